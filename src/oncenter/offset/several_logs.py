"""Several logs of one truck: each drive is answered alone, and the truck's model (oncenter.truck) combines them.

Logs that continue each other are one drive. The combined answer is an oc_answer like that of one drive, so that the
findings and words of one drive follow from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from oncenter import _core
from oncenter.estimates.cause import Pull
from oncenter.estimates.changes import Change, kind_of_offset
from oncenter.estimates.estimate import number
from oncenter.findings import Finding, Kind, finding
from oncenter.offset.answer import Answer
from oncenter.offset.joint_findings import listed, zero_moves
from oncenter.read.whole_turns import is_relative
from oncenter.signals import DEGREE, Signals
from oncenter.truck.drives import Summary, is_usable, summary_of, together
from oncenter.truck.model import Trucks, learn
from oncenter.truck.priors import Priors, priors_of
from oncenter.vehicle import Vehicle

_MODEL_FROM = 4  # drives: two on either side of a step that the model finds
_STEP_SDS = 6.0  # of two valid drives: 2 of 2,064 neighbours of bench/trucks.py's months scatter by more
_STEP_MIN_RAD = 1.0 * DEGREE


@dataclass(frozen=True)
class Drive:
    """A drive: its logs, the core's answer on it, and the changes of the offset in it."""

    logs: tuple[Signals, ...]
    native: _core.OcAnswer
    changes: tuple[Change, ...]


@dataclass(frozen=True)
class LogStep:
    """The offset changed before drive `at`, by `size` with standard deviation `sd`, rad."""

    at: int
    size: float
    sd: float


@dataclass(frozen=True)
class Together:
    """The drives since the last change of the offset, the change before the first of them, and the truck's model of all
    usable drives; None where there are fewer than two."""

    drives: tuple[Drive, ...]
    native: _core.OcAnswer
    before: tuple[Drive, ...]
    step: LogStep | None
    model: Trucks | None


def combined(drives: tuple[Drive, ...], vehicle: Vehicle, params: Mapping[str, float]) -> Together:
    """All drives of a truck, in order of time, by the joint method."""
    if any(is_relative(log) for log in drives[-1].logs):
        return Together(drives[-1:], drives[-1].native, drives[:-1], None, None)
    priors = priors_of(params)
    summaries = [summary_of(drive.native, vehicle, params) for drive in drives]
    usable = [k for k, drive in enumerate(drives) if is_usable(_status(drive), summaries[k].gradient)]
    if len(usable) < 2:
        return _by_one(drives, usable)
    changed = np.array([[any(map(_moved_offset, drives[k].changes)) for k in usable]])
    valid = [k for k in usable if _status(drives[k]) == "valid"]
    pairs = steps_between(summaries, usable, valid, priors)
    for step in pairs:
        changed[0, usable.index(step.at)] = True
    model = learn(together([[summaries[k] for k in usable]]), priors, changed)
    steps = [*pairs, *(LogStep(usable[step.at], step.size, step.sd) for step in model.steps)]
    since = usable[model.since[0]] if model.since[0] else 0
    used = [drives[k] for k in usable if k >= since]
    return Together(
        drives=drives[since:],
        native=_as_one_drive(drives[since:], used, model, params),
        before=drives[:since],
        step=next((step for step in steps if step.at == since), None) if model.zero[0] == "fixed" else None,
        model=model,
    )


def _by_one(drives: tuple[Drive, ...], usable: Sequence[int]) -> Together:
    """Fewer than two drives have an offset: that of the one, else of the longest; with the time of all."""
    one = usable[0] if usable else max(range(len(drives)), key=lambda k: drives[k].native["used"])
    native = _with_times(drives[one].native.copy(), drives)
    return Together(drives, native, (), None, None)


def _status(drive: Drive) -> str:
    return _core.status_of(drive.native["offset"])


def _moved_offset(change: Change) -> bool:
    return change.size_rad is not None and abs(change.size_rad) >= 1.96 * (change.sd_rad or 0.0)


def steps_between(
    summaries: Sequence[Summary], usable: Sequence[int], valid: Sequence[int], priors: Priors
) -> list[LogStep]:
    """The steps that the model cannot find by the drives after them: of few drives all, else that before the last."""
    pairs = _by_pairs(summaries, valid, priors)
    if len(usable) < _MODEL_FROM:
        return pairs
    return [step for step in pairs if step.at == usable[-1] and _is_new(step, usable, summaries)]


