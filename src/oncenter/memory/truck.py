"""What is kept of a truck: a row of evidence for each drive, and what a person stated. SI and rad."""

from __future__ import annotations

from dataclasses import dataclass

from oncenter.truck.events import Event
from oncenter.truck.fingerprint import are_same
from oncenter.truck.row import Row


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

    def has(self, key: str) -> bool:
        return any(are_same(key, known) for drive in self.drives for known in drive.key)
