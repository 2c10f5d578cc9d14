"""Each format, written by its own library from the same frames, reads back to the same signals."""

from __future__ import annotations

import gzip
import math
import re
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path

import can
import numpy as np
import polars as pl
import pytest
from can.io.mf4 import MF4Writer
from drive_frames import DBC, START_S, Frame, candump, drive, truth
from real_data import real_drive

from oncenter.errors import OncenterError
from oncenter.read import read, require
from oncenter.signals import DEGREE, SignalName, Signals

WRITERS = {
    ".asc": can.ASCWriter,
    ".blf": can.BLFWriter,
    ".trc": can.TRCWriter,
    ".log": can.CanutilsLogWriter,
    ".mf4": MF4Writer,
}
QUANTUM = {
    "steering_wheel_angle_rad": 1 / 1024,
    "yaw_rate_rad_s": 1 / 8192,
    "vehicle_speed_m_s": 1 / 256 / 3.6,
    "lateral_acceleration_m_s2": 1 / 2048,
}
# The error of linear interpolation of a sine is h^2/8 times its second derivative: for the speed at 10 Hz.
SAG = {"vehicle_speed_m_s": 0.1**2 / 8 * 2.0 * 0.3**2}


def written(folder: Path, suffix: str, frames: Sequence[Frame] | None = None) -> Path:
    path = folder / f"drive{suffix}"
    with WRITERS[suffix](path) as writer:
        for frame in drive() if frames is None else frames:
            writer.on_message_received(
                can.Message(
                    timestamp=frame.time,
                    arbitration_id=frame.identifier,
                    is_extended_id=frame.extended,
                    data=frame.data,
                    channel=1,
                )
            )
    return path


def assert_is_the_drive(signals: Signals, quanta: float = 0.51) -> None:
    since = signals.table["time_s"].to_numpy() - signals.table["time_s"][0]
    assert signals.rate_hz == 100.0
    assert len(since) == pytest.approx(400, abs=1)
    for column, exact in truth(since).items():
        error = np.abs(signals.table[column].to_numpy() - exact)
        allowed = quanta * QUANTUM[column] + SAG.get(column, 0.0)
        assert np.nanmax(error) < allowed, column
        # The speed's first sample is 1 ms late, its last 99 ms early: there is no value beyond them.
        assert np.isnan(error).sum() <= (11 if column == "vehicle_speed_m_s" else 0), column


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_log_written_by_its_own_library_reads_back_to_the_drive(tmp_path: Path, suffix: str) -> None:
    signals = read(written(tmp_path, suffix))
    # python-can's writers round stamps: asc and trc to 0.1 ms
    assert_is_the_drive(signals, quanta=0.7)
    assert signals.sources["yaw_rate"].description == "VDC2 from 0x3E"
    assert signals.sources["vehicle_speed"].description == "CCVS1 from 0x00"


def test_a_text_log_keeps_the_time_of_day(tmp_path: Path) -> None:
    for suffix in (".log", ".blf", ".mf4"):
        assert read(written(tmp_path, suffix)).table["time_s"][0] == pytest.approx(START_S, abs=2e-3), suffix


def test_both_candump_styles_give_the_same_drive(tmp_path: Path) -> None:
    log, console = tmp_path / "a.log", tmp_path / "b.log"
    log.write_text(candump(drive()))
    console.write_text(
        "".join(
            f" ({frame.time:.6f})  can0  {frame.identifier:0{8 if frame.extended else 3}X}   [{len(frame.data)}]  "
            f"{frame.data.hex(' ').upper()}\n"
            for frame in drive()
        )
    )
    assert_is_the_drive(read(log))
    assert read(console).table.equals(read(log).table)

    dated = tmp_path / "c.log"
    dated.write_text(
        re.sub(r"\((17\S+?)\)", lambda m: f"({datetime.fromtimestamp(float(m[1]), UTC):%F %T.%f})", console.read_text())
    )
    assert_is_the_drive(read(dated))


def test_candump_of_any_bus_name_line_end_and_direction_reads_the_same(tmp_path: Path) -> None:
    log, other = tmp_path / "a.log", tmp_path / "b.log"
    log.write_text(candump(drive()))
    other.write_bytes(candump(drive(), "vcan_front12").lower().replace("\n", " R\r\n").encode())
    assert read(other).table.equals(read(log).table)


