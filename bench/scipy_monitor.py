"""The core's steps in scipy and numpy, a whole drive at a time, as an engineer writes them in a notebook.

Vectorised throughout; the only loops are over the stretches between holes. It gives the end of the drive only: the
offset as of each tick would need the evidence in the order in which it came.
"""

from __future__ import annotations

from typing import Any

import numba_monitor
import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

Column = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.int64]


def lowpass(c: Any, x: Column) -> Column:
    s2 = (c.b0 - c.a2) * x[0]
    s1 = (2.0 * c.b0 - c.a1) * x[0] + s2
    return lfilter([c.b0, 2.0 * c.b0, c.b0], [1.0, c.a1, c.a2], x, zi=[s1, s2])[0]


def delayed(c: Any, angle: Column) -> Column:
    before = np.concatenate([np.full(c.delay_ticks + 1, angle[0]), angle])
    later, earlier = before[1:][: len(angle)], before[: len(angle)]
    return later + c.delay_fraction * (earlier - later)


def slope(c: Any, speed: Column) -> Column:
    """dv/dt, held between down-sampled speeds; before the first, the speed has always been the first."""
    kept = np.concatenate([np.full(10, speed[0]), speed[:: c.slope_every]])
    slopes = np.convolve(kept, np.arange(5, -6, -1), "valid") * c.slope_scale
    return np.repeat(slopes, c.slope_every)[: len(speed)]


def runs(clean: Mask, breaks: Mask) -> tuple[Rows, Rows]:
    """First rows and lengths of the stretches that are clean; `breaks` is true where one may not go on."""
    starts = np.flatnonzero(clean & (breaks | ~np.concatenate([[False], clean[:-1]])))
    ends = np.flatnonzero(clean & np.concatenate([breaks[1:] | ~clean[1:], [True]])) + 1
    return starts, ends - starts


