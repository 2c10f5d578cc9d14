"""Whether the signals of a drive fit together: sign, scale, lag, ratio times wheelbase, zero, resolution.

A turn is told four times over: by the angle, the yaw rate, the lateral acceleration and the rear wheels' difference.
Each check compares some of these witnesses and returns a finding, nothing (all is well), or `CannotTell` with the
evidence that it lacks. Limits are ours unless a source is named; they are wide enough for any road vehicle.

SI and rad inside; findings are for people and files and hold degrees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.findings import Finding
from oncenter.signals import DEGREE, SIGNALS, STANDARD_GRAVITY, Signals
from oncenter.vehicle import Vehicle

Column = npt.NDArray[np.float64]

NEEDED = ("steering_wheel_angle", "yaw_rate", "vehicle_speed")
USEFUL = (*NEEDED, "lateral_acceleration")

_GRID_HZ = 20.0  # checks run on means over 50 ms: noise is less, steering and yawing are all there
_ROLLING_M_S = 2.0  # r/v means something above it
_DRIVING_M_S = 5.0
_MIN_TIME_S = 30.0  # a comparison of two witnesses needs it
_CORRELATION = 0.6  # in either half of the drive, so that no single event decides; less tells nothing


@dataclass(frozen=True)
class CannotTell:
    """A check that the drive does not decide, and what it would need."""

    check: str
    why: str


Verdict = Finding | CannotTell | None


@dataclass(frozen=True)
class Plausibility:
    """`findings` the gravest first, empty when all that could be judged fits; `cannot_tell` what was not judged."""

    findings: tuple[Finding, ...]
    cannot_tell: tuple[CannotTell, ...]


def check(signals: Signals, vehicle: Vehicle | None = None) -> Plausibility:
    """Judges the signals of a drive together.

    Args:
        signals: of one drive; any of them may be missing, and what needs it is not judged.
        vehicle: with it, ratio times wheelbase is judged; without, it is told as the drive shows it.
    """
    drive = _Drive(signals, vehicle)
    found = [*_missing(drive), *_availability(drive), *_stuck(drive), *_resolution(drive)]
    found += [
        judge(drive)
        for judge in (_sign, _scale, _wheels, _angle_lag, _acceleration_lag, _ratio, _yaw_rate_zero, _standing, _bank)
    ]
    found += [_relative_sensor(drive), _whole_turns(drive)]
    gravity = {"error": 0, "warning": 1, "info": 2}
    findings = [verdict for verdict in found if isinstance(verdict, Finding)]
    return Plausibility(
        tuple(sorted(findings, key=lambda finding: gravity[finding.severity])),
        tuple(verdict for verdict in found if isinstance(verdict, CannotTell)),
    )


class _Drive:
    """The witnesses on the 20 Hz grid; NaN where not available, all NaN where the log lacks a signal."""

    def __init__(self, signals: Signals, vehicle: Vehicle | None) -> None:
        self.signals = signals
        self.vehicle = vehicle
        self.params = {**_core.default_params(), **(vehicle.params if vehicle else {})}
        self.ticks_per_step = max(1, round(signals.rate_hz / _GRID_HZ))
        self.step_s = self.ticks_per_step / signals.rate_hz
        self.angle = self._means("steering_wheel_angle")
        self.yaw_rate = self._means("yaw_rate")
        self.speed = self._means("vehicle_speed")
        self.lateral_acceleration = self._means("lateral_acceleration")
        self.rear_difference = self._means("wheel_speed_rear_right") - self._means("wheel_speed_rear_left")
        self.wheel_speed = np.mean([self._means(name) for name in self.wheel_pair()], axis=0)
        rolling = self.speed > _ROLLING_M_S
        self.curvature = np.where(rolling, self.yaw_rate / np.where(rolling, self.speed, 1.0), np.nan)
        self.centripetal = np.where(rolling, self.yaw_rate * self.speed, np.nan)

    def ticks(self, name: str) -> Column:
        """A signal at the table's own rate."""
        table, column = self.signals.table, SIGNALS[name].column
        if column not in table.columns:
            return np.full(table.height, np.nan)
        return np.asarray(table[column].to_numpy(), dtype=np.float64)

    def has(self, *names: str) -> bool:
        return all(name in self.signals.sources for name in names)

    @cached_property
    def unlike(self) -> bool:
        """Whether sign or scale is wrong: then what rests on r/v and r*v being right is not judged."""
        return isinstance(_sign(self), Finding) or isinstance(_scale(self), Finding)

    @cached_property
    def standing(self) -> npt.NDArray[np.bool_]:
        """Ticks at standstill, after the cab has come to rest."""
        slow = self.ticks("vehicle_speed") < self.params["standstill_speed_max_m_s"]
        settling = round(self.params["standstill_settling_s"] * self.signals.rate_hz)
        since_moving = np.arange(len(slow)) - np.maximum.accumulate(np.where(slow, -1, np.arange(len(slow))))
        return np.asarray(slow & (since_moving > settling))

    def wheel_pair(self) -> tuple[str, str]:
        """Left and right of one axle, so that a bend does not change their mean; the axle without drive first."""
        front, rear = ((f"wheel_speed_{axle}_left", f"wheel_speed_{axle}_right") for axle in ("front", "rear"))
        return front if self.has(*front) else rear

    def _means(self, name: str) -> Column:
        ticks, k = self.ticks(name), self.ticks_per_step
        whole = len(ticks) // k * k
        return np.asarray(ticks[:whole].reshape(-1, k).mean(axis=1))


