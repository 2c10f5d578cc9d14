"""Advice is followed: each command, option and name that a message proposes is executed on the log that caused it, and
the outcome is better: an answer, or a different, later problem."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import polars as pl
import pytest
from drive_frames import START_S, Frame, candump, drive
from test_estimate import steady_drive
from test_sources import STEER, databases, second, steer

from oncenter.cli import run
from oncenter.signals import DEGREE

TRUCK = "wheelbase_m = 3.7\nsteering_ratio = 19.3\n"
PLACEHOLDERS = {"M": "3.7", "RATIO": "19.3", "FILE": "net.dbc", "LOG": "drive.csv"}
_COMMAND = re.compile(r"(oncenter [a-z][^;,]*?|can_logconvert \S+ \S+)(?= (?:proposes|writes|lists|shows) |[;,\n]|$)")
_OPTION = re.compile(r"(--(?:no-accelerometer|each|in-given-order|method wheel-speed))")
_SOURCE = re.compile(r"""--source (.+?)(?=[;\n]|$)""")
_ENTRY = re.compile(r"\w+ = \{[^}]*\}")
_NAME = re.compile(r"did you mean ([^?]+)\?")
_RENAMED = re.compile(r"column (\S+) of \S+ has no unit: rename it to (.+?), or")


class Case(NamedTuple):
    """A command line that fails, made by `make`, and how many proposals its message has."""

    words: str
    make: Callable[[], None]
    proposals: int = 1


def table() -> pl.DataFrame:
    return steady_drive(minutes=0.5).table


def file(name: str, change: Callable[[pl.DataFrame], pl.DataFrame]) -> Callable[[], None]:
    return lambda: change(table()).write_csv(name)


def frames(*buses: list[Frame], name: str = "drive.log") -> None:
    lines = [line for k, bus in enumerate(buses) for line in candump(bus, f"can{k}").splitlines()]
    Path(name).write_text("\n".join(sorted(lines)) + "\n")


def disagreeing() -> None:
    frames(drive() + second(steering_wheel_angle=0.8 * DEGREE))


def on_two_buses() -> None:
    frames(drive(), second(0x3E, yaw_rate=0.5 * DEGREE))


def twice_in_databases() -> None:
    angle = {"name": "STEER", "signal": "steering_wheel_angle"}
    databases(Path(), *[STEER.format(id=291, bit=bit, **angle) for bit in (0, 16)])
    frames(steer([291]))


def not_j1939() -> None:
    frames([Frame(START_S + k / 100, 0x200, bytes(8), extended=False) for k in range(300)])
    Path("net.dbc").write_text('VERSION ""\nBU_: X\nBO_ 512 ESP: 8 X\n SG_ Gyro : 0|16@1- (0.01,0) [0|0] "deg/s" X\n')


def without_an_angle() -> None:
    data = bytes.fromhex("FFFF7F8F7D877E7D")
    frames([Frame(START_S + k / 100, 0x0CF0093E, data) for k in range(300)])


def two_trucks() -> None:
    for name, vin in (("drive.csv", "YS2R4X20001234567"), ("other.csv", "YS2R4X20007654321")):
        table().with_columns(vin=pl.lit(vin)).write_csv(name)


def named_wrongly() -> None:
    file("other.csv", lambda rows: rows.rename({"yaw_rate_rad_s": "GyroZ", "vehicle_speed_m_s": "GPS_Speed"}))()


def undated() -> None:
    for name, offset_deg in (("a.csv", 3.0), ("b.csv", 0.5)):
        steady_drive(offset_deg=offset_deg).table.write_csv(name)


def without_accelerometer() -> None:
    steady_drive().table.drop("lateral_acceleration_m_s2").write_csv("drive.csv")


def without_units(rows: pl.DataFrame) -> pl.DataFrame:
    return rows.rename({"yaw_rate_rad_s": "yaw_rate"})


def in_ms(rows: pl.DataFrame) -> pl.DataFrame:
    return rows.with_columns(pl.col("time_s") * 1e3)


OFFSET = "--vehicle truck.toml"
CASES = {
    "two senders": Case(f"offset drive.log {OFFSET}", disagreeing, 2),
    "two buses": Case("signals drive.log", on_two_buses, 2),
    "two databases": Case("signals drive.log --dbc net0.dbc --dbc net1.dbc", twice_in_databases, 2),
    "a source that is not there": Case("signals drive.log --source yaw_rate=0x77", disagreeing, 0),
    "other names": Case(f"offset other.csv {OFFSET}", named_wrongly),
    "no unit": Case(f"offset drive.csv {OFFSET}", file("drive.csv", without_units), 3),
    "a time without a unit": Case("signals drive.csv", file("drive.csv", lambda rows: rows.rename({"time_s": "time"}))),
    "minutes": Case("signals drive.csv", file("drive.csv", lambda rows: rows.with_columns(pl.col("time_s") / 60))),
    "days": Case(
        f"offset drive.csv {OFFSET}", file("drive.csv", lambda rows: rows.with_columns(pl.col("time_s") / 86400))
    ),
    "seconds as ms": Case("signals drive.csv", file("drive.csv", lambda rows: rows.rename({"time_s": "time_ms"}))),
    "ms as seconds": Case("signals drive.csv", file("drive.csv", in_ms)),
    "11-bit frames": Case(f"offset drive.log {OFFSET}", not_j1939),
    "11-bit frames and a database": Case(f"offset drive.log {OFFSET} --dbc net.dbc", not_j1939),
    "no angle": Case(f"offset drive.log {OFFSET}", without_an_angle),
    "no accelerometer": Case(f"offset drive.csv {OFFSET}", without_accelerometer, 2),
    "no yaw rate": Case(f"offset drive.csv {OFFSET}", file("drive.csv", lambda rows: rows.drop("yaw_rate_rad_s"))),
    "two trucks": Case(f"offset drive.csv other.csv {OFFSET}", two_trucks),
    "a misspelt log": Case(f"offset drvie.csv {OFFSET}", file("drive.csv", lambda rows: rows)),
    "a missing vehicle file": Case("offset drive.csv --vehicle volvo.toml", file("drive.csv", lambda rows: rows), 2),
    "no order": Case(f"compare a.csv b.csv {OFFSET}", undated),
}


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("truck.toml").write_text(TRUCK)
    return tmp_path


def problem(words: list[str], capfd: pytest.CaptureFixture[str]) -> str | None:
    """The line of an error; None without one."""
    code = run(words)
    err = capfd.readouterr().err
    return None if code == 0 else err.strip()


def proposals(message: str, words: list[str]) -> Iterator[list[str]]:
    """Follows one proposal of a message after the other; gives each time the command line to be tried again."""
    for command in _COMMAND.findall(message):
        yield _after_command(shlex.split(command), words)
    for option in _OPTION.findall(message):
        yield [*words, *option.split()]
    for choice in _SOURCE.findall(message):
        for word in (word for word in shlex.split(choice) if "=" in word):
            yield [*words, "--source", word]
    for entry in _ENTRY.findall(message):
        Path("entry.toml").write_text(f"{TRUCK}[signals]\n{entry}\n")
        yield _with_vehicle(words, "entry.toml")
    for name in (name for names in _NAME.findall(message) for name in names.split(" or ")):
        wrong = next(
            word for word in words if word not in ("offset", "--vehicle") and Path(word).suffix == Path(name).suffix
        )
        yield [name if word == wrong else word for word in words]
    for column, names in _RENAMED.findall(message):
        for name in [each for each in names.split(" or ") if each.endswith(("_s", "_rad_s"))]:
            log = next(word for word in words if word.endswith(".csv"))
            pl.read_csv(log).rename({column: name}).write_csv("renamed.csv")
            yield ["renamed.csv" if word == log else word for word in words]


def _after_command(command: list[str], words: list[str]) -> list[str]:
    """Executes a proposed command; the command line to be tried again."""
    command = [PLACEHOLDERS.get(word, word) for word in command]
    if command[0] == "can_logconvert":
        subprocess.run([str(Path(sys.executable).with_name("can_logconvert")), *command[1:]], check=True)
        return [command[2] if word == command[1] else word for word in words]
    if command[1:3] == ["vehicle", "new"]:
        numbers = [] if "--wheelbase-m" in command else ["--wheelbase-m", "3.7", "--steering-ratio", "19.3"]
        assert run([*command[1:], *numbers]) == 0, command
        return _with_vehicle(words, command[3])
    return command[1:]


def _with_vehicle(words: list[str], name: str) -> list[str]:
    if "--vehicle" not in words:
        return [*words, "--vehicle", name]
    place = words.index("--vehicle")
    return [*words[: place + 1], name, *words[place + 2 :]]


@pytest.mark.parametrize("case", CASES)
def test_what_a_message_proposes_is_better(case: str, desk: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words, make, count = CASES[case]
    make()
    message = problem(words.split(), capfd)
    assert message is not None, words
    tried = 0
    for again in proposals(message, words.split()):
        tried += 1
        later = problem(again, capfd)
        assert later is None or _is_later(later, message), f"{message}\n{again}\n{later}"
    assert tried >= count, message


def _is_later(problem_: str, before: str) -> bool:
    """Whether it is another problem: the same one begins with the same words."""
    return problem_[:40] != before[:40]


def test_each_source_that_a_message_lists_can_be_used(desk: Path, capfd: pytest.CaptureFixture[str]) -> None:
    disagreeing()
    message = problem(["signals", "drive.log", "--source", "yaw_rate=0x77"], capfd)
    assert message is not None
    there = message.partition("available are: ")[2].split(", ")
    assert there == ["VDC2 from 0x0B", "VDC2 from 0x3E"]
    for source in there:
        more = [f"{signal}={source}" for signal in ("steering_wheel_angle", "yaw_rate")]
        assert run(["signals", "drive.log", *[word for each in more for word in ("--source", each)]]) == 0


@pytest.mark.parametrize(
    "columns",
    [
        ["Time Stamp", "ID", "Extended", "Dir", "Bus", "LEN", *[f"D{k}" for k in range(1, 9)]],  # SavvyCAN
        ["TimestampEpoch", "BusChannel", "ID", "IDE", "DLC", "DataLength", "Dir", "EDL", "DataBytes"],  # CANedge
        ["time", "CAN ID", "Data"],
        ["timestamp", "arbitration_id", "extended", "remote", "error", "dlc", "data"],  # python-can
    ],
)
def test_a_parquet_of_frames_is_named_whatever_its_columns(columns: list[str], desk: Path) -> None:
    """As CSV they are read."""
    from oncenter.errors import OncenterError
    from oncenter.read import read
    from oncenter.signals import SignalName

    rows = pl.DataFrame({column: ["0C"] * 300 for column in columns})
    rows.write_parquet("frames.parquet")
    for names in ({}, {"steering_wheel_angle": SignalName(columns[-1], "deg")}):
        with pytest.raises(OncenterError, match="table of CAN frames") as refused:
            read("frames.parquet", names=names)
        assert refused.value.code == "table_of_frames"
        for wrong in ("sort", "rename", "assign"):
            assert wrong not in str(refused.value)


def test_a_table_with_a_signal_beside_an_identifier_is_read(desk: Path) -> None:
    from oncenter.read import read

    table().with_columns(id=pl.lit(7), data=pl.lit(1.0)).write_csv("drive.csv")
    assert read("drive.csv").ticks > 0
