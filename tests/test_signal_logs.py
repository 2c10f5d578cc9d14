"""MATLAB, ROS, Racelogic and INCA: a saved drive is read by each command, and an unreadable one gives one line."""

from __future__ import annotations

import json
import re
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import polars as pl
import pytest
import scipy.io
import signal_logs
from asammdf import MDF, Signal
from drive_frames import truth
from planted_faults import drive
from rosbags.rosbag2 import StoragePlugin

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.files.log_formats import SUFFIXES
from oncenter.fleet import run as fleet_run
from oncenter.read import read, require
from oncenter.read.here import read_here
from oncenter.signals import DEGREE, SignalName
from oncenter.vehicle import vehicle

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

COLUMNS = ("steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2")
VEHICLE = """wheelbase_m = 3.7
steering_ratio = 19.3
track_width_rear_m = 1.83

"""
WRITERS: dict[str, Callable[[pl.DataFrame, Path], None]] = {
    **{f"drive{suffix}": writer for suffix, writer in signal_logs.WRITERS.items()},
    "version_4.mat": signal_logs.mat_4,
    "version_73.mat": signal_logs.mat_hdf5,
    "scope.mat": signal_logs.simulink,
    "mcap_folder": signal_logs.ros_folder,
    "db3_folder": lambda table, folder: signal_logs.ros_folder(table, folder, StoragePlugin.SQLITE3),
}


def short() -> pl.DataFrame:
    t = np.arange(400) / 100
    return pl.DataFrame({"time_s": t, **truth(t)})


def names_of(log: Path) -> dict[str, SignalName]:
    return signal_logs.names_for(log.suffix or ".bag")


def refusal(log: Path, names: dict[str, SignalName] | None = None) -> OncenterError:
    with pytest.raises(OncenterError) as refused:
        read(log, names=names)
    said = str(refused.value)
    assert "\n" not in said and (log.name in said or said.startswith("[signals] "))
    return refused.value


def mat(folder: Path, **variables: object) -> Path:
    scipy.io.savemat(folder / "x.mat", variables)
    return folder / "x.mat"


# ---------------------------------------------------------------------------------------------------------------------
# Round trip
# ---------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WRITERS)
def test_a_saved_drive_is_read_back_unchanged(name: str, tmp_path: Path) -> None:
    table, log = short(), tmp_path / name
    WRITERS[name](table, log)
    signals = read(log, names=names_of(log))
    assert (signals.rate_hz, signals.table.height) == (100.0, 400)
    since = signals.table["time_s"].to_numpy() - signals.table["time_s"][0]
    for column in COLUMNS:
        exact = np.interp(since, table["time_s"], table[column])
        assert np.abs(signals.table[column].to_numpy() - exact).max() < 1e-6, column


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], dict[str, object]]:
    """The answer as JSON for a saved drive of five minutes."""
    folder = tmp_path_factory.mktemp("drives")
    table = drive().table.select("time_s", *COLUMNS)

    @cache
    def answer(name: str) -> dict[str, object]:
        log = folder / name
        table.write_csv(log) if name.endswith(".csv") else WRITERS[name](table, log)
        truck = folder / f"{name}.toml"
        entries = (
            f'{signal} = {{ name = "{entry.name}"' + (f', unit = "{entry.unit}" }}' if entry.unit else " }")
            for signal, entry in names_of(log).items()
        )
        truck.write_text(VEHICLE + ("" if name.endswith(".csv") else "[signals]\n" + "\n".join(entries)))
        file = vehicle(truck)
        given: dict[str, object] = json.loads(oc.offset(read(log, names=file.signal_names), file).to_json())
        return given

    return answer


NUMBERS = ("offset", "understeer_gradient", "backlash", "yaw_rate_bias", "lateral_acceleration_bias", "time")


@pytest.mark.parametrize("name", WRITERS)
def test_the_offset_equals_that_of_the_same_drive_as_csv(
    name: str, answers: Callable[[str], dict[str, object]]
) -> None:
    by_csv, other = answers("drive.csv"), answers(name)
    for number in NUMBERS:
        assert same(by_csv[number], other[number]), (number, by_csv[number], other[number])


