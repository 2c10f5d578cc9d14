"""The answer of drives that start with a truck's memory, and the memory after them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.estimates.estimates import DEFAULT_METHOD, Method
from oncenter.memory.drive import priors, with_drive, with_remembered_product
from oncenter.memory.log import start_of_drive
from oncenter.memory.truck import TruckMemory
from oncenter.offset.answer import Answer
from oncenter.offset.run import offset
from oncenter.offset.several_logs import with_zero
from oncenter.signals import DEGREE, Signals
from oncenter.truck.drives import offset_alone, together
from oncenter.truck.fingerprint import fingerprint_of
from oncenter.truck.model import learn
from oncenter.truck.priors import priors_of
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
    progress: Callable[[float], None] | None = None,
) -> tuple[Answer, TruckMemory]:
    """The answer of `oncenter.offset`, and the memory to keep.

    If one of the drives, or a part of it, is in the memory already, all start without it and add nothing: it contains
    their evidence.

    Args:
        drives, vehicle, method, params, progress: as for `oncenter.offset`; `params` override the memory.
        memory: of this truck, before these drives.

    Raises:
        OncenterError: as `oncenter.offset`; "method", exit code 2: another method than "joint".
    """
    if method != _USES_MEMORY:
        raise OncenterError(
            f"a memory needs method '{_USES_MEMORY}', got '{method}'", code="method", exit_code=WRONG_USAGE
        )
    keys = {drive.log: fingerprint_of(drive) for drive in drives}
    if any(map(memory.has, keys.values())):
        answer = offset(drives, vehicle, method=method, params=params, progress=progress)
        return _noted(answer, _again([log for log, key in keys.items() if memory.has(key)])), memory
    vehicle = with_remembered_product(vehicle, memory)
    start_s = max((start_of_drive(drive, _path(drive)) for drive in drives), default=0.0)
    started_from = priors(memory, vehicle, start_s)
    answer = offset(drives, vehicle, method=method, params={**started_from, **(params or {})}, progress=progress)
    after = with_drive(memory, answer, keys, start_s, started_from)
    answer = _with_zero(_noted(answer, _started(started_from)), after)
    return (_noted(answer, _NOTHING_ADDED) if after == memory else answer), after


def _with_zero(answer: Answer, memory: TruckMemory) -> Answer:
    """The answer with what the remembered offsets say of the sensor's zero."""
    past = [drive for drive in memory.drives if drive.offset is not None and drive.offset_sd is not None]
    if answer.zero != "fixed" or not past:
        return answer
    ratio, side = answer.vehicle.ratio_near_centre, answer.vehicle.traffic_sign
    drives = [offset_alone(drive.offset or 0.0, drive.offset_sd or 0.0, ratio, side) for drive in past]
    model = learn(together([drives]), priors_of(answer.params))
    return with_zero(answer, model)


def _path(drive: Signals) -> Path | None:
    """The path of the log, where it is a file."""
    path = Path(drive.log)
    return path if path.is_file() else None


def _noted(answer: Answer, note: str) -> Answer:
    return replace(answer, notes=(*answer.notes, note)) if note else answer


def _again(logs: Sequence[str]) -> str:
    is_one = len(logs) == 1
    return (
        f"{', '.join(logs)} {'is' if is_one else 'are'} in the truck's memory already: this answer does not use the "
        "memory and adds nothing to it"
    )


def _started(priors_used: Mapping[str, float]) -> str:
    """The priors of the drive with standard deviations; empty where the memory was empty."""
    parts = [
        f"{words} {priors_used[name.format('')] / factor:.{digits}f}"
        f" ±{priors_used[name.format('_sd')] / factor:.{digits}f} {unit}"
        for words, name, factor, digits, unit in (
            ("play", "known_play{}_rad", DEGREE, 1, "deg"),
            ("understeer gradient", "known_understeer_gradient{}_rad_m_s2", DEGREE, 2, "deg/(m/s^2)"),
            ("yaw rate bias", "known_yaw_rate_bias{}_rad_s", DEGREE, 2, "deg/s"),
            ("accelerometer bias", "known_accelerometer_bias{}_m_s2", 1.0, 2, "m/s^2"),
        )
        if name.format("") in priors_used
    ]
    return f"priors from the truck's memory: {', '.join(parts)} (one standard deviation)" if parts else ""
