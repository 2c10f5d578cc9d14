"""Writes the table of signals as CSV and Parquet; column names contain the units."""

from __future__ import annotations

import gzip
import io
from pathlib import Path

import polars as pl


def write_csv(table: pl.DataFrame, path: Path) -> None:
    table.write_csv(path)


def write_csv_gz(table: pl.DataFrame, path: Path) -> None:
    """Writes the table without a time stamp in the gzip header."""
    text = io.BytesIO()
    table.write_csv(text)
    path.write_bytes(gzip.compress(text.getvalue(), compresslevel=6, mtime=0))


def write_parquet(table: pl.DataFrame, path: Path) -> None:
    table.write_parquet(path)
