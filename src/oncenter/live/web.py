"""The page's server: Bokeh's, in a thread of its own, for this machine alone unless told otherwise.

A page of another site must not read what is driven here, nor may it come by a name that it has bent to our address:
each request says by `Host` whom it means and by `Origin` whose page asks, and both must be us.
"""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import logging
import socket
import threading
import warnings
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.netutil import bind_sockets
from tornado.web import ErrorHandler

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.live.page import News, page

if TYPE_CHECKING:
    from bokeh.document import Document
    from tornado.httputil import HTTPServerRequest

    from oncenter.live.session import Session

_MESSAGE_MAX_BYTES = 1 << 16  # from a viewer, who has little to say
_UNUSED_MS = 5_000  # after which a page that was closed is forgotten


class Page:
    """Serves a session's snapshots; as a context it ends with it.

    Args:
        session: whose snapshots.
        params: of its core.
        address: a name or address of this machine; "0.0.0.0" or "::" are all of them.
        port: 0 takes a free one.

    Raises:
        OncenterError: "web", exit code 2: it cannot be served there.
    """

    def __init__(self, session: Session, params: Mapping[str, float], address: str, port: int) -> None:
        try:
            self._sockets = bind_sockets(port, address or None)
        except (OSError, OverflowError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            wrong = "--address, of this machine" if _is_of_address(error) else "--port"
            raise OncenterError(
                f"cannot serve a page at {address}:{port}: {reason}; name another {wrong}",
                code="web",
                exit_code=WRONG_USAGE,
            ) from None
        self.port: int = self._sockets[0].getsockname()[1]
        self.url = f"http://{_in_url(address)}:{self.port}/"
        self._session, self._params = session, params
        self._names = names_of(address)
        self._loop: IOLoop | None = None
        self._ready = threading.Event()
        self._failure: Exception | None = None
        self._news = News()
        self._thread = threading.Thread(target=self._serve, name="oncenter web", daemon=True)

    def __enter__(self) -> Page:
        self._thread.start()
        self._ready.wait()
        if self._failure is not None:
            raise self._failure
        loop = self._loop
        assert loop is not None
        self._session.when_shown = lambda: loop.add_callback(self._news.tell)
        return self

    def __exit__(self, *_: object) -> None:
        assert self._loop is not None
        self._loop.add_callback(self._loop.stop)
        self._thread.join()

    def _serve(self) -> None:
        for name in ("bokeh", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # a viewer that leaves is no news
        warnings.filterwarnings("ignore", "coroutine 'WSHandler.send_message' was never awaited")  # nor one who is left

        def document(doc: Document) -> None:
            page(doc, self._session, self._params, self._news)

        try:
            server, http = self._server(document)
        except Exception as failure:
            self._failure = failure
            return
        finally:
            self._ready.set()
        assert self._loop is not None
        self._loop.start()
        self._loop.run_sync(self._news.end)
        server.stop()
        http.stop()
        self._loop.close(all_fds=True)

    def _server(self, document: Callable[[Document], None]) -> tuple[BaseServer, HTTPServer]:
        asyncio.set_event_loop(asyncio.new_event_loop())
        self._loop = IOLoop.current()
        web = _OnlyOurs(
            {"/": Application(FunctionHandler(document))},
            self._names,
            extra_websocket_origins=["*"],  # find_handler has judged it before, more strictly
            websocket_max_message_size_bytes=_MESSAGE_MAX_BYTES,
            unused_session_lifetime_milliseconds=_UNUSED_MS,
            check_unused_sessions_milliseconds=_UNUSED_MS,
        )
        http = HTTPServer(web, max_body_size=_MESSAGE_MAX_BYTES)
        http.add_sockets(self._sockets)
        server = BaseServer(self._loop, web, http)
        server.start()
        return server, http


class _OnlyOurs(BokehTornado):  # type: ignore[misc]
    """Refuses whom it does not know before anything else looks at the request."""

    def __init__(self, applications: Mapping[str, Application], names: frozenset[str] | None, **options: Any) -> None:
        self._own_names = names
        super().__init__(applications, **options)

    def find_handler(self, request: HTTPServerRequest, **options: Any) -> Any:
        if is_ours(request, self._own_names):
            return super().find_handler(request, **options)
        return self.get_handler_delegate(request, ErrorHandler, {"status_code": 403})


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


def _is_of_address(error: Exception) -> bool:
    """Nobody is called so, no name can be so, or it is another machine's; else the port is taken or not for us."""
    return isinstance(error, (socket.gaierror, UnicodeError)) or getattr(error, "errno", None) == errno.EADDRNOTAVAIL


def names_of(address: str) -> frozenset[str] | None:
    """By which names a server at the address may be called; None where it has all of the machine's."""
    try:
        given = ipaddress.ip_address(address)
    except ValueError:
        return frozenset({address.lower(), *(("127.0.0.1", "::1") if address.lower() == "localhost" else ())})
    if given.is_unspecified:
        return None
    return frozenset({str(given), *(("localhost",) if given.is_loopback else ())})


def _plain(address: str) -> str:
    return address.split("%")[0].removeprefix("::ffff:")


def _in_url(address: str) -> str:
    if names_of(address) is None:
        return socket.gethostname()
    return f"[{address}]" if ":" in address else address
