"""Which trucks of a fleet need a calibration, since when, and how certain that is: millions of logs as three tables.

`run` answers new logs and writes tables and page; `query` runs SQL on the tables.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from oncenter.fleet.night import Summary as Summary
    from oncenter.fleet.night import run as run
    from oncenter.fleet.sql import query as query

_HOMES = {"Summary": "night", "query": "sql", "run": "night"}

__all__ = ["Summary", "query", "run"]


def __getattr__(name: str) -> Any:
    """Imports late: its modules take longer to load than most commands run.

    Raises:
        OncenterError: "missing_extra": a package of the extra `fleet` is not installed.
    """
    if name not in _HOMES:
        raise AttributeError(f"module 'oncenter.fleet' has no attribute '{name}'")
    from importlib import import_module

    from oncenter.files.extra import require_package

    if _HOMES[name] == "night":
        for package in ("blake3", "bokeh"):
            require_package(package, "oncenter fleet run", "fleet")
    return getattr(import_module(f"oncenter.fleet.{_HOMES[name]}"), name)
