"""The three tables: their columns with units and meanings, said once, and how they become Parquet."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

from oncenter.files.whole_file import whole_file
from oncenter.fleet.summaries import COLUMNS as SUMMARY

Row = Mapping[str, Any]

_TYPES: Mapping[str, tuple[pl.DataType, pa.DataType]] = {
    "text": (pl.String(), pa.string()),
    "number": (pl.Float64(), pa.float64()),
    "count": (pl.Int64(), pa.int64()),
    "truth": (pl.Boolean(), pa.bool_()),
    "time": (pl.Datetime("ms", "UTC"), pa.timestamp("ms", "UTC")),
}
_ROWS_AT_ONCE = 20_000  # of a row group: so much is held in memory


@dataclass(frozen=True)
class Quantity:
    """What a drive tells beside the offset, as columns name it: value `NAME_UNIT`, standard deviation, status."""

    name: str
    unit: str
    about: str

    @property
    def value(self) -> str:
        return f"{self.name}_{self.unit}"

    @property
    def sd(self) -> str:
        return f"{self.name}_sd_{self.unit}"

    @property
    def status(self) -> str:
        return f"{self.name}_status"


OFFSET = Quantity("offset", "deg", "what the sensor reads driving straight, at the middle of the play")
QUANTITIES = (
    OFFSET,
    Quantity("backlash", "deg", "play and wind-up at the steering wheel, full width"),
    Quantity("unloading_acceleration", "m_s2", "lateral acceleration at which the steering unloads: pull and bias"),
    Quantity("yaw_rate_bias", "deg_s", "of the gyro"),
    Quantity("understeer_gradient", "deg_m_s2", "at the road wheel"),
)


def _of_drives() -> dict[str, tuple[str, str]]:
    columns = {
        "truck": ("text", "VIN, or the part of the path that named it; empty where nothing did"),
        "start": ("time", "when the drive began"),
        "start_source": ("text", "how that is known: log, metadata, name, modified"),
        "log": ("text", "path or URI; of copies the first by name"),
        "key": ("text", "of the log's content (BLAKE3): what makes a drive one drive"),
        "vehicle_file": ("text", "its stem in --vehicles"),
        "settings": ("text", "key of version and vehicle file"),
        "version": ("text", "of oncenter"),
        "error_code": ("text", "why there is no answer; null where there is one"),
        "error": ("text", "the same in words"),
        "rate_hz": ("number", "of the ticks"),
        "duration_s": ("number", "of the drive"),
        "used_s": ("number", "of it, for the offset"),
    }
    for quantity in QUANTITIES:
        columns[quantity.value] = ("number", quantity.about)
        interval = "1.96 of it on both sides is a 95 % interval"
        common = ", of an axle not set up to unload on the crown" if quantity.name == "offset" else ""
        columns[quantity.sd] = ("number", interval + common)
        columns[quantity.status] = ("text", "valid, converging, unobservable, invalid")
        if quantity is OFFSET:
            columns["offset_drive_sd_deg"] = ("number", "of its part that this drive leaves open")
            columns["offset_not_identifiable_sd_deg"] = (
                "number",
                "of its part that no single drive identifies: pull, mean wind, axle set-up",
            )
    for side in ("left", "right"):
        columns[f"side_force_{side}_s"] = (
            "number",
            f"of side force clearly to the {side}, which shows the play's flank",
        )
    columns["changes_in_drive"] = (
        "count",
        "that the drive proved while it lasted; the values are those after the last",
    )
    columns["findings"] = ("text", "codes, parted by blanks")
    return columns | dict(SUMMARY)


DRIVES = _of_drives()
CHANGES: dict[str, tuple[str, str]] = {
    "truck": ("text", "as in drives"),
    "quantity": ("text", "what changed: offset, backlash, unloading_acceleration, yaw_rate_bias"),
    "unit": ("text", "of before, after, size and sd"),
    "after_drive": ("time", "begin of the last drive before it"),
    "by_drive": ("time", "begin of the first drive after it"),
    "found": ("time", "begin of the drive that proved it"),
    "drives_to_find": ("count", "after the change, until it was proved"),
    "before": ("number", "mean of the drives since the change before"),
    "after": ("number", "mean of the drives until the next change"),
    "size": ("number", "after less before, without what roads that tell little put into either"),
    "sd": ("number", "of the size"),
    "cause": ("text", "of an offset's change: what else changed with it; see docs/fleet.md"),
}
TRUCKS: dict[str, tuple[str, str]] = {
    "truck": ("text", "as in drives"),
    "rank": ("count", "by evidence, 1 the strongest"),
    "verdict": ("text", "calibrate, watch, undecided, fine, unknown"),
    "would_decide": ("text", "the drive that would narrow an interval which holds the limit, in words; else null"),
    "p_value": ("number", "that all is within the limit: smaller is stronger evidence"),
    "q_value": ("number", "Benjamini-Hochberg: share of false alarms among all trucks at least so suspicious"),
    "since": ("time", "when what it now reads began: first drive of the present offset"),
    "probability_beyond": ("number", "that the offset now is beyond the limit"),
    "drives": ("count", "answered and refused"),
    "errors": ("count", "refused"),
    "told": ("count", "drives with an offset"),
    "first_drive": ("time", "its begin"),
    "last_drive": ("time", "its begin"),
    "changes": ("count", "of the offset"),
    "drift_deg_day": ("number", "slope of the present offset; null below four drives"),
    "drift_sd_deg_day": ("number", "its standard deviation"),
    "offset_deg": ("number", "now, at the truck's mean load, by all its drives together"),
    "offset_sd_deg": ("number", "its standard deviation, pull and accelerometer bias included"),
    "offset_spread_sd_deg": ("number", "of the drives since the last change alone: without these"),
    "pull_m_s2": ("number", "lateral acceleration at which the steering unloads, the accelerometer's bias taken off"),
    "pull_sd_m_s2": ("number", "its standard deviation; the pull's prior where no drive tells it"),
    "accelerometer_bias_m_s2": ("number", "now"),
    "accelerometer_bias_sd_m_s2": ("number", "its standard deviation"),
    "load_would_help": ("truth", "all drives were at one load: another one separates a pull from that bias"),
    **{
        column: ("number", about)
        for quantity in QUANTITIES[1:]
        for column, about in ((quantity.value, f"{quantity.about}; now"), (quantity.sd, "its standard deviation"))
    },
    "cause": ("text", "of the last change of the offset"),
    "vehicle_file": ("text", "of the last drive"),
}


class TableFile:
    """A Parquet file, see `whole_file`: it takes the place of the one before when all rows are in."""

    def __init__(self, path: Path, columns: Mapping[str, tuple[str, str]]) -> None:
        self._path = path
        self._types = {name: _TYPES[kind][0] for name, (kind, _) in columns.items()}
        self._schema = pa.schema([pa.field(name, _TYPES[kind][1]) for name, (kind, _) in columns.items()])
        self._rows: list[Row] = []

    def __enter__(self) -> TableFile:
        with ExitStack() as opened:
            unfinished = opened.enter_context(whole_file(self._path))
            self._writer = opened.enter_context(pq.ParquetWriter(unfinished, self._schema, compression="zstd"))
            opened.push(self._write_the_rest)
            self._opened = opened.pop_all()
        return self

    def add(self, row: Row) -> None:
        self._rows.append(row)
        if len(self._rows) == _ROWS_AT_ONCE:
            self._write()

    def _write(self) -> None:
        """By polars, since pyarrow would load pandas to look at lists."""
        of_column = {name: [row.get(name) for row in self._rows] for name in self._types}
        for name, type_ in self._types.items():
            if isinstance(type_, pl.Datetime):
                of_column[name] = [_milliseconds(time_s) for time_s in of_column[name]]
        table = pl.DataFrame(of_column, self._types).to_arrow()
        self._writer.write_table(table.cast(self._schema))
        self._rows.clear()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._opened.__exit__(kind, error, where)

    def _write_the_rest(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._write()


def _milliseconds(time_s: float | None) -> int | None:
    return None if time_s is None else round(time_s * 1000.0)
