"""A log is answered in a child process: one that crashes its reader, hangs or takes too much memory costs one row."""

from __future__ import annotations

import os
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.files.child import ChildDied, borrowed, limits_for
from oncenter.files.file_name import printable_name
from oncenter.fleet.files import LogFile, refuse_no_file
from oncenter.fleet.trucks import Trucks

ANSWERER = "oncenter.fleet.child"


@dataclass(frozen=True)
class Watched:
    """The inputs of every answer: plain data, so that it can be sent to another machine.

    Attributes:
        trucks: the vehicle files.
        reports: folder for each drive's page, or None.
        night: differs from one run to the next.
    """

    trucks: Trucks
    reports: Path | None = None
    night: str = field(default_factory=lambda: str(time.time_ns()))

    def __call__(self, log: LogFile) -> dict[str, Any]:
        """The row of `tables.DRIVES`; times in s since 1970. A log without an answer gets a row with its error."""
        try:
            refuse_no_file(log)
        except OncenterError as error:
            return self._refused(log, error)
        try:
            return self._answered(log)
        except ChildDied as died:
            if not died.by_kill:
                return self._refused(log, died.of(printable_name(log.uri)))
        try:  # when memory runs out the system kills the largest process: that need not be the fault of this log
            return self._answered(log)
        except ChildDied as died:
            return self._refused(log, died.of(printable_name(log.uri))) | {"was_killed": died.by_kill}

    def _answered(self, log: LogFile) -> dict[str, Any]:
        request = {
            "log": asdict(log),
            "night": self.night,
            "vehicles": os.fspath(self.trucks.folder),
            "reports": None if self.reports is None else os.fspath(self.reports),
        }
        size = log.size + sum(former.size for former in log.former)
        with borrowed(ANSWERER) as child:
            *_, (said, _) = child.ask(request, limits_for(size + self.trucks.dbc_size(log.uri)))
        row: dict[str, Any] = said["row"]
        return row

    def _refused(self, log: LogFile, error: OncenterError) -> dict[str, Any]:
        truck = self.trucks.by_path(log.uri)
        return {
            "log": printable_name(log.uri),
            "truck": truck.name if truck else "",
            "vehicle_file": truck.vehicle_file if truck else None,
            "version": _core.version(),
            "key": "",
            "error_code": error.code,
            "error": str(error),
            "settings": self.trucks.settings(truck.vehicle_file if truck else None),
        }
