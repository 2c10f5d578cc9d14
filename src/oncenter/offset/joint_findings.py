"""What the joint method alone can tell of a drive: play, where the steering unloads, what changed, what is lacking.

Degrees here: findings are for people and files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from oncenter import _core
from oncenter.offset.changes import Change
from oncenter.offset.core_findings import status_of
from oncenter.offset.findings import PLAY_STANDARD_DEG, Finding, from_table
from oncenter.signals import DEGREE, STANDARD_GRAVITY

# Thresholds for speaking up, ours.
_UNLOADING_WORTH_TELLING_M_S2 = 0.1  # half a usual crown
_BANK_MOVED_M_S2 = 0.35  # between two minutes' means: bench/effects.py, rows `none` and `accelerometer_drift`
_OFFSET_TAKEN_OUT_DEG = 0.5  # a sender that corrects itself ends so near to zero
_OFFSET_LARGE_DEG = 1.0  # and had something to correct
_PART_WORTH_TELLING = 0.25  # of the half-width
_WHEELBASE_WORTH_TELLING = 0.04  # share: tyres and load move the one of (10) by less


def joint_findings(
    native: Mapping[str, Any],
    params: Mapping[str, float],
    changes: Sequence[Change],
    *,
    steering_ratio: float,
    wheelbase_m: float,
    traffic_sign: float,
) -> Iterator[Finding | None]:
    """Those of the joint method on one answer of the core; None for what is not worth telling.

    Args:
        native: the core's oc_answer as a dict, SI and rad.
        params: in force.
        changes: that the drive proved.
        steering_ratio: near the centre.
        wheelbase_m: as the vehicle file has it, (10) applied.
        traffic_sign: 1 where traffic keeps right, -1 left, 0 unknown.
    """
    yield from map(_change, changes)
    yield _play(native)
    other_side = _crown(native, params, traffic_sign)
    yield _unloading(native, params, steering_ratio, 0.0 if other_side else traffic_sign)
    yield other_side
    yield _accelerometer_moves(native, params)
    yield _wheelbase(native, steering_ratio, wheelbase_m)
    yield _evidence(native, params)
    yield _unseen_flank(native, params)
    yield _no_understeer(native, params)
    yield _interval(native, params, steering_ratio)


def _change(change: Change) -> Finding | None:
    """None for one of the offset that did not last: what it is now may be what it was."""
    when = f"{change.into_log_s / 60:.1f} min into {change.log}"
    if change.size_rad is None or change.sd_rad is None:
        return from_table(
            "bends_changed",
            f"{when} bends began to take another angle, as after loading or lifting an axle: the offset is not "
            "affected, the understeer gradient was learned anew",
            change.into_log_s,
        )
    before, after = change.offset_before_rad / DEGREE, change.offset_after_rad / DEGREE
    size, half_width = change.size_rad / DEGREE, 1.96 * change.sd_rad / DEGREE
    if abs(size) < half_width:
        return None
    course = f"by {size:+.1f} +-{half_width:.1f} deg, from {before:+.1f} to {after:+.1f} deg"
    if abs(after) < _OFFSET_TAKEN_OUT_DEG and abs(before) > _OFFSET_LARGE_DEG:
        return from_table(
            "offset_corrected_by_sender",
            f"{when} the offset began to change {course}: the sender corrects its angle itself, or was calibrated; "
            "do not correct it a second time",
            size,
        )
    if change.kind == "straight_ahead":
        return from_table(
            "straight_ahead_moved",
            f"{when} the steering wheel angle that drives straight changed {course}, as after loading or unloading "
            "(the ride height steers), or in a lasting side wind; the sensor may have moved, too, if it stays so",
            size,
        )
    return from_table(
        "offset_changed",
        f"{when} the offset changed {course}: the sensor or the steering wheel was remounted, or the wheels aligned",
        size,
    )


def _play(native: Mapping[str, Any]) -> Finding | None:
    play = native["backlash"]
    value = play["value"] / DEGREE
    if status_of(play) != "valid" or value < PLAY_STANDARD_DEG:
        return None
    sure = value - 1.96 * play["standard_deviation"] / DEGREE > PLAY_STANDARD_DEG
    return from_table(
        "steering_play",
        f"{value:.1f} deg of on-centre hysteresis (play and friction wind-up) at the steering wheel "
        f"{'is beyond' if sure else 'is about'} the {PLAY_STANDARD_DEG:g} deg of the maintenance standard: "
        "look for worn joints",
        value,
    )


def _unloading(
    native: Mapping[str, Any], params: Mapping[str, float], steering_ratio: float, traffic_sign: float
) -> Finding | None:
    """Where the side force is without effect on the steering, when that is not where the accelerometer reads zero."""
    found = native["unloading_acceleration"]
    a_0, half_width = found["value"], 1.96 * found["standard_deviation"]
    if (
        not params["use_accelerometer"]
        or status_of(found) != "valid"
        or abs(a_0) - half_width < _UNLOADING_WORTH_TELLING_M_S2
    ):
        return None
    text = (
        f"the steering unloads where the accelerometer reads {a_0:+.2f} +-{max(half_width, 0.01):.2f} m/s^2, not at "
        "zero: its bias, wheel alignment (the truck pulls) or a steady side wind, which one drive cannot tell apart"
    )
    crown = traffic_sign * params["crown_m_s2"]
    doubt = 1.96 * math.hypot(found["standard_deviation"], params["crown_sd_m_s2"])
    if crown != 0.0 and abs(a_0 - crown) < doubt:
        moved = steering_ratio * native["understeer_gradient"]["value"] * a_0 / DEGREE
        text += (
            f"; it may also be an axle set up to unload on the crown of the road, about {crown:+.1f} m/s^2 here: "
            f"then the offset is {abs(moved):.1f} deg {'less' if moved > 0 else 'more'}"
        )
    return from_table("unloading_off_zero", text, a_0)


def _crown(native: Mapping[str, Any], params: Mapping[str, float], traffic_sign: float) -> Finding | None:
    """Roads that fell to the other side than the vehicle file's traffic has them: what the accelerometer read beyond
    where the steering unloads."""
    unloads = native["unloading_acceleration"]
    believes = params["use_accelerometer"] and traffic_sign * params["crown_m_s2"] != 0.0
    knows_bank = status_of(native["yaw_rate_bias"]) == "valid"  # by which a_y - r*v is off
    if not believes or not knows_bank or status_of(unloads) != "valid":
        return None
    fell = native["bank_mean"] - unloads["value"]
    doubt = 1.96 * math.hypot(unloads["standard_deviation"], params["pull_sd_m_s2"], params["wind_sd_m_s2"])
    if -traffic_sign * fell < doubt:
        return None
    percent = 100.0 / STANDARD_GRAVITY
    seen, believed = ("left", "right") if traffic_sign > 0.0 else ("right", "left")
    return from_table(
        "roads_fall_to_other_side",
        f"this drive's roads fell to the {seen}, by {abs(fell) * percent:.1f} +-{doubt * percent:.1f} %, and where "
        f"traffic keeps {believed} they mostly fall to the {believed}: if other drives say so, too, 'traffic_side' is "
        "wrong in the vehicle file",
        fell * percent,
    )


def _wanders(native: Mapping[str, Any]) -> bool:
    """By both: the steering that no longer goes with the accelerometer, and minutes that read otherwise."""
    return bool(native["accelerometer_wanders"] and native["bank_high"] - native["bank_low"] > _BANK_MOVED_M_S2)


def _accelerometer_moves(native: Mapping[str, Any], params: Mapping[str, float]) -> Finding | None:
    """No road banks by so much for a minute; or the steering wheel angle does not follow the accelerometer."""
    moved = native["bank_high"] - native["bank_low"]
    if not params["use_accelerometer"] or not (native["accelerometer_runs_away"] or _wanders(native)):
        return None
    if native["accelerometer_runs_away"]:
        text = (
            f"the lateral accelerometer's zero moved by about {moved:.1f} m/s^2, more than any road banks: look at the "
            "sensor; it does not tell the offset"
        )
        return from_table("lateral_acceleration_moves", text, moved)
    text = (
        "the lateral accelerometer's zero seems to move in this drive, as a sensor does that warms up, or a wind that "
        "comes and goes: the offset allows for it"
    )
    return from_table("lateral_acceleration_moves", text, moved, severity="info")


def _wheelbase(native: Mapping[str, Any], steering_ratio: float, wheelbase_m: float) -> Finding | None:
    """Bends that ask for another angle than vehicle file and gradient foretell."""
    found = native["equivalent_wheelbase"]
    share = found["value"] / wheelbase_m - 1.0
    doubt = 1.96 * found["standard_deviation"] / wheelbase_m
    if status_of(found) != "valid" or abs(share) - doubt < _WHEELBASE_WORTH_TELLING:
        return None
    return from_table(
        "wheelbase_or_ratio",
        f"bends take {abs(share):.0%} {'more' if share > 0 else 'less'} angle than the vehicle file foretells: an "
        f"equivalent wheelbase of {found['value']:.2f} m, not {wheelbase_m:.2f}, or a steering ratio of "
        f"{steering_ratio * (1.0 + share):.1f}, not {steering_ratio:.1f}; the offset was found with it",
        found["value"],
    )


def _evidence(native: Mapping[str, Any], params: Mapping[str, float]) -> Finding | None:
    lacking = params["joint_evidence_min_s"] - native["used"]
    if lacking <= 0 or (native["used"] == 0 and native["bank_time"] > params["joint_evidence_min_s"]):
        return None
    return from_table(
        "not_enough_evidence",
        f"not enough evidence yet: needs {_long(lacking)} more above {params['joint_speed_min_m_s']:g} m/s, "
        "with some bends to either side",
        lacking,
    )


def _long(seconds: float) -> str:
    return f"{math.ceil(seconds)} s" if seconds < 120 else f"{math.ceil(seconds / 60)} min"


def _lacking_sides(native: Mapping[str, Any]) -> dict[str, float]:
    """By side, the seconds of side force to it that are lacking before the play's flank there has shown."""
    sides = {"left": native["lacking_to_left"], "right": native["lacking_to_right"]}
    return {side: lacking for side, lacking in sides.items() if lacking > 0}


