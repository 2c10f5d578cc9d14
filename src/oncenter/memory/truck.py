"""The memory of a truck: a row of evidence for each drive, and what a person stated. SI and rad."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

from oncenter import _core
from oncenter.offset.inputs import params_of
from oncenter.truck.events import Event
from oncenter.truck.fingerprint import are_same
from oncenter.truck.row import Row
from oncenter.vehicle import Vehicle

_ALIKE_S = 1.0  # of the lengths of a log and of its copy in another format
DRIVES_MAX, LOGS_MAX = 200, 2000  # 0.3 and 0.5 MiB; a file beyond 1 MiB cannot be read (files/toml_file.py)


@dataclass(frozen=True)
class PastDrive:
    """A drive in the memory.

    Attributes:
        key: fingerprint of its signals, of each of its logs.
        row: what it says of the truck alone.
        settings: of the answer; rows of other settings do not combine.
    """

    key: tuple[str, ...]
    row: Row
    settings: str

    @property
    def has_more(self) -> bool:
        """Whether it has several logs."""
        return len(self.key) > 1

    def is_of(self, key: str) -> bool:
        return any(are_same(key, known) for known in self.key)


@dataclass(frozen=True)
class Remembered:
    """A quantity and its standard deviation."""

    value: float
    sd: float


@dataclass(frozen=True)
class TruckMemory:
    """A truck's drives.

    Attributes:
        truck: the vehicle file's name.
        vin: as a log had it; None where none had.
        drives: in order of their answers.
        events: what a person stated, in order of time.
        ratio_times_wheelbase: m, of a truck whose vehicle file does not give both.
    """

    truck: str
    vin: str | None = None
    drives: tuple[PastDrive, ...] = ()
    events: tuple[Event, ...] = ()
    ratio_times_wheelbase: Remembered | None = None

    def rows_of(self, vehicle: Vehicle, params: Mapping[str, float] | None = None) -> list[Row]:
        """Of the drives that were answered by the same core with the same truck and params."""
        settings = settings_of(vehicle, params)
        return [drive.row for drive in self.drives if drive.settings == settings]

    def contains(self, key: str, length_s: float, settings: str) -> bool:
        """Whether a log of this length is a drive with these settings, one of its logs, or a part of it. A longer
        recording of a drive's only log is not: it takes its place."""
        return any(
            drive.is_of(key)
            and drive.settings == settings
            and (drive.has_more or length_s < drive.row.length_s + _ALIKE_S)
            for drive in self.drives
        )

    def of_newest(self) -> TruckMemory:
        """The memory with at most `DRIVES_MAX` drives and `LOGS_MAX` logs, the newest ones by their dates."""
        by_date = sorted(range(len(self.drives)), key=lambda k: self.drives[k].row.start_s, reverse=True)
        logs = accumulate(len(self.drives[k].key) for k in by_date)
        kept = [k for k, count in zip(by_date[:DRIVES_MAX], logs, strict=False) if count <= LOGS_MAX]
        return replace(self, drives=tuple(self.drives[k] for k in sorted(kept)))


def with_added(
    former: Sequence[PastDrive], rows: Sequence[Row], keys: Iterable[tuple[str, str]], settings: str, has_dates: bool
) -> tuple[PastDrive, ...]:
    """The drives after an answer with these rows; a row may go on with a former drive, and replaces it. Only the newest
    drive keeps its image.

    Args:
        keys: name and fingerprint of each log, in order of time.
        has_dates: the logs have dates of their own, so that another log may go on with them.
    """
    drives, new = list(former), list(keys)
    for row in rows:
        begun = next((drive for drive in drives if _is_begun(drive, row, settings)), None)
        key = () if begun is None else begun.key
        if begun is not None:
            drives.remove(begun)
        for name in row.logs[0 if begun is None else len(begun.row.logs) :]:
            pair = next(pair for pair in new if pair[0] == name)
            new.remove(pair)
            key = (*key, pair[1])
        drives.append(PastDrive(key, row if has_dates else replace(row, image=b""), settings))
    newest = max((drive.row.start_s for drive in drives), default=0.0)
    return tuple(
        drive if drive.row.start_s == newest else replace(drive, row=replace(drive.row, image=b"")) for drive in drives
    )


def _is_begun(drive: PastDrive, row: Row, settings: str) -> bool:
    logs = drive.row.logs
    is_alike = drive.row.start_s == row.start_s and drive.settings == settings
    return bool(drive.row.image) and is_alike and len(logs) < len(row.logs) and row.logs[: len(logs)] == logs


def settings_of(vehicle: Vehicle, params: Mapping[str, float] | None) -> str:
    """Rows combine where the core, the truck and the use of the accelerometer are the same."""
    used = params_of(vehicle, params)
    product = "unknown" if vehicle.assumed else f"{vehicle.ratio_times_wheelbase_m:.4g} m"
    return f"oncenter {_core.version()}, {product}, accelerometer {int(used['use_accelerometer'])}"
