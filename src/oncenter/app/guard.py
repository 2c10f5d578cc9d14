"""Guards the app and the live page: requests need the key, and come by this server's name from the page itself.

A page of another site must read and do nothing here, not even under a name that resolves to this address (DNS
rebinding) or by a link with this user's cookie.
"""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import logging
import secrets
import socket
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlsplit

from tornado.http1connection import HTTP1Connection
from tornado.httpserver import HTTPServer
from tornado.httputil import HTTPServerRequest
from tornado.iostream import IOStream
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler

from oncenter.app.texts import ENGLISH
from oncenter.errors import WRONG_USAGE, OncenterError

CONNECTIONS_MAX = 256  # open ones; a browser keeps six
REQUEST_S = 10.0  # for a request's header, and for its body; an unfinished one is closed
REQUEST_BYTES_MAX = 1 << 16  # of a request without a log
REFUSAL_S = 0.5  # delay of a refusal: those without the key get at most 512 answers a second
# Scripts and styles of this server alone; the page is in no frame.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)
POLICY_OF_CHARTS = POLICY.replace("style-src 'self'", "style-src 'self' 'unsafe-inline'")  # BokehJS writes styles
_HEADERS: Mapping[str, str] = {
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Server": "oncenter",
}


def new_key() -> str:
    return secrets.token_urlsafe(12)


