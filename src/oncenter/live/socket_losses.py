"""The kernel's side of a bus that is a socket: frames dropped, buffer size, and a closed peer."""

from __future__ import annotations

import contextlib
import selectors
import socket
import struct
import sys
from pathlib import Path
from typing import Any

HOLD_BYTES = 16 << 20  # the kernel's buffer while this process does not run: seconds of a full bus
_NETWORK = Path("/sys/class/net")
_OF_INTERFACE = ("rx_dropped", "rx_over_errors")  # in the driver, before the frame reaches a socket
_SO_RCVBUFFORCE = 33  # Linux, asm-generic/socket.h: above the system's limit, with the rights for it
_SO_MEMINFO = 55  # Linux: nine counters of a socket, linux/sock_diag.h
_MEMINFO = struct.Struct("=9I")
_MEMINFO_DROPS = 8


class SocketLosses:
    """The frames that one open bus lost; zero for an interface that is no socket.

    Args:
        bus: of python-can.
        channel: its name; for SocketCAN that of the network interface.
    """

    def __init__(self, bus: Any, channel: str) -> None:
        self._socket = _socket_of(bus)
        is_can = self._socket is not None and self._socket.family == getattr(socket, "AF_CAN", None)
        self._files = [_NETWORK / channel / "statistics" / name for name in _OF_INTERFACE] if is_can else []
        if self._socket is not None:
            _hold_more(self._socket)
        self._counted = self._count()

    def new(self) -> int:
        """Frames dropped since the last call."""
        before, self._counted = self._counted, self._count()
        return max(self._counted - before, 0)

    def raise_if_the_peer_closed(self) -> None:
        """Detects a stream closed by the peer, which python-can's socketcand does not report.

        Raises:
            ConnectionError: it is closed.
        """
        if self._socket is None or self._socket.type != socket.SOCK_STREAM:
            return
        with selectors.DefaultSelector() as selector:
            selector.register(self._socket, selectors.EVENT_READ)
            if not selector.select(0.0):
                return
        if not self._socket.recv(1, socket.MSG_PEEK):
            raise ConnectionError("the peer closed the connection")

    def is_of_one_datagram(self, error: Exception) -> bool:
        """Whether an error of `recv` concerns one datagram, which anybody may have sent, and not the bus."""
        if self._socket is None or self._socket.type == socket.SOCK_STREAM:
            return False
        return error.__cause__ is not None and not isinstance(error.__cause__, OSError)

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()

    def _count(self) -> int:
        count = 0
        for file in self._files:
            with contextlib.suppress(OSError, ValueError):
                count += int(file.read_text(encoding="ascii"))
        if sys.platform != "linux" or self._socket is None:
            return count
        if self._socket.type != socket.SOCK_STREAM:  # a stream sends dropped data again
            with contextlib.suppress(OSError, struct.error):
                counters = self._socket.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
                count += _MEMINFO.unpack(counters)[_MEMINFO_DROPS]
        return count


def _socket_of(bus: Any) -> socket.socket | None:
    """A second handle of the bus's socket. Interfaces without `fileno` have it among their members."""
    try:
        number = bus.fileno()
    except Exception:  # each interface has its own exceptions
        members = getattr(bus, "__dict__", {}).values()
        number = next((member.fileno() for member in members if isinstance(member, socket.socket)), -1)
    try:
        return socket.fromfd(number, -1, -1, -1)  # detects family, type and protocol
    except (OSError, ValueError, OverflowError):  # it is no socket
        return None


def _hold_more(own: socket.socket) -> None:
    for option in (_SO_RCVBUFFORCE, socket.SO_RCVBUF) if sys.platform == "linux" else (socket.SO_RCVBUF,):
        with contextlib.suppress(OSError):
            own.setsockopt(socket.SOL_SOCKET, option, HOLD_BYTES)
            return