def _missing(drive: _Drive) -> list[Verdict]:
    return [
        Finding(
            "missing_signal",
            "error" if name in NEEDED else "info",
            f"no {_words(name)}: "
            + ("no answer without it" if name in NEEDED else "bank and understeer then rest on r*v alone"),
        )
        for name in USEFUL
        if not drive.has(name)
    ]


_NOT_AVAILABLE = 0.05  # of the ticks
_SLOWEST_HZ = 9.5  # the 3 Hz low-pass of 5.1.1 needs more than twice its cut-off; EBC2 and CCVS1 come at 10


def _availability(drive: _Drive) -> list[Verdict]:
    found: list[Verdict] = []
    for name in filter(drive.has, USEFUL):
        share = float(np.isnan(drive.ticks(name)).mean())
        if share > _NOT_AVAILABLE:
            text = f"the {_words(name)} has no number for {100 * share:.0f} % of the time"
            found.append(Finding("signal_not_available", "warning", text, 100 * share, "%"))
        rate_hz = drive.signals.sources[name].rate_hz
        if 0 < rate_hz < _SLOWEST_HZ:
            text = f"the {_words(name)} comes at {rate_hz:.3g} Hz only: steering is faster than that"
            found.append(Finding("signal_slow", "warning", text, rate_hz, "Hz"))
    return found


# s of the very same number while rolling; a held wheel still moves by a bit of 1/1024 rad, a cruise control holds long
_STUCK_S = {"steering_wheel_angle": 20.0, "yaw_rate": 20.0, "lateral_acceleration": 20.0, "vehicle_speed": 120.0}


def _stuck(drive: _Drive) -> list[Verdict]:
    rolling = (drive.ticks("vehicle_speed") > _ROLLING_M_S)[1:]
    found: list[Verdict] = []
    for name, limit_s in _STUCK_S.items():
        same_s = _longest_run((np.diff(drive.ticks(name)) == 0.0) & rolling) / drive.signals.rate_hz
        if same_s > limit_s:
            text = f"the {_words(name)} stands still at one number for {same_s:.0f} s while the vehicle rolls: stuck?"
            found.append(Finding("signal_stuck", "error", text, same_s, "s"))
    return found


def _longest_run(true: npt.NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], true, [False])).astype(np.int8)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


