"""oncenter thesis: figures, tables and numbers of the thesis, reproduced on one page."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer


def thesis(
    output: Annotated[Path, typer.Option(metavar="DIR", help="The folder for the page and its figures.")],
) -> None:
    """Reproduce the figures and tables of the thesis.

    The result is one page, with the claims of the thesis beside the numbers of this code. It takes about three minutes.
    """
    from oncenter.files.extra import require_package
    from oncenter.thesis import write

    require_package("matplotlib", "oncenter thesis")  # before the bar is drawn

    with typer.progressbar(length=1000, label="computing", file=sys.stderr) as bar:
        page = write(output, lambda fraction: bar.update(int(1000 * fraction) - bar.pos))
    typer.echo(f"wrote {page}: open it in a browser")