def same(one: object, other: object) -> bool:
    """Tolerance for numbers stored as text or beside a date."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and isinstance(other, int | float):
        return abs(one - other) <= 2e-3 * max(1.0, abs(one))
    return one == other


# ---------------------------------------------------------------------------------------------------------------------
# MATLAB
# ---------------------------------------------------------------------------------------------------------------------

T = np.arange(400) / 100
SWA = np.sin(T)


def test_a_value_in_a_struct_is_called_by_its_struct_and_field(tmp_path: Path) -> None:
    log = mat(tmp_path, log={"t": T, "steer": {"pinion": -SWA}, "yaw_rate_deg_s": SWA, "mass": 18000.0})
    names = {"time": SignalName("log.t", "s"), "steering_wheel_angle": SignalName("log.steer.pinion", "deg", -1)}
    signals = read(log, names=names)
    assert signals.sources["steering_wheel_angle"].description == "variable pinion (log.steer)"
    assert np.allclose(signals.table["steering_wheel_angle_rad"], SWA * DEGREE, atol=1e-12)
    assert np.allclose(signals.table["yaw_rate_rad_s"], SWA * DEGREE, atol=1e-12)


def test_structs_have_their_own_time_and_a_timeseries_its_unit(tmp_path: Path) -> None:
    series = {"Time": T[::5], "Data": (60 + T[::5]).reshape(1, 1, -1), "DataInfo": {"Units": "km/h"}}
    log = mat(tmp_path, time_s=T, steering_wheel_angle_rad=SWA, vehicle_speed=series)
    signals = read(log)
    assert signals.sources["vehicle_speed"].rate_hz == pytest.approx(20.0)
    assert signals.table["vehicle_speed_m_s"][200] == pytest.approx(62 / 3.6)


def test_columns_and_rows_of_a_matrix_have_matlab_names(tmp_path: Path) -> None:
    names = {"time": SignalName("m(:,1)", "s"), "yaw_rate": SignalName("m(:,3)", "rad/s")}
    by_columns = read(mat(tmp_path, m=np.column_stack((T, SWA, 2 * SWA))), names=names)
    assert np.allclose(by_columns.table["yaw_rate_rad_s"], 2 * SWA)
    names = {"time": SignalName("m(1,:)", "s"), "yaw_rate": SignalName("m(3,:)", "rad/s")}
    assert np.allclose(
        read(mat(tmp_path, m=np.vstack((T, SWA, 2 * SWA))), names=names).table["yaw_rate_rad_s"], 2 * SWA
    )


def test_a_struct_array_is_named_by_its_index_in_either_version(tmp_path: Path) -> None:
    names = {"yaw_rate": SignalName("runs(2).r", "rad/s")}
    runs = np.array([(T, SWA), (T, 2 * SWA)], dtype=[("time_s", object), ("r", object)])
    assert np.allclose(read(mat(tmp_path, runs=runs), names=names).table["yaw_rate_rad_s"], 2 * SWA)
    with h5py.File(tmp_path / "new.mat", "w") as file:
        kept = {}
        for name, values in (("time_s", (T, T)), ("r", (SWA, 2 * SWA))):
            kept[name] = [file.create_dataset(f"#refs#/{name}{k}", data=each[None, :]) for k, each in enumerate(values)]
        group = file.create_group("runs")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, each in kept.items():
            group.create_dataset(name, data=np.array([[one.ref] for one in each], h5py.ref_dtype))
    assert np.allclose(read(tmp_path / "new.mat", names=names).table["yaw_rate_rad_s"], 2 * SWA)


def test_values_with_an_invalid_stamp_are_left_out(tmp_path: Path) -> None:
    holed = np.where(np.arange(400) == 7, np.nan, T)
    broken = np.where(np.arange(400) == 9, np.inf, SWA)
    table = read(mat(tmp_path, time_s=holed, yaw_rate_rad_s=broken)).table
    assert np.isfinite(table["yaw_rate_rad_s"].to_numpy()).sum() >= 397


def test_a_missing_variable_gives_the_most_similar_name(tmp_path: Path) -> None:
    log = mat(tmp_path, time_s=T, log={"YawRt": SWA}, yaw_rate_bias_deg_s=SWA)
    said = str(refusal(log, {"yaw_rate": SignalName("log.YawRate", "deg/s")}))
    assert "[signals] names variable 'log.YawRate', which does not exist; did you mean log.YawRt" in said
    assert "'log.YawRt'" in said.split("its variables are")[1]


@pytest.mark.parametrize(
    ("variables", "names"),
    [
        ({"t_eps_s": T, "eps_angle": SWA, "t_esp_s": T[::2] + 0.002, "esp_rate": SWA[::2]}, {}),  # by names
        ({"time_1_s": T, "angle_1": SWA, "time_2_s": T[::2] + 0.002, "rate_2": SWA[::2]}, {}),  # by numbers
        ({"time_s": T, "angle": SWA, "t_slow_s": T[::2] + 0.002, "rate": SWA[::2]}, {}),  # by lengths
        ({"time": T, "angle": SWA, "other": T[::2] + 0.002, "rate": SWA[::2]}, {"time": "other", "time_unit": "s"}),
        ({"DGM0_timestamps": T, "DG0_angle": SWA, "DGM1_timestamps": T[::2] + 0.002, "DG1_rate": SWA[::2]}, {}),
        ({"angle": np.column_stack((T, SWA)), "rate": np.column_stack((T[::2] + 0.002, SWA[::2]))}, {}),  # Vector's
    ],
)
def test_each_group_of_vectors_has_its_time(
    variables: dict[str, object], names: dict[str, str], tmp_path: Path
) -> None:
    angle, rate = (
        next(name for name in variables if name.endswith(end) or end in name.split("_")) for end in ("angle", "rate")
    )
    entries = {"steering_wheel_angle": SignalName(angle, "rad"), "yaw_rate": SignalName(rate, "rad_s", **names)}
    if names:
        entries["time"] = SignalName("time", "s")
    signals = read(mat(tmp_path, **variables), names=entries)
    assert signals.sources["steering_wheel_angle"].rate_hz == pytest.approx(100.0)
    assert signals.sources["yaw_rate"].rate_hz == pytest.approx(50.0)
    time, found = signals.columns["time_s"], signals.columns["yaw_rate_rad_s"]
    known = np.isfinite(found)
    assert np.allclose(found[known], np.interp(time[known] - 0.002, T, SWA), atol=1e-3)


def test_asammdf_s_export_to_mat_is_the_drive_with_its_own_names(tmp_path: Path) -> None:
    with MDF() as mdf:
        mdf.append([Signal(SWA, T, name="steering_wheel_angle_rad")])
        mdf.append([Signal(SWA[::2], T[::2], name="yaw_rate_rad_s")])
        mdf.export("mat", tmp_path / "x.mat", oned_as="column")
    table = read(tmp_path / "x.mat").columns
    assert np.allclose(table["steering_wheel_angle_rad"], SWA)
    by_alias = {"yaw_rate": SignalName("DG1_yaw_rate_rad_s", "rad_s", sign=-1)}
    assert np.allclose(read(tmp_path / "x.mat", names=by_alias).columns["yaw_rate_rad_s"][:100:2], -SWA[:100:2])


@pytest.mark.parametrize(
    ("variables", "names", "says"),
    [
        ({"yaw_rate_deg_s": SWA}, {}, "no time column 'time_s'"),
        ({"t": T, "yaw_rate_deg_s": SWA}, {"time": SignalName("t")}, "[signals] time: 't' has no unit"),
        ({"time": T, "yaw_rate_deg_s": SWA}, {}, "column time of x.mat has no unit"),
        ({"time_s": T, "yaw_rate_deg_s": SWA[:300]}, {}, "yaw_rate_deg_s has 300 values, but time_s has 400"),
        ({"time_s": T, "r": SWA}, {"yaw_rate": SignalName("r")}, "[signals] yaw_rate: 'r' has no unit"),
        ({"text": "only"}, {}, "no time column 'time_s'"),
        ({}, {}, "x.mat has no variables"),
    ],
)
def test_missing_content_of_a_mat_file_is_one_line(
    variables: dict[str, object], names: dict[str, SignalName], says: str, tmp_path: Path
) -> None:
    assert says in str(refusal(mat(tmp_path, **variables), names)).replace("drive", "x")


def opaque(name: str, kind: str) -> bytes:
    """An element of version 5 as MATLAB writes an object: its class, and where its content is."""

    def element(number: int, content: bytes) -> bytes:
        return struct.pack("<II", number, len(content)) + content + bytes(-len(content) % 8)

    numbers = element(1, b"") + element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
    matrix = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 6, 1)) + numbers
    texts = b"".join(element(1, text.encode()) for text in (name, "MCOS", kind))
    return element(14, element(6, struct.pack("<II", 17, 0)) + texts + element(14, matrix))


def test_objects_that_only_matlab_reads_are_named_with_a_way_to_save_them(tmp_path: Path) -> None:
    log = mat(tmp_path)
    log.write_bytes(log.read_bytes() + opaque("tt", "timetable"))
    error = refusal(log)
    assert error.code == "matlab_object"
    assert "(timetable)" in str(error) and "save('drive.mat', '-struct', 's')" in str(error)
    with h5py.File(tmp_path / "new.mat", "w") as file:
        file["tt"] = np.arange(6, dtype=np.uint32)
        file["tt"].attrs["MATLAB_class"] = np.bytes_("timetable")
        file["tt"].attrs["MATLAB_object_decode"] = np.int32(3)
    assert "(timetable)" in str(refusal(tmp_path / "new.mat"))
    with h5py.File(tmp_path / "new.mat", "a") as file:
        file["time_s"], file["yaw_rate_deg_s"] = T[None, :], SWA[None, :]
    assert any("timetable" in note for note in read(tmp_path / "new.mat").notes)


def test_nothing_outside_a_file_is_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "other.mat", "w") as file:
        file["secret"] = SWA[None, :]
    (tmp_path / "raw").write_bytes(SWA.tobytes())
    layout = h5py.VirtualLayout((1, 400), np.float64)
    layout[:] = h5py.VirtualSource(str(tmp_path / "other.mat"), "secret", (1, 400))
    with h5py.File(tmp_path / "x.mat", "w") as file:
        file["time_s"] = T[None, :]
        file["steering_wheel_angle_deg"] = h5py.ExternalLink(str(tmp_path / "other.mat"), "/secret")
        file.create_virtual_dataset("yaw_rate_deg_s", layout)
        file.create_dataset("vehicle_speed_km_h", (1, 400), np.float64, external=[(str(tmp_path / "raw"), 0, 3200)])
        file["itself"] = file["/"]  # a group that holds itself
    said = str(refusal(tmp_path / "x.mat"))
    assert "too many nested structs" in said
    with h5py.File(tmp_path / "x.mat", "a") as file:
        del file["itself"]
        file["lateral_acceleration_m_s2"] = SWA[None, :]
    assert list(read(tmp_path / "x.mat").sources) == ["lateral_acceleration"]


# ---------------------------------------------------------------------------------------------------------------------
# ROS
# ---------------------------------------------------------------------------------------------------------------------


def test_a_note_gives_the_clock_of_each_topic(tmp_path: Path) -> None:
    signal_logs.bag(short(), tmp_path / "x.bag")
    signals = read(tmp_path / "x.bag", names=signal_logs.TOPICS)
    note = "time used: header.stamp for /vehicle/steering, /imu/data; time of recording for /vehicle/speed"
    assert note in signals.notes
    assert signals.table["time_s"][0] == signal_logs.START_S  # the headers', and not the recorder's 3 ms later


def test_a_missing_field_gives_the_most_similar_name_and_the_list(tmp_path: Path) -> None:
    log = tmp_path / "x.mcap"
    signal_logs.mcap(short(), log)
    wrong = {"steering_wheel_angle": SignalName("/vehicle/steering.angel", "rad")}
    said = str(refusal(log, wrong))
    assert (
        "[signals] names field '/vehicle/steering.angel', which does not exist; did you mean /vehicle/steering.angle"
        in said
    )
    assert "'/vehicle/steering.torque'" in said.split("its fields are")[1]
    others = {**signal_logs.TOPICS, **wrong}
    with pytest.raises(OncenterError, match=r"did you mean /vehicle/steering\.angle"):
        require(read(log, names=others), ["steering_wheel_angle"])


def test_a_bag_without_definitions_uses_the_types_of_ros_and_names_missing_ones(tmp_path: Path) -> None:
    """ROS 2 Humble and older record such bags to SQLite."""
    import sqlite3

    log = tmp_path / "x.db3"
    signal_logs.db3(short(), log)
    with sqlite3.connect(log) as database:
        database.execute("DROP TABLE message_definitions")
        database.execute("UPDATE schema SET schema_version = 3")
        database.execute("ALTER TABLE topics DROP COLUMN type_description_hash")
    database.close()
    signals = read(log, names=signal_logs.TOPICS)
    assert set(signals.sources) == {"yaw_rate", "lateral_acceleration", "vehicle_speed"}
    assert any(f"has no definition of {signal_logs.STEERING}" in note for note in signals.notes)


def test_elements_of_sequences_are_named_by_their_index(tmp_path: Path) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    kind, of = "sensor_msgs/msg/JointState", store.types
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joints", kind, typestore=store)
        for tick, value in enumerate(SWA):
            ns = tick * 10_000_000
            stamp = of["builtin_interfaces/msg/Time"](0, ns)
            header = of["std_msgs/msg/Header"](stamp, "x" * (tick % 9))  # what comes after is aligned
            angles = np.array([0.0, value][: 1 + (tick != 5)])
            message = of[kind](header, ["wheel", "column"][: len(angles)], angles, np.empty(0), np.empty(0))
            writer.write(connection, ns, store.serialize_cdr(message, kind))
    names = {"steering_wheel_angle": SignalName("/joints.position[1]", "rad")}
    given = read(tmp_path / "bag", names=names)
    assert np.allclose(given.table["steering_wheel_angle_rad"].to_numpy()[6:], SWA[6:])
    assert given.sources["steering_wheel_angle"].not_available == 1


def _strings(folder: Path, change: Callable[[bytes], bytes] = bytes, **options: object) -> tuple[Path, np.ndarray]:
    """A bag of ROS 1 whose messages have texts of 40 lengths before their number."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    kind, of = "diagnostic_msgs/msg/KeyValue", store.types
    own = get_types_from_msg("string name\nfloat64 angle\n", "own/msg/Named")
    store.register(own)
    values = np.sin(np.arange(400) / 50)
    path = folder / "x.bag"
    path.unlink(missing_ok=True)
    writer = Writer(path)
    if options:
        writer.set_compression(**options)
    with writer:
        first = writer.add_connection("/angle", "own/msg/Named", typestore=store)
        other = writer.add_connection("/text", kind, typestore=store)
        for tick, value in enumerate(values):
            ns = tick * 10_000_000
            named = store.types["own/msg/Named"]("x" * (tick * 7 % 40), value)
            writer.write(first, ns, bytes(store.serialize_ros1(named, "own/msg/Named")))
            writer.write(other, ns, bytes(store.serialize_ros1(of[kind]("a", "b" * (tick % 5)), kind)))
    path.write_bytes(change(path.read_bytes()))
    return path, values


