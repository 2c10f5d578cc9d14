from setuptools import setup

setup(
    name="oncenter_node",
    version="0.2.0",
    packages=["oncenter_node"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/oncenter_node"]),
        ("share/oncenter_node", ["package.xml"]),
        ("share/oncenter_node/config", ["config/truck.yaml"]),
    ],
    install_requires=["setuptools", "oncenter"],
    entry_points={"console_scripts": ["oncenter = oncenter_node.node:main"]},
)