def test_remote_error_and_fd_frames_are_skipped(tmp_path: Path) -> None:
    log = tmp_path / "a.log"
    others = "(1700000000.000100) can0 123#R\n(1700000000.000200) can0 20000004#0000000000000000\n"
    others += "(1700000000.000250) can0 38F0093E#2E8820857D577D7D\n"
    others += "(1700000000.000300) can0 18F0093E##1697D7F637D577F7D00112233\n\n"
    log.write_text(others + candump(drive()))
    signals = read(log)
    assert_is_the_drive(signals)
    assert signals.notes == (
        "left out 2 error frames in a.log",
        "left out 1 remote frame in a.log",
        "left out 1 CAN FD frame of more than 8 bytes, which no database describes, in a.log",
    )


def test_a_log_cut_off_in_its_last_line_is_read_with_a_note(tmp_path: Path) -> None:
    log = tmp_path / "a.log"
    log.write_text(candump(drive())[:-20])
    signals = read(log)
    assert_is_the_drive(signals)
    assert any("cut off" in note for note in signals.notes)


def test_channels_decoded_by_asammdf_with_the_shipped_dbc_equal_the_frames(tmp_path: Path) -> None:
    from asammdf import MDF

    raw, decoded = written(tmp_path, ".mf4"), tmp_path / "decoded.mf4"
    with MDF(raw) as mdf:
        mdf.extract_bus_logging({"CAN": [(str(DBC), 0)]}).save(decoded)
    signals = read(decoded)
    assert_is_the_drive(signals, quanta=0.7)
    assert signals.sources["yaw_rate"].description.startswith("channel YawRate (VDC2")


