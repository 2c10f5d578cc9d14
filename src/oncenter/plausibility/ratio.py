"""Steering ratio times wheelbase of the drive, against that of the vehicle file."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.findings import Kind, finding
from oncenter.plausibility.check_result import CannotTell, CheckResult, lacks
from oncenter.plausibility.correlation import agreement, lag_s
from oncenter.plausibility.grid_signals import MIN_TIME_S, NEEDED, Column, GridSignals
from oncenter.plausibility.jackknife import first_with_interval, normal_equations

_SPEED_MIN_M_S = 3.0
_CURVATURE_MAX_1_M = 1 / 15  # beyond it tan and a variable ratio are not linear
_ACCELERATION_MAX_M_S2 = 3.0  # beyond it tyres are not linear
_BEND_1_M = 1 / 200  # tighter ones need several times the angle of any play
_BEND_TIME_MIN_S = 10.0
_SPEEDS_APART = 1.2  # between slow and fast bends; at one speed understeer and ratio are the same
_OFF = 0.10
FAR_OFF = 0.2  # share of the file's product; a lifted tag axle makes 15 %
_EXAMPLE_WHEELBASE_M = 4.0
_HALF_WIDTH_MAX = 0.15  # of the value; a wider interval is not judged
_BANK_MEAN_S = 1.0  # of the bank, longer than the accelerometer's noise
_NEUTRAL_M_S2 = np.linspace(-0.6, 0.6, 25)  # lateral acceleration from the mean bank at which the flank may change
_SLOW_M_S = 12.0  # slower bends are hardly banked
_QUARTERS = 4
_ZERO_MOVES_M_S2 = 0.45  # between quarters of the drive: more than crown or hard driving explain
_FLANK_M_S2 = 0.05  # of lateral acceleration, beyond which one flank of the play is loaded


@finding("ratio_times_wheelbase", "warning", "m")
def ratio_times_wheelbase(found: Kind, drive: GridSignals, comparable: bool) -> CheckResult:
    """Reported without a vehicle file, judged with one; `comparable`: signs and scales have no error."""
    subject = "ratio times wheelbase"
    if not comparable:
        return CannotTell(subject, "signs or scales have an error")
    bank = _bank(drive)
    shown = _shown(drive, bank)
    if shown is None:
        bends = f"needs {_BEND_TIME_MIN_S:.0f} s in bends of less than {1 / _BEND_1_M:.0f} m, at several speeds"
        slowly = "" if bank is not None else f" below {_SLOW_M_S:.0f} m/s, since no accelerometer measures the bank"
        return CannotTell(subject, lacks(drive, NEEDED, bends + slowly))
    value, half_width = shown
    low, high = value - half_width, value + half_width
    expected = drive.ratio_times_wheelbase_m()
    if expected is None or drive.vehicle is None:
        return found(
            f"steering ratio times wheelbase is {value:.1f} m in this drive ({low:.1f} to {high:.1f} m): with a "
            f"wheelbase of {_EXAMPLE_WHEELBASE_M:g} m, the steering ratio is {value / _EXAMPLE_WHEELBASE_M:.1f}. The "
            "offset is not affected",
            value,
            severity="info",
        )
    if abs(value / expected - 1) <= _OFF or low <= expected <= high:
        return None
    return found(
        fit_words(value / expected - 1.0, drive.vehicle.wheelbase_m, drive.vehicle.ratio_near_centre),
        value,
        signals=("steering_wheel_angle",),
    )


def rough_m(drive: GridSignals) -> float | None:
    """i*L in m without an interval, in any bends: (10) with offset, understeer and gyro bias as further unknowns. Play,
    lag and yaw rate noise cause errors of some tenths of it."""
    k, v = drive.curvature, drive.speed
    used = _usable(drive) & np.isfinite(drive.angle * k)
    if agreement(drive.angle, k) != 1 or used.sum() * drive.step_s < MIN_TIME_S:
        return None
    unknowns = np.column_stack([k[used], np.ones(used.sum()), drive.centripetal[used], 1 / v[used]])
    found = float(np.linalg.lstsq(unknowns, drive.angle[used], rcond=None)[0][0])
    return found if found > 0.0 else None


def _shown(drive: GridSignals, bank: Column | None) -> tuple[float, float] | None:
    """i*L in m and its 95 % half-width: (10) with offset, understeer, gyro bias, lag and play as further unknowns.

    The sign of the lateral force gives the loaded flank of the play. The neutral lateral acceleration, which contains
    the accelerometer's zero, is a further unknown.
    """
    late_s = lag_s(drive.driven(drive.angle), drive.curvature, drive.step_s)
    angle = _later(drive.angle, late_s or 0.0, drive.step_s)
    yaw_acceleration = _rate_of(drive.yaw_rate, drive.step_s)
    k, v = drive.curvature, drive.speed
    used = _usable(drive) & np.isfinite(angle) & np.isfinite(yaw_acceleration)
    used &= v < _SLOW_M_S if bank is None else np.isfinite(bank)
    bends = used & (np.abs(k) > _BEND_1_M)
    if used.sum() * drive.step_s < MIN_TIME_S or bends.sum() * drive.step_s < _BEND_TIME_MIN_S:
        return None
    slow, fast = np.quantile(v[bends], [0.1, 0.9])
    if fast < _SPEEDS_APART * slow:
        return None
    at_rest, lateral = 0.0, drive.centripetal[used]
    if bank is not None:
        at_rest, lateral = _line_over(v[used], bank[used])[0], lateral + bank[used]
    others = np.column_stack([k[used], np.ones_like(lateral), lateral, 1 / v[used], yaw_acceleration[used]])
    flanks = (np.tanh((lateral - at_rest - neutral) / _FLANK_M_S2) for neutral in _NEUTRAL_M_S2)
    guesses = [normal_equations(np.column_stack([others, flank]), angle[used]) for flank in flanks]
    value, half_width = first_with_interval(guesses)
    return (value, half_width) if half_width < _HALF_WIDTH_MAX * abs(value) else None


def _usable(drive: GridSignals) -> npt.NDArray[np.bool_]:
    gentle = np.abs(drive.centripetal) < _ACCELERATION_MAX_M_S2
    return np.asarray((drive.speed > _SPEED_MIN_M_S) & (np.abs(drive.curvature) < _CURVATURE_MAX_1_M) & gentle)


def _rate_of(values: Column, step_s: float) -> Column:
    return np.gradient(values, step_s) if len(values) > 1 else np.full_like(values, np.nan)


def _bank(drive: GridSignals) -> Column | None:
    """a_y - r*v; None without an accelerometer that follows r*v with a constant zero."""
    bank = _smoothed(drive.lateral_acceleration - drive.centripetal, drive.step_s)
    used = _usable(drive) & np.isfinite(bank)
    if used.sum() * drive.step_s < MIN_TIME_S:
        return None
    _, of_speed = _line_over(drive.speed[used], bank[used])
    if agreement(drive.lateral_acceleration, drive.centripetal + of_speed * drive.speed) != 1:
        return None
    level = bank[used] - of_speed * drive.speed[used]
    means = [float(part.mean()) for part in np.array_split(level, _QUARTERS)]
    return bank if max(means) - min(means) < _ZERO_MOVES_M_S2 else None


def _line_over(v: Column, bank: Column) -> tuple[float, float]:
    """The constant part of the bank, and its slope over the speed, which a gyro bias causes."""
    at_rest, of_speed = np.linalg.lstsq(np.column_stack([np.ones_like(v), v]), bank, rcond=None)[0]
    return float(at_rest), float(of_speed)


def _smoothed(values: Column, step_s: float) -> Column:
    """Means of the available values; NaN where there is none."""
    steps = np.ones(max(1, min(round(_BANK_MEAN_S / step_s), len(values))))
    available = np.isfinite(values)
    counts = np.convolve(available, steps, mode="same")
    sums = np.convolve(np.where(available, values, 0.0), steps, mode="same")
    return np.asarray(np.divide(sums, counts, out=np.full(len(values), np.nan), where=counts > 0.5))


def _later(values: Column, by_s: float, step_s: float) -> Column:
    time = np.arange(len(values)) * step_s
    return np.asarray(np.interp(time - by_s, time, values, left=np.nan, right=np.nan))


def fit_words(share: float, wheelbase_m: float, steering_ratio: float) -> str:
    """The text about a product that exceeds the vehicle file's by a share, negative where it is smaller."""
    axle = "" if abs(share) > FAR_OFF else ". A lifted axle causes the same; then no action is necessary"
    return (
        f"bends need {abs(share) * 100:.0f} % {'more' if share > 0 else 'less'} steering wheel angle than calculated "
        "from the vehicle file. Either the wheelbase is wrong (the file has "
        f"{wheelbase_m:.2f} m, {wheelbase_m * (1.0 + share):.2f} m fits), or the steering ratio (the file has "
        f"{steering_ratio:.1f}, {steering_ratio * (1.0 + share):.1f} fits). The offset is not affected: it uses the "
        f"fitted value. Correct the vehicle file{axle}"
    )