def _by_pairs(summaries: Sequence[Summary], valid: Sequence[int], priors: Priors) -> list[LogStep]:
    """Two or three drives do not separate a step from one wrong drive: valid neighbours are compared."""
    steps = []
    for k, later in pairwise(valid):
        before, after = summaries[k], summaries[later]
        size = after.offset - before.offset
        by_load = after.ratio * (after.gradient - before.gradient) * priors.pull_sd_m_s2
        sd = math.hypot(before.offset_sd, after.offset_sd, by_load, math.sqrt(2.0) * priors.offset_noise_sd_rad)
        if _is_step(size, sd):
            steps.append(LogStep(later, size, sd))
    return steps


def _is_step(size: float, sd: float) -> bool:
    """Whether two neighbouring drives differ by more than drives with one offset do; rad."""
    return abs(size) > max(_STEP_MIN_RAD, _STEP_SDS * sd)


def _is_new(step: LogStep, usable: Sequence[int], summaries: Sequence[Summary]) -> bool:
    """Whether the drive after the step differs as much from most of those before it: the one before may be wrong."""
    before = float(np.median([summaries[k].offset for k in usable if k < step.at]))
    return _is_step(summaries[step.at].offset - before, step.sd)


def _as_one_drive(
    drives: Sequence[Drive], usable: Sequence[Drive], model: Trucks, params: Mapping[str, float]
) -> _core.OcAnswer:
    """The oc_answer of the truck's last drive, with what all drives since the last change say of the truck."""
    natives = [drive.native for drive in usable]
    answer = _with_times(drives[-1].native.copy(), drives)
    value, own_sd = float(model.offset[0]), float(model.spread_sd[0])
    lean, whole_sd = float(model.less_pull[0]) - value, float(model.offset_sd[0])
    is_wide = 1.96 * own_sd > params["offset_drive_half_width_max_rad"]
    evidence = sum(native["offset"]["evidence"] for native in natives)
    enough = evidence >= params["joint_evidence_min_s"] and not is_wide
    status = "invalid" if _core.status_of(answer["offset"]) == "invalid" else "valid" if enough else "converging"
    answer["offset"] = _estimate(value, whole_sd, evidence, status, lean)
    answer["offset_temporary"] = value
    answer["offset_parts"] = {
        "drive_sd": own_sd,
        "pull_sd": math.sqrt(max(whole_sd**2 - own_sd**2, 0.0)),
        "wind_sd": 0.0,
        "set_up_sd": 0.0,
        "per_acceleration": _mean(natives, lambda native: native["offset_parts"]["per_acceleration"]),
    }
    answer["understeer_gradient"] = _averaged([native["understeer_gradient"] for native in natives])
    answer["equivalent_wheelbase"] = _averaged([native["equivalent_wheelbase"] for native in natives])
    play_status = _best_status([native["backlash"] for native in natives])
    answer["backlash"] = _estimate(float(model.play[0]), float(model.play_sd[0]), evidence, play_status)
    neutral_status = _best_status([native["unloading_acceleration"] for native in natives])
    if params["use_accelerometer"]:
        neutral = float(model.neutral[0]), float(model.neutral_sd[0])
        answer["unloading_acceleration"] = _estimate(*neutral, evidence, neutral_status)
    answer["unexplained"] = _mean(natives, lambda native: native["unexplained"])
    answer["offset_per_yaw_rate_bias"] = _mean(natives, lambda native: native["offset_per_yaw_rate_bias"])
    answer["yaw_rate_bias"] = _last_known([drive.native["yaw_rate_bias"] for drive in drives])
    answer["standstill_lateral_acceleration"] = _last_known(
        [drive.native["standstill_lateral_acceleration"] for drive in drives]
    )
    return answer


def _estimate(value: float, sd: float, evidence: float, status: str, lean: float = 0.0) -> _core.OcEstimate:
    status_code = _core.STATUSES.index(status)
    return {"value": value, "standard_deviation": sd, "evidence": evidence, "status": status_code, "lean": lean}


def _mean(natives: Sequence[_core.OcAnswer], of: Callable[[_core.OcAnswer], float]) -> float:
    """Weighted by the seconds used."""
    return float(np.average([of(native) for native in natives], weights=[native["used"] for native in natives]))


