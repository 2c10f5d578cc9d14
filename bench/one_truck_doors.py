"""The doors by which a truck's drives are combined, each as one function from drives to its answers after some of them.

A door is called only here. All angles in deg.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from drives_that_differ import over_ignitions
from one_truck_drives import Driven

import oncenter as oc
from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.fleet.drive import of_answer, of_one_drive
from oncenter.fleet.ranking import OfTruck, histories, mark_copies
from oncenter.fleet.several_logs import in_one_drive
from oncenter.memory import TruckMemory, offset_with_memory
from oncenter.signals import DEGREE, Signals
from oncenter.truck.fingerprint import fingerprint_of
from oncenter.vehicle import Vehicle
from oncenter.verdict import verdicts_of

NAN = math.nan
NO_INTERVAL = (NAN, NAN)
OFFSET, SENSOR, PLAY = "straight-ahead offset", "steering wheel angle sensor", "free play"


@dataclass(frozen=True)
class Said:
    """An answer, deg; NaN where it has no number.

    `whole` is the 95 % interval with all causes, `own` that of the driving. `states` are verdicts by what they are
    about. `refusal` is the code of an error in place of an answer. `valid_alone` counts the drives that are valid
    alone, -1 where the door has no count.
    """

    status: str
    value: float = NAN
    whole: tuple[float, float] = NO_INTERVAL
    own: tuple[float, float] = NO_INTERVAL
    play: float = NAN
    play_interval: tuple[float, float] = NO_INTERVAL
    play_status: str = ""
    zero: str = ""
    states: Mapping[str, str] = field(default_factory=dict)
    refusal: str = ""
    valid_alone: int = -1

    @property
    def printed(self) -> str:
        """Value and half-width of the driving as `oncenter offset` prints them, and whether they are valid."""
        half = 0.5 * (self.own[1] - self.own[0])
        digits = 1 if not half < 0.095 else 2
        return f"{self.value:.{digits}f} ± {half:.{digits}f} {'valid' if self.status == 'valid' else 'not valid'}"


Door = Callable[[Sequence[Driven], Collection[int]], Iterator[tuple[int, Said]]]


def folder(drives: Sequence[Driven], wanted: Collection[int]) -> Iterator[tuple[int, Said]]:
    """`oncenter offset LOGS`."""
    for count in sorted(wanted):
        yield count, of_words(oc.offset(_signals(drives[:count]), drives[0].vehicle))


def memory(drives: Sequence[Driven], wanted: Collection[int]) -> Iterator[tuple[int, Said]]:
    """`oncenter offset LOG --memory FILE`, one drive after another."""
    known = TruckMemory(drives[0].vehicle.name)
    for count, drive in enumerate(drives[: max(wanted)], 1):
        answer, known = offset_with_memory([drive.signals], drives[0].vehicle, known)
        if count in wanted:
            yield count, of_words(answer)


def fleet(drives: Sequence[Driven], wanted: Collection[int]) -> Iterator[tuple[int, Said]]:
    """A night's ranking of one truck, without priors of a fleet."""
    rows = []
    for count, drive in enumerate(drives[: max(wanted)], 1):
        rows.append(row_of(drive, count))
        former = drives[count - len(in_one_drive(rows, ())[-1]) : count - 1]
        if former:
            keys = [row["key"] for row in rows[-1 - len(former) :]]
            rows[-1]["drive"] = row_of(drive, count, former) | {"keys": keys}
        if count in wanted:
            yield count, of_rows([dict(row) for row in rows], drives[0].vehicle)


def row_of(drive: Driven, number: int, former: Sequence[Driven] = ()) -> dict[str, Any]:
    """A drive's row as `oncenter.fleet.drive.Work` makes it from a log, or from several with short stops between."""
    signals = drive.signals
    answer = oc.offset([*_signals(former), signals], drive.vehicle)
    whole = {"rows": [of_one_drive(row, answer) for row in answer.rows]} if former else {}
    return {
        "log": signals.log,
        "truck": drive.vehicle.name,
        "version": _core.version(),
        "key": f"{number:064x}",
        "vehicle_file": drive.vehicle.name,
        "start": signals.start_s,
        "start_source": "metadata",
        "span_s": signals.duration_s,
        "fingerprint": fingerprint_of(signals),
        **of_answer(answer),
        **whole,
    }


