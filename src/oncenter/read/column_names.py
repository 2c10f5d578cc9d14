"""The columns of a table's file with their units, without reading its rows."""

from __future__ import annotations

import csv
from pathlib import Path

from oncenter.read.csv_text import csv_text, separator_of
from oncenter.read.units import is_unit


def column_names(path: Path) -> dict[str, str]:
    """The unit of each column by a row of units below the header, else ""; empty for a file that is no CSV or Parquet.

    Raises:
        OncenterError: the file cannot be read.
    """
    name = path.name.lower()
    if name.endswith(".parquet"):
        return dict.fromkeys(_of_parquet(path), "")
    return _of_csv(path) if name.endswith((".csv", ".csv.gz")) else {}


def _of_parquet(path: Path) -> list[str]:
    import polars as pl

    from oncenter.read.tabular import for_polars
    from oncenter.read.wording import cannot_read

    try:
        return list(pl.read_parquet_schema(for_polars(path)))
    except (pl.exceptions.PolarsError, OSError) as error:
        raise cannot_read(path, error) from error


def _of_csv(path: Path) -> dict[str, str]:
    text = csv_text(path)
    lines = text.split(b"\n", 2)[:2]
    header, *below = csv.reader([line.decode("utf-8", "replace") for line in lines], delimiter=separator_of(text))
    units = below[0] if below and sum(is_unit(cell) for cell in below[0]) >= 2 else []
    padded = [*units, *[""] * (len(header) - len(units))]
    return {name.strip(): unit.strip() for name, unit in zip(header, padded, strict=False)}
