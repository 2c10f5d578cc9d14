"""The page's server: tornado, which bokeh of the report brings, for this machine alone."""

from __future__ import annotations

import asyncio
import json
import secrets
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment
from tornado.http1connection import HTTP1Connection
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, stream_request_body

from oncenter.app.answers import Answers
from oncenter.app.guard import BODY_BYTES_MAX, Guarded, cookie_name
from oncenter.app.network import Network, network_entries, network_shown
from oncenter.app.texts import ENGLISH
from oncenter.app.trucks import Trucks, number
from oncenter.app.uploads import Upload, Uploads
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.log_formats import DATABASES, SUFFIXES
from oncenter.report.canvas import COLOURS
from oncenter.verdict.states import STATES, style

_HEADERS_S, _BODY_S = 10.0, 30.0  # for a request without a log: an unfinished one ends
_LOG_S = 86_400.0  # for a log
_AXLES = ("4x2", "6x2", "6x4", "8x4")
# A report has scripts of its own, so it gets an origin of its own; its policy stands in it and lets nothing be loaded.
_OF_REPORT = "sandbox allow-scripts allow-modals allow-downloads"


def serve(folder: Path, port: int, opened: Callable[[str], None]) -> None:
    """Serves the page until it is interrupted.

    Args:
        folder: of this user's trucks.
        port: 0 for any free one.
        opened: called with the page's address, which contains the key.

    Raises:
        OncenterError: "web", exit code 2: the port cannot be used.
    """
    try:
        sockets = bind_sockets(port, "127.0.0.1")
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise OncenterError(
            f"cannot serve a page at port {port}: {reason}; name another --port", code="web", exit_code=WRONG_USAGE
        ) from None
    with Uploads() as uploads, Answers() as answers:
        asyncio.run(_serve(sockets, Trucks(folder), uploads, answers, opened))


async def _serve(
    sockets: Any, trucks: Trucks, uploads: Uploads, answers: Answers, opened: Callable[[str], None]
) -> None:
    port, token = sockets[0].getsockname()[1], secrets.token_urlsafe(24)
    server = HTTPServer(
        application(port, token, trucks, uploads, answers),
        max_body_size=BODY_BYTES_MAX,
        max_header_size=1 << 14,
        idle_connection_timeout=_HEADERS_S,
        body_timeout=_BODY_S,
    )
    server.add_sockets(sockets)
    opened(f"http://127.0.0.1:{port}/?key={token}")
    await asyncio.Event().wait()


def application(port: int, token: str, trucks: Trucks, uploads: Uploads, answers: Answers) -> Application:
    places = {"trucks": trucks, "uploads": uploads, "answers": answers}
    return Application(
        [
            (r"/", _Page, {"trucks": trucks}),
            (r"/(app\.css|app\.js|signals\.js)", _Asset),
            (r"/trucks", _Trucks, {"trucks": trucks, "uploads": uploads}),
            (r"/signals", _Signals, {"trucks": trucks, "uploads": uploads}),
            (r"/logs", _Logs, {"uploads": uploads}),
            (r"/logs/([\w-]+)", _Log, {"uploads": uploads}),
            (r"/answers", _Answers, places),
            (r"/comparisons", _Comparisons, {"answers": answers}),
            (r"/answers/([\w-]+)", _Answer, {"answers": answers}),
            (r"/answers/([\w-]+)/report", _Report, {"answers": answers}),
        ],
        default_handler_class=_Nothing,
        port=port,
        token=token,
        reading=asyncio.Lock(),
        log_function=lambda _: None,
    )


class _Nothing(Guarded):
    def prepare(self) -> None:
        super().prepare()
        raise HTTPError(404, reason="nothing is here")


class _Page(Guarded):
    def initialize(self, trucks: Trucks) -> None:
        self._trucks = trucks

    def prepare(self) -> None:
        """The key of the address becomes a cookie, and leaves the address."""
        key = self.get_query_argument("key", "")
        token, port = self.settings["token"], self.settings["port"]
        if key and secrets.compare_digest(key.encode(), token.encode()):
            self.set_cookie(cookie_name(port), token, httponly=True, samesite="Strict", path="/")
            self.redirect("/")
            return
        super().prepare()

    def get(self) -> None:
        page = files("oncenter.app").joinpath("page.html").read_text(encoding="utf-8")
        template = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(page)
        given = {"texts": ENGLISH, "groups": self._trucks.names(), "axles": _AXLES, "suffixes": ",".join(SUFFIXES)}
        given["databases"] = ",".join(DATABASES)
        self.finish(template.render(given, marks={code: state.mark for code, state in STATES.items()}))


class _Asset(Guarded):
    def get(self, name: str) -> None:
        text, is_style = files("oncenter.app").joinpath(name).read_text(encoding="utf-8"), name.endswith("css")
        if is_style:
            colours = "".join(f"--{name}:{colour};" for name, colour in COLOURS.items())
            text = f":root{{{colours}}}\n{style()}{text}"
        self.set_header("Content-Type", "text/css" if is_style else "text/javascript")
        self.finish(text)


class _OfTruck(Guarded):
    """A handler about a truck that is new, or whose file the request names, and the files that were dropped for it."""

    def initialize(self, trucks: Trucks, uploads: Uploads) -> None:
        self._trucks, self._uploads = trucks, uploads

    def _dropped(self, asked: Mapping[str, Any]) -> tuple[list[Path], Path | None]:
        """The databases, and the first log."""
        files = [self._uploads.of(str(key)) for key in (*asked.get("databases", ()), *asked.get("logs", ()))]
        whole = [upload.path for upload in files if upload is not None and upload.is_whole]
        databases = [path for path in whole if path.name.lower().endswith(DATABASES)]
        return databases, next((path for path in whole if path not in databases), None)


