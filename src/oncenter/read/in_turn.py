"""Sources of a signal that give it one after another become one: a sender that changes its address during the drive,
a channel of a recording that was begun again, parts of a bus's recording in several files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from oncenter.read.samples import Samples

JOINED_COLUMN = "column of a file"
_BY_NAME = ("column", JOINED_COLUMN)  # kinds of table columns: only those of one name are one source


def in_turn(candidates: Sequence[Samples], taken: Collection[str], notes: list[str]) -> list[Samples]:
    """
    Args:
        taken: signals of which the user chose a source: those stay apart; "all" for all signals.
    """
    groups: dict[tuple[object, ...], list[Samples]] = {}
    for samples in candidates:
        apart = samples.signal in taken or "all" in taken or samples.not_available == len(samples.values)
        name = samples.description if samples.kind in _BY_NAME else ""
        key = (id(samples),) if apart else (samples.signal, samples.kind, samples.rank, name)
        groups.setdefault(key, []).append(samples)
    found = []
    for group in groups.values():
        parts = sorted(group, key=lambda samples: _span(samples)[0]) if len(group) > 1 else group
        if len(parts) > 1 and all(_span(one)[1] < _span(other)[0] for one, other in pairwise(parts)):
            found.append(_joined(parts))
            notes += _changes(parts)
        else:
            found += group
    return found


def _span(samples: Samples) -> tuple[float, float]:
    """Times of the first and last number, in the order of time."""
    times = samples.time[~np.isnan(samples.values)]
    return float(times.min()), float(times.max())


def _joined(parts: Sequence[Samples]) -> Samples:
    """One source. Rows without a number are kept only while their part gives numbers."""
    kept = []
    for part in parts:
        first, last = _span(part)
        kept.append(~np.isnan(part.values) | ((part.time >= first) & (part.time <= last)))
    lost: Counter[str] = Counter()
    for part in parts:
        lost.update(part.lost)
    counts = [part.in_file for part in parts]
    outside = [part.beyond.rows if part.beyond else np.zeros(len(part.time), np.bool_) for part in parts]
    beyond = next((part.beyond for part in parts if part.beyond is not None), None)
    descriptions = list(dict.fromkeys(part.description for part in parts))
    return replace(
        parts[0],
        time=np.concatenate([part.time[rows] for part, rows in zip(parts, kept, strict=True)]),
        values=np.concatenate([part.values[rows] for part, rows in zip(parts, kept, strict=True)]),
        description=", then ".join(descriptions),
        labels=tuple(dict.fromkeys(label for part in parts for label in part.labels)),
        steps=None,
        complete=False,
        lost=dict(lost),
        in_file=None if None in counts else sum(filter(None, counts)),
        beyond=beyond
        and replace(beyond, rows=np.concatenate([each[rows] for each, rows in zip(outside, kept, strict=True)])),
    )


def _changes(parts: Sequence[Samples]) -> list[str]:
    if len({part.description for part in parts}) == 1:
        return []
    begin = _span(parts[0])[0]
    said = [parts[0].description, *(f"after {_span(part)[0] - begin:.1f} s {part.description}" for part in parts[1:])]
    return [f"{parts[0].signal}: {', '.join(said)} send one after another, and are used as one source"]
