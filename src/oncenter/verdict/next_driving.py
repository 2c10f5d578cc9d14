"""The driving that an undecided answer lacks, and the reason."""

from __future__ import annotations

import math
from typing import NamedTuple

from oncenter.estimates.bounds import BOUNDS
from oncenter.estimates.estimates import Estimates
from oncenter.signals import DEGREE
from oncenter.verdict.accused import finding_of
from oncenter.verdict.left_out import first_loss
from oncenter.verdict.numbers import joined

_MINUTE_S = 60.0
# By reason of the gate beside the speed: the driving that it takes.
_INSTEAD = {
    "lateral_acceleration": "more slowly in bends",
    "curvature": "in wider bends",
    "longitudinal_acceleration": "at a steady speed",
    "bank": "on level roads",
    "steering_assist": "with the steering assistance off",
}
_TOO_WIDE = "The interval is still too wide."


class Driving(NamedTuple):
    """`wanted` continues "Undecided: "; `why` is a sentence."""

    wanted: str
    why: str


def next_driving(answer: Estimates) -> Driving:
    """The most pressing lack first."""
    lacks = (
        _values(answer),
        _signal(answer),
        _speed(answer),
        _gate(answer),
        _accelerometer(answer),
        _contradiction(answer),
        _loading(answer),
    )
    others = (
        _evidence(answer),
        _assistance(answer),
        _side(answer),
        _tighter_bends(answer),
        _settled(answer),
        _narrower(answer),
    )
    found = next(filter(None, (*lacks, *others)), None)
    return found or Driving(f"drive 10 more minutes {_both_sides(answer)}", _why_not_valid(answer))


def minutes(seconds: float) -> str:
    """ "1 more minute": whole ones, since nobody drives by seconds."""
    count = max(math.ceil(seconds / _MINUTE_S), 1)
    return f"{count} more minute{'' if count == 1 else 's'}"


def _speed_min_km_h(answer: Estimates) -> float:
    of = "joint_" if answer.method == "joint" else ""
    return 3.6 * answer.params[f"{of}speed_min_m_s"]


def _evidence_min_s(answer: Estimates) -> float:
    return answer.params["joint_evidence_min_s" if answer.method == "joint" else "offset_evidence_min_s"]


def _both_sides(answer: Estimates) -> str:
    return "with bends to both sides" if answer.method == "joint" else "nearly straight ahead"


def _values(answer: Estimates) -> Driving | None:
    """Many values of the log were left out."""
    loss = first_loss(answer)
    return Driving("correct the recording, then repeat the drive", loss) if loss else None


def _signal(answer: Estimates) -> Driving | None:
    """A signal that is missing for most of the time."""
    missing_s = answer.rejected_s.get("missing_signal", 0.0)
    if answer.used_s >= _evidence_min_s(answer) or missing_s < 0.5 * answer.duration_s:
        return None
    return Driving(
        "repeat the drive and log all signals",
        f"For {missing_s:.0f} s of {answer.duration_s:.0f} s a signal is missing.",
    )


def _speed(answer: Estimates) -> Driving | None:
    """Nothing used, and most of it for want of speed."""
    too_slow_s = answer.rejected_s.get("speed", 0.0)
    if answer.used_s > 0.0 or too_slow_s < 0.5 * answer.duration_s:
        return None
    faster = f"faster than {_speed_min_km_h(answer):.0f} km/h"
    return Driving(
        f"drive {minutes(_evidence_min_s(answer))} {faster}, {_both_sides(answer)}",
        f"The truck was not {faster} for long enough.",
    )


def _gate(answer: Estimates) -> Driving | None:
    finding = finding_of(answer, "gate_shut")
    return None if finding is None else Driving("check the signals, then repeat the drive", _sentence(finding.text))


def _accelerometer(answer: Estimates) -> Driving | None:
    """A zero that moves makes every later second doubtful."""
    finding = finding_of(answer, "lateral_acceleration_moves", "warning")
    if finding is None:
        return None
    return Driving("check the accelerometer, or answer without it (--no-accelerometer)", _sentence(finding.text))


def _contradiction(answer: Estimates) -> Driving | None:
    """More of the same drive decides nothing, a new one does."""
    if finding_of(answer, "drives_differ") is None:
        return None
    return Driving("drive once more", "The offset is not the same in all drives.")


