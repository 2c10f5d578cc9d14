"""Priors of a drive from a truck's memory, and the memory after the drive, whose result contains those priors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from oncenter.estimates.estimate import Estimate
from oncenter.memory.truck import Load, PastDrive, Remembered, TruckMemory
from oncenter.offset.answer import Answer
from oncenter.offset.inputs import params_of
from oncenter.tuned import BETWEEN_DRIVES, PRIORS
from oncenter.vehicle import Vehicle

# Ageing of remembered values: standard deviations of random walks, per root of a day.
_PLAY_SD_MIN, _PLAY_WALK = BETWEEN_DRIVES["PLAY"]  # the first is also a lower limit: drives' errors have a common part
_GRADIENT_WALK = BETWEEN_DRIVES["GRADIENT"][1]  # other loads are remembered for themselves
_WHEELBASE_BETWEEN, _WHEELBASE_WALK = BETWEEN_DRIVES["WHEELBASE"]
_YAW_RATE_BIAS_WALK = BETWEEN_DRIVES["YAW_RATE_BIAS"][1]  # each ignition adds the core's own
_ACCELERATION_WALK = BETWEEN_DRIVES["ACCELEROMETER_ZERO"][1]
_ACCELERATION_MAX = 0.9  # m/s^2, of a bias: the range of known_accelerometer_bias_m_s2
_GROUND_COMMON = 0.7  # of the sd of the ground's slope: half of its variance belongs to the yard of the truck
_GRADIENT_SHARE_MIN = 0.05  # of K: two loads are never exactly equal
_ANOTHER_LOAD_SD, _ANOTHER_LOAD_SHARE = 3.0, 0.1  # a gradient beyond both limits begins another load
_LOADS_MAX, _DRIVES_MAX = 8, 50
_LIFTS = ("6x2",)  # axle layouts whose wheelbase changes when an axle is lifted
_CONTRADICTS = 3.0  # sd of the remembered value, beyond which a wider result replaces it


def with_remembered_product(vehicle: Vehicle, memory: TruckMemory) -> Vehicle:
    """The vehicle with the remembered ratio times wheelbase in place of an assumed one."""
    if not vehicle.assumed or memory.ratio_times_wheelbase is None:
        return vehicle
    return vehicle.with_product(memory.ratio_times_wheelbase.value) or vehicle


def priors(memory: TruckMemory, vehicle: Vehicle, at_s: float) -> dict[str, float]:
    """Priors of a drive at that time, as params of the core; configured values of the vehicle file come first."""
    p = params_of(vehicle, None)
    found = {
        "known_play{}_rad": _aged_play(memory, at_s),
        "known_understeer_gradient{}_rad_m_s2": _gradient_of_next(memory, at_s),
        "known_wheelbase_share{}_1": _aged_wheelbase(memory, vehicle, at_s),
        "known_accelerometer_bias{}_m_s2": _aged_accelerometer(memory, p, at_s),
        "known_yaw_rate_bias{}_rad_s": _aged_yaw_rate_bias(memory, p, at_s),
    }
    given = vehicle.params.keys() - ({"known_wheelbase_share_sd_1"} if vehicle.assumed else set())
    return {
        name.format(part): value
        for name, remembered in found.items()
        if remembered is not None and name.format("_sd") not in given
        for part, value in (("", remembered.value), ("_sd", remembered.sd))
    }


def with_drive(
    memory: TruckMemory, answer: Answer, keys: Mapping[str, str], start_s: float, started_from: Mapping[str, float]
) -> TruckMemory:
    """The memory after a drive; unchanged where the angle sensor or another signal is at fault.

    Args:
        memory: before the drive.
        answer: of the drive, or of several at once, by the joint method.
        keys: fingerprints of its logs by their names, none in the memory.
        start_s: begin of the drive.
        started_from: the `priors` of the answer.
    """
    if answer.sensor_fault != "none" or answer.offset.status == "invalid":
        return memory
    p = answer.params
    offset = _remembered(answer.offset, start_s, ("valid", "converging"))
    value, offset_sd = (None, None) if offset is None else (offset.value, offset.sd)
    present = {drive.log for drive in answer.drives}  # other logs are before a step, so this offset is not theirs
    added = [
        PastDrive(key, start_s, *((value, offset_sd) if log in present else (None, None)), answer.offset.status)
        for log, key in keys.items()
    ]
    return replace(
        _with_size(memory, answer, start_s),
        play=_renewed(memory.play, _aged_play(memory, start_s), _remembered(answer.backlash, start_s)),
        yaw_rate_bias=_renewed(
            memory.yaw_rate_bias, _aged_yaw_rate_bias(memory, p, start_s), _remembered(answer.yaw_rate_bias, start_s)
        ),
        accelerometer_bias=_with_standstill(memory, answer, start_s),
        loads=_with_gradient(memory, answer, start_s, started_from),
        drives=tuple([*memory.drives, *added][-_DRIVES_MAX:]),
    )


def _remembered(estimate: Estimate, date_s: float, statuses: Sequence[str] = ("valid",)) -> Remembered | None:
    if estimate.value is None or estimate.ci95 is None or estimate.status not in statuses:
        return None
    low, high = estimate.ci95
    sd = max(high - estimate.value, estimate.value - low) / 1.96
    return Remembered(estimate.value, sd, date_s) if sd > 0.0 else None


def _renewed(before: Remembered | None, prior: Remembered | None, result: Remembered | None) -> Remembered | None:
    """The drive's result where it is more accurate than the remembered value, or contradicts it."""
    if result is None:
        return before
    if before is None or prior is None:
        return result
    contradicts = abs(result.value - prior.value) > _CONTRADICTS * prior.sd
    return result if result.sd <= prior.sd or contradicts else before


