"""Completeness of a recording: gaps without any signal, and signals that begin late or end early."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import words
from oncenter.signals import CLOCK_STEP_S, SIGNALS, Signals

_HOLE_MIN_S = 1.0  # a shorter one is lost frames
_LOST_SHARE_MAX = 0.05  # of the time from first to last tick; more is a warning
_END_MIN_S, _END_PERIODS = 0.1, 2.5  # senders do not begin in one tick; reading bridges shorter gaps
_MINUTES_FROM_S = 120.0


@dataclass(frozen=True)
class Recorded:
    """`whole_s` from the first tick to the last, of which `recorded_s` outside the gaps; `holes_s`: the gaps in order,
    each longer than a second."""

    whole_s: float
    recorded_s: float
    holes_s: tuple[float, ...]


def recorded(signals: Signals) -> Recorded:
    """The recorded time of one drive; ticks with decreasing time count as recorded, steps of the clock as nothing."""
    time = signals.columns["time_s"][_has_a_number(signals)]
    steps = np.diff(time)
    steps = steps[steps <= CLOCK_STEP_S]
    holes = steps[steps > _HOLE_MIN_S] - 1.0 / signals.rate_hz
    whole_s = float(steps[steps > 0.0].sum())
    return Recorded(whole_s, whole_s - float(holes.sum()), tuple(map(float, holes)))


def recording_findings(signals: Signals, names: Sequence[str]) -> list[Finding]:
    """Gaps of a drive, and the given signals that begin late or end early."""
    return [*_holes(recorded(signals)), *_ends(signals, names)]


def _has_a_number(signals: Signals) -> npt.NDArray[np.bool_]:
    having = np.zeros(signals.ticks, bool)
    for column in signals.columns:
        if column != "time_s" and not having.all():
            having |= ~np.isnan(signals.columns[column])
    return having


@finding("recording_has_holes", "warning", "s")
def _holes(found: Kind, drive: Recorded) -> list[Finding]:
    if not drive.holes_s:
        return []
    unit, per_unit = ("minutes", 60.0) if drive.whole_s >= _MINUTES_FROM_S else ("seconds", 1.0)
    of_whole = f"{_short(drive.recorded_s / per_unit)} of {_short(drive.whole_s / per_unit)} {unit} are recorded"
    longest = f"{_short(max(drive.holes_s))} s"
    count = len(drive.holes_s)
    holes = f"there is 1 gap of {longest}" if count == 1 else f"there are {count} gaps of up to {longest}"
    lost_s = sum(drive.holes_s)
    severity = "warning" if lost_s > _LOST_SHARE_MAX * drive.whole_s else "info"
    action = ". Check the logger" if severity == "warning" else ""
    return [found(f"{of_whole}; {holes}. The offset uses the recorded time only{action}", lost_s, severity=severity)]


def _ends(signals: Signals, names: Sequence[str]) -> list[Finding]:
    """The late and early ends of signals: senders and logger start and stop one after the other."""
    having = _has_a_number(signals)
    time = signals.columns["time_s"]
    if not having.any():
        return []
    first_s, last_s = time[having][[0, -1]]
    effect = partial(_effect, last_s - first_s)
    found: list[Finding] = []
    for name in names:
        column = SIGNALS[name].column
        if column not in signals.columns:
            continue
        there = time[~np.isnan(signals.columns[column])]
        if not len(there):
            continue
        rate_hz = signals.sources[name].rate_hz if name in signals.sources else 0.0
        reported_from_s = max(_END_MIN_S, _END_PERIODS / rate_hz if rate_hz > 0.0 else 0.0)
        late_s, early_s = float(there[0] - first_s), float(last_s - there[-1])
        if late_s > reported_from_s:
            found.append(_began_late(name, late_s, effect(late_s)))
        if early_s > reported_from_s:
            found.append(_ended_early(name, early_s, effect(early_s)))
    return found


@finding("signal_began_late", "info", "s")
def _began_late(found: Kind, name: str, late_s: float, effect: str) -> Finding:
    return found(f"the {words(name)} signal starts {_short(late_s)} s after the start of the log. {effect}", late_s)


@finding("signal_ended_early", "info", "s")
def _ended_early(found: Kind, name: str, early_s: float, effect: str) -> Finding:
    return found(f"the {words(name)} signal stops {_short(early_s)} s before the end of the log. {effect}", early_s)


def _effect(whole_s: float, lost_s: float) -> str:
    """The effect on the offset of time without a signal at an end of the log."""
    if lost_s > _LOST_SHARE_MAX * whole_s:
        return "The offset uses only the time with this signal. Check its sender and the logger"
    return "That time is not used; the offset is not affected"


def _short(number: float) -> str:
    """Whole from 10 on; below with one or two decimals."""
    return f"{number:.{0 if number >= 9.95 else 1 if number >= 0.95 else 2}f}"
