"""Files of one drive, put together by time: several buses, or loggers, that were recorded each in a file of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.read.as_signals import FrameCount
from oncenter.read.identity import NOT_STATED, Identity
from oncenter.read.in_turn import JOINED_COLUMN, in_turn
from oncenter.read.samples import Samples
from oncenter.read.set_back import SetBack
from oncenter.utc import EPOCH_S

WITHOUT_SIGNALS = ("missing_signal", "not_j1939", "empty_log")  # codes for a file that another one may complete


class Content(NamedTuple):
    """Sources in a log, its truck, and of a log of frames their number and their clock."""

    candidates: list[Samples]
    about: Identity = NOT_STATED
    frames: FrameCount | None = None
    set_back: SetBack | None = None


def joined(contents: Sequence[tuple[Path, Content]], take: Mapping[str, str], notes: list[str]) -> Content:
    """One drive of several files. The same source in files after one another is one source, in files beside one
    another it has the name of the file.

    Raises:
        OncenterError: "different_trucks"; "no_common_time": some files have times since 1970, others do not.
    """
    given = [(path, content._replace(candidates=_on_one_clock(path, content, contents))) for path, content in contents]
    file_of: dict[int, str] = {}
    candidates = []
    for path, content in given:
        for each in content.candidates:
            kind = JOINED_COLUMN if each.kind == "column" else each.kind
            candidates.append(replace(each, kind=kind, labels=(*each.labels, path.name.lower())))
            file_of[id(candidates[-1])] = path.name
    candidates = in_turn(candidates, take, notes)
    count = Counter((each.signal, each.description) for each in candidates)
    candidates = [
        replace(each, description=f"{each.description} in {file_of[id(each)]}")
        if count[each.signal, each.description] > 1 and id(each) in file_of
        else each
        for each in candidates
    ]
    found = {each.signal for each in candidates}
    notes[:] = [
        note for note in dict.fromkeys(notes) if not (note.split(":")[0] in found and ": [signals] names" in note)
    ]
    notes.append(f"{', '.join(path.name for path, _ in given)} were put together by time")
    frames = [content.frames for _, content in given]
    total = FrameCount(sum(each.in_file for each in frames if each), sum(each.with_signal for each in frames if each))
    return Content(candidates, _one_truck(given), None if None in frames else total)


def _one_truck(contents: Sequence[tuple[Path, Content]]) -> Identity:
    named = {content.about.vin: path for path, content in contents if content.about.vin is not None}
    if len(named) > 1:
        (vin, path), (other_vin, other), *_ = named.items()
        raise OncenterError(
            f"the files are of different trucks: {path} has VIN {vin}, {other} has VIN {other_vin}; give --join only "
            "files of one drive",
            code="different_trucks",
            exit_code=WRONG_USAGE,
        )
    starts = (content.about.start_s for _, content in contents if content.about.start_s is not None)
    return Identity(next(iter(named), None), next(starts, None))


def _on_one_clock(path: Path, content: Content, every: Sequence[tuple[Path, Content]]) -> list[Samples]:
    """The candidates with times since 1970 if another file has those and this file states its begin."""
    if not any(map(_is_dated, (other for _, other in every))) or _is_dated(content):
        return content.candidates
    start_s = content.about.start_s
    if start_s is None:
        dated = next(other.name for other, its in every if _is_dated(its))
        raise OncenterError(
            f"{path.name} has times since its begin, and {dated} since 1970, so they cannot be put together by time: "
            "export both with the date",
            code="no_common_time",
        )
    times = {id(each.time): each.time + start_s for each in content.candidates}
    return [replace(each, time=times[id(each.time)], steps=None) for each in content.candidates]


def _is_dated(content: Content) -> bool:
    return any(len(each.time) and float(np.nanmin(each.time)) > EPOCH_S for each in content.candidates)
