"""The account of a log: counts by an independent reader are those that reading gives, for every format and damage."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import can
import numpy as np
import polars as pl
import pytest
from asammdf import MDF, Signal
from can.io.mf4 import MF4Writer
from drive_frames import START_S, Frame, candump, ccvs1, drive, vdc2
from signal_logs import WRITERS, names_for
from test_findings import core_says

import oncenter as oc
from oncenter import _core
from oncenter.account import Account, AccountError, FileAccount, SignalAccount
from oncenter.cli import run
from oncenter.cli.explain import read_sections
from oncenter.errors import OncenterError
from oncenter.findings import Finding, most_severe_first
from oncenter.offset.core_findings import findings_of
from oncenter.offset.withheld import Gaps, withheld_by_oncenter
from oncenter.plausibility.values_left_out import values_left_out
from oncenter.read import read
from oncenter.read.frames import joined
from oncenter.signals import DEGREE, SignalName, Signals
from oncenter.verdict import verdicts_of

OF_FRAMES = {
    ".log": can.CanutilsLogWriter,
    ".asc": can.ASCWriter,
    ".blf": can.BLFWriter,
    ".trc": can.TRCWriter,
    ".mf4": MF4Writer,
}
VDC2_ID = 0x18F0093E
ANGLE = "steering_wheel_angle"


@cache
def frames_of(seconds: float) -> tuple[Frame, ...]:
    return tuple(drive(seconds))


def messages(frames: Sequence[Frame] | None = None) -> list[can.Message]:
    return [
        can.Message(
            timestamp=frame.time,
            arbitration_id=frame.identifier,
            is_extended_id=frame.extended,
            data=frame.data,
            channel=1,
        )
        for frame in (frames_of(4.0) if frames is None else frames)
    ]


def written(path: Path, given: Sequence[can.Message]) -> Path:
    with OF_FRAMES[path.suffix](path) as writer:
        for message in given:
            writer.on_message_received(message)
    return path


def counted(path: Path) -> tuple[Counter[str], Counter[str]]:
    """Frames of a log by kind, and samples of the angle by kind, with python-can."""
    frames: Counter[str] = Counter()
    angles: Counter[str] = Counter()
    with can.LogReader(path) as reader:
        for message in reader:
            kind = (
                "error_frame"
                if message.is_error_frame
                else "remote_frame"
                if message.is_remote_frame
                else "can_fd"  # no J1939 message has as many bytes
                if len(message.data) > 8
                else "data"
            )
            frames[kind] += 1
            if kind == "data" and message.is_extended_id and message.arbitration_id & 0x3FFFF00 == 0x0F00900:
                angles[code_of(bytes(message.data))] += 1
    return frames, angles


def code_of(data: bytes) -> str:
    if len(data) < 2:
        return "frame_too_short"
    return {0xFF: "not_available", 0xFE: "error_code"}.get(data[1], "reserved_code" if data[1] > 0xFA else "number")


def account_of(path: Path, **options: Any) -> Account:
    account = read(path, **options).account
    assert account is not None
    return account


def with_angle(message: can.Message, raw: int) -> can.Message:
    data = raw.to_bytes(2, "little") + bytes(message.data[2:])
    return can.Message(
        timestamp=message.timestamp, arbitration_id=message.arbitration_id, data=data, channel=message.channel
    )


def every(count: int, change: Callable[[can.Message], can.Message]) -> Callable[[list[can.Message]], list[can.Message]]:
    """Changes each `count`-th VDC2 frame."""

    def changed(given: list[can.Message]) -> list[can.Message]:
        seen, result = 0, []
        for message in given:
            seen += message.arbitration_id == VDC2_ID
            result.append(change(message) if message.arbitration_id == VDC2_ID and seen % count == 0 else message)
        return result

    return changed


def between(count: int, extra: Callable[[float], can.Message]) -> Callable[[list[can.Message]], list[can.Message]]:
    """Another frame after each `count`-th one."""
    return lambda given: [
        each
        for k, message in enumerate(given)
        for each in ([message, extra(message.timestamp + 1e-4)] if k % count == 0 else [message])
    ]


def flexible(message: can.Message) -> can.Message:
    return can.Message(
        timestamp=message.timestamp,
        arbitration_id=message.arbitration_id,
        data=message.data,
        is_fd=True,
        channel=message.channel,
    )


ODD = {
    "good": lambda given: given,
    "not available": every(7, lambda message: with_angle(message, 0xFFFF)),
    "error codes": every(5, lambda message: with_angle(message, 0xFE03)),
    "reserved codes": every(9, lambda message: with_angle(message, 0xFC00)),
    "short frames": every(
        11,
        lambda message: can.Message(
            timestamp=message.timestamp, arbitration_id=VDC2_ID, data=message.data[:1], channel=message.channel
        ),
    ),
    "error frames": between(6, lambda time: can.Message(timestamp=time, is_error_frame=True, channel=1)),
    "remote frames": between(
        6, lambda time: can.Message(timestamp=time, arbitration_id=VDC2_ID, is_remote_frame=True, dlc=8, channel=1)
    ),
    "short CAN FD": every(1, flexible),
    "long CAN FD": between(
        6, lambda time: can.Message(timestamp=time, arbitration_id=VDC2_ID, is_fd=True, data=bytes(12), channel=1)
    ),
    "another network": lambda given: [
        *given,
        *(can.Message(timestamp=START_S + 4.1, arbitration_id=k, is_extended_id=False, channel=2) for k in range(50)),
    ],
    "no angle": lambda given: [message for message in given if message.arbitration_id != VDC2_ID],
}
NOT_WRITTEN = {(".trc", "short CAN FD"), (".trc", "long CAN FD"), (".trc", "error frames")}  # by python-can


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf", ".trc"])
def test_the_account_of_frames_is_that_of_python_can(suffix: str, odd: str, tmp_path: Path) -> None:
    if (suffix, odd) in NOT_WRITTEN:
        return
    path = written(tmp_path / f"drive{suffix}", ODD[odd](messages()))
    frames, angles = counted(path)
    account = account_of(path)
    of_file = account.file
    assert of_file.unit == "frames"
    assert of_file.in_file == frames.total()
    assert {reason: of_file.left_out.get(reason, 0) for reason in ("error_frame", "remote_frame", "can_fd")} == {
        reason: frames[reason] for reason in ("error_frame", "remote_frame", "can_fd")
    }
    assert of_file.used == sum(angles.values()) + 40  # CCVS1 at 10 Hz
    if not angles:
        assert ANGLE not in account.signals
        return
    of_angle = account.signals[ANGLE]
    assert of_angle.in_file == angles.total()
    assert of_angle.left_out == {reason: count for reason, count in angles.items() if reason != "number"}
    assert of_angle.used + of_angle.superseded == angles["number"]


@pytest.mark.parametrize("odd", ["good", "not available", "short CAN FD", "long CAN FD", "error frames"])
def test_the_account_of_mf4_frames_is_that_of_asammdf(odd: str, tmp_path: Path) -> None:
    path = written(tmp_path / "drive.mf4", ODD[odd](messages()))
    account = account_of(path)
    with MDF(path) as mdf:
        records = sum(group.channel_group.cycles_nr for group in mdf.groups)
        rows = [mdf.get("CAN_DataFrame", group=k).samples for k, group in enumerate(mdf.groups) if _has_frames(group)]
    lengths = np.concatenate([row["CAN_DataFrame.DataLength"] for row in rows])
    assert account.file.in_file == records
    assert account.file.left_out.get("can_fd", 0) == np.count_nonzero(lengths > 8)
    assert account.signals[ANGLE].in_file == 400
    assert account.signals[ANGLE].left_out == ({"not_available": 57} if odd == "not available" else {})


def _has_frames(group: Any) -> bool:
    return bool(group.channel_group.cycles_nr) and any(each.name == "CAN_DataFrame" for each in group.channels)


def table(seconds: float = 5.0) -> pl.DataFrame:
    time = np.arange(round(100 * seconds)) / 100.0
    return pl.DataFrame(
        {
            "time_s": time,
            "steering_wheel_angle_rad": 0.3 * np.sin(time),
            "yaw_rate_rad_s": 0.05 * np.sin(time),
            "vehicle_speed_m_s": 20.0 + np.sin(time),
            "lateral_acceleration_m_s2": np.sin(time),
        }
    )


@pytest.mark.parametrize("suffix", WRITERS)
def test_the_account_of_channels_variables_and_fields_has_every_value(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"drive{suffix}"
    WRITERS[suffix](table(), path)
    account = account_of(path, names=names_for(suffix))
    for name in (ANGLE, "yaw_rate", "vehicle_speed", "lateral_acceleration"):
        assert account.signals[name].in_file == 500, name
        assert account.signals[name].left_out == {}, name
    assert account.file.used == account.file.in_file


def empty_cells(given: pl.DataFrame) -> pl.DataFrame:
    return given.with_columns(
        pl.when(pl.int_range(pl.len()) % 6 == 0).then(None).otherwise(pl.col(f"{ANGLE}_rad")).alias(f"{ANGLE}_rad")
    )


def infinite(given: pl.DataFrame) -> pl.DataFrame:
    return given.with_columns(
        pl.when(pl.int_range(pl.len()) % 8 == 0)
        .then(np.inf)
        .otherwise(pl.col("yaw_rate_rad_s"))
        .alias("yaw_rate_rad_s")
    )


def without_time(given: pl.DataFrame) -> pl.DataFrame:
    return given.with_columns(
        pl.when(pl.int_range(pl.len()) % 50 == 7).then(None).otherwise(pl.col("time_s")).alias("time_s")
    )


def twice(given: pl.DataFrame) -> pl.DataFrame:
    return pl.concat([given[:200], given[199:]])


@pytest.mark.parametrize("change", [lambda given: given, empty_cells, infinite, without_time, twice])
@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet", "frame"])
def test_the_account_of_a_table_is_that_of_polars(
    suffix: str, change: Callable[[pl.DataFrame], pl.DataFrame], tmp_path: Path
) -> None:
    given = change(table())
    account = account_of_table(given, suffix, tmp_path)
    rows = len(given)
    no_time = given["time_s"].null_count()
    repeated = int((given["time_s"].drop_nulls().diff() == 0.0).sum())
    left_out = {"without_time": no_time, "time_not_later": repeated}
    assert account.file == FileAccount(
        "rows", rows, rows - no_time - repeated, {name: count for name, count in left_out.items() if count}
    )
    for name in (ANGLE, "yaw_rate"):
        column = given[f"{name}_rad" if name == ANGLE else "yaw_rate_rad_s"]
        of = account.signals[name]
        assert of.in_file == rows - column.null_count()
        assert of.left_out.get("infinite", 0) == int(column.is_infinite().sum())
        assert of.left_out.get("without_time", 0) == no_time
        assert of.left_out.get("time_not_later", 0) == repeated


def account_of_table(given: pl.DataFrame, suffix: str, folder: Path) -> Account:
    if suffix == "frame":
        account = oc.from_dataframe(given).account
        assert account is not None
        return account
    path = folder / f"drive{suffix}"
    if suffix == ".parquet":
        given.write_parquet(path)
    elif suffix == ".csv":
        given.write_csv(path)
    else:
        import gzip

        path.write_bytes(gzip.compress(given.write_csv().encode()))
    return account_of(path)


def test_a_fast_signal_is_superseded_between_two_ticks(tmp_path: Path) -> None:
    time = np.arange(4000) / 1000.0
    pl.DataFrame({"time_s": time, f"{ANGLE}_rad": np.sin(time)}).write_parquet(tmp_path / "drive.parquet")
    account = account_of(tmp_path / "drive.parquet")
    assert account.signals[ANGLE] == SignalAccount(4000, 800, 3200, {}, 800, 800)


def test_a_slow_signal_is_held_between_its_samples(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    path.write_text(candump(list(frames_of(4.0))))
    speed = account_of(path).signals["vehicle_speed"]
    assert (speed.in_file, speed.used, speed.left_out) == (40, 40, {})
    assert (speed.ticks, speed.fresh) == (400, 40)
    assert speed.missing == 10
    assert speed.held == 400 - 40 - 10


def test_samples_far_from_all_others_are_left_out(tmp_path: Path) -> None:
    lonely = [ccvs1(START_S + 10.0037 + k, 20.0) for k in range(5)]
    path = tmp_path / "drive.log"
    path.write_text(candump([*frames_of(4.0), *lonely]))
    speed = account_of(path).signals["vehicle_speed"]
    assert speed.left_out == {"no_neighbour": 5}


def test_an_account_whose_sums_do_not_agree_is_an_internal_error() -> None:
    with pytest.raises(AccountError, match="the account of the samples does not add up: 10 is not 5 \\+ 1 \\+ 3"):
        SignalAccount(10, 5, 1, {"not_available": 3})
    with pytest.raises(AccountError, match="ticks"):
        SignalAccount(9, 5, 1, {"not_available": 3}, ticks=9, fresh=5, held=5)
    with pytest.raises(AccountError, match="file"):
        FileAccount("frames", 9, 5)


def test_an_account_survives_the_way_from_the_child_process(tmp_path: Path) -> None:
    path = written(tmp_path / "drive.blf", ODD["not available"](messages()))
    account = account_of(path)
    assert Account.of_dict(json.loads(json.dumps(account.to_dict()))) == account


# ---------------------------------------------------------------------------------------------------------------------
# The clock
# ---------------------------------------------------------------------------------------------------------------------


def on_clock(change: Callable[[float], float], seconds: float = 20.0) -> list[Frame]:
    return [Frame(change(f.time - START_S), f.identifier, f.data, f.extended) for f in frames_of(seconds)]


CLOCKS: dict[str, Callable[[float], float]] = {
    "wrap after 2^32 us": lambda t: (t + 4294.967296 - 8.0) % 4294.967296,
    "midnight": lambda t: (t + 86400.0 - 9.0) % 86400.0,
    "set back by 10 s": lambda t: START_S + (t if t < 12.0 else t - 10.0),
    "set back by 1.5 s": lambda t: START_S + (t if t < 12.0 else t - 1.5),
    "set back twice": lambda t: t % 7.5,
}


def asc(frames: Sequence[Frame]) -> str:
    lines = [
        f"{f.time:.6f} 1  {f.identifier:X}{'x' if f.extended else ''}  Rx   d {len(f.data)} {f.data.hex(' ')}\n"
        for f in frames
    ]
    return "".join(["base hex  timestamps absolute\n", *lines])


def trc(frames: Sequence[Frame]) -> str:
    lines = [
        f"{k} {f.time * 1000:.3f} DT 1 {f.identifier:0{8 if f.extended else 4}X} Rx - {len(f.data)} {f.data.hex(' ')}\n"
        for k, f in enumerate(frames)
    ]
    return "".join([";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n", *lines])


TEXTS = {".log": candump, ".asc": asc, ".trc": trc}


@pytest.mark.parametrize("name", CLOCKS)
@pytest.mark.parametrize("suffix", OF_FRAMES)
def test_a_clock_that_was_set_back_leaves_pieces(name: str, suffix: str, tmp_path: Path) -> None:
    frames, path = on_clock(CLOCKS[name]), tmp_path / f"drive{suffix}"
    if suffix in TEXTS:
        path.write_text(TEXTS[suffix](frames))
    elif suffix == ".blf" and frames[0].time > min(frame.time for frame in frames):
        return  # python-can's writer has no time before that of the first frame
    else:
        written(path, messages(frames))
    signals = read(path)
    assert signals.account is not None
    angle = signals.account.signals[ANGLE]
    assert (angle.in_file, angle.left_out) == (2000, {})
    steps = np.diff(signals.columns["time_s"])
    assert np.count_nonzero(steps < 0.0) == (2 if name == "set back twice" else 1)
    assert angle.missing == 0
    assert signals.duration_s == pytest.approx(20.0, abs=0.1)
    assert any("was set back or wrapped" in note for note in signals.notes)
    assert "time column" not in " ".join(signals.notes)


def test_a_log_of_two_buses_behind_one_another_is_one_piece(tmp_path: Path) -> None:
    angles = [frame for frame in frames_of(20.0) if frame.identifier == VDC2_ID]
    others = [frame for frame in frames_of(20.0) if frame.identifier != VDC2_ID]
    path = tmp_path / "drive.log"
    path.write_text(candump(angles) + candump(others, "can1"))
    signals = read(path)
    assert signals.notes == ()
    assert np.all(np.diff(signals.columns["time_s"]) > 0.0)
    assert {"vehicle_speed", ANGLE} <= set(signals.sources)


@pytest.mark.parametrize("wrong_s", [5e5, -300.0])
def test_a_wrong_single_stamp_costs_its_sample_only(wrong_s: float, tmp_path: Path) -> None:
    frames = [
        Frame(f.time + (wrong_s if k % 301 == 77 else 0.0), f.identifier, f.data, f.extended)
        for k, f in enumerate(frames_of(20.0))
    ]
    path = tmp_path / "drive.log"
    path.write_text(candump(frames))
    signals = read(path)
    assert signals.account is not None
    wrong = sum(frame.identifier == VDC2_ID for k, frame in enumerate(frames) if k % 301 == 77)
    assert wrong > 2
    assert signals.account.signals[ANGLE].left_out == {"time_not_later": wrong}
    assert np.all(np.diff(signals.columns["time_s"]) > 0.0)


def test_a_bus_whose_clock_is_set_back_gives_the_ticks_of_its_log(tmp_path: Path) -> None:
    from oncenter.read import candump as reader
    from oncenter.read.stream import Stream

    path = tmp_path / "drive.log"
    path.write_text(candump(on_clock(CLOCKS["set back by 10 s"])))
    log = read(path)
    frames = joined(list(reader.chunks(path, [], lambda fraction: None)))
    stream = Stream("bus", ("steering_wheel_angle",))
    parts = []
    for begin in range(0, len(frames), 700):
        for piece in stream.pieces(frames.where(np.arange(begin, min(begin + 700, len(frames))))):
            parts += [stream.finish()] if stream.clock_was_set_back(piece) else []
            parts.append(stream.add(piece))
    parts.append(stream.finish())
    time = np.concatenate([part["time_s"] for part in parts])
    angle = np.concatenate([part[f"{ANGLE}_rad"] for part in parts if len(part["time_s"])])
    assert len(time) == pytest.approx(log.ticks, abs=2)
    assert np.interp(0.0, [0.0], [angle[-1]]) == pytest.approx(log.columns[f"{ANGLE}_rad"][-1], abs=1e-3)
    assert np.count_nonzero(np.diff(time) < 0.0) == 1


def test_stamps_without_progress_are_named_as_such(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    path.write_text(candump([Frame(START_S, f.identifier, f.data, f.extended) for f in frames_of(4.0)]))
    with pytest.raises(OncenterError, match="never increase: record the log with the time of each frame") as refused:
        read(path)
    assert "time column" not in str(refused.value)


def test_a_log_that_has_every_frame_twice_is_answered_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    path.write_text(candump([frame for frame in frames_of(4.0) for _ in range(2)]))
    signals = read(path)
    assert signals.account is not None
    assert signals.account.signals[ANGLE].left_out == {"time_not_later": 400}


# ---------------------------------------------------------------------------------------------------------------------
# The range of a database
# ---------------------------------------------------------------------------------------------------------------------

NETWORK = """VERSION ""
BU_: EPS
BO_ 256 STEERING: 8 EPS
 SG_ SteerAng : 0|16@1{sign} (0.1,{offset}) {range} "deg" EPS
 SG_ YawRt : 16|16@1- (0.01,0) [-200|200] "deg/s" EPS
 SG_ VehSpd : 32|16@1+ (0.01,0) [0|300] "km/h" EPS
