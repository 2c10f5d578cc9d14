"""The page of `oncenter app`: who gets in, what it keeps, and that it says what the command says."""

from __future__ import annotations

import csv
import http.client
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import polars as pl
import pytest
from browser import note_errors
from live_drive import until

import oncenter as oc
from oncenter.signals import SignalName
from oncenter.simulate import simulate_to_log
from oncenter.vehicle_file.new import proposals_for

pytest.importorskip("tornado", reason="tornado is not installed: pip install 'oncenter[report]'")

ROOT = Path(__file__).parents[1]
FORM = {
    "name": "M-AB 12",
    "wheelbase_m": "3,7 m",
    "steering_ratio": "19,3",
    "axle_layout": "4x2",
    "traffic_side": "right",
}


@dataclass
class Page:
    """A page that is served, and a browser's requests to it."""

    port: int
    key: str
    trucks: Path

    def ask(self, method: str, path: str, body: Any = None, **headers: str | None) -> tuple[int, bytes]:
        """Status and body; headers by their names with _ for -, None leaves one out."""
        given = {"Host": f"127.0.0.1:{self.port}", "Origin": f"http://127.0.0.1:{self.port}"}
        given |= {"Cookie": f"oncenter-{self.port}={self.key}"}
        given |= {name.replace("_", "-"): value for name, value in headers.items()}
        sent = body if isinstance(body, bytes) or body is None else json.dumps(body).encode()
        client = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        try:
            client.request(method, path, sent, {name: value for name, value in given.items() if value is not None})
            response = client.getresponse()
            return response.status, response.read()
        finally:
            client.close()

    def said(self, method: str, path: str, body: Any = None) -> Any:
        status, text = self.ask(method, path, body)
        assert status == 200, text
        return json.loads(text)

    def refused(self, method: str, path: str, body: Any) -> str:
        status, text = self.ask(method, path, body)
        assert status >= 400, text
        return str(json.loads(text)["message"])

    def drop(self, log: Path) -> str:
        content = log.read_bytes()
        key = self.said("POST", "/logs", {"name": log.name, "size": len(content)})["log"]
        self.said("PUT", f"/logs/{key}", content)
        return str(key)

    def begun(self, key: str, content: bytes) -> http.client.HTTPConnection:
        """The connection of a log of 1000 bytes that has begun to come."""
        client = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        client.putrequest("PUT", f"/logs/{key}")
        for name, value in (("Content-Length", "1000"), ("Cookie", f"oncenter-{self.port}={self.key}")):
            client.putheader(name, value)
        client.putheader("Origin", f"http://127.0.0.1:{self.port}")
        client.endheaders(content)
        return client

    def answer(self, *logs: str, **given: str) -> dict[str, Any]:
        asked = {"group": "shipped", "name": "scania_r730_4x2", "logs": logs, **given}
        return self.ended(self.said("POST", "/answers", asked)["answer"])

    def ended(self, key: str) -> dict[str, Any]:
        until = time.monotonic() + 60.0
        while (answer := self.said("GET", f"/answers/{key}"))["state"] == "running":
            assert time.monotonic() < until
            time.sleep(0.05)
        return {"key": key, **answer}