@pytest.mark.parametrize("compression", [None, "bz2", "lz4"])
def test_messages_with_texts_of_many_lengths_are_read_in_chunks(compression: str | None, tmp_path: Path) -> None:
    from rosbags.rosbag1 import Writer

    options = {} if compression is None else {"fmt": Writer.CompressionFormat[compression.upper()]}
    path, values = _strings(tmp_path, **options)
    found = read(path, names={"steering_wheel_angle": SignalName("/angle.angle", "rad")})
    assert np.allclose(found.columns["steering_wheel_angle_rad"], values)


def test_an_index_that_points_to_a_connection_leads_to_its_message_and_one_to_nothing_is_damage(tmp_path: Path) -> None:
    names = {"steering_wheel_angle": SignalName("/angle.angle", "rad")}

    def before(content: bytes) -> bytes:
        """The first message's entry in the index of /angle points to the connection at the begin of the chunk."""
        index = content.index(b"count=", content.index(b"op=\x04")) + 10
        return content[: index + 12] + bytes(4) + content[index + 16 :]

    path, values = _strings(tmp_path, before)
    assert np.allclose(read(path, names=names).columns["steering_wheel_angle_rad"], values)
    path, _ = _strings(tmp_path, lambda content: before(content)[:-1] + b"x")
    content = path.read_bytes()
    index = content.index(b"count=", content.index(b"op=\x04")) + 10
    for offset in (b"\xff\xff\xff\x7f", b"\x05\0\0\0"):
        path.write_bytes(content[: index + 12] + offset + content[index + 16 :])
        assert refusal(path, names).code == "unreadable_log"


