"""One viewer's page as a Bokeh document, updated with the newest snapshot.

The next update is made after the viewer has received the last one: a slow viewer gets fewer updates and delays nobody.
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from oncenter.live import words
from oncenter.live.pictures import Pictures
from oncenter.live.snapshot import Snapshot
from oncenter.report.canvas import COLOURS
from oncenter.signals import DEGREE
from oncenter.verdict import Verdict
from oncenter.verdict.states import style as states_style

if TYPE_CHECKING:
    from bokeh.application.application import SessionContext
    from bokeh.document import Document
    from bokeh.models import ColumnDataSource
    from bokeh.resources import Resources

_NOTICES_SHOWN = 6
_TOKEN = "TOKEN-OF-THE-VIEWER"  # placeholder in the page's HTML
_LAST_S = 0.5  # for updates on their way at the end

# The browser may load from this server only, whatever the page or a library in it tries.
_POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; img-src 'self' data: "
    "blob:; connect-src 'self'; font-src 'self' data:"
)


class News:
    """The newest snapshot of the session, in the page's process. The next one is requested when a viewer who has the
    newest one waits for it. All on one event loop.

    Args:
        first: shown until another one comes.
        params: of the session's core.
        ask: requests the session's next snapshot; returns at once.

    Attributes:
        snapshot: the newest.
        over: no further snapshot will come.
        followers: one task per viewer.
    """

    def __init__(self, first: Snapshot, params: Mapping[str, float], ask: Callable[[], None]) -> None:
        self.snapshot = first
        self.over = False
        self.followers: set[asyncio.Task[None]] = set()
        self._params, self._ask = params, ask
        self._is_requested = False
        self._json: tuple[int, str] = (-1, "")
        self._next = asyncio.Event()

    def update(self, newest: Snapshot) -> None:
        self.snapshot, self._is_requested = newest, False
        self._wake()

    def json(self) -> str:
        """The state for the page's script, made once for all viewers."""
        if self._json[0] != self.snapshot.number:
            self._json = self.snapshot.number, as_json(self.snapshot, self._params)
        return self._json[1]

    async def wait(self) -> None:
        if not self._is_requested:
            self._is_requested = True
            self._ask()
        await self._next.wait()

    async def end(self) -> None:
        """Waits `_LAST_S` for viewers to receive the last snapshot, then cancels them."""
        self.over = True
        self._wake()
        if self.followers:
            _, late = await asyncio.wait(self.followers, timeout=_LAST_S)
            for follower in late:
                follower.cancel()

    def _wake(self) -> None:
        self._next.set()
        self._next = asyncio.Event()


def page(doc: Document, news: News) -> None:
    """Makes the document of one viewer and keeps it up to date until the viewer leaves."""
    first = news.snapshot
    now, pictures = _empty_page(doc, news)
    shown, here = first.number, True

    async def look(document: Document) -> None:
        nonlocal shown
        newest = news.snapshot
        shown = newest.number
        now.data = {"json": [news.json()]}
        for _ in range(len(pictures.figures) if newest.phase == "ended" else 1):  # no update comes after the end
            pictures.show_next(newest)

    async def follow() -> None:
        while here:
            if news.snapshot.number == shown:
                if news.over:
                    return
                await news.wait()
            context = doc.session_context
            if context is None:  # the viewer has left
                return
            if news.snapshot.number == shown:  # the end, without a newer one
                continue
            await context.with_locked_document(look)

    def begin() -> None:
        following = asyncio.get_running_loop().create_task(follow())
        news.followers.add(following)
        following.add_done_callback(news.followers.discard)

    def leave(context: SessionContext) -> None:
        nonlocal here
        here = False

    for _ in pictures.figures:
        pictures.show_next(first)
    doc.on_session_destroyed(leave)
    doc.add_next_tick_callback(begin)


