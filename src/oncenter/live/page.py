"""The live page and its events: files that are rendered once, then the newest snapshot for each viewer.

The next event is made after the viewer has taken the last one: a slow viewer gets fewer events and delays nobody.
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import asdict
from importlib.resources import files
from typing import Any

from bokeh.embed import json_item
from bokeh.resources import Resources
from jinja2 import Environment

from oncenter.app.texts import LIVE
from oncenter.live import words
from oncenter.live.pictures import Pictures
from oncenter.live.snapshot import Snapshot
from oncenter.report.canvas import COLOURS
from oncenter.signals import DEGREE
from oncenter.verdict import Verdict
from oncenter.verdict.states import style as states_style

_NOTICES_SHOWN = 6
_LAST_S = 0.5  # for events on their way at the end


class News:
    """The newest snapshot of the session, in the page's process. The next one is requested when a viewer who has the
    newest one waits for it. All on one event loop.

    Args:
        first: shown until another one comes.
        params: of the session's core.
        ask: requests the session's next snapshot; returns at once.

    Attributes:
        snapshot: the newest.
        pictures: of the snapshot that a viewer got last.
    """

    def __init__(self, first: Snapshot, params: Mapping[str, float], ask: Callable[[], None]) -> None:
        self.snapshot, self.pictures = first, Pictures()
        self._params, self._ask = params, ask
        self._is_over = self._is_requested = False
        self._followers: set[asyncio.Task[None]] = set()
        self._json: tuple[int, str] = (-1, "")
        self._next = asyncio.Event()

    def update(self, newest: Snapshot) -> None:
        self.snapshot, self._is_requested = newest, False
        self._wake()

    def begin(self, send: Callable[[bytes], Awaitable[None]]) -> asyncio.Task[None]:
        """A task that sends one viewer an event for each snapshot that is the newest when the last event has been
        taken; it ends when no other snapshot will come."""
        following = asyncio.get_running_loop().create_task(self._follow(send))
        self._followers.add(following)
        following.add_done_callback(self._followers.discard)
        return following

    async def end(self) -> None:
        """Waits `_LAST_S` for viewers to take the last snapshot, then cancels them."""
        self._is_over = True
        self._wake()
        if self._followers:
            _, late = await asyncio.wait(self._followers, timeout=_LAST_S)
            for follower in late:
                follower.cancel()

    async def _follow(self, send: Callable[[bytes], Awaitable[None]]) -> None:
        sent, drawn = -1, [-1] * len(self.pictures.figures)
        while True:
            while self.snapshot.number == sent:
                if self._is_over:
                    return
                await self._wait()
            sent = self.snapshot.number
            await send(self._event(drawn))

    def _event(self, drawn: list[int]) -> bytes:
        """The state for the page's script, made once for all viewers, and one outdated figure, if any: a browser that
        paints all three at once would delay the needle. `drawn` are the numbers of the viewer's figures."""
        now = self.snapshot
        if self._json[0] != now.number:
            self._json = now.number, as_json(now, self._params)
        event = f"data: {self._json[1]}\n\n"
        for _ in drawn if now.phase == "ended" else drawn[:1]:  # no event comes after the end
            oldest = drawn.index(min(drawn))
            if drawn[oldest] < now.pictures.number:
                drawn[oldest] = now.pictures.number
                event += f"event: picture\ndata: {self.pictures.json(oldest, now)}\n\n"
        return event.encode()

    async def _wait(self) -> None:
        if not self._is_requested:
            self._is_requested = True
            self._ask()
        await self._next.wait()

    def _wake(self) -> None:
        self._next.set()
        self._next = asyncio.Event()


def rendered(news: News) -> dict[str, tuple[str, str]]:
    """Type and content of each file of the page, by its path; the values come as events."""
    ours, report = files("oncenter.live"), files("oncenter.report")
    jinja = Environment(autoescape=True)
    jinja.policies["json.dumps_kwargs"] = {}  # in Bokeh's order: a model stands before its references
    template = jinja.from_string(ours.joinpath("page.html").read_text(encoding="utf-8"))
    figures = [json_item(figure, figure.name) for figure in news.pictures.figures]
    colours = "".join(f"--{name}:{colour};" for name, colour in COLOURS.items())
    css, script = (
        "\n".join(room.joinpath(f"page.{kind}").read_text(encoding="utf-8") for room in (report, ours))
        for kind in ("css", "js")
    )
    library = "\n".join(Resources(mode="inline", minified=True, components=["bokeh"]).js_raw)
    title = LIVE["title"].format(news.snapshot.truck)
    return {
        "/": ("text/html", template.render(texts=LIVE, title=title, figures=figures)),
        "/page.css": ("text/css", f":root{{{colours}}}\n{states_style()}{css}"),
        "/page.js": ("text/javascript", script),
        "/bokeh.js": ("text/javascript", library),
    }


def as_json(now: Snapshot, params: Mapping[str, float]) -> str:
    """The state for the page's script: words and degrees, null where not available."""
    offset = words.offset(now)
    counts, why = words.gate(now)
    angles, lost = now.angles, words.losses(now.dropped)
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
        "losses": lost and LIVE["frames_lost"].format(lost),
        "fault": "" if now.fault == "none" else LIVE["fault"].format(now.fault.replace("_", " ")),
        "findings": [
            {"severity": finding.severity, "text": words.sentence(finding.text)}
            for finding in (answer.findings if answer is not None else ())
        ],
        "said": [
            f"{time.strftime('%H:%M:%S', time.localtime(notice.time_s))} {notice.text}"
            for notice in now.notices[-_NOTICES_SHOWN:]
        ],
        "traffic": LIVE["traffic"].format(words.bus(now), words.duration(now.driven_s)),
    }
    return json.dumps(state, allow_nan=False)


def _verdict(verdict: Verdict, phase: str) -> dict[str, str]:
    """The action follows at the end: while driving, the next step is to drive on."""
    action = verdict.action if phase == "ended" else ""
    return {"state": verdict.state, "headline": words.signed(verdict.headline), "action": words.signed(action)}


def _number(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