def _averaged(estimates: Sequence[_core.OcEstimate]) -> _core.OcEstimate:
    """Of a quantity that loads change a little: the mean of those with the best status, with their scatter."""
    status = _best_status(estimates)
    best = [estimate for estimate in estimates if _core.status_of(estimate) == status]
    values = np.array([estimate["value"] for estimate in best])
    weights = np.array([estimate["standard_deviation"] for estimate in best]) ** -2.0
    mean = float(np.average(values, weights=weights))
    scatter = float(np.average((values - mean) ** 2, weights=weights)) / max(len(best) - 1, 1)
    sd = math.sqrt(1.0 / float(np.sum(weights)) + scatter)
    return _estimate(mean, sd, sum(estimate["evidence"] for estimate in best), status)


def _best_status(estimates: Sequence[_core.OcEstimate]) -> str:
    found = set(map(_core.status_of, estimates))
    return next(status for status in ("valid", "converging", "unobservable", "invalid") if status in found)


def _last_known(estimates: Sequence[_core.OcEstimate]) -> _core.OcEstimate:
    return next((each for each in reversed(estimates) if _core.status_of(each) != "unobservable"), estimates[-1])


def _with_times(answer: _core.OcAnswer, drives: Sequence[Drive]) -> _core.OcAnswer:
    """With the seconds of all drives, and with the accelerometer of the drive in which it moved most."""
    natives = [drive.native for drive in drives]
    banked = [native for native in natives if native["bank_time"] > 0.0]
    loaded_left_s = sum(native["loaded_left_s"] for native in natives)
    loaded_right_s = sum(native["loaded_right_s"] for native in natives)
    moved = max(natives, key=_moved_accelerometer)
    steered = max(natives, key=lambda native: native["steered_s"])
    answer["steered_s"], answer["steered_since_s"] = steered["steered_s"], steered["steered_since_s"]
    answer["steered_by"] = steered["steered_by"]
    answer["duration"] = sum(native["duration"] for native in natives)
    answer["used"] = sum(native["used"] for native in natives)
    answer["unused"] = sum(native["unused"] for native in natives)
    answer["rejected"] = np.sum([native["rejected"] for native in natives], axis=0).tolist()
    answer["bank_time"] = sum(native["bank_time"] for native in banked)
    answer["bank_low"] = moved["bank_low"]
    answer["bank_high"] = moved["bank_high"]
    answer["accelerometer_wanders"] = moved["accelerometer_wanders"]
    answer["accelerometer_runs_away"] = moved["accelerometer_runs_away"]
    answer["yaw_rate_bias_wheel_time"] = sum(native["yaw_rate_bias_wheel_time"] for native in natives)
    answer["yaw_rate_bias_alarm_time"] = sum(native["yaw_rate_bias_alarm_time"] for native in natives)
    answer["yaw_rate_bias_moved"] = max(native.get("yaw_rate_bias_moved", 0.0) for native in natives)
    answer["loaded_left_s"] = loaded_left_s
    answer["loaded_right_s"] = loaded_right_s
    answer["lacking_to_left"] = _lacking([(n["loaded_left_s"], n["lacking_to_left"]) for n in natives], loaded_left_s)
    answer["lacking_to_right"] = _lacking(
        [(n["loaded_right_s"], n["lacking_to_right"]) for n in natives], loaded_right_s
    )
    if banked:
        weights = [native["bank_time"] for native in banked]
        answer["bank_mean"] = float(np.average([native["bank_mean"] for native in banked], weights=weights))
    return answer


def _moved_accelerometer(native: _core.OcAnswer) -> tuple[int, int, float]:
    moved = native["bank_high"] - native["bank_low"]
    return native["accelerometer_runs_away"], native["accelerometer_wanders"], moved


def _lacking(loaded_and_lacking: Iterable[tuple[float, float]], loaded_s: float) -> float:
    """Seconds of lateral force to a side that all drives together lack, of `loaded_s` in all."""
    needed = min(loaded + lacking if lacking > 0.0 else 0.0 for loaded, lacking in loaded_and_lacking)
    return max(needed - loaded_s, 0.0)


def changes_of_all(together: Together) -> tuple[Change, ...]:
    """Those within the drives since the last one, on the clocks of their logs."""
    first, found = 0, []
    for drive in together.drives:
        found += [replace(change, drive=first + change.drive) for change in drive.changes]
        first += len(drive.logs)
    return tuple(found)


def with_zero(answer: Answer, model: Trucks) -> Answer:
    """The answer with what the truck's drives say of the sensor's zero."""
    zero, offsets = model.zero[0], model.offsets[0].tolist()
    if zero == "fixed" or answer.zero != "fixed":
        return answer
    found = (_differs_at_starts if zero == "relative" else zero_moves)(offsets)
    kept = (each for each in answer.findings if each.code != "steering_wheel_angle_offset")  # it says: calibrate
    return replace(answer, zero=zero, findings=(found, *kept))


