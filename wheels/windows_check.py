"""Runs install.cmd of the zip in wine's command interpreter, from and into folders with spaces, umlauts and brackets.

Usage: windows_check.py FOLDER, from windows_zip.py. wine has no Python: a program that writes down what it is asked
takes its place, and fails where it should. pip resolves the packages for Windows here, and installs nothing: that is
tried on Windows, by the workflow. Needs zig and wine (`make zip` installs both).
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from windows_zip import VERSION

STAND_IN = r"""
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <windows.h>
int main(void)
{
    const char *fails_at = getenv("FAILS_AT");
    FILE *said = fopen(getenv("SAID"), "a");
    fprintf(said, "%s\n", GetCommandLineA());
    fclose(said);
    return *fails_at != '\0' && strstr(GetCommandLineA(), fails_at) != NULL;
}
"""
HOME = r"C:\users\J Werk & Hof (1)\AppData\Local"  # wine has no umlaut in this variable
_WINE_S = 120.0


def main() -> None:
    archive = next(Path(sys.argv[1]).resolve().glob("oncenter-*-windows.zip"))
    with tempfile.TemporaryDirectory() as place:
        work = Path(place)
        begin = work / "begin.cmd"
        begin.write_text(f'@set "LOCALAPPDATA={HOME}"\r\n@call install.cmd\r\n', encoding="ascii")
        folder = unpacked(archive, work / "Eigene Dateien \u00fc (1)")
        resolve(folder / "wheels")
        refused = run(folder, work, "")
        expect(refused, 1, "finding Python", "python.org")
        (folder / "python").mkdir(exist_ok=True)
        compile_stand_in(folder / "python" / "python.exe", work)
        installed = run(folder, work, "")
        expect(installed, 0, "oncenter is installed", "Press")
        pip, icon = (work / "said").read_text(encoding="latin-1").splitlines()
        if (
            "--no-index" not in pip
            or "--require-hashes" not in pip
            or "pip-" not in pip
            or "app --shortcut" not in icon
        ):
            raise SystemExit(f"install.cmd asked for {pip} and {icon}")
        expect(run(folder, work, "--shortcut"), 1, "putting the icon on the desktop", "oncenter itself is installed")
        expect(run(folder, work, "--no-index"), 1, "installing the packages", "Press")
        (folder / "wheels" / "requirements.txt").unlink()
        expect(run(folder, work, ""), 1, "Extract All")
    print(f"{archive.name}: install.cmd installs, and says what fails")


def unpacked(archive: Path, place: Path) -> Path:
    with zipfile.ZipFile(archive) as packed:
        packed.extractall(place)
    return place / archive.stem


def resolve(wheels: Path) -> None:
    """What install.cmd asks of pip, by the zip's pip: all packages are there, with their hashes."""
    (pip,) = wheels.glob("pip-*.whl")
    asked = ["install", "--dry-run", "--quiet", "--isolated", "--no-index", "--find-links", str(wheels)]
    asked += ["--require-hashes", "-r", str(wheels / "requirements.txt")]
    asked += ["--platform=win_amd64", f"--python-version={VERSION}", "--only-binary=:all:"]
    subprocess.run([sys.executable, pip / "pip", *asked], check=True)


def compile_stand_in(program: Path, work: Path) -> None:
    source = work / "python.c"
    source.write_text(STAND_IN, encoding="ascii")
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu"]
    subprocess.run([*zig, source, "-o", program], check=True)


def run(folder: Path, work: Path, fails_at: str) -> tuple[int, str]:
    """Exit code and output. Its standard input is empty, so that `pause` goes on."""
    said = work / "said"
    said.unlink(missing_ok=True)
    given = {"WINEPREFIX": str(work / "wine"), "WINEDEBUG": "-all", "LC_ALL": "C.UTF-8"}
    given |= {"SAID": f"Z:{said}", "FAILS_AT": fails_at}
    done = subprocess.run(
        ["wine", "cmd", "/c", r"..\..\begin.cmd"],
        cwd=folder,
        env=os.environ | given,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=_WINE_S,
        check=False,
    )
    return done.returncode, done.stdout.decode("utf-8", "replace")


def expect(done: tuple[int, str], code: int, *said: str) -> None:
    lacking = [words for words in said if words not in done[1]]
    if done[0] != code or lacking:
        raise SystemExit(f"install.cmd ended with {done[0]} instead of {code} and does not say {lacking}:\n{done[1]}")


if __name__ == "__main__":
    main()