def final_blocks(c: Any, clean: Mask, breaks: Mask) -> tuple[Rows, Rows]:
    """Rows of all final blocks, shape (blocks, ticks per block), and the rows at which they became final."""
    starts, lengths = runs(clean, breaks)
    blocks = np.maximum(lengths // c.ticks_per_block - c.blocks_until_final, 0)
    number = np.arange(blocks.sum()) - np.repeat(np.cumsum(blocks) - blocks, blocks)
    first = np.repeat(starts, blocks) + number * c.ticks_per_block
    became_final = first + (c.blocks_until_final + 1) * c.ticks_per_block - 1
    return first[:, None] + np.arange(c.ticks_per_block), became_final


def in_batches(c: Any, blocks: Column) -> Column:
    per_batch = int(np.ceil(c.ticks_per_batch / c.ticks_per_block))
    whole = len(blocks) // per_batch
    return blocks[: whole * per_batch].reshape(whole, per_batch)


def moments(weight: float, y: Column, x: Column, w: Column) -> Column:
    mean_y, mean_x = y.mean(), x.mean()
    dy, dx = y - mean_y, x - mean_x
    return np.array([weight, mean_y, mean_x, w.mean(), (dy * dy).sum(), (dx * dy).sum(), (dx * dx).sum()])


def few_batches_factor(batches: Column) -> Column:
    f = 1.0 / np.maximum(batches - 1.0, 1.0)
    series = 1.0 + f * (2.3723 + f * (2.8225 + f * (2.5559 + f * 1.5896))) / 1.96
    return np.where(batches - 1.0 > 1.5, series, 12.706 / 1.96)


def trusted_from(c: Any, y: Column, became_final: Rows) -> int:
    """The row at which the offset became accurate enough for K_us; after the last row if never."""
    batches = in_batches(c, y)
    n = np.arange(1.0, len(batches) + 1.0)
    deviation = batches.mean(axis=1) - y[:1].sum()
    squares = np.cumsum(deviation**2) - np.cumsum(deviation) ** 2 / n
    variance = few_batches_factor(n) ** 2 * np.maximum(squares, 0.0) / np.maximum(n - 1.0, 1.0) / n
    known = np.concatenate([[10.0, 10.0], variance[1:]])  # by number of complete batches, from zero
    blocks = np.arange(1, len(y) + 1)
    accurate = 1.96 * np.sqrt(known[blocks // batches.shape[1]]) <= c.offset_half_width_max_rad
    good = np.flatnonzero(accurate & (blocks * c.ticks_per_block * c.tick_s >= c.offset_evidence_min_s))
    return int(became_final[good[0]]) if len(good) else np.iinfo(np.int64).max


def run(c: Any, time: Column, angle: Column, yaw_rate: Column, speed: Column, acceleration: Column) -> Any:
    """Figure 15 over the whole drive.

    Returns:
        offset, its standard deviation, K_us/g, ticks by reason, standstill yaw rate bias, ticks.
    """
    nm = numba_monitor
    # input checks
    forward = np.concatenate([[True], time[1:] > np.maximum.accumulate(time)[:-1]])
    present = (np.abs(angle) < 100) & (np.abs(yaw_rate) < 10) & (np.abs(speed) < 150) & (np.abs(acceleration) < 100)
    row = np.flatnonzero(forward & present)
    tick = np.cumsum(forward)[row]
    breaks = np.concatenate([[True], np.diff(tick) > 1])
    t, d_m, r_m, v_m, a_m = (column[row] for column in (time, angle, yaw_rate, speed, acceleration))

    hole = np.diff(t) - 0.5 * c.tick_s
    restarts = np.flatnonzero((hole > c.gap_max_s) & (hole > c.tick_s)) + 1

    # standstill
    still = np.abs(v_m) <= c.standstill_speed_max_m_s
    anew = breaks.copy()  # a standstill restarts after a gap or a missing tick
    anew[restarts] = True
    _, lengths = runs(still, anew)
    in_run = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    at_rest = r_m[still][in_run >= c.standstill_settling_ticks]
    still_mean = float(at_rest.mean()) if len(at_rest) else 0.0

    stands = np.zeros(len(t), bool)
    stands[np.flatnonzero(still)[in_run >= c.standstill_settling_ticks - 1]] = True

    # filters, between gaps and standstills
    edges = np.flatnonzero(np.diff(stands.astype(np.int8))) + 1
    begins = np.unique(np.concatenate([[0], restarts, edges]))
    ends = np.append(begins[1:], len(t))
    pieces = [slice(a, b) for a, b in zip(begins, ends, strict=True) if not stands[a]]
    r, v, a, delta_m, a_x = np.zeros((5, len(t)))
    for piece in pieces:
        r[piece], v[piece], a[piece] = (lowpass(c, x[piece]) for x in (r_m, v_m, a_m))
        delta_m[piece], a_x[piece] = delayed(c, d_m[piece]), slope(c, v[piece])

    # motion and gate
    slow = np.maximum(v, 1.0)
    curvature = r / slow
    bank = a - r * v
    y = delta_m - c.ratio_times_wheelbase * curvature
    x = c.steering_ratio * a
    w = c.ratio_times_wheelbase / slow
    reasons = np.where(v > c.speed_min_m_s, 0, nm.SPEED)
    reasons |= np.where(np.abs(curvature) < c.curvature_max_1_m, 0, nm.CURVATURE)
    reasons |= np.where(np.abs(a_x) < c.longitudinal_acceleration_max_m_s2, 0, nm.LONGITUDINAL)
    reasons |= np.where(np.abs(bank) < c.bank_max_m_s2, 0, nm.BANK)
    reasons[restarts] |= nm.GAP
    for piece in pieces:
        reasons[piece][: c.settling_ticks - 1] |= nm.SETTLING
    reasons[stands] = nm.SPEED

    # offset
    rows, became_final = final_blocks(c, reasons == 0, breaks)
    by, bx, bw = (column[rows].mean(axis=1) for column in (y, x, w))
    offset = moments(float(rows.size), by, bx, bw)
    batches = [in_batches(c, column).mean(axis=1) for column in (by, bx, bw)]
    offset_batches = moments(float(len(batches[0])), *batches)
    trusted_row = trusted_from(c, by, became_final)

    # understeer gradient
    in_range = (np.abs(a) > c.understeer_acceleration_min_m_s2) & (np.abs(a) < c.understeer_acceleration_max_m_s2)
    bend = (reasons & ~nm.CURVATURE == 0) & in_range
    bend[: min(trusted_row + 1, len(bend))] = False
    rows, _ = final_blocks(c, bend, breaks)
    sums = [values[rows].sum(axis=1) for values in (x, x * x, x * y)]
    bends = np.array([float(rows.size), *(s.sum() for s in sums)])
    sx, sxx, sxy = (in_batches(c, s).sum(axis=1) for s in sums)
    products = ((sxy, sxy), (sx, sx), (sxx, sxx), (sxy, sx), (sxy, sxx), (sx, sxx))
    bend_batches = np.array([float(len(sx)), sxx.sum(), *(p @ q for p, q in products)])

    # the final arithmetic, once per drive, is shared with the numba rival
    squares = float(((at_rest - still_mean) ** 2).sum())
    value, sd, K, _ = nm.learn(
        c, offset, offset_batches, bends, bend_batches, float(len(at_rest)), still_mean, squares, True, np.zeros(2, int)
    )
    rejected = np.array([np.count_nonzero(reasons & (1 << k)) for k in range(9)])
    ticks = int(forward.sum())
    rejected[0], rejected[1] = ticks - len(row), len(time) - ticks
    rejected[8] = np.count_nonzero(reasons == 0) - int(offset[0])
    return value, sd, K, rejected, still_mean, ticks
