"""Reads the logs of a command line. Of several logs of a truck, those that cannot be read are named and left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.cli.options import progress_bar
from oncenter.cli.standard_input import STANDARD_INPUT, as_file
from oncenter.errors import LOG_CANNOT_BE_ANSWERED, WRONG_USAGE, OncenterError
from oncenter.files.own_file import NOT_A_LOG
from oncenter.findings import Finding, Kind, finding
from oncenter.utc import EPOCH_S

if TYPE_CHECKING:
    from oncenter.cli.places import Places
    from oncenter.signals import Signals
    from oncenter.truck.events import Event
    from oncenter.vehicle import Vehicle

_IN_COMMON = 0.5  # of the shorter log: files of one drive begin and end together, or one has parts of it
_ANGLE = ("steering_wheel_angle",)


@dataclass(frozen=True)
class _Log:
    """A drive and its log."""

    path: Path
    drive: Signals


def read_log(log: Path, truck: Vehicle | None, dbc: Sequence[Path], take: Mapping[str, str]) -> Signals:
    """One log; `-` is standard input.

    Raises:
        OncenterError: as `oncenter.read`.
    """
    with as_file(log) as file:
        return _read(log, file, truck, dbc, take)


def read_logs(
    places: Places,
    truck: Vehicle,
    dbc: Sequence[Path],
    take: Mapping[str, str],
    wanted: Sequence[str] = _ANGLE,
    join: bool = False,
    events: Sequence[Event] = (),
) -> tuple[list[Signals], list[Finding]]:
    """Drives of one truck, and findings on logs that were left out. Drives of a folder are in order of their start
    times, or of their names if a log has no start time.

    Args:
        wanted: signals without which one of several logs is left out.
        join: puts logs that overlap in time together: they are files of one drive.
        events: what a person states of the truck.

    Raises:
        OncenterError: a single log cannot be read, or none of several; two logs are of different trucks
            ("different_trucks"); or the usage is wrong.
    """
    from oncenter.offset.inputs import refuse_two_trucks

    logs: list[_Log] = []
    refusals = list(places.unlisted)
    are_several = len(places.logs) > 1
    for path in places.logs:
        try:
            with as_file(path) as file:
                logs.append(_Log(path, _read(path, file, truck, dbc, take)))
        except OncenterError as error:
            if not are_several or error.exit_code != LOG_CANNOT_BE_ANSWERED:
                raise
            refusals.append(error)
            continue
        refuse_two_trucks([log.drive for log in logs], events)  # before the next long log is read
    if join:
        groups = _at_one_time(logs)
        if len(groups) == len(logs) > 1:
            raise OncenterError(
                f"--join: none of the {len(logs)} logs overlap in time, so none are files of one drive: check their "
                "clocks, or leave the option out",
                code="no_common_time",
                exit_code=WRONG_USAGE,
            )
        logs = [_joined(together, truck, dbc, take) for together in groups]
    in_order = _by_start(logs) if places.has_folder else logs
    drives, incomplete = _complete([log.drive for log in in_order], wanted, truck)
    refusals += incomplete
    if not drives:
        reasons = "; ".join(str(error) for error in refusals[:3])
        raise OncenterError(
            f"none of {len(refusals)} logs can be used: {reasons}", code=refusals[0].code, needs=refusals[0].needs
        )
    return drives, [*_left_out(refusals), *_no_logs(refusals), *_given_twice(places.twice), *_overlaps(drives)]


def _read(log: Path, file: Path, truck: Vehicle | None, dbc: Sequence[Path], take: Mapping[str, str]) -> Signals:
    from oncenter.read import read

    with progress_bar(f"reading {file.name}", file) as progress:
        drive = read(file, vehicle=truck, dbc=dbc, take=take, progress=progress)
    if log != STANDARD_INPUT:
        return drive
    return drive.replaced(log="-")


def _at_one_time(logs: Sequence[_Log]) -> list[list[_Log]]:
    """Groups of logs that overlap each other for most of the shorter one, in the order of their first ones."""
    groups: list[list[_Log]] = []
    for log in sorted(logs, key=lambda log: -log.drive.duration_s):
        own = next((group for group in groups if any(_overlap(log.drive, each.drive) for each in group)), None)
        if own is None or log.path == STANDARD_INPUT:
            groups.append([log])
        else:
            own.append(log)
    place = {log.path: number for number, log in enumerate(logs)}
    groups = [sorted(group, key=lambda log: place[log.path]) for group in groups]
    return sorted(groups, key=lambda group: place[group[0].path])


def _overlap(one: Signals, other: Signals) -> bool:
    """Whether two logs have most of the shorter one's time in common."""
    (begin, end), (other_begin, other_end) = _span(one), _span(other)
    shorter = min(end - begin, other_end - other_begin)
    return min(end, other_end) - max(begin, other_begin) > _IN_COMMON * shorter