@contextmanager
def served(trucks: Path, browser: Path | None = None) -> Iterator[Page]:
    command = [sys.executable, "-m", "oncenter", "app", "--trucks", str(trucks)]
    command += ["--no-browser"] if browser is None else []
    environment = {**os.environ, "BROWSER": f"{browser} %s"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        opened = re.search(r"http://127\.0\.0\.1:(\d+)/\?key=([\w-]+)", process.stdout.readline())
        assert opened is not None
        try:
            yield Page(int(opened[1]), opened[2], trucks)
        finally:
            process.kill()


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with served(tmp_path_factory.mktemp("app") / "trucks") as page:
        yield page


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("logs") / "my drive.log"
    simulate_to_log("weave", 1, path)
    return path


def test_the_command_line_of_the_browser_lets_in_one_and_neither_where_two_come(tmp_path: Path) -> None:
    """Other users of the machine see it. The printed address still lets in whoever sees the terminal."""
    browser, seen = tmp_path / "browser", tmp_path / "seen"
    browser.write_text(f'#!/bin/sh\necho "$1" >{seen}.new && mv {seen}.new {seen}\n')
    browser.chmod(0o700)
    with served(tmp_path / "trucks", browser) as page:
        until(seen.exists)
        address = seen.read_text().strip()
        assert page.key not in address
        path = address.partition(str(page.port))[2]
        client = http.client.HTTPConnection("127.0.0.1", page.port, timeout=20)
        client.request("GET", path)
        cookie = client.getresponse().getheader("Set-Cookie", "").partition(";")[0]
        assert page.ask("GET", "/", Cookie=cookie)[0] == 200
        assert b"was opened before" in page.ask("GET", path, Cookie=None)[1]
        assert page.ask("GET", "/", Cookie=cookie)[0] == 403
        assert page.ask("GET", "/")[0] == 200


STRANGERS: tuple[tuple[str, dict[str, str | None]], ...] = (
    ("GET", {"Cookie": None}),
    ("GET", {"Cookie": "oncenter=x"}),
    ("GET", {"Host": "evil.example"}),
    ("POST", {"Origin": "http://evil.example"}),
    ("POST", {"Origin": None}),
    ("DELETE", {"Origin": "null"}),
)


def test_only_this_user_s_page_gets_an_answer(page: Page) -> None:
    paths = ("/", "/app.js", "/trucks", "/signals", "/logs", "/logs/x", "/answers/x", "/answers/x/report", "/no")
    with ThreadPoolExecutor(len(STRANGERS) * len(paths)) as pool:  # at once, since a refusal takes its time
        asked = [
            pool.submit(page.ask, method, path, FORM if method == "POST" else None, **headers)
            for method, headers in STRANGERS
            for path in paths
        ]
    assert {each.result()[0] for each in asked} == {403}
    assert not page.trucks.exists() or not list(page.trucks.glob("M-AB*12.toml"))


def test_the_address_that_is_printed_opens_the_page_and_another_key_does_not(page: Page) -> None:
    status, _ = page.ask("GET", f"/?key={page.key}", Cookie=None)
    assert status == 302
    assert page.ask("GET", "/?key=guessed", Cookie=None)[0] == 403


def test_a_truck_is_kept_as_people_write_it_and_never_replaced(page: Page) -> None:
    form = {**FORM, "name": "M/AB ../<b>12"}
    stem = page.said("POST", "/trucks", form)["name"]
    (kept,) = page.trucks.iterdir()
    assert kept.stem == stem
    truck = oc.vehicle(kept)
    assert (truck.name, truck.wheelbase_m, truck.steering_ratio) == ("M/AB ../<b>12", 3.7, 19.3)
    listed = page.ask("GET", "/")[1]
    assert b"<b>12" not in listed and b"M/AB ../&lt;b&gt;12" in listed
    assert "choose it" in page.refused("POST", "/trucks", form)
    for wrong, said in (
        ({"wheelbase_m": "long"}, "not a number: long"),
        ({"wheelbase_m": "370"}, "370 m is out of the range 1 to 20 m; in cm? 370 cm are 3.7 m"),
        ({"name": " "}, "give the truck a name"),
    ):
        status, text = page.ask("POST", "/trucks", FORM | wrong)
        assert status == 400
        assert said in json.loads(text)["message"] and json.loads(text)["needs"] == [*wrong]


@pytest.mark.parametrize(
    ("field", "written", "read"),
    [
        ("wheelbase_m", "3,7 m", "3.7 m"),
        ("wheelbase_m", "3700 mm", "3.7 m"),
        ("wheelbase_m", "370cm", "3.7 m"),
        ("wheelbase_m", '145,7"', "3.70078 m"),
        ("steering_ratio", "18:1", "18"),
        ("steering_ratio", "18,5 : 1", "18.5"),
        ("steering_ratio", "1:18.5", "18.5"),
        ("limit", "2,5°", "2.5 deg"),
        ("applied", "−2", "-2 deg"),
    ],
)
def test_a_number_is_read_in_the_unit_that_people_write(page: Page, field: str, written: str, read: str) -> None:
    assert page.said("POST", "/fields", {"field": field, "written": written}) == {"read": read, "unusual": ""}


def test_an_unusual_number_is_taken_with_a_sentence_and_an_impossible_one_is_not(page: Page) -> None:
    field = {"field": "steering_ratio", "written": "40"}
    assert page.said("POST", "/fields", field)["unusual"] == "Unusual: 40; trucks have 13 to 27."
    assert "out of the range 1 to 60" in page.said("POST", "/fields", field | {"written": "400"})["wrong"]
    assert "19.3 or 19.3:1" in page.said("POST", "/fields", field | {"written": "16 to 24"})["wrong"]


@pytest.mark.parametrize(
    ("name", "size", "said"),
    [
        ("notes.pdf", 10, "notes.pdf is not a log"),
        ("drive.log", 0, "empty"),
        ("drive.log", 10**15, "MB left"),
        ("a\x1b[31m.pdf", 1, r"a\x1b[31m.pdf"),
    ],
)
def test_what_cannot_be_taken_is_refused_before_it_is_sent(page: Page, name: str, size: int, said: str) -> None:
    assert said in page.refused("POST", "/logs", {"name": name, "size": size})


def test_a_log_is_taken_once_in_the_size_that_was_announced(page: Page) -> None:
    key = page.said("POST", "/logs", {"name": "../../drive.log", "size": 5})["log"]
    assert "announced" in page.refused("PUT", f"/logs/{key}", b"longer than five")
    assert page.said("PUT", f"/logs/{key}", b"12345") == {}
    assert "announced" in page.refused("PUT", f"/logs/{key}", b"12345")
    page.said("DELETE", f"/logs/{key}")
    assert "announced" in page.refused("PUT", f"/logs/{key}", b"12345")


def test_a_log_that_is_cut_on_its_way_is_not_answered(page: Page) -> None:
    key = page.said("POST", "/logs", {"name": "drive.log", "size": 1000})["log"]
    page.begun(key, b"half").close()
    asked = {"group": "shipped", "name": "rigid_6x2", "logs": [key]}
    assert "Wait until all logs" in page.refused("POST", "/answers", asked)


def test_the_page_says_what_the_command_says(page: Page, log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from oncenter.cli import run

    answer = page.answer(page.drop(log))
    assert answer["state"] == "done"
    assert run(["offset", str(log), "--vehicle", "scania_r730_4x2", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert answer["said"]["verdicts"] == said["verdicts"]
    assert answer["said"]["offset"] == said["offset"]
    status, table = page.ask("GET", f"/answers/{answer['key']}/csv")
    first, second, *_ = csv.reader(table.decode("utf-8-sig").splitlines())
    row = dict(zip(first, second, strict=True))
    assert (row["quantity"], row["unit"], float(row["value"])) == (
        "offset",
        "deg",
        pytest.approx(said["offset"]["value"], 1e-5),
    )
    assert [float(row[end]) for end in ("ci95_low", "ci95_high")] == pytest.approx(said["offset"]["ci95"], 1e-5)
    status, report = page.ask("GET", f"/answers/{answer['key']}/report")
    assert status == 200 and b"Straight-ahead offset" in report and str(page.trucks.parent).encode() not in report


def test_the_form_states_nothing_that_nobody_answered(page: Page) -> None:
    _, form = page.ask("GET", "/")
    chosen = re.findall(r'<input type="radio" name="(\w+)" value="(\w*)" checked>', form.decode())
    assert chosen == [("axle_layout", ""), ("traffic_side", "")]


def test_a_truck_that_nobody_describes_has_an_answer_too(page: Page, log: Path) -> None:
    (page.trucks / "side.toml").parent.mkdir(exist_ok=True)
    kept = page.said(
        "POST", "/trucks", {"name": "a guest", "traffic_side": "left", "wheelbase_m": "", "axle_layout": ""}
    )
    assert 'traffic_side = "left"' in (page.trucks / f"{kept['name']}.toml").read_text()
    key = page.drop(log)
    for group, name in (("unknown", "unknown"), (kept["group"], kept["name"])):
        answer = page.answer(key, group=group, name=name)
        assert "unknown_truck" in [finding["code"] for finding in answer["said"]["findings"]]


@pytest.fixture(scope="module")
def own_network(page: Page, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A log and its database. The angle of this network is positive to the right, as a comment of the database says."""
    log, example = tmp_path_factory.mktemp("own") / "own.blf", ROOT / "examples" / "own_dbc"
    subprocess.run([sys.executable, example / "write_log.py", log, "weave"], check=True, capture_output=True)
    return {"databases": [page.drop(example / "chassis.dbc")], "logs": [page.drop(log)], "log": log}


CHOSEN = {
    "steering_wheel_angle": {"name": "STEERING.WheelAngle", "unit": "deg", "sign": -1},
    "yaw_rate": {"name": "MOTION.YawRate", "unit": "deg_s", "sign": 1},
    "vehicle_speed": {"name": "SPEED.VehSpeed", "unit": "km_h", "sign": 1},
    "lateral_acceleration": {"name": "MOTION.LatAccel", "unit": "m_s2", "sign": 1},
}


def asked_with(own_network: dict[str, Any], name: str, **changed: dict[str, Any]) -> dict[str, Any]:
    signals = {signal: {**entry, **changed.get(signal, {})} for signal, entry in CHOSEN.items()}
    return {**FORM, "name": name, **{key: own_network[key] for key in ("databases", "logs")}, "signals": signals}


def rows_of(page: Page, asked: dict[str, Any]) -> dict[str, Any]:
    return {row["signal"]: row for row in page.said("POST", "/signals", asked)["rows"]}


def test_signals_of_an_own_network_are_proposed_beside_what_they_should_look_like(
    page: Page, own_network: dict[str, Any]
) -> None:
    asked = {**asked_with(own_network, "proposed"), "signals": None}
    said = page.said("POST", "/signals", asked)
    rows = {row["signal"]: row for row in said["rows"]}
    chosen = {signal: {key: rows[signal][key] for key in entry} for signal, entry in CHOSEN.items()}
    assert chosen == CHOSEN
    assert ["STEERING.WheelTorque", "Nm"] in said["names"]
    angle, expected = (np.array(curve) for curve in rows["steering_wheel_angle"]["picture"]["curves"])
    assert np.corrcoef(angle, expected)[0, 1] > 0.95
    assert np.std(angle) == pytest.approx(np.std(expected), rel=0.2)
    assert [rows[signal]["said"][0][0] for signal in ("steering_wheel_angle", "yaw_rate")] == ["ok", "ok"]
    assert not list(page.trucks.glob("proposed*"))


def test_what_is_chosen_is_kept_and_answered_by_its_database_alone(page: Page, own_network: dict[str, Any]) -> None:
    kept = page.said("POST", "/trucks", asked_with(own_network, "own network"))
    truck = oc.vehicle(page.trucks / f"{kept['name']}.toml")
    assert {signal: entry.model_dump(exclude_none=True) for signal, entry in truck.signals.items()} == {
        signal: {**entry, "road_wheel": False} for signal, entry in CHOSEN.items()
    }
    answer = page.answer(*own_network["logs"], group="yours", name=kept["name"])
    low, high = answer["said"]["offset"]["ci95"]
    assert low < 2.04 < high
    facts = page.said("GET", f"/trucks/{quote(kept['name'])}")["facts"]
    assert facts[-1] == "Corrected the reversed sign of: steering wheel angle"
    given = {"group": "yours", "name": kept["name"], "applied": "1", "limit": "1"}  # as the truck's own tool shows it
    applied = page.answer(*own_network["logs"], **given)["said"]
    assert applied["offset"]["applied_deg"] == -1.0  # positive to the left
    _, report = page.ask("GET", f"/answers/{answer['key']}/report")
    assert b"corrected the reversed sign of steering wheel angle" in report
    assert str(page.trucks).encode() not in report and b"own%20network" not in report


def test_a_flipped_sign_is_said_at_its_row_and_mended_in_a_truck_that_is_kept(
    page: Page, own_network: dict[str, Any]
) -> None:
    asked = asked_with(own_network, "flipped", steering_wheel_angle={"sign": 1})
    rows = rows_of(page, asked)
    state, text = rows["steering_wheel_angle"]["said"][0]
    assert state == "bad" and "sign of the steering wheel angle is reversed" in text and "Flip the sign" in text
    assert all(rows[signal]["said"][0][0] == "ok" for signal in ("yaw_rate", "lateral_acceleration"))
    kept = page.said("POST", "/trucks", asked)["name"]
    again = {"truck": kept, "logs": own_network["logs"]}
    assert rows_of(page, again)["steering_wheel_angle"]["said"][0][0] == "bad"
    (page.trucks / "drives" / kept).mkdir(parents=True)  # answered with the wrong sign
    page.said("POST", "/trucks", {**again, "signals": CHOSEN})
    assert not (page.trucks / "drives" / kept).exists()
    truck = oc.vehicle(page.trucks / f"{kept}.toml")
    assert (truck.signals["steering_wheel_angle"].sign, truck.wheelbase_m) == (-1, 3.7)
    assert rows_of(page, again)["steering_wheel_angle"]["said"] == [["ok", "Fits the other signals."]]
    (page.trucks / "drives" / kept).mkdir()
    page.said("POST", "/trucks", {**again, "signals": CHOSEN})
    assert (page.trucks / "drives" / kept).exists()  # nothing was changed
    page.said("POST", "/trucks", {**again, "name": "flipped", "wheelbase_m": "4 m", "signals": CHOSEN})
    truck = oc.vehicle(page.trucks / f"{kept}.toml")
    assert (truck.wheelbase_m, truck.assumed, len(truck.signals)) == (4.0, ("steering_ratio",), len(CHOSEN))


@pytest.mark.parametrize(
    ("signal", "unit", "factor"),
    [("steering_wheel_angle", "rad", "57.3"), ("yaw_rate", "rad_s", "57.3"), ("vehicle_speed", "m_s", "3.6")],
)
def test_a_swapped_unit_is_said_at_its_row(
    page: Page, own_network: dict[str, Any], signal: str, unit: str, factor: str
) -> None:
    rows = rows_of(page, asked_with(own_network, "swapped", **{signal: {"unit": unit}}))
    state, text = rows[signal]["said"][0]
    assert state == "bad" and f"too large by a factor of {factor}" in text and "Choose another unit in this row" in text
    assert [name for name in CHOSEN if rows[name]["said"] and rows[name]["said"][0][0] == "bad"] == [signal]


def test_a_yaw_rate_that_is_chosen_as_the_speed_is_said_at_its_row(page: Page, own_network: dict[str, Any]) -> None:
    speed = {"name": "MOTION.YawRate", "unit": "m_s", "sign": 1}
    rows = rows_of(page, asked_with(own_network, "no speed", vehicle_speed=speed))
    said = " ".join(text for state, text in rows["vehicle_speed"]["said"] if state == "bad")
    assert all(each in said for each in ("chosen in another row", "unit deg/s, which", "goes below zero"))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"name": "MOTION.Roll"}, "MOTION.Roll is not a signal of chassis.dbc, own.blf"),
        ({"name": "../../etc/passwd"}, "is not a signal of"),
        ({"unit": "furlong"}, "yaw rate has no unit furlong: it is rad_s or deg_s"),
        ({"sign": 2}, "the sign of the yaw rate is 1 or -1"),
    ],
)
def test_a_choice_that_the_files_do_not_have_is_refused(
    page: Page, own_network: dict[str, Any], given: dict[str, Any], said: str
) -> None:
    asked = asked_with(own_network, "refused", yaw_rate=given)
    for path in ("/signals", "/trucks"):
        assert said in page.refused("POST", path, asked)
    assert not list(page.trucks.glob("refused*"))
    assert "Choose a truck first" in page.refused("POST", "/signals", {**asked, "truck": "../../somebody"})


def test_the_search_for_signals_ends_when_nobody_waits_for_it(own_network: dict[str, Any]) -> None:
    database = [ROOT / "examples" / "own_dbc" / "chassis.dbc"]

    def gone(_: float) -> None:
        raise ConnectionAbortedError

    with pytest.raises(ConnectionAbortedError):
        proposals_for(database, own_network["log"], progress=gone)
    names = {"yaw_rate": SignalName("MOTION.YawRate")}
    assert oc.read(own_network["log"], names=names, dbc=database).ticks > 1000


def test_a_signal_that_says_nothing_is_named_at_its_row(page: Page, tmp_path: Path) -> None:
    """Columns of a table: one never moves, one has no unit, one is missing."""
    table = oc.simulate("weave")[0].table
    columns = {"t": table["time_s"], "SteeringWheelAngle": table["steering_wheel_angle_rad"]}
    columns |= {"YawRate_rad_s": 0.0 * table["yaw_rate_rad_s"], "VehicleSpeed_m_s": table["vehicle_speed_m_s"]}
    pl.DataFrame(columns).write_csv(tmp_path / "drive.csv")
    asked = {**FORM, "name": "table", "logs": [page.drop(tmp_path / "drive.csv")]}
    said = page.said("POST", "/signals", asked)
    rows = {row["signal"]: row for row in said["rows"]}
    assert any("t: this column is read as the time in seconds" in note for note in said["notes"])
    assert ["bad", "Nothing fits by its name. Choose a signal."] in rows["lateral_acceleration"]["said"]
    assert any("gives no unit" in text for _, text in rows["steering_wheel_angle"]["said"])
    (state, text), *_ = rows["yaw_rate"]["said"]
    assert state == "bad" and "yaw rate stays at one value" in text and "Choose another signal" in text
    signals = {signal: {"name": row["name"]} for signal, row in rows.items() if row["name"]}
    kept = page.said("POST", "/trucks", {**asked, "signals": signals})["name"]
    assert oc.vehicle(page.trucks / f"{kept}.toml").signals["time"].name == "t"


def test_two_drives_are_compared_and_have_a_certificate(page: Page, log: Path, tmp_path: Path) -> None:
    oc.simulate("hard_turn")[0].table.write_parquet(tmp_path / "after.parquet")
    before, after = (page.answer(page.drop(each))["key"] for each in (log, tmp_path / "after.parquet"))
    comparison = page.ended(page.said("POST", "/comparisons", {"before": before, "after": after})["answer"])
    assert comparison["said"]["schema"] == "oncenter/compare-1"
    status, certificate = page.ask("GET", f"/answers/{comparison['key']}/report")
    assert status == 200 and b"Name, signature" in certificate
    assert "another drive" in page.refused("POST", "/comparisons", {"before": before, "after": before})


def test_the_certificate_orders_the_drives_by_their_dates_whichever_was_dropped_first(
    page: Page, tmp_path: Path
) -> None:
    keys = []
    for year, scenario in ((2017, "weave"), (2016, "hard_turn")):
        log = tmp_path / f"{year}.parquet"
        oc.simulate(scenario)[0].table.write_parquet(log, metadata={"start_time": f"{year}-03-02T07:00:00"})
        keys.append(page.answer(page.drop(log))["key"])
    comparison = page.ended(page.said("POST", "/comparisons", {"before": keys[0], "after": keys[1]})["answer"])
    assert [comparison["said"][name]["log"] for name in ("before", "after")] == ["2016.parquet", "2017.parquet"]


def test_a_drive_of_an_own_truck_is_there_next_time_until_it_is_forgotten(page: Page, log: Path) -> None:
    name = page.said("POST", "/trucks", FORM | {"name": "my/truck"})["name"]
    truck = f"/trucks/{quote(name)}"
    fresh = page.said("GET", truck)
    assert fresh["drives"] == [] and fresh["common"] is None
    assert fresh["facts"][::2] == ["Wheelbase: 3.7 m", "Axles: 4x2"]
    answer = page.answer(page.drop(log), group="yours", name=name)
    (kept,) = page.said("GET", truck)["drives"]
    assert kept["log"].endswith(log.name) and kept["verdict"] == answer["said"]["verdicts"][0]
    asked = {"truck": name, "drive": kept["drive"], "after": answer["key"]}
    assert "another drive" in page.refused("POST", "/comparisons", asked)  # with itself
    page.said("DELETE", f"{truck}/drives/{kept['drive']}")
    assert page.said("GET", truck)["drives"] == []
    (page.trucks / f"{name}-1.dbc").touch()
    page.said("DELETE", truck)
    assert "Choose a truck" in page.refused("GET", truck, None)
    assert not list(page.trucks.rglob("my*"))
    assert "Choose a truck" in page.refused("DELETE", "/trucks/..%2Fpage", None)


def test_limit_and_applied_correction_are_those_of_the_form(page: Page, log: Path) -> None:
    answer = page.answer(page.drop(log), limit="1,5 deg", applied="-2")
    assert answer["said"]["limit_deg"] == 1.5
    assert answer["said"]["offset"]["applied_deg"] == -2.0
    asked = {"group": "unknown", "logs": ["x"], "limit": "two"}
    assert "not a number: two" in page.refused("POST", "/answers", asked)


def test_a_log_without_an_answer_has_the_command_s_error(page: Page, tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_text("time_s,speed\n1,2\n")
    answer = page.answer(page.drop(tmp_path / "empty.csv"))
    assert answer["state"] == "failed"
    assert "empty.csv" in answer["said"]["message"] and "Traceback" not in answer["said"]["message"]


def test_a_code_is_explained_in_the_words_of_the_command(page: Page) -> None:
    assert "What it means" in page.said("GET", "/explanations/missing_signal")["text"]
    assert "no finding" in page.said("GET", "/explanations/no_such_code")["text"]


def test_an_answer_can_be_cancelled(page: Page, log: Path) -> None:
    asked = {"group": "shipped", "name": "rigid_6x2", "logs": [page.drop(log)]}
    key = page.said("POST", "/answers", asked)["answer"]
    page.said("DELETE", f"/answers/{key}")
    assert page.said("GET", f"/answers/{key}") == {"state": "cancelled", "said": None}
    assert page.ask("GET", f"/answers/{key}/report")[0] == 404


def test_300_requests_without_an_end_lock_nobody_out_and_cut_no_log(page: Page) -> None:
    key = page.said("POST", "/logs", {"name": "drive.log", "size": 1000})["log"]
    coming = page.begun(key, b"half")
    waiting = [coming]
    for _ in range(300):
        client = http.client.HTTPConnection("127.0.0.1", page.port)
        client.connect()
        client.sock.sendall(b"POST /logs HTTP/1.1\r\nContent-Length: 1000\r\n")
        waiting.append(client)
    try:
        assert page.ask("GET", "/")[0] == 200
        coming.send(bytes(996))
        assert coming.getresponse().status == 200
    finally:
        for client in waiting:
            client.close()


def test_a_shortcut_starts_the_page_of_this_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from oncenter.app import shortcut
    from oncenter.cli import run

    monkeypatch.setattr(shortcut, "_desktop", lambda: tmp_path / "Desktop")
    assert run(["app", "--shortcut"]) == 2
    assert "no desktop at" in capsys.readouterr().err
    (tmp_path / "Desktop").mkdir()
    for platform, name in (("linux", "oncenter.desktop"), ("darwin", "oncenter.command"), ("win32", "oncenter.cmd")):
        monkeypatch.setattr(sys, "platform", platform)
        monkeypatch.setattr(sys, "executable", "/opt/my $python/bin/python")
        shortcut.write_shortcut()
        text = (tmp_path / "Desktop" / name).read_text()
        assert "python" in text and "-m oncenter app" in text
    assert r'Exec="/opt/my \\$python/bin/python" -m oncenter app' in (tmp_path / "Desktop/oncenter.desktop").read_text()


@pytest.mark.browser
def test_a_mechanic_goes_from_the_first_page_to_the_report(page: Page, log: Path, browser: Any, tmp_path: Path) -> None:
    faults: list[str] = []
    with browser.new_context(viewport={"width": 1280, "height": 900}) as context:
        opened = context.new_page()
        note_errors(opened, faults)
        opened.goto(f"http://127.0.0.1:{page.port}/?key={page.key}")
        assert "key" not in opened.url
        opened.click("#other summary")
        for field in ("name", "wheelbase_m", "steering_ratio"):
            opened.fill(f"[name={field}]", FORM[field])
        opened.click("form button")
        opened.wait_for_selector("#other:not([open])")
        opened.set_input_files("#files", [log])
        opened.wait_for_selector("text=ready")
        opened.click("#begin")
        opened.wait_for_selector(".verdict")
        with context.expect_page() as report:
            opened.click("text=Open the report")
        report.value.wait_for_selector("canvas")
        report.value.pdf(path=tmp_path / "report.pdf")
        opened.set_viewport_size({"width": 400, "height": 900})
        assert opened.evaluate("document.documentElement.scrollWidth") == 400
    assert faults == []
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.browser
def test_a_mechanic_flips_a_wrong_sign_and_has_an_answer(
    page: Page, own_network: dict[str, Any], browser: Any, tmp_path: Path
) -> None:
    """The truck is kept by a database that does not say which side is positive; the log shows it afterwards."""
    database = (ROOT / "examples" / "own_dbc" / "chassis.dbc").read_text(encoding="utf-8")
    (tmp_path / "network.dbc").write_text(database.replace(", positive to the right", ""), encoding="utf-8")
    faults: list[str] = []
    with browser.new_context(viewport={"width": 1280, "height": 900}) as context:
        opened = context.new_page()
        note_errors(opened, faults)
        opened.goto(f"http://127.0.0.1:{page.port}/?key={page.key}")
        opened.click("#other summary")
        opened.fill("[name=name]", "wrong sign")
        opened.set_input_files("#databases", tmp_path / "network.dbc")
        opened.click("form button")
        opened.wait_for_selector("#signals-log:visible")
        opened.click("#keep")
        opened.set_input_files("#files", own_network["log"])
        opened.wait_for_selector("text=ready")
        opened.click("#check-signals")
        angle = opened.get_by_role("group", name="Steering wheel angle")
        angle.locator(".said-bad", has_text="is reversed").wait_for()
        assert angle.locator("path.own").get_attribute("d")
        opened.set_viewport_size({"width": 400, "height": 900})
        assert opened.evaluate("document.documentElement.scrollWidth") == 400
        sign = angle.get_by_label("Flip the sign")
        sign.focus()
        opened.keyboard.press("Space")
        angle.locator(".said-ok").wait_for()
        assert opened.evaluate("document.activeElement.type") == "checkbox"
        opened.click("#keep")
        opened.wait_for_selector("#signals", state="hidden")
        opened.click("#begin")
        opened.wait_for_selector(".verdict")
        with context.expect_page() as report:
            opened.click("text=Open the report")
        report.value.wait_for_selector("canvas")
    assert faults == []
    (kept,) = page.trucks.glob("wrong*sign.toml")
    assert oc.vehicle(kept).signals["steering_wheel_angle"].sign == -1
