"""`cold_steps.py STEPS.json VERB …`: runs that command of oncenter and writes the seconds of reading and answering.

Imports during these steps are not included: they count as start. Waiting for a child process that reads is included.
"""

from __future__ import annotations

import builtins
import functools
import importlib
import json
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import oncenter
from oncenter.cli import main as command_line


class Imports:
    """An `__import__` that sums the seconds of this thread's imports, nested ones only once.

    Args:
        imported: the original function.
    """

    def __init__(self, imported: Callable[..., Any]) -> None:
        self.seconds, self._depth = 0.0, 0
        self._thread, self._imported = threading.get_ident(), imported

    def __call__(self, *given: Any, **named: Any) -> Any:
        if threading.get_ident() != self._thread or self._depth:
            return self._imported(*given, **named)
        self._depth, began = 1, time.perf_counter()
        try:
            return self._imported(*given, **named)
        finally:
            self._depth, self.seconds = 0, self.seconds + time.perf_counter() - began


def timed(work: Callable[..., Any], step: str, imports: Imports, found: dict[str, float]) -> Callable[..., Any]:
    @functools.wraps(work)
    def run(*given: Any, **named: Any) -> Any:
        began, imported = time.perf_counter(), imports.seconds
        try:
            return work(*given, **named)
        finally:
            found[step] = time.perf_counter() - began - (imports.seconds - imported)

    return run


def answer(*given: Any, **named: Any) -> Any:
    from oncenter.offset.run import offset

    return offset(*given, **named)


def main() -> None:
    said, *sys.argv[1:] = sys.argv[1:]
    imports, found = Imports(builtins.__import__), dict[str, float]()
    builtins.__import__ = imports
    room: Any = importlib.import_module("oncenter.read")
    room.read = timed(room.read, "reading_s", imports, found)
    oncenter.offset = timed(answer, "answering_s", imports, found)
    try:
        command_line()
    finally:
        Path(said).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