def test_a_message_of_either_byte_order_is_decoded_as_rosbags_does_and_a_short_one_is_left_out() -> None:
    from rosbags.typesys import Stores, get_typestore

    from oncenter.read.ros_messages import Layout, NotDecoded

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind, of = "nav_msgs/msg/Odometry", store.types
    vector, point = of["geometry_msgs/msg/Vector3"], of["geometry_msgs/msg/Point"]
    pose = of["geometry_msgs/msg/Pose"](point(1.0, 2.0, 3.0), of["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0))
    twist = of["geometry_msgs/msg/Twist"](vector(4.0, 5.0, 6.0), vector(7.0, 8.0, 9.0))
    header = of["std_msgs/msg/Header"](of["builtin_interfaces/msg/Time"](11, 12), "odd")
    message = of[kind](
        header,
        "child",
        of["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
        of["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)),
    )
    layout = Layout(kind, store.fielddefs, aligned=True)
    decode = layout.decoder(["twist.twist.angular.z", "pose.pose.position.y", "header.stamp.nanosec"])
    for is_little in (True, False):
        raw = bytes(store.serialize_cdr(message, kind, little_endian=is_little))
        assert decode(raw) == [9.0, 2.0, 12.0]
        with pytest.raises(NotDecoded, match="shorter"):
            decode(raw[:400])
    assert [each.unit for each in layout.fields if each.path == "twist.twist.angular.z"] == ["rad/s"]


ENDLESS = {  # types that contain themselves, grow without limit, or have no size
    "a/msg/A": ([], [("a", ("NAME", "a/msg/A"))]),
    "b/msg/B0": ([], [(f"x{k}", ("NAME", "b/msg/B1")) for k in range(16)]),
    **{f"b/msg/B{n}": ([], [(f"x{k}", ("NAME", f"b/msg/B{n + 1}")) for k in range(16)]) for n in range(1, 6)},
    "b/msg/B6": ([], [("x", ("BASE", ("float64", 0)))]),
    "c/msg/C": ([], [("x", ("ARRAY", (("BASE", ("float64", 0)), -4)))]),
}


@pytest.mark.parametrize("kind", ["a/msg/A", "b/msg/B0", "c/msg/C"])
def test_endless_types_are_refused_at_once(kind: str) -> None:
    from rosbags.interfaces import Nodetype

    from oncenter.read.ros_messages import Layout, NotDecoded

    def described(given: object) -> object:
        return (
            (Nodetype[given[0]], tuple(map(described, given[1])) if given[0] == "ARRAY" else given[1])
            if isinstance(given, tuple) and given and given[0] in Nodetype.__members__
            else given
        )

    types = {name: (consts, [(n, described(d)) for n, d in fields]) for name, (consts, fields) in ENDLESS.items()}
    began = time.monotonic()
    with pytest.raises(NotDecoded):
        Layout(kind, types, aligned=True)  # type: ignore[arg-type]
    assert time.monotonic() - began < 2.0


def test_compressed_files_are_refused_with_the_command_to_unpack_them(tmp_path: Path) -> None:
    signal_logs.ros_folder(short(), tmp_path / "bag")
    (part,) = (tmp_path / "bag").glob("*.mcap")
    part.rename(f"{part}.zstd")
    assert f"zstd -d {part.name}.zstd" in str(refusal(tmp_path / "bag"))


def test_an_unclosed_bag_is_refused_with_the_command_to_repair_it(tmp_path: Path) -> None:
    signal_logs.mcap(short(), tmp_path / "x.mcap")
    content = (tmp_path / "x.mcap").read_bytes()
    (tmp_path / "x.mcap").write_bytes(content[: len(content) // 2])
    assert "mcap recover" in str(refusal(tmp_path / "x.mcap"))


# ---------------------------------------------------------------------------------------------------------------------
# VBOX
# ---------------------------------------------------------------------------------------------------------------------


def vbo(folder: Path, change: Callable[[str], str] = str) -> Path:
    signal_logs.vbo(short(), folder / "x.vbo")
    text = (folder / "x.vbo").read_bytes().decode("latin-1")
    changed = change(text)
    assert changed != text or change is str
    (folder / "x.vbo").write_bytes(changed.encode("latin-1"))
    return folder / "x.vbo"


def test_minutes_become_degrees_and_west_is_negative(tmp_path: Path) -> None:
    table = read(vbo(tmp_path)).table
    assert table["latitude_deg"][0] == pytest.approx(3119.09973 / 60)
    assert table["longitude_deg"][0] == pytest.approx(58.49277 / 60)  # -58 minutes to the west
    assert table["course_deg"][0] == pytest.approx(123.45)
    assert table["time_s"][0] == signal_logs.START_S


def test_a_unit_is_that_of_the_channel_and_the_last_unit_is_that_of_the_last_channel(tmp_path: Path) -> None:
    in_rad = read(vbo(tmp_path, lambda text: text.replace("deg/s\r\n", "rad/s\r\n"))).table["yaw_rate_rad_s"]
    assert in_rad.max() == pytest.approx(0.05 / DEGREE, rel=1e-3)
    without = read(vbo(tmp_path, lambda text: text.replace("deg\r\ndeg/s\r\ng\r\n", "deg/s\r\ng\r\n")))
    assert without.table["yaw_rate_rad_s"].max() == pytest.approx(0.05, rel=1e-3)
    wrong = read(vbo(tmp_path, lambda text: text.replace("deg\r\ndeg/s\r\ng\r\n", "g\r\ndeg\r\n")))
    assert any("2 [channel units]" in note for note in wrong.notes)
    assert wrong.table["yaw_rate_rad_s"].max() == pytest.approx(0.05, rel=1e-3)
    odd = read(vbo(tmp_path, lambda text: text.replace("deg\r\ndeg/s", "percent\r\ndeg/s")))
    assert "steering_wheel_angle" not in odd.sources and any("unit 'percent'" in note for note in odd.notes)


@pytest.mark.parametrize(("unit", "per"), [("knots", 1.852), ("mph", 1.609344), ("m/s", 3.6)])
def test_the_speed_has_the_unit_of_the_header(unit: str, per: float, tmp_path: Path) -> None:
    speed = read(vbo(tmp_path, lambda text: text.replace("\nvelocity kmh", f"\nvelocity {unit}"))).table[
        "vehicle_speed_m_s"
    ]
    assert speed[0] == pytest.approx(15.0 * per)


def test_a_speed_without_a_unit_is_left_out_with_a_note(tmp_path: Path) -> None:
    signals = read(vbo(tmp_path, lambda text: text.replace("\nvelocity kmh", "\nvelocity")))
    with pytest.raises(OncenterError, match=r"the \[header\] of x.vbo has no unit of velocity"):
        require(signals, ["vehicle_speed"])


def test_the_signals_table_takes_precedence_over_standard_channels(tmp_path: Path) -> None:
    log = vbo(tmp_path, lambda text: text.replace("Steering_Angle", "EPS_Pinion"))
    names = {"steering_wheel_angle": SignalName("EPS_Pinion", sign=-1), "yaw_rate": SignalName("Yaw_Rate", "deg/s")}
    table, plain = read(log, names=names).table, short()
    assert np.allclose(table["steering_wheel_angle_rad"], -plain["steering_wheel_angle_rad"], atol=1e-6)
    assert np.allclose(table["yaw_rate_rad_s"], -plain["yaw_rate_rad_s"], atol=1e-6)


def test_lateral_acceleration_from_gnss_is_used_with_a_note(tmp_path: Path) -> None:
    signals = read(vbo(tmp_path, lambda text: text.replace("Y_Accel", "Latacc")))
    assert any("does not contain the road bank" in note for note in signals.notes)
    assert signals.sources["lateral_acceleration"].rate_hz == 100.0


def test_time_continues_past_midnight(tmp_path: Path) -> None:
    def late(text: str) -> str:
        return text.replace(" 12000", " 23595").replace(" 120001", " 000000").replace(" 120002", " 000001")

    signals = read(vbo(tmp_path, lambda text: late(text.replace(" 120003.", " 000002."))))
    assert np.all(np.diff(signals.table["time_s"]) > 0)


def test_cut_rows_are_left_out_with_a_note(tmp_path: Path) -> None:
    cut = read(vbo(tmp_path, lambda text: text[:-9]))
    assert any("last line" in note for note in cut.notes) and cut.table.height == 399
    holed = read(vbo(tmp_path, lambda text: text.replace("123.45 +00152.58", "123.45", 1)))
    assert any("1 row of x.vbo" in note for note in holed.notes)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda text: text.split("[data]")[0], "has no [data]"),
        (lambda text: text.split("[data]")[0] + "[data]\r\n", "x.vbo has no rows"),
        (lambda text: text.replace("[column names]", "[names]").replace("[header]", "[h]"), "has no [column names]"),
        (lambda text: text.replace("sats time", "sats when"), "no column 'time'"),
        (lambda text: text.replace("Y_Accel\r\n\r\n[data]", "Yaw_Rate\r\n\r\n[data]"), "two columns"),
        (lambda text: text.replace(" 120001.000 ", " 126101.000 "), "row 101 of x.vbo: '126101.0' is not a time"),
        (lambda text: text.replace(" 123.45 ", " 12E.45 ", 1), "'12E.45' is not a number"),
    ],
)
def test_missing_content_of_a_vbo_file_is_one_line(change: Callable[[str], str], says: str, tmp_path: Path) -> None:
    assert says in str(refusal(vbo(tmp_path, change)))


# ---------------------------------------------------------------------------------------------------------------------
# Verbs
# ---------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in WRITERS if name.startswith(("drive", "mcap"))])
def test_the_signals_command_lists_the_content_of_each_format(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    WRITERS[name](short(), tmp_path / name)
    truck = tmp_path / "truck.toml"
    entries = (
        f'{key} = {{ name = "{entry.name}", unit = "{entry.unit or ""}" }}'
        for key, entry in names_of(tmp_path / name).items()
    )
    truck.write_text(VEHICLE + "[signals]\n" + "\n".join(entries).replace(', unit = ""', ""))
    assert run(["signals", str(tmp_path / name), "--vehicle", str(truck), "--json"]) == 0
    assert {"steering_wheel_angle", "yaw_rate", "vehicle_speed"} <= set(json.loads(capsys.readouterr().out)["signals"])


@pytest.mark.slow
def test_a_folder_and_a_fleet_read_these_formats(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs, trucks = tmp_path / "logs" / "truck", tmp_path / "trucks"
    logs.mkdir(parents=True)
    trucks.mkdir()
    (trucks / "truck.toml").write_text(VEHICLE)
    table = drive().table.select("time_s", *COLUMNS)
    for name in ("drive.mat", "drive.vbo", "drive.dat"):
        WRITERS[name](table, logs / name)
    assert run(["offset", str(logs), "--vehicle", str(trucks / "truck.toml"), "--json", "--each"]) == 0
    answers = json.loads(capsys.readouterr().out)
    assert [Path(each["log"]).name for each in answers["answers"]] == ["drive.dat", "drive.mat", "drive.vbo"]
    assert fleet_run([str(tmp_path / "logs")], trucks, tmp_path / "out").logs_answered == 3
    rows = pl.read_parquet(tmp_path / "out" / "drives.parquet")
    assert rows["error"].null_count() == 3 and rows["offset_deg"].null_count() == 0


def test_a_bag_folder_is_one_log_of_a_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    signal_logs.ros_folder(short(), tmp_path / "bag")
    assert run(["offset", str(tmp_path / "bag"), "--vehicle", "scania_r730_4x2", "--json"]) == 1
    assert "no signal recognised in bag" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "module", "extra"),
    [
        ("drive.mat", "scipy", "mat"),
        ("version_73.mat", "h5py", "mat"),
        *((f"drive.{suffix}", "rosbags", "ros") for suffix in ("bag", "mcap", "db3")),
    ],
)
def test_an_extra_that_is_not_installed_is_named(
    name: str, module: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    WRITERS[name](short(), tmp_path / name)
    for loaded in [each for each in sys.modules if each.partition(".")[0] == module]:
        monkeypatch.delitem(sys.modules, loaded)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(OncenterError) as refused:
        read_here(tmp_path / name, {}, (), {}, lambda fraction: None)
    needs = f"{name} needs {module}, which is not installed: pip install 'oncenter[{extra}]'"
    assert (str(refused.value), refused.value.code, refused.value.exit_code) == (needs, "missing_extra", 1)


def test_light_formats_load_none_of_these_libraries(tmp_path: Path) -> None:
    short().write_csv(tmp_path / "drive.csv")
    code = (
        f"import sys; from oncenter.read.here import read_here; from pathlib import Path\n"
        f"read_here(Path({str(tmp_path / 'drive.csv')!r}), {{}}, (), {{}}, lambda fraction: None)\n"
        "print([m for m in ('scipy', 'h5py', 'rosbags') if m in sys.modules])"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )


def test_each_signals_table_of_the_page_about_formats_is_a_vehicle_files(tmp_path: Path) -> None:
    page = (Path(__file__).parents[1] / "docs" / "formats.md").read_text(encoding="utf-8")
    tables = re.findall(r"^```toml\n(.+?)^```", page, re.MULTILINE | re.DOTALL)
    assert len(tables) == 6
    for table in tables:
        (tmp_path / "truck.toml").write_text(VEHICLE + table)
        assert vehicle(tmp_path / "truck.toml").signal_names
    assert all(suffix in page for suffix in SUFFIXES)


# ---------------------------------------------------------------------------------------------------------------------
# Hostile files
# ---------------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_file_that_unpacks_beyond_the_limit_is_stopped(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "x.mat", "w") as file:
        for name in ("time_s", "yaw_rate_deg_s"):
            file.create_dataset(name, (1, 10**12), np.float64, chunks=(1, 10**6), compression="gzip")
    assert refusal(tmp_path / "x.mat").code in ("unreadable_log", "reader_memory", "reader_time")

    def record(kind: int, content: bytes) -> bytes:
        return bytes([kind]) + struct.pack("<Q", len(content)) + content

    def text(given: bytes) -> bytes:
        return struct.pack("<I", len(given)) + given

    magic, size = b"\x89MCAP0\r\n", 1 << 30
    packed = zstd.compress(bytes(size))
    chunk = struct.pack("<QQQI", 0, 1, size, 0) + text(b"zstd") + struct.pack("<Q", len(packed)) + packed
    records = record(1, text(b"ros2") + text(b"")) + record(6, chunk) * 4 + record(2, struct.pack("<QQI", 0, 0, 0))
    (tmp_path / "x.mcap").write_bytes(magic + records + magic)
    assert refusal(tmp_path / "x.mcap").code in ("unreadable_log", "reader_memory", "reader_time")
