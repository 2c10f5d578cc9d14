"""One drive has one verdict, whichever door it leaves by: command line, JSON, report, Python, comparison, fleet and the
live display."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from live_drive import drive_log

import oncenter as oc
from oncenter.cli import run
from oncenter.cli.offset import as_table
from oncenter.estimates.cause import Cause, Prior
from oncenter.estimates.estimate import Estimate
from oncenter.findings import Finding
from oncenter.fleet.drive import of_answer
from oncenter.fleet.listing import as_text
from oncenter.fleet.ranking import OfTruck, histories, rank
from oncenter.live.learner import Learner, needed
from oncenter.live.replay import Replay
from oncenter.live.session import Notices, Session
from oncenter.live.steady_verdict import HELD_S, SteadyVerdict
from oncenter.offset.answer import Answer
from oncenter.offset.compare import compare
from oncenter.read.stream import Stream
from oncenter.report.verdict_part import verdict_header
from oncenter.signals import DEGREE, Signals
from oncenter.verdict import STATES, Verdict, verdicts_of

VEHICLE = Path(__file__).parents[1] / "vehicles" / "scania_r730_4x2.toml"
TRUCK = oc.vehicle("scania_r730_4x2")
MONDAY_S = 1_772_434_800.0


@pytest.fixture(scope="module")
def base() -> Answer:
    return oc.offset(oc.simulate("thesis_drive", seed=1)[0], TRUCK)


@dataclass(frozen=True)
class Drive:
    """Offset and half-widths in deg, and what else decides."""

    value: float
    own: float = 0.1
    whole: float = 0.9
    status: str = "valid"
    fault: str = "none"
    zero: str = "fixed"
    errors: tuple[str, ...] = ()
    used_s: float = 1700.0

    def of(self, base: Answer) -> Answer:
        offset = Estimate(*self._around(self.whole), self.status, "rad")
        error = [Finding(code, "error", "the yaw rate is at fault: correct it") for code in self.errors]
        relative = [Finding("relative_angle_sensor", "info", "a relative sensor")] if self.zero == "relative" else []
        pull = Cause("pull", 0.05, (self.whole - self.own) * DEGREE / 1.96, Prior(0.05, ""))
        return replace(
            base,
            offset=offset,
            offset_ci95_drive=self._around(self.own)[1],
            not_identifiable=(pull,),
            sensor_fault=self.fault,
            zero=self.zero,
            used_s=self.used_s,
            findings=(*error, *relative),
            changes=(),
        )

    def _around(self, half_width: float) -> tuple[float, tuple[float, float]]:
        return self.value * DEGREE, ((self.value - half_width) * DEGREE, (self.value + half_width) * DEGREE)


AT_THE_LIMIT = [
    ("within", Drive(0.0)),
    ("within", Drive(1.85)),
    ("within", Drive(1.89)),
    ("within", Drive(-1.89)),
    ("within", Drive(1.899)),
    ("within", Drive(1.8999999)),
    ("undecided", Drive(1.9)),
    ("undecided", Drive(1.9000001)),
    ("undecided", Drive(1.94)),
    ("undecided", Drive(1.96)),
    ("undecided", Drive(-1.96)),
    ("undecided", Drive(2.0)),
    ("undecided", Drive(2.04)),
    ("undecided", Drive(2.0999999)),
    ("recalibrate", Drive(2.1)),
    ("recalibrate", Drive(2.1000001)),
    ("recalibrate", Drive(2.101)),
    ("recalibrate", Drive(-2.11)),
    ("recalibrate", Drive(2.5)),
    ("recalibrate", Drive(2.5, 0.5)),
    ("undecided", Drive(2.49, 0.5)),
    ("within", Drive(1.97, 0.02)),
    ("recalibrate", Drive(2.03, 0.02)),
    ("recalibrate", Drive(-40.0)),
]
IN_EVERY_STATE = [
    ("over", Drive(2.5, 0.1, 2.6)),  # a pull alone can explain it
    ("over", Drive(362.0)),
    ("over", Drive(-181.0)),
    ("over", Drive(6.0, 1.5, 1.9, "converging")),
    ("undecided", Drive(3.0, 0.8, 1.9, "converging")),
    ("undecided", Drive(6.0, 1.5, 1.9, "converging", used_s=20.0)),
    ("within", Drive(0.3, 0.9, 1.5, "converging")),
    ("undecided", Drive(0.3, 0.1, 0.9, "converging")),  # it still moves
    ("signal_or_sensor", Drive(0.3, status="invalid", fault="jumped")),
    ("repair", Drive(3.0, status="invalid", fault="drifting")),
    ("repair", Drive(3.0, status="invalid", fault="remounted")),
    ("signal_or_sensor", Drive(0.3, zero="moves")),
    ("signal_or_sensor", Drive(3.0, status="invalid", fault="lost")),
    ("signal_or_sensor", Drive(0.3, status="invalid", fault="stuck")),
    ("signal_or_sensor", Drive(0.3, status="invalid", fault="wrong_sign")),
    ("signal_or_sensor", Drive(0.3, status="invalid", fault="stuck", errors=("signal_stuck",))),
    ("check_signal", Drive(3.0, status="invalid", errors=("scale",))),
    ("check_signal", Drive(3.0, errors=("wheel_speed",))),
    ("check_signal", Drive(0.3, status="invalid", fault="jumped", errors=("sign_reversed",))),
    ("no_correction", Drive(3.0, zero="relative")),
]
DRIVES = [*AT_THE_LIMIT, *IN_EVERY_STATE]


def of_one_drive_fleet(answer: Answer) -> dict[str, Any]:
    row = {"log": "a.log", "key": "a", "start": MONDAY_S, "truck": "t", "vehicle_file": "t", **of_answer(answer)}
    (history,) = histories([OfTruck("t", [row], answer.vehicle.offset_limit_deg)])
    return rank([history.truck])[0]


@pytest.mark.parametrize(("code", "drive"), DRIVES, ids=str)
def test_one_drive_has_the_same_code_and_word_by_every_door(base: Answer, code: Any, drive: Drive) -> None:
    answer = drive.of(base)
    word = STATES[code].word
    verdict = verdicts_of(answer)[0]
    assert (verdict.state, verdict.word) == (code, word)
    assert str(answer).startswith(f"{word}: ") and as_table(answer).startswith(f"{word}: ")
    given = json.loads(answer.to_json())["verdicts"][0]
    assert (given["state"], given["word"]) == (code, word)
    header = verdict_header(verdicts_of(answer), "a truck")
    assert header.startswith(f'<header class="verdict {code}">') and f"</i> {word}</span>" in header
    another = answer.drives[0].table.with_columns(pl.col("steering_wheel_angle_rad") * 2.0)
    after = replace(answer, log="after.log", drives=(replace(answer.drives[0], table=another),))
    comparison = compare(replace(answer, log="before.log"), after)
    assert [offset["verdict"] for name, offset in comparison.to_dict().items() if name in ("before", "after")] == [
        code
    ] * 2
    assert word in str(comparison)
    truck = of_one_drive_fleet(answer)
    assert truck["verdict"] == truck["state"] == code and word in as_text([truck])


def test_a_drive_without_an_offset_has_none_by_every_door(base: Answer) -> None:
    none = Estimate(None, None, "unobservable", "rad")
    answer = replace(base, offset=none, offset_ci95_drive=None, rows=(), used_s=0.0, findings=())
    assert verdicts_of(answer)[0].state == of_one_drive_fleet(answer)["verdict"] == "no_offset"
    assert str(answer).startswith("Not determined: ")
    assert json.loads(answer.to_json())["verdicts"][0]["state"] == "no_offset"


def logs_of(offsets_deg: Sequence[float]) -> list[Signals]:
    """Logs of ten minutes of one truck, whose sensor reads so much more."""
    found = []
    for day, more in enumerate(offsets_deg):
        signals, _ = oc.simulate("thesis_drive", seed=day + 1)
        time_s = pl.col("time_s") + MONDAY_S + 86400.0 * day
        table = signals.table.head(60_000).with_columns(time_s, pl.col("steering_wheel_angle_rad") + more * DEGREE)
        found.append(replace(signals, table=table, log=f"day{day}.parquet"))
    return found


@pytest.mark.parametrize(
    "offsets_deg",
    [(0.0, 0.0, 0.0), (2.0, -1.4), (1.9, -1.4, -1.4, -1.4), (0.0, 0.0, 4.0, 4.0)],
    ids=["untouched", "contradicting", "calibrated", "remounted"],
)
def test_a_truck_s_logs_have_the_same_offset_and_verdict_as_a_folder_and_in_a_fleet(
    offsets_deg: tuple[float, ...],
) -> None:
    logs = logs_of(offsets_deg)
    folder = oc.offset(logs, TRUCK)
    drives = []
    for log in logs:
        row = {"log": log.log, "key": log.log, "start": log.begin_s, "truck": "t", "vehicle_file": "t"}
        drives.append({**row, **of_answer(oc.offset(log, TRUCK))})
    of_truck = OfTruck("t", drives, TRUCK.offset_limit_deg)
    (history,) = histories([of_truck])
    truck = rank([history.truck])[0]
    whole, own, value = folder.offset.ci95, folder.offset_ci95_drive, folder.offset.value
    assert whole is not None and own is not None and value is not None
    is_valid = folder.offset.status == "valid"
    low, high = own if is_valid else whole
    given = truck["offset_deg"], truck["offset_low_deg"], truck["offset_high_deg"]
    assert given == pytest.approx((value / DEGREE, low / DEGREE, high / DEGREE), abs=1e-6)
    assert truck["offset_sd_deg"] == pytest.approx((whole[1] - whole[0]) / 3.92 / DEGREE, abs=1e-6)
    assert truck["offset_is_valid"] == is_valid == (len(offsets_deg) != 2)
    assert truck["verdict"] == verdicts_of(folder)[0].state


@pytest.fixture(scope="module")
def log() -> Path:
    return drive_log()


def truck_file(folder: Path, limit_deg: float) -> Path:
    file = folder / "drive.toml"
    text = VEHICLE.read_text(encoding="utf-8")
    file.write_text(f"offset_limit_deg = {limit_deg}\n{text}", encoding="utf-8")
    return file


@pytest.mark.parametrize("limit_deg", [0.5, 1.5, 2.0, 3.0, 8.0])
def test_a_real_log_has_the_same_verdict_from_command_line_fleet_and_the_end_of_a_replay(
    log: Path, limit_deg: float, replayed: Answer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = truck_file(tmp_path, limit_deg)
    assert run(["offset", str(log), "--vehicle", str(vehicle)]) == 0
    first = capsys.readouterr().out
    assert run(["offset", str(log), "--vehicle", str(vehicle), "--json"]) == 0
    given = json.loads(capsys.readouterr().out)["verdicts"][0]
    live = verdicts_of(replayed, limit_deg)[0]
    assert (live.state, live.word) == (given["state"], given["word"])
    assert first.startswith(f"{given['word']}: ")
    answer = oc.offset(oc.read(log), oc.vehicle(vehicle))
    assert str(answer).startswith(f"{given['word']}: ")
    assert of_one_drive_fleet(answer)["verdict"] == given["state"]


@pytest.fixture(scope="module")
def replayed(log: Path) -> Answer:
    """The answer at the end of a replay with an empty memory, as the display has it."""
    truck = oc.vehicle("scania_r730_4x2")
    replay = Replay(log, 100.0)
    session = Session(replay, Learner(Stream(replay.name, needed(truck)), truck), "truck", Notices())
    session.run()
    answer = session.snapshot.known.answer
    assert answer is not None and session.snapshot.verdict == verdicts_of(answer)[0]
    return answer


# -- the live display


def said(code: Any) -> Verdict:
    return Verdict("straight-ahead offset", code, "a sentence.", "An action.")


def test_the_live_verdict_does_not_flip_while_the_interval_passes_the_limit() -> None:
    steady = SteadyVerdict()
    shown = []
    for second in range(0, 600):
        steady.update(said("within" if second % 20 < 10 else "undecided"), float(second))
        assert steady.shown is not None
        shown.append(steady.shown.state)
    assert set(shown) == {"within"}


def test_a_live_verdict_that_holds_is_shown_and_a_fault_at_once() -> None:
    steady = SteadyVerdict()
    steady.update(said("no_offset"), 0.0)
    steady.update(said("undecided"), 1.0)
    assert steady.shown == said("undecided") and not steady.is_changing
    steady.update(said("within"), 10.0)
    assert steady.shown == said("undecided") and steady.is_changing
    steady.update(said("within"), 10.0 + HELD_S)
    assert steady.shown == said("within") and not steady.is_changing
    steady.update(said("signal_or_sensor"), 11.0 + HELD_S)
    assert steady.shown == said("signal_or_sensor")
