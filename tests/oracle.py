"""The second implementation: the thesis in short, batch, literal NumPy, after docs/method.md.

It shares no code with core/ but the default params. It works on a whole drive at once: masks, runs of clean ticks and
plain sums take the place of the core's rings and running means, so that the two can agree only by both being right.
SI and rad.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import signal, stats

Array = npt.NDArray[np.float64]

MISSING_SIGNAL, TIME, GAP, SETTLING, SPEED, CURVATURE, LONGITUDINAL, BANK = (1 << k for k in range(8))
REASONS = (
    "missing_signal time gap settling speed curvature longitudinal_acceleration bank window"
).split()  # by bit
NORMAL_95 = 1.96


@dataclass(frozen=True)
class Motion:
    """(32), (33) and the regression quantities of every tick that had all its signals, in order."""

    time: Array
    speed: Array  # m/s, filtered
    curvature: Array  # 1/m
    longitudinal_acceleration: Array  # m/s^2
    bank: Array  # m/s^2
    y: Array  # rad, delta_m - i*L*r/v
    x: Array  # m/s^2, i*a_y
    w: Array  # s, i*L/v
    angle: Array  # rad, delayed
    yaw_rate: Array  # rad/s, filtered
    restarted: npt.NDArray[np.bool_]
    settling: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Queue:
    """What a queue of blocks made final: tick numbers in order, and after how many ticks each block ended."""

    final: npt.NDArray[np.int64]
    block_ends: npt.NDArray[np.int64]  # numbers of final ticks so far
    final_since: npt.NDArray[np.int64]  # the tick number that made the block final
    pending: npt.NDArray[np.int64]  # ticks that wait at the end of the drive


@dataclass(frozen=True)
class Answer:
    reasons: npt.NDArray[np.uint32]  # of each row, 0 clean
    motion: Motion
    straight: npt.NDArray[np.int64]  # numbers, among the ticks of motion, of those used for the offset
    bends: npt.NDArray[np.int64]  # for K_us
    offset: float  # rad
    offset_temporary: float
    offset_sd: float
    offset_variance_if_independent: float
    offset_status: str
    understeer: float  # rad/(m/s^2), zero until learned
    understeer_sd: float
    understeer_status: str
    offset_per_yaw_rate_bias: float
    yaw_rate_bias: tuple[float, float] | None  # value and standard deviation at standstill, rad/s
    standstill_acceleration: tuple[float, float] | None
    bank_mean: float
    bank_time: float
    duration: float
    used: float
    unused: float
    rejected: dict[str, float]  # s


def lowpass(cutoff_hz: float, rate_hz: float) -> tuple[Array, Array]:
    """5.1.1: maximally flat, second order, bilinear and prewarped."""
    b, a = signal.butter(2, cutoff_hz, fs=rate_hz)
    return np.asarray(b), np.asarray(a)


def mean_group_delay(cutoff_hz: float, band_hz: float, rate_hz: float) -> float:
    """s; the phase at the band's end over its width is the mean of the group delay over the band."""
    b, a = lowpass(cutoff_hz, rate_hz)
    _, response = signal.freqz(b, a, worN=[band_hz], fs=rate_hz)
    return float(-np.angle(response[0]) / (2 * np.pi * band_hz))


def filtered(values: Array, b: Array, a: Array) -> Array:
    """As if the first value had stood for ever."""
    out, _ = signal.lfilter(b, a, values, zi=signal.lfilter_zi(b, a) * values[0])
    return np.asarray(out)


def delayed(values: Array, ticks: float) -> Array:
    n = np.arange(len(values), dtype=float)
    return np.interp(n - ticks, n, values)  # before the first value it had stood for ever


def slope(speed: Array, every: int, rate_hz: float) -> Array:
    """dv/dt: the least-squares line through the last 11 speeds of every `every`-th tick, held in between."""
    kept = speed[::every]
    padded = np.concatenate([np.full(10, kept[0]), kept])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 11)
    seconds = np.arange(-5, 6) * every / rate_hz
    slopes = windows @ (seconds / np.sum(seconds**2))
    return np.repeat(slopes, every)[: len(speed)]


