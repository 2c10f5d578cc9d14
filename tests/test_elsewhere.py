"""Windows and macOS, emulated on this machine by `elsewhere/`: no real one runs these tests."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from oncenter.utc import utc

SOURCES = Path(__file__).parents[1] / "src"
ELSEWHERE = Path(__file__).parent / "elsewhere"
TRUCK = "scania_r730_4x2"
BOTH = pytest.mark.parametrize("platform", ["win32", "darwin"])
IMPORTS = """
import importlib, pkgutil, oncenter
for module in pkgutil.walk_packages(oncenter.__path__, "oncenter."):
    if module.name.rpartition(".")[2] not in ("__main__", "liboncenter"):
        importlib.import_module(module.name)
"""


def run(platform: str, *arguments: str, folder: Path | None = None) -> subprocess.CompletedProcess[bytes]:
    """Python as on that platform."""
    path = os.pathsep.join([str(ELSEWHERE), str(SOURCES), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"ONCENTER_AS": platform, "PYTHONPATH": path}
    return subprocess.run([sys.executable, *arguments], capture_output=True, cwd=folder, env=environment, timeout=120)


def printed(platform: str, program: str, folder: Path | None = None) -> str:
    done = run(platform, "-c", program, folder=folder)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout.decode()


@BOTH
def test_every_module_loads_where_posix_modules_are_missing(platform: str) -> None:
    printed(platform, IMPORTS)


def test_modules_missing_on_a_system_are_hidden_only_from_oncenter() -> None:
    said = "from oncenter.files import child; import os; print(hasattr(child.os, 'sysconf'), hasattr(os, 'sysconf'))"
    assert printed("win32", said) == "False True\n"
    assert printed("darwin", said) == "True True\n"
    said = "from oncenter.fleet import engines as e; import os; print(hasattr(e.os, 'sched_getaffinity'))"
    assert printed("darwin", said) == "False\n"


@BOTH
@pytest.mark.parametrize("interface", [(), ("--interface", "socketcan")])
def test_a_system_without_socketcan_says_which_interface_to_name(platform: str, interface: tuple[str, ...]) -> None:
    done = run(platform, "-m", "oncenter", "live", "can0", "--vehicle", TRUCK, *interface)
    assert done.returncode == 2
    (line,) = done.stderr.decode().splitlines()
    assert "name the interface of your CAN adapter with --interface: pcan, vector, kvaser" in line


def test_output_to_a_file_on_windows_is_utf8(tmp_path: Path) -> None:
    done = run("win32", "-m", "oncenter", "signals", "−5°±Ω.csv", "--json", folder=tmp_path)
    assert "−5°±Ω.csv" in json.loads(done.stdout.decode("utf-8"))["message"]
    assert "−5°±Ω.csv" in done.stderr.decode("utf-8")


def test_windows_shells_leave_patterns_to_the_program(tmp_path: Path) -> None:
    for name in ("b.mf4", "a.mf4", "c.csv", "d[1].mf4"):
        (tmp_path / name).touch()
    said = "from oncenter.cli import _expanded; print(_expanded(['offset', '*.mf4', 'd[1].mf4', '*.blf', '--json']))"
    expected = ["offset", "a.mf4", "b.mf4", "d[1].mf4", "d[1].mf4", "*.blf", "--json"]
    assert printed("win32", said, tmp_path) == f"{expected}\n"
    assert printed("darwin", said, tmp_path) == f"{['offset', '*.mf4', 'd[1].mf4', '*.blf', '--json']}\n"


def test_a_file_open_on_windows_stays_and_the_error_says_so(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    page.write_text("old", encoding="utf-8")
    program = f"""
from oncenter.errors import OncenterError
from oncenter.files.whole_file import write_whole
with open({str(page)!r}):
    try:
        write_whole({str(page)!r}, "new")
    except OncenterError as error:
        print(error)
"""
    why = "another program has it open: close it there, or name another file"
    assert printed("win32", program) == f"cannot write {page}: {why}\n"
    assert (page.read_text(encoding="utf-8"), os.listdir(tmp_path)) == ("old", [page.name])


def test_a_file_open_on_windows_for_a_moment_is_replaced(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    page.write_text("old", encoding="utf-8")
    program = f"""
