"""oncenter thesis: its figures, tables and numbers again, as one page."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer


def thesis(
    output: Annotated[Path, typer.Option(metavar="DIR", help="Where the page and its figures go.")],
) -> None:
    """The thesis line by line: its figures, tables and claims made again from this code, some three minutes."""
    from oncenter.files.extra import require_package
    from oncenter.thesis import write

    require_package("matplotlib", "oncenter thesis")  # before the bar is drawn

    with typer.progressbar(length=1000, label="computing", file=sys.stderr) as bar:
        page = write(output, lambda fraction: bar.update(int(1000 * fraction) - bar.pos))
    typer.echo(f"wrote {page}: open it in a browser")
