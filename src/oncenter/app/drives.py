"""Former drives of the user's own trucks: their answers, beside the memory that `oncenter offset --memory` keeps."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from oncenter.files.whole_file import write_whole
from oncenter.memory import TruckMemory, read_memory, write_memory
from oncenter.offset.common_offset import Reading, common_offset
from oncenter.signals import DEGREE
from oncenter.vehicle import Vehicle
from oncenter.verdict.decision import Case, decide
from oncenter.verdict.states import AT_FAULT, STATES

_COUNT = ("valid", "converging")  # statuses of offsets
_KEPT_MAX = 50  # as many as a memory has


class Drives:
    """The drives of one truck, oldest first. Drive n has its answer in n.json and the memory before it in n.toml.

    Args:
        folder: made with the first drive.
        truck: of the vehicle file.
    """

    def __init__(self, folder: Path, truck: Vehicle) -> None:
        self._folder, self._truck = folder, truck

    @property
    def memory(self) -> Path:
        return self._folder / "memory.toml"

    def begin(self) -> bytes | None:
        """The memory before a drive, None where there is none; a folder for the memory after it."""
        self._folder.mkdir(parents=True, exist_ok=True)
        return self.memory.read_bytes() if self.memory.exists() else None

    def keep(self, before: bytes | None, said: dict[str, Any]) -> None:
        """Keeps an answer whose drives the memory took.

        Args:
            before: as `begin` gave it.
            said: the JSON of `oncenter offset`.
        """
        if not self.memory.exists() or self.memory.read_bytes() == before:
            return
        files = self._files()
        number = int(files[-1].stem) + 1 if files else 1
        of_answer = self._folder / f"{number:06}.json"
        if before is not None:
            write_whole(of_answer.with_suffix(".toml"), before)
        known = {drive.key for drive in self._memory(of_answer.with_suffix(".toml")).drives}
        keys = [drive.key for drive in self._memory(self.memory).drives if drive.key not in known]
        write_whole(of_answer, json.dumps({"said": said, "keys": keys}))
        for old in files[: -_KEPT_MAX + 1]:
            _remove(old)

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
        return {"drives": rows[::-1], "common": self._common(list(answers.values()))}

    def _common(self, answers: list[dict[str, Any]]) -> dict[str, Any] | None:
        known = [said for said in answers if said["offset"]["status"] in _COUNT and said["offset"]["ci95_drive"]]
        common = common_offset([_reading(said) for said in known], self._truck)
        if common is None:
            return None
        half_widths = (1.96 * sd / DEGREE for sd in (common.own_sd, common.whole_sd))
        value = common.value / DEGREE
        own, whole = ((value - half, value + half) for half in half_widths)
        newest = answers[-1]["verdicts"][0]["state"]
        at_fault = newest if newest in AT_FAULT else None
        case = Case(at_fault, common.zero, common.is_valid, True, own, whole)
        state = decide(case, answers[-1]["limit_deg"])
        drives = known[common.since :]
        return {
            "state": state,
            "word": STATES[state].word,
            "count": len(drives),
            "since": drives[0]["start_time"],
            "offset": value,
            "interval": own,
        }

    def forget(self, number: str) -> None:
        """Takes a drive out of the memory. What the memory estimated from it and later drives goes, too: it cannot be
        taken apart."""
        files = self._files()
        gone = next((each for each in files if each.stem == number), None)
        if gone is None:
            return
        keys, before = _read(gone)["keys"], self._memory(gone.with_suffix(".toml"))
        now = self._memory(self.memory)
        left = tuple(drive for drive in now.drives if drive.key not in keys)
        write_memory(self.memory, replace(before, drives=left, vin=now.vin if left else None))
        for later in files[files.index(gone) + 1 :]:
            write_memory(
                later.with_suffix(".toml"), replace(before, drives=self._memory(later.with_suffix(".toml")).drives)
            )
        _remove(gone)

    def _files(self) -> list[Path]:
        return sorted(self._folder.glob("[0-9]*.json"))

    def _memory(self, file: Path) -> TruckMemory:
        return read_memory(file, self._truck.name)


def _read(file: Path) -> dict[str, Any]:
    return dict(json.loads(file.read_text(encoding="utf-8")))


def _remove(file: Path) -> None:
    for each in (file, file.with_suffix(".toml")):
        each.unlink(missing_ok=True)


def _reading(said: dict[str, Any]) -> Reading:
    offset, neutral = said["offset"], said["unloading_acceleration"]
    reading = Reading(offset["value"] * DEGREE, _sd(offset["ci95_drive"]) * DEGREE)
    if neutral["value"] is None or neutral["ci95"] is None:
        return reading
    return replace(reading, neutral=neutral["value"], neutral_sd=_sd(neutral["ci95"]))


def _sd(interval: Sequence[float]) -> float:
    return (interval[1] - interval[0]) / 2.0 / 1.96
