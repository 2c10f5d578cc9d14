"""A CAN bus through python-can: a thread that only receives, so that nobody else's work costs a frame."""

from __future__ import annotations

import contextlib
import os
import socket
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from oncenter.errors import LOG_CANNOT_BE_ANSWERED, WRONG_USAGE, OncenterError

if TYPE_CHECKING:
    import can

WAITING_MAX = 500_000  # frames, minutes of a full bus; beyond, frames are dropped and counted
TRY_AGAIN_S = 1.0
_RECEIVE_S = 0.25  # between two looks whether to stop
_SOCKET_BYTES = 4 << 20  # what the kernel keeps meanwhile: a second of a full bus


class Bus:
    """One channel, received from as soon as it is made, opened again when it is lost.

    Args:
        channel, interface: as python-can names them.
        bitrate: bit/s, for interfaces that must be told.
        say: is told in one line when the bus is lost and when it is back.

    Raises:
        OncenterError: "bus": the interface is unknown or cannot be opened.
    """

    def __init__(self, channel: str, interface: str, bitrate: int | None, say: Callable[[str], None]) -> None:
        self.name = f"{channel} ({interface})"
        self.dropped = 0
        self._channel, self._interface, self._bitrate, self._say = channel, interface, bitrate, say
        self._lock = threading.Lock()
        self._waiting: list[can.Message] = []
        self._arrived = threading.Event()
        self._stopping = threading.Event()
        self._bus: can.BusABC | None = self._opened()
        self._thread = threading.Thread(target=self._receive, name="oncenter bus", daemon=True)
        self._thread.start()

    def take(self, timeout_s: float) -> list[can.Message]:
        """All that has come since; waits for the first one."""
        self._arrived.wait(timeout_s)
        with self._lock:
            taken, self._waiting = self._waiting, []
            self._arrived.clear()
        return taken

    def close(self) -> None:
        self._stopping.set()
        self._thread.join()

    def _opened(self) -> can.BusABC:
        import can

        options: dict[str, Any] = {} if self._bitrate is None else {"bitrate": self._bitrate}
        try:
            bus = can.Bus(channel=self._channel, interface=self._interface, **options)
        except can.CanInterfaceNotImplementedError as error:
            raise self._cannot_open(error, WRONG_USAGE) from error
        except Exception as error:  # each interface has its own
            raise self._cannot_open(error, LOG_CANNOT_BE_ANSWERED) from error
        _keep_more_in_the_kernel(bus)
        return bus

    def _cannot_open(self, error: Exception, exit_code: int) -> OncenterError:
        import can

        known = f"; python-can knows {', '.join(sorted(can.VALID_INTERFACES))}" if exit_code == WRONG_USAGE else ""
        return OncenterError(f"cannot open {self.name}: {_reason(error)}{known}", code="bus", exit_code=exit_code)

    def _receive(self) -> None:
        while not self._stopping.is_set():
            try:
                assert self._bus is not None
                message = self._bus.recv(_RECEIVE_S)
            except Exception as error:  # of a driver: whatever it is, the bus is gone
                self._come_back(error)
                continue
            if message is not None:
                self._keep(message)
        if self._bus is not None:
            _shut(self._bus)

    def _keep(self, message: can.Message) -> None:
        message.timestamp = round(message.timestamp, 6)  # as a log has it
        with self._lock:
            if len(self._waiting) < WAITING_MAX:
                self._waiting.append(message)
            else:
                self.dropped += 1
            self._arrived.set()

    def _come_back(self, error: Exception) -> None:
        """Until the bus can be opened again, or nobody wants it any more."""
        lost_s = time.monotonic()
        self._say(f"{self.name} is lost: {_reason(error)}; trying every second to open it again")
        if self._bus is not None:
            _shut(self._bus)
            self._bus = None
        while not self._stopping.wait(TRY_AGAIN_S):
            try:
                self._bus = self._opened()
            except OncenterError:
                continue
            self._say(f"{self.name} is back after {time.monotonic() - lost_s:.0f} s")
            return


def _shut(bus: can.BusABC) -> None:
    with contextlib.suppress(Exception):  # a lost one may fail to close
        bus.shutdown()


def _keep_more_in_the_kernel(bus: can.BusABC) -> None:
    """Where the bus is a socket: what comes while this process does not run is not lost."""
    try:
        own = socket.socket(fileno=os.dup(bus.fileno()))
    except (OSError, NotImplementedError, ValueError):
        return
    with contextlib.closing(own), contextlib.suppress(OSError):
        own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SOCKET_BYTES)


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:160] or type(error).__name__
