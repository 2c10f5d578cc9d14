"""The memory of a truck: a row of evidence for each drive, and what a person stated. SI and rad."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from oncenter import _core
from oncenter.offset.inputs import params_of
from oncenter.truck.events import Event
from oncenter.truck.fingerprint import are_same
from oncenter.truck.row import Row
from oncenter.vehicle import Vehicle

_ALIKE_S = 1.0  # of the lengths of a log and of its copy in another format
DRIVES_MAX = 200  # of one log each they are 0.3 MiB; a file beyond 1 MiB cannot be read (files/toml_file.py)


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
        """Whether a log of this length is one of a drive with these settings, or a part of it."""
        return any(
            drive.is_of(key) and drive.settings == settings and length_s < drive.row.length_s + _ALIKE_S
            for drive in self.drives
        )

    def of_newest(self) -> TruckMemory:
        """The memory with at most `DRIVES_MAX` drives, the newest ones by their dates."""
        by_date = sorted(range(len(self.drives)), key=lambda k: self.drives[k].row.start_s)
        return replace(self, drives=tuple(self.drives[k] for k in sorted(by_date[-DRIVES_MAX:])))


def with_added(
    former: Sequence[PastDrive], rows: Sequence[Row], keys: Iterable[tuple[str, str]], settings: str
) -> tuple[PastDrive, ...]:
    """The drives after an answer with these rows; a row may go on with a former drive, and replaces it. Only the newest
    drive keeps its image.

    Args:
        keys: name and fingerprint of each log, in order of time.
    """
    drives, new = list(former), list(keys)
    for row in rows:
        begun = next((drive for drive in drives if drive.row.image and drive.row.start_s == row.start_s), None)
        key = () if begun is None else begun.key
        if begun is not None:
            drives.remove(begun)
        for name in row.logs[0 if begun is None else len(begun.row.logs) :]:
            pair = next(pair for pair in new if pair[0] == name)
            new.remove(pair)
            key = (*key, pair[1])
        drives.append(PastDrive(key, row, settings))
    newest = max((drive.row.start_s for drive in drives), default=0.0)
    return tuple(
        drive if drive.row.start_s == newest else replace(drive, row=replace(drive.row, image=b"")) for drive in drives
    )


def settings_of(vehicle: Vehicle, params: Mapping[str, float] | None) -> str:
    """Rows combine where the core, the truck and the use of the accelerometer are the same."""
    used = params_of(vehicle, params)
    product = "unknown" if vehicle.assumed else f"{vehicle.ratio_times_wheelbase_m:.4g} m"
    return f"oncenter {_core.version()}, {product}, accelerometer {int(used['use_accelerometer'])}"
