"""The requests that are let in: of a browser of this machine that has the key, from the page itself."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from http.cookies import CookieError

from tornado.web import HTTPError, RequestHandler

from oncenter.errors import OncenterError

BODY_BYTES_MAX = 1 << 16  # of a request without a log
_UNTRUSTED = "open the page by the address that oncenter app printed: it contains a key"
_HEADERS: Mapping[str, str] = {
    # Scripts and styles of this server alone; the page is in no frame, and no other page may read from here.
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Server": "oncenter",
}


class Guarded(RequestHandler):
    """A handler whose requests come from this user's page. A refused one is a status with one line of JSON."""

    def set_default_headers(self) -> None:
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        """Another name for this machine would let a foreign page read from here (DNS rebinding); a foreign page may
        send a request with our cookie, but not with our origin.

        Raises:
            HTTPError: 403.
        """
        port = self.settings["port"]
        if self.request.host not in (f"127.0.0.1:{port}", f"localhost:{port}"):
            raise HTTPError(403, reason="not a name of this page")
        if not self._has_token():
            raise HTTPError(403, reason=_UNTRUSTED)
        origin = self.request.headers.get("Origin")
        if self.request.method not in ("GET", "HEAD") and origin != f"http://{self.request.host}":
            raise HTTPError(403, reason="a request of another page")

    def _has_token(self) -> bool:
        try:
            given = self.get_cookie(cookie_name(self.settings["port"]), "") or ""
        except CookieError:
            return False
        return secrets.compare_digest(given.encode(), self.settings["token"].encode())

    def refuse(self, error: OncenterError) -> None:
        self.set_status(400)
        self.finish({"code": error.code, "message": str(error), "needs": error.needs})

    def write_error(self, status_code: int, **_: object) -> None:
        self.finish({"code": "page", "message": self._reason, "needs": []})


def cookie_name(port: int) -> str:
    """Two pages on two ports share their cookies."""
    return f"oncenter-{port}"
