"""oncenter fleet: many trucks, many logs, every night."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from oncenter.cli.options import Json
from oncenter.errors import INTERRUPTED, WRONG_USAGE, OncenterError

if TYPE_CHECKING:
    from oncenter.fleet import Summary

_POISONOUS_SHOWN = 20

fleet = typer.Typer(name="fleet")

Output = Annotated[Path, typer.Option(metavar="DIR", help="Tables and page: a folder that a run made or makes.")]


@fleet.callback(invoke_without_command=True)
def _fleet(context: typer.Context) -> None:
    """Which trucks of a fleet need a calibration, since when, and how sure that is."""
    if context.invoked_subcommand is None:
        raise OncenterError(
            "fleet what: oncenter fleet run, or oncenter fleet query", code="usage", exit_code=WRONG_USAGE
        )


@fleet.command(epilog="Example: oncenter fleet run logs --vehicles vehicles --output fleet")
def run(
    logs: Annotated[list[str], typer.Argument(metavar="LOG…", help="Logs, folders of them, s3://bucket/folder.")],
    vehicles: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Vehicle files: NAME.toml is of the truck NAME, or of VINs that begin so."),
    ],
    output: Output,
    engine: Annotated[
        Literal["processes", "ray"], typer.Option(help="This machine's cores, or a Ray cluster.")
    ] = "processes",
    address: Annotated[str | None, typer.Option(help="Of the Ray cluster; without it one of this machine.")] = None,
    limit: Annotated[
        float, typer.Option(metavar="DEG", help="The offset, either sign, beyond which a truck needs a calibration.")
    ] = 2.0,
    reports: Annotated[bool, typer.Option("--reports", help="A page for each drive as well, some 2 MB.")] = False,
    retry: Annotated[
        bool, typer.Option("--retry", help="Read again the logs at which a reader crashed or was stopped.")
    ] = False,
    json: Json = False,
) -> None:
    """Answer all logs that are new, rank the trucks, and write tables and page anew."""
    from oncenter.fleet import run as run_night  # first: it asks for the extra
    from oncenter.fleet.engines import on_ray, processes

    if address is not None and engine != "ray":
        raise OncenterError("--address is of --engine ray", code="usage", exit_code=WRONG_USAGE)
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
            "interrupted; what was put down is kept, the next run goes on from there",
            code="interrupted",
            exit_code=INTERRUPTED,
        ) from None
    typer.echo((output / "metrics.json").read_text(encoding="utf-8").rstrip() if json else in_words(summary))


@fleet.command(epilog='Example: oncenter fleet query "select truck, verdict from trucks" --output fleet')
def query(
    sql: Annotated[str, typer.Argument(metavar="SQL", help="One SELECT on drives, trucks, changes.")],
    output: Output,
    json: Json = False,
) -> None:
    """Ask a fleet's tables in SQL (polars')."""
    import polars as pl

    from oncenter.fleet.sql import query as ask

    result = ask(sql, output)
    if json:
        typer.echo(f'{{"schema": "oncenter/query-1", "rows": {result.write_json()}}}')
        return
    with pl.Config(tbl_rows=50, tbl_cols=-1, tbl_hide_dataframe_shape=True, tbl_hide_column_data_types=True):
        typer.echo(str(result))


def in_words(summary: Summary) -> str:
    """What was done, what stands, and which trucks come first, in less than a screen."""
    verdicts = ", ".join(f"{count} {name}" for name, count in summary.verdicts.items() if count) or "none is judged"
    lines = [
        f"{summary.logs_found} logs: {summary.logs_answered} answered now, {summary.logs_refused} refused, "
        f"{summary.logs_found - summary.logs_answered - summary.logs_refused} known before; "
        f"{summary.logs_per_second:.1f} logs/s, {summary.seconds:.0f} s",
        f"{summary.trucks} trucks, {summary.drives} drives: {verdicts}; "
        f"{summary.changes_of_offset} changes of an offset",
    ]
    if summary.refused:
        codes = ", ".join(f"{count} {code}" for code, count in summary.refused.items())
        lines.append(f"logs without an answer: {codes}")
    shown = summary.poisonous[:_POISONOUS_SHOWN]
    lines += [f"skipped, readers crash or hang at it: {each['error']}" for each in shown]
    if len(summary.poisonous) > len(shown):
        lines.append(f"skipped as well: {len(summary.poisonous) - len(shown)} more, named in drives.parquet")
    named = [row for row in summary.worst if row["verdict"] in ("calibrate", "watch", "undecided")]
    if named:
        lines += ["", f"  {'truck':24}{'verdict':11}{'offset, 95 %':>24}   {'since':12}{'q':>8}"]
        lines += [line for row in named for line in _lines(row)]
    return "\n".join([*lines, "", f"wrote {Path(summary.output) / 'index.html'}"])


def _lines(row: dict[str, Any]) -> list[str]:
    from oncenter.utc import utc

    value, half = row["offset_deg"], 1.96 * row["offset_sd_deg"]
    offset = f"{value:+.1f} deg, {value - half:+.1f} to {value + half:+.1f}"
    since = f"{utc(row['since']):%Y-%m-%d}" if row["changes"] else "its first"
    line = f"  {row['truck'][:22]:24}{row['verdict']:11}{offset:>24}   {since:12}{row['q_value']:8.2g}"
    decides = row.get("would_decide")
    return [line, f"    would decide: {decides}"] if decides else [line]
