"""The second line of the offset's verdict: a pull, free play that the method leaves out, and the last change."""

from __future__ import annotations

from oncenter.estimates.by_priors import PRIORS_IN_WORDS, OffsetBy
from oncenter.estimates.cause import Pull, in_words, together_rad
from oncenter.estimates.changes import Change
from oncenter.estimates.estimates import Estimates
from oncenter.files.file_name import printable
from oncenter.findings import PLAY_STANDARD_DEG
from oncenter.signals import DEGREE
from oncenter.verdict.decision import Interval, crosses, standing

_STRONG_M_S2 = 0.2  # by a steady crosswind of 8 m/s on 9 m^2 or 6 m/s on 25 m^2, of a truck of 9 t


def align_first(pull: Pull | None) -> str:
    """Of a measured pull; empty without one."""
    if pull is None or not pull.is_measured:
        return ""
    return f"Align first: {pull.words()}, which moves the offset by {pull.effect_deg:.1f} deg."


def by_pull(answer: Estimates, limit_deg: float) -> str:
    """A pull that is measured, or one that would move the interval across the limit; else a strong wind that would."""
    own, whole, causes = answer.offset_ci95_drive, answer.offset.ci95, in_words(answer.not_identifiable)
    measured = align_first(answer.pull)
    if measured or not causes or own is None or whole is None:
        return measured
    drives = "one drive" if len(answer.drives) == 1 else "these logs"
    around_deg = 1.96 * together_rad(answer.not_identifiable) / DEGREE
    usual = possible_pull(
        f"{causes}, which {drives} cannot separate,", around_deg, in_deg(own), in_deg(whole), limit_deg
    )
    return usual if "wind" in usual else f"{usual} {_strong_wind(answer, limit_deg)}".strip()


def _strong_wind(answer: Estimates, limit_deg: float) -> str:
    """A steady wind or a pull, rarer than those of the interval, that would explain an offset over the limit."""
    own = answer.offset_ci95_drive
    if own is None or not any(cause.cause == "mean_wind" for cause in answer.not_identifiable):
        return ""
    by_rad = abs(answer.offset_per_acceleration) * _STRONG_M_S2
    around = (own[0] - by_rad, own[1] + by_rad)
    if standing(in_deg(own), limit_deg) != "over" or standing(in_deg(around), limit_deg) == "over":
        return ""
    return (
        "A strong wind from one side during the whole drive, or a large pull, could explain it "
        f"(± {by_rad / DEGREE:.1f} deg): compare with a drive on a calm day."
    )


def possible_pull(causes: str, around_deg: float, own: Interval, whole: Interval, limit_deg: float) -> str:
    """The 95 % half-width by the causes; empty where the whole interval is on the same side of the limit."""
    if standing(own, limit_deg) == standing(whole, limit_deg):
        return ""
    return f"{causes[:1].upper()}{causes[1:]} could add ± {around_deg:.1f} deg."


def by_priors(answer: Estimates, limit_deg: float) -> str:
    """The priors on which the verdict depends: an interval is on another side of the limit where they are halved or
    doubled."""
    now = answer.offset_now
    if now is None:
        return ""
    found = [
        PRIORS_IN_WORDS[each.prior]
        for each in answer.by_priors
        if any(_depends(now, now + moves, limit_deg, each.inside_drive) for moves in (each.halved, each.doubled))
    ]
    if not found:
        return ""
    named = found[0] if len(found) == 1 else f"{', '.join(found[:-1])} and {found[-1]}"
    return f"This depends on the prior of {named}: half or twice of it would move an interval across the limit."


def _depends(now: OffsetBy, by: OffsetBy, limit_deg: float, inside_drive: bool) -> bool:
    """Whether an interval crosses the limit; the whole one of an offset over the limit also if it crosses zero."""
    own, whole, by_whole = in_deg(now.ci95_drive), in_deg(now.ci95), in_deg(by.ci95)
    if crosses(whole, by_whole, limit_deg) or (inside_drive and crosses(own, in_deg(by.ci95_drive), limit_deg)):
        return True
    is_over = standing(own, limit_deg) == "over"
    return is_over and (whole[0] <= 0.0 <= whole[1]) != (by_whole[0] <= 0.0 <= by_whole[1])


def in_deg(interval: Interval) -> Interval:
    return interval[0] / DEGREE, interval[1] / DEGREE


def without_play(answer: Estimates) -> str:
    if answer.method == "joint":
        return ""
    return (
        f"The interval of the method {answer.method} does not include free play: {PLAY_STANDARD_DEG:g} deg of play can "
        f"shift the offset by up to {PLAY_STANDARD_DEG / 2:g} deg."
    )


def last_change(answer: Estimates) -> str:
    """The last change of the offset that lasted."""
    lasting = [change for change in answer.changes if _has_lasted(change)]
    if not lasting:
        return ""
    last = lasting[-1]
    assert last.size_rad is not None
    log = printable(last.log)
    when = f"{last.into_log_s / 60:.1f} min into" if last.into_log_s > 0.0 else "before"
    size, before, after = (
        round(angle / DEGREE, 1) + 0.0 for angle in (last.size_rad, last.offset_before_rad, last.offset_after_rad)
    )
    return (
        f"The offset changed by {size:+.1f} deg {when} {log}, from {before:+.1f} to {after:+.1f} deg: use the "
        "value after."
    )


def _has_lasted(change: Change) -> bool:
    return change.size_rad is not None and abs(change.size_rad) >= 1.96 * (change.sd_rad or 0.0)
