"""A run that must skip nothing fails for each test that it skips without an allowed reason, and names it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from allowed_skips import ALLOWED, IN_MAKE_FMU

TESTS = Path(__file__).parent
SKIPPED = "import pytest\n\n@pytest.mark.skip('{reason}')\ndef test_skipped():\n    pass\n\ndef test_run():\n    pass\n"


def run(folder: Path, *options: str, must_skip_nothing: str = "1") -> subprocess.CompletedProcess[str]:
    """pytest on a folder of its own."""
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "allowed_skips", "-p", "xdist", *options, "."],
        cwd=folder,
        env=os.environ
        | {"PYTHONPATH": str(TESTS), "ONCENTER_NO_SKIPS": must_skip_nothing, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
    )


@pytest.mark.parametrize("processes", ["0", "1"])
def test_a_test_and_a_file_that_are_skipped_for_an_unlisted_reason_fail_the_run_by_name(
    processes: str, tmp_path: Path
) -> None:
    (tmp_path / "test_one.py").write_text(SKIPPED.format(reason="no chromium"))
    (tmp_path / "test_file.py").write_text("import pytest\npytest.importorskip('no_such_module', reason='too rare')\n")
    done = run(tmp_path, "-n", processes)
    assert done.returncode == 1
    assert "FAILED test_one.py::test_skipped - skipped: no chromium" in done.stdout
    assert "FAILED test_file.py - skipped: too rare" in done.stdout
    assert run(tmp_path, must_skip_nothing="").returncode == 0


def test_a_run_in_which_all_is_skipped_fails_as_well(tmp_path: Path) -> None:
    (tmp_path / "test_file.py").write_text("import pytest\npytest.importorskip('no_such_module', reason='too rare')\n")
    assert run(tmp_path).returncode == 1


def test_an_allowed_reason_and_an_expected_failure_pass(tmp_path: Path) -> None:
    expected = "\n@pytest.mark.xfail(reason='a known fault')\ndef test_fault():\n    assert False\n"
    (tmp_path / "test_one.py").write_text(SKIPPED.format(reason="real drive a.csv is not in data") + expected)
    done = run(tmp_path)
    assert (done.returncode, "allowed_skips" in done.stdout) == (0, False)


def test_each_allowed_reason_is_one_that_a_test_gives() -> None:
    sources = [path for path in TESTS.glob("*.py") if path.name not in ("allowed_skips.py", "test_allowed_skips.py")]
    given = [text for path in sources for text in re.findall(r'"([^"\n]+)"', path.read_text(encoding="utf-8"))]
    assert [pattern for pattern in {*ALLOWED, IN_MAKE_FMU} if not any(re.search(pattern, text) for text in given)] == []
