"""The three tables: columns with units and meanings, defined once, and how they become Parquet."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import polars as pl

from oncenter.files.own_file import metadata
from oncenter.files.whole_file import whole_file
from oncenter.fleet.summaries import COLUMNS as SUMMARY
from oncenter.verdict.states import OF_OFFSET

Row = Mapping[str, Any]

_TYPES: Mapping[str, pl.DataType] = {
    "text": pl.String(),
    "number": pl.Float64(),
    "count": pl.Int64(),
    "truth": pl.Boolean(),
    "time": pl.Datetime("ms", "UTC"),
}
_ROWS_AT_ONCE = 20_000  # of a row group; they are in memory


@dataclass(frozen=True)
class Quantity:
    """An estimated quantity and its columns: value `NAME_UNIT`, standard deviation `NAME_sd_UNIT`, status."""

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


OFFSET = Quantity("offset", "deg", "straight-ahead offset: sensor reading at zero lateral force, mid-play")
QUANTITIES = (
    OFFSET,
    Quantity("backlash", "deg", "free play at the steering wheel, column wind-up included, full width"),
    Quantity("unloading_acceleration", "m_s2", "neutral lateral acceleration: pull plus accelerometer bias"),
    Quantity("yaw_rate_bias", "deg_s", "bias of the yaw rate sensor"),
    Quantity("understeer_gradient", "deg_m_s2", "understeer gradient at the road wheel"),
)


def _of_drives() -> dict[str, tuple[str, str]]:
    columns = {
        "truck": ("text", "VIN, or the part of the path that names it; empty if neither"),
        "start": ("time", "when the drive began"),
        "start_source": ("text", "source of the start: log, metadata, name, modified"),
        "log": ("text", "path or URI; of several copies the first by name"),
        "key": ("text", "hash of the log's content (BLAKE3), which identifies the drive"),
        "fingerprint": ("text", "of the signals: a copy or a part of the drive in another log has the same hashes"),
        "vin": ("text", "VIN in the log; null where it has none"),
        "copy_of": ("text", "key of the drive of which this is a copy or a part; it does not count for its truck"),
        "vehicle_file": ("text", "name of the vehicle file in --vehicles, without .toml"),
        "settings": ("text", "hash of version and vehicle file"),
        "version": ("text", "version of oncenter"),
        "error_code": ("text", "why there is no answer; null if there is one"),
        "error": ("text", "the same as a sentence"),
        "rate_hz": ("number", "tick rate"),
        "duration_s": ("number", "duration of the drive"),
        "used_s": ("number", "time used for the offset"),
        "left_out_share": ("number", "largest share of a signal's samples that one reason took; null if none was"),
        "left_out_reason": ("text", "that reason, as in the account of `oncenter signals`"),
        "left_out_signal": ("text", "that signal"),
    }
    for quantity in QUANTITIES:
        columns[quantity.value] = ("number", quantity.about)
        interval = "standard deviation; ±1.96 of it is the 95 % interval"
        common = ", for an axle that is not set up for the crown" if quantity.name == "offset" else ""
        columns[quantity.sd] = ("number", interval + common)
        columns[quantity.status] = ("text", "valid, converging, unobservable, invalid")
        if quantity is OFFSET:
            columns["offset_low_deg"] = ("number", "lower end of the whole 95 % interval")
            columns["offset_high_deg"] = ("number", "its upper end")
            columns["offset_drive_sd_deg"] = (
                "number",
                "sd of the part from this drive's measurement scatter",
            )
            columns["offset_not_identifiable_sd_deg"] = (
                "number",
                "sd of the part not identifiable from one drive: pull, mean wind, axle set-up",
            )
    for side in ("left", "right"):
        columns[f"side_force_{side}_s"] = (
            "number",
            f"time with lateral force clearly to the {side}, which loads that flank of the play",
        )
    columns["changes_in_drive"] = (
        "count",
        "changes detected within the drive; the values are those after the last change",
    )
    columns["findings"] = ("text", "codes, separated by spaces")
    columns["evidence_enough"] = ("truth", "the driving suffices for an interval that holds, valid or wider")
    columns["verdict"] = ("text", f"verdict on this drive alone, with the limit of its vehicle file: {_VERDICTS}")
    return columns | dict(SUMMARY)


_VERDICTS = ", ".join(OF_OFFSET)
DRIVES = _of_drives()
CHANGES: dict[str, tuple[str, str]] = {
    "truck": ("text", "as in drives"),
    "quantity": ("text", "what changed: offset, backlash"),
    "unit": ("text", "unit of before, after, size and sd"),
    "after_drive": ("time", "start of the last drive before the change"),
    "by_drive": ("time", "start of the first drive after the change"),
    "before": ("number", "before this change, by the truck's model"),
    "after": ("number", "the same after it"),
    "size": ("number", "after minus before; drives on roads with little excitation count less"),
    "sd": ("number", "standard deviation of the size"),
    "probability": ("number", "of the change, 0.5 to 1, by all drives"),
    "cause": ("text", "of an offset's change: the quantity that changed with it; see docs/fleet.md"),
}
TRUCKS: dict[str, tuple[str, str]] = {
    "truck": ("text", "as in drives"),
    "rank": ("count", "by evidence, 1 is the strongest"),
    "verdict": ("text", f"verdict on the offset from all drives: {_VERDICTS}"),
    "state": ("text", "the same; kept until the next release"),
    "watch": (
        "truth",
        "look again after some drives: beyond the limit, but q is above 5 %; or within it, but p is at most 5 %",
    ),
    "second_line": ("text", "pull: align first where one is measured, or its possible effect; null: none"),
    "limit_deg": ("number", "the limit of this truck: --limit, or offset_limit_deg of its vehicle file"),
    "would_decide": ("text", "the drive that would narrow the interval most, where one is needed; else null"),
    "p_value": ("number", "probability that offset and last change are within the limit; smaller is stronger evidence"),
    "q_value": ("number", "Benjamini-Hochberg: share of false alarms among the trucks down to this rank"),
    "since": ("time", "start of the first drive with the present offset"),
    "probability_beyond": ("number", "probability that the offset now is beyond the limit"),
    "drives": ("count", "drives with and without an answer, without copies and those of a former truck"),
    "errors": ("count", "drives without an answer"),
    "told": ("count", "drives with an offset; logs with short stops between are one"),
    "first_drive": ("time", "start of the first drive"),
    "last_drive": ("time", "start of the last drive"),
    "changes": ("count", "changes of the offset"),
    "drift_deg_day": ("number", "slope of the present offset; null below four drives"),
    "drift_sd_deg_day": ("number", "its standard deviation"),
    "offset_deg": ("number", "straight-ahead offset now, at the truck's mean load, from all its drives together"),
    "offset_sd_deg": ("number", "its standard deviation, pull and accelerometer bias included"),
    "offset_low_deg": ("number", "lower end of the 95 % interval that decides: without a pull if valid, else with it"),
    "offset_high_deg": ("number", "its upper end"),
    "offset_is_valid": ("truth", "the number is exact enough to be set"),
    "offset_spread_sd_deg": (
        "number",
        "the same from the drives since the last change, without pull and bias",
    ),
    "pull_m_s2": ("number", "neutral lateral acceleration minus accelerometer bias"),
    "pull_sd_m_s2": ("number", "its standard deviation; the prior's where the pull is not identified"),
    "accelerometer_bias_m_s2": ("number", "accelerometer bias now"),
    "accelerometer_bias_sd_m_s2": ("number", "its standard deviation"),
    "load_would_help": (
        "truth",
        "all drives were at one load; another load separates pull and accelerometer bias",
    ),
    **{
        column: ("number", about)
        for quantity in QUANTITIES[1:]
        for column, about in ((quantity.value, f"{quantity.about}; now"), (quantity.sd, "its standard deviation"))
    },
    "cause": ("text", "cause of the last change of the offset"),
    "vehicle_file": ("text", "vehicle file of the last drive"),
}


class TableFile:
    """A Parquet file, see `whole_file`: it replaces the previous one when all rows are written.

    polars writes a file as a whole. So a long table is written in parts beside the file, which are then joined as a
    stream: memory holds one part.
    """

    def __init__(self, path: Path, columns: Mapping[str, tuple[str, str]]) -> None:
        self._path = path
        self._types = {name: _TYPES[kind] for name, (kind, _) in columns.items()}
        self._rows: list[Row] = []
        self._parts: list[Path] = []

    def __enter__(self) -> TableFile:
        with ExitStack() as opened:
            self._unfinished = opened.enter_context(whole_file(self._path))
            opened.callback(self._remove_parts)
            opened.push(self._write_the_file)
            self._opened = opened.pop_all()
        return self

    def add(self, row: Row) -> None:
        self._rows.append(row)
        if len(self._rows) == _ROWS_AT_ONCE:
            self._write_part()

    def _write_part(self) -> None:
        """Beside the unfinished file, by whose name `remove_unfinished` finds it if this process is killed."""
        part = self._unfinished.with_suffix(f".{len(self._parts)}")
        self._parts.append(part)
        self._table().write_parquet(part)
        self._rows.clear()

    def _table(self) -> pl.DataFrame:
        of_column = {name: [row.get(name) for row in self._rows] for name in self._types}
        for name, type_ in self._types.items():
            if isinstance(type_, pl.Datetime):
                of_column[name] = [_milliseconds(time_s) for time_s in of_column[name]]
        return pl.DataFrame(of_column, self._types)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._opened.__exit__(kind, error, where)

    def _write_the_file(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            return
        if not self._parts:
            self._table().write_parquet(self._unfinished, metadata=metadata("fleet"))
            return
        self._write_part()
        pl.scan_parquet(self._parts, glob=False).sink_parquet(
            self._unfinished, row_group_size=_ROWS_AT_ONCE, metadata=metadata("fleet")
        )

    def _remove_parts(self) -> None:
        for part in self._parts:
            part.unlink(missing_ok=True)


def _milliseconds(time_s: float | None) -> int | None:
    return None if time_s is None else round(time_s * 1000.0)
