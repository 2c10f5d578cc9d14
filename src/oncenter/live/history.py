"""The history of a drive for the page's figures, in constant memory."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from oncenter import _core
from oncenter.live.learner import Stepped
from oncenter.signals import DEGREE

COURSE_POINTS = 600  # of the offset over the whole drive; when full, every other point is dropped
STRIP_S = 120  # of the gate
CLOUD_POINTS = 900  # of the last clean ones
CLOUD_EVERY_S = 0.5
_UNOBSERVABLE = _core.STATUSES.index("unobservable")


@dataclass(frozen=True)
class Course:
    """Offset over driving time with its 95 % interval and the half-width of the drive's part, deg and s."""

    time_s: tuple[float, ...]
    offset_deg: tuple[float, ...]
    low_deg: tuple[float, ...]
    high_deg: tuple[float, ...]
    half_width_drive_deg: tuple[float, ...]


@dataclass(frozen=True)
class Strip:
    """The gate's last seconds, one cell each: by reason, the share of the cell's ticks rejected for it."""

    begin_s: tuple[float, ...]
    clean: tuple[float, ...]
    rejected: dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Cloud:
    """Clean ticks: lateral acceleration (m/s^2), residual (deg), place in the play (-1 to 1)."""

    lateral_acceleration_m_s2: tuple[float, ...]
    residual_deg: tuple[float, ...]
    place: tuple[float, ...]


class History:
    """Collects steps; returns immutable copies."""

    def __init__(self) -> None:
        self._begin_s: float | None = None
        self._course: list[tuple[float, float, float, float, float]] = []
        self._course_step_s, self._course_next_s = 1.0, 0.0
        self._cells: deque[tuple[int, int, dict[str, int]]] = deque(maxlen=STRIP_S)  # second, ticks, by reason or clean
        self._cloud: deque[tuple[float, float, float]] = deque(maxlen=CLOUD_POINTS)
        self._cloud_next_s = 0.0

    def take(self, stepped: Stepped) -> None:
        time = stepped.ticks["time_s"]
        if self._begin_s is None or time[0] < self._begin_s:
            self._begin_s = float(time[0])
            self._course_next_s = self._cloud_next_s = 0.0
        since = time - self._begin_s
        self._take_course(since, stepped)
        self._take_cells(since, stepped)
        self._take_cloud(since, stepped)

    def _take_course(self, since: np.ndarray[tuple[int], np.dtype[np.float64]], stepped: Stepped) -> None:
        while len(later := np.flatnonzero(since >= self._course_next_s)):
            k = int(later[0])
            row = stepped.outputs[k]
            self._course_next_s = float(since[k]) + self._course_step_s
            if row["offset_status"] == _UNOBSERVABLE or not np.isfinite(row["offset_sd"]):
                continue
            low, high = _core.interval_95(row["offset"], row["offset_sd"], row["offset_lean"])
            self._course.append(
                (
                    float(since[k]),
                    float(row["offset"]) / DEGREE,
                    float(low) / DEGREE,
                    float(high) / DEGREE,
                    1.96 * float(row["offset_parts"]["drive_sd"]) / DEGREE,
                )
            )
            if len(self._course) > COURSE_POINTS:
                self._course = self._course[::2]
                self._course_step_s *= 2.0

    def _take_cells(self, since: np.ndarray[tuple[int], np.dtype[np.float64]], stepped: Stepped) -> None:
        seconds = np.floor(since).astype(np.int64)
        for second in np.unique(seconds).tolist()[-STRIP_S:]:
            reasons = stepped.outputs["reasons"][seconds == second]
            if not self._cells or self._cells[-1][0] != second:
                self._cells.append((second, 0, {}))
            _, ticks, by_reason = self._cells.pop()
            for name, bit in {"clean": 0, **_core.REASONS}.items():
                count = int(np.count_nonzero(reasons & bit if bit else reasons == 0))
                if count:
                    by_reason[name] = by_reason.get(name, 0) + count
            self._cells.append((second, ticks + len(reasons), by_reason))

    def _take_cloud(self, since: np.ndarray[tuple[int], np.dtype[np.float64]], stepped: Stepped) -> None:
        for k in np.flatnonzero(stepped.outputs["reasons"] == 0).tolist():
            if since[k] >= self._cloud_next_s:
                row = stepped.outputs[k]
                motion = row["motion"]
                self._cloud_next_s = float(since[k]) + CLOUD_EVERY_S
                self._cloud.append(
                    (float(motion["lateral_acceleration"]), float(motion["residual"]) / DEGREE, float(row["place"]))
                )

    def course(self) -> Course:
        return Course(*_columns(self._course, 5))

    def strip(self) -> Strip:
        cells = list(self._cells)
        names = [name for name in _core.REASONS if any(name in by_reason for _, _, by_reason in cells)]
        shares = {
            name: tuple(by_reason.get(name, 0) / ticks for _, ticks, by_reason in cells) for name in ("clean", *names)
        }
        return Strip(tuple(float(second) for second, _, _ in cells), shares.pop("clean"), shares)

    def cloud(self) -> Cloud:
        return Cloud(*_columns(self._cloud, 3))


def _columns(rows: Iterable[tuple[float, ...]], count: int) -> list[tuple[float, ...]]:
    return [tuple(column) for column in zip(*rows, strict=True)] or [()] * count
