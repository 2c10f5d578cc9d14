"""What the joint method alone can tell of a drive: play, where the steering unloads, what changed, what is lacking.

Degrees here: findings are for people and files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from oncenter.offset.cause import Name, causes_of
from oncenter.offset.changes import Change
from oncenter.offset.core_findings import status_of
from oncenter.offset.findings import PLAY_STANDARD_DEG, Finding, from_table
from oncenter.offset.vehicle_file import FAR_OFF
from oncenter.signals import DEGREE, STANDARD_GRAVITY

# Thresholds for speaking up, ours.
_UNLOADING_WORTH_TELLING_M_S2 = 0.1  # half a usual crown
_BANK_MOVED_M_S2 = 0.35  # between two minutes' means: bench/effects.py, rows `none` and `accelerometer_drift`
_OFFSET_TAKEN_OUT_DEG = 0.5  # a sender that corrects itself ends so near to zero
_OFFSET_LARGE_DEG = 1.0  # and had something to correct
_PART_WORTH_TELLING = 0.25  # of the half-width
_GAIN_WORTH_TELLING = 0.1  # of the same
_ANOTHER_MINUTE_S = 60.0
_MODEL_ERROR_RAD = 0.04 * DEGREE  # core/joint_answer.c, offset_error
_WIDTH_ERROR_RAD = 0.2 * DEGREE  # core/joint_answer.c, width_error: of the play alone
_STANDING_GYRO_SD_RAD_S = 3.5e-4  # core/standstill.c, yaw_rate_floor
_STAND_STILL = "stand still for 1 s"
_GYRO, _PLAY, _SCATTER, _MODEL = "gyro bias", "free play", "measurement scatter", "limits of the model"
_CAUSES: Mapping[Name, str] = {
    "pull": "a pull by the wheel alignment",
    "mean_wind": "mean crosswind",
    "axle_set_up": "an axle set up to unload on the road's crown",
}
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
    params = _with_known_spreads(params)
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
    yield _interval(native, params, steering_ratio, traffic_sign)


def next_driving(
    native: Mapping[str, Any], params: Mapping[str, float], *, steering_ratio: float, traffic_sign: float
) -> tuple[str, ...]:
    """The driving that narrows this drive's part of the offset's interval, the most useful first; as for
    `joint_findings`."""
    if status_of(native["offset"]) == "unobservable":
        return ()
    params = _with_known_spreads(params)
    drive = 1.96 * native["offset_parts"]["drive_sd"] / DEGREE
    parts = _parts(native, params, steering_ratio)
    return tuple(words for _, words in sorted(_gains(native, params, drive, parts, traffic_sign)))


def _with_known_spreads(params: Mapping[str, float]) -> Mapping[str, float]:
    """Standard deviations that the truck's own take the place of."""
    own = {name: params[f"known_{name}"] for name in ("pull_sd_m_s2", "accelerometer_bias_sd_m_s2")}
    return {**params, **{name: sd for name, sd in own.items() if sd > 0.0}}


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
        severity="warning" if abs(share) > FAR_OFF else None,
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


def _interval(
    native: Mapping[str, Any], params: Mapping[str, float], steering_ratio: float, traffic_sign: float
) -> Finding | None:
    """Both parts of the offset's uncertainty with their contributions, the largest first, and what would narrow it."""
    if status_of(native["offset"]) == "unobservable":
        return None
    whole = 1.96 * native["offset"]["standard_deviation"] / DEGREE
    drive = 1.96 * native["offset_parts"]["drive_sd"] / DEGREE
    parts = _parts(native, params, steering_ratio)
    gains = list(_gains(native, params, drive, parts, traffic_sign))
    text = f"uncertainty ±{_deg(whole)} deg: ±{_deg(drive)} from this drive"
    text += f" ({_contributions(native, params, drive, parts)})"
    causes = causes_of(native["offset_parts"], params, traffic_sign)
    beside = [(1.96 * cause.sd_rad / DEGREE, _CAUSES[cause.cause]) for cause in causes]
    beside = [(part, words) for part, words in beside if part > _PART_WORTH_TELLING * max(drive, whole - drive)]
    if beside:
        of_causes = ", ".join(f"±{_deg(part)} {words}" for part, words in sorted(beside, reverse=True))
        text += f"; not identifiable from one drive: {of_causes}"
    if gains:
        would = ", ".join(f"{words} (to ±{_deg(left)})" for left, words in sorted(gains))
        text += f"; to narrow this drive's part: {would}"
    return from_table("interval", text, whole)


