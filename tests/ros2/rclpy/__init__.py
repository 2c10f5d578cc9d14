"""As much of rclpy, by its own signatures, as examples/ros2_node uses; a test turns the wheel."""

from collections.abc import Callable

from rclpy.node import Node

spun: list[Callable[[Node], None]] = []  # what happens while a node spins


def init(*, args: list[str] | None = None) -> None: ...


def spin(node: Node) -> None:
    for happens in spun:
        happens(node)


def try_shutdown() -> None: ...
