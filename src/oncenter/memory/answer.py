"""The answer of a truck's new drive together with those in its memory, and the memory after it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import compress
from pathlib import Path

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.estimates.estimates import DEFAULT_METHOD, Method
from oncenter.memory.log import start_of_drive
from oncenter.memory.truck import PastDrive, Remembered, TruckMemory, settings_of, with_added
from oncenter.offset.answer import Answer
from oncenter.offset.run import offset
from oncenter.signals import Signals
from oncenter.truck.events import Event, is_former, with_stated
from oncenter.truck.fingerprint import fingerprint_of
from oncenter.vehicle import Vehicle

_USES_MEMORY: Method = "joint"
_NOTHING_ADDED = "this drive was not added to the truck's memory, since one of its signals is at fault"


def offset_with_memory(
    drives: Sequence[Signals],
    vehicle: Vehicle,
    memory: TruckMemory,
    *,
    method: Method = DEFAULT_METHOD,
    params: Mapping[str, float] | None = None,
    events: Sequence[Event] = (),
    progress: Callable[[float], None] | None = None,
) -> tuple[Answer, TruckMemory]:
    """The answer of `oncenter.offset` on these drives and those in the memory, and the memory to keep.

    A drive that is in the memory already, or a part of it, counts once.

    Args:
        drives, vehicle, method, params, progress: as for `oncenter.offset`.
        memory: of this truck, before these drives.
        events: what a person states of the truck, in addition to the memory's.

    Raises:
        OncenterError: as `oncenter.offset`; exit code 2: "method": another one than "joint"; "different_trucks".
    """
    if method != _USES_MEMORY:
        raise OncenterError(
            f"a memory needs method '{_USES_MEMORY}', got '{method}'", code="method", exit_code=WRONG_USAGE
        )
    memory = replace(memory, events=with_stated(memory.events, events))
    dated = [replace(drive, start_s=start_of_drive(drive, _path(drive))) for drive in drives]
    vin = _vin_of(dated, memory)
    vehicle = _with_remembered_product(vehicle, memory)
    settings = settings_of(vehicle, params)
    keys = list(map(fingerprint_of, dated))
    known = [memory.contains(key, drive.duration_s, settings) for key, drive in zip(keys, dated, strict=True)]
    again = [drive.log for drive, is_known in zip(dated, known, strict=True) if is_known]
    if not all(known):  # else the answer is that on these drives, and they count once
        new = [not is_known for is_known in known]
        dated, keys = list(compress(dated, new)), list(compress(keys, new))
    others = [drive for drive in memory.drives if not _is_replaced(drive, dated, keys)]
    rows = [drive.row for drive in others if drive.settings == settings]
    has_dates = all(drive.begin_s is not None for drive in drives)
    answer = offset(
        dated,
        vehicle,
        method=method,
        params=params,
        before=rows,
        short_stops=has_dates,
        events=memory.events,
        progress=progress,
    )
    answer = _noted(answer, _again(again))
    answer = _noted(answer, not_counted(len(others) - len(rows)))
    if answer.sensor_fault != "none" or answer.offset.status == "invalid":
        return _noted(answer, _NOTHING_ADDED), memory
    if all(known):
        return answer, memory
    named = [(drive.log, key) for drive, key in zip(dated, keys, strict=True)]
    after = replace(
        memory,
        vin=vin,
        drives=with_added(others, answer.rows, named, settings, has_dates),
        ratio_times_wheelbase=_product(answer) or memory.ratio_times_wheelbase,
    )
    return answer, after.of_newest()


def _is_replaced(drive: PastDrive, logs: Sequence[Signals], keys: Sequence[str]) -> bool:
    """By the answer on these logs; one of several logs of a drive takes that drive's row instead."""
    names = {log.log for log, key in zip(logs, keys, strict=True) if drive.is_of(key)}
    return bool(names) and not (drive.has_more and names <= {*drive.row.logs})


def _vin_of(drives: Sequence[Signals], memory: TruckMemory) -> str | None:
    """The VIN of the present truck: the memory's, unless all its drives are of a former truck, else that of the drives.

    Raises:
        OncenterError: "different_trucks", exit code 2: the VIN of a drive is not that of the memory.
    """
    is_replaced = memory.drives and all(is_former(drive.row.start_s, memory.events) for drive in memory.drives)
    vin = None if is_replaced else memory.vin
    named = [drive for drive in drives if drive.vin is not None and not is_former(drive.begin_s, memory.events)]
    other = next((drive for drive in named if vin not in (None, drive.vin)), None)
    if other is not None:
        raise OncenterError(
            f"{other.log} has VIN {other.vin}, and the former drives of truck '{memory.truck}' have VIN {vin}: "
            "give this truck's logs, or the memory of the other truck",
            code="different_trucks",
            exit_code=WRONG_USAGE,
        )
    return vin or next((drive.vin for drive in named), None)


def _with_remembered_product(vehicle: Vehicle, memory: TruckMemory) -> Vehicle:
    """The vehicle with the remembered ratio times wheelbase in place of an assumed one."""
    if not vehicle.assumed or memory.ratio_times_wheelbase is None:
        return vehicle
    return vehicle.with_product(memory.ratio_times_wheelbase.value) or vehicle


def _product(answer: Answer) -> Remembered | None:
    found = answer.ratio_times_wheelbase
    if not answer.vehicle.assumed or found.value is None or found.ci95 is None or found.status != "valid":
        return None
    sd = (found.ci95[1] - found.ci95[0]) / (2.0 * 1.96)
    return Remembered(found.value, sd) if sd > 0.0 and math.isfinite(sd) else None


def _path(drive: Signals) -> Path | None:
    """The path of the log, where it is a file."""
    path = Path(drive.log)
    return path if path.is_file() else None


def _noted(answer: Answer, note: str) -> Answer:
    return replace(answer, notes=(*answer.notes, note)) if note else answer


def _again(logs: Sequence[str]) -> str:
    if not logs:
        return ""
    verb = "is" if len(logs) == 1 else "are"
    return f"{', '.join(logs)} {verb} in the truck's memory already and counts once"


def not_counted(count: int) -> str:
    """The note on so many drives of other settings; empty for none."""
    if not count:
        return ""
    drives = "1 drive" if count == 1 else f"{count} drives"
    return (
        f"{drives} of the truck's memory were answered by another version of oncenter or with another vehicle file, "
        "and do not count: give their logs again with a new memory file"
    )