"""
NAMES = {
    ANGLE: SignalName("SteerAng"),
    "yaw_rate": SignalName("YawRt"),
    "vehicle_speed": SignalName("VehSpd"),
}


def network(
    folder: Path, raws: Sequence[int], *, sign: str = "-", offset: float = 0.0, given: str = "[0|1]"
) -> Signals:
    (folder / "net.dbc").write_text(NETWORK.format(sign=sign, offset=offset, range=given))
    lines = [
        f"({START_S + k / 100:.6f}) can0 100#{(raw & 0xFFFF).to_bytes(2, 'little').hex()}{'0000'}{'7017'}\n"
        for k, raw in enumerate(raws)
    ]
    (folder / "drive.log").write_text("".join(lines))
    return read(folder / "drive.log", names=NAMES, dbc=[folder / "net.dbc"])


def turning(count: int = 1000) -> list[int]:
    return [round(2000 * np.sin(k / 100)) for k in range(count)]  # 200 deg


@pytest.mark.parametrize("given", ["[0|1]", "[0|255]", "[0|65535]", "[-3|655]"])
def test_a_placeholder_in_a_database_removes_no_value(given: str, tmp_path: Path) -> None:
    signals = network(tmp_path, turning(), given=given)
    assert signals.account is not None
    low, high = (float(bound) for bound in given.strip("[]").split("|"))
    beyond = sum(not low - 0.1 <= raw / 10 <= high + 0.1 for raw in turning())
    angle = signals.account.signals[ANGLE]
    assert angle.left_out == {}
    assert angle.outside_range == beyond > 0
    note = next(note for note in signals.notes if note.startswith(ANGLE))
    assert f"{beyond} of 1000 values of STEERING.SteerAng are outside the range of its database, {low:g} to" in note
    assert np.nanmax(signals.columns[f"{ANGLE}_rad"]) == pytest.approx(200 * DEGREE, rel=0.01)


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        (0x7FFF, "not_available"),
        (-0x8000, "not_available"),
        (0x7FFE, "error_code"),
        (30000, "outside_range"),  # 3000 deg: no code at an end, but a jump
    ],
)
@pytest.mark.parametrize("given", ["[-780|780]", "[0|1]"])
def test_a_code_beyond_the_range_is_no_value(code: int, reason: str, given: str, tmp_path: Path) -> None:
    raws = [code if k % 20 in (3, 4, 5) and k > 10 else raw for k, raw in enumerate(turning())]
    signals = network(tmp_path, raws, given=given)
    assert signals.account is not None
    assert signals.account.signals[ANGLE].left_out == {reason: raws.count(code)}
    assert np.nanmax(np.abs(signals.columns[f"{ANGLE}_rad"])) < 201 * DEGREE


def test_all_zeros_are_a_code_where_they_do_not_mean_zero(tmp_path: Path) -> None:
    raws = [0 if k < 100 else raw + 7800 for k, raw in enumerate(turning())]
    signals = network(tmp_path, raws, sign="+", offset=-780.0, given="[-779|779]")
    assert signals.account is not None
    assert signals.account.signals[ANGLE].left_out == {"error_code": 100}


def test_a_value_within_the_range_after_a_long_code_is_used_again(tmp_path: Path) -> None:
    raws = [30000 if 200 <= k < 700 else raw for k, raw in enumerate(turning())]
    signals = network(tmp_path, raws, given="[0|1]")
    assert signals.account is not None
    assert signals.account.signals[ANGLE].left_out == {"outside_range": 500}


# ---------------------------------------------------------------------------------------------------------------------
# What the user reads
# ---------------------------------------------------------------------------------------------------------------------


def test_signals_shows_the_account(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "drive.log", ODD["not available"](messages()))
    assert run(["signals", str(path)]) == 0
    said = capsys.readouterr().out
    assert "account: 880 frames = 440 used + 440 left out (440 no signal)" in said
    assert "400 samples = 343 used + 57 left out (57 not available)" in " ".join(said.split())
    assert "warning: 14 % of the samples of the steering wheel angle are left out (57 of 400): the sender marks" in said
    assert run(["signals", str(path), "--json"]) == 0
    whole = json.loads(capsys.readouterr().out)
    assert whole["account"]["signals"][ANGLE]["left_out"] == {"not_available": 57}
    assert whole["findings"][0]["code"] == "values_left_out"


def test_a_large_loss_stands_before_errors() -> None:
    loss = Finding("values_left_out", "warning", "12 % of the samples", 12.0, "%")
    small = Finding("values_left_out", "info", "1 % of the samples", 1.0, "%")
    error = Finding("scale", "error", "a unit is wrong")
    assert most_severe_first([small, error, loss]) == (loss, error, small)


def test_the_note_on_a_cut_line_does_not_replace_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    path.write_text(candump([frame for frame in frames_of(4.0) if frame.identifier == 0x0CF00400]) + "(17000")
    with pytest.raises(OncenterError) as refused:
        read(path)
    said = str(refused.value)
    assert said.startswith("no frame has a steering wheel angle (PGN 61449 VDC2, SPN 1807)")
    assert said.index("no frame has") < said.index("the last line of drive.log is cut off")


def test_a_signal_that_lost_all_values_is_missing_for_that_reason(tmp_path: Path) -> None:
    lost = [vdc2(f.time, 0.0, 0.1, 0.1) if f.identifier == VDC2_ID else f for f in frames_of(4.0)]
    lost = [Frame(f.time, f.identifier, b"\xff\xff" + f.data[2:]) if f.identifier == VDC2_ID else f for f in lost]
    path = tmp_path / "drive.log"
    path.write_text(candump(lost))
    with pytest.raises(OncenterError) as refused:
        oc.offset(read(path), oc.vehicle("scania_r730_4x2"))
    assert "VDC2 from 0x3E (all 400 samples: the sender marks them as not available)" in str(refused.value)


def test_the_page_of_findings_quotes_the_printed_text_of_a_loss() -> None:
    account = SignalAccount(180000, 119958, 0, {"not_available": 60042})
    drive_with = Signals({}, {}, 100.0, "drive.log", account=Account(FileAccount("frames", 0, 0), {ANGLE: account}))
    (found,) = values_left_out(drive_with, (ANGLE,))
    (example,) = (section.paragraphs[1] for section in read_sections() if section.code == "values_left_out")
    assert found.text == example.strip()
    assert (found.severity, round(found.value or 0.0, 1), found.unit) == ("warning", 33.4, "%")


@pytest.mark.parametrize(("lost", "severities"), [(100, []), (101, ["info"]), (5000, ["info"]), (5001, ["warning"])])
def test_a_reason_is_named_above_0_1_percent_and_stands_first_above_5_percent(lost: int, severities: list[str]) -> None:
    account = SignalAccount(100_000, 100_000 - lost, 0, {"invalid_bit": lost})
    drive_with = Signals({}, {}, 100.0, "drive.log", account=Account(FileAccount("frames", 0, 0), {ANGLE: account}))
    assert [found.severity for found in values_left_out(drive_with, (ANGLE,))] == severities


def test_pages_of_a_multiplexer_are_no_loss() -> None:
    account = SignalAccount(4000, 1000, 0, {"other_multiplexer_page": 3000})
    assert account.shares() == {}


def withheld(missing_s: float, absent_s: float, turns_s: float = 0.0, fault: str = "none") -> dict[str, Finding]:
    """The findings of a core that lacked a signal for some of 1800 s."""
    rejected = [missing_s if reason == "missing_signal" else 0.0 for reason in _core.REASONS]
    native = core_says(rejected=rejected, fault=_core.FAULTS.index(fault))
    why = withheld_by_oncenter(native, Gaps(absent_s, turns_s), ())
    params = _core.default_params()
    joint = {"method": "joint", "yaw_rate_from_vdc2": False, "measures_banks": True, "limit_deg": 2.0}
    given = findings_of(native, params, False, withheld=why, **joint)
    return {finding.code: finding for finding in given}


def test_time_that_oncenter_withheld_is_not_called_missing() -> None:
    found = withheld(677.0, 0.0, fault="stuck")
    assert "signals_not_available" not in found
    (example,) = (section.paragraphs[1] for section in read_sections() if section.code == "signals_withheld")
    assert found["signals_withheld"].text == example.strip()
    assert "whole turns of the relative sensor" in withheld(300.0, 0.0, turns_s=290.0)["signals_withheld"].text


def test_time_without_values_and_time_withheld_are_separated() -> None:
    found = withheld(677.0, 200.0, fault="drifting")
    assert (found["signals_not_available"].value, found["signals_withheld"].value) == (200.0, 477.0)
    assert set(withheld(200.0, 200.0)) & {"signals_not_available", "signals_withheld"} == {"signals_not_available"}


def test_an_angle_that_the_file_loses_is_no_reason_to_repair_the_sensor() -> None:
    """The same drive: lost by frames of another layout, or not sent."""
    drive_lost = oc.simulate("step_steer", seed=1)[0]
    columns = dict(drive_lost.columns)
    columns[f"{ANGLE}_rad"] = np.where(np.arange(drive_lost.ticks) < 9000, columns[f"{ANGLE}_rad"], np.nan)
    ticks, left = drive_lost.ticks, drive_lost.ticks - 9000
    headlines = {}
    for reason in ("reserved_code", "not_available"):
        account = SignalAccount(ticks, 9000, 0, {reason: left}, ticks, 9000, 0, left)
        of_drive = Account(FileAccount("frames", ticks, ticks), {ANGLE: account})
        lost = Signals(columns, drive_lost.sources, drive_lost.rate_hz, "drive.log", account=of_drive)
        headlines[reason] = verdicts_of(oc.offset(lost, oc.vehicle("scania_r730_4x2")))[0].headline
    assert headlines["reserved_code"] == "Check the signal: the log has steering wheel angles that cannot be used."
    assert headlines["not_available"].startswith("Signal or sensor: the steering wheel angle (")


def test_a_row_of_a_fleet_has_the_largest_loss(undisturbed: Path) -> None:
    drives = pl.read_parquet(undisturbed / "drives.parquet")
    assert drives["left_out_share"].dtype == pl.Float64
    assert drives.filter(pl.col("left_out_share").is_not_null() != pl.col("left_out_reason").is_not_null()).is_empty()


def test_invalid_bits_of_a_channel_are_counted(tmp_path: Path) -> None:
    given = table()
    time = given["time_s"].to_numpy()
    bits = np.arange(500) % 9 == 0
    signals = [
        Signal(given[f"{ANGLE}_rad"].to_numpy(), time, name=ANGLE, unit="rad", invalidation_bits=bits),
        Signal(given["yaw_rate_rad_s"].to_numpy(), time, name="yaw_rate", unit="rad/s"),
    ]
    with MDF() as mdf:
        mdf.append(signals)
        mdf.save(tmp_path / "drive.mf4")
    account = account_of(tmp_path / "drive.mf4")
    assert account.signals[ANGLE].left_out == {"invalid_bit": int(bits.sum())}
    assert account.signals["yaw_rate"].left_out == {}
    assert (account.file.unit, account.file.in_file, account.file.left_out) == ("samples", 1000, {"invalid_bit": 56})


def test_cut_and_short_rows_are_counted(tmp_path: Path) -> None:
    lines = table().write_csv().splitlines()
    lines[200] = ",".join(lines[200].split(",")[:3])
    path = tmp_path / "drive.csv"
    path.write_text("\n".join(lines)[:-30])
    account = account_of(path)
    assert account.file.in_file == len(lines) - 1
    assert account.file.left_out == {"short_row": 1, "cut_off": 1}