def _span(drive: Signals) -> tuple[float, float]:
    first, last = float(drive.columns["time_s"][0]), float(drive.columns["time_s"][-1])
    begin = first if drive.begin_s is None else drive.begin_s
    return begin, begin + last - first


def _joined(together: Sequence[_Log], truck: Vehicle, dbc: Sequence[Path], take: Mapping[str, str]) -> _Log:
    if len(together) == 1:
        return together[0]
    from oncenter.read import read_joined

    paths = [log.path for log in together]
    with progress_bar(f"reading {len(paths)} files together", *paths) as progress:
        return _Log(paths[0], read_joined(paths, truck, dbc, take, progress))


def _by_start(logs: Sequence[_Log]) -> list[_Log]:
    starts = [(log.drive.begin_s, place) for place, log in enumerate(logs)]
    known = [(start, place) for start, place in starts if start is not None]
    return [logs[place] for _, place in sorted(known)] if len(known) == len(logs) else list(logs)


def _complete(
    drives: list[Signals], wanted: Sequence[str], truck: Vehicle
) -> tuple[list[Signals], list[OncenterError]]:
    """Of several drives those with all wanted signals, and errors for the others. If no drive has all of them, those
    with an angle: the estimator then names the method that works without the missing signals.

    Raises:
        OncenterError: "missing_signal": no drive has all of them, and two overlap in time.
    """
    if len(drives) < 2:
        return drives, []
    complete, refusals = _with_all(drives, wanted, truck)
    if not complete and any(_overlap(one, other) for one, other in combinations(drives, 2)):
        raise refusals[0]
    return (complete, refusals) if complete else _with_all(drives, _ANGLE, truck)


def _with_all(
    drives: Sequence[Signals], wanted: Sequence[str], truck: Vehicle
) -> tuple[list[Signals], list[OncenterError]]:
    from oncenter.read import require

    complete, refusals = [], []
    for drive in drives:
        try:
            require(drive, wanted, truck)
            complete.append(drive)
        except OncenterError as error:
            refusals.append(_with_proposal(error, drive, drives))
    return complete, refusals


def _with_proposal(error: OncenterError, drive: Signals, drives: Sequence[Signals]) -> OncenterError:
    """The error for a log without a signal, with the log that may have it."""
    other = next((each for each in drives if each is not drive and _overlap(drive, each)), None)
    if other is None:
        return error
    text = f"{error}; {drive.log} and {other.log} overlap in time: if they are files of one drive, give --join"
    return OncenterError(text, code=error.code, exit_code=error.exit_code, needs=error.needs)


@finding("log_left_out", "warning")
def _left_out(found: Kind, refusals: Sequence[OncenterError]) -> list[Finding]:
    refused = [error for error in refusals if error.code != NOT_A_LOG]
    return [found(f"a log was left out: {error}. The offset is estimated from the other logs") for error in refused]


@finding("no_log_left_out", "info")
def _no_logs(found: Kind, refusals: Sequence[OncenterError]) -> list[Finding]:
    """Files that oncenter wrote beside the logs."""
    own = [error for error in refusals if error.code == NOT_A_LOG]
    return [found(f"a file was left out: {error}. The offset is not affected") for error in own]


@finding("log_given_twice", "warning")
def _given_twice(found: Kind, twice: Sequence[Path]) -> list[Finding]:
    return [found(f"{log} is given twice; it is used once. The offset is not affected") for log in twice]


@finding("logs_overlap", "warning")
def _overlaps(found: Kind, drives: Sequence[Signals]) -> list[Finding]:
    """Among drives with the time of day: one truck cannot be on two of them at once. Copies and parts count once."""
    from oncenter.offset.inputs import without_copies

    once, _ = without_copies(tuple(drives))
    dated = sorted((drive for drive in once if _span(drive)[0] > EPOCH_S), key=_span)
    return [
        found(
            f"{one.log} and {other.log} overlap in time for "
            f"{min(_span(one)[1], _span(other)[1]) - _span(other)[0]:.0f} s. "
            "This part is used twice, so the interval of the offset is too narrow. Give only one of the two logs, or "
            "--join if they are files of one drive",
        )
        for one, other in pairwise(dated)
        if _span(other)[0] < _span(one)[1]
    ]
