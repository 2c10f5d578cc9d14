"""Several logs of one truck: whether the offset changed between them, and their common estimate.

Each log is answered alone, and the truck's model (oncenter.truck) combines their summaries. Fewer than four logs do not
separate a step from one wrong drive; then valid neighbours are compared in pairs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from oncenter import _core
from oncenter.estimates.changes import Change, kind_of_offset
from oncenter.estimates.estimate import Estimate, number
from oncenter.findings import Finding, Kind, finding
from oncenter.offset.answer import Answer
from oncenter.signals import DEGREE, Signals
from oncenter.truck.drives import Summary, is_usable, summary_of, together
from oncenter.truck.model import Trucks, learn
from oncenter.truck.priors import Priors, priors_of
from oncenter.vehicle import Vehicle

_MODEL_FROM = 4  # logs: two on either side of a step
_STEP_SDS = 6.0  # of two valid logs: 2 of 2,064 neighbours of bench/trucks.py's months scatter by more
_STEP_MIN_RAD = 1.0 * DEGREE
_BEGIN_S, _DRIVES_M_S = 120.0, 8.0  # of driving in a log: a change found in this time may be from before the log
_AGREES_SDS = 3.0  # between the offset of all logs and the model's


@dataclass(frozen=True)
class LogStep:
    """The offset changed before log `at`, by `size` with standard deviation `sd`, rad."""

    at: int
    size: float
    sd: float


@dataclass(frozen=True)
class Together:
    """All steps in order of time, and the truck's model of the usable logs; None where there are too few."""

    steps: tuple[LogStep, ...]
    model: Trucks | None

    @property
    def since(self) -> int:
        """The first log of the present offset."""
        return self.steps[-1].at if self.steps else 0


def across(natives: Sequence[_core.OcAnswer], vehicle: Vehicle, params: Mapping[str, float]) -> Together:
    """The steps and the truck's model from each log's oc_answer by the joint method, in order of time."""
    priors = priors_of(params)
    summaries = [summary_of(native, vehicle, params) for native in natives]
    statuses = [_core.status_of(native["offset"]) for native in natives]
    usable = [(k, one) for k, one in enumerate(summaries) if is_usable(statuses[k], one.gradient)]
    if len(usable) < _MODEL_FROM:
        return Together(tuple(_by_pairs(natives, usable, priors)), None)
    model = learn(together([[summary for _, summary in usable]]), priors)
    steps = [LogStep(usable[step.at][0], step.size, step.sd) for step in model.steps]
    return Together(tuple(steps), model)


def without_steps_within(logs: Together, changes: Sequence[Change], drives: Sequence[Signals]) -> Together:
    """The logs less a step before a log in whose middle the run over all found the same change: the change is there. A
    change of another size or sign is that run's first reading of the step, which looks like the play at first."""

    def came_within(step: LogStep) -> bool:
        return any(
            change.drive == step.at
            and change.size_rad is not None
            and 0.5 < change.size_rad / step.size < 2.0
            and _driven_s(drives[step.at], change.into_log_s) > _BEGIN_S
            for change in changes
        )

    return replace(logs, steps=tuple(step for step in logs.steps if not came_within(step)))


def _driven_s(drive: Signals, until_s: float) -> float:
    """Seconds of driving since the begin of the log."""
    time, speed = drive.columns["time_s"], drive.columns["vehicle_speed_m_s"]
    stands = speed <= _DRIVES_M_S  # False where the speed is not available
    return float(((time - time[0] < until_s) & ~stands).sum()) / drive.rate_hz


def _by_pairs(
    natives: Sequence[_core.OcAnswer], usable: Sequence[tuple[int, Summary]], priors: Priors
) -> list[LogStep]:
    valid = [(k, one) for k, one in usable if _core.status_of(natives[k]["offset"]) == "valid"]
    steps = []
    for (_, before), (k, after) in pairwise(valid):
        size = after.offset - before.offset
        by_load = after.ratio * (after.gradient - before.gradient) * priors.pull_sd_m_s2
        noise = math.sqrt(2.0) * priors.offset_noise_sd_rad
        sd = math.hypot(before.offset_sd, after.offset_sd, by_load, noise)
        if abs(size) > max(_STEP_MIN_RAD, _STEP_SDS * sd):
            steps.append(LogStep(k, size, sd))
    return steps


