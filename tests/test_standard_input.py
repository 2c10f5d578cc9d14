"""`-` reads a log of any format from standard input, so that pipes need no file."""

from __future__ import annotations

import gzip
import io
import json
import sys
from pathlib import Path

import pytest
from drive_frames import candump, drive
from signal_logs import WRITERS
from test_signal_logs import short

from oncenter.cli import run as command
from oncenter.cli.standard_input import STANDARD_INPUT, as_file
from oncenter.files.log_formats import FORMATS
from oncenter.simulate import simulate_to_log

pytestmark = pytest.mark.system

CSV = "time_s,steering_wheel_angle_deg,yaw_rate_deg_s,vehicle_speed_km_h\n" + "".join(
    f"{k / 100},{k % 7},{k % 5},60\n" for k in range(200)
)


class Terminal(io.BytesIO):
    def isatty(self) -> bool:
        return True


def give(monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))


def signals_of(capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    assert command(["signals", "-", "--json"]) == 0
    answer: dict[str, object] = json.loads(capsys.readouterr().out)
    return answer


@pytest.mark.parametrize("packed", [False, True])
def test_a_table_from_standard_input_gives_the_answer_of_its_file(
    packed: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    give(monkeypatch, gzip.compress(CSV.encode()) if packed else CSV.encode())
    printed = signals_of(capsys)
    assert (printed["log"], printed["duration_s"]) == ("-", pytest.approx(1.99))


def test_a_candump_log_from_standard_input_gives_the_answer_of_its_file(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    give(monkeypatch, candump(drive()).encode())
    assert signals_of(capsys)["log"] == "-"


@pytest.mark.parametrize("suffix", [row.suffixes[0] for row in FORMATS])
def test_each_format_is_recognised_by_its_first_bytes(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = tmp_path / "short.toml"
    scenario.write_text('base = "thesis_drive"\nabout = "short"\n[drive]\nduration_s = 30.0\n')
    log = tmp_path / f"drive{suffix}"
    if suffix in WRITERS:
        WRITERS[suffix](short(), log)
    else:
        simulate_to_log(scenario, 1, log)
    give(monkeypatch, log.read_bytes())
    with as_file(STANDARD_INPUT) as file:
        assert file.name == f"standard input{suffix}"
        assert file.read_bytes() == log.read_bytes()
    assert not file.exists()


def test_a_terminal_is_not_a_log(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(Terminal()))
    assert command(["signals", "-"]) == 2
    assert "candump -ta can0 | oncenter" in capsys.readouterr().err


def test_an_empty_standard_input_is_an_empty_log(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    give(monkeypatch, b"")
    assert command(["signals", "-"]) == 1
    assert "is empty" in capsys.readouterr().err
