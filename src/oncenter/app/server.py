"""The page's server: tornado, which bokeh of the report brings, for this machine alone."""

from __future__ import annotations

import asyncio
import json
import socket
import sys
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment
from markupsafe import Markup
from tornado.http1connection import HTTP1Connection
from tornado.web import HTTPError, stream_request_body

from oncenter.app.answers import Answers
from oncenter.app.csv_table import csv_of
from oncenter.app.fields import NUMBERS, number, read_back
from oncenter.app.guard import Guarded, Server, bound, new_key, server, url_of
from oncenter.app.network import Network, network_entries, network_shown
from oncenter.app.texts import ENGLISH
from oncenter.app.trucks import OWN, Trucks
from oncenter.app.uploads import TAKEN, Upload, Uploads
from oncenter.errors import OncenterError
from oncenter.files.log_formats import DATABASES
from oncenter.report.browser import find_browser, pdf_of, require_browser
from oncenter.report.canvas import COLOURS
from oncenter.vehicle_keys import KEYS
from oncenter.verdict.states import STATES, style

_ADDRESS = "127.0.0.1"
_LOG_S = 86_400.0  # for a log to come
_CHOICES = {  # of the form, by field; the first is chosen, and nobody who does not answer states a thing
    "axle_layout": {"": ENGLISH["not_known"], **{axles: axles for axles in KEYS["axle_layout"].choices}},
    "traffic_side": {"": ENGLISH["not_known"], **{side: ENGLISH[side] for side in KEYS["traffic_side"].choices}},
}
_UNITS = {"wheelbase_m": "m", "limit": "deg", "applied": "deg"}  # in which a number without unit is
_PRINT = b'<script>addEventListener("load", () => setTimeout(print, 1000))</script>'  # once the pictures are drawn
# A report has scripts of its own, so it gets an origin of its own; its policy stands in it and lets nothing be loaded.
_OF_REPORT = "sandbox allow-scripts allow-modals allow-downloads"


def serve(folder: Path, port: int, opened: Callable[[str, str], None]) -> None:
    """Serves the page until it is interrupted.

    Args:
        folder: of this user's trucks.
        port: 0 for any free one.
        opened: called with the page's address, which contains the key, and with one for the command line of a browser,
            which others may see: it is good once.

    Raises:
        OncenterError: "web", exit code 2: the port cannot be used.
    """
    sockets = bound(_ADDRESS, port)
    with Uploads() as uploads, Answers() as answers:
        asyncio.run(_serve(sockets, Trucks(folder), uploads, answers, opened))


async def _serve(
    sockets: list[socket.socket], trucks: Trucks, uploads: Uploads, answers: Answers, opened: Callable[[str, str], None]
) -> None:
    key, ticket = new_key(), new_key()
    _server(key, ticket, trucks, uploads, answers).add_sockets(sockets)
    url = url_of(_ADDRESS, sockets[0].getsockname()[1], key)
    opened(url, url.replace(f"key={key}", f"ticket={ticket}"))
    await asyncio.Event().wait()


def _server(key: str, ticket: str, trucks: Trucks, uploads: Uploads, answers: Answers) -> Server:
    places = {"trucks": trucks, "uploads": uploads, "answers": answers}
    of_truck = {"trucks": trucks, "uploads": uploads, "reading": asyncio.Lock()}
    return server(
        [
            (r"/", _Page, {"trucks": trucks}),
            (r"/(app|drives|fields|offers|signals)\.(css|js)", _Asset),
            (r"/fields", _Fields),
            (r"/trucks", _Trucks, of_truck),
            (r"/signals", _Signals, of_truck),
            (r"/logs", _Logs, {"uploads": uploads}),
            (r"/logs/([\w-]+)", _Log, {"uploads": uploads}),
            (r"/answers", _Answers, places),
            (r"/trucks/([^/]+)", _Truck, {"trucks": trucks}),
            (r"/trucks/([^/]+)/drives/(\d+)", _Drive, {"trucks": trucks}),
            (r"/trucks/([^/]+)/events", _Events, {"trucks": trucks}),
            (r"/trucks/([^/]+)/events/(\d+)", _Events, {"trucks": trucks}),
            (r"/comparisons", _Comparisons, {"trucks": trucks, "answers": answers}),
            (r"/answers/([\w-]+)", _Answer, {"answers": answers}),
            (r"/answers/([\w-]+)/report", _Report, {"answers": answers}),
            (r"/answers/([\w-]+)/pdf", _Pdf, {"answers": answers}),
            (r"/answers/([\w-]+)/csv", _Table, {"answers": answers}),
            (r"/explanations/([a-z_0-9]+)", _Explanation),
        ],
        _ADDRESS,
        key,
        ticket=ticket,
    )