# coarsest step that does no harm: angle, a share of Table 1's 2.5 deg; yaw rate, half of 5.3.1's 0.2 deg/s
_COARSEST = {
    "steering_wheel_angle": (1.05, DEGREE, "deg"),
    "yaw_rate": (0.105, DEGREE, "deg/s"),
    "lateral_acceleration": (0.105, 1.0, "m/s^2"),
    "vehicle_speed": (1.05, 1 / 3.6, "km/h"),
}


def _resolution(drive: _Drive) -> list[Verdict]:
    found: list[Verdict] = []
    for name, (coarsest, factor, unit) in _COARSEST.items():
        step = resolution(drive.ticks(name))
        if step is not None and step / factor > coarsest:
            text = f"the {_words(name)} comes in steps of {step / factor:.3g} {unit}: coarse for this purpose"
            found.append(Finding("signal_coarse", "warning", text, step / factor, unit))
    return found


def resolution(values: Column) -> float | None:
    """The step in which a signal comes, in its unit; None where it shows none.

    Only numbers that recur count: what was interpolated between two samples hardly does, what was measured does.
    """
    numbers, counts = np.unique(np.round(values[np.isfinite(values)], 9), return_counts=True)
    recurring = numbers[counts >= 3]
    return float(np.quantile(np.diff(recurring), 0.1)) if len(recurring) >= 5 else None


def _sign(drive: _Drive) -> Verdict:
    """The witnesses of a turn vote; the minority is reversed."""
    against = {
        "steering wheel angle": (drive.angle, drive.curvature),
        "lateral acceleration": (drive.lateral_acceleration, drive.centripetal),
        "difference of the rear wheel speeds": (drive.rear_difference, drive.yaw_rate),
    }
    agrees = {name: _agreement(x, y) for name, (x, y) in against.items()}
    like = ["yaw rate", *(name for name, sign in agrees.items() if sign > 0)]
    unlike = [name for name, sign in agrees.items() if sign < 0]
    if len(like) + len(unlike) < 2:
        return CannotTell("signs", _lacks(drive, NEEDED, _BENDS))
    if not unlike:
        return None
    minority, majority = sorted((like, unlike), key=len)
    if len(minority) == len(majority):
        text = f"either the {_and(like)} or the {_and(unlike)} has its sign reversed: left turns are to be positive"
    else:
        text = f"the {_and(minority)} has its sign reversed: left turns are positive in the {_and(majority)}"
    return Finding("sign_reversed", "error", text + " (set sign = -1 in [signals])")


def _agreement(x: Column, y: Column) -> int:
    """1 when two witnesses follow each other, -1 when they do so mirrored, 0 when the drive does not tell."""
    both = np.isfinite(x) & np.isfinite(y)
    if both.sum() < _MIN_TIME_S * _GRID_HZ:
        return 0
    halves = zip(np.array_split(x[both], 2), np.array_split(y[both], 2), strict=True)
    first, second = (_correlation(a, b) for a, b in halves)
    if min(abs(first), abs(second)) < _CORRELATION or first * second < 0:
        return 0
    return 1 if first > 0 else -1


def _correlation(x: Column, y: Column) -> float:
    spread = float(np.std(x) * np.std(y))
    return float(np.mean((x - x.mean()) * (y - y.mean()))) / spread if spread > 0 else 0.0


# Where a right scale puts each relation. Understeer turns more angle than i*L*r/v at speed: up to four times.
_ANGLE_PER_IL = (0.5, 4.0)
_ANGLE_PER_CURVATURE_M = (15.0, 400.0)  # i*L of cars 35 to heavy trucks 140 m, where no vehicle file says it
_ACCELERATION_PER_RV = (1 / 1.8, 1.8)
_WHEELS_PER_YAW_RATE_M = (0.9, 3.5)  # track width; noise widens it
_WHEELS_PER_SPEED = (0.8, 1.25)

_RADIAN_IN_DEGREES = 1 / DEGREE


