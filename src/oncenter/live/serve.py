"""The page's process: tornado's own handlers, by default for this machine only, behind the checks below.

A page of another site must not read the drive, not even under a name that resolves to this address (DNS rebinding). So
`Host` and, if present, `Origin` of each request must name this server. Requests are cheap and limited in number.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import re
import socket
import sys
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any
from urllib.parse import urlsplit

from tornado.http1connection import HTTP1Connection
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.iostream import IOStream, StreamClosedError
from tornado.web import Application, HTTPError, RequestHandler

from oncenter.live.handed_sockets import taken
from oncenter.live.page import News, rendered
from oncenter.live.web import NEXT, READY, Hello

NICE = 10  # recording and estimation get nine tenths of a core that this process competes for
VIEWERS_MAX = 32  # enough for a workshop
REQUESTS_PER_S = 20.0  # of one address; opening a page takes five
REQUESTS_AT_ONCE = 400  # of one address: 32 browsers behind one router that open the page at once, and again
REFUSAL_S = 1.0  # delay of a refusal, which slows down endless requests
ADDRESSES_MAX = 1024  # whose requests are counted; the one silent for longest is dropped
CONNECTIONS_MAX = 256  # open ones; a browser keeps six
SLOW_S = (
    60.0  # a viewer who takes longer for an event, or for a part of a file, is cut off; the page comes back by itself
)
_REQUEST_S = 10.0  # for a request's header, and for its body; an unfinished one is closed
_REQUEST_MAX_BYTES = 1 << 14
_UNREAD_MAX_BYTES = 1 << 16  # in the kernel for one viewer: more would only be outdated; and of a file, here

_HEADERS = {
    # The browser may load from this server only, whatever the page or a library in it tries; BokehJS writes styles.
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self'; font-src data:; form-action 'none'; base-uri 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Server": "oncenter",
}


def main() -> None:
    """Takes the pipe and the listening sockets; ends when the other end of the pipe closes."""
    if sys.platform != "win32":  # Windows starts it with a lower priority
        os.nice(NICE)
    pipe, *listening = taken()
    serve(Connection(pipe.detach()), listening)


def serve(pipe: Connection, sockets: list[socket.socket]) -> None:
    logging.getLogger("tornado").setLevel(logging.CRITICAL)  # a viewer that leaves is no error
    # Windows' default loop cannot watch sockets by number
    with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
        runner.run(_serve(pipe, sockets))


async def _serve(pipe: Connection, sockets: list[socket.socket]) -> None:
    hello: Hello = pipe.recv()
    news = News(hello.first, hello.params, lambda: pipe.send_bytes(NEXT))
    server = _Server(
        application(news, hello.names),
        idle_connection_timeout=_REQUEST_S,
        body_timeout=_REQUEST_S,
        max_header_size=_REQUEST_MAX_BYTES,
        max_body_size=_REQUEST_MAX_BYTES,
    )
    for own in sockets:
        own.setblocking(False)
        own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _UNREAD_MAX_BYTES)  # its connections inherit it
    server.add_sockets(sockets)
    over = asyncio.Event()

    def receive() -> None:
        try:
            news.update(pipe.recv())
        except (EOFError, OSError):
            loop.remove_reader(pipe.fileno())
            over.set()

    loop = asyncio.get_running_loop()
    loop.add_reader(pipe.fileno(), receive)
    pipe.send_bytes(READY)
    await over.wait()
    await news.end()
    server.stop()
    await server.close_all_connections()


class Allowance:
    """A rate limit for each address, with a burst after a pause (token bucket).

    Args:
        per_s, at_once: requests of one address.
        clock: s.
    """

    def __init__(self, per_s: float, at_once: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._per_s, self._at_once, self._clock = per_s, at_once, clock
        self._left: dict[str, tuple[float, float]] = {}  # by address: tokens left, time; in order of the last request

    def take(self, address: str) -> bool:
        """Whether one more request is allowed."""
        now = self._clock()
        left, then = self._left.pop(address, (self._at_once, now))
        left = min(left + (now - then) * self._per_s, self._at_once)
        allowed = left >= 1.0
        self._left[address] = (left - allowed, now)
        if len(self._left) > ADDRESSES_MAX:
            del self._left[next(iter(self._left))]
        return allowed


def application(news: News, names: frozenset[str] | None) -> Application:
    """
    Args:
        news: of the session.
        names: the host names accepted.
    """
    contents = rendered(news).items()
    return Application(
        [
            *(
                (re.escape(path), _File, {"kind": kind, "content": content.encode()})
                for path, (kind, content) in contents
            ),
            ("/events", _Events, {"news": news}),
        ],
        default_handler_class=_Guarded,
        log_function=lambda _: None,
        names=names,
        allowance=Allowance(REQUESTS_PER_S, REQUESTS_AT_ONCE),
        viewers=set(),
    )


class _Server(HTTPServer):
    """A connection beyond the limit takes the place of the oldest one that is no viewer's."""

    _streams: tuple[IOStream, ...] = ()

    def handle_stream(self, stream: IOStream, address: tuple[Any, ...]) -> None:
        assert isinstance(self.request_callback, Application)
        viewers = self.request_callback.settings["viewers"]
        self._streams = (*(own for own in self._streams if not own.closed()), stream)
        if len(self._streams) > CONNECTIONS_MAX:
            next(own for own in self._streams if own not in viewers).close()
        super().handle_stream(stream, address)


