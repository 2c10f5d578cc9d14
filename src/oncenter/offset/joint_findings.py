"""Findings of the joint method: play, neutral lateral acceleration, changes, missing driving, uncertainty.

Degrees here: findings are for people and files.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from oncenter import _core
from oncenter.estimates.cause import Name, causes_of
from oncenter.estimates.changes import Change
from oncenter.estimates.estimate import number
from oncenter.findings import PLAY_STANDARD_DEG, Finding, Kind, bends_demand, demand, finding
from oncenter.offset.core_findings import km_h
from oncenter.offset.rear_axle import by_zero_sd
from oncenter.offset.stated import set_up_contradicted, side_or_set_up
from oncenter.offset.unknown_truck import unknown_truck
from oncenter.plausibility.ratio import FAR_OFF, fit_words
from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.tuned import TUNED
from oncenter.vehicle import Vehicle

# Minimum values that are reported; tuned.
_NEUTRAL_REPORTED_FROM_M_S2 = 0.1  # half a usual crown
_BANK_MOVED_M_S2 = 0.35  # between two minutes' means: bench/effects.py, rows `none` and `accelerometer_drift`
_OFFSET_CORRECTED_DEG = 0.5  # a sender that corrects its angle itself ends this near to zero
_OFFSET_LARGE_DEG = 1.0  # and had more than this to correct
_OFFSET_USED = "The reported offset is the one after the last change"
_PART_REPORTED_FROM = 0.25  # of the half-width
_GAIN_REPORTED_FROM = 0.1  # of the same
_MORE_DRIVING_S = 60.0
_CAUSES: Mapping[Name, str] = {
    "pull": "a pull by the wheel alignment",
    "mean_wind": "a mean crosswind",
    "axle_set_up": "an axle set up for the road crown",
    "axle_layout": "the axle layout",
}
_WHEELBASE_REPORTED_FROM = 0.04  # share: tyres and payload change the one of (10) by less
_MOVES_FROM = 2  # changes: nobody remounts a sensor twice in a drive
_LISTED_MAX = 8  # offsets in a finding
_SET_UP_LIKELY = TUNED["joint_verdict.set_up_likely"]
_LOADED_FROM_S = 0.5  # less is printed as "to the left only"


def joint_findings(
    native: _core.OcAnswer, params: Mapping[str, float], changes: Sequence[Change], vehicle: Vehicle
) -> Iterator[Finding | None]:
    """All of one answer of the core; None where there is nothing to report.

    Args:
        native: the core's oc_answer as a dict, SI and rad.
        params: in force.
        changes: found in the drive.
        vehicle: of the core.
    """
    params = _with_configured_sds(params)
    steering_ratio, traffic_sign = vehicle.ratio_near_centre, vehicle.traffic_sign
    yield from map(_change, changes)
    yield _moves(native, changes)
    yield _play(native)
    other_side = _bends_fall(native, traffic_sign) or _crown(native, params, traffic_sign)
    yield _unloading(native, params, steering_ratio, 0.0 if other_side else traffic_sign)
    yield other_side
    yield side_or_set_up(native, params, vehicle) if other_side is None else None
    yield set_up_contradicted(native, params, vehicle)
    yield _may_be_set_up(native, params)
    yield _accelerometer_moves(native, params)
    yield _seems_steered(native)
    yield unknown_truck(native, vehicle)
    yield None if vehicle.assumed else _wheelbase(native, steering_ratio, vehicle.wheelbase_m)
    yield _evidence(native, params)
    yield _missing_loading(native, params)
    yield _no_understeer(native, params)
    yield _interval(native, params, steering_ratio)


def next_driving(native: _core.OcAnswer, params: Mapping[str, float], vehicle: Vehicle) -> tuple[str, ...]:
    """The driving that narrows this drive's part of the offset's interval, the most useful first; as for
    `joint_findings`."""
    if _core.status_of(native["offset"]) == "unobservable":
        return ()
    params = _with_configured_sds(params)
    drive = 1.96 * native["offset_parts"]["drive_sd"] / DEGREE
    parts = _parts_of(native, params, vehicle.ratio_near_centre)
    return tuple(words for _, words in sorted(_gains(native, params, drive, parts)))


def _with_configured_sds(params: Mapping[str, float]) -> Mapping[str, float]:
    """The truck's own standard deviations in place of the general priors."""
    own = {name: params[f"known_{name}"] for name in ("pull_sd_m_s2", "accelerometer_bias_sd_m_s2")}
    return {**params, **{name: sd for name, sd in own.items() if sd > 0.0}}