@dataclass(frozen=True)
class _UnitSlip:
    """One signal read in the wrong unit: too large by `factor`, and how that moves each relation (its power)."""

    signal: str
    factor: float
    words: str
    powers: Mapping[str, int]

    def __str__(self) -> str:
        size = f"{'large' if self.factor > 1 else 'small'} by {max(self.factor, 1 / self.factor):.3g}"
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
        ("steering wheel angle", _RADIAN_IN_DEGREES, "deg taken for rad", "rad taken for deg"),
        ("yaw rate", _RADIAN_IN_DEGREES, "deg/s taken for rad/s", "rad/s taken for deg/s"),
        ("vehicle speed", 3.6, "km/h taken for m/s", "m/s taken for km/h"),
        ("lateral acceleration", STANDARD_GRAVITY, "m/s^2 taken for g", "g taken for m/s^2"),
        ("wheel speeds", 3.6, "km/h taken for m/s", "m/s taken for km/h"),
    )
    for power, words in ((1, read_large), (-1, read_small))
]


def _scale(drive: _Drive) -> Verdict:
    """Each relation between witnesses against where it belongs; a slip of units must explain all of them at once."""
    seen = _relations(drive)
    if not seen:
        return CannotTell("scales", _lacks(drive, NEEDED, _BENDS))
    none = _UnitSlip("", 1.0, "", {})
    if _explains(none, seen):
        return None
    slips = [slip for slip in _SLIPS if _explains(slip, seen)]
    if not slips:
        off = [name for name, (ratio, low, high) in seen.items() if not low <= ratio <= high]
        if off == ["wheels"]:
            return None  # `_wheels` says it
        text = "the scales do not fit together, and no single mix-up of units explains it: " + ", ".join(
            f"{_RELATION[name]} is {seen[name][0]:.3g}, usual is {seen[name][1]:.3g} to {seen[name][2]:.3g}"
            for name in off
        )
        return Finding("scale", "error", text)
    return Finding("scale", "error", "a unit is mixed up: " + ", or ".join(map(str, slips)), slips[0].factor, "1")


_RELATION = {
    "angle": "angle over r/v in m",
    "acceleration": "lateral acceleration over r*v",
    "turning wheels": "rear wheel difference over yaw rate in m",
    "wheels": "wheel speed over vehicle speed",
}


def _relations(drive: _Drive) -> dict[str, tuple[float, float, float]]:
    """By name: the ratio that the drive shows, and between what it belongs."""
    il = _ratio_times_wheelbase(drive.vehicle)
    angle_limits = _ANGLE_PER_CURVATURE_M if il is None else (_ANGLE_PER_IL[0] * il, _ANGLE_PER_IL[1] * il)
    pairs = {
        "angle": (drive.angle, drive.curvature, angle_limits),
        "acceleration": (drive.lateral_acceleration, drive.centripetal, _ACCELERATION_PER_RV),
        "turning wheels": (drive.rear_difference, drive.yaw_rate, _WHEELS_PER_YAW_RATE_M),
    }
    seen = {name: (_spread_ratio(x, y), *limits) for name, (x, y, limits) in pairs.items() if _agreement(x, y) != 0}
    wheels = _wheel_speed_ratio(drive)
    if wheels is not None:
        seen["wheels"] = (wheels, *_WHEELS_PER_SPEED)
    return seen


def _spread_ratio(x: Column, y: Column) -> float:
    """How much x moves for y, whatever their signs."""
    both = np.isfinite(x) & np.isfinite(y)
    return float(np.std(x[both]) / np.std(y[both]))


def _explains(slip: _UnitSlip, seen: Mapping[str, tuple[float, float, float]]) -> bool:
    return all(
        low <= ratio / slip.factor ** slip.powers.get(name, 0) <= high for name, (ratio, low, high) in seen.items()
    )


_WHEELS_OFF = 0.05  # tyre wear and pressure make 3 %


