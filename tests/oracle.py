"""The second implementation: the thesis in short, batch, literal NumPy, after docs/method.md.

It shares only the default params with core/. It processes a whole drive at once, with masks, runs of clean ticks and
plain sums in place of the core's rings and running means. So agreement of both is evidence that both are correct. SI
units and rad.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import signal, stats

Array = npt.NDArray[np.float64]

MISSING_SIGNAL, TIME, GAP, SETTLING, SPEED, CURVATURE, LONGITUDINAL, BANK = (1 << k for k in range(8))
REASONS = ("missing_signal time gap settling speed curvature longitudinal_acceleration bank window").split()  # by bit
NORMAL_95 = 1.96


@dataclass(frozen=True)
class Motion:
    """(32), (33) and the regression quantities of all ticks with all signals, in order."""

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
    """Final ticks of a queue of blocks, as numbers in order."""

    final: npt.NDArray[np.int64]
    final_since: npt.NDArray[np.int64]  # of each block, the tick number that made it final
    pending: npt.NDArray[np.int64]  # at the end of the drive


@dataclass(frozen=True)
class Answer:
    reasons: npt.NDArray[np.uint32]  # of each row, 0 clean
    motion: Motion
    straight: npt.NDArray[np.int64]  # indices in `motion` of the ticks used for the offset
    bends: npt.NDArray[np.int64]  # the same, for K_us
    offset: float  # rad
    offset_temporary: float
    offset_sd: float
    offset_variance_if_independent: float
    offset_status: str
    understeer: float  # rad/(m/s^2), zero until learned
    understeer_sd: float
    understeer_status: str
    understeer_evidence: float  # s
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
    """s; the mean group delay over a band is the phase at its end over its width."""
    b, a = lowpass(cutoff_hz, rate_hz)
    _, response = signal.freqz(b, a, worN=[band_hz], fs=rate_hz)
    return float(-np.angle(response[0]) / (2 * np.pi * band_hz))


def filtered(values: Array, b: Array, a: Array) -> Array:
    """The filtered values, from the steady state of the first one."""
    out, _ = signal.lfilter(b, a, values, zi=signal.lfilter_zi(b, a) * values[0])
    return np.asarray(out)


def delayed(values: Array, ticks: float) -> Array:
    n = np.arange(len(values), dtype=float)
    return np.interp(n - ticks, n, values)  # constant before the first value


def slope(speed: Array, every: int, rate_hz: float) -> Array:
    """dv/dt: slope of a least-squares line through the last 11 speeds of every `every`-th tick, held in between."""
    kept = speed[::every]
    padded = np.concatenate([np.full(10, kept[0]), kept])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 11)
    seconds = np.arange(-5, 6) * every / rate_hz
    slopes = windows @ (seconds / np.sum(seconds**2))
    return np.repeat(slopes, every)[: len(speed)]


def holes(time: Array, rate_hz: float, params: Mapping[str, float]) -> npt.NDArray[np.bool_]:
    """Ticks after a hole, including the first tick."""
    hole = np.diff(time, prepend=-np.inf) - 0.5 / rate_hz
    return (hole > max(params["gap_max_s"], 1.0 / rate_hz)) | (hole < -1.0 / rate_hz)


def motion_of(
    rows: Mapping[str, Array],
    stands: npt.NDArray[np.bool_],
    wheelbase: float,
    ratio: float,
    params: Mapping[str, float],
    rate_hz: float,
) -> Motion:
    """5.1.1 and 5.1.2 over ticks that have all their signals, segment by segment between holes and standstills."""
    time = rows["time"]
    restarted = holes(time, rate_hz, params)
    every = max(1, int(params["speed_slope_window_s"] / 10 * rate_hz + 0.5))
    b, a = lowpass(params["cutoff_hz"], rate_hz)
    delay = mean_group_delay(params["cutoff_hz"], params["delay_band_hz"], rate_hz) * rate_hz
    angle, r, v, a_y, dv, settling = np.zeros((6, len(time)))  # zero at standstill
    changed = restarted | (np.diff(stands, prepend=False) != 0)
    starts = np.flatnonzero(changed)
    for start, stop in zip(starts, [*starts[1:], len(time)], strict=True):
        piece = slice(start, stop)
        if stands[start]:
            continue
        v[piece] = filtered(rows["speed"][piece], b, a)
        angle[piece] = delayed(rows["angle"][piece], delay)
        r[piece] = filtered(rows["yaw_rate"][piece], b, a)
        a_y[piece] = filtered(rows["acceleration"][piece], b, a)
        dv[piece] = slope(v[piece], every, rate_hz)
        settling[piece] = np.arange(stop - start) < 10 * every + int(delay)
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
    """(34), (35) and condition 2 of 5.1."""
    bits = np.zeros(len(motion.time), np.uint32)
    bits[motion.speed <= params["speed_min_m_s"]] |= SPEED
    bits[np.abs(motion.curvature) >= params["curvature_max_1_m"]] |= CURVATURE
    bits[np.abs(motion.longitudinal_acceleration) >= params["longitudinal_acceleration_max_m_s2"]] |= LONGITUDINAL
    bits[np.abs(motion.bank) >= params["bank_max_m_s2"]] |= BANK
    return bits


def queue(clean: npt.NDArray[np.bool_], ticks_per_block: int, blocks_until_final: int) -> Queue:
    """Blocks of clean runs that `blocks_until_final` clean blocks follow."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], clean, [False]]).astype(int)))
    final, since = [np.empty(0, int)], [np.empty(0, int)]
    pending = np.empty(0, int)
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        blocks = max(0, (stop - start) // ticks_per_block - blocks_until_final)
        final.append(np.arange(start, start + blocks * ticks_per_block))
        since.append(start + (np.arange(blocks) + 1 + blocks_until_final) * ticks_per_block - 1)
        if stop == len(clean):
            pending = np.arange(start + blocks * ticks_per_block, stop)
    return Queue(np.concatenate(final), np.concatenate(since), pending)


def few_batches(n: int) -> float:
    return float(stats.t.ppf(0.975, n - 1)) / NORMAL_95


def status_next(now: str, half_width: float, limit: float) -> str:
    return "valid" if half_width <= (limit * 4 / 3 if now == "valid" else limit) else "converging"


def recursive_mean(values: Array) -> float:
    """(36), tick by tick."""
    offset = 0.0
    for k, value in enumerate(values, start=1):
        offset += (value - offset) / k
    return offset


def understeer_literal(
    motion: Motion, ticks: npt.NDArray[np.int64], offset: float, ratio: float, wheelbase: float, floor: float
) -> float:
    """(38) as printed, K_us/g: the mean of its values where |r*v| is above the floor, rad/(m/s^2)."""
    r, v, delta = motion.yaw_rate[ticks], motion.speed[ticks], motion.angle[ticks]
    far = np.abs(r * v) > floor
    return float(np.mean((((delta - offset) / ratio - wheelbase * r / v) / (r * v))[far]))


def forward(time: Array, ticks_until_new_clock: int) -> npt.NDArray[np.bool_]:
    """Ticks whose time increases, as the core accepts them."""
    accepted = np.zeros(len(time), bool)
    newest, rejected, in_order = -np.inf, 0.0, 0
    for k, t in enumerate(time):
        if not abs(t) < 1e300:
            continue
        if t <= newest:
            in_order = in_order + 1 if t > rejected else 0
            rejected = t
            if in_order < ticks_until_new_clock:
                continue
        newest, in_order, accepted[k] = t, 0, True
    return accepted


def stood(speed: Array, anew: npt.NDArray[np.bool_], params: Mapping[str, float]) -> npt.NDArray[np.int64]:
    """Ticks of standstill up to each tick, starting at 1 where `anew`; 0: the truck moves."""
    still = np.abs(speed) <= params["standstill_speed_max_m_s"]
    number = np.arange(len(still))
    moved = np.maximum.accumulate(np.where(still, np.where(anew, number - 1, -1), number)) if len(still) else number
    return np.asarray(number - moved)


def standstill(values: Array, floor: float, rate_hz: float, params: Mapping[str, float]) -> tuple[float, float] | None:
    """Mean and its standard deviation, if long enough: ten ticks count as one, and the sd has a floor."""
    n = len(values)
    if n < 2 or n * (1.0 / rate_hz) < params["standstill_time_min_s"]:
        return None
    return float(np.mean(values)), float(np.sqrt(np.var(values, ddof=1) * 10 / n + floor**2))


@dataclass(frozen=True)
class Verdict:
    offset: float
    offset_sd: float
    scatter: float  # rad^2
    offset_status: str
    understeer: float
    understeer_sd: float
    understeer_status: str


def verdict(
    straight: dict[str, Array],
    bends: dict[str, Array],
    ticks_per_block: int,
    bias: tuple[float, float] | None,
    before: tuple[str, str],
    params: Mapping[str, float],
    rate_hz: float,
) -> Verdict:
    """(36)-(38), (42) and the intervals from the means of y, x, w per straight block and the sums per bend block."""
    ticks_per_batch = params["batch_s"] * rate_hz
    blocks_per_batch = max(1, int(np.ceil(ticks_per_batch / ticks_per_block)))
    y, x, w = (float(np.mean(straight[k])) if len(straight["y"]) else 0.0 for k in "yxw")
    Sx, Sxx, Sxy = (float(np.sum(bends[k])) for k in ("x", "xx", "xy"))
    bend_batches = len(bends["x"]) // blocks_per_batch

    def by_batch(values: Array) -> Array:
        whole = len(values) // blocks_per_batch
        return values[: whole * blocks_per_batch].reshape(whole, blocks_per_batch)

    def scatter(K: float) -> float:
        """rad^2, of the mean of y - K*x, by its batch means; 10 below two batches."""
        means = by_batch(straight["y"] - K * straight["x"]).mean(axis=1)
        n = len(means)
        return float(np.var(means, ddof=1)) / n * few_batches(n) ** 2 if n > 1 else 10.0

    K, K_variance, K_status = 0.0, params["understeer_sd_rad_m_s2"] ** 2, "unobservable"
    bends_variance, shared = K_variance, 1.0
    bend_time = len(bends["x"]) * ticks_per_block * (1.0 / rate_hz)
    separability = 1 - x * Sx / Sxx if Sxx else 0.0  # separability of gradient and offset
    if bend_time >= params["understeer_evidence_min_s"] and bend_batches > 1 and separability > 0.25:
        K = (Sxy - y * Sx) / (Sxx - x * Sx)
        e = by_batch(bends["xy"] - (y - K * x) * bends["x"] - K * bends["xx"]).sum(axis=1)
        n = len(e)
        bends_variance = float(np.sum(e**2)) * n / (n - 1) * few_batches(n) ** 2 / by_batch(bends["xx"]).sum() ** 2
        shared = separability**2
        K_variance = (bends_variance + (Sx / Sxx) ** 2 * scatter(K)) / shared
        K_status = status_next(before[1], NORMAL_95 * K_variance**0.5, params["understeer_half_width_max_rad_m_s2"])

    bias_spread = float(np.hypot(*bias)) if bias else params["yaw_rate_bias_sd_rad_s"]
    sd = ((scatter(K) + x**2 * bends_variance) / shared + (w * bias_spread) ** 2) ** 0.5
    straight_time = len(straight["y"]) * ticks_per_block * (1.0 / rate_hz)
    if len(straight["y"]) // blocks_per_batch < 2:
        status = "unobservable"
    elif straight_time < params["offset_evidence_min_s"]:
        status = "converging"
    else:
        status = status_next(before[0], NORMAL_95 * sd, params["offset_half_width_max_rad"])
    return Verdict(y - K * x, sd, scatter(K), status, K, K_variance**0.5, K_status)


def mean_or_zero(values: Array) -> float:
    return float(np.mean(values)) if len(values) else 0.0


def estimate(
    columns: Mapping[str, Array], wheelbase: float, ratio: float, params: Mapping[str, float], rate_hz: float
) -> Answer:
    """The thesis's method of docs/method.md on columns named as in tables (`time_s`, `yaw_rate_rad_s`, ...)."""
    t = columns["time_s"]
    n = len(t)
    lacking = np.full(n, np.nan)
    rows = {
        "time": t,
        "angle": columns.get("steering_wheel_angle_rad", lacking),
        "yaw_rate": columns.get("yaw_rate_rad_s", lacking),
        "speed": columns.get("vehicle_speed_m_s", lacking),
        "acceleration": columns.get("lateral_acceleration_m_s2", lacking),
    }
    # validity of ticks and signals
    accepted = forward(t, int(rate_hz))
    limits = {"angle": 100.0, "yaw_rate": 10.0, "speed": 150.0, "acceleration": 100.0}
    present = {name: np.abs(rows[name]) < limit for name, limit in limits.items()}
    has_acceleration = present["acceleration"]
    if not params["use_accelerometer"]:
        rows["acceleration"] = np.zeros(n)
        present["acceleration"] = np.ones(n, bool)
    complete = accepted & np.logical_and.reduce(list(present.values()))
    complete_rows = {name: np.asarray(values)[complete] for name, values in rows.items()}

    # motion and gate
    after_missing = np.diff(np.cumsum(accepted & ~complete)[complete], prepend=0) > 0
    after_hole = holes(complete_rows["time"], rate_hz, params)
    ticks_stood = stood(complete_rows["speed"], after_hole | after_missing, params)
    settled = int(params["standstill_settling_s"] * rate_hz + 0.5)
    stands = (ticks_stood > 0) & (ticks_stood >= settled)
    motion = motion_of(complete_rows, stands, wheelbase, ratio, params, rate_hz)
    bits = gate(motion, params)
    bits[motion.settling] |= SETTLING
    bits[motion.restarted & ~stands & (np.arange(len(bits)) > 0)] |= GAP
    reasons = np.zeros(n, np.uint32)
    reasons[~accepted] = TIME
    reasons[accepted & ~complete] = MISSING_SIGNAL
    reasons[complete] = bits

    # a run is of accepted ticks: a missing signal ends it, a rejected tick is ignored
    place = np.cumsum(complete) - 1  # index of a row among complete ticks
    rows_in_order = np.flatnonzero(accepted)
    clean = reasons[rows_in_order] == 0
    t1_ticks = params["clean_time_s"] * rate_hz
    ticks_per_block = int(np.ceil(t1_ticks / 20))
    blocks_until_final = int(np.ceil(t1_ticks / ticks_per_block))
    straight = queue(clean, ticks_per_block, blocks_until_final)

    def complete_ticks(numbers: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        return np.asarray(place[rows_in_order[numbers]])

    def per_block(values: Array) -> Array:
        return values.reshape(-1, ticks_per_block)

    s = complete_ticks(straight.final)
    straight_blocks = {k: per_block(v[s]).mean(axis=1) for k, v in (("y", motion.y), ("x", motion.x), ("w", motion.w))}
    no_bends = {k: np.empty(0) for k in ("x", "xx", "xy")}

    # standstill
    standing = np.flatnonzero(ticks_stood > settled)
    standing_rows = np.flatnonzero(complete)[standing]

    def bias_after(row: int) -> tuple[float, float] | None:
        shown = standing[: np.searchsorted(standing_rows, row, side="right")]
        return standstill(complete_rows["yaw_rate"][shown], 3.5e-4, rate_hz, params)

    def blocks_until(count: int, blocks: dict[str, Array]) -> dict[str, Array]:
        return {name: values[:count] for name, values in blocks.items()}

    # trusted from the tick after the decisive block on
    trusted_since = n + 1
    for count, since in enumerate(straight.final_since, start=1):
        if count * ticks_per_block * (1.0 / rate_hz) < params["offset_evidence_min_s"]:
            continue
        now = verdict(blocks_until(count, straight_blocks), no_bends, ticks_per_block, None, ("", ""), params, rate_hz)
        if NORMAL_95 * now.scatter**0.5 <= params["offset_half_width_max_rad"]:
            trusted_since = int(since)
            break

    # bends for K_us
    a_y = np.zeros(len(rows_in_order))
    is_complete = complete[rows_in_order]
    a_y[is_complete] = np.abs(motion.x / ratio)
    bend = (
        ((reasons[rows_in_order] & ~np.uint32(CURVATURE)) == 0)
        & (a_y > params["understeer_acceleration_min_m_s2"])
        & (a_y < params["understeer_acceleration_max_m_s2"])
        & (np.arange(len(rows_in_order)) > trusted_since)
    )
    bends = queue(bend, ticks_per_block, blocks_until_final)
    b = complete_ticks(bends.final)
    products = (("x", motion.x), ("xx", motion.x**2), ("xy", motion.x * motion.y))
    bend_blocks = {k: per_block(v[b]).sum(axis=1) for k, v in products}

    # the statuses as evidence grows; the last one has all of it
    now = verdict(blocks_until(0, straight_blocks), no_bends, ticks_per_block, None, ("", ""), params, rate_hz)
    for tick in [*np.unique(np.concatenate([straight.final_since, bends.final_since])), len(rows_in_order) - 1]:
        now = verdict(
            blocks_until(int(np.searchsorted(straight.final_since, tick, side="right")), straight_blocks),
            blocks_until(int(np.searchsorted(bends.final_since, tick, side="right")), bend_blocks),
            ticks_per_block,
            bias_after(int(rows_in_order[tick])) if len(rows_in_order) else None,
            (now.offset_status, now.understeer_status),
            params,
            rate_hz,
        )

    tick_s = 1.0 / rate_hz
    with_pending = complete_ticks(np.concatenate([straight.final, straight.pending]))
    fast = (bits & (SETTLING | SPEED)) == 0
    rejected = {name: float(np.sum((reasons >> k) & 1)) * tick_s for k, name in enumerate(REASONS)}
    rejected["window"] = float(np.sum(clean) - len(s)) * tick_s
    residual = motion.y[s] - now.understeer * motion.x[s]
    return Answer(
        reasons=reasons,
        motion=motion,
        straight=s,
        bends=b,
        offset=now.offset,
        offset_temporary=mean_or_zero(motion.y[with_pending] - now.understeer * motion.x[with_pending]),
        offset_sd=now.offset_sd,
        offset_variance_if_independent=float(np.var(residual, ddof=1)) / len(s) if len(s) > 1 else 10.0,
        offset_status=now.offset_status,
        understeer=now.understeer,
        understeer_sd=now.understeer_sd,
        understeer_status=now.understeer_status,
        understeer_evidence=len(b) * tick_s,
        offset_per_yaw_rate_bias=mean_or_zero(motion.w[s]),
        yaw_rate_bias=bias_after(n),
        standstill_acceleration=standstill(
            columns.get("lateral_acceleration_m_s2", lacking)[standing_rows][has_acceleration[standing_rows]],
            0.0,
            rate_hz,
            params,
        ),
        bank_mean=mean_or_zero(motion.bank[fast]),
        bank_time=float(np.sum(fast)) * tick_s,
        duration=len(rows_in_order) * tick_s,
        used=len(s) * tick_s,
        unused=(len(rows_in_order) - len(s)) * tick_s,
        rejected=rejected,
    )
