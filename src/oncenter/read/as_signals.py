"""Samples of all sources become one table: `choose` takes a source a signal, `clock` resamples to one tick."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from oncenter.errors import OncenterError
from oncenter.read import choose, clock
from oncenter.read.cut_off import with_seconds
from oncenter.read.identity import NOT_STATED, Identity
from oncenter.read.samples import Samples
from oncenter.signals import Signals


def as_signals(
    path: Path,
    candidates: Sequence[Samples],
    take: Mapping[str, str],
    notes: list[str],
    identity: Identity = NOT_STATED,
) -> Signals:
    clock.refuse_time_out_of_range(candidates, path.name)
    chosen, sources = choose.choose(candidates, take, path.name, notes)
    if not chosen:
        raise OncenterError(
            f'all samples in {path.name} are "not available": {"; ".join(notes)}',
            code="missing_signal",
            needs=tuple(dict.fromkeys(samples.signal for samples in candidates)),
        )
    columns, rate = clock.to_one_tick(chosen, path.name, notes)
    time = columns["time_s"]
    if len(time) < 2:
        raise OncenterError(f"{path.name} is too short: at least 2 ticks are needed, got {len(time)}", code="too_short")
    words = with_seconds(notes, float(time[-1] - time[0]))
    return Signals(columns, sources, rate, os.fspath(path), words, identity.vin, identity.start_s)