def _wheels(drive: _Drive) -> Verdict:
    ratio = _wheel_speed_ratio(drive)
    if ratio is None:
        why = _lacks(drive, ("vehicle_speed",), f"needs {_MIN_TIME_S:.0f} s of rolling")
        has_wheels = drive.has(*drive.wheel_pair())
        return CannotTell("vehicle speed against wheel speeds", why if has_wheels else "no wheel speeds")
    if abs(ratio - 1) <= _WHEELS_OFF or isinstance(_scale(drive), Finding):
        return None
    faster = 100 * (ratio - 1)
    if faster > 1000:
        return Finding("wheel_speed", "error", "the wheels turn while the vehicle speed reads next to nothing")
    text = f"the wheels turn {faster:+.0f} % against the vehicle speed: tyre size, or the speed's calibration"
    return Finding("wheel_speed", "warning", text, faster, "%")


def _wheel_speed_ratio(drive: _Drive) -> float | None:
    both = np.isfinite(drive.wheel_speed) & np.isfinite(drive.speed)
    both &= np.fmax(drive.wheel_speed, drive.speed) > _ROLLING_M_S
    if both.sum() < _MIN_TIME_S * _GRID_HZ:
        return None
    return float(np.median(drive.wheel_speed[both]) / max(float(np.median(drive.speed[both])), 1e-3))


_LAG_SEARCHED_S = 2.0
_LAG_CORRELATION = 0.8
_ANGLE_TO_YAW_S = (-0.05, 0.5)  # tyres, chassis and play make it late; a loaded truck at speed takes some 0.3 s
_YAW_TO_ACCELERATION_S = (-0.2, 0.2)  # the sensor's place along the vehicle and the roll of the cab move it


def _angle_lag(drive: _Drive) -> Verdict:
    subject = "lag of the yaw rate behind the angle"
    lags_s = _lags_s(_driven(drive, drive.angle), drive.curvature, drive.step_s)
    if lags_s is None:
        return CannotTell(subject, _lacks(drive, NEEDED, _BENDS))
    return _beyond(subject, lags_s, _ANGLE_TO_YAW_S, "lag_yaw_rate")


def _acceleration_lag(drive: _Drive) -> Verdict:
    subject = "lag of the lateral acceleration behind the yaw rate"
    lags_s = _lags_s(_driven(drive, drive.centripetal), drive.lateral_acceleration, drive.step_s)
    if lags_s is None:
        return CannotTell(subject, _lacks(drive, ("lateral_acceleration", "yaw_rate", "vehicle_speed"), _BENDS))
    return _beyond(subject, lags_s, _YAW_TO_ACCELERATION_S, "lag_lateral_acceleration")


def _beyond(subject: str, lags_s: tuple[float, float], limits: tuple[float, float], code: str) -> Verdict:
    """A finding when both halves of the drive lie beyond the limits on the same side."""
    low, high = limits
    if max(lags_s) >= low and min(lags_s) <= high:
        return None
    lag_ms = 1e3 * sum(lags_s) / 2
    text = (
        f"the {subject} is {lag_ms:.0f} ms, plausible is {1e3 * low:.0f} to {1e3 * high:.0f}: "
        "look at the time stamps, or at a filter in a sensor"
    )
    return Finding(code, "warning", text, lag_ms, "ms")


def _driven(drive: _Drive, values: Column) -> Column:
    return np.where(drive.speed > _DRIVING_M_S, values, np.nan)


def _lags_s(early: Column, late: Column, step_s: float) -> tuple[float, float] | None:
    """`_lag_s` in each half of the drive; None unless both tell."""
    middle = len(early) // 2
    first = _lag_s(early[:middle], late[:middle], step_s)
    second = _lag_s(early[middle:], late[middle:], step_s)
    return None if first is None or second is None else (first, second)


