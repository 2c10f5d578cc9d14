"""The page's own process: Bokeh's server, for this machine alone unless told otherwise, behind what follows.

A page of another site must not read what is driven here, nor may it come by a name that it has bent to our address:
each request says by `Host` whom it means and by `Origin` whose page asks, and both must be us. A request costs next to
nothing, and there is no more than so many of them; a document is made only for a viewer whose socket is open.
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

NICE = 10  # recording and estimation get nine tenths of a core that this process wants as well
VIEWERS_MAX = 32  # a workshop's; at ten pictures a second each they fill one core
REQUESTS_PER_S = 20.0  # of one address; a page that is opened asks for ten
REQUESTS_AT_ONCE = 400  # of one address: as many as 32 browsers behind one router ask for, when all open it at once
REFUSAL_S = 1.0  # after which a request too many is refused: who asks without end waits without end
ADDRESSES_MAX = 1024  # whose requests are counted; the one that was silent for longest is forgotten
CONNECTIONS_MAX = 256  # open ones; a browser keeps six
_IDLE_S = 10.0  # after which a connection that asks for nothing is closed
_MESSAGE_MAX_BYTES = 1 << 16  # from a viewer, who has little to say
_FORGET_MS = 200  # how often documents are looked for whose viewer is gone


def main() -> None:
    """Takes the pipe and the listening sockets; ends when the other end of the pipe is closed."""
    if sys.platform != "win32":  # there it begins with a lower priority
        os.nice(NICE)
    pipe, *listening = taken()
    serve(Connection(pipe.detach()), listening)


def serve(pipe: Connection, sockets: list[socket.socket]) -> None:
    for name in ("bokeh", "tornado"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # a viewer that leaves is no news
    warnings.filterwarnings("ignore", "coroutine 'WSHandler.send_message' was never awaited")  # nor one who is left
    hello: Hello = pipe.recv()
    asyncio.set_event_loop(asyncio.SelectorEventLoop())  # Windows' own loop does not watch sockets by number
    loop = IOLoop.current()
    news = News(hello.first, hello.params, lambda: pipe.send_bytes(NEXT))
    web = Web(news, hello.names)
    http = _Server(web, max_body_size=_MESSAGE_MAX_BYTES, idle_connection_timeout=_IDLE_S)
    for own in sockets:
        own.setblocking(False)
    http.add_sockets(sockets)
    server = BaseServer(loop, web, http)
    server.start()

    def hear(number: int, events: int) -> None:
        try:
            news.tell(pipe.recv())
        except (EOFError, OSError):
            loop.remove_handler(number)
            loop.stop()

    loop.add_handler(pipe.fileno(), hear, IOLoop.READ)
    pipe.send_bytes(READY)
    loop.start()
    loop.run_sync(news.end)
    server.stop()
    http.stop()


class Allowance:
    """So many requests a second for each address, and so many at once after a rest.

    Args:
        per_s, at_once: of one address.
        clock: s.
    """

    def __init__(self, per_s: float, at_once: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._per_s, self._at_once, self._clock = per_s, at_once, clock
        self._left: dict[str, tuple[float, float]] = {}  # by address: how many, when; the last one to ask is last

    def take(self, address: str) -> bool:
        """Whether one more is allowed."""
        now = self._clock()
        left, then = self._left.pop(address, (self._at_once, now))
        left = min(left + (now - then) * self._per_s, self._at_once)
        allowed = left >= 1.0
        self._left[address] = (left - allowed, now)
        if len(self._left) > ADDRESSES_MAX:
            del self._left[next(iter(self._left))]
        return allowed


class Web(BokehTornado):  # type: ignore[misc]
    """Refuses whom it does not know before anything else looks at the request, and has nothing but the page, its socket
    and Bokeh's scripts: each other address of Bokeh's makes a document for who only asks.

    Args:
        news: of the session.
        names: by which this server may be called.
    """

    def __init__(self, news: News, names: frozenset[str] | None) -> None:
        def document(doc: Document) -> None:
            page(doc, news)

        super().__init__(
            {"/": Application(FunctionHandler(document))},
            extra_websocket_origins=["*"],  # find_handler has judged it before, more strictly
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
            return self._refusal(request, 429, "too many requests: ask again later", REFUSAL_S)
        if not is_ours(request, self._own_names):
            return self._refusal(request, 403, "this page does not answer to that name, or to that site")
        if request.path in ("/", "/ws") and self.viewers >= VIEWERS_MAX:
            return self._refusal(request, 503, f"{VIEWERS_MAX} viewers look already, more are not served: come later")
        if request.path == "/":
            return self.get_handler_delegate(request, _Start)
        if request.path == "/ws":
            context = self._applications["/"]
            return self.get_handler_delegate(
                request, _Socket, {"application_context": context, "bokeh_websocket_path": "/ws"}
            )
        if request.path.startswith("/static/"):
            return super().find_handler(request, **options)
        return self._refusal(request, 404, "there is nothing here")

    def page_for(self, token: str) -> bytes:
        before, after = self._html
        return before + token.encode() + after

    def _refusal(self, request: HTTPServerRequest, status: int, text: str, after_s: float = 0.0) -> Any:
        return self.get_handler_delegate(request, _Refusal, {"status": status, "text": text, "after_s": after_s})


class _Start(RequestHandler):
    """The page, which then opens its socket with a token of its own."""

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


def is_ours(request: HTTPServerRequest, names: frozenset[str] | None) -> bool:
    """Whether `Host` is one of the names (the address of the connection itself where there are none), with our port,
    and `Origin`, where there is one, the same."""
    headers = request.headers
    if headers.get("Sec-Fetch-Site") == "cross-site" and headers.get("Sec-Fetch-Dest") != "document":
        return False  # a frame, an image, a script in another site's page; a link there is no harm
    host = headers.get_list("Host")
    origin = headers.get_list("Origin")
    stream = getattr(request.connection, "stream", None)
    if len(host) != 1 or len(origin) > 1 or stream is None or stream.socket is None:
        return False
    own_address, own_port = stream.socket.getsockname()[:2]
    try:
        asked = urlsplit(f"//{host[0]}")
        name, port = asked.hostname, asked.port or 80
    except ValueError:
        return False
    known = names if names is not None else {_plain(own_address), socket.gethostname().lower()}
    if name not in known or port != own_port:
        return False
    return not origin or origin[0].lower() == f"http://{host[0].lower()}"


def _plain(address: str) -> str:
    return address.split("%")[0].removeprefix("::ffff:")


if __name__ == "__main__":
    main()
