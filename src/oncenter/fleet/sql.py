"""SQL over a fleet's tables, by polars."""

from __future__ import annotations

import os
from pathlib import Path

import polars as pl

from oncenter.errors import WRONG_USAGE, OncenterError

TABLES = ("drives", "trucks", "changes")


def query(sql: str, output: str | os.PathLike[str]) -> pl.DataFrame:
    """The result of one SELECT on the tables drives, trucks and changes of an output folder.

    Raises:
        OncenterError: "output", exit code 2: no fleet was run there. "sql", exit code 2: polars refuses the query.
    """
    folder = Path(output)
    missing = [name for name in TABLES if not (folder / f"{name}.parquet").is_file()]
    if missing:
        raise OncenterError(
            f"no {missing[0]}.parquet in {folder}: oncenter fleet run … --output {folder} writes it",
            code="output",
            exit_code=WRONG_USAGE,
        )
    tables = {name: pl.scan_parquet(folder / f"{name}.parquet") for name in TABLES}
    try:
        return pl.SQLContext(frames=tables, eager=False).execute(sql).collect()
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())[:300]
        raise OncenterError(
            f"the query is refused: {reason}; tables are {', '.join(TABLES)}", code="sql", exit_code=WRONG_USAGE
        ) from None
