"""What a live drive leaves behind: the frames, what was learned, the trace. A disk may fill, a power cut come."""

import errno
import os
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from drive_frames import START_S, drive
from live_drive import TRUCK, cut, drive_log, fed, frames_of_log, in_batches, message, new_learner, until

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.live import record as live_record
from oncenter.live.learner import Learner, needed
from oncenter.live.memory import Memory
from oncenter.live.record import Recorder
from oncenter.live.replay import Replay
from oncenter.live.session import Notices, Session
from oncenter.live.trace import Trace, unit_of
from oncenter.read.frames import Frames
from oncenter.read.stream import Stream
from oncenter.signals import DEGREE

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def log() -> Path:
    return drive_log()


def test_a_full_disk_is_said_once_and_every_frame_is_there_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    frames = drive(4.0)
    room = {"bytes": 1000}

    def write(file: int, data: bytes) -> int:
        if room["bytes"] <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        count = real_write(file, data[: min(len(data), room["bytes"], 777)])
        room["bytes"] -= count
        return count

    real_write = os.write
    monkeypatch.setattr(live_record, "_AGAIN_S", 0.05)
    monkeypatch.setattr(live_record, "_EVERY_S", 0.01)
    monkeypatch.setattr(os, "write", write)
    notices = Notices()
    recorder = Recorder(tmp_path / "kept.log", notices.say)
    recorder.take([message(frame) for frame in frames])
    until(lambda: len(notices.all()) == 1)
    room["bytes"] = 1 << 30
    until(lambda: len(notices.all()) == 2)
    recorder.close()
    full, again = (line.text for line in notices.all())
    assert "No space left on device; frames are kept in memory, the estimate continues" in full
    assert again.endswith("is recorded again, nothing is missing")
    assert frames_of_log(tmp_path / "kept.log").time.tolist() == [round(frame.time, 6) for frame in frames]