def motion_of(
    rows: Mapping[str, Array], wheelbase: float, ratio: float, params: Mapping[str, float], rate_hz: float
) -> Motion:
    """5.1.1 and 5.1.2 over ticks that have all their signals, segment by segment between holes."""
    time = rows["time"]
    step = np.diff(time, prepend=-np.inf)
    restarted = step > max(params["gap_max_s"], 1.5 / rate_hz)
    every = max(1, int(params["speed_slope_window_s"] / 10 * rate_hz + 0.5))
    b, a = lowpass(params["cutoff_hz"], rate_hz)
    delay = mean_group_delay(params["cutoff_hz"], params["delay_band_hz"], rate_hz) * rate_hz
    parts: dict[str, list[Array]] = {name: [] for name in ("angle", "r", "v", "a", "dv", "settling")}
    starts = np.flatnonzero(restarted)
    for start, stop in zip(starts, [*starts[1:], len(time)], strict=True):
        piece = slice(start, stop)
        v = filtered(rows["speed"][piece], b, a)
        parts["angle"].append(delayed(rows["angle"][piece], delay))
        parts["r"].append(filtered(rows["yaw_rate"][piece], b, a))
        parts["v"].append(v)
        parts["a"].append(filtered(rows["acceleration"][piece], b, a))
        parts["dv"].append(slope(v, every, rate_hz))
        parts["settling"].append(np.arange(stop - start) < 10 * every + int(delay))
    angle, r, v, a_y, dv, settling = (np.concatenate([np.empty(0), *parts[name]]) for name in parts)
    v_safe = np.maximum(v, 1.0)
    accelerometer = bool(params["use_accelerometer"])
    return Motion(
        time=time,
        speed=v,
        curvature=r / v_safe,
        longitudinal_acceleration=dv,
        bank=a_y - r * v if accelerometer else np.zeros_like(v),
        y=angle - ratio * wheelbase * r / v_safe,
        x=ratio * (a_y if accelerometer else r * v),
        w=ratio * wheelbase / v_safe,
        angle=angle,
        yaw_rate=r,
        restarted=restarted,
        settling=settling.astype(bool),
    )


def gate(motion: Motion, params: Mapping[str, float]) -> npt.NDArray[np.uint32]:
    """(34), (35) and condition 2 of 5.1, with what the filters say of themselves."""
    bits = np.zeros(len(motion.time), np.uint32)
    bits[motion.speed <= params["speed_min_m_s"]] |= SPEED
    bits[np.abs(motion.curvature) >= params["curvature_max_1_m"]] |= CURVATURE
    bits[np.abs(motion.longitudinal_acceleration) >= params["longitudinal_acceleration_max_m_s2"]] |= LONGITUDINAL
    bits[np.abs(motion.bank) >= params["bank_max_m_s2"]] |= BANK
    return bits


def queue(clean: npt.NDArray[np.bool_], ticks_per_block: int, blocks_until_final: int) -> Queue:
    """Blocks of clean runs that so many clean blocks follow."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], clean, [False]]).astype(int)))
    final, since = [np.empty(0, int)], [np.empty(0, int)]
    pending = np.empty(0, int)
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        blocks = max(0, (stop - start) // ticks_per_block - blocks_until_final)
        final.append(np.arange(start, start + blocks * ticks_per_block))
        since.append(start + (np.arange(blocks) + 1 + blocks_until_final) * ticks_per_block - 1)
        if stop == len(clean):
            pending = np.arange(start + blocks * ticks_per_block, stop)
    ends = (np.arange(sum(map(len, since))) + 1) * ticks_per_block
    return Queue(np.concatenate(final), ends, np.concatenate(since), pending)


def batch_edges(ticks: int, ticks_per_block: int, ticks_per_batch: float) -> npt.NDArray[np.int64]:
    """Where whole batches end: the first whole number of blocks that spans one."""
    size = ticks_per_block * max(1, int(np.ceil(ticks_per_batch / ticks_per_block)))
    return np.arange(0, ticks + 1, size)


def few_batches(n: int) -> float:
    return float(stats.t.ppf(0.975, n - 1)) / NORMAL_95


def scatter_variance(residual: Array, edges: npt.NDArray[np.int64]) -> float:
    """rad^2, of the mean, from batch means; 10 below two batches."""
    n = len(edges) - 1
    if n < 2:
        return 10.0
    means = np.add.reduceat(residual[: edges[-1]], edges[:-1]) / np.diff(edges)
    return float(np.var(means, ddof=1)) / n * few_batches(n) ** 2


def status_next(now: str, half_width: float, limit: float) -> str:
    return "valid" if half_width <= (limit * 4 / 3 if now == "valid" else limit) else "converging"


def recursive_mean(values: Array) -> float:
    """(36), tick by tick."""
    offset = 0.0
    for k, value in enumerate(values, start=1):
        offset += (value - offset) / k
    return offset


def understeer_literal(motion: Motion, ticks: npt.NDArray[np.int64], offset: float, ratio: float,
                       wheelbase: float, floor: float) -> float:
    """(38) as printed, K_us/g: the mean of its values where |r*v| is above the floor, rad/(m/s^2)."""
    r, v, delta = motion.yaw_rate[ticks], motion.speed[ticks], motion.angle[ticks]
    far = np.abs(r * v) > floor
    return float(np.mean((((delta - offset) / ratio - wheelbase * r / v) / (r * v))[far]))


def standstill(values: Array, still: npt.NDArray[np.bool_], rate_hz: float,
               params: Mapping[str, float]) -> tuple[float, float] | None:
    """Mean and its standard deviation over what is left of each standstill after settling."""
    raise NotImplementedError


def clean_mean(values: Array) -> float:
    return float(np.mean(values)) if len(values) else 0.0
