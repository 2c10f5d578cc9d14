"""The checks that concern a fault, in order of cost, in a copy of the project; the first red one has caught it."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from kept import ROOT, Fault, planted
from near import nearest_tests

PYTHON = sys.executable
MAKE = ["make", "-o", ".venv/dev", f"BIN={Path(PYTHON).parent}"]
TEST, CI, NIGHT = LEVELS = ("make test", ".ci/run", "make night")
MARKED = {TEST: "not slow and not browser", CI: "browser and not slow", NIGHT: "slow"}
HANGS_S = {TEST: 300, CI: 300, NIGHT: 900}  # one test
IN_PYTHON, IN_C = {CI: "portable"}, {CI: "sanitize-core", NIGHT: "sanitize"}  # targets that repeat tests in another way

# A fault is written as `if 0: note()` or `None and finding()`, or leaves an import or a function without a use.
RUFF = ["-m", "ruff", "check", "-q", "--extend-ignore", "E701,F401,F841,SIM,RUF,B"]
WARNINGS = [*MAKE, "warnings", "EXPORTED=", "CC=gcc -Wno-unused"]

BATCHES = (4, 12)  # test files, nearest first; then all others
FAULT_S = 1200.0  # until then a check has caught the fault, or none has
RUNNING: set[int] = set()  # process groups
CONTROLLING = threading.Lock()  # both workers have one control


@dataclass(frozen=True)
class Caught:
    check: str
    level: str


class TimeIsUp(Exception):
    pass


@dataclass
class Copy:
    """The project's files in a folder of their own, with a compiled core."""

    folder: Path
    until: float | None = None  # of time.monotonic(): TimeIsUp

    @classmethod
    def made(cls, folder: Path) -> Copy:
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in filter(None, listed.split("\0")):
            if (ROOT / name).is_file():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, folder / name)
        return cls(folder)

    def another(self, folder: Path) -> Copy:
        shutil.copytree(self.folder, folder)
        return Copy(folder)

    def left_s(self) -> float | None:
        return None if self.until is None else max(self.until - time.monotonic(), 0.0)

    def run(self, command: list[str]) -> tuple[int, str]:
        """Exit code and output; no process that the command began outlives it."""
        temporary = self.folder.with_name(f"{self.folder.name}.tmp")
        temporary.mkdir(exist_ok=True)
        environment = os.environ | {"PYTHONPATH": str(self.folder / "src"), "TMPDIR": str(temporary), "CI": "1"}
        with subprocess.Popen(
            command, cwd=self.folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True,
        ) as process:  # fmt: skip
            RUNNING.add(process.pid)
            try:
                output, _ = process.communicate(timeout=self.left_s())
            except subprocess.TimeoutExpired:
                raise TimeIsUp from None
            finally:
                _end_group(process.pid)
                RUNNING.discard(process.pid)
        shutil.rmtree(temporary, ignore_errors=True)
        return process.returncode, output

    def compile(self) -> str:
        """Nothing, or the compiler's message."""
        code, output = self.run([PYTHON, "setup.py", "-q", "build_ext", "--inplace", "--force"])
        return output if code else ""

    def take_library(self, other: Copy) -> None:
        for library in other.folder.glob("src/oncenter/liboncenter.*"):
            shutil.copy2(library, self.folder / library.relative_to(other.folder))

    def types(self) -> str:
        code, output = self.run([PYTHON, "-m", "mypy", "--strict", "src"])
        return output if code else ""

    def first_red(self, tests: list[str], level: str, without: list[str]) -> str | None:
        """The first test of the level that fails, hangs or ends its process."""
        command = [PYTHON, "-m", "pytest", "-x", "-v", "-rfE", "--tb=no", "-n", "0", "-p", "no:cacheprovider"]
        command += ["-m", MARKED[level], "-o", f"faulthandler_timeout={HANGS_S[level]}"]
        command += ["-o", "faulthandler_exit_on_timeout=true"]
        code, output = self.run(command + [f"--deselect={name}" for name in without] + tests)
        if code in (0, 5) or (code == 4 and len(tests) == 1):  # 5: no test is of that level; 4: it has a new name
            return None
        return named_red(output)

    def passes(self, target: str) -> bool:
        return self.run([*MAKE, target])[0] == 0


def end_all() -> None:
    for pid in RUNNING.copy():
        _end_group(pid)


def _end_group(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)


_BEGUN = re.compile(
    r"^(tests/\S+?::.+?)(?: (?:PASSED|FAILED|SKIPPED|XFAIL|XPASS|ERROR).*| ?(?:Fatal Python error|Timeout \().*| ?)$",
    re.MULTILINE,
)


def named_red(output: str) -> str:
    """The last test that began: pytest stops at the first red one. None began if a file cannot be imported."""
    found = _BEGUN.findall(output)[-1:] or re.findall(r"^ERROR (tests/\S+)", output, re.MULTILINE)
    if not found:
        raise RuntimeError(f"pytest names no red test:\n{output[-3000:]}")
    return str(found[0])


def caught(fault: Fault, copy: Copy, control: Copy, last: str) -> Caught | None:
    """By which check; `last` is the one of the last round. A check does not count that is red once, but not again, or
    that is red in `control`, where there is no fault."""
    file = copy.folder / fault.file
    right = file.read_text(encoding="utf-8")
    file.write_text(planted(fault, right), encoding="utf-8", newline="\n")
    copy.until = time.monotonic() + FAULT_S
    try:
        return next(_red_checks(fault, copy, control, last), None)
    except TimeIsUp:
        return None
    finally:
        file.write_text(right, encoding="utf-8", newline="\n")
        copy.take_library(control)


def _red_checks(fault: Fault, copy: Copy, control: Copy, last: str) -> Iterator[Caught]:
    is_c = fault.file.endswith(".c")
    yield from _red_in_c(fault, copy) if is_c else _red_in_python(fault, copy)
    tests = nearest_tests(fault)
    first, second = BATCHES
    batches = [tests[:first], tests[first : first + second], tests[first + second :]]
    if last.startswith("tests/"):
        batches.insert(0, [last])
    for level in LEVELS:
        for red in _red_tests(batches, level, copy):
            if copy.first_red([red], level, []) and _is_green_in(control, [red], level):
                yield Caught(red, level)
        target = (IN_C if is_c else IN_PYTHON).get(level)
        if target and not copy.passes(target):
            with CONTROLLING:
                if control.passes(target):
                    yield Caught(f"make {target}", level)


def _is_green_in(control: Copy, tests: list[str], level: str) -> bool:
    with CONTROLLING:
        return control.first_red(tests, level, []) is None


def _red_in_python(fault: Fault, copy: Copy) -> Iterator[Caught]:
    if copy.run([PYTHON, *RUFF, fault.file])[0]:
        yield Caught("ruff", TEST)
    if copy.types():
        yield Caught("mypy", TEST)


def _red_in_c(fault: Fault, copy: Copy) -> Iterator[Caught]:
    if copy.run([*WARNINGS, f"C_FILES={fault.file}"])[0] or copy.compile():
        yield Caught("gcc", TEST)


def _red_tests(batches: list[list[str]], level: str, copy: Copy) -> Iterator[str]:
    without: list[str] = []
    for tests in batches:
        while (red := copy.first_red(tests, level, without)) is not None:
            yield red
            without.append(red)
