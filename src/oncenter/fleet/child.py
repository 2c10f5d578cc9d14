"""`python -m oncenter.fleet.child`: answers logs for a parent that watches it, see `oncenter.files.child`."""

from __future__ import annotations

import gc
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from oncenter.files.child import Send, serve
from oncenter.fleet.drive import Work
from oncenter.fleet.files import LogFile
from oncenter.fleet.trucks import Trucks


@lru_cache(maxsize=1)
def _work(night: str, vehicles: str, reports: str | None) -> Work:
    """Vehicle files are read once a run: a child may live for several runs."""
    return Work(Trucks(Path(vehicles)), None if reports is None else Path(reports))


def _answer(request: Mapping[str, Any], send: Send) -> None:
    work = _work(request["night"], request["vehicles"], request["reports"])
    send({"row": work(_log_of(request["log"])), "last": True})


def _log_of(given: Mapping[str, Any]) -> LogFile:
    return LogFile(
        **{**given, "known": tuple(map(tuple, given["known"])), "former": tuple(map(_log_of, given["former"]))}
    )


if __name__ == "__main__":
    gc.freeze()  # loaded modules stay, so the collector need not scan them after each drive
    serve(_answer)
