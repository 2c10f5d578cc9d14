"""--fail-on: an exit code for scripts by the status of the offset. An invalid offset is marked in every output."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from test_estimate import steady_drive

import oncenter as oc
from oncenter import _core
from oncenter.cli import run
from oncenter.cli.fail_on import STATUSES
from oncenter.live import words
from oncenter.live.terminal import _offset
from oncenter.simulate import simulate_to_log

TRUCK = "scania_r730_4x2"


@pytest.fixture(scope="module")
def failed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive whose angle sensor dies after twenty minutes."""
    log = tmp_path_factory.mktemp("failed") / "failed.log"
    simulate_to_log("sensor_failure", 1, log)
    return log


@pytest.mark.parametrize(
    ("given", "exit_code"),
    [("invalid,converging", 3), ("invalid", 3), (" invalid , valid", 3), ("valid,converging", 0), ("unobservable", 0)],
)
def test_an_invalid_offset_has_exit_code_3_on_request(
    given: str, exit_code: int, failed: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["offset", str(failed), "--vehicle", TRUCK, "--fail-on", given, "--json"]) == exit_code
    out, err = capfd.readouterr()
    assert json.loads(out)["offset"]["status"] == "invalid"
    assert err == ("oncenter: --fail-on: 1 invalid\n" if exit_code else "")


@pytest.mark.parametrize("given", ["invlid", "invalid,", "", "invalid;valid"])
def test_an_unknown_status_to_fail_on_is_refused_by_name(given: str, capfd: pytest.CaptureFixture[str]) -> None:
    """The log is missing, which reading would say."""
    assert run(["offset", "none.log", "--vehicle", TRUCK, "--fail-on", given]) == 2
    err = capfd.readouterr().err
    assert err.count("\n") == 1 and "--fail-on takes valid, converging, unobservable, invalid" in err
    assert repr(given.split(",")[-1]) in err


def test_the_statuses_to_fail_on_are_those_of_the_core() -> None:
    assert set(STATUSES) == set(_core.STATUSES)


def test_one_of_each_log_or_the_answer_of_several_may_fail(
    failed: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    good = tmp_path / "good.csv"
    steady_drive().table.write_csv(good)
    each = ["offset", str(good), str(failed), "--vehicle", TRUCK, "--each", "--fail-on"]
    assert run([*each, "invalid"]) == 3
    out, err = capfd.readouterr()
    assert len(out.splitlines()) == 2 and err == f"oncenter: --fail-on: 1 invalid: {failed}\n"
    assert re.search(r"- \(before the fault \+2\.\d\d ± 0\.\d\d deg\)", out)
    assert run([*each, "unobservable"]) == 0
    copy = shutil.copy(failed, tmp_path / "copy.log")
    assert run(["offset", str(failed), str(copy), "--vehicle", TRUCK, "--fail-on", "invalid"]) == 3


def test_the_page_greys_an_offset_of_before_a_fault_and_says_so(failed: Path, tmp_path: Path) -> None:
    answer = oc.offset(oc.read(failed), oc.vehicle(TRUCK))
    oc.report(answer, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert re.search(r"The straight-ahead offset \+2\.\d deg ± 0\.\d is from before the fault: do not use it", page)
    assert ".not-valid td.number { color: var(--muted)" in page
    assert re.search(r'<tr class="not-valid"><th scope="row">Straight-ahead offset', page)
    assert answer.words().startswith("straight-ahead offset invalid; before the fault 2.")


@pytest.mark.parametrize(
    ("log", "status", "but"), [("failed", "invalid", "before the fault"), ("", "converging", "still converging")]
)
def test_the_live_terminal_and_page_give_no_bare_number_of_an_offset_that_is_not_valid(
    log: str, status: str, but: str, request: pytest.FixtureRequest
) -> None:
    drive = oc.read(request.getfixturevalue(log)) if log else steady_drive()
    answer = oc.offset(drive, oc.vehicle(TRUCK))
    now: Any = SimpleNamespace(known=SimpleNamespace(answer=answer))
    offset = words.offset(now)
    assert (offset.status, offset.but) == (status, but)
    assert _offset(offset).startswith(f"straight-ahead offset {status}, {but}: +2.")


def test_the_page_says_of_an_offset_that_it_is_still_converging(tmp_path: Path) -> None:
    answer = oc.offset(steady_drive(), oc.vehicle(TRUCK))
    assert answer.offset.status == "converging" and answer.offset.value is not None
    oc.report(answer, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "The straight-ahead offset so far is +2." in page and '<header class="verdict undecided">' in page


@pytest.mark.parametrize("verb", ["offset", "angle"])
@pytest.mark.parametrize("name", ["x.txt", "x.HTML.gz", "x"])
def test_a_report_that_would_be_named_like_another_format_is_refused_before_any_work(
    verb: str, name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The log is missing, which reading would say."""
    assert run([verb, "none.log", "--vehicle", TRUCK, "--report", str(tmp_path / name)]) == 2
    err = capfd.readouterr().err
    assert err.count("\n") == 1 and "--report writes HTML or PDF: name it" in err
    assert f"{(tmp_path / name).with_suffix('.html')}, not {name}" in err
    assert not list(tmp_path.iterdir())


def test_in_python_a_report_has_its_own_ending_as_well(tmp_path: Path) -> None:
    answer = oc.offset(steady_drive(), oc.vehicle(TRUCK))
    with pytest.raises(oc.OncenterError, match=r"a report writes HTML or PDF: name it .*x\.html, not x\.txt"):
        oc.report(answer, tmp_path / "x.txt")
    oc.report(answer, tmp_path / "X.HTML")
