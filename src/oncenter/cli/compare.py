"""oncenter compare: what a calibration or a repair changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from oncenter.cli.options import Dbc, Json, Source, sources_of

if TYPE_CHECKING:
    from oncenter.offset.compare import Offset


def compare(
    before: Annotated[
        Path, typer.Argument(metavar="BEFORE", help="The answer (.json) or the log of the drive before it.")
    ],
    after: Annotated[Path, typer.Argument(metavar="AFTER", help="The same of the drive after it.")],
    vehicle_file: Annotated[
        str | None, typer.Option("--vehicle", metavar="FILE", help="The truck's vehicle file; needed for logs.")
    ] = None,
    limit: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            min=0.1,
            max=30.0,  # oncenter.vehicle_keys
            help="The offset from which a truck is recalibrated, in place of the limit in AFTER or its vehicle file.",
        ),
    ] = None,
    in_given_order: Annotated[
        bool,
        typer.Option("--in-given-order", help="BEFORE was driven first: for drives without start times."),
    ] = False,
    report: Annotated[
        Path | None, typer.Option(metavar="OUT.html", help="Write a certificate: one page to print and to sign.")
    ] = None,
    json: Json = False,
    dbc: Dbc = None,
    source: Source = None,
) -> None:
    """Check a calibration or a repair: compare the offsets of one truck before and after it.

    The start times of the drives give their order.

    BEFORE and AFTER are answers that `oncenter offset LOG --vehicle FILE --json > before.json` wrote, or logs.
    """
    from oncenter.offset.compare import compared, in_order

    if report is not None:
        from oncenter.cli.overwriting import spare_inputs
        from oncenter.report import check_report

        spare_inputs({"--report": report}, [before, after, vehicle_file])
        check_report(report, "--report")
    take = sources_of(source)
    one, other = (_offset(place, vehicle_file, dbc or (), take) for place in (before, after))
    first, second = (one, other) if in_given_order else in_order(one, other)
    comparison = compared(first, second, second.limit_deg if limit is None else limit)
    typer.echo(comparison.to_json() if json else str(comparison))
    if report is not None:
        from oncenter.report import report_comparison

        report_comparison(comparison, report)


def _offset(place: Path, vehicle_file: str | None, dbc: Sequence[Path], take: Mapping[str, str]) -> Offset:
    """The offset of an answer's file, or of a log.

    Raises:
        OncenterError: "usage", exit code 2: a log without --vehicle; else as `offset_of` or `oncenter.offset`.
    """
    import oncenter as oc
    from oncenter.cli.logs import read_log
    from oncenter.errors import WRONG_USAGE, OncenterError
    from oncenter.offset.compare import offset_of, read_answer

    if place.suffix.lower() == ".json":
        return offset_of(read_answer(place), str(place))
    if vehicle_file is None:
        raise OncenterError(
            f"{place} is a log, which needs --vehicle FILE; or compare two answers (.json)",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    truck = oc.vehicle(vehicle_file)
    answer = oc.offset(read_log(place, truck, dbc or truck.databases(), take), truck)
    return replace(offset_of(answer.to_dict(), str(place)), limit_deg=truck.offset_limit_deg)
