"""A log gives the same signals in either process, and a file that becomes shorter during reading is refused."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from drive_frames import DBC, candump, drive

from oncenter.cli import run as command
from oncenter.errors import OncenterError
from oncenter.files.log_formats import OF_FRAMES, WRITTEN
from oncenter.read import candump as candump_reader
from oncenter.read import read
from oncenter.read.apart import frames, read_apart
from oncenter.read.frames import COLUMNS, Frames, joined
from oncenter.read.frames_of_log import frames_of_log
from oncenter.read.here import read_here
from oncenter.signals import SignalName
from oncenter.simulate import simulate_to_log

pytestmark = pytest.mark.system


def nobody_hears(fraction: float) -> None:
    pass


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("drives")
    (folder / "short.toml").write_text('base = "thesis_drive"\nabout = "short"\n[drive]\nduration_s = 30.0\n')
    for suffix in WRITTEN:
        simulate_to_log(folder / "short.toml", 1, folder / f"drive{suffix}")
    return folder


@pytest.mark.parametrize("suffix", WRITTEN)
def test_a_child_reads_what_this_process_reads(drives: Path, suffix: str) -> None:
    log = drives / f"drive{suffix}"
    heard: list[float] = []
    own, apart = read_here(log, {}, (), {}, nobody_hears), read_apart(log, {}, (), {}, heard.append)
    assert apart.table.equals(own.table)
    assert (apart.sources, apart.rate_hz, apart.log, apart.notes) == (own.sources, own.rate_hz, own.log, own.notes)
    assert (heard[0], heard[-1]) == (0.0, 1.0)


@pytest.mark.parametrize("suffix", sorted(set(WRITTEN) & set(OF_FRAMES)))
def test_a_child_gives_the_frames_that_this_process_gives(drives: Path, suffix: str) -> None:
    log = drives / f"drive{suffix}"
    own, apart = (joined(list(given)) for given in (frames_of_log(log, [], nobody_hears), frames(log, [])))
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(apart, column), getattr(own, column))


def test_names_databases_and_the_chosen_source_reach_the_child(tmp_path: Path) -> None:
    (tmp_path / "drive.log").write_text(candump(drive()))
    names = {"yaw_rate": SignalName("YawRate", None, -1)}
    given = (tmp_path / "drive.log", names, [DBC], {"all": "0x3E"}, nobody_hears)
    own, apart = read_here(*given), read_apart(*given)
    assert apart.table.equals(own.table)
    assert apart.notes == own.notes
    with pytest.raises(OncenterError) as refusal:
        read_apart(*given[:3], {"yaw_rate": "0x99"}, nobody_hears)
    assert (refusal.value.code, refusal.value.exit_code, refusal.value.needs) == ("unknown_source", 2, ("yaw_rate",))


def test_a_log_with_a_name_that_is_not_text_is_read_in_both_processes(tmp_path: Path) -> None:
    table = "time_s,yaw_rate_deg_s\n" + "".join(f"{k / 100},1\n" for k in range(300))
    for name, content in (("a\udcff.csv", table), ("a\udcff.log", candump(drive()))):
        (tmp_path / name).write_text(content)
        assert read(tmp_path / name).log == os.fspath(tmp_path / name)


def changed_meanwhile(monkeypatch: pytest.MonkeyPatch, change: Callable[[Path], object]) -> None:
    chunks = candump_reader.chunks

    def changing(path: Path, *given: object) -> Iterator[Frames]:
        yield from chunks(path, *given)  # type: ignore[arg-type]
        change(path)

    monkeypatch.setattr(candump_reader, "chunks", changing)


def test_a_log_that_becomes_shorter_during_reading_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "drive.log"
    log.write_text(candump(drive()))
    size = log.stat().st_size
    changed_meanwhile(monkeypatch, lambda path: os.truncate(path, size // 2))
    with pytest.raises(
        OncenterError, match=rf"drive.log became shorter during reading, from {size} to {size // 2} bytes"
    ) as refusal:
        read(log)
    assert refusal.value.code == "unreadable_log"


def test_a_log_that_grows_during_reading_gives_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "drive.log"
    log.write_text(candump(drive()))
    changed_meanwhile(monkeypatch, lambda path: path.write_text(path.read_text() * 2))
    assert "drive.log changed during reading" in " ".join(read(log).notes)


def test_a_log_deleted_during_reading_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = tmp_path / "drive.log"
    log.write_text(candump(drive()))
    changed_meanwhile(monkeypatch, Path.unlink)
    with pytest.raises(OncenterError, match="No such file"):
        read(log)


def test_a_reader_that_crashes_is_one_line_with_exit_code_1(
    drives: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "a_reader_that_crashes.py").write_text(
        "import os\nfrom oncenter.files.child import serve\nserve(lambda request, send: os.abort())\n"
    )
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    monkeypatch.setattr(sys.modules[read_apart.__module__], "READER", "a_reader_that_crashes")
    assert command(["signals", str(drives / "drive.csv"), "--json"]) == 1
    said = capsys.readouterr()
    assert '"code": "reader_crashed"' in said.out
    assert said.err.count("\n") == 1
