"""Former drives of the user's own trucks: their answers, beside the memory that `oncenter offset --memory` keeps."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from oncenter.errors import OncenterError
from oncenter.files.whole_file import write_whole
from oncenter.fleet.offset_now import offset_of, with_priors
from oncenter.fleet.verdict import state_of
from oncenter.memory import TruckMemory, read_memory, write_memory
from oncenter.offset.inputs import params_of
from oncenter.truck.events import KINDS, Event, with_stated
from oncenter.truck.now import Truck, truck_now, usable
from oncenter.truck.priors import priors_of
from oncenter.truck.row import Row
from oncenter.utc import iso
from oncenter.vehicle import Vehicle
from oncenter.verdict.states import AT_FAULT, STATES


class Drives:
    """The drives of one truck, oldest first. Drive n has its answer in n.json.

    Args:
        folder: made with the first drive.
        truck: of the vehicle file.
    """

    def __init__(self, folder: Path, truck: Vehicle) -> None:
        self._folder, self._truck = folder, truck

    @property
    def memory(self) -> Path:
        return self._folder / "memory.toml"

    def begin(self) -> frozenset[str]:
        """The keys of the drives in the memory before a new one; makes a folder for the memory after it."""
        self._folder.mkdir(parents=True, exist_ok=True)
        return self._keys()

    def keep(self, before: frozenset[str], said: dict[str, Any]) -> None:
        """Keeps an answer whose drives the memory took, and drops those whose drives it no longer has.

        Args:
            before: as `begin` gave it.
            said: the JSON of `oncenter offset`.
        """
        in_memory = self._keys()
        keys = sorted(in_memory - before)
        if not keys:
            return
        files = self._files()
        number = int(files[-1].stem) + 1 if files else 1
        write_whole(self._folder / f"{number:06}.json", json.dumps({"said": said, "keys": keys}))
        self._drop_what_is_not_in(in_memory)

    def _drop_what_is_not_in(self, memory: frozenset[str]) -> None:
        for file in self._files():
            if memory.isdisjoint(_read(file)["keys"]):
                file.unlink(missing_ok=True)

    def said(self, number: str) -> dict[str, Any] | None:
        """The answer on a drive."""
        file = next((each for each in self._files() if each.stem == number), None)
        return None if file is None else dict(_read(file)["said"])

    def listed(self) -> dict[str, Any]:
        """For the page: the drives, newest first, and their common offset, None below two."""
        answers = {file.stem: _read(file)["said"] for file in self._files()}
        if all(said["start_time"] for said in answers.values()):  # else in the order of their answers
            answers = dict(sorted(answers.items(), key=lambda each: str(each[1]["start_time"])))
        rows = [
            {
                "drive": number,
                "start": said["start_time"],
                "log": said["log"],
                "offset": said["offset"]["value"],
                "interval": said["offset"]["ci95_drive"],
                "verdict": said["verdicts"][0],
            }
            for number, said in answers.items()
        ]
        events = [{"kind": event.kind, "date": iso(event.time_s)} for event in self._memory().events]
        return {"drives": rows[::-1], "common": self._common(list(answers.values())), "events": events}

    def _common(self, answers: list[dict[str, Any]]) -> dict[str, Any] | None:
        memory = self._memory()
        every = memory.rows_of(self._truck)
        rows = usable(every, memory.events)
        if len(rows) < 2 or not answers:
            return None

        def by(params: Mapping[str, float]) -> Truck:
            return truck_now(rows, memory.events, priors_of(params))

        params, limit_deg = params_of(self._truck, None), answers[-1]["limit_deg"]
        truck = by(params)
        offset = offset_of(truck, [{"start": row.start_s} for row in rows], params, sum(row.used_s for row in every))
        newest = answers[-1]["verdicts"][0]["state"]
        at_fault = newest if newest in AT_FAULT else None
        state = state_of(at_fault, with_priors(offset, by, params, limit_deg), truck.zero, limit_deg)
        return {
            "state": state,
            "word": STATES[state].word,
            "count": len(rows) - truck.since,
            "since": iso(offset.since),
            "offset": offset.value,
            "interval": offset.own,
            "asks": _contradicts(truck, rows, memory.events),
        }

    def state(self, kind: str) -> None:
        """That something was done to the truck before its last drive.

        Raises:
            OncenterError: "usage": there is no such kind, or no drive.
        """
        memory = self._memory()
        rows = usable(memory.rows_of(self._truck), memory.events)
        if kind not in KINDS or not rows:
            raise OncenterError(f"'{kind}' cannot be stated of a truck with {len(rows)} drives", code="usage")
        event = Event(math.floor(rows[-1].start_s), kind)  # a memory has whole seconds
        write_memory(self.memory, replace(memory, events=with_stated(memory.events, [event])))

    def take_back(self, number: int) -> None:
        """Forgets an event, by its place in the list."""
        memory = self._memory()
        left = tuple(event for k, event in enumerate(memory.events) if k != number)
        write_memory(self.memory, replace(memory, events=left))

    def forget(self, number: str) -> None:
        """Takes a drive out of the memory, with all its logs."""
        gone = next((each for each in self._files() if each.stem == number), None)
        if gone is None:
            return
        keys, memory = set(_read(gone)["keys"]), self._memory()
        left = tuple(drive for drive in memory.drives if not keys & {*drive.key})
        write_memory(self.memory, replace(memory, drives=left, vin=memory.vin if left else None))
        gone.unlink(missing_ok=True)
        self._drop_what_is_not_in(self._keys())

    def _keys(self) -> frozenset[str]:
        return frozenset(key for drive in self._memory().drives for key in drive.key)

    def _files(self) -> list[Path]:
        return sorted(self._folder.glob("[0-9]*.json"))

    def _memory(self) -> TruckMemory:
        return read_memory(self.memory, self._truck.name)


def _contradicts(truck: Truck, rows: Sequence[Row], events: Sequence[Event]) -> bool:
    """Whether the last drive differs from those before, and nothing that was done to the truck is stated."""
    before, last = rows[-2:]
    is_stated = any(before.start_s < event.time_s <= last.start_s for event in events)
    return not is_stated and (truck.is_ambiguous or any(change.at == len(rows) - 1 for change in truck.changes))


def _read(file: Path) -> dict[str, Any]:
    return dict(json.loads(file.read_text(encoding="utf-8")))
