"""The faults that `make faults` plants: each is in the code, and other draws from the same code are alike."""

import ast
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "faults"))

import checks
import draw
import in_c
import in_python
import near
import page
from kept import ROOT, Fault, kept_faults, planted

KINDS = {"sign", "factor", "off-by-one", "dropped note", "unescaped string", "swapped argument"}


@pytest.mark.parametrize("fault", kept_faults(), ids=lambda fault: f"{fault.number}-{fault.kind}")
def test_a_kept_fault_is_found_once_and_changes_one_line(fault: Fault) -> None:
    right = (ROOT / fault.file).read_text(encoding="utf-8")
    wrong = planted(fault, right)
    assert sum(a != b for a, b in zip(right.splitlines(), wrong.splitlines(), strict=True)) == 1
    if fault.file.endswith(".py"):
        ast.parse(wrong)


def test_a_kept_fault_that_an_edit_has_removed_is_named() -> None:
    fault = kept_faults()[0]
    right = (ROOT / fault.file).read_text(encoding="utf-8")
    with pytest.raises(LookupError, match=f"fault {fault.number}: {fault.file}"):
        planted(fault, right.replace(fault.expression, "other()"))


def test_the_kept_faults_are_forty_of_all_folders_and_of_as_many_files_of_the_core() -> None:
    faults = kept_faults()
    assert [fault.number for fault in faults] == list(range(1, 41))
    assert len({fault.room for fault in faults}) == 40
    assert {fault.kind for fault in faults} == KINDS
    assert {room for room in draw.rooms() if room.startswith("src/")} <= {fault.room for fault in faults}


def test_a_draw_gives_the_same_faults_each_time_and_others_with_another_seed() -> None:
    one = draw.drawn()
    assert one == draw.drawn()
    assert one != draw.drawn(seed=18)
    assert len({fault.room for fault in one}) == draw.COUNT
    counts = [[fault.kind for fault in one].count(kind) for kind in KINDS]
    assert min(counts) >= 4


def test_faults_in_python_are_of_its_code_and_not_of_its_text() -> None:
    source = '''
LIMIT = 2 * 3


def f(a: "a - b", b, notes):
    """a - b"""
    # a - b
    x: "a * b" = a - b
    notes.append(f"{a - b}")
    if len(notes) < 2:
        return html.escape(x)
    return g(a, b) + -a
'''
    found = {(kind, source[start:end], new) for kind, _, start, end, new in in_python.faults(source)}
    assert found == {
        ("sign", "-", "+"),
        ("sign", "+", "-"),
        ("sign", "-", ""),
        ("dropped note", "", "if 0: "),
        ("off-by-one", "<", "<="),
        ("unescaped string", "html.escape(x)", "x"),
        ("swapped argument", "a, b", "b, a"),
    }
    assert len(list(in_python.faults(source))) == 7


def test_faults_in_c_are_of_its_code_and_not_of_its_text() -> None:
    source = """
#define HALF(a) (a / 2)
static const double limit = 2.0 * 3.0;

static double f(double a, double b) {
    /* a - b */
    const char *text = "a - b";
    for (int k = 0; k < 3; ++k) {
        reasons |= OC_REASON_TIME;
    }
    return g(a, b) * -a;
}
"""
    found = {(kind, source[start:end], new) for kind, _, start, end, new in in_c.faults(source)}
    assert found == {
        ("off-by-one", "0", "1"),
        ("off-by-one", "<", "<="),
        ("dropped note", "", "if (0) "),
        ("swapped argument", "a, b", "b, a"),
        ("factor", "*", "/"),
    }


def test_the_tests_named_after_a_file_come_first_and_all_others_follow() -> None:
    first = {
        "core/numbers/mean.c": "core_mean",
        "core/ecu/message.c": "message",
        "core/monitor/joint_method.c": "core_joint",
    }
    by_file = {fault.file: near.nearest_tests(fault) for fault in kept_faults() if fault.file in first}
    assert {file: tests[0] for file, tests in by_file.items()} == {
        file: f"tests/test_{name}.py" for file, name in first.items()
    }
    every = {file.relative_to(ROOT).as_posix() for file in ROOT.glob("tests/test_*.py")}
    assert all(set(tests) == every - {"tests/test_faults.py"} for tests in by_file.values())


@pytest.mark.parametrize(
    "output",
    [
        "tests/test_a.py::test_one PASSED [ 50%]\ntests/test_a.py::test_two[1 - 2] FAILED [100%]\n"
        "FAILED tests/test_a.py::test_two[1 - 2] - assert 1 == 2\n",
        "tests/test_a.py::test_one PASSED [ 50%]\ntests/test_a.py::test_two[1 - 2] Fatal Python error: Aborted\n",
        "tests/test_a.py::test_one PASSED [ 50%]\ntests/test_a.py::test_two[1 - 2] ",
    ],
    ids=["fails", "aborts", "hangs"],
)
def test_a_red_test_is_named_however_it_ends(output: str) -> None:
    assert checks.named_red(output) == "tests/test_a.py::test_two[1 - 2]"


def test_the_page_is_what_its_command_writes() -> None:
    assert page.PAGE.read_text(encoding="utf-8") == page.made()