def with_logs(answer: Answer, logs: Together, before: Sequence[Signals]) -> Answer:
    """The answer of the logs since the last step, narrowed by the truck's model of all logs.

    Args:
        answer: of the logs since the last step.
        logs: of all.
        before: the logs before it.
    """
    answer = _narrowed(answer, logs)
    if not logs.steps or answer.offset.value is None:
        return answer
    later = next((c.offset_before_rad for c in answer.changes if c.kind != "bends"), answer.offset.value)
    change = _change(answer, later, logs.steps[-1])
    changed = (_offset_changed if change.kind == "offset" else _moved)(change, before)
    return replace(answer, changes=(change, *answer.changes), findings=(changed, *answer.findings))


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


def _narrowed(answer: Answer, logs: Together) -> Answer:
    """The answer with the truck's offset where its interval is narrower: different loads or many roads separate a
    pull from the accelerometer bias. Not where the run over the logs found a change that is not in the model: with few
    logs since then, the model may treat the new offset as an outlier."""
    model, offset, drive_rad = logs.model, answer.offset, answer.offset_half_width_rad
    changed = any(change.kind != "bends" for change in answer.changes)
    if model is None or changed or offset.value is None or offset.ci95 is None or drive_rad is None:
        return answer
    value, sd = float(model.offset[0]), float(model.offset_sd[0])
    half_width = 0.5 * (offset.ci95[1] - offset.ci95[0])
    apart = abs(value - 0.5 * (offset.ci95[0] + offset.ci95[1]))
    agrees = apart < _AGREES_SDS * math.hypot(sd, half_width / 1.96)
    if 1.96 * sd > half_width or not agrees or offset.status == "invalid" or not answer.params["use_accelerometer"]:
        return answer
    drive_sd = min(float(model.spread_sd[0]), sd)
    left = math.sqrt(sd**2 - drive_sd**2)
    pull = [
        replace(c, sd_rad=left, sd_m_s2=float(model.pull_sd[0])) for c in answer.not_identifiable if c.cause == "pull"
    ]
    findings = [each for each in answer.findings if each.code != "interval"]
    findings.append(_interval(sd, drive_sd, left, float(model.pull_sd[0])))
    if model.load_would_help[0]:
        findings.append(_another_load())
    return replace(
        answer,
        offset=Estimate(value, (value - 1.96 * sd, value + 1.96 * sd), offset.status, offset.unit, offset.evidence_s),
        offset_ci95_drive=(value - 1.96 * drive_sd, value + 1.96 * drive_sd),
        not_identifiable=tuple(pull),
        findings=tuple(findings),
    )


@finding("interval", "info", "deg")
def _interval(found: Kind, sd: float, drive_sd: float, pull: float, pull_sd_m_s2: float) -> Finding:
    whole, own, by_pull = (number(1.96 * each, 1 if each > 0.05 * DEGREE else 2) for each in (sd, drive_sd, pull))
    return found(
        f"uncertainty ±{whole} deg: ±{own} deg from the scatter of these logs, ±{by_pull} deg from a pull, which they"
        f" identify to ±{1.96 * pull_sd_m_s2:.2f} m/s^2",
        1.96 * sd / DEGREE,
    )


@finding("another_load_would_help", "info")
def _another_load(found: Kind) -> Finding:
    """Several logs, and their gradients hardly differ."""
    return found(
        "the understeer gradients of the logs differ by less than 20 %, so the payloads are similar. Such logs hardly"
        " separate a pull from an accelerometer bias, so the offset is less certain. Add logs with another payload"
    )
