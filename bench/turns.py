"""Runs contenders in turns, so that a busy machine slows all of them equally."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import TypeVar

Key = TypeVar("Key")


def best_of(
    field: Mapping[Key, Callable[[], object]], rounds: int, clock: Callable[[], float] = time.thread_time
) -> dict[Key, float]:
    """Seconds of each contender, best of its rounds, by CPU time of this thread or by another clock."""
    best = dict.fromkeys(field, math.inf)
    for _ in range(rounds):
        for key, work in field.items():
            began = clock()
            work()
            best[key] = min(best[key], clock() - began)
    return best
