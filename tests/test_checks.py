"""The levels of checks: parts of the night are targets of the Makefile, and their results go into docs/checks.md."""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NIGHT = runpy.run_path(str(ROOT / ".ci" / "night.py"))
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
PAGE = (ROOT / "docs" / "checks.md").read_text(encoding="utf-8")


def test_each_part_of_the_night_is_a_target() -> None:
    targets = set(re.findall(r"^([a-z][a-z -]*):(?!=)", MAKEFILE, re.MULTILINE))
    assert NIGHT["PARTS"].keys() <= {name for line in targets for name in line.split()}


def test_each_slow_test_is_of_one_part() -> None:
    files = dict(re.findall(r"^(DAMAGED|BENCHES|PAGES) = (.+)$", MAKEFILE, re.MULTILINE))
    rest = re.search(r"^slow:.*\n.*--ignore=,(.*)\)$", MAKEFILE, re.MULTILINE)
    assert rest is not None and set(re.findall(r"\$\((\w+)\)", rest[1])) == files.keys()
    for name in files:
        assert re.search(rf"^{name.lower()}:.*\n\t\$\(SLOW\) \$\({name}\)$", MAKEFILE, re.MULTILINE)


def test_the_page_has_a_row_for_each_part_and_no_other() -> None:
    assert list(NIGHT["results"](PAGE)) == list(NIGHT["PARTS"])
    assert NIGHT["with_results"](PAGE, NIGHT["results"](PAGE)) == PAGE


def test_a_result_replaces_the_last_one_of_its_part_and_leaves_the_others() -> None:
    rows = NIGHT["results"](PAGE)
    row = ("fuzz", NIGHT["PARTS"]["fuzz"], "2026-01-31", "abc1234", "12.0", "0.1 to 1.9", "passed")
    renewed = NIGHT["results"](NIGHT["with_results"](PAGE, rows | {"fuzz": row}))
    assert renewed.pop("fuzz") == row
    assert renewed == {part: given for part, given in rows.items() if part != "fuzz"}


@pytest.mark.parametrize(
    ("log", "named"),
    [
        (
            "FAILED tests/test_a.py::test_one[x] - assert 0\nERROR tests/test_b.py\n1 failed\n",
            "`test_one[x]`, `tests/test_b.py`",
        ),
        ("FAILED tests/test_a.py::test_one[a|b] - x\n", "`test_one[a\\|b]`"),
        ("compiling\nmake: *** [Makefile:9: fuzz] Error 1\n", "make: *** [Makefile:9: fuzz] Error 1"),
        ("", "no output"),
    ],
)
def test_a_result_names_what_failed(log: str, named: str) -> None:
    assert NIGHT["failures"](log) == named


def test_a_result_counts_the_tests_of_all_runs() -> None:
    assert NIGHT["passed"]("== 1200 passed, 3 skipped in 9 s ==\n7 passed in 1 s\n") == "passed, 1,207 tests"
    assert NIGHT["passed"]("all mutants read\n") == "passed"


def test_an_unknown_part_is_named_with_those_that_exist() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / ".ci" / "night.py", "fuz"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("no part fuz: the parts are slow, ")
