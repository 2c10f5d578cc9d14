"""Every fault of a log gives one line that names it, and never a wrong value."""

from __future__ import annotations

import gzip
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import can
import numpy as np
import polars as pl
import pytest
from can.io.mf4 import MF4Writer
from drive_frames import START_S, Frame, candump, drive, identifier
from hypothesis import example, given, settings
from hypothesis import strategies as st
from real_data import real_drive

from oncenter.errors import OncenterError
from oncenter.files.log_formats import format_of
from oncenter.read import SUFFIXES, read, require
from oncenter.read.database_file import read_database
from oncenter.signals import Signals

CSV = "time_s,steering_wheel_angle_deg,yaw_rate_deg_s,vehicle_speed_km_h\n" + "".join(
    f"{k / 100},{k % 7},{k % 5},60\n" for k in range(200)
)


def refusal(path: Path, **options: object) -> OncenterError:
    with pytest.raises(OncenterError) as refused:
        read(path, **options)  # type: ignore[arg-type]
    assert "\n" not in str(refused.value)
    return refused.value


def refusal_of(folder: Path, name: str, content: str | bytes) -> OncenterError:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return refusal(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_an_empty_file_is_called_empty(tmp_path: Path, suffix: str) -> None:
    error = refusal_of(tmp_path, f"drive{suffix}", b"")
    assert (error.code, error.exit_code) == ("empty_log", 1)
    assert "empty" in str(error)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_noise_under_any_name_is_refused(tmp_path: Path, suffix: str) -> None:
    noise = np.random.default_rng(3).bytes(20_000)
    error = refusal_of(tmp_path, f"drive{suffix}", noise)
    assert error.exit_code == 1
    assert f"drive{suffix}" in str(error)


def test_stamps_with_an_infinite_step_are_out_of_range(tmp_path: Path) -> None:
    head, first, second = CSV.splitlines(keepends=True)[:3]
    error = refusal_of(tmp_path, "drive.csv", head + "-1e308" + first[first.index(",") :] + "1e308" + second[4:])
    assert error.code == "time_out_of_range"


def test_a_missing_path_and_a_directory_are_refused(tmp_path: Path) -> None:
    assert "No such file" in str(refusal(tmp_path / "drive.log"))
    (tmp_path / "folder.log").mkdir()
    assert "is a directory" in str(refusal(tmp_path / "folder.log"))


def test_a_file_without_read_permission_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "mine.log"
    path.write_text(candump(drive()))

    def forbidden(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied", str(path))  # root, who often runs tests, may read any file

    monkeypatch.setattr(os, "open", forbidden)
    assert str(refusal(path)) == f"cannot read {path}: Permission denied"


def test_an_unknown_suffix_lists_the_known_ones(tmp_path: Path) -> None:
    error = refusal_of(tmp_path, "drive.xlsx", b"x")
    assert error.code == "unknown_format"
    assert all(suffix in str(error) for suffix in SUFFIXES)


@pytest.mark.parametrize("writer", [(".blf", can.BLFWriter), (".mf4", MF4Writer)], ids=str)
@pytest.mark.parametrize("share", [0.05, 0.5, 0.9, 0.999])
def test_a_truncated_binary_log_is_refused(
    tmp_path: Path, writer: tuple[str, type[can.BLFWriter]], share: float, capfd: pytest.CaptureFixture[str]
) -> None:
    suffix, kind = writer
    whole = tmp_path / f"whole{suffix}"
    with kind(whole) as log:
        for frame in drive():
            log.on_message_received(
                can.Message(
                    timestamp=frame.time,
                    arbitration_id=frame.identifier,
                    is_extended_id=frame.extended,
                    data=frame.data,
                    channel=1,
                )
            )
    content = whole.read_bytes()
    error = refusal_of(tmp_path, f"cut{suffix}", content[: int(share * len(content))])
    assert error.code == "unreadable_log"
    assert capfd.readouterr() == ("", "")


def test_an_unclosed_log_of_a_real_truck_is_read_up_to_its_end(tmp_path: Path) -> None:
    """The file was not closed, so a shorter one is a shorter drive; without its header it is unreadable."""
    content = real_drive("j1939_truck_stationary/truck_stationary.mf4").read_bytes()
    (tmp_path / "half.mf4").write_bytes(content[: len(content) // 2])
    half = read(tmp_path / "half.mf4")
    assert any("logger did not close" in note for note in half.notes)
    assert 0.4 < (half.table["time_s"][-1] - half.table["time_s"][0]) / 402 < 0.6
    assert refusal_of(tmp_path, "cut.mf4", content[:30_000]).code == "unreadable_log"


def test_a_measurement_file_whose_data_come_last_is_refused_when_they_are_cut(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    time = np.arange(2000) / 100
    with MDF() as mdf:
        mdf.append([Signal(np.sin(time), time, name="steering_wheel_angle", unit="rad")])
        mdf.save(tmp_path / "whole.mf4")
    content = (tmp_path / "whole.mf4").read_bytes()
    data, group = content.find(b"##DT"), content.find(b"##DG")
    length = int.from_bytes(content[data + 8 : data + 16], "little")
    end = len(content) + -len(content) % 8
    moved = bytearray(content.ljust(end, b"\0") + content[data : data + length])
    moved[group + 40 : group + 48] = end.to_bytes(8, "little")  # the data group's link to its data
    (tmp_path / "moved.mf4").write_bytes(moved)
    assert read(tmp_path / "moved.mf4").table.height == 2000
    assert refusal_of(tmp_path, "cut.mf4", bytes(moved[: end + length // 2])).code == "unreadable_log"


def test_a_damaged_measurement_file_prints_only_one_line(tmp_path: Path) -> None:
    (tmp_path / "cut.mf4").write_bytes(b"MDF     4.10    " + b"\1" * 500)
    code = (
        "from oncenter.read import read\n"
        "from oncenter.errors import OncenterError\n"
        f"try: read({str(tmp_path / 'cut.mf4')!r})\n"
        "except OncenterError as error: print(error)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.count("\n") == 1
    assert run.stderr == ""


@pytest.mark.parametrize("end", ["2.00", "2.", "2.00,3", "2.00,3,1.", '2.00,3,"1,2'])
def test_a_table_cut_in_its_last_line_loses_that_line_with_a_note(tmp_path: Path, end: str) -> None:
    (tmp_path / "drive.csv").write_text(CSV + end)
    cut = read(tmp_path / "drive.csv")
    assert cut.table.height == 200
    assert cut.notes == ("the last line of drive.csv is cut off and was left out; 2.0 s were read",)


@pytest.mark.parametrize("last", ["2.00,3,1,60", "2.00,3,1,", '2.00,3,1,"60"'])
def test_a_last_line_with_all_cells_is_complete_without_a_line_end(tmp_path: Path, last: str) -> None:
    (tmp_path / "drive.csv").write_text(CSV + last)
    whole = read(tmp_path / "drive.csv")
    assert (whole.table.height, whole.notes) == (201, ())


def test_rows_are_complete_if_all_leave_out_their_last_cells(tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(CSV.replace(",60\n", "\n").rstrip())
    whole = read(tmp_path / "drive.csv")
    assert (whole.table.height, len([note for note in whole.notes if "cut off" in note])) == (200, 0)


@pytest.mark.parametrize("share", [0.1, 0.9])
def test_truncated_gzip_and_parquet_are_refused(tmp_path: Path, share: float) -> None:
    packed = gzip.compress(CSV.encode())
    assert refusal_of(tmp_path, "cut.csv.gz", packed[: int(share * len(packed))]).code == "unreadable_log"
    pl.read_csv(CSV.encode()).write_parquet(tmp_path / "whole.parquet")
    table = (tmp_path / "whole.parquet").read_bytes()
    assert refusal_of(tmp_path, "cut.parquet", table[: int(share * len(table))]).code == "unreadable_log"


def test_a_column_without_a_unit_is_refused_with_possible_names(tmp_path: Path) -> None:
    error = refusal_of(tmp_path, "drive.csv", CSV.replace("yaw_rate_deg_s", "yaw_rate"))
    assert error.code == "unit_missing"
    assert error.needs == ("yaw_rate_rad_s", "yaw_rate_deg_s")
    assert "yaw_rate_rad_s or yaw_rate_deg_s" in str(error)


def test_a_column_with_an_unknown_unit_is_named_if_its_signal_is_missing(tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(CSV.replace("yaw_rate_deg_s", "yaw_rate_dps"))
    with pytest.raises(
        OncenterError, match="yaw_rate_dps left out: its unit is unknown, rename it to yaw_rate_rad_s or"
    ):
        require(read(tmp_path / "drive.csv"), ["yaw_rate"])


def test_text_instead_of_a_number_is_named_by_column_and_row(tmp_path: Path) -> None:
    error = refusal_of(tmp_path, "drive.csv", CSV.replace("\n0.03,3,3,", "\n0.03,3,three,"))
    assert error.code == "not_a_number"
    assert "column yaw_rate_deg_s, row 4" in str(error)
    assert "'three'" in str(error)


def test_a_table_without_time_or_with_one_row_is_refused(tmp_path: Path) -> None:
    error = refusal_of(tmp_path, "drive.csv", CSV.replace("time_s", "when"))
    assert (error.code, error.needs) == ("missing_time", ("time_s",))
    assert refusal_of(tmp_path, "one.csv", "\n".join(CSV.splitlines()[:2])).code == "too_short"
    assert refusal_of(tmp_path, "none.csv", CSV.splitlines()[0]).code == "too_short"


def test_a_table_without_signals_lists_its_columns(tmp_path: Path) -> None:
    error = refusal_of(tmp_path, "drive.csv", "time_s,oil_temperature\n0,80\n1,81\n")
    assert error.code == "missing_signal"
    assert "oil_temperature" in str(error)


def test_a_table_whose_time_runs_backward_is_refused(tmp_path: Path) -> None:
    header, *rows = CSV.splitlines()
    error = refusal_of(tmp_path, "drive.csv", "\n".join([header, *reversed(rows)]))
    assert error.code == "time_backward"
    assert "column time_s" in str(error)


def test_a_row_with_more_cells_than_the_header_is_named_by_its_number(tmp_path: Path) -> None:
    error = refusal_of(tmp_path, "drive.csv", CSV.replace("\n0.03,3,3,60\n", '\n"0.03","3,3",3,60,0\n'))
    assert error.code == "unreadable_log"
    assert "row 4 has 5 cells, the header has 4" in str(error)


def test_milliseconds_labelled_as_seconds_are_refused(tmp_path: Path) -> None:
    rows = "".join(f"{1_700_000_000_000 + 10 * k},{k % 5}\n" for k in range(100))
    error = refusal_of(tmp_path, "drive.csv", "time_s,yaw_rate_deg_s\n" + rows)
    assert error.code == "time_out_of_range"
    assert "column time_s" in str(error)


def test_a_log_of_another_protocol_is_refused_as_not_j1939(tmp_path: Path) -> None:
    car = [Frame(START_S + k / 100, 0x123, b"\1\2\3", extended=False) for k in range(50)]
    error = refusal_of(tmp_path, "car.log", candump(car))
    assert error.code == "not_j1939"
    assert "11-bit" in str(error)


def test_a_truck_log_without_the_needed_messages_lists_its_groups(tmp_path: Path) -> None:
    frames = [Frame(START_S + k / 100, identifier(61444, 0), b"\1" * 8) for k in range(50)]
    frames += [Frame(START_S + 1 + k / 100, identifier(65103, 0x0B), b"\1" * 8) for k in range(9)]
    error = refusal_of(tmp_path, "truck.log", candump(frames))
    assert error.code == "missing_signal"
    assert "PGN 61449 VDC2, SPN 1807" in str(error)
    assert "found: PGN 61444 EEC1, 65103 VDC1" in str(error)


@pytest.mark.parametrize("content", ["", "VERSION", "not a database", "BO_ x A: 8 X"])
def test_a_broken_dbc_is_wrong_usage(tmp_path: Path, content: str) -> None:
    (tmp_path / "drive.log").write_text(candump(drive()))
    (tmp_path / "other.dbc").write_text(content)
    error = refusal(tmp_path / "drive.log", dbc=[tmp_path / "other.dbc"])
    assert (error.code, error.exit_code) == ("bad_dbc", 2)
    assert "other.dbc" in str(error)
    assert refusal(tmp_path / "drive.log", dbc=[tmp_path / "none.dbc"]).exit_code == 2


def test_a_pipe_is_refused_as_dbc(tmp_path: Path) -> None:
    (tmp_path / "drive.log").write_text(candump(drive()))
    os.mkfifo(tmp_path / "pipe.dbc")
    for path in (tmp_path / "pipe.dbc", tmp_path):
        error = refusal(tmp_path / "drive.log", dbc=[path])
        assert (error.code, error.exit_code) == ("bad_dbc", 2)


OF_ANGLE = 'BO_ 256 ANGLE: 8 X\n SG_ page M : 0|4@1+ (1,0) [0|15] "" X\n SG_ steering_wheel_angle{} "deg" X\n'


@pytest.mark.parametrize(
    ("layout", "reason"),
    [
        (" : 0|13@1- (1,0) [0|0]", "is a floating-point number of 13 bits"),
        (" : -4|16@1+ (1,0) [0|0]", "begins at bit -4"),
        (" : 0|65@1+ (1,0) [0|0]", "has 65 bits"),
        (" : 56|16@1+ (1,0) [0|0]", "ends after the eighth byte"),
        (" : 0|32@1+ (0,0) [0|0]", "has an unusable scale or offset"),
        (" : 0|32@1+ (1e300,0) [0|0]", "has an unusable scale or offset"),
    ],
)
def test_an_impossible_layout_is_left_out_with_a_note(tmp_path: Path, layout: str, reason: str) -> None:
    log = tmp_path / "drive.log"
    log.write_text(candump(drive()) + candump([Frame(START_S + k / 100, 256, bytes(8), False) for k in range(100)]))
    dbc = OF_ANGLE.format(layout) + "SIG_VALTYPE_ 256 steering_wheel_angle : 1;\n"
    (tmp_path / "other.dbc").write_text('VERSION ""\n' + dbc)
    signals = read(log, dbc=[tmp_path / "other.dbc"])
    assert any(f"steering_wheel_angle: ANGLE.steering_wheel_angle {reason}" in note for note in signals.notes)
    assert signals.sources["steering_wheel_angle"].description.startswith("VDC2")


def test_a_signal_without_a_bit_is_left_out_with_a_note(tmp_path: Path) -> None:
    (tmp_path / "drive.log").write_text(candump(drive()))
    (tmp_path / "other.dbc").write_text('VERSION ""\n' + OF_ANGLE.format(" : 8|0@1+ (1,0) [0|0]"))
    signals = read(tmp_path / "drive.log", dbc=[tmp_path / "other.dbc"])
    assert any("ANGLE.steering_wheel_angle" in note and "length 0" in note for note in signals.notes)


def test_a_multiplexed_signal_that_is_never_sent_is_missing(tmp_path: Path) -> None:
    log = tmp_path / "drive.log"
    log.write_text(candump(drive()) + candump([Frame(START_S + k / 100, 256, bytes(8), False) for k in range(100)]))
    (tmp_path / "other.dbc").write_text('VERSION ""\n' + OF_ANGLE.format(" m3 : 8|16@1- (1,0) [0|0]"))
    signals = read(log, dbc=[tmp_path / "other.dbc"])
    assert signals.sources["steering_wheel_angle"].description.startswith("VDC2")


@pytest.mark.parametrize(
    "absurd",
    [
        OF_ANGLE.format(" : 4294967296|16@1+ (1,0) [0|0]"),
        OF_ANGLE.format(" : // beside\n 8|4294967296@1+ (1,0) [0|0]"),
        OF_ANGLE.format(" : 8|16@1+ (1,0) [0|0]").replace("ANGLE: 8", "ANGLE: 4294967296"),
        OF_ANGLE.format(" m1 : 8|16@1+ (1,0) [0|0]") + "SG_MUL_VAL_ 256 steering_wheel_angle page 0-4294967295;\n",
        OF_ANGLE.format(" : 8|16@1+ (1,0) [0|0]")
        + 'BA_DEF_ SG_ "SPN" INT 0 524287;\nBA_ "SPN" SG_ 256 steering_wheel_angle 1e999999999;\n',
    ],
)
def test_a_statement_for_which_cantools_would_need_all_memory_is_left_out(tmp_path: Path, absurd: str) -> None:
    (tmp_path / "other.dbc").write_text('VERSION ""\n' + absurd + "BO_ 257 OTHER: 8 X\n")
    database = read_database(tmp_path / "other.dbc")
    assert database.messages and len(database.not_read) >= 1


def survives(suffix: str, content: bytes) -> Signals | None:
    """The signals of a file with that content, or None if it is refused as bad input."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"drive{suffix}"
        path.write_bytes(content)
        try:
            signals = read(path)
        except OncenterError as error:
            assert "\n" not in str(error)
            assert error.exit_code == 1
            return None
    assert signals.table.height >= 2
    assert 20.0 <= signals.rate_hz <= 200.0
    assert signals.table.null_count().sum_horizontal()[0] == 0
    return signals


# Begins that pass a reader's first check where the first bytes in the table of formats do not.
DOORS = {
    ".blf": b"LOGG\x90\x00\x00\x00",
    ".mf4": b"MDF     4.10    TGT 15.0" + bytes(4) + (410).to_bytes(2, "little") + bytes(34),
    ".mdf": b"MDF     3.30    TGT 15.0" + bytes(4) + (330).to_bytes(2, "little") + bytes(34),
    ".dat": b"MDF     3.30    TGT 15.0" + bytes(4) + (330).to_bytes(2, "little") + bytes(34),
    ".vbo": b"[header]\nvelocity kmh\n[column names]\nsats time velocity\n[data]\n007 120000.00 +3",
    ".mat": b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + bytes((14, 0, 0, 0, 56, 0, 0, 0)),
    ".bag": b"#ROSBAG V2.0\n" + (69).to_bytes(4, "little"),
    ".mcap": b"\x89MCAP0\r\n\x01" + (12).to_bytes(8, "little") + b"\4\0\0\0ros2\0\0\0\0",
    ".db3": b"SQLite format 3\0\x10\x00\x01\x01\x00\x40\x20\x20",
    ".csv.gz": b"\x1f\x8b\x08",
    ".csv": b"time_s,yaw_rate_deg_s\n",
    ".log": b"(1.000000) can0 18F0093E#",
    ".asc": b"base hex  timestamps relative\n0.1 1 18F0093Ex Rx d 8 ",
    ".trc": b";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n",
}


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(max_examples=30)
@given(door=st.booleans(), content=st.binary(max_size=400))
def test_random_bytes_give_a_refusal_or_a_table(suffix: str, door: bool, content: bytes) -> None:
    row = format_of(suffix)
    assert row is not None
    survives(suffix, DOORS.get(suffix, b"".join(row.begins[:1])) * door + content)


CELL = st.one_of(
    st.floats(allow_nan=True).map(str),
    st.integers(-(10**20), 10**20).map(str),
    st.sampled_from(["", "nan", "inf", "-inf", "1e999", "NA", '"', "a", "1,5", "٣", "\x00", " 7 "]),
)


@given(
    header=st.lists(
        st.sampled_from(
            ["time_s", "steering_wheel_angle_deg", "yaw_rate", "yaw_rate_rad_s", "heading_deg", "x", "", '"q"']
        ),
        min_size=1,
        max_size=5,
    ),
    rows=st.lists(st.lists(CELL, min_size=1, max_size=5), max_size=12),
    separator=st.sampled_from([",", ";", "\t"]),
)
@example(["time_s", "yaw_rate_rad_s"], [["0", "1"], ["1e300", "2"]], ",")
@example(["time_s", "yaw_rate_rad_s"], [["0", "1"], ["1e-310", "2"]], ",")
@example(["time_s", "yaw_rate_rad_s"], [["-1e308", "1"], ["1e308", "2"], ["1.1e308", "2"]], ",")
def test_random_tables_give_a_refusal_or_a_table(header: list[str], rows: list[list[str]], separator: str) -> None:
    survives(".csv", "\n".join(separator.join(row) for row in [header, *rows]).encode())


LINE = st.one_of(
    st.text(max_size=30),
    st.builds(
        lambda t, bus, i, d: f"({t}) {bus} {i}#{d}",
        st.one_of(
            st.floats(0, 1e12, allow_nan=False).map("{:.6f}".format),
            st.sampled_from(["", ".", "1.", ".000001", "99999999999999999.000000", "1.5", "12.3456789"]),
        ),
        st.sampled_from(["can0", "c", "a_long_name_of_a_bus", ""]),
        st.sampled_from(["18F0093E", "18FEF100", "123", "7FF", "FFFFFFFF", "1234", ""]),
        st.sampled_from(["697D7F637D577F7D", "69", "697", "R", "", "697D7F637D577F7D00", "#1AA", "zz"]),
    ),
)


@pytest.mark.slow
@given(st.lists(LINE, max_size=30))
@example(["(99999999999.000000) can0 18F0093E#697D7F637D577F7D", "(0.000001) can0 18F0093E#697D7F637D577F7D"])
def test_random_lines_give_a_refusal_or_a_table(lines: list[str]) -> None:
    survives(".log", "\n".join(lines).encode())


@pytest.mark.slow
@given(st.integers(0, 400 * 45), st.binary(min_size=1, max_size=20))
def test_local_damage_in_a_candump_log_never_changes_a_value(place: int, scratch: bytes) -> None:
    """The undamaged frames around a damaged stretch keep their values."""
    whole = candump(drive()).encode()
    signals = survives(".log", whole[:place] + scratch + whole[place + len(scratch) :])
    if signals is None:
        return
    undamaged = survives(".log", whole)
    assert undamaged is not None
    both = undamaged.table.join(signals.table, on="time_s", suffix="_then")
    change = (both["steering_wheel_angle_rad"] - both["steering_wheel_angle_rad_then"]).abs()
    moved = change.fill_nan(0.0) > 1e-9  # a number that is lost, since the stamps were damaged, is not moved
    assert moved.sum() <= 3


@pytest.mark.parametrize("name", ["a\rb", "x" * 200_000])
def test_a_name_of_a_column_that_no_table_has_is_one_line(name: str, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_bytes(f"time_s,{name},steering_wheel_angle_deg\n0,0,0\n1,0,0\n".encode())
    with pytest.raises(OncenterError, match="header line") as refused:
        read(log)
    assert refused.value.code == "unreadable_log" and len(str(refused.value)) < 400
