"""The begin of a simulated drive, as its log, as frames in batches, and what a learner makes of them."""

import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import can
import numpy as np
from drive_frames import Frame

import oncenter as oc
from oncenter.live.learner import Learner, Stepped, needed
from oncenter.read import candump as candump_reader
from oncenter.read.frames import Frames, joined
from oncenter.read.stream import Stream
from oncenter.simulate import simulate_to_log

TRUCK = "scania_r730_4x2"
_FOLDER = tempfile.TemporaryDirectory()


@cache
def drive_log(duration_s: float = 500.0) -> Path:
    """Long enough for an offset."""
    folder = Path(_FOLDER.name)
    whole, path = folder / "whole.log", folder / f"{duration_s:g}.log"
    if not whole.exists():
        simulate_to_log("thesis_drive", 1, whole)
    lines = whole.read_bytes().splitlines(keepends=True)
    end_s = float(lines[0][1:18]) + duration_s
    path.write_bytes(b"".join(line for line in lines if float(line[1:18]) < end_s))
    return path


def frames_of_log(path: Path) -> Frames:
    return joined(list(candump_reader.chunks(path, [], lambda fraction: None)))


def in_batches(frames: Frames, seed: int, most: int = 400) -> Iterator[Frames]:
    """The frames as a bus hands them over: now one, now many."""
    chances = np.random.default_rng(seed)
    ends = np.cumsum(chances.integers(1, most, len(frames)))
    begin = 0
    for end in [*ends[ends < len(frames)].tolist(), len(frames)]:
        yield (frames.where(np.arange(len(frames)) >= begin) if end - begin == len(frames) else cut(frames, begin, end))
        begin = end


def cut(frames: Frames, begin: int, end: int) -> Frames:
    return frames.where(np.arange(begin, min(end, len(frames))))


def new_learner(name: str = "bus") -> Learner:
    truck = oc.vehicle(TRUCK)
    return Learner(Stream(name, needed(truck)), truck)


def fed(learner: Learner, frames: Frames, seed: int = 1, most: int = 4000) -> list[Stepped]:
    stepped = [step for batch in in_batches(frames, seed, most) for step in learner.take(batch)]
    return [*stepped, *learner.finish()]


def one_frame(time_s: float, number: int, extended: bool, data: bytes) -> Frames:
    payload = np.frombuffer(data.ljust(8, b"\xff"), "<u8")
    one = np.array([time_s])
    return Frames(
        one,
        np.array([number], np.uint32),
        np.array([extended]),
        payload,
        np.array([len(data)], np.uint8),
        np.zeros(1, np.uint64),
    )


def message(frame: Frame) -> can.Message:
    return can.Message(
        timestamp=frame.time, arbitration_id=frame.identifier, is_extended_id=frame.extended, data=frame.data
    )


def until(so: Callable[[], bool]) -> None:
    until_s = time.monotonic() + 60.0  # a guard, not a demand
    while not so():
        assert time.monotonic() < until_s
        time.sleep(0.01)
