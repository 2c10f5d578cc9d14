"""Pages for people about one answer or one angle: a single file that loads nothing from anywhere."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.files.whole_file import check_place, write_whole

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    import polars as pl

    from oncenter.offset.answer import Answer
    from oncenter.offset.compare import Comparison
    from oncenter.signals import Signals
    from oncenter.vehicle import Vehicle


_SUFFIXES = (".html", ".htm")
_PDF = ".pdf"


def check_report(path: str | os.PathLike[str], by: str = "a report") -> None:
    """Refuses, before an answer is computed, a path to which no page can be written.

    Args:
        path: of the page, HTML or PDF; a device or a pipe may have any name.
        by: what names it, for the message.

    Raises:
        OncenterError: "output", exit code 2: no file can be written there, or its name promises another format;
            "missing_extra": bokeh is not installed; "missing_browser": a PDF, and no browser is installed that prints.
    """
    check_place(path)
    file = Path(path)
    if _is_pdf(file):
        from oncenter.report.browser import require_browser

        require_browser(file.name, file.with_suffix(".html").name)
    is_page = file.suffix.lower() in (*_SUFFIXES, _PDF) or (file.exists() and not file.is_file())
    if not is_page:
        raise OncenterError(
            f"{by} writes HTML or PDF: name it {file.with_suffix('.html')}, not {file.name}",
            code="output",
            exit_code=WRONG_USAGE,
        )
    require_package("bokeh", file.name)


def _is_pdf(file: Path) -> bool:
    return file.suffix.lower() == _PDF


def report(answer: Answer, path: str | os.PathLike[str]) -> None:
    """Writes the page: the verdict and the action, truck and drive, numbers, findings, figures, provenance.

    Args:
        answer: as `oncenter.offset` gives it.
        path: of the HTML file, `.html`, some 2 MB, or of a PDF of two A4 pages, `.pdf`, which an installed Chromium,
            Chrome or Edge prints; overwritten where it exists.

    Raises:
        OncenterError: "output", exit code 2: the file cannot be written, or has another ending; "missing_browser" or
            "browser", exit code 1: no browser is installed that prints, or it failed.
    """
    check_report(path)
    # late: bokeh takes longer to load than most answers take to find
    from oncenter.offset.run import outputs_of
    from oncenter.report.origin import origin_of
    from oncenter.report.page import page

    _write(path, page(answer, outputs_of(answer), origin_of(answer.drives)))


def report_comparison(comparison: Comparison, path: str | os.PathLike[str]) -> None:
    """Writes the certificate of a repair: one page to print and to sign.

    Args:
        comparison: as `oncenter.offset.compare.compare` gives it.
        path: as of `report`.

    Raises:
        OncenterError: as `report`.
    """
    check_report(path)
    import time

    from oncenter.report.certificate import certificate
    from oncenter.utc import utc

    _write(path, certificate(comparison, utc(time.time())))


def _write(path: str | os.PathLike[str], html: str) -> None:
    file = Path(path)
    if not _is_pdf(file):
        write_whole(path, html)
        return
    from oncenter.report.browser import pdf_of, require_browser

    write_whole(path, pdf_of(html, require_browser(file.name, file.with_suffix(".html").name), file))


def report_angle(
    table: pl.DataFrame,
    signals: Signals,
    vehicle: Vehicle,
    path: str | os.PathLike[str],
    *,
    method: str = "observer",
    sensor_lost_at: float | None = None,
    smooth: bool = False,
    taught_by: Sequence[Signals] = (),
    true_rad: npt.NDArray[np.float64] | None = None,
) -> None:
    """Writes the page of an angle without its sensor: how sure it is, what became of the sensor, the error.

    Args:
        table: as `oncenter.angle` gives it for `signals` and `vehicle`, with these options.
        path: as of `report`.
        true_rad: the true angle, shape (n,), from a simulation; without it the sensor gives the error.

    Raises:
        OncenterError: "output", exit code 2: the file cannot be written, or has another ending.
    """
    check_report(path)
    from oncenter.angle.run import findings_on, notes_on
    from oncenter.report.angle_course import angle_course
    from oncenter.report.angle_page import angle_page

    course = angle_course(table, signals, sensor_lost_at, true_rad)
    findings = [finding.text for finding in findings_on(signals, vehicle, taught_by)]
    notes = (*findings, *notes_on(signals, vehicle, taught_by, sensor_lost_at))
    _write(path, angle_page(course, signals, vehicle, method, smooth, notes))
