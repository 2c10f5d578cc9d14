"""The page's process: Bokeh's server, by default for this machine only, behind the checks below.

A page of another site must not read the drive, not even under a name that resolves to this address (DNS rebinding). So
`Host` and, if present, `Origin` of each request must name this server. Requests are cheap and limited in number; a
document is made only for a viewer with an open socket.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import sys
import time
import warnings
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from bokeh.server.views.ws import WSHandler
from bokeh.util.token import generate_jwt_token, generate_secret_key, generate_session_id
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.web import RequestHandler

from oncenter.live.handed_sockets import taken
from oncenter.live.page import News, page, rendered
from oncenter.live.web import NEXT, READY, Hello

if TYPE_CHECKING:
    from bokeh.document import Document
    from tornado.httputil import HTTPServerRequest
    from tornado.iostream import IOStream

NICE = 10  # recording and estimation get nine tenths of a core that this process competes for
VIEWERS_MAX = 32  # enough for a workshop; at ten updates a second each they fill one core
REQUESTS_PER_S = 20.0  # of one address; opening a page takes ten
REQUESTS_AT_ONCE = 400  # of one address: 32 browsers behind one router that open the page at once
REFUSAL_S = 1.0  # delay of a refusal, which slows down endless requests
ADDRESSES_MAX = 1024  # whose requests are counted; the one silent for longest is dropped
CONNECTIONS_MAX = 256  # open ones; a browser keeps six
_IDLE_S = 10.0  # after which an idle connection is closed
_MESSAGE_MAX_BYTES = 1 << 16  # from a viewer
_FORGET_MS = 200  # between two searches for documents without a viewer


def main() -> None:
    """Takes the pipe and the listening sockets; ends when the other end of the pipe closes."""
    if sys.platform != "win32":  # Windows starts it with a lower priority
        os.nice(NICE)
    pipe, *listening = taken()
    serve(Connection(pipe.detach()), listening)


def serve(pipe: Connection, sockets: list[socket.socket]) -> None:
    for name in ("bokeh", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # a viewer that leaves is no error
    warnings.filterwarnings("ignore", "coroutine 'WSHandler.send_message' was never awaited")  # the same at the end
    hello: Hello = pipe.recv()
    asyncio.set_event_loop(asyncio.SelectorEventLoop())  # Windows' default loop cannot watch sockets by number
    loop = IOLoop.current()
    news = News(hello.first, hello.params, lambda: pipe.send_bytes(NEXT))
    web = Web(news, hello.names)
    http = _Server(web, max_body_size=_MESSAGE_MAX_BYTES, idle_connection_timeout=_IDLE_S)
    for own in sockets:
        own.setblocking(False)
    http.add_sockets(sockets)
    server = BaseServer(loop, web, http)
    server.start()

    def receive(number: int, events: int) -> None:
        try:
            news.update(pipe.recv())
        except (EOFError, OSError):
            loop.remove_handler(number)
            loop.stop()

    loop.add_handler(pipe.fileno(), receive, IOLoop.READ)
    pipe.send_bytes(READY)
    loop.start()
    loop.run_sync(news.end)
    server.stop()
    http.stop()


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


class Web(BokehTornado):  # type: ignore[misc]
    """Checks each request first, and serves only the page, its socket and Bokeh's scripts: Bokeh's other addresses
    would make a document for each request.

    Args:
        news: of the session.
        names: the host names accepted.
    """

    def __init__(self, news: News, names: frozenset[str] | None) -> None:
        def document(doc: Document) -> None:
            page(doc, news)

        super().__init__(
            {"/": Application(FunctionHandler(document))},
            extra_websocket_origins=["*"],  # find_handler has a stricter check before
            websocket_max_message_size_bytes=_MESSAGE_MAX_BYTES,
            unused_session_lifetime_milliseconds=1,
            check_unused_sessions_milliseconds=_FORGET_MS,
            sign_sessions=True,
            secret_key=generate_secret_key().encode(),
        )
        self.viewers = 0
        self._own_names = names
        self._allowance = Allowance(REQUESTS_PER_S, REQUESTS_AT_ONCE)
        self._html = rendered(news, self.resources())

    def find_handler(self, request: HTTPServerRequest, **options: Any) -> Any:
        if not self._allowance.take(request.remote_ip or ""):
            return self._refusal(request, 429, "too many requests: try again later", REFUSAL_S)
        if not is_allowed(request, self._own_names):
            return self._refusal(request, 403, "this host name or this site is not allowed here")
        if request.path in ("/", "/ws") and self.viewers >= VIEWERS_MAX:
            return self._refusal(request, 503, f"the limit of {VIEWERS_MAX} viewers is reached: try again later")
        if request.path == "/":
            return self.get_handler_delegate(request, _Start)
        if request.path == "/ws":
            context = self._applications["/"]
            return self.get_handler_delegate(
                request, _Socket, {"application_context": context, "bokeh_websocket_path": "/ws"}
            )
        if request.path.startswith("/static/"):
            return super().find_handler(request, **options)
        return self._refusal(request, 404, "not found")

    def page_for(self, token: str) -> bytes:
        before, after = self._html
        return before + token.encode() + after

    def _refusal(self, request: HTTPServerRequest, status: int, text: str, after_s: float = 0.0) -> Any:
        return self.get_handler_delegate(request, _Refusal, {"status": status, "text": text, "after_s": after_s})


class _Start(RequestHandler):
    """The page, which then opens its socket with its own token."""

    application: Web

    def get(self) -> None:
        web = self.application
        session = generate_session_id(secret_key=web.secret_key, signed=True)
        self.set_header("Cache-Control", "no-store")
        self.write(web.page_for(generate_jwt_token(session, secret_key=web.secret_key, signed=True)))


class _Socket(WSHandler):  # type: ignore[misc]
    """One viewer."""

    _is_counted = False

    def open(self) -> None:
        self.application.viewers += 1
        self._is_counted = True
        super().open()

    def on_close(self) -> None:
        self.application.viewers -= self._is_counted
        self._is_counted = False
        super().on_close()


class _Refusal(RequestHandler):
    def initialize(self, status: int, text: str, after_s: float) -> None:
        self._given = status, text, after_s

    async def prepare(self) -> None:
        status, text, after_s = self._given
        await asyncio.sleep(after_s)
        self.set_status(status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"oncenter: {text}\n")


class _Server(HTTPServer):
    def handle_stream(self, stream: IOStream, address: tuple[Any, ...]) -> None:
        if len(self._connections) >= CONNECTIONS_MAX:
            stream.close()
            return
        super().handle_stream(stream, address)


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
