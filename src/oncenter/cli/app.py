"""oncenter app: a page in the browser in place of a terminal."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Annotated

import typer


def app(
    port: Annotated[
        int, typer.Option(metavar="PORT", min=0, max=65535, help="Port of the page; 0 takes a free one.")
    ] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
    trucks: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of your trucks; by default in the system's for programs.")
    ] = None,
    shortcut: Annotated[
        bool, typer.Option("--shortcut", help="Put an icon on the desktop that opens the page, and end.")
    ] = False,
) -> None:
    """Open a page: drop logs, choose the truck, read the verdict. Ctrl-C ends it.

    Everything stays on this computer. The page's address contains a key, so that no other user of it gets in.
    """
    from oncenter.files.extra import require_package
    from oncenter.live.memory import default_folder

    require_package("bokeh", "oncenter app", "report")
    if shortcut:
        from oncenter.app.shortcut import write_shortcut

        typer.echo(f"wrote {write_shortcut()}: a double click opens the page")
        return
    from oncenter.app.server import serve

    def opened(address: str, once: str) -> None:
        typer.echo(f"the page is at {address}; Ctrl-C ends it")
        if browser:
            import webbrowser

            webbrowser.open(once)

    _end_when_closed()
    serve(trucks or default_folder() / "trucks", port, opened)


def _end_when_closed() -> None:
    """A terminal that closes ends the page as Ctrl-C does, which deletes the copies of the logs."""
    if sys.platform == "win32":
        closed = signal.SIGBREAK
    else:
        closed = signal.SIGHUP
    for number in (signal.SIGTERM, closed):
        if signal.getsignal(number) is signal.SIG_DFL:  # nohup ignores it
            signal.signal(number, signal.default_int_handler)