def bound(address: str, port: int) -> list[socket.socket]:
    """Listening sockets.

    Args:
        address: a name or address of this machine; "0.0.0.0" or "::" for all.
        port: 0 for any free port.

    Raises:
        OncenterError: "web", exit code 2: the page cannot be served there.
    """
    try:
        return bind_sockets(port, address or None)
    except (OSError, OverflowError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        number = getattr(error, "errno", None)
        is_of_address = isinstance(error, (socket.gaierror, UnicodeError)) or number == errno.EADDRNOTAVAIL
        wrong = "--address, of this machine" if is_of_address else "--port"
        raise OncenterError(
            f"cannot serve a page at {address}:{port}: {reason}; name another {wrong}",
            code="web",
            exit_code=WRONG_USAGE,
        ) from None


def url_of(address: str, port: int, key: str) -> str:
    """The page's address for its user, with the key."""
    host = socket.gethostname() if names_of(address) is None else f"[{address}]" if ":" in address else address
    return f"http://{host}:{port}/?key={key}"


def names_of(address: str) -> frozenset[str] | None:
    """The host names accepted for a server at the address; None for all of the machine's."""
    try:
        given = ipaddress.ip_address(address)
    except ValueError:
        return frozenset({address.lower(), *(("127.0.0.1", "::1") if address.lower() == "localhost" else ())})
    if given.is_unspecified:
        return None
    return frozenset({str(given), *(("localhost",) if given.is_loopback else ())})


class Server(HTTPServer):
    """A connection beyond the limit takes the place of the oldest one that does not hold its place."""

    _streams: tuple[IOStream, ...] = ()

    def handle_stream(self, stream: IOStream, address: tuple[Any, ...]) -> None:
        assert isinstance(self.request_callback, Application)
        held = self.request_callback.settings["held"]
        self._streams = (*(own for own in self._streams if not own.closed()), stream)
        if len(self._streams) > CONNECTIONS_MAX:
            next(own for own in self._streams if own not in held).close()
        super().handle_stream(stream, address)


def server(handlers: list[Any], address: str, key: str, policy: str = POLICY, ticket: str = "") -> Server:
    """
    Args:
        handlers: rows of tornado's Application, each a Guarded.
        address: at which it is served.
        ticket: gets in once. Other users of the machine see the command line by which a browser is opened; if one of
            them brings the ticket as well, it is good for nobody.
    """
    logging.getLogger("tornado").setLevel(logging.CRITICAL)  # a browser that leaves is no error
    application = Application(
        handlers,
        default_handler_class=_Nothing,
        log_function=lambda _: None,
        names=names_of(address),
        key=key,
        by_ticket={ticket: new_key()} if ticket else {},  # its cookie; empty: used twice
        unused={ticket},
        policy=policy,
        held=set(),
    )
    return Server(
        application,
        idle_connection_timeout=REQUEST_S,
        body_timeout=REQUEST_S,
        max_header_size=1 << 14,
        max_body_size=REQUEST_BYTES_MAX,
    )


class Guarded(RequestHandler):
    """Checks each request first. A refused one is a status with one line: text for a person, JSON for the page."""

    _held: IOStream | None = None

    def set_default_headers(self) -> None:
        for name, value in {"Content-Security-Policy": self.settings["policy"], **_HEADERS}.items():
            self.set_header(name, value)

    async def prepare(self) -> None:
        """The key of the address becomes a cookie, and leaves the address.

        Raises:
            HTTPError: 403: the request is refused.
        """
        if not is_of_page(self.request, self.settings["names"]):
            await self._refused("other_page")
        cookie = f"oncenter-{self.stream().socket.getsockname()[1]}"  # two pages on two ports share their cookies
        ticket = self.get_query_argument("ticket", "")
        if ticket in self.settings["by_ticket"] and ticket not in self.settings["unused"]:
            self.settings["by_ticket"][ticket] = ""
            await self._refused("opened_twice")
        is_first = ticket in self.settings["by_ticket"]
        if is_first or _is_one_of((self.settings["key"],), self.get_query_argument("key", "")):
            self.settings["unused"].discard(ticket)
            kept = self.settings["by_ticket"][ticket] if is_first else self.settings["key"]
            self.set_cookie(cookie, kept, httponly=True, samesite="Lax", path="/")
            self.redirect("/")
            return
        if not _is_one_of((self.settings["key"], *self.settings["by_ticket"].values()), self.get_cookie(cookie, "")):
            await self._refused("needs_key")

    async def _refused(self, text: str) -> None:
        await asyncio.sleep(REFUSAL_S)
        raise HTTPError(403, reason=ENGLISH[text])

    def stream(self) -> IOStream:
        connection = self.request.connection
        assert isinstance(connection, HTTP1Connection)  # the only one of tornado's server
        return connection.stream

    def hold(self) -> None:
        """Its connection keeps its place until the request has ended."""
        self._held = self.stream()
        self.settings["held"].add(self._held)

    def on_finish(self) -> None:
        self.settings["held"].discard(self._held)

    def on_connection_close(self) -> None:
        self.settings["held"].discard(self._held)

    def refuse(self, error: OncenterError) -> None:
        self.set_status(400)
        self.finish({"code": error.code, "message": str(error), "needs": error.needs})

    def write_error(self, status_code: int, **_: object) -> None:
        if "text/html" in self.request.headers.get("Accept", ""):
            self.set_header("Content-Type", "text/plain; charset=utf-8")
            self.finish(f"oncenter: {self._reason}\n")
        else:
            self.finish({"code": "page", "message": self._reason, "needs": []})


def _is_one_of(keys: tuple[str, ...], given: str) -> bool:
    return any(key and secrets.compare_digest(given.encode(), key.encode()) for key in keys)


class _Nothing(Guarded):
    async def prepare(self) -> None:
        await super().prepare()
        raise HTTPError(404, reason=ENGLISH["nothing"])


def is_of_page(request: HTTPServerRequest, names: frozenset[str] | None) -> bool:
    """Whether `Host` is one of the names (if None, the address of the connection) with this port, and `Origin` is the
    same; a request that only reads may have none."""
    headers = request.headers
    if headers.get("Sec-Fetch-Site") == "cross-site" and headers.get("Sec-Fetch-Dest") != "document":
        return False  # a frame, image or script in another site's page; a link from there is harmless
    host = headers.get_list("Host")
    origin = headers.get_list("Origin")
    stream = getattr(request.connection, "stream", None)
    if len(host) != 1 or stream is None or stream.socket is None:
        return False
    own_address, own_port = stream.socket.getsockname()[:2]
    try:
        requested = urlsplit(f"//{host[0]}")
        name, port = requested.hostname, requested.port or 80
    except ValueError:
        return False
    own = own_address.split("%")[0].removeprefix("::ffff:")
    if name not in (names if names is not None else {own, socket.gethostname().lower()}) or port != own_port:
        return False
    same = [f"http://{host[0].lower()}"]
    return [each.lower() for each in origin] == same or (not origin and request.method in ("GET", "HEAD"))
