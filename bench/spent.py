"""Time from log to answer in one warm process, by file of the package."""

from __future__ import annotations

import os
import signal
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from cold import vehicle_of
from warm import read_to_signals

import oncenter as oc

PACKAGE = f"{Path(str(oc.__file__)).parent}{os.sep}"
LOOK_EVERY_S = 0.001
OTHERS = "others"


def spent(log: Path, rounds: int) -> tuple[float, dict[str, float]]:
    """Seconds for reading and answering once, and the share of each file, the largest first."""
    truck, shares = oc.vehicle(vehicle_of(log)), defaultdict[str, float](float)
    oc.offset(read_to_signals(log), truck)  # imports
    with looks(shares):
        for _ in range(rounds):
            oc.offset(read_to_signals(log), truck)
    whole = sum(shares.values())
    return whole / rounds, {file: shares[file] / whole for file in sorted(shares, key=shares.__getitem__, reverse=True)}


@contextmanager
def looks(shares: dict[str, float]) -> Iterator[None]:
    """Samples periodically. The time since the last sample is assigned to the file whose function is running; a long
    library call, which cannot be sampled, counts for its caller."""
    last = time.perf_counter()

    def look(_: int, frame: FrameType | None) -> None:
        nonlocal last
        before, last = last, time.perf_counter()
        shares[_file_of(frame)] += last - before

    handler = signal.signal(signal.SIGALRM, look)
    signal.setitimer(signal.ITIMER_REAL, LOOK_EVERY_S, LOOK_EVERY_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, handler)


def _file_of(frame: FrameType | None) -> str:
    while frame is not None:
        file = frame.f_code.co_filename
        if file.startswith(PACKAGE):
            return file.removeprefix(PACKAGE)
        frame = frame.f_back
    return OTHERS