def _stream_of(handler: RequestHandler) -> IOStream:
    connection = handler.request.connection
    assert isinstance(connection, HTTP1Connection)  # the only one of tornado's server
    return connection.stream


class _Guarded(RequestHandler):
    """Checks each request first; nothing else is here without a class of its own. A refusal is one line of text."""

    def set_default_headers(self) -> None:
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    async def prepare(self) -> None:
        """
        Raises:
            HTTPError: the request is refused.
        """
        if not self.settings["allowance"].take(self.request.remote_ip or ""):
            await asyncio.sleep(REFUSAL_S)
            raise HTTPError(429, reason="too many requests: try again later")
        if not is_allowed(self.request, self.settings["names"]):
            raise HTTPError(403, reason="this host name or this site is not allowed here")
        if type(self) is _Guarded:
            raise HTTPError(404, reason="not found")

    def refuse_beyond_viewers(self) -> None:
        """
        Raises:
            HTTPError: no other viewer is let in.
        """
        if len(self.settings["viewers"]) >= VIEWERS_MAX:
            raise HTTPError(503, reason=f"the limit of {VIEWERS_MAX} viewers is reached: try again later")

    async def send(self, part: bytes) -> None:
        """Waits until it is taken: no other one waits here meanwhile.

        Raises:
            StreamClosedError: who asked is too slow, or has left.
        """
        self.write(part)
        try:
            await asyncio.wait_for(self.flush(), SLOW_S)
        except TimeoutError:
            _stream_of(self).close()
            raise StreamClosedError from None

    def write_error(self, status_code: int, **_: object) -> None:
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"oncenter: {self._reason}\n")


class _File(_Guarded):
    def initialize(self, kind: str, content: bytes) -> None:
        self._kind, self._content = kind, content

    async def get(self) -> None:
        if self.request.path == "/":
            self.refuse_beyond_viewers()
        self.set_header("Content-Type", f"{self._kind}; charset=utf-8")
        with contextlib.suppress(StreamClosedError):
            for begin in range(0, len(self._content), _UNREAD_MAX_BYTES):
                await self.send(self._content[begin : begin + _UNREAD_MAX_BYTES])


class _Events(_Guarded):
    """One viewer, as server-sent events."""

    _following: asyncio.Task[None] | None = None

    def initialize(self, news: News) -> None:
        self._news = news

    async def get(self) -> None:
        self.refuse_beyond_viewers()
        stream = _stream_of(self)
        stream.set_nodelay(True)
        self.set_header("Content-Type", "text/event-stream")
        viewers = self.settings["viewers"]
        viewers.add(stream)
        self._following = self._news.begin(self.send)
        (failure,) = await asyncio.gather(self._following, return_exceptions=True)
        viewers.discard(stream)
        if failure is not None:  # he is too slow, or has left
            self.detach().close()

    def on_connection_close(self) -> None:
        if self._following is not None:
            self._following.cancel()


def is_allowed(request: HTTPServerRequest, names: frozenset[str] | None) -> bool:
    """Whether `Host` is one of the names (if None, the address of the connection) with this port, and `Origin`, if
    present, is the same."""
    headers = request.headers
    if headers.get("Sec-Fetch-Site") == "cross-site" and headers.get("Sec-Fetch-Dest") != "document":
        return False  # a frame, image or script in another site's page; a link from there is harmless
    host = headers.get_list("Host")
    origin = headers.get_list("Origin")
    stream = getattr(request.connection, "stream", None)
    if len(host) != 1 or len(origin) > 1 or stream is None or stream.socket is None:
        return False
    own_address, own_port = stream.socket.getsockname()[:2]
    try:
        requested = urlsplit(f"//{host[0]}")
        name, port = requested.hostname, requested.port or 80
    except ValueError:
        return False
    accepted = names if names is not None else {_plain(own_address), socket.gethostname().lower()}
    if name not in accepted or port != own_port:
        return False
    return not origin or origin[0].lower() == f"http://{host[0].lower()}"


def _plain(address: str) -> str:
    return address.split("%")[0].removeprefix("::ffff:")


if __name__ == "__main__":
    main()
