"""A truck's verdict: the decision of `oncenter.verdict` on its offset from all its drives, and its second line."""

from __future__ import annotations

from oncenter.estimates.cause import Pull
from oncenter.fleet.offset_now import Offset
from oncenter.truck.zero import Zero
from oncenter.verdict.decision import Case, Interval, decide
from oncenter.verdict.second_line import align_first, possible_pull
from oncenter.verdict.states import Code

_OF_OFFSET: tuple[Code, ...] = ("recalibrate", "over", "within", "undecided")


def own_interval(offset: Offset) -> Interval:
    """From these drives, deg."""
    return offset.value - 1.96 * offset.spread_sd, offset.value + 1.96 * offset.spread_sd


def deciding_interval(offset: Offset) -> Interval:
    """With all causes in it where the offset is not valid."""
    return own_interval(offset) if offset.is_valid else (offset.low, offset.high)


def state_of(at_fault: Code | None, offset: Offset | None, zero: Zero, limit_deg: float) -> Code:
    """`at_fault` is the newest drive's, where no limit changes it."""
    if offset is None:
        return decide(Case(at_fault, zero, False, False, None, None), limit_deg)
    own, whole = own_interval(offset), (offset.low, offset.high)
    return decide(Case(at_fault, zero, offset.is_valid, offset.has_evidence, own, whole), limit_deg)


def second_line(state: Code, offset: Offset | None, drives: int, limit_deg: float) -> str | None:
    """A pull that is measured, or that could move the offset across the limit; None where there is none."""
    if offset is None or state not in _OF_OFFSET:
        return None
    causes = "a pull or crosswind" if drives == 1 else "a pull"
    measured = align_first(Pull(offset.pull, offset.pull_sd, offset.pull_effect) if drives > 1 else None)
    around_deg = 1.96 * offset.not_identifiable_sd
    return (
        measured
        or possible_pull(causes, around_deg, own_interval(offset), (offset.low, offset.high), limit_deg)
        or None
    )
