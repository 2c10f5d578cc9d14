"""The session's side of the page: another process serves it, so that no viewer can delay a frame.

The page's process requests a snapshot when one of its viewers waits for it; a thread then sends the newest one. A slow
page requests fewer, and without a viewer nothing is sent.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import subprocess
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from oncenter.app.guard import bound, new_key, url_of
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.live.handed_sockets import begin
from oncenter.live.snapshot import Snapshot

if TYPE_CHECKING:
    from oncenter.live.session import Session

READY, NEXT = b"ready", b"next"  # messages of the page's process
_END_S = 3.0  # for the last snapshot to reach the viewers; then the page's process is killed
_REQUESTED_EVERY_S = 0.25  # between two checks for the end while no viewer waits


@dataclass(frozen=True)
class Hello:
    """The first message to the page's process."""

    first: Snapshot
    params: Mapping[str, float]
    address: str
    key: str


class Page:
    """Serves a session's snapshots; ends when its context ends.

    Args:
        session: its snapshots are shown.
        params: of its core.
        address: a name or address of this machine; "0.0.0.0" or "::" for all.
        port: 0 for any free port.
        say: called with one line if the page's process ends before the session.

    Raises:
        OncenterError: "web", exit code 2: the page cannot be served there.
    """

    def __init__(
        self, session: Session, params: Mapping[str, float], address: str, port: int, say: Callable[[str], None]
    ) -> None:
        self._sockets = bound(address, port)
        self.port: int = self._sockets[0].getsockname()[1]
        self._address, self._key = address, new_key()
        self.url = url_of(address, self.port, self._key)
        self._session, self._params, self._say = session, dict(params), say
        self._newer = threading.Event()
        self._over = False
        self._thread = threading.Thread(target=self._send, name="oncenter page", daemon=True)

    def __enter__(self) -> Page:
        self._process, self._socket = self._started()
        self._pipe = Connection(self._socket.dup().detach())
        try:
            self._pipe.send(Hello(self._session.snapshot, self._params, self._address, self._key))
            self._pipe.recv_bytes()
        except (EOFError, OSError):
            raise OncenterError(
                f"cannot serve a page: its process ended with code {self._process.wait()} before it was ready",
                code="web",
                exit_code=WRONG_USAGE,
            ) from None
        self._session.when_shown = self._newer.set
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over = True
        self._newer.set()
        self._thread.join(_END_S)
        self._socket.close()
        try:
            self._process.wait(_END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._thread.join()
        self._pipe.close()

    def _started(self) -> tuple[subprocess.Popen[bytes], socket.socket]:
        ours, theirs = socket.socketpair()
        with theirs:
            process = begin("oncenter.live.serve", [theirs, *self._sockets])
        for own in self._sockets:
            own.close()
        return process, ours

    def _send(self) -> None:
        """Pickled, since both ends are this program and the pipe is private; only in this direction, so that nothing
        from the process that strangers can reach is unpickled here."""
        sent = 0
        with contextlib.suppress(ConnectionError):
            while self._is_requested():
                while self._session.snapshot.number == sent and not self._over:
                    self._newer.clear()
                    if self._session.snapshot.number == sent and not self._over:
                        self._newer.wait()
                newest = self._session.snapshot
                self._pipe.send(newest)
                sent = newest.number
            if self._over:
                self._pipe.send(self._session.snapshot)
        if not self._over:
            self._say(f"the page has ended: its process ended with code {self._process.wait()}; the session continues")
        self._pipe.close()

    def _is_requested(self) -> bool:
        try:
            with selectors.DefaultSelector() as selector:
                selector.register(self._socket, selectors.EVENT_READ)
                while not selector.select(_REQUESTED_EVERY_S):
                    if self._over:
                        return False
            return self._pipe.recv_bytes() == NEXT
        except (EOFError, OSError, ValueError):  # ValueError: our end is closed
            return False
