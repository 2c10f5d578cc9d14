"""Statements on a truck that its drive contradicts: side of traffic, set-up of the front axle, free play, assistance.

Roads fall by `crown_m_s2` to the side of traffic. The mean bank less the neutral lateral acceleration shows that fall:
the accelerometer's zero cancels. It is the crown for an ordinary front axle, and about zero for one that is set up for
the crown, whose neutral lateral acceleration is the crown.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from oncenter import _core
from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import SIGNALS_TABLE
from oncenter.plausibility.statuses import without
from oncenter.signals import DEGREE, SIGNALS, STANDARD_GRAVITY, Signals
from oncenter.vehicle import STATED_WRONG_1, Vehicle

_POSSIBLE = 0.025  # probability from which the other is said: one tail of a 95 % interval
_PLAY_SDS = 3.0  # between stated and estimated play
_ASSISTANCE = "steering_assist_active"
_ASSISTED_MIN_S = 60.0  # s of either value: fewer show no play
# Between the play of both parts of a drive. On 60 tuning drives of resting_hand in bench/wrong_statements.py, the
# driver's part has 0.3 to 7.3 standard deviations more play than the motor's, 2 or more on 56 of them.
_ASSISTED_SDS = 2.0
_PERCENT = 100.0 / STANDARD_GRAVITY
_WITHOUT = "The offset is estimated without this statement"


def without_inverted_assistance(
    native: _core.OcAnswer, logs: tuple[Signals, ...], run: Callable[[tuple[Signals, ...]], _core.OcAnswer]
) -> tuple[tuple[Signals, ...], Finding | None]:
    """The logs without a status of a steering assistance whose sense seems inverted, and the finding about it.

    Args:
        native: the core's oc_answer of the joint method on the logs.
        run: the same on other logs.
    """
    if not all(map(_may_be_inverted, logs)):
        return logs, None
    found = _assistance_inverted(native["backlash"], run(tuple(map(_inverted, logs)))["backlash"])
    return (logs, None) if found is None else (tuple(without(log, (_ASSISTANCE,)) for log in logs), found)


def _may_be_inverted(log: Signals) -> bool:
    values = log.columns.get(SIGNALS[_ASSISTANCE].column)
    if values is None:
        return False
    counts = np.count_nonzero(values > 0.5), np.count_nonzero(values < 0.5)
    return bool(min(counts) > _ASSISTED_MIN_S * log.rate_hz)


def _inverted(log: Signals) -> Signals:
    column = SIGNALS[_ASSISTANCE].column
    return log.replaced({**log.columns, column: 1.0 - log.columns[column]}, log.sources)


@finding("status_contradicted", "warning", "deg")
def _assistance_inverted(found: Kind, used: _core.OcEstimate, unused: _core.OcEstimate) -> Finding | None:
    """The time in which a motor is said to steer shows more free play than the rest: a hand that rests on the wheel
    while a motor steers shows less."""
    if "unobservable" in (_core.status_of(used), _core.status_of(unused)):
        return None
    more = (unused["value"] - used["value"]) / DEGREE
    sd = math.hypot(unused["standard_deviation"], used["standard_deviation"]) / DEGREE
    if more < _ASSISTED_SDS * sd:
        return None
    return found(
        f"the time in which the status '{_ASSISTANCE}' is true shows {more:.1f} ±{1.96 * sd:.1f} deg more free play "
        "than the rest. A hand that rests on the wheel while a motor steers shows less, so its sense seems inverted. "
        f"The offset does not use this status. Check its 'true_when' in {SIGNALS_TABLE}, and its sender",
        more,
    )


class Fall(NamedTuple):
    """Fall of the roads to the stated side, and its standard deviation by pull, wind and the choice of roads, m/s^2."""

    value: float
    sd: float

    def contradicts(self, expected: float, other: float) -> bool:
        """Whether the 95 % interval about the expected fall excludes it."""
        return (self.value - expected) * (other - expected) > 0.0 and abs(self.value - expected) > 1.96 * self.sd

    def allows(self, expected: float, other: float) -> bool:
        """Whether the other fall is possible, by Bayes over two normals."""
        cost = ((self.value - other) ** 2 - (self.value - expected) ** 2) / (2.0 * self.sd**2)
        return cost < math.log((1.0 - _POSSIBLE) / _POSSIBLE) - math.log((1.0 - STATED_WRONG_1) / STATED_WRONG_1)

    def words(self) -> str:
        return f"{self.value * _PERCENT:.1f} ±{1.96 * self.sd * _PERCENT:.1f} %"


def fall_of(native: _core.OcAnswer, params: Mapping[str, float], traffic_sign: float) -> Fall | None:
    """Without a side its size; None where the drive does not show it."""
    neutral = native["unloading_acceleration"]
    has_bank = _core.status_of(native["yaw_rate_bias"]) == "valid"  # a bias would be in a_y - r*v
    if not params["use_accelerometer"] or not has_bank or _core.status_of(neutral) != "valid":
        return None
    value = native["bank_mean"] - neutral["value"]
    sd = math.hypot(
        neutral["standard_deviation"], params["crown_sd_m_s2"], params["pull_sd_m_s2"], params["wind_sd_m_s2"]
    )
    return Fall(traffic_sign * value if traffic_sign else abs(value), sd)


def without_contradicted(
    native: _core.OcAnswer,
    params: Mapping[str, float],
    vehicle: Vehicle,
    run: Callable[[Mapping[str, float]], _core.OcAnswer],
) -> tuple[Mapping[str, float], tuple[Finding, ...]]:
    """The params without statements that the drive contradicts, and the findings about them.

    Args:
        native: the core's oc_answer of the joint method with `params`.
        run: the same with other params. A given play that is too large leaves no hypothesis near the true one, so only
            a run without it shows the contradiction.
    """
    found = set_up_contradicted(native, params, vehicle, _WITHOUT)
    if found is not None and found.severity == "info" and vehicle.set_up_for_crown:
        found = None  # the interval contains both, and the answer's own findings say so
    if found is not None:
        params = {**params, **_of_unknown_set_up()}
    if vehicle.play_deg is None or params["known_play_sd_rad"] <= 0.0:
        return params, () if found is None else (found,)
    without_play = {**params, "known_play_rad": 0.0, "known_play_sd_rad": 0.0}
    of_play = _play_contradicted(run(without_play), params)
    return params if of_play is None else without_play, tuple(each for each in (found, of_play) if each is not None)


def _of_unknown_set_up() -> Mapping[str, float]:
    by_default = _core.default_params()
    return {key: by_default[key] for key in ("set_up_probability_1", "known_pull_m_s2", "known_pull_sd_m_s2")}


@finding("set_up_contradicted", "warning", "%")
def set_up_contradicted(
    found: Kind,
    native: _core.OcAnswer,
    params: Mapping[str, float],
    vehicle: Vehicle,
    effect: str = "The offset rests on this statement",
) -> Finding | None:
    """Roads that fall by the crown though the axle is stated to be set up for it, or level ones though it is stated not
    to be; an info where both are possible."""
    stated, side, crown = vehicle.set_up_for_crown, vehicle.traffic_sign, params["crown_m_s2"]
    in_force = params["known_pull_sd_m_s2"] > 0.0 if stated else params["set_up_probability_1"] == 0.0
    fall = fall_of(native, params, side)
    if stated is None or not in_force or fall is None or crown <= 0.0:
        return None
    expected, other = (0.0, crown) if stated else (crown, 0.0)
    if not fall.allows(expected, other):
        return None
    is_sure = fall.contradicts(expected, other)
    if stated and not is_sure:
        effect = "The interval of the offset contains both"
    return found(
        f"'set_up_for_crown' is {str(stated).lower()} in the vehicle file. The mean slope of these roads is "
        f"{fall.words()} away from the one at which the steering is free of lateral force. About "
        f"{expected * _PERCENT:.0f} % is usual then, and {other * _PERCENT:.0f} % otherwise. {effect}. Ask the "
        "workshop how the front axle is set up, and correct the vehicle file",
        fall.value * _PERCENT,
        severity=None if is_sure else "info",
    )


@finding("side_or_set_up", "warning", "deg")
def side_or_set_up(
    found: Kind, native: _core.OcAnswer, params: Mapping[str, float], vehicle: Vehicle
) -> Finding | None:
    """Level roads by this drive, with a side of traffic, and nothing stated of the axle's set-up; an info where a usual
    axle is possible as well."""
    side, crown = vehicle.traffic_sign, params["crown_m_s2"]
    effect = native["offset_parts"]["per_acceleration"] * crown / DEGREE
    states_set_up = params["known_pull_sd_m_s2"] > 0.0 or params["set_up_probability_1"] <= 0.0
    fall = fall_of(native, params, side)
    if side == 0.0 or states_set_up or fall is None or effect <= 0.0 or not fall.allows(crown, 0.0):
        return None
    lower, higher = ("lower", "higher") if side > 0.0 else ("higher", "lower")
    return found(
        f"these roads slope down to the {'right' if side > 0.0 else 'left'} by {fall.words()} from the slope at which "
        f"the steering is free of lateral force; {crown * _PERCENT:.0f} % is usual. If the front axle is set up for "
        f"the road crown, the offset is {effect:.1f} deg {lower}, which its interval allows for. If it is set up and "
        f"'traffic_side' is wrong, the offset is {effect:.1f} deg {higher}, which its interval does not contain. Check "
        "'traffic_side', and give 'set_up_for_crown' as the workshop has set it",
        effect,
        severity=None if fall.contradicts(crown, 0.0) else "info",
    )


@finding("play_contradicted", "warning", "deg")
def _play_contradicted(found: Kind, without: _core.OcAnswer, params: Mapping[str, float]) -> Finding | None:
    """The play by a run without the stated one is far from it."""
    play = without["backlash"]
    value, sd = play["value"] / DEGREE, play["standard_deviation"] / DEGREE
    stated, stated_sd = params["known_play_rad"] / DEGREE, params["known_play_sd_rad"] / DEGREE
    lacks = without["lacking_to_left"] + without["lacking_to_right"] > 0.0
    if _core.status_of(play) == "unobservable" or lacks or abs(value - stated) < _PLAY_SDS * math.hypot(sd, stated_sd):
        return None
    return found(
        f"the drive shows {value:.1f} ±{1.96 * sd:.1f} deg of free play, and 'play_deg' of the vehicle file is "
        f"{stated:.1f} deg (sd {stated_sd:.1f}). {_WITHOUT}. Measure the play, or remove it from the vehicle file",
        value - stated,
    )