def _contributions(
    native: Mapping[str, Any],
    params: Mapping[str, float],
    drive: float,
    parts: Mapping[str, float],
) -> str:
    """To the drive's part, the largest first; a gyro that nothing measured is named in any case."""
    names_gyro = status_of(native["yaw_rate_bias"]) == "unobservable"
    told = [
        (part, _play_words(native) if words == _PLAY else words)
        for words, part in _not_separated(native, params, parts).items()
        if part > _PART_WORTH_TELLING * drive or (names_gyro and words.startswith(_GYRO))
    ]
    return ", ".join(f"±{_deg(part)} {words}" for part, words in sorted(told, reverse=True))


def _deg(half_width_deg: float) -> str:
    return f"{half_width_deg:.{1 if half_width_deg >= 0.095 else 2}f}"


def _parts(native: Mapping[str, Any], params: Mapping[str, float], steering_ratio: float) -> dict[str, float]:
    """Contributions to the drive's part as 95 % half-widths in deg; their squares sum to its square."""
    gyro = native["yaw_rate_bias"]
    slope = steering_ratio * abs(native["understeer_gradient"]["value"])
    of_play = max(native["backlash"]["standard_deviation"] ** 2 - _WIDTH_ERROR_RAD**2, 0.0)
    spreads = {
        _GYRO: native["offset_per_yaw_rate_bias"] * gyro["standard_deviation"],
        _zero(params): slope * native["unloading_acceleration"]["standard_deviation"],
        _MODEL: _MODEL_ERROR_RAD,
        _PLAY: 0.5 * math.sqrt(of_play),  # of a play whose one flank was not loaded, half is in the offset
    }
    if status_of(gyro) == "unobservable":  # only the prior limits it: all that scatter does not explain
        spreads |= {_SCATTER: native["unexplained"] / math.sqrt(max(native["used"], 1.0)), _GYRO: math.inf}
        spreads[_GYRO] = spreads.pop(_GYRO)  # after the scatter
    left = native["offset_parts"]["drive_sd"] ** 2
    parts = {}
    for words, spread in spreads.items():
        part = min(spread**2, left)
        left -= part
        parts[words] = 1.96 * math.sqrt(part) / DEGREE
    rest = 1.96 * math.sqrt(left) / DEGREE
    return parts | {_SCATTER: math.hypot(parts.get(_SCATTER, 0.0), rest)}


def _not_separated(
    native: Mapping[str, Any], params: Mapping[str, float], parts: Mapping[str, float]
) -> Mapping[str, float]:
    """With gyro bias and accelerometer zero as one contribution where neither standstill nor wheel speeds measured the
    former: both shift a_y - r*v, and what `_parts` gives to the one may be the other's."""
    zero = _zero(params)
    both = math.hypot(parts[_GYRO], parts[zero])
    if not _gyro_hides_zero(native, params) or parts[zero] < _PART_WORTH_TELLING * both:
        return parts
    return {words: part for words, part in parts.items() if words not in (_GYRO, zero)} | {
        f"{_GYRO} and {zero}, which it does not separate": both
    }


def _gyro_hides_zero(native: Mapping[str, Any], params: Mapping[str, float]) -> bool:
    return bool(params["use_accelerometer"]) and status_of(native["yaw_rate_bias"]) == "unobservable"


