"""The core's state machine in numba, as a careful Python programmer would write it instead of C.

One loop, no fastmath, the same operations in the same order as core/*.c and the same outputs. The state is in local
variables, so the compiler can keep it in registers. Unlike the core, it cannot be stopped, saved and continued.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from oncenter._core import OUTPUT_DTYPE, Core

Column = npt.NDArray[np.float64]

POINTS = 11  # OC_SLOPE_POINTS
DELAY = 64  # OC_DELAY_MAX
PENDING = 48  # OC_PENDING_MAX
MISSING, TIME, GAP, SETTLING, SPEED, CURVATURE, LONGITUDINAL, BANK = (1 << k for k in range(8))
UNOBSERVABLE, CONVERGING, VALID = 0, 1, 2

# The fields of oc_output that the thesis's method fills, with oc_motion flattened, in a form that numba can write.
_MOTION = OUTPUT_DTYPE["motion"]
_THESIS = ("time", "vehicle_speed", "reasons", "offset_status", "offset", "offset_sd", "understeer_gradient")
FLAT_OUTPUT = np.dtype(
    {
        "names": [*_THESIS, *(_MOTION.names or ())],
        "formats": [OUTPUT_DTYPE[n] for n in _THESIS] + [_MOTION[n] for n in _MOTION.names or ()],
        "offsets": [OUTPUT_DTYPE.fields[n][1] for n in _THESIS]
        + [OUTPUT_DTYPE.fields["motion"][1] + _MOTION.fields[n][1] for n in _MOTION.names or ()],
        "itemsize": OUTPUT_DTYPE.itemsize,
    }
)  # fmt: skip


def flat(members: Mapping[str, Any]) -> Any:
    """The core's coefficients as a named tuple of plain numbers, for numba."""
    numbers: dict[str, Any] = {}
    for name, value in members.items():
        numbers.update(flat(value)._asdict() if isinstance(value, dict) else {name: value})
    return NamedTuple("Coefficients", [(n, type(v)) for n, v in numbers.items()])(**numbers)


def coefficients(core: Core) -> Any:
    """The coefficients of the thesis's method."""
    all_of_them = core.coefficients()
    settling = all_of_them["gyro_bias"]["settling_ticks"]
    mine = {name: value for name, value in all_of_them.items() if name not in ("gyro_bias", "joint", "angle")}
    return flat(mine | {"standstill_settling_ticks": settling})


@njit
def merge(into: Column, other: Column) -> None:
    """Moments as [weight, y, x, w, yy, xy, xx]."""
    total = into[0] + other[0]
    share = other[0] / total
    between = into[0] * share
    y, x, w = other[1] - into[1], other[2] - into[2], other[3] - into[3]
    into[4] += other[4] + between * y * y
    into[5] += other[5] + between * x * y
    into[6] += other[6] + between * x * x
    into[1] += share * y
    into[2] += share * x
    into[3] += share * w
    into[0] = total


@njit
def few_batches_factor(batches: float) -> float:
    freedom = batches - 1.0
    if not freedom > 1.5:
        return 12.706 / 1.96
    one, f = np.float32(1.0), np.float32(1.0) / np.float32(freedom)  # single precision, as in the core
    b, c, d, e = np.float32(2.3723), np.float32(2.8225), np.float32(2.5559), np.float32(1.5896)
    return np.float64(one + f * (b + f * (c + f * (d + f * e))) / np.float32(1.96))


@njit
def offset_variance(batches: Column, K: float) -> float:
    n = batches[0]
    if not n > 1.0:
        return 10.0
    squares = batches[4] - 2.0 * K * batches[5] + K * K * batches[6]
    factor = few_batches_factor(n)
    return factor * factor * (squares / (n - 1.0) if squares > 0.0 else 0.0) / n


@njit
def status_next(now: int, half_width: float, narrow: float) -> int:
    return VALID if half_width <= (4.0 / 3.0 * narrow if now == VALID else narrow) else CONVERGING


