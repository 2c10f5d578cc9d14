"""Writes a table of signals in the formats of MATLAB, ROS, Racelogic and INCA, each with an independent writer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

import h5py
import numpy as np
import polars as pl
import scipy.io
from asammdf import MDF, Signal
from rosbags.rosbag1 import Writer as Rosbag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from oncenter.signals import DEGREE, STANDARD_GRAVITY, SignalName

START_S = datetime(2016, 6, 15, 12, tzinfo=UTC).timestamp()
STEERING = "oncenter_test/msg/Steering"
_STEERING = """std_msgs/Header header
string source
float64 angle
float32 torque
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""
TOPICS = {  # of a bag, as a vehicle file names them
    "steering_wheel_angle": SignalName("/vehicle/steering.angle", "rad"),
    "yaw_rate": SignalName("/imu/data.angular_velocity.z"),
    "lateral_acceleration": SignalName("/imu/data.linear_acceleration.y"),
    "vehicle_speed": SignalName("/vehicle/speed.twist.linear.x"),
}


def mat_5(table: pl.DataFrame, path: Path) -> None:
    """`save('drive.mat', '-struct', 's')`: a variable a column, packed."""
    scipy.io.savemat(path, {name: table[name].to_numpy() for name in table.columns}, do_compression=True)


def mat_4(table: pl.DataFrame, path: Path) -> None:
    scipy.io.savemat(path, {name: table[name].to_numpy() for name in table.columns}, format="4")


def mat_hdf5(table: pl.DataFrame, path: Path) -> None:
    """`save('drive.mat', 's', '-v7.3')`: HDF5 behind 512 bytes, a struct as a group, columns as rows."""
    with h5py.File(path, "w", userblock_size=512) as file:
        struct = file.create_group("s")
        struct.attrs["MATLAB_class"] = np.bytes_("struct")
        for name in table.columns:
            column = struct.create_dataset(name, data=table[name].to_numpy()[None, :], compression="gzip")
            column.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        text = "MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Wed Jun 15 12:00:00 2016 HDF5 schema 1.00 ."
        file.write(text.encode().ljust(116) + bytes(8) + b"\x00\x02IM")


def simulink(table: pl.DataFrame, path: Path) -> None:
    """A scope's "Structure with time", each signal as the column of a matrix would be."""
    columns = [name for name in table.columns if name != "time_s"]
    signals = np.array(
        [(table[name].to_numpy()[:, None], name, 1.0) for name in columns],
        dtype=[("values", object), ("label", object), ("dimensions", object)],
    )
    scipy.io.savemat(path, {"ScopeData": {"time": table["time_s"].to_numpy()[:, None], "signals": signals}})


def inca(table: pl.DataFrame, path: Path) -> None:
    """MDF 3.30 under INCA's suffix."""
    time = table["time_s"].to_numpy()
    units = {"angle_rad": "rad", "rate_rad_s": "rad/s", "speed_m_s": "m/s", "acceleration_m_s2": "m/s²"}
    with MDF(version="3.30") as mdf:
        unit_of = {name: next(units[end] for end in units if name.endswith(end)) for name in table.columns[1:]}
        mdf.append([Signal(table[name].to_numpy(), time, name=name, unit=unit) for name, unit in unit_of.items()])
        mdf.save(path.with_suffix(".mdf"))
    path.with_suffix(".mdf").rename(path)


def vbo(table: pl.DataFrame, path: Path) -> None:
    """A VBOX with Racelogic's IMU, whose yaw rate is positive clockwise, and a steering angle by CAN."""
    time = table["time_s"].to_numpy() + 12 * 3600.0
    stamps = [f"{int(t // 3600):02d}{int(t // 60 % 60):02d}{t % 60:06.3f}" for t in time]
    columns = (
        table["vehicle_speed_m_s"].to_numpy() * 3.6,
        table["steering_wheel_angle_rad"].to_numpy() / DEGREE,
        -table["yaw_rate_rad_s"].to_numpy() / DEGREE,
        table["lateral_acceleration_m_s2"].to_numpy() / STANDARD_GRAVITY,
    )
    rows = (
        f"012 {stamp} +03119.09973000 -00058.49277000 {speed:.9f} 123.45 +00152.58 +000.000 {angle:+.12E} {yaw:+.12E} "
        f"{lateral:+.12E}"
        for stamp, speed, angle, yaw, lateral in zip(stamps, *columns, strict=True)
    )
    head = """File created on 15/06/2016 at 12:00:00

[header]
satellites
time
latitude
longitude
velocity kmh
heading
height
vertical velocity kmh
Steering_Angle
Yaw_Rate
Y_Accel

[channel units]
deg
deg/s
g

[comments]
(c) Racelogic

[column names]
sats time lat long velocity heading height vert-vel Steering_Angle Yaw_Rate Y_Accel

[data]
"""
    path.write_bytes("\r\n".join([*head.splitlines(), *rows, ""]).encode("latin-1"))