def _zero(params: Mapping[str, float]) -> str:
    if params["use_accelerometer"]:
        return "accelerometer zero"
    return "torque zero" if params["torque_for_accelerometer_1"] else "road bank, which was not measured"


def _play_words(native: Mapping[str, Any]) -> str:
    """Free play with the loading that left it open."""
    lacking = _lacking_sides(native)
    if len(lacking) == 2:
        return f"{_PLAY} because neither flank was loaded for long enough"
    if lacking:
        (side,) = lacking
        return f"{_PLAY} because only {'right' if side == 'left' else 'left'}-hand loading occurred"
    return _PLAY


def _other_flank(native: Mapping[str, Any]) -> str:
    """The driving that shows the flank that is lacking, or the rarer one."""
    lacking = _lacking_sides(native)
    if lacking:
        return " and ".join(f"{math.ceil(s)} s of bends to the {side}" for side, s in lacking.items())
    rarer = "left" if native["side_force_to_left"] < native["side_force_to_right"] else "right"
    return f"another minute of bends to the {rarer}"


def _gains(
    native: Mapping[str, Any],
    params: Mapping[str, float],
    drive: float,
    parts: Mapping[str, float],
    traffic_sign: float,
) -> Iterator[tuple[float, str]]:
    """The half-width in deg that would be left of the drive's part, where that gains a tenth of it, and by what.
    Standing still costs a second: where nothing measured the gyro's bias it is asked for in any case."""

    def left(less: float) -> float:
        return math.sqrt(max(drive**2 - less, 0.0))

    more_s = native["used"] + _ANOTHER_MINUTE_S
    would = {
        _STAND_STILL: left(_by_standing(native, params, parts, traffic_sign)),
        f"{_other_flank(native)}, or a known play": left(parts[_PLAY] ** 2),
        "another minute of such driving": left(parts[_SCATTER] ** 2 * _ANOTHER_MINUTE_S / more_s),
    }
    never_stood = status_of(native["yaw_rate_bias"]) == "unobservable"
    for words, would_be in would.items():
        if drive - would_be >= _GAIN_WORTH_TELLING * drive or (words == _STAND_STILL and never_stood):
            yield would_be, words


def _by_standing(
    native: Mapping[str, Any], params: Mapping[str, float], parts: Mapping[str, float], traffic_sign: float
) -> float:
    """Square of a half-width in deg that a second of standing takes away: the gyro's bias but for what a standstill
    leaves of it, with the accelerometer's zero where the two were not separated. Otherwise also the accelerometer's
    zero but for the ground's slope, where the truck has not stood yet."""
    gyro = native["yaw_rate_bias"]
    gyro_sd = math.inf if status_of(gyro) == "unobservable" else gyro["standard_deviation"]
    standing_sd = math.hypot(_STANDING_GYRO_SD_RAD_S, native.get("yaw_rate_step_sd", 0.0))
    of_gyro: float = 1.96 * native["offset_per_yaw_rate_bias"] * min(gyro_sd, standing_sd) / DEGREE
    of_both = parts[_GYRO] ** 2 + (parts[_zero(params)] ** 2 if _gyro_hides_zero(native, params) else 0.0)
    gained: float = max(of_both - of_gyro**2, 0.0)
    if _gyro_hides_zero(native, params):
        return gained
    zero_sd: float = native["unloading_acceleration"]["standard_deviation"]
    has_stood = status_of(native["standstill_lateral_acceleration"]) == "valid"
    if not params["use_accelerometer"] or has_stood or zero_sd <= 0.0:
        return gained
    crown_sd = math.hypot(params["crown_sd_m_s2"], params["crown_m_s2"] if traffic_sign == 0.0 else 0.0)
    ground_sd = math.hypot(params["standing_slope_sd_m_s2"], params["standing_crown_share_1"] * crown_sd)
    return gained + parts[_zero(params)] ** 2 * zero_sd**2 / (zero_sd**2 + ground_sd**2)
