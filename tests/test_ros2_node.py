"""examples/ros2_node: its published values for a simulated drive, and its stored state; tests/ros2 replaces rclpy."""

from __future__ import annotations

import importlib
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import polars as pl
import pytest

import oncenter as oc
from oncenter.signals import Signals

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "ros2_node"
STAND_IN = ROOT / "tests" / "ros2"
RATE_HZ = 50.0
TRUCK = oc.vehicle("scania_r730_4x2")
NEEDED = ("steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2")


@dataclass(frozen=True)
class Ros:
    """The modules of the example and of the ROS replacement."""

    estimate: Any
    node: Any
    rclpy: Any
    executors: Any
    rclpy_node: Any


@pytest.fixture(scope="module")
def ros() -> Iterator[Ros]:
    """Gone afterwards."""
    before = set(sys.modules)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(EXAMPLE))
        patch.syspath_prepend(str(STAND_IN))
        names = ("oncenter_node.estimate", "oncenter_node.node", "rclpy", "rclpy.executors", "rclpy.node")
        yield Ros(*map(importlib.import_module, names))
        for name in set(sys.modules) - before:
            if name.split(".")[0] in ("rclpy", "std_msgs", "rosidl_runtime_py", "oncenter_node"):
                del sys.modules[name]


@pytest.fixture(scope="module")
def drive() -> Signals:
    """Six minutes at 50 Hz."""
    signals, _ = oc.simulate("country", seed=4)
    return Signals(signals.table.gather_every(2).head(18_000), signals.sources, RATE_HZ, signals.log)


def driven(estimate: Any, table: pl.DataFrame) -> Any:
    """The last published values, if all signals arrive 1 ms before each tick."""
    published = None
    for time, *values in table.select("time_s", *NEEDED).iter_rows():
        for name, value in zip(NEEDED, values, strict=True):
            estimate.receive(name, value, time - 0.001)
        published = estimate.tick(time)
    return published


def monitored(table: pl.DataFrame, monitor: oc.Monitor | None = None) -> Any:
    monitor = monitor or oc.Monitor(TRUCK, RATE_HZ)
    now = None
    for row in table.select("time_s", *NEEDED).iter_rows(named=True):
        now = monitor.step(oc.Tick(**row))
    return now


def test_the_node_publishes_the_monitor_s_result(ros: Ros, drive: Signals) -> None:
    published = driven(ros.estimate.Estimate(TRUCK, RATE_HZ, None), drive.table)
    now = monitored(drive.table)
    assert published.status == now.offset_status != "unobservable"
    assert published.sensor_fault == now.sensor_fault == "none"
    assert published.offset_rad == now.offset_rad
    assert published.low_rad == now.offset_rad - 1.96 * now.offset_sd_rad < published.offset_rad < published.high_rad


def test_before_an_estimate_exists_numbers_are_nan(ros: Ros) -> None:
    published = ros.estimate.Estimate(TRUCK, RATE_HZ, None).tick(0.0)
    assert published.status == "unobservable"
    assert all(math.isnan(value) for value in (published.offset_rad, published.low_rad, published.high_rad))


def test_a_stale_signal_is_not_available(ros: Ros) -> None:
    estimate = ros.estimate.Estimate(TRUCK, RATE_HZ, None)
    ticks: list[oc.Tick] = []
    step = estimate._monitor.step
    estimate._monitor.step = lambda tick: (ticks.append(tick), step(tick))[1]
    for name in NEEDED:
        estimate.receive(name, 1.0, 10.0)
    estimate.tick(10.4)
    estimate.tick(10.6)
    estimate.tick(9.0)  # a clock that was set back: the value's time is in the future
    assert ticks[0].yaw_rate_rad_s == 1.0 and math.isnan(ticks[0].wheel_speed_rear_left_m_s)
    assert math.isnan(ticks[1].yaw_rate_rad_s) and math.isnan(ticks[2].yaw_rate_rad_s)


