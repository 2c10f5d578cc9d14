"""Several logs of one truck: each drive is a row of evidence, and the truck's model (oncenter.truck) combines them.

The combined answer is an oc_answer like that of one drive, so that the findings and words of one drive follow from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from oncenter import _core
from oncenter.estimates.by_priors import OffsetBy
from oncenter.estimates.cause import Pull
from oncenter.estimates.changes import Change, kind_of_offset
from oncenter.estimates.estimate import number
from oncenter.findings import Finding, Kind, finding
from oncenter.offset.answer import Answer
from oncenter.offset.joint_findings import listed, zero_moves
from oncenter.read.whole_turns import is_relative
from oncenter.signals import DEGREE, Signals
from oncenter.truck import now
from oncenter.truck.events import Event, is_former
from oncenter.truck.now import Truck, truck_now
from oncenter.truck.priors import priors_of
from oncenter.truck.row import Row


@dataclass(frozen=True)
class Drive:
    """A drive: its row; of one that was answered now its logs, the core's answer on it, and the changes in it.
    `is_part`: the row has more logs, which were answered before."""

    row: Row
    logs: tuple[Signals, ...] = ()
    native: _core.OcAnswer | None = None
    changes: tuple[Change, ...] = ()
    is_part: bool = False


@dataclass(frozen=True)
class Together:
    """The drives since the last change of the offset, those before it, the change between them, and the truck after
    all usable drives; None where there are fewer than two."""

    drives: tuple[Drive, ...]
    native: _core.OcAnswer
    before: tuple[Drive, ...]
    step: now.Change | None
    truck: Truck | None
    every: tuple[Drive, ...] = ()
    rows: tuple[Row, ...] = ()  # usable ones
    events: tuple[Event, ...] = ()

    def by(self, params: Mapping[str, float], layout_sd: float) -> OffsetBy:
        """The offset of the truck by other priors; `layout_sd`, rad, by unknown axles."""
        other = truck_now(self.rows, self.events, priors_of(params))
        middle, half_width = 0.5 * sum(other.whole), 0.5 * (other.whole[1] - other.whole[0])
        half_width = math.hypot(half_width, 1.96 * layout_sd)
        return OffsetBy(other.offset, other.own, (middle - half_width, middle + half_width))


def combined(given: Sequence[Drive], params: Mapping[str, float], events: Sequence[Event] = ()) -> Together:
    """All drives of a truck by the joint method; some of them were answered now, and stand last. Drives without a date
    keep their places."""
    present = [drive for drive in given if not is_former(drive.row.start_s, events)]
    drives = present if any(drive.native is not None for drive in present) else list(given)
    if all(math.isfinite(drive.row.start_s) for drive in drives):
        drives.sort(key=lambda drive: drive.row.start_s)
    answered = tuple(drive for drive in drives if drive.native is not None)
    last = answered[-1]
    assert last.native is not None
    if any(is_relative(log) for log in last.logs):
        return Together((last,), last.native, tuple(drives[:-1]), None, None, answered)
    counted = now.usable((drive.row for drive in drives), events)
    usable = [k for k, drive in enumerate(drives) if any(drive.row is row for row in counted)]
    if len(usable) < 2 and all(drives[k].native is not None and not drives[k].is_part for k in usable):
        together = _by_one(answered, [drives[k] for k in usable if drives[k].native is not None])
        return replace(together, every=answered)
    rows = tuple(drives[k].row for k in usable)
    truck = truck_now(rows, events, priors_of(params))
    since = usable[truck.since] if truck.since else 0
    native = _as_one_drive(answered, [drives[k] for k in usable if k >= since], truck, params)
    step = next((change for change in truck.changes if change.at == truck.since and change.kind != "play"), None)
    return Together(
        drives=tuple(drives[since:]),
        native=native,
        before=tuple(drives[:since]),
        step=step if truck.zero == "fixed" and truck.since else None,
        truck=truck,
        every=answered,
        rows=rows,
        events=tuple(events),
    )


def _by_one(drives: Sequence[Drive], usable: Sequence[Drive]) -> Together:
    """Fewer than two drives have an offset, each answered now: that of the one, else of the longest; with the time of
    all."""
    natives = [drive.native for drive in drives if drive.native is not None]
    one = usable[0].native if usable else max(natives, key=lambda native: native["used"])
    assert one is not None
    return Together(tuple(drives), _with_times(one.copy(), natives), (), None, None)


def _as_one_drive(
    answered: Sequence[Drive], usable: Sequence[Drive], truck: Truck, params: Mapping[str, float]
) -> _core.OcAnswer:
    """The oc_answer of the truck's last drive, with what all drives since the last change say of the truck."""
    every = [drive.native for drive in answered if drive.native is not None]
    natives = [drive.native for drive in usable if drive.native is not None] or every[-1:]
    answer = _with_times(every[-1].copy(), every)
    own_sd, whole_sd = truck.own_sd, truck.whole_sd
    is_invalid = _core.status_of(answer["offset"]) == "invalid"
    status = "invalid" if is_invalid else "valid" if truck.is_valid(params) else "converging"
    answer["offset"] = _estimate(truck.offset, whole_sd, truck.evidence_s, status, truck.lean)
    answer["offset_temporary"] = truck.offset
    answer["offset_parts"] = {
        "drive_sd": own_sd,
        "pull_sd": math.sqrt(max(whole_sd**2 - own_sd**2, 0.0)),
        "wind_sd": 0.0,
        "set_up_sd": 0.0,
        "per_acceleration": _mean(natives, lambda native: native["offset_parts"]["per_acceleration"]),
    }
    answer["understeer_gradient"] = _averaged([native["understeer_gradient"] for native in natives])
    answer["equivalent_wheelbase"] = _averaged([native["equivalent_wheelbase"] for native in natives])
    is_loose = 1.96 * truck.play_sd > params["offset_half_width_max_rad"]
    answer["backlash"] = _estimate(
        truck.play, truck.play_sd, truck.evidence_s, "converging" if is_loose or not truck.has_flanks else "valid"
    )
    neutral_status = _best_status([native["unloading_acceleration"] for native in natives])
    if params["use_accelerometer"]:
        answer["unloading_acceleration"] = _estimate(truck.neutral, truck.neutral_sd, truck.evidence_s, neutral_status)
    answer["unexplained"] = _mean(natives, lambda native: native["unexplained"])
    answer["offset_per_yaw_rate_bias"] = _mean(natives, lambda native: native["offset_per_yaw_rate_bias"])
    answer["yaw_rate_bias"] = _last_known([native["yaw_rate_bias"] for native in every])
    answer["standstill_lateral_acceleration"] = _last_known(
        [native["standstill_lateral_acceleration"] for native in every]
    )
    return answer


