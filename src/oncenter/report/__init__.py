"""Pages for people about one answer or one angle: a single file that loads nothing from anywhere."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from oncenter.files.whole_file import write_whole

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    import polars as pl

    from oncenter.offset.answer import Answer
    from oncenter.signals import Signals
    from oncenter.vehicle import Vehicle


def report(answer: Answer, path: str | os.PathLike[str]) -> None:
    """Writes the page: the answer in words, the drive, the gate, the offset over time, where it came from.

    Args:
        answer: as `oncenter.offset` gives it.
        path: of the HTML file, some 2 MB; overwritten where it exists.

    Raises:
        OncenterError: "output", exit code 2: the file cannot be written.
    """
    # late: bokeh takes longer to load than most answers take to find
    from oncenter.offset.run import trace
    from oncenter.report.page import page

    write_whole(path, page(answer, trace(answer)))


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
        path: of the HTML file, some 2 MB; overwritten where it exists.
        true_rad: the true angle, shape (n,), where a simulation knows it; else the sensor tells the error.

    Raises:
        OncenterError: "output", exit code 2: the file cannot be written.
    """
    from oncenter.angle.run import findings_on, notes_on
    from oncenter.report.angle_course import angle_course
    from oncenter.report.angle_page import angle_page

    course = angle_course(table, signals, sensor_lost_at, true_rad)
    findings = [finding.text for finding in findings_on(signals, vehicle, taught_by)]
    notes = (*findings, *notes_on(signals, vehicle, taught_by, sensor_lost_at))
    write_whole(path, angle_page(course, signals, vehicle, method, smooth, notes))
