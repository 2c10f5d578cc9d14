"""A session on a terminal: a panel that is redrawn; without a terminal, a line every 10 s."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, TextIO

from oncenter.app.texts import LIVE
from oncenter.files.file_name import printable
from oncenter.live import words
from oncenter.live.snapshot import Notice, Snapshot
from oncenter.verdict.states import colour_of

if TYPE_CHECKING:
    from rich.panel import Panel

    from oncenter.live.session import Session

_DRAW_EVERY_S = 0.25
_LINE_EVERY_S = 10.0
_STYLES = {"valid": "bold green", "converging": "bold blue", "unobservable": "dim", "invalid": "bold red"}


def watch(session: Session, params: Mapping[str, float]) -> None:
    """Shows the session on stderr until it ends."""
    if sys.stderr.isatty():
        _draw(session, params)
    else:
        _print_lines(session, sys.stderr, params)


def _draw(session: Session, params: Mapping[str, float]) -> None:
    from rich.console import Console
    from rich.live import Live

    console = Console(stderr=True)
    with Live(console=console, auto_refresh=False) as display:
        shown = 0
        while True:
            ended = not session.is_alive()
            now = session.snapshot
            for notice in _new(now, shown):
                console.print(_line(notice), markup=False, highlight=False)
                shown = notice.number
            display.update(panel(now, params), refresh=True)
            if ended:
                return
            session.join(_DRAW_EVERY_S)


def _print_lines(session: Session, stream: TextIO, params: Mapping[str, float]) -> None:
    shown, next_line_s = 0, time.monotonic() + _LINE_EVERY_S
    while True:
        ended = not session.is_alive()
        now = session.snapshot
        for notice in _new(now, shown):
            print(f"oncenter: {printable(notice.text)}", file=stream, flush=True)
            shown = notice.number
        if ended:
            print(f"oncenter: {printable(words.finished(now))}", file=stream, flush=True)
            return
        if time.monotonic() >= next_line_s:
            next_line_s += _LINE_EVERY_S
            print(f"oncenter: {printable(one_line(now, params))}", file=stream, flush=True)
        session.join(_DRAW_EVERY_S)


def _new(now: Snapshot, shown: int) -> list[Notice]:
    return [notice for notice in now.notices if notice.number > shown]


def _line(notice: Notice) -> str:
    return f"{time.strftime('%H:%M:%S', time.localtime(notice.time_s))} {printable(notice.text)}"


def one_line(now: Snapshot, params: Mapping[str, float]) -> str:
    headline = f"{now.verdict.headline} " if now.verdict is not None else ""
    missing = words.still_missing(now, params)
    needed = f"; still needed: {', '.join(missing)}" if missing else ""
    return f"{headline}{_offset(words.offset(now))}; {words.gate(now)[1]}; {words.bus(now)}{needed}"


def _offset(given: words.Offset) -> str:
    if not given.of_drive:
        return f"no straight-ahead offset yet ({given.status})"
    begin = f"{given.status}, {given.but}: " if given.but else ""
    end = "" if given.but else f" ({given.status})"
    text = f"straight-ahead offset {begin}{given.value} deg {given.of_drive} from the driving{end}"
    return f"{text}, {given.whole} with {given.beside}" if given.beside else text


def panel(now: Snapshot, params: Mapping[str, float]) -> Panel:
    from rich.panel import Panel
    from rich.table import Table
    from rich.text import Text

    offset = words.offset(now)
    is_used, why = words.gate(now)
    rows = Table.grid(padding=(0, 2))
    rows.add_column(style="dim", no_wrap=True)
    rows.add_column(overflow="fold")
    if now.ended_s is not None:
        rows.add_row("", Text(words.sentence(words.finished(now)), style="bold"))
    if now.verdict is not None:
        action = f" {now.verdict.action}" if now.ended_s is not None else ""
        text = words.signed(f"{now.verdict.headline}{action}")
        rows.add_row("verdict", Text(text, style=f"bold {colour_of(now.verdict.state)}"))
    value = f"{offset.value} deg, {offset.but}" if offset.but else f"{offset.value} deg"
    standing = Text(value, style="dim" if offset.but else "bold")
    standing.append(f"  {offset.of_drive} from the driving" if offset.of_drive else "", style="blue")
    standing.append(f"  {offset.status}", style=_STYLES[offset.status])
    rows.add_row("straight-ahead offset", standing)
    if offset.beside:
        rows.add_row("", Text(f"{offset.whole} with {offset.beside}", style="blue"))
    for name, text in words.quantities(now).items():
        rows.add_row(name, Text(text))
    angles = now.angles
    rows.add_row(
        "steering wheel",
        Text(
            f"measured {words.number(angles.measured_rad)}  corrected {words.number(angles.corrected_rad)}  "
            f"estimated {words.number(angles.estimated_rad)} deg"
        ),
    )
    if now.ended_s is None:
        rows.add_row("this driving", Text(why, style="green" if is_used else "yellow"))
    missing = words.still_missing(now, params)
    nothing = "none" if now.ended_s is not None else "none: you can stop"
    rows.add_row("still needed", Text("; ".join(missing) or nothing, style="" if missing else "green"))
    if now.fault != "none":
        rows.add_row("sensor fault", Text(now.fault.replace("_", " "), style="bold red"))
    for finding in now.known.answer.findings if now.known.answer is not None else ():
        rows.add_row(
            finding.severity,
            Text(words.sentence(finding.text), style="yellow" if finding.severity == "warning" else ""),
        )
    rows.add_row("bus", Text(LIVE["traffic"].format(words.bus(now), words.duration(now.driven_s)), style="dim"))
    return Panel(rows, title=Text(f"{now.truck} on {now.bus}"), title_align="left", border_style="dim")
