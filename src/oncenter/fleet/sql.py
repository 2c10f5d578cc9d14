"""SQL over a fleet's tables, by polars."""

from __future__ import annotations

import io
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.child import ChildDied, borrowed, limits_for

if TYPE_CHECKING:
    import polars as pl

TABLES = ("drives", "trucks", "changes")

# Codes of the column verdict in former versions, accepted for one release, and what to write now.
_OLD_CODES = {
    "calibrate": "verdict = 'recalibrate' AND NOT watch",
    "watch": "watch",
    "fine": "verdict = 'within' AND NOT watch",
    "unknown": "p_value IS NULL",
}
_OLD_CODE = re.compile(rf"'({'|'.join(_OLD_CODES)})'")
_VERDICT = re.compile(r"\bverdict\b", re.IGNORECASE)

_CHILD = "oncenter.fleet.sql_child"
_ENDS = {  # by code of `ChildDied`
    "reader_crashed": "polars crashes at it: write it shorter",
    "reader_time": "it takes too long for tables of this size",
    "reader_memory": "it takes too much memory for tables of this size",
    "stopped": "it was stopped from outside",
}

_READ = ("SELECT", "WITH", "FROM", "VALUES", "SHOW", "EXPLAIN")  # how a query may begin
_FIRST_WORD = re.compile(r"(?:\s|;|\(|--[^\n]*(?:\n|$)|/\*.*?\*/)*(\w*)", re.DOTALL)

# Polars' table functions read any file: read_csv(, "read_parquet" (, READ_IPC/* */(. A call in a string or a comment is
# refused as well, so that this check does not depend on polars' quoting rules.
_CALL_THAT_READS = re.compile(r"\bread_\w*(?=[\"`]?\s*[(/#-])", re.IGNORECASE)


def query(sql: str, output: str | os.PathLike[str]) -> pl.DataFrame:
    """The result of one SELECT on the tables drives, trucks and changes of an output folder, and on no other file.

    A child process runs it: a query may crash polars or take any memory.

    Raises:
        OncenterError: "output", exit code 2: the folder has no tables of a run. "sql", exit code 2: it is no query, it
            reads another file, polars refuses it, or it takes more time or memory than tables of this size need.
    """
    try:
        with borrowed(_CHILD) as child:
            answer = child.ask({"sql": sql, "output": os.fspath(output)}, limits_for(_size(Path(output))))
            import polars as pl  # it loads while the child works

            *_, (_, packed) = answer
    except ChildDied as died:
        raise _refusal(_ENDS[died.code]) from None
    return pl.read_ipc(io.BytesIO(packed))


def _size(folder: Path) -> int:
    try:
        return sum((folder / f"{name}.parquet").stat().st_size for name in TABLES)
    except OSError:  # the query says which is missing
        return 0


def result_of(sql: str, folder: Path) -> pl.DataFrame:
    """As `query`, in this process."""
    import polars as pl

    _refuse_what_is_no_query(sql)
    _refuse_other_files(sql)
    missing = [name for name in TABLES if not (folder / f"{name}.parquet").is_file()]
    if missing:
        raise OncenterError(
            f"no {missing[0]}.parquet in {folder}: write it with oncenter fleet run … --output {folder}",
            code="output",
            exit_code=WRONG_USAGE,
        )
    tables = {name: pl.scan_parquet(folder / f"{name}.parquet", glob=False) for name in TABLES}
    tables["trucks"] = _trucks(tables["trucks"], in_old_codes=bool(_old_codes(sql)))
    try:
        return pl.SQLContext(frames=tables, eager=False).execute(sql).collect()
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, ValueError, TypeError) as error:
        raise _refusal(" ".join(str(error).split())[:300]) from None


def notes_on(sql: str) -> list[str]:
    """A line for each old code of the column verdict in a query."""
    return [
        f"'{code}' is an old code of the column verdict, which this query still gets in the old codes; the next "
        f"release does not accept it: write {_OLD_CODES[code]}"
        for code in _old_codes(sql)
    ]


def _old_codes(sql: str) -> list[str]:
    return list(dict.fromkeys(_OLD_CODE.findall(sql))) if _VERDICT.search(sql) else []


def _trucks(table: pl.LazyFrame, *, in_old_codes: bool) -> pl.LazyFrame:
    """The table trucks with the codes that the query has, whichever version wrote it."""
    import polars as pl

    if "watch" not in table.collect_schema().names():  # a former version wrote it
        return table if in_old_codes else table.with_columns(verdict=pl.col("state"))
    if not in_old_codes:
        return table
    watch = pl.col("watch")
    old = (
        pl.when(pl.col("p_value").is_null())
        .then(pl.lit("unknown"))
        .when(watch)
        .then(pl.lit("watch"))
        .when(pl.col("verdict") == "recalibrate")
        .then(pl.lit("calibrate"))
        .when(pl.col("verdict") == "within")
        .then(pl.lit("fine"))
        .otherwise(pl.lit("undecided"))
    )
    return table.with_columns(verdict=old)


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
