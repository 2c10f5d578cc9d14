"""oncenter fleet: many trucks, many logs, every night."""

from __future__ import annotations

from pathlib import Path
from shutil import get_terminal_size
from typing import Annotated, Literal

import typer

from oncenter.cli.options import Json
from oncenter.errors import INTERRUPTED, WRONG_USAGE, OncenterError

_STDOUT = "-"
_WIDTH = 100  # of a table, where there is no terminal
_ROWS_SHOWN = 50

fleet = typer.Typer(name="fleet")

Output = Annotated[Path, typer.Option(metavar="DIR", help="Folder of the tables and the page; made if missing.")]
Tables = Annotated[Path, typer.Option("--output", metavar="DIR", help="Folder that oncenter fleet run has written.")]


@fleet.callback(invoke_without_command=True)
def _fleet(context: typer.Context) -> None:
    """Find the trucks of a fleet that need a calibration, since when, and how certain that is."""
    if context.invoked_subcommand is None:
        raise OncenterError(
            "fleet needs a command: oncenter fleet run, trucks, remove, event, priors or query",
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
    fail_on: Annotated[
        str | None,
        typer.Option(
            metavar="KIND,…",
            help="Exit with code 3 for one of these: new-calibrate, new-fault, unread, new-unread, damaged.",
        ),
    ] = None,
    metrics: Annotated[
        Path | None, typer.Option(metavar="FILE.prom", help="Write the run's numbers for Prometheus as well.")
    ] = None,
    json: Json = False,
) -> None:
    """Answer all new logs, rank the trucks, and write the tables and the page."""
    from oncenter.cli.fail_on import fail_on_kinds, kinds_of
    from oncenter.files.whole_file import check_place
    from oncenter.fleet import run as run_night  # first: it checks that the extra is installed
    from oncenter.fleet.engines import on_ray, processes
    from oncenter.fleet.news import KINDS

    failing = kinds_of(fail_on, KINDS)
    if metrics is not None:
        check_place(metrics)
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
    from oncenter.fleet.end_of_run import in_words
    from oncenter.fleet.metrics import write_metrics

    if metrics is not None:
        write_metrics(metrics, summary)
    typer.echo((output / "metrics.json").read_text(encoding="utf-8").rstrip() if json else in_words(summary))
    named = {kind: each["names"] for kind, each in summary.kinds.items()}
    fail_on_kinds({kind: each["count"] for kind, each in summary.kinds.items()}, failing, named)


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


@fleet.command(epilog="Example: oncenter fleet remove logs/T07/wrong.mf4 --output fleet")
def remove(
    log: Annotated[str, typer.Argument(metavar="LOG", help="The log, as the column log of the table drives names it.")],
    output: Tables,
    undo: Annotated[
        bool, typer.Option("--undo", help="Count the drive again: one that was removed, or whose log is gone.")
    ] = False,
) -> None:
    """Leave a drive out, with its copies: it counts no longer from the next run on."""
    from oncenter.files.file_name import printable_name
    from oncenter.fleet.ledger import ledger_in
    from oncenter.fleet.night import absolute

    name = printable_name(absolute(log))
    with ledger_in(output) as ledger:
        trucks = ledger.take_back(name) if undo else ledger.remove(name)
    counts = "counts again" if undo else "no longer counts"
    typer.echo(f"{name} {counts} for truck {' and '.join(trucks)}, from the next oncenter fleet run on")