class _Signals(_OfTruck):
    """The signals of a truck as rows: proposed, or as chosen so far. Nothing is kept."""

    async def post(self) -> None:
        asked = _asked(self)
        try:  # in a thread: a log is read; one after the other
            async with self.settings["reading"]:
                self.finish(await asyncio.to_thread(self._rows, asked))
        except OncenterError as error:
            self.refuse(error)

    def _rows(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        databases, log = self._dropped(asked)
        values = self._trucks.described(asked)
        network = Network([*map(Path, values.get("dbc", ())), *databases], log)
        return network_shown(values, network, asked.get("signals"), asked.get("at_s"))


class _Trucks(_OfTruck):
    async def post(self) -> None:
        asked = _asked(self)
        try:
            self.finish({"group": "yours", "name": await asyncio.to_thread(self._kept, asked)})
        except OncenterError as error:
            self.refuse(error)

    def _kept(self, asked: Mapping[str, Any]) -> str:
        databases, log = self._dropped(asked)
        values = self._trucks.described(asked)
        network, table = Network([*map(Path, values.get("dbc", ())), *databases], log), {}
        if asked.get("signals") is not None:
            table = network_entries(network, asked["signals"], values.get("signals", {}))
        return self._trucks.keep(asked, values, databases, table)


class _Logs(Guarded):
    def initialize(self, uploads: Uploads) -> None:
        self._uploads = uploads

    def post(self) -> None:
        """The name and size of a log that will come; it is refused here, before a gigabyte is sent in vain."""
        asked = _asked(self)
        try:
            self.finish({"log": self._uploads.begin(str(asked.get("name", "")), int(asked.get("size", 0)))})
        except OncenterError as error:
            self.refuse(error)


@stream_request_body
class _Log(Guarded):
    def initialize(self, uploads: Uploads) -> None:
        self._uploads = uploads
        self._coming: Upload | None = None

    def prepare(self) -> None:
        super().prepare()
        if self.request.method == "PUT":
            upload = self._uploads.of(self.path_args[0])
            if upload is None or upload.written or self.request.headers.get("Content-Length") != str(upload.size):
                raise HTTPError(400, reason="not the log that was announced")
            connection = self.request.connection
            assert isinstance(connection, HTTP1Connection)  # as tornado's guide to streamed bodies has it
            connection.set_max_body_size(upload.size)
            connection.set_body_timeout(_LOG_S)
            self._coming = upload

    def data_received(self, chunk: bytes) -> None:
        if self._coming is not None:
            try:
                self._coming.write(chunk)
            except OSError as error:
                self._uploads.remove(self.path_args[0])
                raise HTTPError(507, reason=f"the log cannot be kept: {error.strerror}") from None

    def put(self, _: str) -> None:
        self.finish({})

    def delete(self, key: str) -> None:
        self._uploads.remove(key)
        self.finish({})

    def on_connection_close(self) -> None:
        if self._coming is not None:
            self._uploads.remove(self.path_args[0])


class _Answers(Guarded):
    def initialize(self, trucks: Trucks, uploads: Uploads, answers: Answers) -> None:
        self._trucks, self._uploads, self._answers = trucks, uploads, answers

    async def post(self) -> None:
        asked = _asked(self)
        logs = [self._uploads.of(str(key)) for key in asked.get("logs", ())]
        whole = [upload.path for upload in logs if upload is not None and upload.is_whole]
        try:
            options = self._trucks.options(str(asked.get("group")), str(asked.get("name")))
            for field in ("limit", "applied"):
                options += [f"--{field}={number(field, asked):g}"] if asked.get(field) else []
            if not whole or len(whole) < len(logs):
                raise OncenterError(ENGLISH["waits" if logs else "needs_log"], code="page")
            self.finish({"answer": self._answers.begin(whole, options)})
        except OncenterError as error:
            self.refuse(error)


class _Comparisons(Guarded):
    def initialize(self, answers: Answers) -> None:
        self._answers = answers

    async def post(self) -> None:
        asked = _asked(self)
        try:
            key = self._answers.begin_comparison(str(asked.get("before")), str(asked.get("after")))
            self.finish({"answer": key})
        except OncenterError as error:
            self.refuse(error)


class _Answer(Guarded):
    def initialize(self, answers: Answers) -> None:
        self._answers = answers

    def get(self, key: str) -> None:
        answer = self._answers.of(key)
        if answer is None:
            raise HTTPError(404, reason="no such answer")
        self.finish({"state": answer.state, "said": answer.said})

    def delete(self, key: str) -> None:
        self._answers.cancel(key)
        self.finish({})


class _Report(Guarded):
    def initialize(self, answers: Answers) -> None:
        self._answers = answers

    def get(self, key: str) -> None:
        answer = self._answers.of(key)
        if answer is None or answer.state != "done":
            raise HTTPError(404, reason="no such report")
        self.set_header("Content-Security-Policy", _OF_REPORT)
        self.finish(answer.report.read_bytes())


def _asked(handler: Guarded) -> dict[str, Any]:
    """The JSON object of a request.

    Raises:
        HTTPError: 400: it is none.
    """
    try:
        asked = json.loads(handler.request.body)
    except ValueError:
        asked = None
    if not isinstance(asked, dict):
        raise HTTPError(400, reason="no JSON object")
    return asked
