"""A CAN bus through python-can: a thread only receives, so that other work loses no frame."""

from __future__ import annotations

import contextlib
import logging
import re
import socket
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

from oncenter.errors import LOG_CANNOT_BE_ANSWERED, WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.live.snapshot import Dropped
from oncenter.live.socket_losses import SocketLosses
from oncenter.read.clock import LATEST_S
from oncenter.read.frames import Frames, frames_of_rows
from oncenter.read.other_lines import row

if TYPE_CHECKING:
    import can

WAITING_MAX = 500_000  # frames, minutes of a full bus; later frames are dropped and counted
TRY_AGAIN_S = 1.0  # after a bus was lost; twice as long after each failure
TRY_AGAIN_MAX_S = 30.0  # short for a gateway that boots, cheap for one that is off all night
COUNT_EVERY_S = 1.0  # between two readings of the kernel's loss counters
_ANSWER_S = 5.0  # a gateway that accepts a connection and then says nothing counts as lost
_RECEIVE_S = 0.25  # between two checks for the end
_LAST_S = 0.5  # at the end, for frames still in the kernel
_STUCK_S = 10.0  # at the end, after which a driver that does not return is left
_NAME = re.compile(r"[!-~]{1,64}")  # of a channel, as candump's format allows it
_EXTENDED_MAX, _STANDARD_MAX = (1 << 29) - 1, (1 << 11) - 1
_BYTES_MAX, _FD_BYTES_MAX = 8, 64