def _aged_play(memory: TruckMemory, at_s: float) -> Remembered | None:
    return memory.play and memory.play.aged(at_s, _PLAY_WALK, sd_min=_PLAY_SD_MIN)


def _aged_yaw_rate_bias(memory: TruckMemory, p: Mapping[str, float], at_s: float) -> Remembered | None:
    bias = memory.yaw_rate_bias
    return bias and _if_narrower(
        bias.aged(at_s, _YAW_RATE_BIAS_WALK, p["gyro_bias_ignition_sd_rad_s"]), p["gyro_bias_sd_rad_s"]
    )


def _aged_accelerometer(memory: TruckMemory, p: Mapping[str, float], at_s: float) -> Remembered | None:
    bias = memory.accelerometer_bias
    return bias and _if_narrower(bias.aged(at_s, _ACCELERATION_WALK), p["accelerometer_bias_sd_m_s2"])


def _with_size(memory: TruckMemory, answer: Answer, start_s: float) -> TruckMemory:
    """The memory with the wheelbase after the drive; of a truck whose wheelbase or ratio is assumed, their product."""
    prior = _in_metres(_aged_wheelbase(memory, answer.vehicle, start_s), _size_m(answer.vehicle))
    if answer.vehicle.assumed:
        product = _remembered(answer.ratio_times_wheelbase, start_s)
        return replace(memory, ratio_times_wheelbase=_renewed(memory.ratio_times_wheelbase, prior, product))
    found = _remembered(answer.equivalent_wheelbase, start_s)
    return replace(memory, equivalent_wheelbase=_renewed(memory.equivalent_wheelbase, prior, found))


def _size_m(vehicle: Vehicle) -> float:
    """The wheelbase, or ratio times wheelbase where one of them is assumed."""
    return vehicle.ratio_times_wheelbase_m if vehicle.assumed else vehicle.wheelbase_m


def _aged_wheelbase(memory: TruckMemory, vehicle: Vehicle, at_s: float) -> Remembered | None:
    """The remembered wheelbase, or product, as a share of the vehicle's."""
    found, size_m = memory.ratio_times_wheelbase if vehicle.assumed else memory.equivalent_wheelbase, _size_m(vehicle)
    if found is None or vehicle.axle_layout in _LIFTS:
        return None
    share = Remembered(found.value / size_m - 1.0, found.sd / size_m, found.date_s)
    return share.aged(at_s, _WHEELBASE_WALK, _WHEELBASE_BETWEEN)


def _in_metres(share: Remembered | None, wheelbase_m: float) -> Remembered | None:
    return share and Remembered(wheelbase_m * (1.0 + share.value), wheelbase_m * share.sd, share.date_s)