def _estimate(value: float, sd: float, evidence: float, status: str, lean: float = 0.0) -> _core.OcEstimate:
    status_code = _core.STATUSES.index(status)
    return {"value": value, "standard_deviation": sd, "evidence": evidence, "status": status_code, "lean": lean}


def _mean(natives: Sequence[_core.OcAnswer], of: Callable[[_core.OcAnswer], float]) -> float:
    """Weighted by the seconds used, of which a single drive may have none."""
    weights = [max(native["used"], 1e-9) for native in natives]
    return float(np.average([of(native) for native in natives], weights=weights))


def _averaged(estimates: Sequence[_core.OcEstimate]) -> _core.OcEstimate:
    """Of a quantity that loads change a little: the mean of those with the best status, with their scatter."""
    status = _best_status(estimates)
    if status == "unobservable":
        return estimates[-1]
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


def _with_times(answer: _core.OcAnswer, natives: Sequence[_core.OcAnswer]) -> _core.OcAnswer:
    """With the seconds of all drives, and with the accelerometer of the drive in which it moved most."""
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


def with_logs(answer: Answer, together: Together) -> Answer:
    """The answer on all drives with what only several can say: the change between two, their scatter, their zero."""
    truck, value = together.truck, answer.offset.value
    if truck is None or value is None:
        return answer
    answer = replace(_with_zero(answer, truck), pull=Pull(truck.pull, truck.pull_sd, truck.pull_effect / DEGREE))
    if together.step is not None:
        later = next((c.offset_before_rad for c in answer.changes if c.kind != "bends"), value)
        change = _change(together.drives[0], later, together.step)
        before = [log for drive in together.before for log in drive.row.logs]
        changed = (_offset_changed if change.kind == "offset" else _moved)(change, before)
        answer = replace(answer, changes=(change, *answer.changes), findings=(changed, *answer.findings))
    of_play = next((change for change in reversed(truck.changes) if change.kind == "play"), None)
    if of_play is not None:
        last, first = (together.rows[at].logs for at in (of_play.at - 1, of_play.at))
        answer = replace(answer, findings=(play_changed(of_play, last, first), *answer.findings))
    if truck.is_ambiguous and answer.zero == "fixed":
        answer = replace(answer, findings=(drives_differ(truck.offsets.tolist()), *answer.findings))
    findings = [each for each in answer.findings if each.code != "interval"]
    findings.append(_interval(truck))
    if truck.load_would_help and len(together.rows) > 1 and answer.zero == "fixed":
        findings.append(_another_load())
    return replace(answer, findings=tuple(findings))