@njit
def learn(c, offset, batches, bends, bend_batches, still_weight, still_mean, still_squares, trusted, statuses):
    """(offset, its standard deviation, K_us/g, trusted) from the evidence; `statuses` is [offset, understeer]."""
    K, own, K_status = 0.0, c.understeer_sd_rad_m_s2 * c.understeer_sd_rad_m_s2, UNOBSERVABLE
    n, x, xx, xy = bends
    shared = 1.0
    share = 1.0 - offset[2] * x / xx if xx > 0.0 else 0.0
    if n * c.tick_s >= c.understeer_evidence_min_s and bend_batches[0] > 1.0 and share > 0.25:
        K = (xy - offset[1] * x) / xx / share
        o = offset[1] - K * offset[2]
        b, b_xx, xy_xy, x_x, xx_xx, xy_x, xy_xx, x_xx = bend_batches
        squares = xy_xy + o * o * x_x + K * K * xx_xx - 2.0 * o * xy_x - 2.0 * K * xy_xx + 2.0 * o * K * x_xx
        factor = few_batches_factor(b)
        own = factor * factor * (b / (b - 1.0)) * max(squares, 0.0) / (b_xx * b_xx)
        K_variance = own + (-x / xx) * (-x / xx) * offset_variance(batches, K)
        shared = share
        K_status = status_next(statuses[1], 1.96 * np.sqrt(K_variance) / share, c.understeer_half_width_max_rad_m_s2)
    statuses[1] = K_status

    bias = c.yaw_rate_bias_sd_rad_s
    if still_weight * c.tick_s >= c.standstill_time_min_s and still_weight > 1.0:
        sd = np.sqrt(still_squares / (still_weight - 1.0) * 10.0 / still_weight + 3.5e-4 * 3.5e-4)
        bias = np.sqrt(still_mean * still_mean + sd * sd)
    scatter = offset_variance(batches, K)
    gyro = offset[3] * bias
    sd = np.sqrt((scatter + offset[2] * offset[2] * own) / (shared * shared) + gyro * gyro)
    enough = offset[0] * c.tick_s >= c.offset_evidence_min_s
    if enough and 1.96 * np.sqrt(scatter) <= c.offset_half_width_max_rad:
        trusted = True
    if not batches[0] > 1.0:
        statuses[0] = UNOBSERVABLE
    elif not enough:
        statuses[0] = CONVERGING
    else:
        statuses[0] = status_next(statuses[0], 1.96 * sd, c.offset_half_width_max_rad)
    return offset[1] - K * offset[2], sd, K, trusted


@njit
def pend(c, ring, place, sums, final):
    """Puts a complete block into the ring; True when the oldest became final. `place` is [first, count]."""
    n = sums[0]
    y, x = sums[1] / n, sums[2] / n
    ripe = place[1] == c.blocks_until_final
    if ripe:
        final[:] = ring[place[0]]
        place[0] = (place[0] + 1) % PENDING
        place[1] -= 1
    whole = ring[(place[0] + place[1]) % PENDING]
    whole[0], whole[1], whole[2], whole[3] = n, y, x, sums[3] / n
    whole[4], whole[5], whole[6] = sums[4] - n * y * y, sums[5] - n * x * y, sums[6] - n * x * x
    place[1] += 1
    return ripe


@njit
def add_to_batch(c, filling, block, batches):
    merge(filling, block)
    if filling[0] >= c.ticks_per_batch:
        mean = np.array([1.0, filling[1], filling[2], filling[3], 0.0, 0.0, 0.0])
        merge(batches, mean)
        filling[:] = 0.0


@njit
def add_to_bends(c, bends, filling, block, batches):
    bends[0] += block[0]
    bends[1] += block[0] * block[2]
    bends[2] += block[6] + block[0] * block[2] * block[2]
    bends[3] += block[5] + block[0] * block[2] * block[1]
    merge(filling, block)
    if filling[0] >= c.ticks_per_batch:
        x = filling[0] * filling[2]
        xx = filling[6] + filling[0] * filling[2] * filling[2]
        xy = filling[5] + filling[0] * filling[2] * filling[1]
        batches += np.array([1.0, xx, xy * xy, x * x, xx * xx, xy * x, xy * xx, x * xx])
        filling[:] = 0.0


