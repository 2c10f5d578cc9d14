"""The one decision on a straight-ahead offset: of a drive, of several logs, of a truck of a fleet, of a live bus.

The interval from the driving itself decides about the sensor. The causes that no single drive identifies (pull, wind,
axle set-up) are in the whole interval, and are a second line of the verdict.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from oncenter.estimates.estimates import HALF_TURN_RAD
from oncenter.signals import DEGREE
from oncenter.truck.zero import Zero
from oncenter.verdict.states import Code

Interval = tuple[float, float]  # deg, the lower end first
FINEST_DIGITS = 8  # after the decimal point, that are ever printed: an end is at the limit if it reads so

_PRINTED_FROM_DEG = 0.05  # less rounds to zero

# Faults of the angle sensor by the core's names that a log with a wrong or a missing signal shows as well.
OF_SIGNAL_OR_SENSOR = ("lost", "stuck", "jumped", "wrong_sign")


@dataclass(frozen=True)
class Case:
    """The facts that decide.

    Attributes:
        at_fault: as `at_fault` gives it, of the newest drive.
        zero: of the angle sensor.
        is_valid: the offset's status: its number is exact enough to be set.
        has_evidence: the driving suffices for an interval that holds; of every valid offset.
        own: interval of the offset from this drive, or from these logs; None without an offset.
        whole: with the causes that no single drive identifies.
        has_play: the interval includes free play (method joint).
        own_by_priors: `own` by other priors inside it, each halved and doubled.
    """

    at_fault: Code | None
    zero: Zero
    is_valid: bool
    has_evidence: bool
    own: Interval | None
    whole: Interval | None
    has_play: bool = True
    own_by_priors: tuple[Interval, ...] = ()


def decide(case: Case, limit_deg: float) -> Code:
    """The state of the offset's verdict; `limit_deg` in deg, either sign. Exact numbers decide, not printed ones."""
    if case.at_fault is not None:
        return case.at_fault
    if case.zero == "relative":
        return "no_correction"
    if case.zero == "moves":
        return "signal_or_sensor"
    if case.own is None or case.whole is None:
        return "no_offset"
    if not case.is_valid:  # a wide interval decides only with all causes in it, and its number is not set
        return standing(case.whole, limit_deg) if case.has_evidence else "undecided"
    place = standing(case.own, limit_deg)
    if any(crosses(case.own, by, limit_deg) for by in case.own_by_priors):
        return "undecided"
    return place if place != "over" else _over(case.own, case.whole, case.has_play)


def crosses(interval: Interval, by_prior: Interval, limit_deg: float) -> bool:
    """Whether another prior moves an interval (deg) across the limit, by more than is printed."""
    moved = max(abs(to - at) for at, to in zip(interval, by_prior, strict=True))
    return moved >= _PRINTED_FROM_DEG and standing(interval, limit_deg) != standing(by_prior, limit_deg)


def at_fault(fault: str, is_invalid: bool, *, signals: bool, stuck_only: bool) -> Code | None:
    """The state that no limit changes. The file and the assignment of its signals are suspected before the truck.

    Args:
        fault: of the angle sensor, "none" or one of the core's names.
        is_invalid: the offset is.
        signals: an error accuses a signal.
        stuck_only: of standing still only, as a stuck sensor does.
    """
    is_ambiguous = fault in OF_SIGNAL_OR_SENSOR
    if signals and not (is_ambiguous and stuck_only):
        return "check_signal"
    if fault != "none":
        return "signal_or_sensor" if is_ambiguous else "repair"
    return "check_signal" if is_invalid else None


def _over(own: Interval, whole: Interval, has_play: bool) -> Code:
    """An offset is set if free play is in its interval, if no pull alone explains it, and if it is below half a
    turn."""
    is_sure = has_play and not whole[0] <= 0.0 <= whole[1] and not is_whole_turns(sum(own) / 2.0)
    return "recalibrate" if is_sure else "over"


def standing(interval: Interval, limit: float) -> Literal["over", "within", "undecided"]:
    """Whether the whole interval is at the limit or beyond, on one side; within it; or neither. All in one unit."""
    low, high = (round(end, FINEST_DIGITS) for end in interval)  # as it can be printed
    if low >= limit or high <= -limit:
        return "over"
    return "within" if max(-low, high) < limit else "undecided"


def is_whole_turns(offset_deg: float) -> bool:
    return abs(offset_deg) * DEGREE >= HALF_TURN_RAD
