"""Names that somebody else wrote, on every page: of trucks, logs, signals, users. They are text and no tag."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace
from typing import Any

import pytest
from live_drive import TRUCK

import oncenter as oc
from oncenter.findings import Finding
from oncenter.fleet.page import Contents, _page
from oncenter.fleet.page_data import PageData
from oncenter.live.learner import Learner, needed
from oncenter.live.page import News, rendered
from oncenter.live.session import Notices, Session
from oncenter.live.snapshot import Dropped
from oncenter.offset.compare import Comparison, Offset
from oncenter.offset.inputs import params_of
from oncenter.offset.run import outputs_of
from oncenter.read.stream import Stream
from oncenter.report.angle_course import angle_course
from oncenter.report.angle_page import angle_page
from oncenter.report.certificate import certificate
from oncenter.report.origin import Origin
from oncenter.report.page import page
from oncenter.signals import Signals
from oncenter.utc import utc

NAME = "</title></script><script>alert(1)</script><img src=x onerror=alert(2)>\"' onclick='x' &amp;{{ 7 * 7 }}{% x %}"
VEHICLE = oc.vehicle(TRUCK)


class Tags(HTMLParser):
    """Each tag with the names of its attributes, and the text beside scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, list[str]]] = []
        self.text = self._tag = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._tag = tag
        self.found.append((tag, [name for name, _ in attrs]))

    def handle_endtag(self, tag: str) -> None:
        self._tag = ""

    def handle_data(self, data: str) -> None:
        self.text += "" if self._tag in ("script", "style") else data


@pytest.fixture(scope="module")
def drive() -> Signals:
    return oc.simulate("weave", seed=1)[0]


def report_of(drive: Signals, name: str) -> str:
    answer = oc.offset(drive, VEHICLE)
    changed = replace(
        answer,
        log=name,
        notes=(name,),
        sources={name: name},
        findings=(Finding(name, "warning", name),),
        vehicle=VEHICLE.model_copy(update={"name": name, "origin": name}),
        drives=tuple(replace(each, log=name) for each in answer.drives),
    )
    return page(changed, outputs_of(answer), Origin(vin=name, user=name))


def angle_page_of(drive: Signals, name: str) -> str:
    source = replace(next(iter(drive.sources.values())), description=name)
    named = replace(drive, log=name, sources={name: source})
    course = angle_course(oc.angle(drive, VEHICLE), drive, None, None)
    return angle_page(course, named, VEHICLE.model_copy(update={"name": name}), name, False, (name,))


def certificate_of(_: Signals, name: str) -> str:
    before, after = (Offset(name, name, name, "joint", value, 0.1, "valid", {}) for value in (3.0, 0.1))
    return certificate(Comparison(before, after, 2.0, -2.9, 0.2, 0.0, "successful"), utc(0.0))


def fleet_page_of(_: Signals, name: str) -> str:
    row = {
        **dict.fromkeys(("truck", "second_line", "would_decide"), name),
        **dict.fromkeys(("first_drive", "last_drive", "since"), 0.0),
        **{"rank": 1, "limit_deg": 2.0, "offset_deg": 3.0, "offset_sd_deg": 0.1, "p_value": 0.01, "q_value": 0.01},
        **{"offset_low_deg": 2.8, "offset_high_deg": 3.2},
    }
    ranked = [{**row, "state": state} for state in ("recalibrate", "check_signal")]
    change = {"truck": name, "quantity": "offset", "size": 3.0, "sd": 0.1, "by_drive": 0.0, "cause": "gyro"}
    return _page(Contents(ranked, [change], 1, {name: 1}, PageData(1)))


def live_page_of(_: Signals, name: str) -> str:
    silent: Any = SimpleNamespace(name=name, dropped=Dropped())
    session = Session(silent, Learner(Stream(name, needed(VEHICLE)), VEHICLE), name, Notices())
    return rendered(News(session.snapshot, params_of(VEHICLE, None), lambda: None))["/"][1]


@pytest.mark.parametrize("made", [report_of, angle_page_of, certificate_of, fleet_page_of, live_page_of])
def test_a_name_adds_no_tag_and_no_attribute_and_can_be_read(made: Callable[[Any, str], str], drive: Signals) -> None:
    plain, named = (Tags(made(drive, name)) for name in ("x", NAME))
    assert named.found == plain.found
    assert NAME in named.text