def test_the_estimate_is_kept_over_a_restart_of_the_node(ros: Ros, drive: Signals, tmp_path: Path) -> None:
    image = tmp_path / "oncenter.image"
    first = ros.estimate.Estimate(TRUCK, RATE_HZ, image)
    assert "estimation starts from zero" in first.note
    published = driven(first, drive.table)
    first.save()
    second = ros.estimate.Estimate(TRUCK, RATE_HZ, image)
    assert second.note == f"continues from {image}"
    assert second.tick(drive.table["time_s"][-1] + 3600.0).offset_rad == pytest.approx(published.offset_rad, abs=1e-3)
    assert list(tmp_path.iterdir()) == [image]


def test_an_image_of_another_truck_is_rejected_with_a_note(ros: Ros, tmp_path: Path) -> None:
    image = tmp_path / "oncenter.image"
    ros.estimate.Estimate(TRUCK, RATE_HZ, image).save()
    other = ros.estimate.Estimate(oc.vehicle("rigid_8x4"), RATE_HZ, image)
    assert "another vehicle" in other.note


def parameters(image: Path) -> dict[str, Any]:
    """The parameters of config/truck.yaml, with the angle in degrees, to the right."""
    given: dict[str, Any] = {"rate_hz": RATE_HZ, "image": str(image)}
    for name in NEEDED:
        given[f"{name}.topic"] = f"/truck/{name}"
    return given | {"steering_wheel_angle_rad.factor": -math.pi / 180.0}


def test_the_node_receives_its_topics_and_publishes_its_own(
    ros: Ros, drive: Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    image = tmp_path / "oncenter.image"
    monkeypatch.setattr(ros.rclpy_node.Node, "given", parameters(image))
    nodes: list[Any] = []

    def driving(node: Any) -> None:
        nodes.append(node)
        tick = next(callback for callback, period in node.timers.items() if period == 1.0 / RATE_HZ)
        for time, *values in drive.table.select("time_s", *NEEDED).iter_rows():
            node.clock.nanoseconds = round(time * 1e9)
            for name, value in zip(NEEDED, values, strict=True):
                ((message, callback),) = node.callbacks[f"/truck/{name}"]
                callback(message(data=-math.degrees(value) if name == NEEDED[0] else value))
            tick()
        raise ros.executors.ExternalShutdownException

    monkeypatch.setattr(ros.rclpy, "spun", [driving])
    ros.node.main()
    (node,) = nodes
    published = {topic: publisher.published[-1].data for topic, publisher in node.publishers_by_topic.items()}
    now = monitored(drive.table)
    assert published["~/status"] == now.offset_status
    assert published["~/sensor_fault"] == "none"
    assert published["~/offset"] == pytest.approx(now.offset_rad, abs=1e-4)
    assert published["~/offset_low"] < published["~/offset"] < published["~/offset_high"]
    assert all(len(publisher.published) == drive.table.height for publisher in node.publishers_by_topic.values())
    assert image.exists()


def test_a_full_disk_does_not_end_the_node(ros: Ros, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros.rclpy_node.Node, "given", {"image": str(tmp_path / "nowhere" / "oncenter.image")})
    node = ros.node.OncenterNode()
    node.save()
    assert "cannot save the estimate" in node.logger.lines[-1]


@pytest.mark.slow
def test_the_node_s_types_fit_rclpy_s_signatures() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-incremental", "oncenter_node"],
        cwd=EXAMPLE,
        env={"MYPYPATH": f"{STAND_IN}:{ROOT / 'src'}", "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout


def test_the_parameter_file_names_the_needed_signals_as_the_node_calls_them(ros: Ros) -> None:
    given = re.findall(
        r"^    (\w+):(?: #.*)?$", (EXAMPLE / "config" / "truck.yaml").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert set(given) == set(NEEDED) <= set(ros.estimate.SIGNALS)


def test_package_and_project_have_one_version() -> None:
    version = ET.parse(EXAMPLE / "package.xml").findtext("version")
    assert version == oc.__version__
    assert f'version="{version}"' in (EXAMPLE / "setup.py").read_text(encoding="utf-8")