import threading
from oncenter.files.whole_file import write_whole
scanned = open({str(page)!r})
threading.Timer(0.2, scanned.close).start()
write_whole({str(page)!r}, "new")
"""
    printed("win32", program)
    assert page.read_text(encoding="utf-8") == "new"


@BOTH
def test_two_processes_cannot_lock_one_file(platform: str, tmp_path: Path) -> None:
    program = f"""
import os
from oncenter.files import lock
one, other = (os.open({str(tmp_path / "x.state")!r}, os.O_RDWR | os.O_CREAT) for _ in range(2))
print(lock.take(one), lock.take(other), os.lseek(one, 0, os.SEEK_CUR))
os.close(one)
print(lock.take(other))
"""
    assert printed(platform, program) == "True False 0\nTrue\n"


def test_the_state_is_stored_in_the_system_s_folder_for_it() -> None:
    said = "import os; os.environ |= {'LOCALAPPDATA': '/local', 'HOME': '/me'}; from oncenter.live import memory; "
    said += "print(memory.default_folder())"
    assert printed("win32", said) == "/local/oncenter\n"
    assert printed("darwin", said) == "/me/Library/Application Support/oncenter\n"


@BOTH
def test_two_trucks_have_two_files_on_file_systems_that_ignore_case(platform: str) -> None:
    trucks = ["A1", "a1", "\N{LATIN SMALL LETTER E WITH ACUTE}", "e\N{COMBINING ACUTE ACCENT}", "con", "CON", "x" * 300]
    said = f"from oncenter.files.file_name import file_stem; print([file_stem(each) for each in {trucks!r}])"
    stems = ast.literal_eval(printed(platform, f"import sys; sys.stdout.reconfigure(encoding='utf-8'); {said}"))
    assert len({stem.lower() for stem in stems}) == len(trucks)
    assert stems[1] == "a1"
    assert all(not stem.lower().startswith("con") for stem in stems)
    assert platform == "darwin" or all(len(os.fsencode(stem)) <= 120 for stem in stems)


def test_a_path_of_windows_is_shown_with_slashes() -> None:
    said = r"from oncenter.files.file_name import printable_name as p; print(p('C:\\logs\\xa1\\drive\x1b.csv'))"
    assert printed("win32", said) == "C:/logs/xa1/drive\\x1b.csv\n"


def test_a_closed_output_pipe_is_no_error_on_windows() -> None:
    said = "from oncenter.cli import _is_of_a_reader_that_left as left; print([left(OSError(k, '')) for k in (22, 28)])"
    assert printed("win32", said) == "[True, False]\n"
    assert printed("darwin", said) == "[False, False]\n"


def test_dates_beyond_those_of_windows_are_the_same() -> None:
    assert [f"{utc(time_s):%Y-%m-%d %H:%M:%S}" for time_s in (-1.0, 253_402_300_799.0)] == [
        "1969-12-31 23:59:59",
        "9999-12-31 23:59:59",
    ]


def test_a_crash_on_windows_is_named_by_its_status() -> None:
    said = "from oncenter.files import child; print([child._how_it_ended(code) for code in (1, 0xC0000005, -11)])"
    assert printed("win32", said) == "['exit code 1', 'exit code 0xc0000005', 'SIGSEGV']\n"


def test_every_text_file_is_opened_by_its_encoding() -> None:
    """Windows would use its code page."""
    assert not [place for path in SOURCES.rglob("*.py") for place in _without_encoding(path)]


def _without_encoding(path: Path) -> Iterator[str]:
    for call in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(call, ast.Call) and _is_of_text(call) and not _has_encoding(call):
            yield f"{path.relative_to(SOURCES)}:{call.lineno}"


def _is_of_text(call: ast.Call) -> bool:
    if isinstance(call.func, ast.Name):
        return call.func.id == "open" and not any("b" in mode for mode in _texts(call.args[1:]))
    if not isinstance(call.func, ast.Attribute):
        return False
    if call.func.attr in ("read_text", "write_text"):
        return True
    of_a_bag = isinstance(call.func.value, ast.Name) and call.func.value.id == "reader"
    is_path = call.func.attr == "open" and not of_a_bag and all(isinstance(given, ast.Constant) for given in call.args)
    return is_path and not isinstance(call.func.value, ast.Call) and not any("b" in mode for mode in _texts(call.args))


def _has_encoding(call: ast.Call) -> bool:
    return any(keyword.arg == "encoding" for keyword in call.keywords)


def _texts(given: list[ast.expr]) -> Iterator[str]:
    yield from (str(each.value) for each in given if isinstance(each, ast.Constant))