def _loading(answer: Estimates) -> Driving | None:
    """Free play and offset are separated by lateral force to both sides."""
    left_s, right_s = answer.missing_loading_s
    sides = [(side, s) for side, s in (("left", left_s), ("right", right_s)) if s > 0.0]
    if answer.method != "joint" or not sides or _lacking_evidence_s(answer) > sum(s for _, s in sides) + _MINUTE_S:
        return None
    wanted = joined([f"{minutes(s)} of {side}-hand bends" for side, s in sides])
    if len(sides) == 2:
        why = "The bends so far were too few or too wide to load the steering to either side."
    else:
        why = f"Only {'right' if sides[0][0] == 'left' else 'left'}-hand bends loaded the steering so far."
    return Driving(f"drive {wanted}", f"{why} Free play and offset are not separated yet.")


def _lacking_evidence_s(answer: Estimates) -> float:
    return max(_evidence_min_s(answer) - answer.used_s, 0.0)


def _evidence(answer: Estimates) -> Driving | None:
    lacking_s = _lacking_evidence_s(answer)
    if lacking_s <= 0.0:
        return None
    reason = max(_INSTEAD, key=lambda name: answer.rejected_s.get(name, 0.0))
    is_of_speed = answer.rejected_s.get("speed", 0.0) >= answer.rejected_s.get(reason, 0.0)
    how = f"faster than {_speed_min_km_h(answer):.0f} km/h" if is_of_speed else _INSTEAD[reason]
    why = f"Only {answer.used_s:.0f} s of the drive were usable"
    if not is_of_speed:
        why += f", {answer.rejected_s[reason]:.0f} s were rejected for {reason.replace('_', ' ')}"
    return Driving(f"drive {minutes(lacking_s)} {how}, {_both_sides(answer)}", f"{why}.")


def _assistance(answer: Estimates) -> Driving | None:
    """A motor that seems to steer leaves the flank of the play unknown."""
    finding = finding_of(answer, "seems_steered")
    if finding is None:
        return None
    return Driving("drive 20 minutes without steering assistance, or log its status", _sentence(finding.text))


def _side(answer: Estimates) -> Driving | None:
    """An axle that may be set up for a crown to either side."""
    finding = finding_of(answer, "axle_may_be_set_up")
    if finding is None:
        return None
    wanted = "give the side of traffic in the vehicle file, or drive on other roads with bends to both sides"
    return Driving(wanted, _sentence(finding.text))


def _tighter_bends(answer: Estimates) -> Driving | None:
    if finding_of(answer, "no_understeer") is None:
        return None
    return Driving(
        "drive 5 more minutes with tighter bends to both sides",
        "Free play in gentle bends looks like oversteer, so offset and play are not separated yet.",
    )


def _settled(answer: Estimates) -> Driving | None:
    """A narrow interval that is not valid: the offset still moves, as after a late change, or a pull of usual size
    would move it farther than on any truck."""
    if not is_narrow(answer):
        return None
    whole = answer.offset.ci95
    if whole is not None and whole[1] - whole[0] > 2.0 * BOUNDS["offset"].half_width:
        around = 0.5 * (whole[1] - whole[0]) / DEGREE
        return Driving(
            "check the signals, then repeat the drive",
            f"With a usual pull and wind the interval is ± {around:.1f} deg.",
        )
    return Driving(f"drive 5 more minutes {_both_sides(answer)}", _why_not_valid(answer))


def is_narrow(answer: Estimates) -> bool:
    """Whether this drive's part of the interval is narrow enough for a valid offset."""
    joint = "drive_" if answer.method == "joint" else ""
    half_width = answer.offset_half_width_rad
    return half_width is not None and half_width <= answer.params[f"offset_{joint}half_width_max_rad"]


def _why_not_valid(answer: Estimates) -> str:
    if not is_narrow(answer):
        return _TOO_WIDE
    if any(change.kind != "bends" for change in answer.changes):
        return "The interval is narrow, but the offset changed late in the drive and is not confirmed since then."
    return "The interval is narrow, but the offset still moves from minute to minute."


def _narrower(answer: Estimates) -> Driving | None:
    """The action that narrows the drive's part of the interval most."""
    if not answer.next_driving:
        return None
    wanted = answer.next_driving[0].partition(", or")[0]
    return Driving(wanted if wanted.startswith("drive") else f"{wanted}, then drive {_both_sides(answer)}", _TOO_WIDE)


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."