def test_frames_that_the_disk_never_took_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write(file: int, data: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    frames = drive(1.0)
    monkeypatch.setattr(live_record, "_AGAIN_S", 0.02)
    monkeypatch.setattr(live_record, "_EVERY_S", 0.01)
    monkeypatch.setattr(live_record, "WAITING_MAX_BYTES", 2000)
    monkeypatch.setattr(os, "write", write)
    notices = Notices()
    recorder = Recorder(tmp_path / "kept.log", notices.say)
    recorder.take([message(frame) for frame in frames[:100]])
    until(lambda: len(notices.all()) == 1)
    recorder.take([message(frame) for frame in frames[100:]])
    until(lambda: recorder.lost == len(frames) - 100)
    recorder.close()
    assert recorder.lost == len(frames)
    assert notices.all()[-1].text.endswith("the last 100 frames were not recorded")


def test_what_is_recorded_is_on_disk_before_it_is_closed(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "kept.log", print)
    frames = drive(2.0)
    recorder.take([message(frame) for frame in frames])
    until(lambda: (tmp_path / "kept.log").read_bytes().count(b"\n") == len(frames))
    recorder.close()


def test_a_recording_is_never_written_over(tmp_path: Path) -> None:
    path = tmp_path / "kept.log"
    path.write_text("dear\n")
    with pytest.raises(OncenterError, match=r"kept\.log: File exists"):
        Recorder(path, print)
    assert path.read_text() == "dear\n"


def test_what_was_learned_is_resumed_from_the_newer_of_two_slots(log: Path, tmp_path: Path) -> None:
    learner = new_learner()
    notices = Notices()
    memory = Memory(tmp_path, "truck 7", notices.say)
    frames = frames_of_log(log)
    taught = Learner(learner.stream, learner.vehicle, memory.resume)
    halves = cut(frames, 0, len(frames) // 2), cut(frames, len(frames) // 2, len(frames))
    for half in halves:
        for batch in in_batches(half, seed=3, most=4000):
            taught.take(batch)
        memory.save(core_of(taught))
        kept = core_of(taught).answer()["offset"]
    memory.close()
    resumed, lines = _resumed(frames, tmp_path, "truck 7")
    assert lines == ["resumed the saved state of truck 7"]
    again = core_of(resumed).answer()["offset"]  # after an ignition, in which the truck may have changed
    assert again["value"] == pytest.approx(kept["value"], abs=0.3 * DEGREE)
    assert kept["standard_deviation"] <= again["standard_deviation"] < 2.0 * kept["standard_deviation"]

    path = tmp_path / "truck%207.state"
    image = bytearray(path.read_bytes())
    newer = len(image) // 2 * (2 % 2)  # the second image has sequence 2
    image[newer + 200] ^= 1
    path.write_bytes(image)
    older, lines = _resumed(frames, tmp_path, "truck 7")
    assert lines == ["resumed the saved state of truck 7"]
    assert 0.0 < core_of(older).answer()["used"] < core_of(resumed).answer()["used"]

    path.write_bytes(bytes(len(image)))  # as one that was never written to: nothing is said
    assert _resumed(frames, tmp_path, "truck 7")[1] == []
    path.write_bytes(b"no image at all, but long enough to be read as one" * 9)
    fresh, lines = _resumed(frames, tmp_path, "truck 7")
    assert lines == [
        f"the saved state of truck 7 is not resumed ({path}: it has no saved state); learning starts from zero"
    ]
    assert core_of(fresh).answer()["used"] == 0.0


def _resumed(frames: Frames, folder: Path, truck: str) -> tuple[Learner, list[str]]:
    """The learner after the first tick, which knows nothing but the resumed state, and the messages."""
    notices = Notices()
    memory = Memory(folder, truck, notices.say)
    learner = Learner(Stream("bus", needed(oc.vehicle(TRUCK))), oc.vehicle(TRUCK), memory.resume)
    begin_s = frames.time[0]
    learner.take(frames.where(frames.time < begin_s + 5.2))
    assert learner.core is not None
    memory.close()
    return learner, [line.text for line in notices.all()]


def test_a_truck_whose_memory_is_in_use_is_watched_all_the_same(log: Path, tmp_path: Path) -> None:
    frames = frames_of_log(log)
    notices = Notices()
    first = Memory(tmp_path, "one", notices.say)
    first.resume(fed := _first_core(frames))
    _, lines = _resumed(frames, tmp_path, "one")
    assert len(lines) == 1 and "neither resumed nor saved" in lines[0] and "another oncenter live uses it" in lines[0]
    first.save(fed)
    first.close()
    assert _resumed(frames, tmp_path, "one")[1] == ["resumed the saved state of one"]


def test_a_pipe_in_the_place_of_the_memory_does_not_stop_the_start(log: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "one.state")
    _, (line,) = _resumed(frames_of_log(log), tmp_path, "one")
    assert line.endswith("one.state: is a device or a pipe, not a file") and "neither resumed nor saved" in line


def core_of(learner: Learner) -> Any:
    assert learner.core is not None
    return learner.core


def _first_core(frames: Frames) -> Any:
    learner = new_learner()
    learner.take(frames.where(frames.time < frames.time[0] + 60.0))
    return core_of(learner)


@pytest.mark.parametrize("suffix", [".parquet", ".mf4"])
def test_the_trace_is_a_table_with_units_that_answers_as_the_drive_did(log: Path, tmp_path: Path, suffix: str) -> None:
    notices = Notices()
    path = tmp_path / f"trace{suffix}"
    learner, trace = new_learner(), Trace(path, notices.say)
    for stepped in fed(learner, frames_of_log(log)):
        trace.take(stepped)
    trace.close()
    assert notices.all() == ()
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    live = learner.known().answer
    again = oc.offset(oc.read(path), oc.vehicle(TRUCK))
    assert live is not None and live.offset.value is not None
    assert again.offset.value == pytest.approx(live.offset.value, abs=1e-7)
    assert again.used_s == pytest.approx(live.used_s, abs=0.1)
    _check_units(path)


def test_a_trace_that_fills_the_disk_holds_what_came_before(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    room = {"bytes": 1_000_000}

    def write(file: int, data: bytes) -> int:
        if room["bytes"] <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        room["bytes"] -= min(len(data), 100_000)
        return real_write(file, data[:100_000])

    real_write = os.write
    monkeypatch.setattr(os, "write", write)
    notices = Notices()
    trace = Trace(tmp_path / "trace.parquet", notices.say)
    stepped = fed(new_learner(), cut(frames_of_log(log), 0, 20_000))
    for step in stepped:
        trace.take(step)
    trace.close()
    assert [line.text for line in notices.all()] == [
        f"the trace {tmp_path / 'trace.parquet'} ends here: No space left on device"
    ]
    table = pl.read_parquet(tmp_path / "trace.parquet")
    whole = np.concatenate([step.ticks["time_s"] for step in stepped])
    assert 2000 < table.height < len(whole)
    assert np.array_equal(table["time_s"].to_numpy(), whole[: table.height])


def _check_units(path: Path) -> None:
    if path.suffix == ".parquet":
        table = pl.read_parquet(path)
        assert table["offset_status"][-1] == "valid" and table["rejected_by"][0] == "settling, speed"
        assert {"converging", "valid"} <= set(table["true_angle_status"]) and set(table["signal_fault"]) == {"none"}
        named = {
            "offset_status",
            "true_angle_status",
            "rejected_by",
            "sensor_fault",
            "signal_fault",
            "signals_at_fault",
        }
        assert all(unit_of(name) for name in set(table.columns) - named)
        return
    from asammdf import MDF

    with MDF(path) as mdf:
        assert mdf.get("offset_deg").unit == "deg"
        assert mdf.get("yaw_rate_bias_deg_s").unit == "deg/s"
        assert mdf.get("offset_status").samples[-1] == b"valid" and b"valid" in mdf.get("true_angle_status").samples
        assert abs(mdf.start_time.timestamp() - START_S) < 3e8


def test_what_is_learned_is_saved_while_it_is_driven(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("oncenter.live.session.SAVE_EVERY_S", 0.05)
    notices = Notices()
    truck = oc.vehicle(TRUCK)
    memory = Memory(tmp_path, "one", notices.say)
    learner = Learner(Stream("bus", needed(truck)), truck, memory.resume)
    session = Session(Replay(log, 100.0), learner, "one", notices, memory=memory)
    session.start()
    path = tmp_path / "one.state"
    until(lambda: path.exists() and _slots_written(path) == 2)
    assert session.is_alive()
    session.stop()
    session.join()
    assert session.failure is None


def _slots_written(path: Path) -> int:
    content = path.read_bytes()
    half = len(content) // 2
    return sum(any(part[:4]) for part in (content[:half], content[half:]))