def rendered(news: News, resources: Resources) -> tuple[bytes, bytes]:
    """The page's HTML before and after a viewer's token: rendered once, since only the token differs. The content comes
    through the viewer's socket."""
    from bokeh.document import Document
    from bokeh.embed.bundle import bundle_for_objs_and_resources
    from bokeh.embed.elements import html_page_for_render_items
    from bokeh.embed.util import RenderItem

    doc = Document()
    _empty_page(doc, news)
    item = RenderItem(token=_TOKEN, roots=doc.roots, use_for_title=True)
    bundle = bundle_for_objs_and_resources(None, resources)
    html = html_page_for_render_items(bundle, {}, [item], doc.title, template=_template())
    before, after = html.encode().split(_TOKEN.encode())
    return before, after


def _empty_page(doc: Document, news: News) -> tuple[ColumnDataSource, Pictures]:
    """The figures, with the same identifiers in every document, so that one rendered page fits all viewers."""
    from bokeh.core.types import ID
    from bokeh.models import ColumnDataSource

    now = ColumnDataSource(data={"json": [news.json()]}, name="now")
    pictures = Pictures(now)
    for figure in pictures.figures:
        figure._id = ID(f"oncenter-{figure.name}")
        doc.add_root(figure)
    if hasattr(doc, "config") and hasattr(doc.config, "notify_connection_status"):  # newer than the lowest Bokeh
        doc.config.notify_connection_status = False  # the page itself says that it has finished, or lost its server
    doc.title = f"{news.snapshot.truck}: straight-ahead offset, live"
    return now, pictures


def _template() -> str:
    room = files("oncenter.live")
    ours, style = room.joinpath("page.css"), files("oncenter.report").joinpath("page.css").read_text(encoding="utf-8")
    colours = "".join(f"--{name}:{colour};" for name, colour in COLOURS.items())
    return (
        room.joinpath("page.html")
        .read_text(encoding="utf-8")
        .replace("[[policy]]", _POLICY)
        .replace("[[style]]", f":root{{{colours}}}\n{states_style()}{style}\n{ours.read_text(encoding='utf-8')}")
        .replace("[[restyle]]", files("oncenter.report").joinpath("page.js").read_text(encoding="utf-8"))
        .replace("[[script]]", room.joinpath("page.js").read_text(encoding="utf-8"))
    )


def as_json(now: Snapshot, params: Mapping[str, float]) -> str:
    """The state for the page's script: words and degrees, null where not available."""
    offset = words.offset(now)
    counts, why = words.gate(now)
    angles = now.angles
    answer = now.known.answer
    state: dict[str, Any] = {
        "number": now.number,
        "frame_s": _number(angles.frame_s),
        "phase": now.phase,
        "truck": now.truck,
        "bus": now.bus,
        "offset": asdict(offset),
        "verdict": None if now.verdict is None else _verdict(now.verdict, now.phase),
        "finished": words.finished(now),
        "gate": {"counts": counts, "why": why},
        "angles": {
            "measured": _number(angles.measured_rad / DEGREE),
            "corrected": _number(angles.corrected_rad / DEGREE),
            "estimated": _number(angles.estimated_rad / DEGREE),
        },
        "estimated_half_width": _number(1.96 * angles.estimated_sd_rad / DEGREE),
        "speed_km_h": _number(3.6 * angles.vehicle_speed_m_s),
        "flanks": {side: words.loaded_share(now, side) for side in ("left", "right")},
        "missing": words.still_missing(now, params),
        "quantities": words.quantities(now),
        "losses": words.losses(now.dropped),
        "fault": "" if now.fault == "none" else now.fault.replace("_", " "),
        "findings": [
            {"severity": finding.severity, "text": words.sentence(finding.text)}
            for finding in (answer.findings if answer is not None else ())
        ],
        "said": [
            f"{time.strftime('%H:%M:%S', time.localtime(notice.time_s))} {notice.text}"
            for notice in now.notices[-_NOTICES_SHOWN:]
        ],
        "traffic": f"{words.bus(now)}; driven {words.duration(now.driven_s)}",
    }
    return json.dumps(state, allow_nan=False, ensure_ascii=False)


def _verdict(verdict: Verdict, phase: str) -> dict[str, str]:
    """The action follows at the end: while driving, the next step is to drive on."""
    action = verdict.action if phase == "ended" else ""
    return {"state": verdict.state, "headline": words.signed(verdict.headline), "action": words.signed(action)}


def _number(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
