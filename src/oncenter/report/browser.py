"""A page printed as PDF by a browser of this machine: Chromium, Chrome or Edge, without a window."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from oncenter.errors import OncenterError

_ON_PATH = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "microsoft-edge-stable",
    "msedge",
)
_WINDOWS = (r"Google\Chrome\Application\chrome.exe", r"Chromium\Application\chrome.exe")
_WINDOWS_EDGE = r"Microsoft\Edge\Application\msedge.exe"
_WINDOWS_FOLDERS = ("PROGRAMFILES", "PROGRAMFILES(X86)", "LOCALAPPDATA")
_MACOS = ("Google Chrome", "Chromium", "Microsoft Edge")
_DRAWING_MS = 10_000  # of the page's own clock, which runs as fast as it can: its scripts take some 300
_TIMEOUT_S = 90.0  # a slow laptop takes 15
# Wider than an A4 page less its margins, 718 px: page.js makes the pictures as narrow as that for print, and so lower.
_WINDOW = "--window-size=860,1400"
_OPTIONS = (
    "--headless",
    "--disable-gpu",
    "--disable-extensions",
    "--disable-background-networking",
    "--no-first-run",
    "--no-default-browser-check",
    "--hide-scrollbars",
    "--no-pdf-header-footer",
    "--force-device-scale-factor=2",
    f"--virtual-time-budget={_DRAWING_MS}",
    _WINDOW,
)


def find_browser() -> Path | None:
    """The first that is installed, on PATH or at its usual place."""
    on_path = (shutil.which(name) for name in _ON_PATH)
    there = (Path(found) for found in on_path if found)
    return next(there, None) or next((place for place in _usual_places() if place.is_file()), None)


def _usual_places() -> Iterator[Path]:
    if sys.platform == "win32":
        folders = [Path(os.environ[name]) for name in _WINDOWS_FOLDERS if os.environ.get(name)]
        yield from (folder / name for name in (*_WINDOWS, _WINDOWS_EDGE) for folder in folders)
    elif sys.platform == "darwin":
        applications = (Path("/Applications"), Path.home() / "Applications")
        yield from (folder / f"{name}.app/Contents/MacOS/{name}" for name in _MACOS for folder in applications)
    else:
        yield from ()  # Linux installs browsers on PATH


def require_browser(what: str, instead: str) -> Path:
    """The browser that prints.

    Args:
        what: the file that needs it, for the message.
        instead: the name of a page that does without.

    Raises:
        OncenterError: "missing_browser", exit code 1: none is installed.
    """
    found = find_browser()
    if found is None:
        raise OncenterError(
            f"{what} needs Chromium, Chrome or Edge to print it, and none is installed: install one "
            f"(Debian: apt install chromium), or write the page {instead}, which any browser prints",
            code="missing_browser",
        )
    return found


def pdf_of(html: str, browser: Path, beside: Path, timeout_s: float = _TIMEOUT_S) -> bytes:
    """The page as PDF.

    Args:
        html: the whole document.
        browser: as `require_browser` gives it.
        beside: the file to be written, for messages. The page is put into its folder meanwhile, since a browser in a
            sandbox of its own (Ubuntu's) has another /tmp.
        timeout_s: of wall clock; then the browser is stopped.

    Raises:
        OncenterError: "browser", exit code 1: the browser did not start, crashed or did not end.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="oncenter-", dir=beside.parent, ignore_cleanup_errors=True) as name:
            folder = Path(name).resolve()
            page, pdf = folder / "page.html", folder / "page.pdf"
            page.write_bytes(html.encode("utf-8", "backslashreplace"))
            why = _run([str(browser), *_options(folder), f"--print-to-pdf={pdf}", page.as_uri()], timeout_s)
            printed = pdf.read_bytes() if pdf.is_file() else b""
    except OSError as error:
        why, printed = error.strerror or str(error), b""
    if not printed.startswith(b"%PDF"):
        raise OncenterError(
            f"cannot print {beside}: {browser.name} {why or 'wrote no PDF'}; write the page "
            f"{beside.with_suffix('.html').name} instead, which any browser prints",
            code="browser",
        )
    return printed


def _options(folder: Path) -> list[str]:
    as_root = hasattr(os, "geteuid") and os.geteuid() == 0
    # as root Chromium does not start with its sandbox; the page is ours and may load nothing
    return [*_OPTIONS, f"--user-data-dir={folder / 'profile'}", *(["--no-sandbox"] if as_root else [])]


def _run(command: list[str], timeout_s: float) -> str:
    """Empty where it ended well, else what happened."""
    quiet = subprocess.DEVNULL
    with subprocess.Popen(
        command, stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=sys.platform != "win32"
    ) as running:
        try:
            code = running.wait(timeout_s)
        except subprocess.TimeoutExpired:
            return f"did not end within {timeout_s:g} s"
        finally:
            if running.poll() is None:
                _stop(running)
    return "" if code == 0 else f"ended with code {code}"


def _stop(running: subprocess.Popen[bytes]) -> None:
    """Stops the browser with its child processes, where the system groups them."""
    if sys.platform == "win32":
        running.kill()
    else:
        os.killpg(running.pid, signal.SIGKILL)
    running.wait()