def test_channels_of_several_rates_keep_their_time_and_unit(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    path = tmp_path / "rasters.mf4"
    fast, slow = np.arange(400) / 100, np.arange(40) / 10
    with MDF() as mdf:
        angle = truth(fast)["steering_wheel_angle_rad"] / DEGREE
        mdf.append([Signal(-angle, fast, name="SWA", unit="°")])
        mdf.append([Signal(truth(fast)["yaw_rate_rad_s"] / DEGREE, fast, name="yaw_rate", unit="deg/s")])
        mdf.append([Signal(truth(slow)["vehicle_speed_m_s"] * 3.6, slow, name="vehicle_speed_km_h")])
        mdf.save(path)
    names = {"steering_wheel_angle": SignalName("SWA", sign=-1)}
    table = read(path, names=names).table
    since = table["time_s"].to_numpy() - table["time_s"][0]
    exact = truth(since)
    for column in ("steering_wheel_angle_rad", "yaw_rate_rad_s"):
        assert np.allclose(table[column], exact[column], atol=1e-6, rtol=0)
    speed = table["vehicle_speed_m_s"].to_numpy()
    assert np.nanmax(np.abs(speed - exact["vehicle_speed_m_s"])) < SAG["vehicle_speed_m_s"] + 1e-6


def table_of_the_drive() -> pl.DataFrame:
    time = np.arange(400) / 100
    return pl.DataFrame({"time_s": time, **truth(time)})


def test_csv_and_parquet_are_read_to_the_last_bit(tmp_path: Path) -> None:
    table = table_of_the_drive()
    table.write_csv(tmp_path / "drive.csv")
    (tmp_path / "drive.csv.gz").write_bytes(gzip.compress((tmp_path / "drive.csv").read_bytes()))
    table.write_parquet(tmp_path / "drive.parquet")
    for name in ("drive.csv", "drive.csv.gz", "drive.parquet"):
        signals = read(tmp_path / name)
        assert signals.table.select(table.columns).equals(table), name
        assert signals.rate_hz == 100.0


def test_every_documented_unit_is_converted_to_si(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(
        "time_s,steering_wheel_angle_deg,yaw_rate_deg_s,vehicle_speed_km_h,lateral_acceleration_g,"
        "wheel_speed_rear_left_rad_s,note\n" + "".join(f"{k / 50},180,90,36,1,10,text {k}\n" for k in range(10))
    )
    signals = read(path)
    row = signals.table.row(3, named=True)
    assert row["steering_wheel_angle_rad"] == pytest.approx(math.pi)
    assert row["yaw_rate_rad_s"] == pytest.approx(math.pi / 2)
    assert row["vehicle_speed_m_s"] == pytest.approx(10)
    assert row["lateral_acceleration_m_s2"] == pytest.approx(9.80665)
    assert row["wheel_speed_rear_left_m_s"] == pytest.approx(5)
    assert any("nominal wheel radius" in note for note in signals.notes)


@pytest.mark.parametrize("unit", ["deg/s", "°/s", "deg_s", None])
def test_a_signals_table_names_columns_units_and_signs(tmp_path: Path, unit: str | None) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("ms;gyro_deg_s\n" + "".join(f"{10 * k};{'' if k == 5 else '1,5'}\n" for k in range(20)))
    names = {"time": SignalName("ms", "ms"), "yaw_rate": SignalName("gyro_deg_s", unit, -1)}
    table = read(path, names=names).table
    assert table["time_s"][1] == pytest.approx(0.01)
    assert table["yaw_rate_rad_s"][0] == pytest.approx(-1.5 * DEGREE)
    assert math.isnan(table["yaw_rate_rad_s"][5])
    assert table.null_count().sum_horizontal()[0] == 0


def test_a_signals_table_for_another_log_does_not_affect_standard_names(tmp_path: Path) -> None:
    table_of_the_drive().write_parquet(tmp_path / "drive.parquet")
    names = {"time": SignalName("ms", "ms"), "yaw_rate": SignalName("gyro", "deg/s", -1)}
    signals = read(tmp_path / "drive.parquet", names=names)
    assert signals.table.select(table_of_the_drive().columns).equals(table_of_the_drive())


def test_light_formats_load_no_heavy_library(tmp_path: Path) -> None:
    (tmp_path / "drive.log").write_text(candump(drive()))
    table_of_the_drive().write_csv(tmp_path / "drive.csv")
    table_of_the_drive().write_parquet(tmp_path / "drive.parquet")
    written(tmp_path, ".blf")
    code = (
        "import sys; from oncenter.read import read\n"
        f"for s in ('log', 'blf', 'csv', 'parquet'): read({str(tmp_path)!r} + '/drive.' + s)\n"
        "print([m for m in ('can', 'cantools', 'asammdf', 'pandas', 'bokeh', 'matplotlib') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_progress_rises_from_zero_to_one(tmp_path: Path) -> None:
    shares: list[float] = []
    read(written(tmp_path, ".blf"), progress=shares.append)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    assert shares == sorted(shares)


GENESIS = {
    "time": SignalName("t_s", "s"),
    "steering_wheel_angle": SignalName("swa_deg", "deg"),
    "yaw_rate": SignalName("yaw_rate_dps", "deg/s"),
    "vehicle_speed": SignalName("speed_ref_mps", "m/s"),
    "lateral_acceleration": SignalName("lat_accel_mps2", "m/s^2"),
}


def test_a_log_of_a_real_car_is_read_with_its_units(tmp_path: Path) -> None:
    path = real_drive("genesis/cpg_fast_lap.csv.gz")
    signals = read(path, names=GENESIS)
    raw = pl.read_csv(path)
    assert signals.rate_hz == 100.0
    assert signals.table.height == pytest.approx(raw.height, rel=0.01)
    for column, name, factor in (
        ("steering_wheel_angle_rad", "swa_deg", DEGREE),
        ("yaw_rate_rad_s", "yaw_rate_dps", DEGREE),
        ("vehicle_speed_m_s", "speed_ref_mps", 1.0),
    ):
        at_ticks = np.interp(signals.table["time_s"], raw["t_s"], raw[name]) * factor
        assert np.nanmax(np.abs(signals.table[column].to_numpy() - at_ticks)) < 1e-9


def test_a_real_car_logged_by_topic_gives_one_topic_a_file() -> None:
    names = {"time": SignalName("t_s", "s")} | {
        f"wheel_speed_{place}": SignalName(f"ws_{short}", "m/s")
        for place, short in (
            ("front_left", "fl"),
            ("front_right", "fr"),
            ("rear_left", "rl"),
            ("rear_right", "rr"),
        )
    }
    wheels = read(real_drive("genesis_raw_multirate/wheel_speeds.csv.gz"), names=names)
    assert wheels.rate_hz == 50.0
    assert set(wheels.sources) == set(names) - {"time"}
    imu = read(
        real_drive("genesis_raw_multirate/vehicle_imu.csv.gz"),
        names={"time": SignalName("t_s", "s"), "yaw_rate": SignalName("yaw_rate", "deg/s")},
    )
    assert imu.rate_hz == pytest.approx(100, rel=0.01)


def test_a_real_truck_without_steering_angle_gives_missing_and_found_signals() -> None:
    signals = read(real_drive("j1939_truck_stationary/truck_stationary.mf4"))
    assert signals.sources["vehicle_speed"].description == "CCVS1 from 0x00"
    assert signals.table["vehicle_speed_m_s"].drop_nans().max() == 0.0
    with pytest.raises(OncenterError) as refused:
        require(signals, ["steering_wheel_angle", "yaw_rate", "vehicle_speed"])
    said = str(refused.value)
    assert "steering wheel angle (PGN 61449 VDC2, SPN 1807)" in said
    assert "truck_stationary.mf4; found: vehicle_speed from CCVS1 from 0x00" in said
    assert refused.value.code == "missing_signal"
    assert refused.value.exit_code == 1
    assert refused.value.needs == ("steering_wheel_angle", "yaw_rate")


def asc(*, relative: bool = False, decimal: bool = False, named: bool = False, written: str = "ID = {}x") -> str:
    """The drive as written by Vector tools, with an event line now and then."""
    lines = [
        "date Wed May 1 12:00:00.000 pm 2024",
        f"base {'dec' if decimal else 'hex'}  timestamps {'relative' if relative else 'absolute'}",
        "internal events logged",
        "// version 9.0.0",
        "Begin Triggerblock Wed May 1 12:00:00.000 pm 2024",
        "   0.000000 Start of measurement",
    ]
    last = 0.0

    def stamp(time: float) -> str:
        nonlocal last
        shown, last = time - last if relative else time, time
        return f"   {shown:.6f}"

    for k, frame in enumerate(drive()):
        if not frame.extended:
            continue
        number = f"{frame.identifier:d}" if decimal else f"{frame.identifier:X}"
        data = " ".join(f"{byte:d}" if decimal else f"{byte:02X}" for byte in frame.data)
        name = "VDC2" if named and frame.identifier == 0x18F0093E else number + "x"
        since = frame.time - START_S
        tail = f"Length = 0 BitCount = 138 {written.format(frame.identifier)}"
        lines.append(f"{stamp(since)} 1  {name}  Rx   d {len(frame.data)} {data}  {tail}")
        if k % 20 == 0:
            lines.append(f"{stamp(since + 1e-4)} 1  ErrorFrame")
            lines.append(f"{stamp(since + 2e-4)} CAN 1 Status:chip status error active")
            lines.append(f"{stamp(since + 3e-4)} 1  123  Rx   r")
    return "\n".join([*lines, "End TriggerBlock"]) + "\n"


@pytest.mark.parametrize(
    "way", [{}, {"relative": True}, {"decimal": True}, {"named": True}, {"named": True, "decimal": True}]
)
def test_an_asc_log_may_be_relative_decimal_or_name_its_messages(way: dict[str, bool], tmp_path: Path) -> None:
    (tmp_path / "drive.asc").write_text(asc(**way))
    assert_is_the_drive(read(tmp_path / "drive.asc"), quanta=0.7)


def test_an_asc_log_with_message_names_instead_of_identifiers_is_refused(tmp_path: Path) -> None:
    (tmp_path / "drive.asc").write_text(asc(named=True, written=""))
    with pytest.raises(OncenterError, match=r"has message names .'VDC2'. instead of identifiers") as refused:
        read(tmp_path / "drive.asc")
    assert refused.value.code == "unreadable_log"


def trc(version: str) -> str:
    head = [f";$FILEVERSION={version}", ";$STARTTIME=45413.5"]
    head += [";$COLUMNS=N,O,T,B,I,d,R,L,D"] if version == "2.1" else []
    head += [";$COLUMNS=N,O,T,I,d,l,D"] if version == "2.0" else []
    lines = []
    for k, frame in enumerate(drive(), 1):
        ms, size, data = 1000 * (frame.time - START_S), len(frame.data), frame.data.hex(" ").upper()
        number = f"{frame.identifier:0{8 if frame.extended else 4}X}"
        lines.append(
            {
                "1.1": f"{k:6d}) {ms:11.1f}  Rx     {number}  {size}  {data}",
                "1.3": f"{k:6d}) {ms:11.1f} 1  Rx    {number} -  {size}    {data}",
                "2.0": f"{k:6d} {ms:13.3f} DT {number} Rx {size}  {data}",
                "2.1": f"{k:6d} {ms:13.3f} DT 1 {number} Rx -  {size}    {data}",
            }[version]
        )
        if k % 50 == 0 and version == "2.1":
            lines += [f"{k} {ms:.3f} ST 1 - Rx - 4    00 00 00 08", f"{k} {ms:.3f} RR 1 0123 Rx -  8"]
        if k % 50 == 0 and version == "1.1":
            lines += [f"{k}) {ms:.1f}  Warng  FFFFFFFF  4  00 00 00 08  BUSHEAVY", f"{k}) {ms:.1f}  Rx  0123  8  RTR"]
    return "\n".join(head + lines) + "\n"


@pytest.mark.parametrize("version", ["1.1", "1.3", "2.0", "2.1"])
def test_trc_of_each_version_is_the_drive(version: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "drive.trc").write_text(trc(version))
    # python-can's writers round stamps: asc and trc to 0.1 ms
    assert_is_the_drive(read(tmp_path / "drive.trc"), quanta=0.7)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("suffix", "text"), [(".asc", asc()), (".trc", trc("1.1")), (".trc", trc("2.1"))])
@pytest.mark.parametrize("less", [18, 30, 55, 75])
def test_a_text_log_that_is_cut_off_is_read_with_a_note(
    suffix: str, text: str, less: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"drive{suffix}"
    path.write_text(text.removesuffix("End TriggerBlock\n")[:-less])
    signals = read(path)
    assert any("last line of" in note and "cut off" in note for note in signals.notes)
    assert signals.table.height > 390
    assert capfd.readouterr() == ("", "")


def test_a_line_that_python_can_leaves_out_gives_a_note_and_no_terminal_output(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    lines = trc("1.1").splitlines()
    (tmp_path / "drive.trc").write_text("\n".join([*lines[:50], "51)   0.5  Rx", *lines[50:]]) + "\n")
    signals = read(tmp_path / "drive.trc")
    assert_is_the_drive(signals, quanta=0.7)
    assert [note for note in signals.notes if "1 line of drive.trc" in note]
    assert caplog.records == []


@pytest.mark.parametrize("suffix", [".blf", ".mf4"])
def test_error_remote_and_fd_frames_of_binary_logs_are_skipped(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"drive{suffix}"
    with WRITERS[suffix](path) as writer:
        for k, frame in enumerate(drive()):
            about = {"timestamp": frame.time, "arbitration_id": frame.identifier, "is_extended_id": frame.extended}
            late = about | {"timestamp": frame.time + 0.003}
            writer.on_message_received(can.Message(**about, data=frame.data, channel=1))
            if k % 20 == 0:
                writer.on_message_received(can.Message(timestamp=frame.time, is_error_frame=True, channel=1))
                writer.on_message_received(can.Message(**about, is_remote_frame=True, dlc=8, channel=1))
                writer.on_message_received(can.Message(**late, is_fd=True, data=bytes(12), channel=1))
    assert_is_the_drive(read(path))


def test_an_unclosed_blf_log_is_read_with_a_note(tmp_path: Path) -> None:
    content = bytearray(written(tmp_path, ".blf").read_bytes())
    content[16:24] = bytes(8)  # its size, which the logger writes last
    (tmp_path / "open.blf").write_bytes(content)
    signals = read(tmp_path / "open.blf")
    assert_is_the_drive(signals)
    assert any("logger did not close" in note for note in signals.notes)


def test_candump_with_error_details_and_a_byte_order_mark_reads_the_same(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_text(candump(drive()))
    error = " (1700000000.000100)  can0  20000080   [8]  00 00 00 00 00 00 00 00   ERRORFRAME\n"
    details = "\tcontroller-problem{rx-overflow}\n\tbus-error\n\terror-counter-tx-rx{{0}{127}}\n"
    (tmp_path / "b.log").write_text("\ufeff" + candump(drive()) + 20 * (error + details))
    signals = read(tmp_path / "b.log")
    assert signals.table.equals(read(tmp_path / "a.log").table)
    assert signals.notes == ("left out 20 error frames in b.log",)


def test_channels_of_mdf_3_read_like_those_of_mdf_4(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    time = np.arange(400) / 100
    for version, name in (("3.30", "old.mdf"), ("4.10", "new.mf4")):
        with MDF(version=version) as mdf:
            for column, unit in (("steering_wheel_angle", "rad"), ("yaw_rate", "rad/s"), ("vehicle_speed", "m/s")):
                values = next(v for k, v in truth(time).items() if k.startswith(column))
                mdf.append([Signal(values, time, name=column, unit=unit)])
            mdf.save(tmp_path / name)
    old, new = (read(tmp_path / name).table for name in ("old.mdf", "new.mf4"))
    assert old.drop("time_s").equals(new.drop("time_s"))


def test_a_channel_in_two_groups_can_be_selected_as_the_error_suggests(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    time, path = np.arange(400) / 100, tmp_path / "drive.mf4"
    with MDF() as mdf:
        mdf.append([Signal(np.zeros(400), time, name="yaw_rate", unit="rad/s")])
        mdf.append([Signal(np.ones(40), time[::10], name="yaw_rate", unit="rad/s")])
        mdf.save(path)
    with pytest.raises(OncenterError, match=r'--source "yaw_rate=channel yaw_rate .group 0.') as refused:
        read(path)
    assert refused.value.code == "sources_disagree"
    assert (read(path, take={"yaw_rate": "channel yaw_rate (group 1)"}).table["yaw_rate_rad_s"] == 1.0).any()


def test_a_channel_with_lost_data_has_no_valid_sample(tmp_path: Path) -> None:
    """A damaged type of its data block loses them."""
    from asammdf import MDF, Signal

    path, time = tmp_path / "drive.mf4", np.arange(0.0, 30.0, 0.01)
    with MDF(version="4.10") as mdf:
        mdf.append([Signal(0.1 * np.sin(time), time, unit="rad", name="steering_wheel_angle")])
        mdf.append([Signal(np.sin(time), time, unit="rad/s", name="yaw_rate")])
        mdf.append([Signal(20.0 + np.sin(time), time, unit="m/s", name="vehicle_speed")])
        mdf.save(path)
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"##DT", b"##DX", 1))
    signals = read(path)
    assert set(signals.sources) == {"yaw_rate", "vehicle_speed"}
    assert signals.notes == ("steering_wheel_angle: no valid sample in channel steering_wheel_angle",)
    path.write_bytes(whole.replace(b"##DT", b"##DX"))
    with pytest.raises(OncenterError, match=r"all samples in drive\.mf4 are .not available."):
        read(path)


def test_a_measurement_file_of_foreign_channels_lists_them(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF() as mdf:
        mdf.append([Signal(np.zeros(40), np.arange(40) / 10, name="WheelAng", unit="deg")])
        mdf.append([Signal(np.zeros(40), np.arange(40) / 10, name="yaw_rate")])
        mdf.save(tmp_path / "drive.mf4")
    with pytest.raises(OncenterError, match="its channels are 'WheelAng', 'yaw_rate'") as refused:
        read(tmp_path / "drive.mf4")
    assert "yaw_rate left out: it has unit '', expected rad_s or deg_s" in str(refused.value)
    assert refused.value.code == "missing_signal"


def test_measurement_files_read_in_parallel_do_not_lose_program_output(tmp_path: Path) -> None:
    """asammdf's output is suppressed on the streams, which are global to the process."""
    path = written(tmp_path, ".mf4")
    before = sys.stdout, sys.stderr
    with ThreadPoolExecutor(3) as pool:
        heights = [signals.table.height for signals in pool.map(read, [path] * 18)]
    assert (sys.stdout, sys.stderr) == before
    assert len(set(heights)) == 1
