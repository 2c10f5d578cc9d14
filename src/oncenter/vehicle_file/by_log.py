"""Of the candidates of each signal, those that move in a log as the quantity does: the angle like yaw rate over speed,
the lateral acceleration like their product. The same relations give signs, and units that a file leaves open."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from oncenter.errors import OncenterError
from oncenter.files.log_formats import suffixes
from oncenter.read.apart import frames
from oncenter.read.frames import pgn_of
from oncenter.read.named import Named
from oncenter.read.units import factors
from oncenter.signals import SIGNALS, Signals, Source
from oncenter.vehicle_file.check import NEEDED
from oncenter.vehicle_file.proposals import NAMELESS, Proposal, nameless

Column = npt.NDArray[np.float64]

_ROUNDS_MAX = 5  # candidates of a signal that are read
_STEP_S = 0.1  # between the samples that are compared
_SPEED_MIN_M_S = 4.0
_SAMPLES_MIN = 100
_ALIKE = 0.6  # correlation from which two signals are of one motion
_NAMELESS_ALIKE = 0.9  # the same where the name says nothing
_EQUAL = 0.03  # of the correlation: the better name decides
_RATIO_TIMES_WHEELBASE_M = (20.0, 300.0)  # of the steering wheel angle over the curvature
_NEAR_ONE = (0.4, 2.5)  # of two readings of one quantity
_BENDS_MIN_RAD_S = 0.005  # standard deviation of the yaw rate of a drive that has bends


@dataclass(frozen=True)
class _Read:
    """A candidate with its samples, in SI by the unit and sign of its proposal."""

    proposal: Proposal
    values: Column

    def times(self, factor: float) -> _Read:
        return replace(self, values=self.values * factor)


def decided_by_log(
    log: Path,
    databases: Sequence[Path],
    proposed: Sequence[Proposal],
    there: Sequence[Named],
    progress: Callable[[float], None],
) -> tuple[list[Proposal], Signals, list[str]]:
    """The proposals whose names the log has, the best by motion first, and what else the log shows.

    Args:
        there: all names; where none fits the angle or the yaw rate, one that moves like it is proposed.

    Returns:
        The proposals, the drive as read by the first candidates, and notes for people.

    Raises:
        OncenterError: the log has none of the candidates, or it cannot be read.
    """
    drive, read = _candidates(log, databases, proposed, there, progress)
    for signal, candidates in list(read.items()):
        moving = [each for each in candidates if _moves(each.values)]
        read[signal] = candidates if signal in NEEDED and not moving else moving
    chosen = {
        signal: candidates[0]
        for signal, candidates in read.items()
        if candidates and candidates[0].proposal.rank < NAMELESS
    }
    notes: list[str] = []
    speed = [*read.get("vehicle_speed", []), *_mean_wheel_speed(read)]
    angles, rates = read.get("steering_wheel_angle", []), read.get("yaw_rate", [])
    best = _alike(angles, rates, speed)
    if angles and rates and speed and best is None:
        notes.append(
            f"{log.name} does not show which signals are right: it has no bends, or no candidate for the steering "
            "wheel angle moves like yaw rate over speed; check names and signs"
        )
    if best is not None:
        angle, rate, v, correlation = best
        rate = _in_known_unit(rate, read, v.values)
        rate = _with_true_sign(rate, angle, read, v.values, notes)
        angle = _signed(angle, rate.values / v.values, log)
        angle = _in_unit(angle, rate.values / v.values, _RATIO_TIMES_WHEELBASE_M)
        why = f"moves like yaw rate over speed in the log (correlation {abs(correlation):.2f})"
        chosen["steering_wheel_angle"] = _because(angle, why)
        chosen["yaw_rate"] = rate
        if v.proposal.signal == "vehicle_speed":
            chosen["vehicle_speed"] = v
        lateral = rate.values * v.values
        chosen.pop("lateral_acceleration", None)
        accelerations = read.get("lateral_acceleration", [])
        like = [each for each in accelerations if abs(_correlation(each.values, lateral)) > _ALIKE]
        if like:
            likest = max(like, key=lambda each: abs(_correlation(each.values, lateral)))
            chosen["lateral_acceleration"] = _in_unit(_signed(likest, lateral, log), lateral, _NEAR_ONE)
    by_signal = {each.signal: each for each in proposed}
    given = [each for each in proposed if each.signal not in SIGNALS]
    for signal in (signal for signal in SIGNALS if signal in chosen):
        given.append(_first(by_signal.get(signal), chosen[signal].proposal))
    return given, drive, notes


def _first(proposal: Proposal | None, chosen: Proposal) -> Proposal:
    """The proposal with the chosen candidate in the first place."""
    candidates = () if proposal is None else (proposal, *proposal.others)
    others = [each for each in candidates if each.named != chosen.named]
    ranked = [replace(each, rank=rank, others=()) for rank, each in enumerate(others, 2)]
    return replace(chosen, rank=1, others=tuple(ranked))


def _candidates(
    log: Path,
    databases: Sequence[Path],
    proposed: Sequence[Proposal],
    named: Sequence[Named],
    progress: Callable[[float], None],
) -> tuple[Signals, dict[str, list[_Read]]]:
    """Each candidate that the log has, all on one time base; reading stops at the first candidate of every signal if
    the log has only one of each."""
    import oncenter as oc

    always = {each.signal: each.signal_name() for each in proposed if each.signal not in SIGNALS}  # the time
    there = _messages_in(log, progress)
    in_log = {each.signal: _in_log(there, (each, *each.others)) for each in proposed if each.signal in SIGNALS}
    for signal in ("steering_wheel_angle", "yaw_rate"):
        if there is not None and not in_log.get(signal):
            in_log[signal] = nameless(
                signal, [each for each in named if each.frame >= 0 and _has_message(there, each.frame)]
            )
    read: dict[str, list[_Read]] = {}
    first: Signals | None = None
    grid: Column | None = None
    refused: OncenterError | None = None
    for place in range(_ROUNDS_MAX):
        of_round = [candidates[place] for candidates in in_log.values() if place < len(candidates)]
        if place and not of_round:
            break
        try:
            drive = oc.read(
                log,
                names={**always, **{each.signal: each.signal_name() for each in of_round}},
                dbc=databases,
                progress=progress,
            )
        except OncenterError as error:
            refused = refused or error
            continue
        time = drive.columns["time_s"]
        if first is None or grid is None:
            first, grid = drive, time[:: max(1, round(_STEP_S * drive.rate_hz))]
        for each in of_round:
            if each.signal in drive.sources and is_named(drive.sources[each.signal], each.named.name):
                values = drive.columns[SIGNALS[each.signal].column]
                read.setdefault(each.signal, []).append(_Read(replace(each, others=()), _on(grid, time, values)))
    if first is None:
        assert refused is not None
        raise refused
    return first, read


def _messages_in(log: Path, progress: Callable[[float], None]) -> set[int] | None:
    """The identifiers in a log of frames, with bit 31 for 29 bits; None for another log."""
    if not log.name.lower().endswith(suffixes("frames")):
        return None
    there: set[int] = set()
    for part in frames(log, []):
        progress(0.0)
        marked = part.identifier.astype(np.int64) | part.extended.astype(np.int64) << 31
        there.update(np.unique(marked).tolist())
    return there


def _in_log(there: Collection[int] | None, candidates: Sequence[Proposal]) -> list[Proposal]:
    """Those that the log may have, its own columns and channels first where its frames are unknown."""
    if there is None:
        return sorted(candidates, key=lambda each: each.named.frame >= 0)
    return [each for each in candidates if _has_message(there, each.named.frame)]


def _has_message(there: Collection[int], frame: int) -> bool:
    """Whether the log has the message, or for 29 bits one of its parameter group."""
    return frame < 0 or frame in there or (frame >> 31 == 1 and _group(frame) in {_group(each) for each in there})


def _group(frame: int) -> int:
    return int(pgn_of(np.array([frame & 0x1FFFFFFF], np.uint32))[0]) if frame >> 31 else -1


def is_named(source: Source, name: str) -> bool:
    """Whether it is the source of this name in `[signals]`, and not another one of the log."""
    return name in (source.place or "") or name.rpartition(".")[2] in source.description


def _on(grid: Column, time: Column, values: Column) -> Column:
    there = np.isfinite(values)
    if np.count_nonzero(there) < 2:
        return np.full(len(grid), np.nan)
    return np.interp(grid, time[there], values[there], left=np.nan, right=np.nan)


def _mean_wheel_speed(read: Mapping[str, Sequence[_Read]]) -> Iterator[_Read]:
    for axle in ("rear", "front"):
        sides = [read.get(f"wheel_speed_{axle}_{side}", []) for side in ("left", "right")]
        if all(sides):
            yield _Read(sides[0][0].proposal, 0.5 * (sides[0][0].values + sides[1][0].values))


def _alike(
    angles: Sequence[_Read], rates: Sequence[_Read], speeds: Sequence[_Read]
) -> tuple[_Read, _Read, _Read, float] | None:
    """Angle, yaw rate and speed that fit together best; of equally good ones those with the best names."""
    found = []
    for angle, rate, speed in itertools.product(angles, rates, speeds):
        if _has_bends(rate, speed):
            moving = replace(speed, values=np.where(speed.values > _SPEED_MIN_M_S, speed.values, np.nan))
            correlation = _correlation(angle.values, rate.values / moving.values)
            rank = sum(each.proposal.rank for each in (angle, rate, speed))
            if rank < NAMELESS or abs(correlation) > _NAMELESS_ALIKE:
                found.append((abs(correlation), rank, (angle, rate, moving, correlation)))
    best = max((size for size, *_ in found), default=0.0)
    if not best > _ALIKE:
        return None
    return min((each for each in found if each[0] > best - _EQUAL), key=lambda each: (each[1], -each[0]))[2]


def _moves(values: Column) -> bool:
    """Whether a signal has more than one value."""
    there = values[np.isfinite(values)]
    return len(there) > 0 and bool(np.ptp(there) > 0.0)


def _has_bends(rate: _Read, speed: _Read) -> bool:
    moving = rate.values[(speed.values > _SPEED_MIN_M_S) & np.isfinite(rate.values)]
    return len(moving) >= _SAMPLES_MIN and float(np.std(moving)) > _BENDS_MIN_RAD_S


def _correlation(one: Column, other: Column) -> float:
    there = np.isfinite(one) & np.isfinite(other)
    if np.count_nonzero(there) < _SAMPLES_MIN:
        return 0.0
    a, b = one[there] - np.median(one[there]), other[there] - np.median(other[there])
    size = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    return float(np.sum(a * b)) / size if size > 0.0 else 0.0


def _slope(one: Column, other: Column) -> float:
    """By how much `one` changes with `other`."""
    there = np.isfinite(one) & np.isfinite(other)
    a, b = one[there] - np.median(one[there]), other[there] - np.median(other[there])
    return float(np.sum(a * b) / np.sum(b * b))


def _because(read: _Read, why: str) -> _Read:
    return replace(read, proposal=replace(read.proposal, reasons=(*read.proposal.reasons, why)))


def _signed(read: _Read, like: Column, log: Path) -> _Read:
    """With the sign that its motion has."""
    if _correlation(read.values, like) >= 0.0:
        return read
    turned = replace(read.proposal, sign=-read.proposal.sign)
    return _because(replace(read.times(-1.0), proposal=turned), f"sign by {log.name}")


def _in_unit(read: _Read, like: Column, usual: tuple[float, float]) -> _Read:
    """In the unit by which its size is usual, where the file leaves the unit open."""
    if read.proposal.unit is not None or not np.isfinite(like).any():
        return read
    known = factors(read.proposal.signal)
    now = known[read.proposal.assumed]
    slope = abs(_slope(read.values, like))
    fitting = [unit for unit, factor in known.items() if usual[0] <= slope * factor / now <= usual[1]]
    if not fitting or read.proposal.assumed in fitting:
        return read
    in_unit = replace(read.proposal, assumed=fitting[0])
    return replace(read.times(known[fitting[0]] / now), proposal=in_unit)


def _in_known_unit(rate: _Read, read: Mapping[str, Sequence[_Read]], speed: Column) -> _Read:
    """A yaw rate without a unit, in the one that fits the lateral acceleration or the wheel speeds."""
    for each in read.get("lateral_acceleration", []):
        if each.proposal.unit is not None and abs(_correlation(each.values, rate.values * speed)) > _ALIKE:
            return _in_unit(rate, each.values / speed, _NEAR_ONE)
    for difference in _wheel_differences(read):
        if abs(_correlation(difference, rate.values)) > _ALIKE:
            return _in_unit(rate, difference / _TRACK_M, _NEAR_ONE)
    return rate


_TRACK_M = 1.9


def _wheel_differences(read: Mapping[str, Sequence[_Read]]) -> Iterator[Column]:
    """Right minus left, positive in a left turn."""
    for axle in ("rear", "front"):
        left, right = (read.get(f"wheel_speed_{axle}_{side}", []) for side in ("left", "right"))
        if left and right:
            yield right[0].values - left[0].values


def _with_true_sign(
    rate: _Read, angle: _Read, read: Mapping[str, Sequence[_Read]], speed: Column, notes: list[str]
) -> _Read:
    """The yaw rate, positive to the left: by wheel speeds, else by the majority of angle, yaw rate and acceleration."""
    turned = replace(rate.times(-1.0), proposal=replace(rate.proposal, sign=-rate.proposal.sign))
    for difference in _wheel_differences(read):
        correlation = _correlation(difference, rate.values)
        if abs(correlation) > _ALIKE:
            return rate if correlation > 0.0 else _because(turned, "sign by the wheel speeds in the log")
    of_angle = _correlation(angle.values, rate.values / speed)
    sides = [_correlation(each.values, rate.values * speed) for each in read.get("lateral_acceleration", [])[:1]]
    if of_angle < 0.0 and sides and sides[0] < -_ALIKE:
        return _because(turned, "sign by the angle and the lateral acceleration in the log")
    if of_angle < 0.0 and not (sides and sides[0] > _ALIKE):
        notes.append(
            "steering wheel angle and yaw rate have opposite signs in the log, and it does not show which is right: "
            "the yaw rate is taken as it is; check both"
        )
    return rate