def _change(change: Change) -> Finding | None:
    """The change as a finding; None if the offset did not stay changed: it may be the same as before."""
    if change.size_rad is None or change.sd_rad is None:
        return _bends_changed(change)
    if abs(change.size_rad) < 1.96 * change.sd_rad:
        return None
    before, after = change.offset_before_rad / DEGREE, change.offset_after_rad / DEGREE
    size, half_width = change.size_rad / DEGREE, 1.96 * change.sd_rad / DEGREE
    course = f"by {size:+.1f} ±{half_width:.1f} deg, from {before:+.1f} to {after:+.1f} deg"
    if abs(after) < _OFFSET_CORRECTED_DEG and abs(before) > _OFFSET_LARGE_DEG:
        return _corrected_by_sender(change, course, size)
    return (_moved if change.kind == "straight_ahead" else _offset_changed)(change, course, size)


def moves_within(native: _core.OcAnswer, changes: Sequence[Change]) -> bool:
    """Whether the offset walks, or changed twice by more than load, ride height or wind explain."""
    return bool(native["offset_walks"]) or sum(change.kind == "offset" for change in changes) >= _MOVES_FROM


def _moves(native: _core.OcAnswer, changes: Sequence[Change]) -> Finding | None:
    if not moves_within(native, changes):
        return None
    return zero_moves([*(c.offset_before_rad for c in changes if c.kind != "bends"), native["offset"]["value"]])


@finding("zero_moves", "warning")
def zero_moves(found: Kind, offsets: Sequence[float]) -> Finding:
    """The offset changes again and again, or drifts, within a drive or from drive to drive."""
    now = listed(offsets) if len(offsets) > 1 else f"now the offset is {listed(offsets)}"
    return found(
        f"the zero of the steering wheel angle sensor moves: {now}. The sensor or the steering wheel is "
        "loose or slips. The offset is the last value; its interval allows for another such step. Check the mounting "
        "before you recalibrate"
    )


def listed(offsets: Sequence[float]) -> str:
    """The last ones, deg."""
    shown = [number(offset, 1) for offset in offsets[-_LISTED_MAX:]]
    return f"{'…, ' if len(offsets) > len(shown) else ''}{', '.join(shown)} deg"


def _when(change: Change) -> str:
    return f"{change.into_log_s / 60:.1f} min into {change.log}"


@finding("bends_changed", "info", "s")
def _bends_changed(found: Kind, change: Change) -> Finding:
    """A change that was not one of the offset."""
    return found(
        f"{_when(change)} the steering wheel angle in bends changed, as with another payload or a lifted axle. The "
        "offset is not affected; the understeer gradient is estimated again from there on",
        change.into_log_s,
    )


@finding("offset_corrected_by_sender", "warning", "deg")
def _corrected_by_sender(found: Kind, change: Change, course: str, size: float) -> Finding:
    """The offset changed from large to nearly zero."""
    return found(
        f"{_when(change)} the offset began to change {course}. The sender corrects its angle itself, or the sensor was "
        f"calibrated. {_OFFSET_USED}. Do not correct it a second time",
        size,
    )


@finding("straight_ahead_moved", "info", "deg")
def _moved(found: Kind, change: Change, course: str, size: float) -> Finding:
    """A change smaller than that of a remounted sensor."""
    return found(
        f"{_when(change)} the straight-ahead offset changed {course}. Another payload or ride height, or a lasting "
        f"crosswind, can cause this. {_OFFSET_USED}. If the next drive shows the same, check the signal and the "
        "mounting of the sensor",
        size,
    )


@finding("offset_changed", "warning", "deg")
def _offset_changed(found: Kind, change: Change, course: str, size: float) -> Finding:
    """The offset changed otherwise, by more than its interval."""
    return found(
        f"{_when(change)} the offset changed {course}. The signal is another one since then, or work on the sensor, "
        f"the steering wheel or the wheel alignment moved its zero. {_OFFSET_USED}. If nobody worked on the truck, "
        "check the signal, then the mounting of the sensor and the wheel alignment",
        size,
    )


