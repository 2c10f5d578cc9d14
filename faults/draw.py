"""Draws one-line faults, one for each room of `core/` and `src/oncenter/`, and prints them.

The kept faults stay as they are when the code changes: draw again only to replace all of them.

Usage: draw.py >faults.toml
"""

from __future__ import annotations

import json
import random
import sys
from collections.abc import Iterator
from dataclasses import asdict
from functools import cache
from pathlib import Path

import in_c
import in_python
from kept import ROOT, Edit, Fault, kept_form

SEED, COUNT = 17, 40
HEAD = """\
# Faults that `make faults` plants, one at a time; faults/draw.py wrote them once. An expression is unique in its
# function: when an edit moves or changes it, correct it here. `excused` is the reason why no check can find a fault.
"""


def rooms(root: Path = ROOT) -> dict[str, list[Path]]:
    """A file pair of the core; a folder of the package; the package's own files together; the simulator's C."""
    found = {f"core/{file.stem}": [file] for file in sorted(root.glob("core/*/*.c"), key=lambda file: file.stem)}
    package = root / "src" / "oncenter"
    found["src/oncenter"] = sorted(package.glob("*.py"))
    for folder in sorted(file.parent for file in package.glob("*/__init__.py")):
        files = sorted([*folder.rglob("*.py"), *folder.rglob("*.c")])
        found[f"src/oncenter/{folder.name}"] = [file for file in files if file.parent.name != "native"]
    found["src/oncenter/simulate/native"] = sorted(package.glob("simulate/native/*.c"))
    return found


def edits(files: list[Path], root: Path = ROOT) -> Iterator[tuple[str, Edit]]:
    """All possible faults of these files."""
    for file in files:
        if file.name == "_declarations.py":
            continue
        text = file.read_text(encoding="utf-8")
        found = in_python.faults(text) if file.suffix == ".py" else in_c.faults(text)
        for kind, function, start, end, new in found:
            yield file.relative_to(root).as_posix(), Edit(kind, function, start, end, new)


@cache
def _possible() -> dict[str, list[tuple[str, Edit]]]:
    """By room, without those that have none."""
    found = {room: sorted(edits(files), key=str) for room, files in rooms().items()}
    return {room: pairs for room, pairs in found.items() if pairs}


def drawn(seed: int = SEED, count: int = COUNT) -> list[Fault]:
    """By room; the kinds as evenly as the rooms allow."""
    chance = random.Random(seed)
    possible = dict(_possible())
    folders = [room for room in possible if not room.startswith("core/")]
    pairs = sorted(possible.keys() - set(folders))
    waiting = sorted(folders + chance.sample(pairs, count - len(folders)))
    used: dict[str, int] = {}
    faults: list[Fault] = []
    while waiting:
        kinds = sorted({edit.kind for room in waiting for _, edit in possible[room]})
        having = {kind: [room for room in waiting if any(e.kind == kind for _, e in possible[room])] for kind in kinds}
        kind = min(kinds, key=lambda name: (used.get(name, 0), len(having[name])))
        room = chance.choice(having[kind])
        fault = _one(chance, room, [pair for pair in possible[room] if pair[1].kind == kind])
        if fault is None:  # no place of that kind is unique in its function
            possible[room] = [pair for pair in possible[room] if pair[1].kind != kind]
            continue
        waiting.remove(room)
        used[kind] = used.get(kind, 0) + 1
        faults.append(fault)
    faults.sort(key=lambda fault: fault.room)
    return [Fault(**asdict(fault) | {"number": k}) for k, fault in enumerate(faults, 1)]


def _one(chance: random.Random, room: str, found: list[tuple[str, Edit]]) -> Fault | None:
    for file, edit in chance.sample(found, len(found)):
        form = kept_form(edit, file, (ROOT / file).read_text(encoding="utf-8"))
        if form is not None:
            return Fault(0, room, edit.kind, file, edit.function, *form)
    return None


def as_toml(faults: list[Fault]) -> str:
    return HEAD + "".join("\n[[fault]]\n" + "".join(_lines(fault)) for fault in faults)


def _lines(fault: Fault) -> Iterator[str]:
    for name, value in asdict(fault).items():
        if value:
            yield f"{name} = {json.dumps(value, ensure_ascii=False)}\n"


if __name__ == "__main__":
    sys.stdout.write(as_toml(drawn()))