def bag(table: pl.DataFrame, path: Path) -> None:
    """Writes a bag of ROS 1."""
    path.unlink(missing_ok=True)  # the writer overwrites none
    with Rosbag1(path) as writer:
        _ros(table, writer, is_first=True)


def mcap(table: pl.DataFrame, path: Path) -> None:
    _of_folder(table, path, StoragePlugin.MCAP)


def db3(table: pl.DataFrame, path: Path) -> None:
    _of_folder(table, path, StoragePlugin.SQLITE3)


def _of_folder(table: pl.DataFrame, path: Path, storage: StoragePlugin) -> None:
    """The one file of the folder that a recorder makes."""
    folder = path.with_name(f"{path.stem}_bag")
    ros_folder(table, folder, storage)
    next(folder.glob(f"*{path.suffix}")).rename(path)
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()


def ros_folder(table: pl.DataFrame, folder: Path, storage: StoragePlugin = StoragePlugin.MCAP) -> None:
    with Rosbag2(folder, version=9, storage_plugin=storage) as writer:
        _ros(table, writer, is_first=False)


def _ros(table: pl.DataFrame, writer: Rosbag1 | Rosbag2, is_first: bool) -> None:
    """The steering's messages are of a type of their own; the speed comes without a header, by the recorder's time."""
    store = get_typestore(Stores.ROS1_NOETIC if is_first else Stores.ROS2_HUMBLE)
    text = _STEERING.replace("builtin_interfaces/Time stamp", "uint32 seq\ntime stamp") if is_first else _STEERING
    own = get_types_from_msg(text, STEERING)
    store.register({name: definition for name, definition in own.items() if name == STEERING})
    of = store.types
    steering, imu, twist = STEERING, "sensor_msgs/msg/Imu", "geometry_msgs/msg/TwistStamped"
    topics = {"/vehicle/steering": steering, "/imu/data": imu, "/vehicle/speed": twist}
    connections = {
        topic: writer.add_connection(topic, kind, typestore=store)  # type: ignore[arg-type]
        for topic, kind in topics.items()
    }

    def send(topic: str, recorded_ns: int, message: object) -> None:
        kind = topics[topic]
        raw = store.serialize_ros1(message, kind) if is_first else store.serialize_cdr(message, kind)
        writer.write(connections[topic], recorded_ns, raw)

    def header(ns: int, frame: str) -> object:
        stamp = of["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9)
        return of["std_msgs/msg/Header"](0, stamp, frame) if is_first else of["std_msgs/msg/Header"](stamp, frame)

    vector, covariance = of["geometry_msgs/msg/Vector3"], np.zeros(9)
    for row in table.iter_rows(named=True):
        ns = round((START_S + row["time_s"]) * 1e9)
        late = ns + 3_000_000  # the recorder gets them 3 ms later
        send(
            "/vehicle/steering",
            late,
            of[steering](header(ns, "column"), "eps" * (ns % 3), row["steering_wheel_angle_rad"], 1.5),
        )
        turn, push = vector(0.0, 0.0, row["yaw_rate_rad_s"]), vector(0.0, row["lateral_acceleration_m_s2"], 9.8)
        quaternion = of["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
        send(
            "/imu/data",
            late,
            of[imu](header(ns, "imu"), quaternion, covariance, turn, covariance, push, covariance),
        )
        speed = of["geometry_msgs/msg/Twist"](vector(row["vehicle_speed_m_s"], 0.0, 0.0), vector(0.0, 0.0, 0.0))
        send("/vehicle/speed", ns, of[twist](header(0, ""), speed))  # a stamp that was not set


WRITERS: Mapping[str, Callable[[pl.DataFrame, Path], None]] = {
    ".dat": inca,
    ".vbo": vbo,
    ".mat": mat_5,
    ".bag": bag,
    ".mcap": mcap,
    ".db3": db3,
}


def names_for(suffix: str) -> dict[str, SignalName]:
    """The `[signals]` entries of a vehicle file for such a log."""
    return TOPICS if suffix in (".bag", ".mcap", ".db3") else {}