@finding("steering_play", "warning", "deg")
def _play(found: Kind, native: _core.OcAnswer) -> Finding | None:
    """Valid, and its whole 95 % interval beyond the maintenance standard."""
    play = native["backlash"]
    value, half_width = play["value"] / DEGREE, 1.96 * play["standard_deviation"] / DEGREE
    if _core.status_of(play) != "valid" or value - half_width < PLAY_STANDARD_DEG:
        return None
    return found(
        f"the steering has {value:.1f} ±{max(half_width, 0.1):.1f} deg of free play at the steering wheel. This is "
        f"more than the maintenance limit of {PLAY_STANDARD_DEG:g} deg. The offset is not affected. Check the steering "
        "joints for wear",
        value,
    )


@finding("unloading_off_zero", "warning", "m/s^2")
def _unloading(
    found: Kind, native: _core.OcAnswer, params: Mapping[str, float], steering_ratio: float, traffic_sign: float
) -> Finding | None:
    """A neutral lateral acceleration that is valid, and whose whole interval is away from zero."""
    neutral = native["unloading_acceleration"]
    a_0, half_width = neutral["value"], 1.96 * neutral["standard_deviation"]
    if (
        not params["use_accelerometer"]
        or _core.status_of(neutral) != "valid"
        or abs(a_0) - half_width < _NEUTRAL_REPORTED_FROM_M_S2
    ):
        return None
    pull = params["known_pull_m_s2"] if params["known_pull_sd_m_s2"] > 0.0 else 0.0
    moved = steering_ratio * native["understeer_gradient"]["value"] * (a_0 - pull) / DEGREE
    text = (
        f"the front axle is free of lateral force where the accelerometer reads {a_0:+.2f} "
        f"±{max(half_width, 0.01):.2f} m/s^2 (to the {'left' if a_0 > 0 else 'right'}), not at zero. The cause is an "
        "accelerometer bias, a pull by the wheel alignment or a steady crosswind. One drive cannot separate them. Its "
        f"offset takes all{' except the configured pull' if pull else ''} as bias; with a pull or wind instead, it is "
        f"{_lower(moved)}. The interval of the offset allows for a usual pull and wind. If the truck pulls to one "
        "side, check the wheel alignment. Drives "
        "with another payload separate the causes"
    )
    crown = traffic_sign * params["crown_m_s2"]
    doubt = 1.96 * math.hypot(neutral["standard_deviation"], params["crown_sd_m_s2"])
    if crown != 0.0 and abs(a_0 - crown) < doubt:
        text += (
            f". An axle set up for the road crown (about {crown:+.1f} m/s^2 here) is possible as well: then the offset "
            f"is also {_lower(moved)}"
        )
    return found(text, a_0)


def _lower(by_deg: float) -> str:
    return f"{abs(by_deg):.1f} deg {'lower' if by_deg > 0 else 'higher'}"


@finding("axle_may_be_set_up", "warning", "deg")
def _may_be_set_up(found: Kind, native: _core.OcAnswer, params: Mapping[str, float]) -> Finding | None:
    """Roads that are level where the steering is free of lateral force, and no side of traffic in use: as may_be_set_up
    of core/monitor/joint_verdict.c, which withholds the status."""
    parts = native["offset_parts"]
    effect = parts["per_acceleration"] * params["crown_m_s2"]
    if native["traffic_side"] != 0.0 or effect <= 0.0 or parts["set_up_sd"] <= _SET_UP_LIKELY * effect:
        return None
    rare = min(params["set_up_probability_1"], 1.0 - params["set_up_probability_1"])  # or another axle than stated
    return found(
        "the steering is free of lateral force on the mean slope of these roads. Either they are level, or the "
        f"front axle is set up for the road crown (1 truck in {1.0 / rare:.0f}): then the "
        f"offset is {effect / DEGREE:.1f} deg lower or higher, so it is not valid. Give 'traffic_side' in the "
        "vehicle file, and 'set_up_for_crown' as the workshop has set it, or drive on other roads",
        effect / DEGREE,
    )


