"""The fleet's page: the trucks to act on first, then the fleet; each truck's drives a click away. One offline file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jinja2 import Environment
from markupsafe import Markup

from oncenter import _core
from oncenter.files.whole_file import write_whole
from oncenter.fleet import pictures
from oncenter.fleet.listing import next_lines, offset_words
from oncenter.fleet.page_data import PageData
from oncenter.fleet.ranking import SHARE_OF_FALSE_ALARMS
from oncenter.report.canvas import COLOURS
from oncenter.report.document import document, embedded, key
from oncenter.utc import utc
from oncenter.verdict.states import AT_FAULT, OF_OFFSET, STATES, colour_of

_SHOWN, _LISTED = 20, 200  # trucks in the table at first, and when it is opened; every truck opens by its name
_FAULTS = {
    "check_signal": "The signals of its newest drive contradict each other: correct the signal that its report names.",
    "signal_or_sensor": "The steering wheel angle of its newest drive is lost, stuck or reversed: check the signal "
    "first, then the sensor.",
    "repair": "A fault of the steering wheel angle sensor at the newest drive, or its zero moves from drive to drive: "
    "check the sensor, its mounting and its connector.",
}


@dataclass(frozen=True)
class Contents:
    """The contents of a page.

    Attributes:
        ranked, changes: rows of the tables, times in s since 1970.
        drives: all drives, those without a truck included.
        refused: logs without an answer, by error code.
        data: all trucks' histories.
    """

    ranked: Sequence[dict[str, Any]]
    changes: Sequence[dict[str, Any]]
    drives: int
    refused: Mapping[str, int]
    data: PageData


def write_page(path: Path, contents: Contents) -> None:
    """Writes `index.html`."""
    write_whole(path, _page(contents))


def _page(contents: Contents) -> str:
    ranked, changes = contents.ranked, contents.changes
    drawn = {
        "distribution": pictures.distribution(ranked),
        "ranking": pictures.ranking(ranked),
        "calendar": pictures.calendar(changes),
        "history": pictures.truck_history(),
    }
    script, divs = embedded({name: picture for name, picture in drawn.items() if picture is not None})
    of_offset = [change for change in changes if change["quantity"] == "offset"]
    last = {change["truck"]: change for change in of_offset}
    body = _TEMPLATE.render(
        ranked=ranked,
        lines=[_line(row, last.get(row["truck"])) for row in ranked[:_LISTED]],
        at_fault=[row for row in ranked if row["state"] in AT_FAULT],
        counts={state: sum(row["state"] == state for row in ranked) for state in OF_OFFSET},
        days=[row[name] for row in ranked for name in ("first_drive", "last_drive") if row[name] is not None],
        drives=contents.drives,
        of_the_offset=len(of_offset),
        refused=", ".join(f"{count} {_spaced(code)}" for code, count in contents.refused.items()),
        # some trucks to recalibrate may be healthy because many trucks were tested
        weak=sum(row["state"] == "recalibrate" and row["q_value"] > SHARE_OF_FALSE_ALARMS for row in ranked),
        limit_deg=pictures.common_limit_deg(ranked),
        divs={name: Markup(div) for name, div in divs.items()},  # bokeh's
        data=contents.data.text(),
    )
    colours = json.dumps({name: COLOURS[name] for name in ("estimate", "rejected")})
    return document(
        f"Steering wheel angle offsets of {len(ranked)} trucks",
        body,
        script,
        style=_asset("fleet.css"),
        program=f"const COLOURS = {colours};\n{_asset('fleet.js')}",
    )


def _asset(name: str) -> str:
    return files("oncenter.fleet").joinpath(name).read_text(encoding="utf-8")


def _line(row: dict[str, Any], change: dict[str, Any] | None) -> dict[str, Any]:
    """A line of the ranking."""
    has_offset = row.get("p_value") is not None
    offset, interval = map(_minus, offset_words(row)) if has_offset else ("—", "—")
    small = "< 0.001" if has_offset and row["q_value"] < 0.001 else None
    return {
        "row": row,
        "next": next_lines(row),
        "has_offset": has_offset,
        "offset": offset,
        "interval": interval,
        "since": _day(row["since"]) if change is not None and has_offset else "",
        "change": "" if change is None else f"{_signed(change['size'])} deg, {_spaced(change['cause'])}",
        "q": small or (f"{row['q_value']:.3f}" if has_offset else "—"),
    }


def _signed(number: float) -> str:
    return _minus(f"{number:+.1f}").replace("+0.0", "0.0").replace("−0.0", "0.0")


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _spaced(name: str) -> str:
    return name.replace("_", " ")


def _day(time_s: float) -> str:
    return f"{utc(time_s):%Y-%m-%d}"


_KEY_OF_TRUCK = key(
    estimate_dot="one drive, 95 % interval; paler: still converging",
    rejected_up="a drive before a fault of its sensor",
    rejected_dashed="change",
    used_dashed="limit",
    measured_stroke="offset by the model of the truck, without the pull and the sensor biases that all its drives "
    "share; so it may lie above or below all of them",
)
_KEY_OF_CAUSES = key(**{f"{colour}_{form}": _spaced(name) for name, (colour, form, _) in pictures.CAUSES.items()})
_JINJA = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
_JINJA.filters |= {"day": _day, "quoted": partial(quote, safe=""), "spaced": _spaced}
_TEMPLATE = _JINJA.from_string(
    _asset("page.html"),
    {
        "of_offset": OF_OFFSET,
        "states": STATES,
        "not_drawn": ("check_signal", "no_offset"),  # without an offset
        "colour_of": colour_of,
        "faults": _FAULTS,
        "key_of_truck": Markup(_KEY_OF_TRUCK),
        "key_of_causes": Markup(_KEY_OF_CAUSES),
        "false_alarms": SHARE_OF_FALSE_ALARMS,
        "shown": _SHOWN,
        "listed": _LISTED,
        "version": _core.version(),
    },
)
