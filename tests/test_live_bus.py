"""A live bus, and what may happen to it: lost, silent, faster than the disk."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from drive_frames import START_S, drive
from live_drive import TRUCK, message, new_learner

import oncenter as oc
from oncenter.live import bus as live_bus
from oncenter.live.bus import Bus
from oncenter.live.record import Recorder
from oncenter.live.session import Sayings, Session


def without_log(answer: oc.Answer | None) -> dict[str, Any]:
    assert answer is not None
    return {key: value for key, value in answer.to_dict().items() if key != "log"}


def sender(channel: str) -> can.BusABC:
    return can.Bus(channel=channel, interface="virtual", preserve_timestamps=True)


def ended(session: Session, when: Any, timeout_s: float = 60.0) -> Session:
    """Runs it until something is so, then ends it."""
    session.start()
    until_s = time.monotonic() + timeout_s
    while not when(session.snapshot) and session.is_alive():
        assert time.monotonic() < until_s
        time.sleep(0.02)
    session.stop()
    session.join()
    if session.failure is not None:
        raise session.failure
    return session


@pytest.mark.parametrize("trembling_s", [0.0, 0.002])
def test_what_is_recorded_of_a_bus_answers_as_the_bus_did(trembling_s: float, tmp_path: Path) -> None:
    said, chances = Sayings(), np.random.default_rng(1)
    stamps = (frame.time + 1.234e-7 + chances.normal(0.0, trembling_s) for frame in drive(60.0))  # finer than a log's
    frames = sorted(map(lambda frame, time: replace(frame, time=time), drive(60.0), stamps), key=lambda f: f.time)
    channel = f"recorded {trembling_s}"
    bus, learner = Bus(channel, "virtual", None, said.say), new_learner()
    path = tmp_path / "kept.log"
    with sender(channel) as sending:
        for frame in frames:
            sending.send(message(frame))
        session = Session(bus, learner, "truck", said, recorder=Recorder(path, said.say))
        ended(session, lambda now: now.frames == len(frames))
    assert len(path.read_text().splitlines()) == len(frames)
    live = session.snapshot.known.answer
    assert without_log(live) == without_log(oc.offset(oc.read(path), oc.vehicle(TRUCK)))
    assert session.snapshot.dropped == 0


def test_a_bus_that_is_lost_is_opened_again_and_nothing_learned_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    pieces = [drive(20.0), [frame for frame in drive(40.0) if frame.time - START_S > 22.0]]
    opened = []

    class Cable:
        """Gives a piece of the drive, then fails as a driver does; the second time it cannot be opened at first."""

        def __init__(self, **options: Any) -> None:
            opened.append(options)
            if len(opened) == 2:
                raise can.CanInitializationError("no device")
            self.frames = iter(pieces.pop(0))

        def recv(self, timeout: float) -> can.Message | None:
            frame = next(self.frames, None)
            if frame is None and pieces:
                raise can.CanOperationError("Network is down")
            return None if frame is None else message(frame)

        def fileno(self) -> int:
            raise NotImplementedError

        def shutdown(self) -> None:
            raise OSError("already gone")

    total = sum(map(len, pieces))
    monkeypatch.setattr(can, "Bus", Cable)
    monkeypatch.setattr(live_bus, "TRY_AGAIN_S", 0.05)
    said = Sayings()
    learner = new_learner()
    bus = Bus("can0", "socketcan", 250_000, said.say)
    session = ended(Session(bus, learner, "truck", said), lambda now: now.frames == total)
    assert opened == [{"channel": "can0", "interface": "socketcan", "bitrate": 250_000}] * 3
    lost, back = (line.text for line in session.snapshot.said)
    assert lost == "can0 (socketcan) is lost: Network is down; trying every second to open it again"
    assert back.startswith("can0 (socketcan) is back after ")
    assert session.snapshot.driven_s == pytest.approx(40.0, abs=0.1)  # 2 s of silence are ticks without signals


def test_a_bus_that_falls_silent_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("oncenter.live.session.SILENT_S", 0.2)
    said = Sayings()
    bus = Bus("silent", "virtual", None, said.say)
    with sender("silent") as sending:
        session = Session(bus, new_learner(), "truck", said)
        session.start()
        time.sleep(0.8)
        sending.send(message(drive(0.1)[0]))
        ended_with = [line.text for line in _stopped(session, lambda now: now.frames == 1).said]
    assert ended_with[0] == "no frame on silent (virtual) for 0 s: cable, ignition or bitrate?"
    assert len(ended_with) == 2 and ended_with[1].startswith("frames again after ")


def _stopped(session: Session, when: Any) -> Any:
    until_s = time.monotonic() + 60.0
    while not when(session.snapshot):
        assert time.monotonic() < until_s
        time.sleep(0.02)
    session.stop()
    session.join()
    return session.snapshot
