"""Decodes frames to samples: for a message that a DBC describes, the DBC replaces the J1939 layout."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from oncenter.read import dbc as databases
from oncenter.read import j1939
from oncenter.read.frames import Frames, Kept, Wanted, with_groups
from oncenter.read.left_out import left_out_frames
from oncenter.read.samples import Samples


def wanted_by(described: Sequence[databases.Definition]) -> Wanted:
    """The frames that carry signals, of J1939 and of the databases' messages."""
    described_pgns = frozenset(definition.pgn for definition in described if definition.pgn is not None)
    standard_ids = frozenset(definition.message.frame_id for definition in described if definition.pgn is None)
    return Wanted(frozenset(j1939.MESSAGES) | described_pgns, standard_ids)


def with_signals(frames: Frames, described: Sequence[databases.Definition]) -> int:
    """The number of wanted frames that `decode` uses."""
    if not described:
        return len(frames)
    having = with_groups(frames, j1939.MESSAGES)
    for definition in described:
        having |= databases.matching(definition, frames, described)
    return int(np.count_nonzero(having))


def without_long(kept: Kept, described: Sequence[databases.Definition], log: str, notes: list[str]) -> tuple[Kept, int]:
    """Without frames of more than eight bytes that no database describes, which no J1939 signal is in, and their
    number."""
    if kept.frames.more is None:
        return kept, 0
    long = kept.frames.length > 8
    for definition in described:
        long &= ~databases.matching(definition, kept.frames, described)
    count = int(np.count_nonzero(long))
    notes += left_out_frames(log, Counter(can_fd=count))
    return replace(kept, frames=kept.frames.where(~long)), count


def decode(kept: Kept, described: Sequence[databases.Definition], decoded: Sequence[Samples] = ()) -> list[Samples]:
    """Every signal of every source in frames; `decoded` are samples from channels of the same log."""
    by_dbc = databases.samples(kept, described)
    replaced = {each.name: j1939.MESSAGES[each.pgn].name for each in described if each.pgn in j1939.MESSAGES}
    described_signals = {(samples.signal, replaced.get(samples.kind, samples.kind)) for samples in by_dbc}
    if kept.frames.more is not None:
        kept = replace(kept, frames=kept.frames.where(kept.frames.length <= 8))
    known = [samples for samples in j1939.samples(kept) if (samples.signal, samples.kind) not in described_signals]
    return [*by_dbc, *decoded, *known]
