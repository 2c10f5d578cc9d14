"""oncenter as a ROS 2 node: estimate.py computes the published values, only node.py depends on ROS."""
