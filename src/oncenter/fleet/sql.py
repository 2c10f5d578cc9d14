"""SQL over a fleet's tables, by polars."""

from __future__ import annotations

import os
import re
from pathlib import Path

import polars as pl

from oncenter.errors import WRONG_USAGE, OncenterError

TABLES = ("drives", "trucks", "changes")

_READ = ("SELECT", "WITH", "FROM", "VALUES", "SHOW", "EXPLAIN")  # how a query may begin
_FIRST_WORD = re.compile(r"(?:\s|;|\(|--[^\n]*(?:\n|$)|/\*.*?\*/)*(\w*)", re.DOTALL)

# Polars' table functions read any file: read_csv(, "read_parquet" (, READ_IPC/* */(. A call in a string or a comment is
# refused as well, so that this check does not depend on polars' quoting rules.
_CALL_THAT_READS = re.compile(r"\bread_\w*(?=[\"`]?\s*[(/#-])", re.IGNORECASE)


def query(sql: str, output: str | os.PathLike[str]) -> pl.DataFrame:
    """The result of one SELECT on the tables drives, trucks and changes of an output folder, and on no other file.

    Raises:
        OncenterError: "output", exit code 2: the folder has no tables of a run. "sql", exit code 2: it is no query, it
            reads another file, or polars refuses it.
    """
    _refuse_what_is_no_query(sql)
    _refuse_other_files(sql)
    folder = Path(output)
    missing = [name for name in TABLES if not (folder / f"{name}.parquet").is_file()]
    if missing:
        raise OncenterError(
            f"no {missing[0]}.parquet in {folder}: write it with oncenter fleet run … --output {folder}",
            code="output",
            exit_code=WRONG_USAGE,
        )
    tables = {name: pl.scan_parquet(folder / f"{name}.parquet", glob=False) for name in TABLES}
    try:
        return pl.SQLContext(frames=tables, eager=False).execute(sql).collect()
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, ValueError, TypeError) as error:
        raise _refusal(" ".join(str(error).split())[:300]) from None


def _refuse_what_is_no_query(sql: str) -> None:
    """Polars would drop or empty its copy of a table and return no rows."""
    first = _FIRST_WORD.match(sql)
    word = first[1] if first is not None else ""
    if word.upper() not in _READ:
        raise _refusal(f"it begins with '{word}', not with SELECT")


def _refuse_other_files(sql: str) -> None:
    call = _CALL_THAT_READS.search(sql)
    if call is not None:
        raise _refusal(f"'{call[0]}' reads other files, but a query may read the fleet's tables only")


def _refusal(why: str) -> OncenterError:
    return OncenterError(f"cannot run the query: {why}; tables: {', '.join(TABLES)}", code="sql", exit_code=WRONG_USAGE)
