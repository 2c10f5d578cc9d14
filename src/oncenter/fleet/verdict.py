"""A truck's verdict: the decision of `oncenter.verdict` on its offset from all its drives, and its second line."""

from __future__ import annotations

from oncenter.estimates.cause import Pull
from oncenter.fleet.offset_now import Offset
from oncenter.signals import DEGREE
from oncenter.truck.zero import Zero
from oncenter.verdict.decision import Case, Interval, decide
from oncenter.verdict.second_line import align_first, possible_pull
from oncenter.verdict.states import Code

_OF_OFFSET: tuple[Code, ...] = ("recalibrate", "over", "within", "undecided")


def deciding_interval(offset: Offset) -> Interval:
    """With all causes in it where the offset is not valid."""
    return offset.own if offset.is_valid else offset.whole


def state_of(at_fault: Code | None, offset: Offset | None, zero: Zero, limit_deg: float) -> Code:
    """`at_fault` is the newest drive's, where no limit changes it."""
    if offset is None:
        return decide(Case(at_fault, zero, False, False, None, None), limit_deg)
    evidence = offset.is_valid, offset.has_evidence, offset.own, offset.whole
    return decide(Case(at_fault, zero, *evidence, own_by_priors=offset.own_by_priors), limit_deg)


def second_line(state: Code, offset: Offset | None, drives: int, limit_deg: float) -> str | None:
    """A pull that is measured, or that could move the offset across the limit; None where there is none."""
    if offset is None or state not in _OF_OFFSET:
        return None
    truck = offset.truck
    causes = "a pull or crosswind" if drives == 1 else "a pull"
    measured = align_first(Pull(truck.pull, truck.pull_sd, truck.pull_effect / DEGREE) if drives > 1 else None)
    around_deg = 1.96 * offset.not_identifiable_sd
    return measured or possible_pull(causes, around_deg, offset.own, offset.whole, limit_deg) or None