def _with_zero(answer: Answer, truck: Truck) -> Answer:
    """The answer with what the truck's drives say of the sensor's zero."""
    if truck.zero == "fixed" or answer.zero != "fixed":
        return answer
    found = (_differs_at_starts if truck.zero == "relative" else zero_moves)(truck.offsets.tolist())
    kept = (each for each in answer.findings if each.code != "steering_wheel_angle_offset")  # it says: calibrate
    return replace(answer, zero=truck.zero, findings=(found, *kept))


def _change(first: Drive, offset: float, step: now.Change) -> Change:
    return Change(
        kind=kind_of_offset(step.size, step.sd),
        drive=0,
        log=first.row.logs[0] if first.row.logs else "",
        time_s=float(first.logs[0].columns["time_s"][0]) if first.logs else first.row.start_s,
        into_log_s=0.0,
        offset_before_rad=offset - step.size,
        offset_after_rad=offset,
        size_rad=step.size,
        sd_rad=step.sd,
    )


@finding("offset_changed", "warning", "deg")
def _offset_changed(found: Kind, change: Change, before: Sequence[str]) -> Finding:
    """The offset changed between two logs by more than load, ride height or wind explain."""
    return _between(found, change, before)


@finding("straight_ahead_moved", "info", "deg")
def _moved(found: Kind, change: Change, before: Sequence[str]) -> Finding:
    """The offset changed between two logs by no more than load, ride height or wind explain."""
    return _between(found, change, before)


def _between(found: Kind, change: Change, before: Sequence[str]) -> Finding:
    assert change.size_rad is not None and change.sd_rad is not None
    size = change.size_rad / DEGREE
    names = ", ".join(before)
    return found(
        f"between {before[-1]} and {change.log} the straight-ahead offset changed by {size:+.1f}"
        f" ±{1.96 * change.sd_rad / DEGREE:.1f} deg, from {number(change.offset_before_rad, 1)} to"
        f" {number(change.offset_after_rad, 1)} deg. The reported offset uses only the logs from {change.log} on. If"
        " nobody worked on the truck, check the sensor and its mounting. For the offset before, run oncenter offset"
        f" with {names} only",
        size,
    )


@finding("drives_differ", "warning")
def drives_differ(found: Kind, offsets: Sequence[float]) -> Finding:
    """Several offsets are likely, such as when the last drive alone has another one."""
    return found(
        f"the offset is not the same in all drives: {listed(offsets)}. The sensor may have moved or been calibrated, "
        "or one drive may be wrong, so the offset is not identified. Drive once more: the next drive decides. If the "
        "truck was calibrated or repaired, say so with --event"
    )


@finding("play_changed", "warning", "deg")
def play_changed(found: Kind, change: now.Change, before: Sequence[str], after: Sequence[str]) -> Finding:
    """The free play changed between two drives."""
    return found(
        f"between {', '.join(before)} and {', '.join(after)} the free play changed from {number(change.before, 1)} to"
        f" {number(change.after, 1)} deg. The reported play is that of the drives since then; the offset is not"
        " affected. If nobody repaired the steering, check it; if it was repaired, say so with --event repaired@DATE",
        change.size / DEGREE,
    )


@finding("zero_differs_at_starts", "warning")
def _differs_at_starts(found: Kind, offsets: Sequence[float]) -> Finding:
    """Histories with a relative zero have more than 90 % of the weight."""
    return found(
        f"the offset is another one in each drive: {listed(offsets)}. The zero of this steering wheel angle sensor "
        "changes at each start, so no stored correction can be right. The offset is that of the last drive"
    )


@finding("interval", "info", "deg")
def _interval(found: Kind, truck: Truck) -> Finding:
    """Several logs, whose model has an offset."""
    own_sd, whole_sd = truck.own_sd, (truck.whole[1] - truck.whole[0]) / (2.0 * 1.96)
    by_pull = math.sqrt(max(whole_sd**2 - own_sd**2, 0.0))
    whole, own, pull = (number(1.96 * each, 1 if each > 0.05 * DEGREE else 2) for each in (whole_sd, own_sd, by_pull))
    return found(
        f"uncertainty ±{whole} deg: ±{own} deg from the scatter of these logs, ±{pull} deg from a pull, which they"
        f" identify as {truck.pull:+.2f} ±{1.96 * truck.pull_sd:.2f} m/s^2",
        1.96 * whole_sd / DEGREE,
    )


@finding("another_load_would_help", "info")
def _another_load(found: Kind) -> Finding:
    """Several logs, and their gradients hardly differ."""
    return found(
        "the understeer gradients of the logs differ by less than 20 %, so the payloads are similar. Such logs hardly"
        " separate a pull from an accelerometer bias, so the offset is less certain. Add logs with another payload"
    )