def _lag_s(early: Column, late: Column, step_s: float) -> float | None:
    """How much `late` comes after `early`: where their changes are most alike, or None when they never are."""
    x, y = _increments(early), _increments(late)
    if np.isfinite(x * y).sum() * step_s < _MIN_TIME_S / 2:
        return None
    furthest = round(_LAG_SEARCHED_S / step_s)
    y = np.pad(y, furthest, constant_values=np.nan)
    likeness = [_likeness(x, y[shift : shift + len(x)]) for shift in range(2 * furthest + 1)]
    best = int(np.argmax(likeness))
    if likeness[best] < _LAG_CORRELATION or best in (0, 2 * furthest):
        return None
    before, peak, after = likeness[best - 1 : best + 2]
    between = 0.5 * (before - after) / (before - 2 * peak + after)  # summit of the parabola
    return (best - furthest + between) * step_s


def _likeness(x: Column, y: Column) -> float:
    """0 to 1, whatever their signs; over what both have."""
    both = np.isfinite(x) & np.isfinite(y)
    x, y = x[both], y[both]
    energy = float(np.sqrt(np.dot(x, x) * np.dot(y, y)))
    return abs(float(np.dot(x, y))) / energy if energy > 0 else 0.0


def _increments(values: Column) -> Column:
    """Changes over 0.5 s of means over 0.2 s: level and drift are gone, noise is still low."""
    if len(values) < 4 + 10:
        return np.empty(0)
    smooth = np.convolve(values, np.full(4, 0.25), mode="valid")
    return np.asarray(smooth[10:] - smooth[:-10])


_RATIO_SPEED_M_S = 3.0
_RATIO_CURVATURE_1_M = 1 / 15  # beyond it tan and a variable ratio bend the line
_RATIO_ACCELERATION_M_S2 = 3.0  # beyond it tyres do
_RATIO_BEND_1_M = 1 / 200  # tighter ones turn the wheel by several times any play
_RATIO_BEND_TIME_S = 10.0
_RATIO_SPEEDS = 1.2  # between slow and fast bends; at one speed understeer and ratio are the same
_RATIO_OFF = 0.10
_RATIO_HALF_WIDTH = 0.15  # a wider interval judges nothing
_PLAY_ACCELERATION_M_S2 = 0.2  # side force beyond which the wheels lie on one flank of the play
_PARTS = 12  # of the drive, for the jackknife
_STUDENT_T = 2.20  # 97.5 %, _PARTS - 1 degrees of freedom


def _ratio(drive: _Drive) -> Verdict:
    subject = "ratio times wheelbase"
    if drive.unlike:
        return CannotTell(subject, "signs and scales first")
    shown = _ratio_times_wheelbase_shown(drive)
    if shown is None:
        bends = f"needs {_RATIO_BEND_TIME_S:.0f} s in bends of less than {1 / _RATIO_BEND_1_M:.0f} m, at several speeds"
        return CannotTell(subject, _lacks(drive, NEEDED, bends))
    value, half_width = shown
    low, high = value - half_width, value + half_width
    told = f"ratio times wheelbase is {value:.1f} m in this drive ({low:.1f} to {high:.1f})"
    expected = _ratio_times_wheelbase(drive.vehicle)
    if expected is None or drive.vehicle is None:
        return Finding("ratio_times_wheelbase", "info", told, value, "m")
    if abs(value / expected - 1) <= _RATIO_OFF or low <= expected <= high:
        return None
    text = (
        f"{told}, the vehicle file says {expected:.1f}: if its wheelbase is right, the ratio is "
        f"{value / drive.vehicle.wheelbase_m:.1f}"
    )
    return Finding("ratio_times_wheelbase", "warning", text, value, "m")


def _ratio_times_wheelbase(vehicle: Vehicle | None) -> float | None:
    return None if vehicle is None else vehicle.ratio_near_centre * vehicle.wheelbase_m


