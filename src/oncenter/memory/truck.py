"""The memory of a truck: a row of evidence for each drive, and what a person stated. SI and rad."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from oncenter import _core
from oncenter.offset.inputs import params_of
from oncenter.truck.events import Event
from oncenter.truck.fingerprint import are_same
from oncenter.truck.row import Row
from oncenter.vehicle import Vehicle


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

    def has(self, key: str) -> bool:
        return any(drive.is_of(key) for drive in self.drives)


def settings_of(vehicle: Vehicle, params: Mapping[str, float] | None) -> str:
    """Rows combine where the core, the truck and the use of the accelerometer are the same."""
    used = params_of(vehicle, params)
    product = "unknown" if vehicle.assumed else f"{vehicle.ratio_times_wheelbase_m:.4g} m"
    return f"oncenter {_core.version()}, {product}, accelerometer {int(used['use_accelerometer'])}"
