"""oncenter as a ROS 2 node: what is published is worked out in estimate.py, node.py alone knows ROS."""
