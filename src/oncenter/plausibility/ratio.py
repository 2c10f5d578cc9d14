"""Steering ratio times wheelbase as the drive shows it, against what the vehicle file says."""

from __future__ import annotations

import numpy as np

from oncenter.findings import Finding
from oncenter.plausibility.correlation import lag_s
from oncenter.plausibility.drive import MIN_TIME_S, NEEDED, Column, Drive
from oncenter.plausibility.verdict import CannotTell, Verdict, lacks

_SPEED_MIN_M_S = 3.0
_CURVATURE_MAX_1_M = 1 / 15  # beyond it tan and a variable ratio bend the line
_ACCELERATION_MAX_M_S2 = 3.0  # beyond it tyres do
_BEND_1_M = 1 / 200  # tighter ones turn the wheel by several times any play
_BEND_TIME_MIN_S = 10.0
_SPEEDS_APART = 1.2  # between slow and fast bends; at one speed understeer and ratio are the same
_OFF = 0.10
_HALF_WIDTH_MAX = 0.15  # of the value; a wider interval judges nothing
_SIDE_FORCE_S = 1.0  # over which the bank is a mean: the accelerometer's noise is shorter
_UNLOADS_M_S2 = np.linspace(-0.6, 0.6, 25)  # from the mean bank, where the steering may change its flank
_FLANK_M_S2 = 0.05  # of side force, beyond which the wheels lie on one flank of the play
_PARTS = 12  # of the drive, for the jackknife
_STUDENT_T = 2.20  # 97.5 %, _PARTS - 1 degrees of freedom


def ratio_times_wheelbase(drive: Drive, comparable: bool) -> Verdict:
    """Told without a vehicle file, judged with one; `comparable`: signs and scales let r/v be compared at all."""
    subject = "ratio times wheelbase"
    if not comparable:
        return CannotTell(subject, "signs and scales first")
    shown = _shown(drive)
    if shown is None:
        bends = f"needs {_BEND_TIME_MIN_S:.0f} s in bends of less than {1 / _BEND_1_M:.0f} m, at several speeds"
        return CannotTell(subject, lacks(drive, NEEDED, bends))
    value, half_width = shown
    low, high = value - half_width, value + half_width
    told = f"ratio times wheelbase is {value:.1f} m in this drive ({low:.1f} to {high:.1f})"
    expected = drive.ratio_times_wheelbase_m()
    if expected is None or drive.vehicle is None:
        return Finding("ratio_times_wheelbase", "info", told, value, "m")
    if abs(value / expected - 1) <= _OFF or low <= expected <= high:
        return None
    text = (
        f"{told}, the vehicle file says {expected:.1f}: if its wheelbase is right and no axle was lifted, the ratio is "
        f"{value / drive.vehicle.wheelbase_m:.1f}"
    )
    return Finding("ratio_times_wheelbase", "warning", text, value, "m")


def _shown(drive: Drive) -> tuple[float, float] | None:
    """i*L in m and its 95 % half-width: (10) with offset, understeer, gyro bias, lag and play as further unknowns.

    The wheels lie on the flank that side force says, less where the steering unloads, which is sought: the zero of the
    accelerometer is in it. The interval is a jackknife over parts of the drive, since residuals are alike for seconds.
    """
    late_s = lag_s(drive.driven(drive.angle), drive.curvature, drive.step_s)
    angle = _later(drive.angle, late_s or 0.0, drive.step_s)
    k, rv, v = drive.curvature, drive.centripetal, drive.speed
    bank = _smoothed(drive.lateral_acceleration - rv, drive.step_s) if drive.has("lateral_acceleration") else 0.0 * rv
    used = (v > _SPEED_MIN_M_S) & (np.abs(k) < _CURVATURE_MAX_1_M) & (np.abs(rv) < _ACCELERATION_MAX_M_S2)
    used &= np.isfinite(angle) & np.isfinite(bank)
    bends = used & (np.abs(k) > _BEND_1_M)
    if used.sum() * drive.step_s < MIN_TIME_S or bends.sum() * drive.step_s < _BEND_TIME_MIN_S:
        return None
    slow, fast = np.quantile(v[bends], [0.1, 0.9])
    if fast < _SPEEDS_APART * slow:
        return None
    yaw_acceleration = np.gradient(drive.yaw_rate, drive.step_s)
    used &= np.isfinite(yaw_acceleration)
    angle, k, v, side_force = (column[used] for column in (angle, k, v, rv + bank))
    others = np.column_stack([k, np.ones_like(k), side_force, 1 / v, yaw_acceleration[used]])

    def on_flanks(unloads: float) -> Column:
        return np.column_stack([others, np.tanh((side_force - unloads) / _FLANK_M_S2)])

    with_speed = np.column_stack([np.ones_like(v), v])  # as a gyro's bias makes it go
    unloads = float(np.linalg.lstsq(with_speed, bank[used], rcond=None)[0][0]) + _UNLOADS_M_S2
    left = [_left_over(on_flanks(each), angle) for each in unloads]
    value, half_width = _first_with_interval(on_flanks(unloads[np.argmin(left)]), angle)
    return (value, half_width) if half_width < _HALF_WIDTH_MAX * abs(value) else None


def _smoothed(values: Column, step_s: float) -> Column:
    steps = max(1, round(_SIDE_FORCE_S / step_s))
    return np.convolve(values, np.full(steps, 1.0 / steps), mode="same") if len(values) >= steps else values


def _later(values: Column, by_s: float, step_s: float) -> Column:
    time = np.arange(len(values)) * step_s
    return np.asarray(np.interp(time - by_s, time, values, left=np.nan, right=np.nan))


def _left_over(unknowns: Column, y: Column) -> float:
    """The squares that least squares leaves."""
    normal, toward = unknowns.T @ unknowns, unknowns.T @ y
    return float(y @ y - toward @ np.linalg.lstsq(normal, toward, rcond=None)[0])


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
