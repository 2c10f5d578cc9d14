"""oncenter fleet: many trucks, many logs, every night."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from oncenter.cli.options import Json
from oncenter.errors import INTERRUPTED, WRONG_USAGE, OncenterError

if TYPE_CHECKING:
    from oncenter.fleet import Summary

_POISONOUS_SHOWN = 20
_STDOUT = "-"

fleet = typer.Typer(name="fleet")

Output = Annotated[Path, typer.Option(metavar="DIR", help="Folder of the tables and the page; made if missing.")]
Tables = Annotated[Path, typer.Option("--output", metavar="DIR", help="Folder that oncenter fleet run has written.")]


@fleet.callback(invoke_without_command=True)
def _fleet(context: typer.Context) -> None:
    """Find the trucks of a fleet that need a calibration, since when, and how certain that is."""
    if context.invoked_subcommand is None:
        raise OncenterError(
            "fleet needs a command: oncenter fleet run, fleet trucks or fleet query",
            code="usage",
            exit_code=WRONG_USAGE,
        )


@fleet.command(epilog="Example: oncenter fleet run logs --vehicles vehicles --output fleet")
def run(
    logs: Annotated[list[str], typer.Argument(metavar="LOG…", help="Logs, folders of logs, s3://bucket/folder.")],
    vehicles: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Vehicle files: NAME.toml is for the truck NAME and for VINs that begin so."),
    ],
    output: Output,
    engine: Annotated[
        Literal["processes", "ray"], typer.Option(help="The cores of this machine, or a Ray cluster.")
    ] = "processes",
    address: Annotated[
        str | None, typer.Option(help="Address of a running Ray cluster; without it one is started on this machine.")
    ] = None,
    limit: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Recalibrate beyond this offset, either sign; by default offset_limit_deg of each vehicle file.",
        ),
    ] = None,
    reports: Annotated[bool, typer.Option("--reports", help="Also write a report of each drive, about 2 MB.")] = False,
    retry: Annotated[
        bool, typer.Option("--retry", help="Read again the logs at which a reader crashed or was stopped.")
    ] = False,
    json: Json = False,
) -> None:
    """Answer all new logs, rank the trucks, and write the tables and the page."""
    from oncenter.fleet import run as run_night  # first: it checks that the extra is installed
    from oncenter.fleet.engines import on_ray, processes

    if address is not None and engine != "ray":
        raise OncenterError("--address needs --engine ray", code="usage", exit_code=WRONG_USAGE)
    try:
        summary = run_night(
            logs,
            vehicles,
            output,
            engine=on_ray(address) if engine == "ray" else processes,
            limit_deg=limit,
            reports=reports,
            retry=retry,
        )
    except KeyboardInterrupt:
        raise OncenterError(
            "interrupted; the answers so far are kept, and the next run continues from there",
            code="interrupted",
            exit_code=INTERRUPTED,
        ) from None
    typer.echo((output / "metrics.json").read_text(encoding="utf-8").rstrip() if json else in_words(summary))


@fleet.command(epilog="Example: oncenter fleet trucks --output fleet --csv trucks.csv")
def trucks(
    output: Tables,
    csv: Annotated[
        str | None,
        typer.Option("--csv", metavar="FILE", help="Write all columns of the ranking as CSV instead; - is stdout."),
    ] = None,
) -> None:
    """List the trucks by rank, with verdict, offset and next step."""
    from oncenter.fleet.listing import as_csv, as_text, ranked, write_csv

    rows = ranked(output)
    if csv is None:
        typer.echo(as_text(rows))
    elif csv == _STDOUT:
        typer.echo(as_csv(rows, "\n"), nl=False)
    else:
        write_csv(Path(csv), rows)


@fleet.command(epilog='Example: oncenter fleet query "select truck, verdict from trucks" --output fleet')
def query(
    sql: Annotated[str, typer.Argument(metavar="SQL", help="One SELECT on the tables drives, trucks, changes.")],
    output: Tables,
    json: Json = False,
) -> None:
    """Run an SQL query (polars' dialect) on the fleet's tables."""
    import polars as pl

    from oncenter.fleet.sql import notes_on
    from oncenter.fleet.sql import query as ask

    result = ask(sql, output)
    for note in notes_on(sql):
        typer.echo(f"note: {note}", err=True)
    if json:
        typer.echo(f'{{"schema": "oncenter/query-1", "rows": {result.write_json()}}}')
        return
    with pl.Config(tbl_rows=50, tbl_cols=-1, tbl_hide_dataframe_shape=True, tbl_hide_column_data_types=True):
        typer.echo(str(result))


def in_words(summary: Summary) -> str:
    """Counts of the run and of the fleet, and the first trucks of the ranking, on less than a screen."""
    from oncenter.fleet.listing import as_text
    from oncenter.verdict.states import OF_OFFSET

    counts = [(summary.states.get(code, 0), state.word) for code, state in OF_OFFSET.items()]
    states = ", ".join(f"{count} {word}" for count, word in counts if count)
    unchanged = summary.logs_found - summary.logs_answered - summary.logs_refused
    changes = "change" if summary.changes_of_offset == 1 else "changes"
    lines = [
        f"{summary.logs_found} logs: {summary.logs_answered} answered now, {summary.logs_refused} without an answer, "
        f"{unchanged} unchanged; {summary.logs_per_second:.1f} logs/s, {summary.seconds:.0f} s",
        f"{summary.trucks} trucks, {summary.drives} drives: {states or 'no truck'}; "
        f"{summary.changes_of_offset} {changes} of an offset",
    ]
    if summary.refused:
        codes = ", ".join(f"{count} {code}" for code, count in summary.refused.items())
        lines.append(f"logs without an answer: {codes}")
    shown = summary.poisonous[:_POISONOUS_SHOWN]
    lines += [f"skipped, a reader crashed or was stopped: {each['error']}" for each in shown]
    if len(summary.poisonous) > len(shown):
        lines.append(f"also skipped: {len(summary.poisonous) - len(shown)} more, see drives.parquet")
    first = [row for row in summary.worst if row["state"] not in ("within", "no_offset") or row["watch"]]
    if first:
        lines += ["", as_text(first)]
    page, tables = Path(summary.output) / "index.html", f"oncenter fleet trucks --output {summary.output}"
    return "\n".join([*lines, "", f"wrote {page}; all trucks: {tables}"])