@njit
def run(c, time, angle, yaw_rate, speed, acceleration, outputs):
    """Figure 15 over all rows; fills `outputs` unless it is empty.

    Returns:
        offset, its standard deviation, K_us/g, ticks by reason, standstill yaw rate bias, ticks.
    """
    b0, a1, a2 = c.b0, c.a1, c.a2
    use_accelerometer = c.use_accelerometer != 0
    i, iL = c.steering_ratio, c.ratio_times_wheelbase
    r1 = r2 = v1 = v2 = a_1 = a_2 = 0.0  # of the filters
    ring_angle, ring_speed = np.zeros(DELAY), np.zeros(POINTS)
    angle_next, speed_next, slope_wait, seen, slope = 0, 0, 0, 0, 0.0
    clock_started, running, followed, last_time, last_filtered = False, False, False, 0.0, 0.0
    last_refused, in_order = 0.0, 0
    still_ticks, still_weight, still_mean, still_squares = 0, 0.0, 0.0, 0.0
    still_a_weight, still_a_mean, still_a_squares = 0.0, 0.0, 0.0
    n1 = y1 = x1 = w1 = yy1 = xy1 = xx1 = 0.0  # the growing block on straights
    n2 = y2 = x2 = w2 = yy2 = xy2 = xx2 = 0.0  # and in bends
    in1 = in2 = 0
    ring1, ring2 = np.zeros((PENDING, 7)), np.zeros((PENDING, 7))
    place1, place2 = np.zeros(2, np.int64), np.zeros(2, np.int64)
    offset, filling1, batches1 = np.zeros(7), np.zeros(7), np.zeros(7)
    bends, filling2, batches2 = np.zeros(4), np.zeros(7), np.zeros(8)
    block, statuses, trusted = np.zeros(7), np.zeros(2, np.int64), False
    value, sd, K = 0.0, 0.0, 0.0
    rejected, unused, ticks = np.zeros(9, np.int64), 0, 0
    bank_ticks, bank_sum = 0.0, 0.0

    for row in range(len(time)):
        t, d_m, r_m, v_m, a_m = time[row], angle[row], yaw_rate[row], speed[row], acceleration[row]
        reasons = 0
        curvature = bank = a_y = residual = v = shown_slope = 0.0

        forward = -1e300 < t < 1e300
        if forward and clock_started and not t > last_time:
            in_order = in_order + 1 if t > last_refused else 0
            last_refused = t
            forward = in_order >= c.ticks_until_new_clock
        if not forward:
            reasons = TIME
            rejected[1] += 1
        else:
            last_time, clock_started, in_order = t, True, 0
            ticks += 1
            has_acceleration = -100.0 < a_m < 100.0
            if not (
                -100.0 < d_m < 100.0
                and -10.0 < r_m < 10.0
                and -150.0 < v_m < 150.0
                and (has_acceleration or not use_accelerometer)
            ):
                reasons = MISSING
                rejected[0] += 1
                unused += 1
                n1 = y1 = x1 = w1 = yy1 = xy1 = xx1 = 0.0
                n2 = y2 = x2 = w2 = yy2 = xy2 = xx2 = 0.0
                in1 = in2 = 0
                place1[1] = place2[1] = 0
                still_ticks = 0
            else:
                hole = t - last_filtered - 0.5 * c.tick_s
                after_hole = followed and (hole < -c.tick_s or (hole > c.gap_max_s and hole > c.tick_s))
                last_filtered, followed = t, True
                if after_hole:
                    still_ticks = 0

                # standstill
                if not abs(v_m) <= c.standstill_speed_max_m_s:
                    still_ticks = 0
                elif still_ticks < c.standstill_settling_ticks:
                    still_ticks += 1
                else:
                    still_weight += 1.0
                    innovation = r_m - still_mean
                    still_mean += innovation / still_weight
                    still_squares += innovation * (r_m - still_mean)
                    if has_acceleration:
                        still_a_weight += 1.0
                        innovation = a_m - still_a_mean
                        still_a_mean += innovation / still_a_weight
                        still_a_squares += innovation * (a_m - still_a_mean)

                if still_ticks >= c.standstill_settling_ticks:
                    reasons, running = SPEED, False
                    rejected[4] += 1
                    unused += 1
                else:
                    # filters
                    a_in = a_m if use_accelerometer else 0.0
                    reasons = GAP if after_hole else 0
                    if not running or after_hole:
                        r2, v2, a_2 = (b0 - a2) * r_m, (b0 - a2) * v_m, (b0 - a2) * a_in
                        r1 = (2.0 * b0 - a1) * r_m + r2
                        v1 = (2.0 * b0 - a1) * v_m + v2
                        a_1 = (2.0 * b0 - a1) * a_in + a_2
                        ring_angle[:] = d_m
                        ring_speed[:] = v_m
                        angle_next, speed_next, slope_wait, seen, slope, running = 0, 0, 0, 0, 0.0, True

                    b0x = b0 * v_m
                    v = b0x + v1
                    v1 = 2.0 * b0x - a1 * v + v2
                    v2 = b0x - a2 * v
                    b0x = b0 * r_m
                    r = b0x + r1
                    r1 = 2.0 * b0x - a1 * r + r2
                    r2 = b0x - a2 * r
                    b0x = b0 * a_in
                    a = b0x + a_1
                    a_1 = 2.0 * b0x - a1 * a + a_2
                    a_2 = b0x - a2 * a
                    if slope_wait > 0:
                        slope_wait -= 1
                    else:
                        slope_wait = c.slope_every - 1
                        ring_speed[speed_next] = v
                        speed_next = speed_next + 1 if speed_next + 1 < POINTS else 0
                        slope, place = 0.0, speed_next
                        for k in range(POINTS):
                            slope += (k - POINTS // 2) * ring_speed[place]
                            place = place + 1 if place + 1 < POINTS else 0
                        slope *= c.slope_scale
                    ring_angle[angle_next] = d_m
                    later = ring_angle[(angle_next - c.delay_ticks) & (DELAY - 1)]
                    earlier = ring_angle[(angle_next - c.delay_ticks - 1) & (DELAY - 1)]
                    delta_m = later + c.delay_fraction * (earlier - later)
                    angle_next = (angle_next + 1) & (DELAY - 1)
                    if seen < c.settling_ticks:
                        seen += 1
                    if seen < c.settling_ticks:
                        reasons |= SETTLING

                    # motion and gate
                    shown_slope = slope
                    curvature = r / (v if v > 1.0 else 1.0)
                    bank = a - r * v if use_accelerometer else 0.0
                    a_y = a if use_accelerometer else r * v
                    residual = delta_m - iL * curvature
                    if not v > c.speed_min_m_s:
                        reasons |= SPEED
                    if not abs(curvature) < c.curvature_max_1_m:
                        reasons |= CURVATURE
                    if not abs(slope) < c.longitudinal_acceleration_max_m_s2:
                        reasons |= LONGITUDINAL
                    if not abs(bank) < c.bank_max_m_s2:
                        reasons |= BANK
                    if not reasons & (SETTLING | SPEED):
                        bank_ticks += 1.0
                        bank_sum += bank
                    if reasons:
                        unused += 1
                        for k in range(9):
                            rejected[k] += (reasons >> k) & 1

                    # offset and understeer gradient
                    x = i * a_y
                    w = iL / (v if v > 1.0 else 1.0)
                    new = False
                    if reasons:
                        n1 = y1 = x1 = w1 = yy1 = xy1 = xx1 = 0.0
                        in1 = 0
                        place1[1] = 0
                    else:
                        n1 += 1.0
                        y1 += residual
                        x1 += x
                        w1 += w
                        yy1 += residual * residual
                        xy1 += x * residual
                        xx1 += x * x
                        in1 += 1
                        if in1 >= c.ticks_per_block:
                            if pend(c, ring1, place1, (n1, y1, x1, w1, yy1, xy1, xx1), block):
                                merge(offset, block)
                                add_to_batch(c, filling1, block, batches1)
                                new = True
                            n1 = y1 = x1 = w1 = yy1 = xy1 = xx1 = 0.0
                            in1 = 0
                    in_range = c.understeer_acceleration_min_m_s2 < abs(a_y) < c.understeer_acceleration_max_m_s2
                    if reasons & ~CURVATURE or not in_range or not trusted:
                        n2 = y2 = x2 = w2 = yy2 = xy2 = xx2 = 0.0
                        in2 = 0
                        place2[1] = 0
                    else:
                        n2 += 1.0
                        y2 += residual
                        x2 += x
                        w2 += w
                        yy2 += residual * residual
                        xy2 += x * residual
                        xx2 += x * x
                        in2 += 1
                        if in2 >= c.ticks_per_block:
                            if pend(c, ring2, place2, (n2, y2, x2, w2, yy2, xy2, xx2), block):
                                add_to_bends(c, bends, filling2, block, batches2)
                                new = True
                            n2 = y2 = x2 = w2 = yy2 = xy2 = xx2 = 0.0
                            in2 = 0
                    if new:
                        standing = (still_weight, still_mean, still_squares)
                        value, sd, K, trusted = learn(
                            c, offset, batches1, bends, batches2, *standing, trusted, statuses
                        )
        if len(outputs) > 0:
            out = outputs[row]
            out.time, out.vehicle_speed, out.reasons = t, v, reasons
            out.curvature, out.bank, out.lateral_acceleration, out.residual = curvature, bank, a_y, residual
            out.longitudinal_acceleration = shown_slope
            out.offset_status, out.offset, out.offset_sd, out.understeer_gradient = statuses[0], value, sd, K

    rejected[8] = ticks - unused - int(offset[0])
    return value, sd, K, rejected, still_mean, ticks
