"""The test files of a source file, nearest first: named after it, naming its function, few imports away from it."""

from __future__ import annotations

import ast
import re
from collections import defaultdict, deque
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from kept import ROOT, Fault

SOURCE = Path("src")
NATIVE = {"src/oncenter/_native.py": ("monitor.c", "save.c", "message.c", "trouble.c")}
SIMULATOR = "src/oncenter/simulate/native/drive.c"
NOT_OF_A_FAULT = "test_faults.py"  # it is red as soon as a fault is planted


def nearest_tests(fault: Fault, root: Path = ROOT) -> list[str]:
    """All test files."""
    steps = _steps_to(fault.file, root)
    stem, function = Path(fault.file).stem, fault.function.split(".")[-1].strip("_")
    words = [_with_word(word, root) for word in (function, f'"{stem}"' if fault.room.endswith("/cli") else stem)]
    named = {test: round(20 * sum(1 / len(tests) for tests in words if test in tests)) for test in _tests(root)}
    far = _with_word('"bench"', root)  # they run for long
    if fault.room.startswith("core/"):
        far |= {test for test in named if not re.match("tests/test_(core_|oracle)", test)}
    return sorted(named, key=lambda test: (_by_name(fault, test), -named[test], test in far, steps.get(test, 99), test))


def _tests(root: Path) -> list[str]:
    files = sorted(root.glob("tests/test_*.py"))
    return [file.relative_to(root).as_posix() for file in files if file.name != NOT_OF_A_FAULT]


@cache
def _with_word(word: str, root: Path) -> frozenset[str]:
    """The fewer tests have a word, the more it says."""
    pattern = re.compile(rf"(?<![a-zA-Z]){re.escape(word)}(?![a-zA-Z])")
    return frozenset(test for test in _tests(root) if pattern.search(_text(root / test)))


@cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def _by_name(fault: Fault, test: str) -> int:
    """0 is a test that is named after the file."""
    stem, room = Path(fault.file).stem, fault.room.removeprefix("src/oncenter/").split("/")[0]
    name = Path(test).stem.removeprefix("test_")
    if room == "core":
        first = stem.split("_")[0]
        whole, beginnings = [f"core_{stem}", stem], [f"core_{first}", first]
    else:
        whole, beginnings = [f"{room}_{stem}", stem, room], [f"{room}_"]
    if name in whole:
        return whole.index(name)
    return next((3 + k for k, each in enumerate(beginnings) if name.startswith(each)), 5)


def _steps_to(target: str, root: Path) -> dict[str, int]:
    """How many imports or includes lie between a file and the target."""
    away, waiting = {target: 0}, deque([target])
    while waiting:
        name = waiting.popleft()
        new = _users(root).get(name, set()) - away.keys()
        away |= dict.fromkeys(new, away[name] + 1)
        waiting += sorted(new)
    return away


@cache
def _users(root: Path) -> dict[str, set[str]]:
    """By file: the files that import or include it."""
    users: dict[str, set[str]] = defaultdict(set)
    for pattern in ("core/*/*.c", "src/**/*.c", "src/**/*.py", "tests/*.py", "bench/*.py"):
        for path in root.glob(pattern):
            name = path.relative_to(root).as_posix()
            for used in _uses(name, root):
                users[used].add(name)
    return users


def _uses(name: str, root: Path) -> frozenset[str]:
    """The files that a file imports or includes."""
    text = _text(root / name)
    if name.endswith(".c"):
        found = [
            Path(name).parent / f"{header}.c" for header in re.findall(r'^#include "(\w+)\.h"', text, re.MULTILINE)
        ]
        found += _in_core((path.name for path in found), root)
    else:
        found = list(_imported(name, ast.parse(text)))
        found += _in_core(NATIVE.get(name, ()), root)
        if name.startswith("tests/"):
            found += _in_core((f"{word}.c" for word in re.findall(r"\boc_(\w+?)(?=_|\b)", text)), root)
    if name == "src/oncenter/_core.py":
        found.append(Path(SIMULATOR))
    if name == SIMULATOR:
        found += [path.relative_to(root) for path in (root / name).parent.glob("*.c")]
    return frozenset(path.as_posix() for path in found if (root / path).is_file())


def _in_core(names: Iterable[str], root: Path) -> list[Path]:
    return [file.relative_to(root) for name in set(names) for file in root.glob(f"core/*/{name}")]


def _imported(name: str, tree: ast.AST) -> list[Path]:
    here = Path(name).parent
    found: list[Path] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for each in node.names:
                found += _files_of(here, each.name)
        elif isinstance(node, ast.ImportFrom):
            base = (
                ".".join([*here.relative_to(SOURCE).parts, *filter(None, [node.module])]) if node.level else node.module
            )
            for each in node.names:
                found += _files_of(here, base or "") + _files_of(here, f"{base}.{each.name}")
    return found


def _files_of(here: Path, module: str) -> list[Path]:
    path = Path(*module.split("."))
    places = [SOURCE, here, Path("bench")]
    return [place / path.with_suffix(".py") for place in places] + [place / path / "__init__.py" for place in places]
