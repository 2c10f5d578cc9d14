"""Steering ratio times wheelbase as the drive shows it, against what the vehicle file says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.findings import Finding
from oncenter.plausibility.correlation import agreement, lag_s
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
_SLOW_M_S = 12.0  # slower bends are hardly banked
_QUARTERS = 4
_ZERO_MOVES_M_S2 = 0.45  # between quarters of the drive: more is neither crown nor hard driving
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
    if len(k) < 2:
        return None
    yaw_acceleration = np.gradient(drive.yaw_rate, drive.step_s)
    used = (v > _SPEED_MIN_M_S) & (np.abs(k) < _CURVATURE_MAX_1_M) & (np.abs(rv) < _ACCELERATION_MAX_M_S2)
    used &= np.isfinite(angle) & np.isfinite(yaw_acceleration)
    bank = _bank(drive, used)
    if bank is None:  # as fast as bends are hardly banked
        bank = np.zeros_like(rv)
        used &= v < _SLOW_M_S
    used &= np.isfinite(bank)
    bends = used & (np.abs(k) > _BEND_1_M)
    if used.sum() * drive.step_s < MIN_TIME_S or bends.sum() * drive.step_s < _BEND_TIME_MIN_S:
        return None
    slow, fast = np.quantile(v[bends], [0.1, 0.9])
    if fast < _SPEEDS_APART * slow:
        return None
    angle, k, v, bank, side_force = (column[used] for column in (angle, k, v, bank, rv + bank))
    others = np.column_stack([k, np.ones_like(k), side_force, 1 / v, yaw_acceleration[used]])
    unloads = _line_over(v, bank)[0] + _UNLOADS_M_S2
    flanks = (np.tanh((side_force - each) / _FLANK_M_S2) for each in unloads)
    parts = [_parts(np.column_stack([others, flank]), angle) for flank in flanks]
    value, half_width = _first_with_interval(parts)
    return (value, half_width) if half_width < _HALF_WIDTH_MAX * abs(value) else None


def _bank(drive: Drive, used: npt.NDArray[np.bool_]) -> Column | None:
    """a_y - r*v; None where no accelerometer that works says it: one that follows r*v, and whose zero stays."""
    bank = _smoothed(drive.lateral_acceleration - drive.centripetal, drive.step_s)
    known = used & np.isfinite(bank)
    if known.sum() * drive.step_s < MIN_TIME_S:
        return None
    _, of_speed = _line_over(drive.speed[known], bank[known])
    if agreement(drive.lateral_acceleration, drive.centripetal + of_speed * drive.speed) != 1:
        return None
    level = bank[known] - of_speed * drive.speed[known]
    means = [float(part.mean()) for part in np.array_split(level, _QUARTERS)]
    return bank if max(means) - min(means) < _ZERO_MOVES_M_S2 else None


def _line_over(v: Column, bank: Column) -> tuple[float, float]:
    """What of the bank is the same at any speed, and what goes with it, as a gyro's bias makes it go."""
    at_rest, of_speed = np.linalg.lstsq(np.column_stack([np.ones_like(v), v]), bank, rcond=None)[0]
    return float(at_rest), float(of_speed)


def _smoothed(values: Column, step_s: float) -> Column:
    """Means of what is known; NaN where nothing is."""
    steps = np.ones(max(1, min(round(_SIDE_FORCE_S / step_s), len(values))))
    known = np.isfinite(values)
    counts = np.convolve(known, steps, mode="same")
    sums = np.convolve(np.where(known, values, 0.0), steps, mode="same")
    return np.asarray(np.divide(sums, counts, out=np.full(len(values), np.nan), where=counts > 0.5))


def _later(values: Column, by_s: float, step_s: float) -> Column:
    time = np.arange(len(values)) * step_s
    return np.asarray(np.interp(time - by_s, time, values, left=np.nan, right=np.nan))


@dataclass(frozen=True)
class _Normal:
    """Normal equations of parts of the drive."""

    squares: npt.NDArray[np.float64]  # (parts, unknowns, unknowns)
    toward: npt.NDArray[np.float64]  # (parts, unknowns)
    target_squares: npt.NDArray[np.float64]  # (parts,)


def _parts(unknowns: Column, y: Column) -> _Normal:
    parts = list(zip(np.array_split(unknowns, _PARTS), np.array_split(y, _PARTS), strict=True))
    return _Normal(
        np.array([a.T @ a for a, _ in parts]),
        np.array([a.T @ b for a, b in parts]),
        np.array([b @ b for _, b in parts]),
    )


def _first_with_interval(guesses: Sequence[_Normal]) -> tuple[float, float]:
    """Least squares' first coefficient by the guess that leaves least, and its 95 % half-width from leaving out one
    part of the drive at a time, with the guess that is best without it."""

    def first(without: int | None) -> float:
        kept = [part for part in range(_PARTS) if part != without]
        fits = []
        for guess in guesses:
            toward = guess.toward[kept].sum(axis=0)
            found = np.linalg.lstsq(guess.squares[kept].sum(axis=0), toward, rcond=None)[0]
            fits.append((float(guess.target_squares[kept].sum() - toward @ found), float(found[0])))
        return min(fits)[1]

    without = np.array([first(part) for part in range(_PARTS)])
    variance = (_PARTS - 1) / _PARTS * float(np.sum((without - without.mean()) ** 2))
    return first(None), _STUDENT_T * variance**0.5