class _Page(Guarded):
    def initialize(self, trucks: Trucks) -> None:
        self._trucks = trucks

    def get(self) -> None:
        template = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(_file("page.html"))
        given: dict[str, Any] = {"texts": ENGLISH, "groups": self._trucks.names(), "suffixes": ",".join(TAKEN)}
        given |= {"layouts": self._trucks.layouts(), "choices": _CHOICES, "units": _UNITS}
        given |= {"databases": ",".join(DATABASES), "drawings": Markup(_file("drawings.svg"))}
        given["prints"] = find_browser() is not None
        self.finish(template.render(given, marks={code: state.mark for code, state in STATES.items()}))


class _Asset(Guarded):
    def get(self, name: str, kind: str) -> None:
        text = _file(f"{name}.{kind}")
        is_style = kind == "css"
        if is_style:
            colours = "".join(f"--{name}:{colour};" for name, colour in COLOURS.items())
            text = f":root{{{colours}}}\n{style()}{text}"
        self.set_header("Content-Type", "text/css" if is_style else "text/javascript")
        self.finish(text)


def _file(name: str) -> str:
    return files("oncenter.app").joinpath(name).read_text(encoding="utf-8")


class _Fields(Guarded):
    def post(self) -> None:
        """The number of one field, as it is understood."""
        asked = _asked(self)
        field = str(asked.get("field"))
        try:
            if field not in NUMBERS:
                raise HTTPError(404, reason="no such field")
            self.finish(read_back(field, {field: asked.get("written", "")}))
        except OncenterError as error:
            self.finish({"wrong": str(error)})


class _OfTruck(Guarded):
    """A handler about a truck that is new, or whose file the request names, and the files that were dropped for it."""

    def initialize(self, trucks: Trucks, uploads: Uploads, reading: asyncio.Lock) -> None:
        self._trucks, self._uploads, self._reading = trucks, uploads, reading

    def _dropped(self, asked: Mapping[str, Any]) -> tuple[list[Path], Path | None]:
        """The databases, and the first log."""
        files = [self._uploads.of(str(key)) for key in (*asked.get("databases", ()), *asked.get("logs", ()))]
        whole = [upload.path for upload in files if upload is not None and upload.is_whole]
        databases = [path for path in whole if path.name.lower().endswith(DATABASES)]
        return databases, next((path for path in whole if path not in databases), None)


class _Signals(_OfTruck):
    """The signals of a truck as rows: proposed, or as chosen so far. Nothing is kept."""

    _is_gone = False

    async def post(self) -> None:
        asked = _asked(self)
        try:  # in a thread: a log is read; one after the other
            async with self._reading:
                self.finish(await asyncio.to_thread(self._rows, asked))
        except OncenterError as error:
            self.refuse(error)
        except ConnectionAbortedError:
            return

    def on_connection_close(self) -> None:
        self._is_gone = True

    def _go_on(self, _: float) -> None:
        """Ends the reading of a log that nobody waits for."""
        if self._is_gone:
            raise ConnectionAbortedError

    def _rows(self, asked: Mapping[str, Any]) -> dict[str, Any]:
        self._go_on(0.0)
        databases, log = self._dropped(asked)
        values = self._trucks.described(asked)
        network = Network([*map(Path, values.get("dbc", ())), *databases], log)
        return network_shown(values, network, asked.get("signals"), asked.get("at_s"), self._go_on)


class _Trucks(_OfTruck):
    async def post(self) -> None:
        asked = _asked(self)
        try:
            self.finish({"group": OWN, "name": await asyncio.to_thread(self._kept, asked)})
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
        self._lost: OncenterError | None = None

    async def prepare(self) -> None:
        await super().prepare()
        if self.request.method == "PUT":
            upload = self._uploads.of(self.path_args[0])
            if upload is None or upload.is_taken or self.request.headers.get("Content-Length") != str(upload.size):
                raise HTTPError(400, reason="not the log that was announced")
            connection = self.request.connection
            assert isinstance(connection, HTTP1Connection)  # as tornado's guide to streamed bodies has it
            connection.set_max_body_size(upload.size)
            connection.set_body_timeout(_LOG_S)
            self.hold()
            self._coming = upload
            upload.is_taken = True

    def data_received(self, chunk: bytes) -> None:
        if self._coming is not None:
            try:
                self._coming.write(chunk)
            except OSError as error:  # a browser hears of it when it has sent the rest, which is dropped
                self._coming = None
                self._uploads.remove(self.path_args[0])
                why = f"the log cannot be kept: {error.strerror}; make room on the disk, then drop it again"
                self._lost = OncenterError(why, code="page")

    def put(self, _: str) -> None:
        if self._lost is not None:
            self.refuse(self._lost)
        else:
            self.finish({})

    def delete(self, key: str) -> None:
        self._uploads.remove(key)
        self.finish({})

    def on_connection_close(self) -> None:
        super().on_connection_close()
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
            own = self._trucks.sign_of(str(asked.get("group")), str(asked.get("name")))
            for field, sign in (("limit", 1), ("applied", own)):
                options += [f"--{field}={sign * number(field, asked):g}"] if asked.get(field) else []
            if not whole or len(whole) < len(logs):
                raise OncenterError(ENGLISH["waits" if logs else "needs_log"], code="page")
            self.finish({"answer": self._begin(asked, whole, options)})
        except OncenterError as error:
            self.refuse(error)

    def _begin(self, asked: dict[str, Any], logs: list[Path], options: list[str]) -> str:
        if asked.get("group") != OWN:
            return self._answers.begin(logs, options)
        truck = str(asked["name"])
        drives = self._trucks.drives(truck)
        before = drives.begin()
        return self._answers.begin(logs, options, truck, lambda said: drives.keep(before, said))