def _ratio_times_wheelbase_shown(drive: _Drive) -> tuple[float, float] | None:
    """i*L in m and its 95 % half-width: (10) with offset, understeer, gyro bias and play as further unknowns.

    The interval is a jackknife over parts of the drive, since residuals are alike for seconds.
    """
    lag_s = _lag_s(_driven(drive, drive.angle), drive.curvature, drive.step_s)
    angle = _later(drive.angle, lag_s or 0.0, drive.step_s)
    k, rv, v = drive.curvature, drive.centripetal, drive.speed
    used = (v > _RATIO_SPEED_M_S) & (np.abs(k) < _RATIO_CURVATURE_1_M) & (np.abs(rv) < _RATIO_ACCELERATION_M_S2)
    used &= np.isfinite(angle)
    bends = used & (np.abs(k) > _RATIO_BEND_1_M)
    if used.sum() * drive.step_s < _MIN_TIME_S or bends.sum() * drive.step_s < _RATIO_BEND_TIME_S:
        return None
    slow, fast = np.quantile(v[bends], [0.1, 0.9])
    if fast < _RATIO_SPEEDS * slow:
        return None
    angle, k, rv, v = angle[used], k[used], rv[used], v[used]
    flank = np.clip(rv / _PLAY_ACCELERATION_M_S2, -1, 1)
    unknowns = np.column_stack([k, np.ones_like(k), rv, 1 / v, flank])
    value, half_width = _first_with_interval(unknowns, angle)
    return (value, half_width) if half_width < _RATIO_HALF_WIDTH * abs(value) else None


def _later(values: Column, by_s: float, step_s: float) -> Column:
    time = np.arange(len(values)) * step_s
    return np.asarray(np.interp(time - by_s, time, values, left=np.nan, right=np.nan))


def _first_with_interval(unknowns: Column, y: Column) -> tuple[float, float]:
    """Least squares' first coefficient and its 95 % half-width from leaving out one part of the drive at a time."""
    parts = zip(np.array_split(unknowns, _PARTS), np.array_split(y, _PARTS), strict=True)
    normal = [(a.T @ a, a.T @ b) for a, b in parts]
    all_a = np.sum([a for a, _ in normal], axis=0)
    all_b = np.sum([b for _, b in normal], axis=0)

    def first(a: Column, b: Column) -> float:
        return float(np.linalg.lstsq(a, b, rcond=None)[0][0])

    without = np.array([first(all_a - a, all_b - b) for a, b in normal])
    variance = (_PARTS - 1) / _PARTS * float(np.sum((without - without.mean()) ** 2))
    return first(all_a, all_b), _STUDENT_T * variance**0.5


_YAW_RATE_ZERO_RAD_S = 0.05 * DEGREE
_VDC2_ZERO_RAD_S = (32127 - 32112.64) / 8192  # SPN 1808: what a sender reads that takes raw 32127 for zero
_VDC2_ZERO_WITHIN_RAD_S = 0.015 * DEGREE  # two bits of 1/8192 rad/s
_STANDING_ACCELERATION_M_S2 = 0.25  # a 2.5 % slope of the ground


def _yaw_rate_zero(drive: _Drive) -> Verdict:
    seen = _at_standstill(drive, "yaw_rate")
    if seen is None:
        return CannotTell("zero of the yaw rate", _lacks_standing(drive, "yaw_rate"))
    bias, time_s = seen
    if abs(bias) < _YAW_RATE_ZERO_RAD_S:
        return None
    text = f"the yaw rate reads {bias / DEGREE:+.2f} deg/s at standstill (seen for {time_s:.1f} s)"
    source = drive.signals.sources.get("yaw_rate")
    if source and "VDC2" in source.description and abs(bias - _VDC2_ZERO_RAD_S) < _VDC2_ZERO_WITHIN_RAD_S:
        text += "; a sender that takes raw 32127 for zero in VDC2, where 32112.64 is, reads +0.10 deg/s"
    return Finding("yaw_rate_bias", "warning", text, bias / DEGREE, "deg/s")