def _if_narrower(aged: Remembered, sd: float) -> Remembered | None:
    return aged if aged.sd < sd else None


def _gradient_of_next(memory: TruckMemory, at_s: float) -> Remembered | None:
    """The gradient of a drive at an unknown load: loads so far, weighted by their drives, and one of another load."""
    if not memory.loads:
        return None
    aged = [(load.drives, load.gradient.aged(at_s, _GRADIENT_WALK)) for load in memory.loads]
    parts = [*((count, remembered.value, remembered.sd) for count, remembered in aged), (1, *PRIORS["GRADIENT"])]
    drives = sum(count for count, _, _ in parts)
    mean = sum(count * value for count, value, _ in parts) / drives
    variance = sum(count * (sd**2 + (value - mean) ** 2) for count, value, sd in parts) / drives
    return Remembered(mean, math.sqrt(variance), at_s)


def _with_gradient(
    memory: TruckMemory, answer: Answer, start_s: float, started_from: Mapping[str, float]
) -> tuple[Load, ...]:
    result = _remembered(answer.understeer_gradient, start_s)
    if result is None:
        return memory.loads
    given = {**answer.vehicle.params, **started_from}
    prior = (
        given.get("known_understeer_gradient_rad_m_s2"),
        given.get("known_understeer_gradient_sd_rad_m_s2"),
    )
    mean, sd = PRIORS["GRADIENT"] if prior[0] is None or not prior[1] else (prior[0], prior[1])
    found = result.without(Remembered(mean, sd, start_s))
    if found is None:
        return memory.loads
    found = replace(found, sd=max(found.sd, _GRADIENT_SHARE_MIN * abs(found.value)))
    loads = list(memory.loads)
    apart = [_apart(load.gradient.aged(start_s, _GRADIENT_WALK), found) for load in loads]
    nearest = min(range(len(loads)), key=lambda k: apart[k], default=None)
    if nearest is None or apart[nearest] > 1.0:
        return tuple(sorted([*loads, Load(found, 1)], key=lambda load: load.gradient.date_s)[-_LOADS_MAX:])
    both = loads[nearest].gradient.aged(start_s, _GRADIENT_WALK).combined(found)
    both = replace(both, sd=max(both.sd, _GRADIENT_SHARE_MIN * abs(both.value)))
    loads[nearest] = Load(both, loads[nearest].drives + 1)
    return tuple(loads)


def _apart(remembered: Remembered, found: Remembered) -> float:
    """Above 1 the gradient belongs to another load."""
    distance = abs(found.value - remembered.value)
    in_sds = distance / (_ANOTHER_LOAD_SD * math.hypot(remembered.sd, found.sd))
    return min(in_sds, distance / (_ANOTHER_LOAD_SHARE * abs(remembered.value) or 1.0))


def _with_standstill(memory: TruckMemory, answer: Answer, start_s: float) -> Remembered | None:
    """The accelerometer bias with the reading at standstill alone, which contains no prior."""
    p = answer.params
    if answer.summary is None or math.isnan(answer.summary.standing) or not p["use_accelerometer"]:
        return memory.accelerometer_bias
    crown, side = p["standing_crown_share_1"] * p["crown_m_s2"], answer.vehicle.traffic_sign
    crown_sd = p["standing_crown_share_1"] * p["crown_sd_m_s2"]
    unknown_side = 0.0 if side else crown
    sd = math.hypot(p["standing_slope_sd_m_s2"], crown_sd, unknown_side)
    sd_min = math.hypot(_GROUND_COMMON * p["standing_slope_sd_m_s2"], unknown_side)
    given = p["known_accelerometer_bias_m_s2"] if p["known_accelerometer_bias_sd_m_s2"] > 0.0 else 0.0
    found = Remembered(answer.summary.standing + given - side * crown, sd, start_s)
    aged = memory.accelerometer_bias and memory.accelerometer_bias.aged(start_s, _ACCELERATION_WALK)
    both = found if aged is None else aged.combined(found)
    if abs(both.value) > _ACCELERATION_MAX:  # extreme ground or a wrong unit, not a bias
        return memory.accelerometer_bias
    return replace(both, sd=max(both.sd, sd_min))