@fleet.command(epilog="Example: oncenter fleet event T07 calibrated --date 2026-03-02 --by -3.4 --output fleet")
def event(
    truck: Annotated[str, typer.Argument(metavar="TRUCK", help="The truck, as oncenter fleet trucks names it.")],
    output: Tables,
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND",
            help="calibrated: a correction was set; repaired: play or steering; changed: sensor or wheels; "
            "another_truck: logs from then on are of another truck.",
        ),
    ] = "",
    date: Annotated[
        str, typer.Option(metavar="DATE", help="2026-03-02 or 2026-03-02T07:00, UTC or with +01:00 after it.")
    ] = "",
    by: Annotated[
        float | None, typer.Option(metavar="DEG", help="The angle that the calibration added to the sensor's reading.")
    ] = None,
    events: Annotated[bool, typer.Option("--list", help="List the events of the truck.")] = False,
    remove: Annotated[bool, typer.Option("--remove", help="Remove this event.")] = False,
) -> None:
    """State a calibration, a repair or another event of a truck, which its drives alone do not show."""
    from oncenter.fleet.ledger import ledger_in
    from oncenter.truck.events import event_of

    if not events and not date:
        raise OncenterError(
            "an event needs a kind and a date: oncenter fleet event TRUCK KIND --date DATE, with KIND one of "
            "calibrated, repaired, changed, another_truck",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    stated = None if events else event_of(kind, date, by)
    with ledger_in(output) as ledger:
        ledger.require_truck(truck)
        if stated is None:
            lines = list(map(str, ledger.events_of(truck)))
        elif remove:
            ledger.forget(truck, stated)
            lines = [f"{stated}: removed from truck {truck}, from the next oncenter fleet run on"]
        else:
            ledger.state(truck, stated)
            lines = [f"{stated}: stated of truck {truck}, from the next oncenter fleet run on"]
    typer.echo("\n".join(lines) or f"no events of truck {truck}")


@fleet.command(epilog="Example: oncenter fleet priors fleet --output fleet_priors.toml")
def priors(
    tables: Annotated[Path, typer.Argument(metavar="FLEET", help="Folder that oncenter fleet run has written.")],
    output: Annotated[
        Path, typer.Option("--output", metavar="FILE", help="The file to write, which vehicle files name in [priors].")
    ] = Path("fleet_priors.toml"),
) -> None:
    """Learn the priors of pull, play, understeer gradient and axle set-up from trucks driven at several loads."""
    from oncenter.fleet.priors import write_priors

    typer.echo(write_priors(tables, output))


@fleet.command(epilog='Example: oncenter fleet query "select truck, verdict from trucks" --output fleet')
def query(
    sql: Annotated[str, typer.Argument(metavar="SQL", help="One SELECT on the tables drives, trucks, changes.")],
    output: Tables,
    csv: Annotated[
        str | None, typer.Option("--csv", metavar="FILE", help="Write CSV for a spreadsheet instead; - is stdout.")
    ] = None,
    parquet: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a Parquet file instead, with types and all digits.")
    ] = None,
    json: Json = False,
) -> None:
    """Run an SQL query (polars' dialect) on the fleet's tables."""
    from oncenter.fleet.sql import notes_on
    from oncenter.fleet.sql import query as ask

    if sum((csv is not None, parquet is not None, json)) > 1:
        raise OncenterError("--csv, --parquet and --json exclude each other", code="usage", exit_code=WRONG_USAGE)
    result = ask(sql, output)
    from oncenter.fleet.listing import as_csv, as_lines, write_csv, write_parquet  # polars loads while the child works

    for note in notes_on(sql):
        typer.echo(f"note: {note}", err=True)
    if json:
        typer.echo(f'{{"schema": "oncenter/query-1", "rows": {result.write_json()}}}')
    elif parquet is not None:
        write_parquet(parquet, result)
    elif csv == _STDOUT:
        typer.echo(as_csv(result.to_dicts(), "\n", result.columns), nl=False)
    elif csv is not None:
        write_csv(Path(csv), result.to_dicts(), result.columns)
    else:
        width = get_terminal_size((_WIDTH, 24)).columns
        typer.echo("\n".join(as_lines(result.head(_ROWS_SHOWN).to_dicts(), result.columns, width)))
        if result.height > _ROWS_SHOWN:
            typer.echo(f"{result.height - _ROWS_SHOWN} more rows: --csv, --parquet or --json gives all", err=True)
