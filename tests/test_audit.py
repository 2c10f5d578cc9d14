"""The audit names the packages that it did not look at: of these pip-audit reports "no known vulnerabilities"."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
AUDIT = runpy.run_path(str(ROOT / ".ci" / "audit.py"))
CLEAN = {"name": "numpy", "version": "2.4.6", "vulns": []}
UNKNOWN = {"name": "polars", "skip_reason": "not found"}
KNOWN = {"name": "jinja2", "version": "3.1.0", "vulns": [{"id": "CVE-1", "fix_versions": ["3.1.6"]}]}
LOCK = (
    "# a lock\nnumpy==2.4.6 \\\n    --hash=sha256:aa \\\n    --hash=sha256:bb\npolars==2.1.0 \\\n    --hash=sha256:cc\n"
)


def audit(reports: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    """Its exit code where pip-audit gives these reports, one after the other."""
    (tmp_path / "lock").write_text(LOCK)
    monkeypatch.setitem(AUDIT["main"].__globals__, "audited", lambda _: reports.pop(0))
    return int(AUDIT["main"]([str(tmp_path / "lock")]))


def test_the_first_pin_of_a_lock_has_its_hashes_and_no_other_package() -> None:
    assert AUDIT["first_pin"](LOCK) == "".join(LOCK.splitlines(keepends=True)[1:4])


@pytest.mark.parametrize("first", [None, [], [UNKNOWN]])
def test_advisories_that_cannot_be_reached_are_a_skip_with_its_reason_and_no_pass(
    first: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert audit([first], tmp_path, monkeypatch) == 0
    line = capsys.readouterr().out.strip()
    assert line == "skipped: the advisories cannot be reached from here"
    assert runpy.run_path(str(ROOT / ".ci" / "night.py"))["passed"](line) == line


@pytest.mark.parametrize(
    ("report", "code", "line"),
    [
        ([CLEAN], 0, "1 packages, 0 to look at"),
        ([CLEAN, KNOWN], 1, "jinja2 3.1.0: CVE-1, corrected in 3.1.6"),
        ([CLEAN, UNKNOWN], 1, "not audited: polars: not found"),
        (None, 1, "not audited: a lock: no report"),
    ],
)
def test_a_vulnerability_and_a_package_without_advisories_fail_by_name(
    report: Any,
    code: int,
    line: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert audit([[CLEAN], report], tmp_path, monkeypatch) == code
    assert line in capsys.readouterr().out.splitlines()