def _unseen_flank(native: Mapping[str, Any], params: Mapping[str, float]) -> Finding | None:
    lacking = _lacking_sides(native)
    if native["used"] < params["joint_evidence_min_s"] or not lacking:
        return None
    needs = " and ".join(f"{math.ceil(s)} s of bends, or of side force, to the {side}" for side, s in lacking.items())
    seen = "neither flank" if len(lacking) == 2 else "only one flank"
    return from_table(
        "one_flank_seen",
        f"{seen} of any play in the steering was seen, so play may hide in the offset: needs {needs}",
        sum(lacking.values()),
    )


def _no_understeer(native: Mapping[str, Any], params: Mapping[str, float]) -> Finding | None:
    """Why the core calls nothing valid then: play on gentle bends passes for a gradient."""
    gradient_deg = native["understeer_gradient"]["value"] / DEGREE
    if native["used"] < params["joint_evidence_min_s"] or gradient_deg > 0:
        return None
    return from_table(
        "no_understeer",
        f"the truck seems to oversteer by {-gradient_deg:.2g} deg/(m/s^2), which few do and play on gentle bends "
        "imitates: needs tighter bends to either side",
        gradient_deg,
    )


def _interval(native: Mapping[str, Any], params: Mapping[str, float], steering_ratio: float) -> Finding | None:
    """Of what the offset's interval consists, the largest part first."""
    if status_of(native["offset"]) == "unobservable":
        return None
    low, high = _core.ci95(native["offset"])
    half_width = 0.5 * (high - low) / DEGREE
    parts = sorted(_parts(native, params, steering_ratio), reverse=True)
    told = [f"{words} (+-{part:.1f})" for part, words in parts if part > _PART_WORTH_TELLING * half_width]
    text = f"the offset's interval of +-{half_width:.2g} deg comes from {', '.join(told)}"
    return from_table("interval", text, half_width)


