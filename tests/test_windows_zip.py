"""The zip for Windows: it has every wheel that the page needs, in the file of the lock; install.cmd bears any path and
does not vanish with its error. `make zip` builds it, and runs install.cmd in wine; the workflow runs it on Windows."""

import hashlib
import re
import runpy
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[1]
ZIP = runpy.run_path(str(ROOT / "wheels" / "windows_zip.py"))
INSTALL = ZIP["texts"](400)["install.cmd"]
LINES = [line for line in INSTALL.split("\r\n") if not line.startswith("rem ")]


def wheel(folder: Path, name: str, *needs: str) -> Path:
    path = folder / f"{name}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as packed:
        lines = [f"Name: {name}", *(f"Requires-Dist: {need}" for need in needs), "", ""]
        packed.writestr(f"{name}-1.0.dist-info/METADATA", "\n".join(lines))
    return path


@pytest.fixture
def wheels(tmp_path: Path) -> list[Path]:
    own = wheel(tmp_path, "oncenter", 'plots[fast] ; extra == "report"', 'compilers ; extra == "fmu"')
    plots = wheel(
        tmp_path, "plots", 'colours ; sys_platform == "win32"', 'other ; os_name == "posix"', "quick; extra=='fast'"
    )
    return [own, plots, *(wheel(tmp_path, name) for name in ("colours", "quick", "pip", "msvc_runtime"))]


def pins(wheels: list[Path]) -> dict[str, tuple[str, set[str]]]:
    named = {path.name.split("-")[0].replace("_", "-"): path for path in wheels}
    return {name: ("1.0", {hashlib.sha256(path.read_bytes()).hexdigest()}) for name, path in named.items()}


def faults(wheels: list[Path], folder: Path, pinned: Any) -> list[str]:
    ZIP["pack"](wheels, None, folder / "made.zip", 1_700_000_000)
    return list(ZIP["faults"](folder / "made.zip", pinned))


def test_a_zip_with_all_that_windows_needs_and_nothing_else_is_complete(wheels: list[Path], tmp_path: Path) -> None:
    assert faults(wheels, tmp_path, pins(wheels)) == []
    assert faults(
        [*wheels, wheel(tmp_path, "compilers")], tmp_path, pins([*wheels, tmp_path / "compilers-1.0-py3-none-any.whl"])
    ) == ["nothing needs compilers"]


@pytest.mark.parametrize("lacking", ["plots", "colours", "quick", "pip"])
def test_a_zip_that_lacks_a_wheel_is_not_made(wheels: list[Path], tmp_path: Path, lacking: str) -> None:
    left = [path for path in wheels if not path.name.startswith(lacking)]
    assert f"no wheel of {lacking}" in faults(left, tmp_path, pins(wheels))


def test_a_wheel_that_is_not_the_file_of_the_lock_is_named(wheels: list[Path], tmp_path: Path) -> None:
    pinned = pins(wheels) | {"plots": ("1.0", {"0" * 64}), "quick": ("1.1", pins(wheels)["quick"][1])}
    said = faults(wheels, tmp_path, pinned)
    assert said == [f"{name}-1.0-py3-none-any.whl is not the file of the lock" for name in ("plots", "quick")]


def test_the_locks_have_hashes_of_pip_and_of_what_the_extras_name() -> None:
    locked = ZIP["locked"]()
    licences = runpy.run_path(str(ROOT / "docs" / "make_licences.py"))
    needed = {name for extra in ("", *ZIP["EXTRAS"]) for name, _ in licences["requirements"]("oncenter", extra)}
    assert [name for name in sorted(needed | set(ZIP["TOOLS"])) if name not in locked or not locked[name][1]] == []


def test_a_text_of_the_zip_ends_its_lines_as_windows_does_and_has_no_mark_left() -> None:
    for text in ZIP["texts"](400).values():
        assert "\n" not in text.replace("\r\n", "") and "@" not in text.replace("@echo off", "")


def test_install_cmd_has_each_path_in_quotes() -> None:
    for line in LINES:
        for path in re.finditer(r"%(?:HERE|PLACE|PYTHON|PIP|LOCALAPPDATA|~dp0)%?", line):
            assert line[: path.start()].count('"') % 2 == 1, line


def test_install_cmd_keeps_its_window_open_and_tests_each_step() -> None:
    ends = [number for number, line in enumerate(LINES) if line.startswith("exit /b")]
    assert len(ends) == 2 and all(LINES[number - 1] == "pause" for number in ends)
    for number, line in enumerate(LINES):
        if line.startswith(("xcopy", '"%PYTHON%"')):
            assert LINES[number + 1] == 'if not "%errorlevel%"=="0" goto failed', line
    assert INSTALL.isascii()  # a console has another code page


def test_install_cmd_asks_no_network_and_takes_only_the_files_of_the_lock() -> None:
    (pip,) = [line for line in LINES if "%PIP%" in line and "install" in line]
    assert {"--isolated", "--no-index", "--require-hashes"} <= set(pip.split())
    assert not re.search(r"https?:|curl|powershell", INSTALL, re.IGNORECASE)


def test_the_icon_on_windows_bears_umlauts_and_percent_signs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from oncenter.app import shortcut

    monkeypatch.setattr(shortcut, "_desktop", lambda: tmp_path)
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(sys, "executable", r"C:\Jürgen 100%\python.exe")
    text = shortcut.write_shortcut().read_bytes().decode("utf-8")
    before, command = text.split('"', 1)
    assert "chcp 65001" in before  # from there on the interpreter reads UTF-8
    assert command == 'C:\\Jürgen 100%%\\python.exe" -m oncenter app || pause\r\n'


def test_the_workflow_installs_the_zip_on_windows_by_double_click_s_command() -> None:
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "check.yml").read_text(encoding="utf-8"))["jobs"]
    text = str(jobs["zip"]) + str(jobs["installed"])
    assert ZIP["PYTHON"] in text and "install.cmd" in text and "windows" in jobs["installed"]["runs-on"]
