"""A live session tick by tick, as a table for other tools: Parquet or MF4, each column with its unit.

Ticks are collected in a file beside it, not in memory. The columns contain the signals under the names that
`oncenter.read` takes, so that the trace can be answered again.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.files.whole_file import check_place, whole_file
from oncenter.live.learner import Stepped
from oncenter.signals import DEGREE
from oncenter.utc import EPOCH_S, utc

_UNITS = {"s": "s", "deg": "deg", "deg_s": "deg/s", "m_s": "m/s", "m_s2": "m/s^2", "deg_m_s2": "deg/(m/s^2)"}

# By column, with deg for rad: the name ends in the unit.
_SIGNALS = {name: name.replace("rad", "deg") for name in _core.COLUMNS}
_OFFSET = {
    "offset_deg": ("offset", DEGREE),
    "offset_standard_deviation_deg": ("offset_sd", DEGREE),
    "offset_drive_standard_deviation_deg": ("offset_parts.drive_sd", DEGREE),
    "understeer_gradient_deg_m_s2": ("understeer_gradient", DEGREE),
    "backlash_deg": ("backlash", DEGREE),
    "unloading_acceleration_m_s2": ("unloading_acceleration", 1.0),
    "yaw_rate_bias_deg_s": ("yaw_rate_bias", DEGREE),
    "yaw_rate_bias_standard_deviation_deg_s": ("yaw_rate_bias_sd", DEGREE),
    "evidence_s": ("evidence", 1.0),
}
_ANGLE = {
    "true_angle_deg": ("angle.angle", DEGREE),
    "true_angle_standard_deviation_deg": ("angle.standard_deviation", DEGREE),
    "true_angle_without_sensor_deg": ("angle.estimate", DEGREE),
}
# By column: the member, and the text of its code.
_CODES: dict[str, tuple[str, Callable[[int], str]]] = {
    "offset_status": ("offset_status", _core.STATUSES.__getitem__),
    "true_angle_status": ("angle.status", _core.STATUSES.__getitem__),
    "rejected_by": ("reasons", lambda bits: ", ".join(_core.reasons_of(bits))),
    "sensor_fault": ("fault", _core.FAULTS.__getitem__),
    "signal_fault": ("signal_fault", _core.SIGNAL_FAULTS.__getitem__),
    "signals_at_fault": ("signals_at_fault", lambda bits: ", ".join(_core.signals_of(bits))),
}
_COLUMNS = (*_SIGNALS.values(), *_OFFSET, *_ANGLE, *_CODES)


class Trace:
    """Collects steps; `close` writes the table.

    Args:
        path: `.parquet` or `.mf4`, in an existing folder; overwritten.
        say: called with one line for each failure.

    Raises:
        OncenterError: "output", exit code 2: another suffix, or the file cannot be written; "missing_extra": asammdf
            is not installed.
    """

    def __init__(self, path: Path, say: Callable[[str], None]) -> None:
        if path.suffix not in (".parquet", ".mf4"):
            raise OncenterError(
                f"--trace takes a .parquet or .mf4 file, got {path.name}", code="output", exit_code=WRONG_USAGE
            )
        check_place(path)
        if path.suffix == ".mf4":
            require_package("asammdf", path.name)
        try:
            self._rows = tempfile.TemporaryFile(dir=path.parent, buffering=0)  # noqa: SIM115 - closed by close
        except OSError as error:
            raise OncenterError(
                f"cannot write {path}: {error.strerror}", code="output", exit_code=WRONG_USAGE
            ) from None
        self._path, self._say = path, say
        self._count = 0
        self._broken = False

    def take(self, stepped: Stepped) -> None:
        if self._broken:
            return
        rows = _rows(stepped)
        try:
            self._append(rows.tobytes())
        except OSError as error:
            self._broken = True
            self._say(f"the trace {self._path} ends here: {error.strerror}")
            return
        self._count += len(rows)

    def _append(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._rows.fileno(), data) :]

    def close(self) -> None:
        """Writes the table; if that fails, an earlier file at the path stays."""
        try:
            columns = self._columns()
            self._rows.close()  # first, to free its disk space
            if self._count:
                self._write(columns)
        except Exception as error:  # polars and asammdf have exceptions of their own
            self._say(f"the trace {self._path} could not be written: {' '.join(str(error).split())[:160]}")

    def _columns(self) -> dict[str, Any]:
        if not self._count:
            return {}
        rows = np.memmap(self._rows, np.float64, "r", shape=(self._count, len(_COLUMNS)))
        columns: dict[str, Any] = {name: np.array(rows[:, k]) for k, name in enumerate(_COLUMNS)}
        for name in _core.COLUMNS:
            if np.isnan(columns[_SIGNALS[name]]).all():
                del columns[_SIGNALS[name]]
        for name, (_, text) in _CODES.items():
            columns[name] = _core.texts_of(columns[name], text).tolist()
        return columns

    def _write(self, columns: Mapping[str, Any]) -> None:
        with whole_file(self._path) as unfinished:
            if self._path.suffix == ".parquet":
                pl.DataFrame(columns).write_parquet(unfinished)
            else:
                _write_mf4(columns, unfinished)


def unit_of(column: str) -> str:
    """The unit at the end of the column's name; empty if it has none."""
    ends = [end for end in _UNITS if column.endswith(f"_{end}")]
    return _UNITS[max(ends, key=len)] if ends else ""


def _rows(stepped: Stepped) -> npt.NDArray[np.float64]:
    rows = np.full((len(stepped), len(_COLUMNS)), np.nan)
    at = {name: k for k, name in enumerate(_COLUMNS)}
    for name, column in stepped.ticks.items():
        if name in _SIGNALS:
            rows[:, at[_SIGNALS[name]]] = column / DEGREE if "rad" in name else column
    for name, (member, factor) in _OFFSET.items():
        rows[:, at[name]] = _values(stepped, member) / factor
    for name, (member, factor) in _ANGLE.items():
        rows[:, at[name]] = _values(stepped, member) / factor
    for name, (member, _) in _CODES.items():
        rows[:, at[name]] = _values(stepped, member)
    has_offset = stepped.outputs["offset_status"] != _core.STATUSES.index("unobservable")
    for name in _OFFSET:
        if name.startswith("offset"):
            rows[~has_offset, at[name]] = np.nan
    return rows


def _values(stepped: Stepped, member: str) -> Any:
    return reduce(lambda struct, part: struct[part], member.split("."), stepped.outputs)


def _write_mf4(columns: Mapping[str, Any], path: Path) -> None:
    from asammdf import MDF, Signal

    time = columns["time_s"]
    start_s = float(time[0]) if time[0] > EPOCH_S else 0.0
    with MDF(version="4.10") as mdf:
        if start_s:
            mdf.start_time = utc(start_s)
        mdf.append(
            [
                Signal(
                    np.array(column, "S") if isinstance(column, list) else column,
                    time - start_s,
                    unit=unit_of(name),
                    name=name,
                    encoding="utf-8" if isinstance(column, list) else None,
                )
                for name, column in columns.items()
                if name != "time_s"
            ],
            comment="oncenter live",
            common_timebase=True,
        )
        mdf.save(path, overwrite=True, compression=2)