def of_rows(rows: list[dict[str, Any]], vehicle: Vehicle) -> Said:
    """A truck by its rows; the table of trucks has no status of the play."""
    mark_copies(rows)
    (history,) = histories([OfTruck(vehicle.name, rows, vehicle.offset_limit_deg)])
    row, alone = history.truck, sum(each.get("offset_status") == "valid" for each in rows)
    state = str(row["state"])
    zero = {"no_correction": "relative", "signal_or_sensor": "moves"}.get(state, "fixed")
    if row.get("offset_deg") is None:
        return Said("no offset", zero=zero, states={OFFSET: state}, valid_alone=alone)
    value, own, whole = row["offset_deg"], 1.96 * row["offset_spread_sd_deg"], 1.96 * row["offset_sd_deg"]
    play, play_sd = row.get("backlash_deg"), row.get("backlash_sd_deg")
    return Said(
        status="valid" if row["offset_is_valid"] else "converging",
        value=value,
        own=(value - own, value + own),
        whole=(value - whole, value + whole),
        play=NAN if play is None else play,
        play_interval=NO_INTERVAL
        if play is None or play_sd is None
        else (play - 1.96 * play_sd, play + 1.96 * play_sd),
        play_status=row.get("backlash_status") or "",
        zero=zero,
        states={OFFSET: state},
        valid_alone=alone,
    )


def ecu(drives: Sequence[Driven], wanted: Collection[int]) -> Iterator[tuple[int, Said]]:
    """One core that is saved, restored and started again before each drive, after the time that the truck stood."""
    logs = _signals(drives[: max(wanted)])
    for count, answer in enumerate(over_ignitions(logs, drives[0].vehicle, _between), 1):
        if count in wanted:
            yield count, _of_core(answer)


def _between(before: Signals, after: Signals) -> float:
    """s from the end of one log to the start of the next."""
    return max((after.begin_s or 0.0) - ((before.begin_s or 0.0) + before.duration_s), 0.0)


def _of_core(answer: Any) -> Said:
    offset, play = answer["offset"], answer["backlash"]
    value, own = offset["value"] / DEGREE, 1.96 * answer["offset_parts"]["drive_sd"] / DEGREE
    return Said(
        status=_core.status_of(offset),
        value=value,
        own=(value - own, value + own),
        whole=_in_deg(_core.ci95(offset)),
        play=play["value"] / DEGREE,
        play_interval=_in_deg(_core.ci95(play)),
        play_status=_core.status_of(play),
    )


def of_words(answer: oc.Answer) -> Said:
    """Of an answer whose numbers and verdicts are printed."""
    play, value = answer.backlash, answer.offset.value
    return Said(
        status=answer.offset.status,
        value=NAN if value is None else value / DEGREE,
        own=_in_deg(answer.offset_ci95_drive),
        whole=_in_deg(answer.offset.ci95),
        play=NAN if play.value is None else play.value / DEGREE,
        play_interval=_in_deg(play.ci95),
        play_status=play.status,
        zero=answer.zero,
        states={verdict.about: verdict.state for verdict in verdicts_of(answer)},
    )


def _in_deg(interval: tuple[float, float] | None) -> tuple[float, float]:
    return NO_INTERVAL if interval is None else (interval[0] / DEGREE, interval[1] / DEGREE)


def _signals(drives: Sequence[Driven]) -> list[Signals]:
    return [drive.signals for drive in drives]


DOORS: Mapping[str, Door] = {"folder": folder, "memory": memory, "fleet": fleet, "ecu": ecu}


def answers(door: str, drives: Sequence[Driven], wanted: Collection[int]) -> dict[int, Said]:
    """By the number of drives so far. A refusal stands in place of the answers that are missing then."""
    found: dict[int, Said] = {}
    try:
        for count, said in DOORS[door](drives, wanted):
            found[count] = said
    except OncenterError as error:
        refusal = error.code
    except Exception as error:  # one sequence must not end a run of hours
        refusal = f"internal error: {type(error).__name__}: {error}"
    else:
        return found
    return {count: found.get(count, Said("refused", refusal=refusal)) for count in wanted}