@finding("roads_fall_to_other_side", "warning")
def _bends_fall(found: Kind, native: _core.OcAnswer, traffic_sign: float) -> Finding | None:
    """Superelevated bends remove a crown to the other side than that of the vehicle file's traffic side. The core then
    does not use it."""
    if native["traffic_side"] == traffic_sign:
        return None
    observed, expected = _sides(traffic_sign)
    return found(
        f"the banked bends of this drive show that its straight roads slope down to the {observed}; where traffic "
        f"keeps {expected}, most slope down to the {expected}. The offset does not use 'traffic_side' of the vehicle "
        "file. Check it"
    )


def _sides(traffic_sign: float) -> tuple[str, str]:
    """Observed and expected one of roads that fall to the other side."""
    return ("left", "right") if traffic_sign > 0.0 else ("right", "left")


@finding("roads_fall_to_other_side", "warning", "%")
def _crown(found: Kind, native: _core.OcAnswer, params: Mapping[str, float], traffic_sign: float) -> Finding | None:
    """Roads that slope down to the other side than those of the vehicle file's traffic side. The slope is the mean bank
    less the neutral lateral acceleration without a given pull, so that the accelerometer's zero cancels."""
    neutral = native["unloading_acceleration"]
    uses_crown = params["use_accelerometer"] and traffic_sign * params["crown_m_s2"] != 0.0
    has_bank = _core.status_of(native["yaw_rate_bias"]) == "valid"  # a bias would be in a_y - r*v
    if not uses_crown or not has_bank or _core.status_of(neutral) != "valid":
        return None
    pull = params["known_pull_m_s2"] if params["known_pull_sd_m_s2"] > 0.0 else 0.0
    fell = native["bank_mean"] - (neutral["value"] - pull)
    doubt = 1.96 * math.hypot(neutral["standard_deviation"], params["pull_sd_m_s2"], params["wind_sd_m_s2"])
    if -traffic_sign * fell < doubt:
        return None
    percent = 100.0 / STANDARD_GRAVITY
    observed, expected = _sides(traffic_sign)
    return found(
        f"the roads of this drive slope down to the {observed} by {abs(fell) * percent:.1f} ±{doubt * percent:.1f} %; "
        f"where traffic keeps {expected}, most slope down to the {expected}. The offset uses this side and is less "
        "certain. If other drives show the same, check 'traffic_side' of the vehicle file, or the position in the log",
        fell * percent,
    )


def _wanders(native: _core.OcAnswer) -> bool:
    """Both signs together: the best hypothesis lets the zero wander, and the means of minutes differ."""
    return bool(native["accelerometer_wanders"] and native["bank_high"] - native["bank_low"] > _BANK_MOVED_M_S2)


@finding("lateral_acceleration_moves", "warning", "m/s^2")
def _accelerometer_moves(found: Kind, native: _core.OcAnswer, params: Mapping[str, float]) -> Finding | None:
    """No road banks that much for a minute, or the steering wheel angle does not follow the accelerometer."""
    moved = native["bank_high"] - native["bank_low"]
    if not params["use_accelerometer"] or not (native["accelerometer_runs_away"] or _wanders(native)):
        return None
    if native["accelerometer_runs_away"]:
        return found(
            f"the zero of the accelerometer moved by about {moved:.1f} m/s^2, more than road bank can explain. The "
            "offset is not accurate enough with it. Check the accelerometer, or estimate without it: "
            "--no-accelerometer",
            moved,
        )
    return found(
        f"the zero of the accelerometer seems to drift: one-minute means differ by {moved:.1f} m/s^2. A sensor that "
        "warms up or a changing wind causes this. The interval of the offset allows for it",
        moved,
        severity="info",
    )


@finding("seems_steered", "warning", "s")
def _seems_steered(found: Kind, native: _core.OcAnswer) -> Finding | None:
    """Seconds far from the prediction, too many on one side for kerbs and gusts: the other flank than usual."""
    if native["steered_s"] <= 0.0:
        return None
    is_told = dict(zip(_core.REASONS, native["rejected"], strict=True))["steering_assist"] > 0.0
    tell = "" if is_told else ", or record the signal 'steering_assist_active'"
    return found(
        f"for {native['steered_s']:.0f} s, from {native['steered_since_s'] / 60.0:.0f} min of used driving on, the "
        f"steering wheel angle is {native['steered_by'] / DEGREE:.1f} deg off the motion of the truck: something seems "
        "to steer in the rest of the time, such as lane keeping while a hand rests on the wheel. The loaded flank of "
        f"the play is unknown then, so the offset is less certain. Drive 20 min without the assistance{tell}",
        native["steered_s"],
    )


