"""A node whose clock, subscriptions and timers a test holds in its hand."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

from rclpy.qos import QoSProfile


@dataclass
class Parameter:
    value: Any


@dataclass
class Publisher:
    published: list[Any] = field(default_factory=list)

    def publish(self, msg: Any) -> None:
        self.published.append(msg)


@dataclass
class Time:
    nanoseconds: int


@dataclass
class Clock:
    nanoseconds: int = 0

    def now(self) -> Time:
        return Time(self.nanoseconds)


@dataclass
class Logger:
    lines: list[str] = field(default_factory=list)

    def info(self, message: str) -> None:
        self.lines.append(message)

    error = info


class Node:
    given: ClassVar[dict[str, Any]] = {}  # parameters by name, as a file gives them

    def __init__(self, node_name: str) -> None:
        self.name = node_name
        self.clock, self.logger = Clock(), Logger()
        self.callbacks: dict[str, list[tuple[Any, Callable[[Any], None]]]] = {}
        self.publishers_by_topic: dict[str, Publisher] = {}
        self.timers: dict[Callable[[], None], float] = {}

    def declare_parameter(self, name: str, value: Any) -> Parameter:
        return Parameter(self.given.get(name, value))

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[[Any], None], qos_profile: int | QoSProfile
    ) -> None:
        self.callbacks.setdefault(topic, []).append((msg_type, callback))

    def create_publisher(self, msg_type: Any, topic: str, qos_profile: int | QoSProfile) -> Publisher:
        return self.publishers_by_topic.setdefault(topic, Publisher())

    def create_timer(self, timer_period_sec: float, callback: Callable[[], None]) -> None:
        self.timers[callback] = timer_period_sec

    def get_clock(self) -> Clock:
        return self.clock

    def get_logger(self) -> Logger:
        return self.logger

    def destroy_node(self) -> None: ...