def _standing(drive: _Drive) -> Verdict:
    seen = _at_standstill(drive, "lateral_acceleration")
    if seen is None:
        return CannotTell("zero of the lateral acceleration", _lacks_standing(drive, "lateral_acceleration"))
    reading, time_s = seen
    if abs(reading) < _STANDING_ACCELERATION_M_S2:
        return None
    text = (
        f"the accelerometer reads {reading:+.2f} m/s^2 at standstill (seen for {time_s:.1f} s): "
        "its bias, or the slope of the ground"
    )
    return Finding("lateral_acceleration_at_standstill", "warning", text, reading, "m/s^2")


def _at_standstill(drive: _Drive, name: str) -> tuple[float, float] | None:
    """Mean reading and the time behind it in s."""
    values = drive.ticks(name)[drive.standing]
    values = values[np.isfinite(values)]
    time_s = len(values) / drive.signals.rate_hz
    return (float(values.mean()), time_s) if time_s >= drive.params["standstill_time_min_s"] else None


def _bank(drive: _Drive) -> Verdict:
    """(33) averaged over all fast driving: banked bends come and go, a crown is some 0.2 m/s^2, the rest is bias."""
    bank = (drive.lateral_acceleration - drive.centripetal)[drive.speed > drive.params["speed_min_m_s"]]
    bank = bank[np.isfinite(bank)]
    subject = "mean of a_y - r*v"
    if len(bank) * drive.step_s < _MIN_TIME_S:
        fast = f"needs {_MIN_TIME_S:.0f} s above {drive.params['speed_min_m_s']:g} m/s"
        return CannotTell(subject, _lacks(drive, ("lateral_acceleration", "yaw_rate", "vehicle_speed"), fast))
    limit = drive.params["bank_max_m_s2"]
    mean = float(bank.mean())
    if drive.unlike or abs(mean) <= limit:
        return None
    text = (
        f"a_y - r*v averages {mean:+.2f} m/s^2 at speed, beyond the bank limit of {limit:g} m/s^2 (bank_max_m_s2): "
        "an accelerometer bias, with which little or nothing passes the gate"
    )
    return Finding("bank", "warning", text, mean, "m/s^2")


def _relative_sensor(drive: _Drive) -> Verdict:
    if not np.any(drive.ticks("steering_wheel_angle_sensor_type") == 0):
        return None
    text = (
        "the angle sensor is a relative one (SPN 1812 = 0): its angle may be off by whole turns after each ignition, "
        "so the offset is told modulo 360 deg"
    )
    return Finding("relative_angle_sensor", "info", text)


_NEARLY_STRAIGHT_1_M = 1 / 500


def _whole_turns(drive: _Drive) -> Verdict:
    straight = drive.angle[(drive.speed > _DRIVING_M_S) & (np.abs(drive.curvature) < _NEARLY_STRAIGHT_1_M)]
    straight = straight[np.isfinite(straight)]
    if len(straight) * drive.step_s < 2.0:
        return CannotTell("whole turns of the angle", _lacks(drive, NEEDED, "needs 2 s of nearly straight driving"))
    middle_deg = float(np.median(straight)) / DEGREE
    if drive.unlike or abs(middle_deg) < 180:
        return None
    text = f"the steering wheel angle reads {middle_deg:+.0f} deg when driving straight: off by a whole turn"
    return Finding("whole_turns", "warning", text, middle_deg, "deg")


_BENDS = f"needs {_MIN_TIME_S:.0f} s with bends to both sides"


def _lacks(drive: _Drive, names: tuple[str, ...], rolling: str) -> str:
    """Why a check that takes these signals of a rolling vehicle is not judged, the plainest reason first."""
    missing = [_words(name) for name in names if not drive.has(name)]
    if missing:
        return f"no {', no '.join(missing)}"
    if not np.any(drive.speed > _ROLLING_M_S):
        return "the vehicle does not move"
    return rolling


def _lacks_standing(drive: _Drive, name: str) -> str:
    if not drive.has(name):
        return f"no {_words(name)}"
    return f"needs {drive.params['standstill_time_min_s']:g} s of standing still"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _and(names: list[str]) -> str:
    return " and the ".join(names)