@finding("wheelbase_or_ratio", "info", "m")
def _wheelbase(found: Kind, native: _core.OcAnswer, steering_ratio: float, wheelbase_m: float) -> Finding | None:
    """Bends need another angle than vehicle file and understeer gradient predict."""
    fitted = native["equivalent_wheelbase"]
    share = fitted["value"] / wheelbase_m - 1.0
    doubt = 1.96 * fitted["standard_deviation"] / wheelbase_m
    if _core.status_of(fitted) != "valid" or abs(share) - doubt < _WHEELBASE_REPORTED_FROM:
        return None
    return found(
        fit_words(share, wheelbase_m, steering_ratio),
        fitted["value"],
        severity="warning" if abs(share) - doubt > FAR_OFF else None,
    )


@finding("not_enough_evidence", "info", "s")
def _evidence(found: Kind, native: _core.OcAnswer, params: Mapping[str, float]) -> Finding | None:
    """Fewer usable seconds than the method needs."""
    lacking = params["joint_evidence_min_s"] - native["used"]
    if lacking <= 0 or (native["used"] == 0 and native["bank_time"] > params["joint_evidence_min_s"]):
        return None
    return found(
        f"only {native['used']:.0f} s of driving can be used; the estimate needs {params['joint_evidence_min_s']:g} s. "
        "There is no valid offset so far. "
        f"Drive at least {demand(lacking)} more above {km_h(params['joint_speed_min_m_s'])}, with bends to both sides",
        lacking,
    )


def _lacking_sides(native: _core.OcAnswer) -> dict[str, float]:
    """Seconds of lateral force to a side that are lacking before play and offset are separated there."""
    sides = {"left": native["lacking_to_left"], "right": native["lacking_to_right"]}
    return {side: lacking for side, lacking in sides.items() if lacking > 0}


@finding("one_flank_seen", "warning", "s")
def _missing_loading(found: Kind, native: _core.OcAnswer, params: Mapping[str, float]) -> Finding | None:
    """Evidence enough, but too little lateral force to a side."""
    lacking = _lacking_sides(native)
    if native["used"] < params["joint_evidence_min_s"] or not lacking:
        return None
    return found(
        f"{_loading_words(native, lacking)}, so free play and offset cannot be separated. The offset is not accurate "
        f"enough so far. Drive {bends_demand(lacking)}",
        sum(lacking.values()),
    )


def _loading_words(native: _core.OcAnswer, lacking: Mapping[str, float]) -> str:
    """How little lateral force there was to the lacking sides."""
    left_s, right_s = native["loaded_left_s"], native["loaded_right_s"]
    if len(lacking) == 2:
        left, right = f"to the left for only {left_s:.0f} s", f"to the right for only {right_s:.0f} s"
        return f"the front axle had lateral force {left} and {right}"
    (side,) = lacking
    loaded_s = left_s if side == "left" else right_s
    if loaded_s < _LOADED_FROM_S:
        return f"the front axle had lateral force to the {'right' if side == 'left' else 'left'} only"
    return f"the front axle had lateral force to the {side} for only {loaded_s:.0f} s"


@finding("no_understeer", "warning", "deg/(m/s^2)")
def _no_understeer(found: Kind, native: _core.OcAnswer, params: Mapping[str, float]) -> Finding | None:
    """Evidence enough, but the gradient is not positive. The core calls no offset valid then: play in gentle bends
    looks like a gradient."""
    gradient_deg = native["understeer_gradient"]["value"] / DEGREE
    if native["used"] < params["joint_evidence_min_s"] or gradient_deg > 0:
        return None
    return found(
        f"the truck seems to oversteer by {-gradient_deg:.2g} deg/(m/s^2). Few trucks do; free play in gentle bends "
        "looks the same, so the offset is not accurate enough so far. Drive tighter bends to both sides",
        gradient_deg,
    )


