"""Samples of all sources become one table: `choose` takes a source a signal, `clock` resamples to one tick."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from oncenter.account import Account, FileAccount, SignalAccount
from oncenter.errors import OncenterError
from oncenter.files.file_name import printable
from oncenter.read import choose, clock
from oncenter.read.frames import Column
from oncenter.read.identity import NOT_STATED, Identity
from oncenter.read.in_turn import in_turn
from oncenter.read.left_out import counts_of, with_seconds
from oncenter.read.samples import Samples
from oncenter.read.set_back import SetBack
from oncenter.signals import CLOCK_STEP_S, SIGNALS, Signals, Source


@dataclass(frozen=True)
class FrameCount:
    """Data frames in a log, and those among them with a signal."""

    in_file: int
    with_signal: int


def as_signals(
    path: Path,
    candidates: Sequence[Samples],
    take: Mapping[str, str],
    notes: list[str],
    identity: Identity = NOT_STATED,
    frames: FrameCount | None = None,
    set_back: SetBack | None = None,
) -> Signals:
    """
    Args:
        frames: of a log of frames.
        set_back: of frames: the times of the candidates are on one clock, and this gives the recorded ones.

    Raises:
        OncenterError: no signal has a sample, the times are impossible, or the sources of a signal disagree.
    """
    counts = counts_of(notes)
    clock.refuse_time_out_of_range(candidates, path.name)
    candidates = in_turn(candidates, take, notes)
    chosen, sources = choose.choose(candidates, take, path.name, notes)
    if not chosen:
        raise OncenterError(
            f'all samples in {path.name} are "not available": {"; ".join(notes)}',
            code="missing_signal",
            needs=tuple(dict.fromkeys(samples.signal for samples in candidates)),
        )
    ticks = clock.to_one_tick(chosen, path.name, notes, set_back)
    if len(ticks.columns["time_s"]) < 2:
        raise OncenterError(
            f"{path.name} is too short: at least 2 ticks are needed, got {len(ticks.columns['time_s'])}",
            code="too_short",
        )
    notes += _forward_steps(ticks.columns["time_s"], path.name)
    account = Account(
        _file_account(frames, candidates, ticks.accounts, counts), _with_silent(ticks.accounts, candidates)
    )
    signals = Signals(
        ticks.columns,
        {signal: _printable(source) for signal, source in sources.items()},
        ticks.rate_hz,
        os.fspath(path),
        (),
        identity.vin,
        identity.start_s,
        account,
    )
    return signals.replaced(notes=tuple(map(printable, with_seconds(notes, signals.duration_s))))


def _printable(source: Source) -> Source:
    """Names of columns, channels and topics are those of the log, and may hold any character."""
    return replace(
        source,
        description=printable(source.description),
        others=tuple(map(printable, source.others)),
        place=printable(source.place),
    )


def _forward_steps(time: Column, log: str) -> list[str]:
    steps = np.diff(time)
    steps = steps[steps > CLOCK_STEP_S]
    if not len(steps):
        return []
    times = "once" if len(steps) == 1 else f"{len(steps)} times"
    return [
        f"the time of {log} steps forward {times}, by up to {float(steps.max()) / CLOCK_STEP_S:.6g} days: the clock "
        "was set, or two logs are behind one another; both parts are used"
    ]


def _with_silent(accounts: Mapping[str, SignalAccount], candidates: Sequence[Samples]) -> dict[str, SignalAccount]:
    """The accounts in the order of the signals, also of those of which no source could be used."""
    every = dict(accounts)
    for samples, _ in choose.without_number(candidates):
        every[samples.signal] = clock.account_of(samples, 0, 0, samples.lost)
    return {signal: every[signal] for signal in SIGNALS if signal in every}


def _file_account(
    frames: FrameCount | None,
    candidates: Sequence[Samples],
    accounts: Mapping[str, SignalAccount],
    counts: Mapping[str, int],
) -> FileAccount:
    if frames is not None and frames.in_file:
        without = frames.in_file - frames.with_signal
        left_out = {**counts, "no_signal": without} if without else dict(counts)
        return FileAccount("frames", frames.in_file + sum(counts.values()), frames.with_signal, left_out)
    if all(samples.kind == "column" for samples in candidates):
        rows, repeated = len(candidates[0].time), clock.rows_not_later(candidates[0])
        left_out = {**counts, "time_not_later": repeated} if repeated else dict(counts)
        return FileAccount("rows", rows + sum(counts.values()), rows - repeated, left_out)
    left_out = Counter(counts)
    left_out["other_source"] = sum(map(clock.samples_in_file, candidates)) - sum(of.in_file for of in accounts.values())
    for account in accounts.values():
        left_out.update(account.left_out)
    used = sum(account.used + account.superseded for account in accounts.values())
    return FileAccount("samples", used + left_out.total(), used, dict(+left_out))
