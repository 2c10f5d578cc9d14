"""The result and the sensor's trouble code on a J1939 bus, through an application of the can-j1939 package."""

from __future__ import annotations

import math
from typing import Any, Protocol

from oncenter import _core
from oncenter.bus.monitor import Monitor
from oncenter.signals import DEGREE

RESULT_EVERY_S = 0.1
DM1_EVERY_S = 1.0
OFFSET_MAX_RAD = 5.0 * DEGREE  # tuned: lane keeping and stability control need less


class Application(Protocol):
    """The part of `j1939.ControllerApplication` in use; its address is claimed."""

    def send_pgn(self, data_page: int, pdu_format: int, pdu_specific: int, priority: int, data: list[int]) -> Any: ...


class Announcer:
    """Sends the results of a monitor, in the caller's thread.

    Args:
        application: of can-j1939.
        monitor: source of the results.
        offset_max_rad: limit of the offset; trouble where the whole interval is beyond it.
    """

    def __init__(self, application: Application, monitor: Monitor, *, offset_max_rad: float = OFFSET_MAX_RAD) -> None:
        self._application = application
        self._monitor = monitor
        self._offset_max_rad = offset_max_rad
        self._trouble = _core.Trouble()
        self._last_sent = self._trouble.payload()
        self._counter = 0
        self._next_result_s = self._next_dm1_s = -math.inf

    def announce(self, time_s: float) -> None:
        """Once after each `Monitor.step`: sends the messages that are due, a change of trouble at once."""
        self._monitor.update(self._trouble, self._offset_max_rad)
        trouble = self._trouble.payload()
        if time_s >= self._next_dm1_s or trouble != self._last_sent:
            self._next_dm1_s, self._last_sent = time_s + DM1_EVERY_S, trouble
            self._send(_core.DM1_PGN, trouble)
        if time_s >= self._next_result_s:
            self._next_result_s = time_s + RESULT_EVERY_S
            self._send(_core.MESSAGE_PGN, self._monitor.message(self._counter))
            self._send(_core.MESSAGE_PARTS_PGN, self._monitor.message_parts(self._counter))
            self._counter = (self._counter + 1) % 16

    def _send(self, pgn: int, payload: bytes) -> None:
        self._application.send_pgn(0, pgn >> 8, pgn & 0xFF, 6, list(payload))