@finding("interval", "info", "deg")
def _interval(
    found: Kind, native: _core.OcAnswer, params: Mapping[str, float], steering_ratio: float
) -> Finding | None:
    """Both parts of the offset's uncertainty with their contributions, the largest first, and ways to reduce it."""
    if _core.status_of(native["offset"]) == "unobservable":
        return None
    whole = 1.96 * native["offset"]["standard_deviation"] / DEGREE
    drive = 1.96 * native["offset_parts"]["drive_sd"] / DEGREE
    parts = _parts_of(native, params, steering_ratio)
    gains = list(_gains(native, params, drive, parts))
    text = f"uncertainty ±{_deg(whole)} deg: ±{_deg(drive)} deg from this drive"
    text += f" ({_contributions(native, params, drive, parts)})"
    causes = causes_of(native["offset_parts"], params, native["traffic_side"])
    beside = [(1.96 * cause.sd_rad / DEGREE, _CAUSES[cause.cause]) for cause in causes]
    beside = [(part, words) for part, words in beside if part > _PART_REPORTED_FROM * max(drive, whole - drive)]
    if beside:
        of_causes = " or ".join(f"{words} (±{_deg(part)})" for part, words in sorted(beside, reverse=True))
        text += f". No single drive can identify {of_causes}"
    if gains:
        ways = ", ".join(f"{words} (to ±{_deg(left)})" for left, words in sorted(gains))
        text += f". To reduce this drive's part: {ways}"
    return found(text, whole)


def _contributions(native: _core.OcAnswer, params: Mapping[str, float], drive: float, parts: _Parts) -> str:
    """The contributions to the drive's part, the largest first; an unmeasured gyro bias is named in any case."""
    never_stood, zero = _core.status_of(native["yaw_rate_bias"]) == "unobservable", _zero(params)
    both = math.hypot(parts.gyro, parts.zero)
    apart = [(parts.gyro, "gyro bias", "", never_stood), (parts.zero, zero, "", False)]
    # Where the gyro bias was not measured: both shift a_y - r*v, and `_parts_of` splits them arbitrarily.
    together = [(both, f"gyro bias and {zero} (not separated)", "", never_stood)]
    sizes = [
        *(together if _gyro_hides_zero(native, params) and parts.zero >= _PART_REPORTED_FROM * both else apart),
        (parts.model, "limits of the model", "", False),
        (parts.play, "free play", _reason_of_play(native), False),
        (parts.rear, "zero of the rear axle's sensor", "", False),
        (parts.scatter, "measurement scatter", "", False),
    ]
    named = [
        (size, f"{words} ±{_deg(size)}{reason}")
        for size, words, reason, always in sizes
        if size > _PART_REPORTED_FROM * drive or always
    ]
    return ", ".join(words for _, words in sorted(named, reverse=True))


def _deg(half_width_deg: float) -> str:
    return f"{half_width_deg:.{1 if half_width_deg >= 0.095 else 2}f}"


class _Parts(NamedTuple):
    """Contributions to the drive's part as 95 % half-widths in deg; their squares sum to its square."""

    gyro: float
    zero: float  # of the accelerometer, or of what takes its place
    model: float
    play: float
    rear: float  # the given zero of a steered rear axle's sensor
    scatter: float


def _parts_of(native: _core.OcAnswer, params: Mapping[str, float], steering_ratio: float) -> _Parts:
    """Each in turn takes at most what is left of the whole; the scatter also takes the rest."""
    gyro = native["yaw_rate_bias"]
    slope = steering_ratio * abs(native["understeer_gradient"]["value"])
    of_play = max(native["backlash"]["standard_deviation"] ** 2 - TUNED["joint_answer.width_error"] ** 2, 0.0)
    in_turn = [
        ("rear", by_zero_sd(params, steering_ratio)),
        ("gyro", native["offset_per_yaw_rate_bias"] * gyro["standard_deviation"]),
        ("zero", slope * native["unloading_acceleration"]["standard_deviation"]),
        ("model", TUNED["joint_answer.offset_error"]),
        ("play", 0.5 * math.sqrt(of_play)),  # with loading to one side only, half of the play is in the offset
    ]
    if _core.status_of(gyro) == "unobservable":  # only its prior limits it: it gets all that scatter does not explain
        scatter = native["unexplained"] / math.sqrt(max(native["used"], 1.0))
        in_turn = [*(each for each in in_turn if each[0] != "gyro"), ("scatter", scatter), ("gyro", math.inf)]
    left = native["offset_parts"]["drive_sd"] ** 2
    parts = {"scatter": 0.0}
    for name, spread in in_turn:
        part = min(spread**2, left)
        left -= part
        parts[name] = 1.96 * math.sqrt(part) / DEGREE
    parts["scatter"] = math.hypot(parts["scatter"], 1.96 * math.sqrt(left) / DEGREE)
    return _Parts(**parts)


