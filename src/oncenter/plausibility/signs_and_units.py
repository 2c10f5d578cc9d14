"""Whether left is positive in all signals, and every signal has its stated unit: the signals of a turn compared."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import BENDS, NO_OFFSET, SIGNALS_TABLE, CannotTell, CheckResult, lacks
from oncenter.plausibility.correlation import agreement, agreement_of_means
from oncenter.plausibility.grid_signals import (
    DRIVING_M_S,
    GRID_HZ,
    MIN_TIME_S,
    NEEDED,
    ROLLING_M_S,
    Column,
    GridSignals,
)
from oncenter.signals import DEGREE, STANDARD_GRAVITY

_REAR_WHEELS = ("wheel_speed_rear_left", "wheel_speed_rear_right")
_WHEELS = ("wheel_speed_front_left", "wheel_speed_front_right", *_REAR_WHEELS)
_SIGNALS_OF = {
    "wheel speeds": _WHEELS,
    "difference of the rear wheel speeds": _REAR_WHEELS,
}  # others: their name


def _signals_of(names: Iterable[str]) -> tuple[str, ...]:
    """By their words in these findings."""
    return tuple(signal for name in names for signal in _SIGNALS_OF.get(name, (name.replace(" ", "_"),)))


@finding("sign_reversed", "error")
def sign(found: Kind, drive: GridSignals) -> CheckResult:
    """The signals of a turn vote; the minority is reversed."""
    against = {
        "steering wheel angle": (drive.angle, drive.curvature),
        "lateral acceleration": (drive.lateral_acceleration, drive.centripetal),
        "difference of the rear wheel speeds": (drive.rear_difference, drive.yaw_rate),
    }
    agrees = {name: agreement(x, y) for name, (x, y) in against.items()}
    like = ["yaw rate", *(name for name, sign in agrees.items() if sign > 0)]
    unlike = [name for name, sign in agrees.items() if sign < 0]
    if len(like) + len(unlike) < 2:
        return CannotTell("signs", lacks(drive, NEEDED, BENDS))
    if not unlike:
        return None
    minority, majority = sorted((like, unlike), key=len)
    suspects = minority
    if len(minority) == len(majority):
        suspects = [*like, *unlike]
        text = f"the sign of either the {_and(like)} or the {_and(unlike)} is reversed: left turns must be positive"
    else:
        text = f"the sign of the {_and(minority)} is reversed: left turns are positive in the {_and(majority)}"
    if suspects == ["steering wheel angle"] and _is_one_sided(drive.angle):
        text += ". Or it is a magnitude without sign, and its sign is another signal: then name that as sign_by"
    return found(f"{text}. {NO_OFFSET}. {_sign_remedy(suspects, drive)}", signals=_signals_of(suspects))


def _is_one_sided(values: Column) -> bool:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return min(-low, high) < _OTHER_SIDE_MAX * max(-low, high)


def _sign_remedy(suspects: list[str], drive: GridSignals) -> str:
    """The remedy for a reversed sign: a sign of -1 that [signals] gives already may be the mistake."""
    entries = {} if drive.vehicle is None else drive.vehicle.signals
    turned = [name for name in suspects if (entry := entries.get(name.replace(" ", "_"))) and entry.sign == -1]
    if not turned:
        return f"Set sign = -1 for it in {SIGNALS_TABLE}"
    if len(turned) == len(suspects) == 1:
        return f"Remove sign = -1 for it in {SIGNALS_TABLE}"
    return f"Check the signs in {SIGNALS_TABLE}: sign = -1 is set there for the {_and(turned)}"


def _and(names: list[str]) -> str:
    return " and the ".join(names)


# Ranges of each relation with right scales. At speed, understeer needs up to four times the angle i*L*r/v.
_ANGLE_PER_IL = (0.5, 4.0)
_ANGLE_PER_CURVATURE_M = (15.0, 400.0)  # without a vehicle file: i*L is 35 m for cars to 140 m for heavy trucks
_ACCELERATION_PER_RV = (1 / 1.8, 1.8)
_ACCELERATION_PER_RV_ON_MOTORWAYS = (0.3, 1.8)  # banked bends leave a third of r*v to the tyres
_MOTORWAY_M_S = 20.0
_WHEELS_PER_YAW_RATE_M = (0.9, 3.5)  # track width; half of it with a yaw rate twice too large
_WHEELS_PER_SPEED = (0.8, 1.25)

_OTHER_SIDE_MAX = 0.02  # share of a magnitude's range, by noise about zero

_RADIAN_IN_DEGREES = 1 / DEGREE


@dataclass(frozen=True)
class _UnitSlip:
    """One signal read in a wrong unit: too large by `factor`, with the power of that factor in each relation."""

    signal: str
    factor: float
    words: str
    powers: Mapping[str, int]

    def __str__(self) -> str:
        size = f"{'large' if self.factor > 1 else 'small'} by a factor of {max(self.factor, 1 / self.factor):.3g}"
        return f"the {self.signal} {'are' if self.signal.endswith('s') else 'is'} too {size} ({self.words})"


_MOVES = {
    "steering wheel angle": {"angle": 1},
    "yaw rate": {"angle": -1, "acceleration": -1, "turning wheels": -1},
    "vehicle speed": {"angle": 1, "acceleration": -1, "wheels": -1},
    "lateral acceleration": {"acceleration": 1},
    "wheel speeds": {"wheels": 1, "turning wheels": 1},
}
_SLIPS = [
    _UnitSlip(signal, factor**power, words, _MOVES[signal])
    for signal, factor, read_large, read_small in (
        ("steering wheel angle", _RADIAN_IN_DEGREES, "deg read as rad", "rad read as deg"),
        ("yaw rate", _RADIAN_IN_DEGREES, "deg/s read as rad/s", "rad/s read as deg/s"),
        ("vehicle speed", 3.6, "km/h read as m/s", "m/s read as km/h"),
        ("lateral acceleration", STANDARD_GRAVITY, "m/s^2 read as g", "g read as m/s^2"),
        ("wheel speeds", 3.6, "km/h read as m/s", "m/s read as km/h"),
    )
    for power, words in ((1, read_large), (-1, read_small))
]


_FAR_BEYOND = 1.5  # times the usual range; much play on straight roads and gusts exceed it by a tenth


@finding("scale", "error", "1")
def units(found: Kind, drive: GridSignals) -> CheckResult:
    """Each relation between signals against its range; a wrong unit must explain all of them at once."""
    shown = _relations(drive)
    if not shown:
        return CannotTell("scales", lacks(drive, NEEDED, BENDS))
    none = _UnitSlip("", 1.0, "", {})
    if _explains(none, shown):
        return None
    slips = [slip for slip in _SLIPS if _explains(slip, shown)]
    if not slips:
        off = [name for name, (ratio, low, high) in shown.items() if not low <= ratio <= high]
        if off == ["wheels"]:
            return None  # reported by `wheels`
        text = "the scales of the signals contradict each other, and no single wrong unit explains it: "
        text += "; ".join(
            f"{_RELATION[name]} is {shown[name][0]:.3g}, usual is {shown[name][1]:.3g} to {shown[name][2]:.3g}"
            for name in off
        )
        worst = max(max(ratio / high, low / ratio) for ratio, low, high in map(shown.__getitem__, off))
        severity = "error" if worst > _FAR_BEYOND else "warning"
        text += f". {NO_OFFSET if severity == 'error' else 'The interval of the offset does not include this error'}"
        text += f". Check the units in {SIGNALS_TABLE}"
        if "angle" in off and drive.vehicle is not None:
            text += ", and its steering ratio and wheelbase"
        of_relations = dict.fromkeys(signal for name in off for signal in _SIGNALS_IN[name])
        return found(text, severity=severity, signals=tuple(of_relations))
    return found(
        "a unit is wrong: " + ", or ".join(map(str, slips)) + f". {NO_OFFSET}. Correct the unit in {SIGNALS_TABLE}",
        slips[0].factor,
        signals=_signals_of(slip.signal for slip in slips),
    )


_RELATION = {
    "angle": "steering wheel angle divided by curvature, in m,",
    "acceleration": "lateral acceleration divided by yaw rate times speed",
    "turning wheels": "difference of the rear wheel speeds divided by yaw rate, in m,",
    "wheels": "wheel speed divided by vehicle speed",
}
_SIGNALS_IN = {
    "angle": ("steering_wheel_angle",),
    "acceleration": ("yaw_rate", "vehicle_speed", "lateral_acceleration"),
    "turning wheels": ("yaw_rate", *_REAR_WHEELS),
    "wheels": ("vehicle_speed", *_WHEELS),
}


def _relations(drive: GridSignals) -> dict[str, tuple[float, float, float]]:
    """The relations by name: the ratio of the drive, and its usual range."""
    il = drive.ratio_times_wheelbase_m()
    angle_limits = _ANGLE_PER_CURVATURE_M if il is None else (_ANGLE_PER_IL[0] * il, _ANGLE_PER_IL[1] * il)
    pairs = {
        "angle": (_spread_ratio, drive.angle, drive.curvature, angle_limits),
        "acceleration": (_spread_ratio, drive.lateral_acceleration, drive.centripetal, _acceleration_limits(drive)),
        "turning wheels": (_slope, drive.rear_difference, drive.yaw_rate, _WHEELS_PER_YAW_RATE_M),
    }
    shown = {name: (ratio(x, y), *limits) for name, (ratio, x, y, limits) in pairs.items() if agreement(x, y) != 0}
    wheels = _wheel_speed_ratio(drive)
    if wheels is not None:
        shown["wheels"] = (wheels, *_WHEELS_PER_SPEED)
    return shown


def confirming_yaw_rate(drive: GridSignals) -> frozenset[str]:
    """Those of "angle" and "acceleration" that follow the yaw rate in sign and scale; none where one contradicts it."""
    others = {
        "angle": (drive.angle, drive.curvature, _ANGLE_PER_CURVATURE_M),
        "acceleration": (drive.lateral_acceleration, drive.centripetal, _acceleration_limits(drive)),
    }
    confirming = set()
    for name, (x, y, (low, high)) in others.items():
        agrees = agreement(x, y)
        if agrees > 0 and low <= _spread_ratio(x, y) <= high:
            confirming.add(name)
        elif agrees != 0:
            return frozenset()
    return frozenset(confirming)


def _acceleration_limits(drive: GridSignals) -> tuple[float, float]:
    driven = drive.speed[drive.speed > DRIVING_M_S]
    fast = len(driven) > 0 and float(np.median(driven)) > _MOTORWAY_M_S
    return _ACCELERATION_PER_RV_ON_MOTORWAYS if fast else _ACCELERATION_PER_RV


def _spread_ratio(x: Column, y: Column) -> float:
    """Change of x per change of y, independent of sign."""
    both = np.isfinite(x) & np.isfinite(y)
    return float(np.std(x[both]) / np.std(y[both]))


def _slope(x: Column, y: Column) -> float:
    """The same by least squares, for an x with far more noise than y."""
    both = np.isfinite(x) & np.isfinite(y)
    return abs(float(np.cov(x[both], y[both])[0, 1] / np.var(y[both], ddof=1)))


def _explains(slip: _UnitSlip, shown: Mapping[str, tuple[float, float, float]]) -> bool:
    return all(
        low <= ratio / slip.factor ** slip.powers.get(name, 0) <= high for name, (ratio, low, high) in shown.items()
    )


_WHEELS_OFF = 0.05  # tyre wear and pressure make 3 %


@finding("wheel_speed", "warning", "%")
def wheels(found: Kind, drive: GridSignals, scale: CheckResult) -> CheckResult:
    """`scale` is the verdict of `units`; where a wrong unit explains the same difference, only that is reported."""
    ratio = _wheel_speed_ratio(drive)
    if ratio is None:
        why = lacks(drive, ("vehicle_speed",), f"needs {MIN_TIME_S:.0f} s of rolling")
        has_wheels = drive.has(*drive.wheel_pair())
        return CannotTell("vehicle speed against wheel speeds", why if has_wheels else "no wheel speeds")
    if abs(ratio - 1) <= _WHEELS_OFF or isinstance(scale, Finding):
        return None
    faster = 100 * (ratio - 1)
    if faster > 1000:
        return found(
            f"the wheels turn while the vehicle speed reads nearly zero. {NO_OFFSET}. Check the vehicle speed in "
            f"{SIGNALS_TABLE}",
            severity="error",
            signals=("vehicle_speed",),
        )
    order = "faster" if faster > 0 else "slower"
    return found(
        f"the wheel speeds are {abs(faster):.0f} % {order} than the vehicle speed. The interval of the offset does not "
        "include this error. Check the tyre size and the calibration of the vehicle speed",
        faster,
        signals=("vehicle_speed", *drive.wheel_pair()),
    )


def _wheel_speed_ratio(drive: GridSignals) -> float | None:
    both = np.isfinite(drive.wheel_speed) & np.isfinite(drive.speed)
    both &= np.fmax(drive.wheel_speed, drive.speed) > ROLLING_M_S
    if both.sum() < MIN_TIME_S * GRID_HZ:
        return None
    return float(np.median(drive.wheel_speed[both]) / max(float(np.median(drive.speed[both])), 1e-3))


_TORQUE = ("steering_wheel_torque",)
_TORQUE_EFFECT = "The offset uses this signal only with --no-accelerometer, and is not reliable then"
_TORQUE_MEANS_S = 2.0  # friction and gaps of the steering average out
_TORQUE_CORRELATION = 0.3  # of such means, in both halves of the drive
_TORQUE_SLOPE_OFF = 10.0  # times the params' slope, or a share of it


def torque(drive: GridSignals, comparable: bool) -> list[CheckResult]:
    """The steering wheel torque against the lateral acceleration, or r*v without one; nothing where the log has none.

    It has no vote on the other signs, since friction and play make it the least reliable signal of a turn.
    """
    if not drive.has("steering_wheel_torque"):
        return []
    subject = "sign and scale of the steering wheel torque"
    if not comparable:
        return [CannotTell(subject, "the other signals contradict each other")]
    moves = drive.lateral_acceleration if drive.has("lateral_acceleration") else drive.centripetal
    steps = round(_TORQUE_MEANS_S / drive.step_s)
    x, y = (_rows_of(drive.driven(values), steps).mean(axis=1) for values in (moves, drive.torque))
    if agreement_of_means(x, y, _TORQUE_CORRELATION, round(MIN_TIME_S / _TORQUE_MEANS_S)) == 0:
        return [CannotTell(subject, lacks(drive, NEEDED, BENDS))]
    both = np.isfinite(x) & np.isfinite(y)
    slope = float(np.cov(x[both], y[both])[0, 1] / np.var(x[both], ddof=1))
    if slope < 0.0:
        return [_torque_reversed(drive)]
    usual = drive.params["torque_slope_n_m_m_s2"]
    if usual / _TORQUE_SLOPE_OFF < slope < usual * _TORQUE_SLOPE_OFF:
        return []
    return [_torque_scale(slope, usual)]


@finding("sign_reversed", "error")
def _torque_reversed(found: Kind, drive: GridSignals) -> Finding:
    return found(
        "the sign of the steering wheel torque is reversed: it must be positive where the driver steers left. "
        f"{_TORQUE_EFFECT}. {_sign_remedy(['steering wheel torque'], drive)}",
        signals=_TORQUE,
    )


@finding("scale", "error", "N m/(m/s^2)")
def _torque_scale(found: Kind, slope: float, usual: float) -> Finding:
    return found(
        f"the steering wheel torque is {slope:.3g} N m per m/s^2 of lateral acceleration; usual is {usual:.3g}. "
        f"{_TORQUE_EFFECT}. Check its unit, or set torque_slope_n_m_m_s2 = {slope:.3g} in the [params] table of the "
        "vehicle file",
        slope,
        signals=_TORQUE,
    )


def _rows_of(values: Column, steps: int) -> Column:
    return values[: len(values) // steps * steps].reshape(-1, steps)
