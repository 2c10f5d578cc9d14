"""A planted fault in one line, kept as file, function, expression and replacement: edits elsewhere do not move it."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

import in_c
import in_python

ROOT = Path(__file__).parents[1]
KEPT = Path(__file__).with_name("faults.toml")

_WORD = re.compile(r"(?:[\w.\[\]]|->)+|[^\w\s]")


@dataclass(frozen=True)
class Fault:
    number: int
    room: str
    kind: str
    file: str
    function: str
    expression: str
    replacement: str
    excused: str = ""  # the reason why no check can find it


@dataclass(frozen=True)
class Edit:
    """A possible fault: text[start:end] becomes `new`, all in one line."""

    kind: str
    function: str
    start: int
    end: int
    new: str


def kept_faults() -> list[Fault]:
    return [Fault(**row) for row in tomllib.loads(KEPT.read_text(encoding="utf-8"))["fault"]]


def functions(file: str, text: str) -> list[tuple[str, int, int]]:
    """Name, begin and end of each function."""
    return in_python.functions(text) if file.endswith(".py") else in_c.functions(text)


def places(function: str, expression: str, file: str, text: str) -> list[int]:
    """Where the expression stands in the functions of that name, in whole words."""
    before = r"(?<!\w)" if re.match(r"\w", expression) else ""
    after = r"(?!\w)" if re.search(r"\w$", expression) else ""
    whole = re.compile(before + re.escape(expression) + after)
    spans = [(begin, end) for name, begin, end in functions(file, text) if name == function]
    return [hit.start() for begin, end in spans for hit in whole.finditer(text, begin, end)]


def planted(fault: Fault, text: str) -> str:
    """The text of its file with the fault."""
    found = places(fault.function, fault.expression, fault.file, text)
    if len(found) != 1:
        raise LookupError(
            f"fault {fault.number}: {fault.file}, {fault.function} has {len(found)} times {fault.expression!r}, "
            "needed is 1: correct it in faults/faults.toml"
        )
    return text[: found[0]] + fault.replacement + text[found[0] + len(fault.expression) :]


def kept_form(edit: Edit, file: str, text: str) -> tuple[str, str] | None:
    """Expression and replacement: the words of the line around the edit, as few as are unique in the function."""
    begin = text.rindex("\n", 0, edit.start) + 1
    line = text[begin : text.index("\n", begin)]
    words = [(begin + hit.start(), begin + hit.end()) for hit in _WORD.finditer(line)]
    first = max((k for k, word in enumerate(words) if word[0] <= edit.start), default=0)
    last = min((k for k, word in enumerate(words) if word[1] >= edit.end), default=len(words) - 1)
    for more in range(2, len(words) + 2):
        start, end = words[max(first - more, 0)][0], words[min(last + more, len(words) - 1)][1]
        expression = text[start:end]
        if len(places(edit.function, expression, file, text)) == 1:
            return expression, text[start : edit.start] + edit.new + text[edit.end : end]
    return None
