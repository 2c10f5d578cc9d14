"""The thesis line by line: each of its figures, tables and numbers reproduced by this code.

A module per figure group has one function, `run(progress) -> list[Exhibit]`: it computes everything that its
figures and tables show, calls `progress` with the fraction done, and types in no result. GROUPS lists them; the page
sorts their exhibits by number.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.files.whole_file import write_whole

if TYPE_CHECKING:
    from oncenter.thesis.figure import Exhibit

# Modules of this folder, with the seconds that each takes approximately: its share of the progress bar.
GROUPS: Mapping[str, float] = {
    "schematics": 1.0,
    "geometry": 1.0,
    "single_track": 1.0,
    "handling": 3.0,
    "validation_drives": 2.0,
    "real_time": 8.0,
    "turning_centre": 2.0,
    "identifiability": 3.0,
    "flowchart": 1.0,
    "estimator": 5.0,
    "tables": 1.0,
    "error_budget": 1.5,
    "gyro_drift": 1.0,
    "distributions": 1.0,
    "passes": 0.7,
}


def write(
    folder: str | os.PathLike[str],
    progress: Callable[[float], None] | None = None,
    groups: Mapping[str, float] = GROUPS,
) -> Path:
    """Computes all groups and writes `index.html`, and each figure as SVG and PNG beside it.

    Args:
        folder: created if it does not exist; files in it are overwritten.
        progress: called with the fraction done, 0 to 1.
        groups: the groups to compute, in the form of GROUPS.

    Returns:
        The page's path.

    Raises:
        OncenterError: "missing_extra": matplotlib is not installed. "output", exit code 2: the folder cannot be
            written.
    """
    require_package("matplotlib", "oncenter thesis")
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
        exhibits = _computed(groups, progress or (lambda fraction: None))
        return _written(target, exhibits)
    except OSError as error:
        raise OncenterError(
            f"output folder {target} cannot be written: {error.strerror or error}; name a folder that you may write to",
            code="output",
            exit_code=WRONG_USAGE,
        ) from None


def _computed(groups: Mapping[str, float], progress: Callable[[float], None]) -> list[Exhibit]:
    exhibits: list[Exhibit] = []
    whole, before = sum(groups.values()), 0.0
    for name, share in groups.items():

        def of_whole(fraction: float, before: float = before, share: float = share) -> None:
            progress((before + share * fraction) / whole)

        exhibits += import_module(f"oncenter.thesis.{name}").run(of_whole)
        before += share
        of_whole(1.0)
    return exhibits


def _written(target: Path, exhibits: list[Exhibit]) -> Path:
    from oncenter import _core
    from oncenter.thesis.drawing import drawn
    from oncenter.thesis.figure import Figure
    from oncenter.thesis.page import file_stem, page

    svgs = {}
    for figure in exhibits:
        if isinstance(figure, Figure):
            svg, png = drawn(figure)
            svgs[figure.number] = svg
            write_whole(target / f"{file_stem(figure)}.svg", svg)
            write_whole(target / f"{file_stem(figure)}.png", png)
    html = target / "index.html"
    write_whole(html, page(exhibits, svgs, _core.version()))
    return html