class _Truck(Guarded):
    """One of the user's trucks."""

    def initialize(self, trucks: Trucks) -> None:
        self._trucks = trucks

    async def get(self, name: str) -> None:
        try:
            self.finish(await asyncio.to_thread(self._trucks.about, name))
        except OncenterError as error:
            self.refuse(error)

    def delete(self, name: str) -> None:
        try:
            self._trucks.forget(name)
            self.finish({})
        except OncenterError as error:
            self.refuse(error)


class _Drive(Guarded):
    """A former drive of it."""

    def initialize(self, trucks: Trucks) -> None:
        self._trucks = trucks

    def delete(self, name: str, number: str) -> None:
        try:
            self._trucks.drives(name).forget(number)
            self.finish({})
        except OncenterError as error:
            self.refuse(error)


class _Events(Guarded):
    """Events that a person states of it."""

    def initialize(self, trucks: Trucks) -> None:
        self._trucks = trucks

    def post(self, name: str) -> None:
        try:
            self._trucks.drives(name).state(str(_asked(self).get("kind")))
            self.finish({})
        except OncenterError as error:
            self.refuse(error)

    def delete(self, name: str, number: str) -> None:
        try:
            self._trucks.drives(name).take_back(int(number))
            self.finish({})
        except OncenterError as error:
            self.refuse(error)


class _Comparisons(Guarded):
    def initialize(self, trucks: Trucks, answers: Answers) -> None:
        self._trucks, self._answers = trucks, answers

    def _former(self, asked: dict[str, Any]) -> dict[str, Any] | None:
        """The answer on the drive before: of this page, or of an earlier day."""
        if "drive" in asked:
            return self._trucks.drives(str(asked.get("truck"))).said(str(asked["drive"]))
        return self._answers.said(str(asked.get("before")))

    async def post(self) -> None:
        asked = _asked(self)
        try:
            key = self._answers.begin_comparison(self._former(asked), self._answers.said(str(asked.get("after"))))
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
        self.finish(answer.report.read_bytes() + (_PRINT if self.get_query_argument("print", "") else b""))


class _Pdf(Guarded):
    """The report, printed by a browser of this machine."""

    def initialize(self, answers: Answers) -> None:
        self._answers = answers

    async def get(self, key: str) -> None:
        answer = self._answers.of(key)
        if answer is None or answer.state != "done":
            raise HTTPError(404, reason="no such report")
        try:
            printed = await asyncio.to_thread(_printed, answer.report)
        except OncenterError as error:
            self.refuse(error)
            return
        self.set_header("Content-Type", "application/pdf")
        self.finish(printed)


def _printed(report: Path) -> bytes:
    place = report.with_suffix(".pdf")
    return pdf_of(report.read_text(encoding="utf-8"), require_browser(place.name, report.name), place)


class _Table(Guarded):
    """The quantities of an answer, a row each, for a spreadsheet."""

    def initialize(self, answers: Answers) -> None:
        self._answers = answers

    def get(self, key: str) -> None:
        said = self._answers.said(key)
        if said is None or "offset" not in said:
            raise HTTPError(404, reason="no such answer")
        self.set_header("Content-Type", "text/csv; charset=utf-8")
        self.finish(csv_of(said))


class _Explanation(Guarded):
    """The words of `oncenter explain`."""

    async def get(self, code: str) -> None:
        command = [sys.executable, "-m", "oncenter", "explain", code]
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(
            *command, stdin=asyncio.subprocess.DEVNULL, stdout=pipe, stderr=pipe
        )
        out, err = await process.communicate()
        self.finish({"text": (out or err).decode(errors="replace").strip()})


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
