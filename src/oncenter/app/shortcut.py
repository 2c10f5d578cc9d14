"""An icon on the desktop that opens the page: a file that the system starts by a double click."""

from __future__ import annotations

import contextlib
import os
import shlex
import stat
import subprocess
import sys
from pathlib import Path

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.whole_file import write_whole

_COMMAND = ("-m", "oncenter", "app")
_SHELL_FOLDERS = r"Software\Microsoft\Windows\CurrentVersion\Explorer\User Shell Folders"
_USER_DIR_S = 5.0


def write_shortcut() -> Path:
    """Writes it for this Python and this user; an older one is replaced.

    Raises:
        OncenterError: "output", exit code 2: there is no desktop, or it cannot be written.
    """
    folder = _desktop()
    if not folder.is_dir():
        raise OncenterError(
            f"there is no desktop at {folder}: start it with oncenter app", code="output", exit_code=WRONG_USAGE
        )
    name, text = _of_system()
    path = folder / name
    write_whole(path, text)
    if os.name == "posix":
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def _of_system() -> tuple[str, str]:
    """Name and text of the file."""
    if sys.platform == "win32":
        return "oncenter.cmd", "\r\n".join(
            (
                "@echo off",
                "chcp 65001 >nul",  # the next lines are UTF-8
                "title oncenter",
                "echo Close this window to end oncenter.",
                f'"{sys.executable.replace("%", "%%")}" {" ".join(_COMMAND)} || pause',
                "",
            )
        )
    command = shlex.join([sys.executable, *_COMMAND])
    if sys.platform == "darwin":
        return "oncenter.command", f"#!/bin/sh\nexec {command}\n"
    entry = f"[Desktop Entry]\nType=Application\nName=oncenter\nExec={_quoted()}\nTerminal=true\n"
    return "oncenter.desktop", entry


def _quoted() -> str:
    """As an Exec key of the Desktop Entry Specification, in which % begins a field code."""
    python = sys.executable.replace("%", "%%")
    escaped = "".join(f"\\\\{sign}" if sign in '"`$\\' else sign for sign in python)
    return f'"{escaped}" {" ".join(_COMMAND)}'


def _desktop() -> Path:
    """On Linux its name depends on the language; on Windows OneDrive may have moved it."""
    if sys.platform == "win32":
        import winreg

        with (
            contextlib.suppress(OSError),
            winreg.OpenKey(winreg.HKEY_CURRENT_USER, _SHELL_FOLDERS) as key,
        ):
            return Path(winreg.ExpandEnvironmentStrings(winreg.QueryValueEx(key, "Desktop")[0]))
    if sys.platform.startswith("linux"):
        try:
            told = subprocess.run(
                ["xdg-user-dir", "DESKTOP"], capture_output=True, text=True, timeout=_USER_DIR_S, check=True
            )
        except (OSError, subprocess.SubprocessError):
            pass
        else:
            if told.stdout.strip():
                return Path(told.stdout.strip())
    return Path.home() / "Desktop"
