"""The ROS 2 node: topics and parameters; see README.md."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import reduce
from pathlib import Path
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rosidl_runtime_py.utilities import get_message
from std_msgs.msg import Float64, String

import oncenter as oc
from oncenter_node.estimate import SIGNALS, Estimate

SAVE_EVERY_S = 60.0  # maximum loss at a power failure


class OncenterNode(Node):
    """Publishes `~/offset`, `~/offset_low`, `~/offset_high`, `~/status` and `~/sensor_fault` once per tick."""

    def __init__(self) -> None:
        super().__init__("oncenter")
        vehicle = oc.vehicle(self._parameter("vehicle", "scania_r730_4x2"))
        rate_hz = self._parameter("rate_hz", 50.0)
        image = self._parameter("image", "")
        self._estimate = Estimate(vehicle, rate_hz, Path(image).expanduser() if image else None)
        self.get_logger().info(f"{vehicle.name}: {self._estimate.note}")
        for signal in SIGNALS:
            self._subscribe(signal)
        self._offset = self.create_publisher(Float64, "~/offset", 10)
        self._low = self.create_publisher(Float64, "~/offset_low", 10)
        self._high = self.create_publisher(Float64, "~/offset_high", 10)
        self._status = self.create_publisher(String, "~/status", 10)
        self._fault = self.create_publisher(String, "~/sensor_fault", 10)
        self.create_timer(1.0 / rate_hz, self._tick)
        self.create_timer(SAVE_EVERY_S, self.save)

    def save(self) -> None:
        """Writes the monitor's image; an error is logged, and the node continues."""
        try:
            self._estimate.save()
        except OSError as error:
            self.get_logger().error(f"cannot save the estimate: {error}")

    def _parameter(self, name: str, default: Any) -> Any:
        return self.declare_parameter(name, default).value

    def _subscribe(self, signal: str) -> None:
        """Subscribes by `SIGNAL.topic`, `.type`, `.field`, `.factor`; a signal without a topic is not available."""
        topic = self._parameter(f"{signal}.topic", "")
        kind = self._parameter(f"{signal}.type", "std_msgs/msg/Float64")
        path = self._parameter(f"{signal}.field", "data").split(".")
        factor = self._parameter(f"{signal}.factor", 1.0)
        if topic:
            receive = self._receiver(signal, path, factor)
            # Best effort receives from reliable and from best-effort publishers.
            self.create_subscription(get_message(kind), topic, receive, qos_profile_sensor_data)

    def _receiver(self, signal: str, path: list[str], factor: float) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            value = float(reduce(getattr, path, message))
            self._estimate.receive(signal, factor * value if math.isfinite(value) else math.nan, self._now_s())

        return receive

    def _now_s(self) -> float:
        return float(self.get_clock().now().nanoseconds) * 1e-9

    def _tick(self) -> None:
        result = self._estimate.tick(self._now_s())
        self._offset.publish(Float64(data=result.offset_rad))
        self._low.publish(Float64(data=result.low_rad))
        self._high.publish(Float64(data=result.high_rad))
        self._status.publish(String(data=result.status))
        self._fault.publish(String(data=result.sensor_fault))


def main(args: list[str] | None = None) -> None:
    """Spins until shutdown, then saves."""
    rclpy.init(args=args)
    node = OncenterNode()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.save()
        node.destroy_node()
        rclpy.try_shutdown()
