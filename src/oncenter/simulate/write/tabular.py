"""The table of signals as CSV and Parquet; the columns' names say their units."""

from __future__ import annotations

import gzip
import io
from pathlib import Path

import polars as pl


def write_csv(table: pl.DataFrame, path: Path) -> None:
    table.write_csv(path)


def write_csv_gz(table: pl.DataFrame, path: Path) -> None:
    """Without the time of day that gzip's header would hold."""
    text = io.BytesIO()
    table.write_csv(text)
    path.write_bytes(gzip.compress(text.getvalue(), compresslevel=6, mtime=0))


def write_parquet(table: pl.DataFrame, path: Path) -> None:
    table.write_parquet(path)