class Bus:
    """One channel. Receives from its construction on, and opens the bus again when it is lost.

    Args:
        channel, interface: python-can's names.
        bitrate: bit/s, for interfaces that need it.
        say: called with one line when the bus is lost, and when frames come again.

    Raises:
        OncenterError: "bus": the interface is unknown or cannot be opened; "missing_extra": python-can is not
            installed, or a package that this interface needs.
    """

    def __init__(self, channel: str, interface: str, bitrate: int | None, say: Callable[[str], None]) -> None:
        self.name = f"{channel} ({interface})"
        require_package("can", f"the bus {channel}")
        if interface == "udp_multicast":
            require_package("msgpack", f"--interface {interface}")
        self._channel, self._interface, self._bitrate, self._say = channel, interface, bitrate, say
        self._lock = threading.Lock()
        self._waiting: list[can.Message] = []
        self._queue_lost = self._impossible = self._interface_lost = 0
        self._arrived = threading.Event()
        self._stopping = threading.Event()
        self._lost_s: float | None = None  # monotonic time of the loss of the bus
        self._again_s = TRY_AGAIN_S
        self._count_s = 0.0
        logging.getLogger("can").addHandler(logging.NullHandler())  # this class reports python-can's messages once
        self._bus: can.BusABC | None = self._opened()
        self._thread = threading.Thread(target=self._receive, name="oncenter bus", daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> Dropped:
        return Dropped(interface=self._interface_lost, queue=self._queue_lost, impossible=self._impossible)

    def take(self, timeout_s: float) -> list[can.Message]:
        """All frames since the last call; waits for the first one."""
        self._arrived.wait(timeout_s)
        with self._lock:
            taken, self._waiting = self._waiting, []
            self._arrived.clear()
        return taken

    def close(self) -> None:
        self._stopping.set()
        self._thread.join(_STUCK_S)

    def _opened(self) -> can.BusABC:
        import can

        options: dict[str, Any] = {} if self._bitrate is None else {"bitrate": self._bitrate}
        try:
            with self._answering_in_time():
                bus = can.Bus(channel=self._channel, interface=self._interface, **options)
        except can.CanInterfaceNotImplementedError as error:
            raise self._cannot_open(error, WRONG_USAGE) from error
        except Exception as error:  # each interface has its own exceptions
            raise self._cannot_open(error, LOG_CANNOT_BE_ANSWERED) from error
        self._losses = SocketLosses(bus, self._channel)
        return bus

    @contextlib.contextmanager
    def _answering_in_time(self) -> Iterator[None]:
        """python-can's socketcand retries a refusing peer for 10 s without a pause, and waits for a silent one for
        ever."""
        if self._interface != "socketcand":
            yield
            return
        from can.util import load_config

        config = load_config(config={"interface": self._interface, "channel": self._channel})
        if "host" in config and "port" in config:
            socket.create_connection((config["host"], int(config["port"])), _ANSWER_S).close()
        before = socket.getdefaulttimeout()
        socket.setdefaulttimeout(_ANSWER_S)
        try:
            yield
        finally:
            socket.setdefaulttimeout(before)

    def _cannot_open(self, error: Exception, exit_code: int) -> OncenterError:
        import can

        names = ", ".join(sorted(can.VALID_INTERFACES))
        interfaces = f"; interfaces of python-can: {names}" if exit_code == WRONG_USAGE else ""
        return OncenterError(f"cannot open {self.name}: {_reason(error)}{interfaces}", code="bus", exit_code=exit_code)

    def _receive(self) -> None:
        while not self._stopping.is_set():
            try:
                self._receive_one(_RECEIVE_S)
            except Exception as error:  # drivers raise anything
                if self._losses.is_of_one_datagram(error):
                    self._discard("that cannot be read")
                else:
                    self._come_back(error)
        with contextlib.suppress(Exception):
            until_s = time.monotonic() + _LAST_S
            while self._bus is not None and self._receive_one(0.0) and time.monotonic() < until_s:
                pass
        self._shut()

    def _receive_one(self, timeout_s: float) -> bool:
        """Whether there was a message."""
        assert self._bus is not None
        message = self._bus.recv(timeout_s)
        if message is None:
            self._losses.raise_if_the_peer_closed()
        else:
            self._keep(message)
        now = time.monotonic()
        if now >= self._count_s:
            self._count_s = now + COUNT_EVERY_S
            self._interface_lost += self._losses.new()
        return message is not None

    def _keep(self, message: can.Message) -> None:
        if not _is_possible(message):
            self._discard("with an identifier, length or time that is impossible on CAN")
            return
        if not _is_name(message.channel):
            message.channel = None  # the name goes into the recording, and a gateway may send any
        message.timestamp = round(message.timestamp, 6)  # to the resolution of a log
        with self._lock:
            if len(self._waiting) < WAITING_MAX:
                self._waiting.append(message)
            else:
                self._queue_lost += 1
            self._arrived.set()
        if self._lost_s is not None:
            self._say(f"{self.name} is back after {time.monotonic() - self._lost_s:.0f} s")
            self._lost_s, self._again_s = None, TRY_AGAIN_S

    def _discard(self, what: str) -> None:
        self._impossible += 1
        if self._impossible == 1:
            self._say(f"{self.name} sent a frame {what}: such frames are discarded and counted")

    def _come_back(self, error: Exception) -> None:
        """Tries to open the bus again, until it opens or the session ends. The loss is reported once, also if the bus
        opens and is lost again before a frame comes."""
        if self._lost_s is None:
            self._lost_s = time.monotonic()
            self._say(
                f"{self.name} is lost: {_reason(error)}; oncenter tries to open it again, "
                f"after {TRY_AGAIN_S:.0f} s first, at least every {TRY_AGAIN_MAX_S:.0f} s"
            )
        self._shut()
        while not self._stopping.wait(self._again_s):
            self._again_s = min(2.0 * self._again_s, TRY_AGAIN_MAX_S)
            with contextlib.suppress(OncenterError):
                self._bus = self._opened()
                return

    def _shut(self) -> None:
        if self._bus is None:
            return
        self._interface_lost += self._losses.new()
        self._losses.close()
        with contextlib.suppress(Exception):  # a lost bus may fail to close
            self._bus.shutdown()
        self._bus = None


def _is_possible(message: can.Message) -> bool:
    """Gateways pass on anything: numbers that no CAN frame can have must reach neither columns nor files."""
    identifier = message.arbitration_id
    if type(identifier) is not int or type(message.data) is not bytearray:
        return False
    identifier_max = _EXTENDED_MAX if message.is_extended_id else _STANDARD_MAX
    bytes_max = _FD_BYTES_MAX if message.is_fd else _BYTES_MAX
    return 0 <= identifier <= identifier_max and len(message.data) <= bytes_max and abs(message.timestamp) < LATEST_S


def _is_name(channel: Any) -> bool:
    if channel is None or type(channel) is int:
        return True
    return type(channel) is str and _NAME.fullmatch(channel) is not None


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:160] or type(error).__name__


def data_frames(messages: Iterable[can.Message]) -> Frames:
    """The data frames of CAN and CAN FD: no error frames and no remote frames."""
    return frames_of_rows(
        [
            row(m.timestamp, m.arbitration_id, m.is_extended_id, m.data, m.channel)
            for m in messages
            if not (m.is_error_frame or m.is_remote_frame)
        ]
    )