def with_logs(answer: Answer, together: Together) -> Answer:
    """The answer on all drives with what only several can say: the change between two, their scatter, their zero."""
    model, value = together.model, answer.offset.value
    if model is None or value is None:
        return answer
    answer = replace(with_zero(answer, model), pull=_pull(model))
    if together.step is not None:
        later = next((c.offset_before_rad for c in answer.changes if c.kind != "bends"), value)
        change = _change(answer, later, together.step)
        before = [log for drive in together.before for log in drive.logs]
        changed = (_offset_changed if change.kind == "offset" else _moved)(change, before)
        answer = replace(answer, changes=(change, *answer.changes), findings=(changed, *answer.findings))
    findings = [each for each in answer.findings if each.code != "interval"]
    findings.append(_interval(model))
    if model.load_would_help[0] and answer.zero == "fixed":
        findings.append(_another_load())
    return replace(answer, findings=tuple(findings))


def _pull(model: Trucks) -> Pull:
    """The pull that the drives identify; its effect is what parts the offset from the one without it."""
    effect_deg = abs(float(model.offset[0] - model.less_pull[0])) / DEGREE
    return Pull(float(model.pull[0]), float(model.pull_sd[0]), effect_deg)


def _change(answer: Answer, offset: float, step: LogStep) -> Change:
    first = answer.drives[0]
    return Change(
        kind=kind_of_offset(step.size, step.sd),
        drive=0,
        log=first.log,
        time_s=float(first.columns["time_s"][0]),
        into_log_s=0.0,
        offset_before_rad=offset - step.size,
        offset_after_rad=offset,
        size_rad=step.size,
        sd_rad=step.sd,
    )


@finding("offset_changed", "warning", "deg")
def _offset_changed(found: Kind, change: Change, before: Sequence[Signals]) -> Finding:
    """The offset changed between two logs by more than load, ride height or wind explain."""
    return _between(found, change, before)


@finding("straight_ahead_moved", "info", "deg")
def _moved(found: Kind, change: Change, before: Sequence[Signals]) -> Finding:
    """The offset changed between two logs by no more than load, ride height or wind explain."""
    return _between(found, change, before)


def _between(found: Kind, change: Change, before: Sequence[Signals]) -> Finding:
    assert change.size_rad is not None and change.sd_rad is not None
    size = change.size_rad / DEGREE
    names = ", ".join(drive.log for drive in before)
    return found(
        f"between {before[-1].log} and {change.log} the straight-ahead offset changed by {size:+.1f}"
        f" ±{1.96 * change.sd_rad / DEGREE:.1f} deg, from {number(change.offset_before_rad, 1)} to"
        f" {number(change.offset_after_rad, 1)} deg. The reported offset uses only the logs from {change.log} on. If"
        " nobody worked on the truck, check the sensor and its mounting. For the offset before, run oncenter offset"
        f" with {names} only",
        size,
    )


@finding("zero_differs_at_starts", "warning")
def _differs_at_starts(found: Kind, offsets: Sequence[float]) -> Finding:
    """From four drives on: their offsets exclude each other, and nearly every one differs from the one before."""
    return found(
        f"the offset is another one in each drive: {listed(offsets)}. The zero of this steering wheel angle sensor "
        "changes at each start, so no stored correction can be right. The offset is that of the last drive"
    )


@finding("interval", "info", "deg")
def _interval(found: Kind, model: Trucks) -> Finding:
    """Several logs, whose model has an offset."""
    own_sd, whole_sd = float(model.spread_sd[0]), float(model.offset_sd[0])
    by_pull = math.sqrt(max(whole_sd**2 - own_sd**2, 0.0))
    whole, own, pull = (number(1.96 * each, 1 if each > 0.05 * DEGREE else 2) for each in (whole_sd, own_sd, by_pull))
    return found(
        f"uncertainty ±{whole} deg: ±{own} deg from the scatter of these logs, ±{pull} deg from a pull, which they"
        f" identify as {float(model.pull[0]):+.2f} ±{1.96 * float(model.pull_sd[0]):.2f} m/s^2",
        1.96 * whole_sd / DEGREE,
    )


@finding("another_load_would_help", "info")
def _another_load(found: Kind) -> Finding:
    """Several logs, and their gradients hardly differ."""
    return found(
        "the understeer gradients of the logs differ by less than 20 %, so the payloads are similar. Such logs hardly"
        " separate a pull from an accelerometer bias, so the offset is less certain. Add logs with another payload"
    )
