"""Logs as a command line names them. Of one truck's logs those that cannot be read are named, the others answered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.cli.options import progress_bar
from oncenter.cli.standard_input import STANDARD_INPUT, as_file
from oncenter.errors import LOG_CANNOT_BE_ANSWERED, OncenterError

if TYPE_CHECKING:
    from oncenter.offset.findings import Finding
    from oncenter.signals import SignalName, Signals
    from oncenter.vehicle import Vehicle

_EPOCH_S = 1e8  # times beyond are of day and year, those below since the log's own start


def read_log(
    log: Path, names: Mapping[str, SignalName] | None, dbc: Sequence[Path], take: Mapping[str, str]
) -> Signals:
    """One log; `-` is standard input.

    Raises:
        OncenterError: as `oncenter.read`.
    """
    from oncenter.read import read

    with as_file(log) as file, progress_bar(f"reading {file.name}", file) as progress:
        drive = read(file, names=names, dbc=dbc, take=take, progress=progress)
    return replace(drive, log="-") if log == STANDARD_INPUT else drive


def read_logs(
    logs: Sequence[Path], truck: Vehicle, dbc: Sequence[Path], take: Mapping[str, str]
) -> tuple[list[Signals], list[Finding]]:
    """Drives, and what to tell of logs that gave none.

    Raises:
        OncenterError: there is one log only and it cannot be read, none of several can, or usage is wrong.
    """
    from oncenter.read import require

    drives: list[Signals] = []
    refusals: list[OncenterError] = []
    wanted = list(dict.fromkeys(logs))
    for log in wanted:
        try:
            drive = read_log(log, truck.signal_names, dbc, take)
            if len(wanted) > 1:
                require(drive, ["steering_wheel_angle"])
            drives.append(drive)
        except OncenterError as error:
            if len(wanted) == 1 or error.exit_code != LOG_CANNOT_BE_ANSWERED:
                raise
            refusals.append(error)
    if not drives:
        reasons = "; ".join(str(error) for error in refusals[:3])
        raise OncenterError(
            f"none of {len(refusals)} logs can be read: {reasons}", code=refusals[0].code, needs=refusals[0].needs
        )
    return drives, [*_left_out(refusals), *_given_twice(logs), *_overlaps(drives)]


def _left_out(refusals: Sequence[OncenterError]) -> list[Finding]:
    from oncenter.offset.findings import Finding

    return [Finding("log_left_out", "warning", f"a log was left out: {error}") for error in refusals]


def _given_twice(logs: Sequence[Path]) -> list[Finding]:
    from oncenter.offset.findings import Finding

    again = [log for k, log in enumerate(logs) if log in logs[:k]]
    return [Finding("log_given_twice", "warning", f"{log} is given twice and counts once") for log in again]


def _overlaps(drives: Sequence[Signals]) -> list[Finding]:
    """Of drives that know the time of day: one truck cannot be on two of them at once."""
    from oncenter.offset.findings import Finding

    def span(drive: Signals) -> tuple[float, float]:
        return float(drive.table["time_s"][0]), float(drive.table["time_s"][-1])

    dated = sorted((drive for drive in drives if span(drive)[0] > _EPOCH_S), key=span)
    return [
        Finding(
            "logs_overlap",
            "warning",
            f"{one.log} and {other.log} overlap in time for {min(span(one)[1], span(other)[1]) - span(other)[0]:.0f} s:"
            " what both have counts twice",
        )
        for one, other in pairwise(dated)
        if span(other)[0] < span(one)[1]
    ]