def _of_both(one_sd: float, other_sd: float) -> float:
    """Of what two tell; 0 where one knows all."""
    return one_sd * other_sd / math.hypot(one_sd, other_sd) if one_sd and other_sd else 0.0


def _parts(
    native: Mapping[str, Any], params: Mapping[str, float], steering_ratio: float
) -> Iterator[tuple[float, str]]:
    """95 % half-widths in deg; their squares sum to the interval's."""
    slope = steering_ratio * abs(native["understeer_gradient"]["value"])
    unknown = "the road's bank, which was not seen"
    if params["use_accelerometer"]:
        unknown = "an unknown zero of the accelerometer"
    elif params["torque_for_accelerometer_1"]:
        unknown = "the unknown zero of the torque signal"
    side_force = math.hypot(params["pull_sd_m_s2"], params["wind_sd_m_s2"])
    if params["use_accelerometer"]:  # crown and prior tell its bias, and so some of what is none
        side_force = _of_both(side_force, _of_both(params["accelerometer_bias_sd_m_s2"], params["crown_sd_m_s2"]))
    lean = native["offset"]["lean"]
    left = native["offset"]["standard_deviation"] ** 2 - lean**2
    spreads = [
        (
            slope * side_force,
            f"a pull or side wind that passes for {'accelerometer bias' if params['use_accelerometer'] else 'bank'}",
        ),
        # no pull makes it lean further than by its own spread
        (max(abs(lean) - slope * side_force, 0.0), "an axle that may be set up to unload on the crown of the road"),
        (slope * native["unloading_acceleration"]["standard_deviation"], unknown),
        (
            native["offset_per_yaw_rate_bias"] * native["yaw_rate_bias"]["standard_deviation"],
            "the bias of the yaw rate sensor",
        ),
    ]
    rest = "play on the flank that was not seen" if _lacking_sides(native) else "scatter of the drive"
    for spread, words in spreads:
        part = min(spread**2, left)
        left -= part
        yield 1.96 * math.sqrt(part) / DEGREE, words
    yield 1.96 * math.sqrt(left) / DEGREE, rest