def _gyro_hides_zero(native: _core.OcAnswer, params: Mapping[str, float]) -> bool:
    return bool(params["use_accelerometer"]) and _core.status_of(native["yaw_rate_bias"]) == "unobservable"


def _zero(params: Mapping[str, float]) -> str:
    if params["use_accelerometer"]:
        return "accelerometer zero"
    return "torque zero" if params["torque_for_accelerometer_1"] else "road bank (not measured)"


def _reason_of_play(native: _core.OcAnswer) -> str:
    """The loading that is missing to identify it."""
    lacking = _lacking_sides(native)
    return f" because of too little lateral force to the {' and to the '.join(lacking)}" if lacking else ""


def _more_loading(native: _core.OcAnswer) -> str:
    """The driving that loads the lacking side, or the less loaded one."""
    lacking = _lacking_sides(native)
    if lacking:
        return f"drive {bends_demand(lacking)}"
    rarer = "left" if native["loaded_left_s"] < native["loaded_right_s"] else "right"
    return f"drive {demand(_MORE_DRIVING_S)} more of {rarer}-hand bends"


def _gains(
    native: _core.OcAnswer,
    params: Mapping[str, float],
    drive: float,
    parts: _Parts,
) -> Iterator[tuple[float, str]]:
    """Ways to reduce the drive's part by a tenth or more, each with the half-width in deg that remains. Standing still
    takes a second: it is listed in any case where the gyro bias was not measured."""

    def left(less: float) -> float:
        return math.sqrt(max(drive**2 - less, 0.0))

    more_s = native["used"] + _MORE_DRIVING_S
    never_stood = _core.status_of(native["yaw_rate_bias"]) == "unobservable"
    ways = (
        (left(_by_standing(native, params, parts)), "stand still for 1 s", never_stood),
        (left(parts.play**2), f"{_more_loading(native)}, or give the play in the vehicle file", False),
        (
            left(parts.scatter**2 * _MORE_DRIVING_S / more_s),
            f"drive {demand(_MORE_DRIVING_S)} more like this",
            False,
        ),
        (left(parts.rear**2), "measure the zero of the rear axle's sensor more accurately", False),
    )
    for would_be, words, always in ways:
        if drive - would_be >= _GAIN_REPORTED_FROM * drive or always:
            yield would_be, words


def _by_standing(native: _core.OcAnswer, params: Mapping[str, float], parts: _Parts) -> float:
    """Square of the half-width in deg that a second of standing removes: the gyro bias, except for its scatter at
    standstill, together with the accelerometer zero where the two were not separated. Otherwise also the accelerometer
    zero, except for the slope of the ground, where the truck has not stood still so far."""
    gyro = native["yaw_rate_bias"]
    gyro_sd = math.inf if _core.status_of(gyro) == "unobservable" else gyro["standard_deviation"]
    standing_sd = math.hypot(_core.standing_yaw_rate_sd(), native.get("yaw_rate_step_sd", 0.0))
    of_gyro: float = 1.96 * native["offset_per_yaw_rate_bias"] * min(gyro_sd, standing_sd) / DEGREE
    of_both = parts.gyro**2 + (parts.zero**2 if _gyro_hides_zero(native, params) else 0.0)
    gained: float = max(of_both - of_gyro**2, 0.0)
    if _gyro_hides_zero(native, params):
        return gained
    zero_sd: float = native["unloading_acceleration"]["standard_deviation"]
    has_stood = _core.status_of(native["standstill_lateral_acceleration"]) == "valid"
    if not params["use_accelerometer"] or has_stood or zero_sd <= 0.0:
        return gained
    crown_sd = math.hypot(params["crown_sd_m_s2"], params["crown_m_s2"] if native["traffic_side"] == 0.0 else 0.0)
    ground_sd = math.hypot(params["standing_slope_sd_m_s2"], params["standing_crown_share_1"] * crown_sd)
    return gained + parts.zero**2 * zero_sd**2 / (zero_sd**2 + ground_sd**2)
