"""oncenter angle: the steering wheel angle with and without its sensor, as a table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from oncenter.cli.options import Dbc, Source, VehicleFile, progress_bar, sources_of
from oncenter.files.log_formats import SUFFIXES

if TYPE_CHECKING:
    import oncenter as oc
    from oncenter.findings import Finding
    from oncenter.memory import TruckMemory

_SHARE_MIN = 0.01  # of a drive; a smaller share is not printed as a number
_WITHIN_MAX_DEG = 90.0  # a wider interval says nothing about the angle
_NOT_OBSERVABLE = "angle not observable: the truck stands, or its motion signals are missing"
_REAR_AXLE_STEERS = "angle not observable: a rear axle steers, and the zero of its sensor is not given"


Log = Annotated[Path, typer.Argument(metavar="LOG", readable=False, help=f"A log: {' '.join(SUFFIXES)}")]
LostAt = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="Ignore the sensor from this time on, counted from the begin of the log."),
]
Output = Annotated[
    Path | None, typer.Option(metavar="OUT.parquet", help="Write the table to this file, .parquet or .csv.")
]
Report = Annotated[Path | None, typer.Option(metavar="OUT.html", help="Write a report: one HTML page.")]
Method = Annotated[
    Literal["observer", "wheel-speed", "wheel-speed-exact", "yaw-rate", "yaw-rate-understeer", "side-slip"],
    typer.Option(help="Method: the observer, or one of the estimators of the thesis (chapter 4)."),
]
TaughtBy = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="LOG",
        help="Log of an earlier drive of the same truck, to learn its offset, play and ratio. Repeat the option for "
        "several logs.",
    ),
]
Memory = Annotated[
    Path | None,
    typer.Option(
        metavar="TRUCK.toml",
        help="Memory of earlier drives of this truck, as offset --memory keeps it: its offset, play and gradient hold "
        "until this drive shows more. For a sensor that is lost before the drive begins.",
    ),
]
Smooth = Annotated[
    bool,
    typer.Option(
        "--smooth", help="Use the whole log for each instant, the time after it as well; not possible in a truck."
    ),
]


def angle(
    log: Log,
    vehicle_file: VehicleFile,
    sensor_lost_at: LostAt = None,
    output: Output = None,
    report: Report = None,
    method: Method = "observer",
    taught_by: TaughtBy = None,
    memory: Memory = None,
    smooth: Smooth = False,
    dbc: Dbc = None,
    source: Source = None,
) -> None:
    """Estimate the angle with and without its sensor.

    The sensor is used while it is valid; after a fault, or after --sensor-lost-at, the other signals replace it.
    """
    import oncenter as oc
    from oncenter.angle.run import findings_on, in_degrees, notes_on
    from oncenter.cli.logs import read_log, read_logs
    from oncenter.cli.overwriting import spare_inputs
    from oncenter.cli.places import logs_named
    from oncenter.errors import WRONG_USAGE, OncenterError
    from oncenter.files.own_file import metadata
    from oncenter.files.whole_file import check_place, whole_file
    from oncenter.memory.answer import not_counted
    from oncenter.offset.inputs import params_of
    from oncenter.offset.rear_axle import is_combined
    from oncenter.report import check_report, report_angle

    if output is not None and output.suffix not in (".parquet", ".csv"):
        raise OncenterError(
            f"--output takes a .parquet or .csv file, got {output.name}", code="output", exit_code=WRONG_USAGE
        )
    outputs = {"--output": output, "--report": report}
    spare_inputs(outputs, [log, *(taught_by or ()), vehicle_file, *(dbc or ())])
    truck = oc.vehicle(vehicle_file)
    known = _remembered(memory, truck)
    before = known.rows_of(truck)
    spare_inputs(outputs, [*truck.dbc, *filter(None, [memory])])
    if output is not None:
        check_place(output)
    if report is not None:
        check_report(report, "--report")
    drive = read_log(log, truck, dbc or (), sources_of(source))
    earlier = logs_named(taught_by or ())
    options = dbc or (), sources_of(source)
    taught, left_out = read_logs(earlier, truck, *options, events=known.events) if taught_by else ([], [])
    with progress_bar("estimating", log) as progress:
        table = oc.angle(
            drive,
            truck,
            sensor_lost_at=sensor_lost_at,
            method=method,
            taught_by=taught,
            before=before,
            events=known.events,
            smooth=smooth,
            progress=progress,
        )
    unused = not_counted(len(known.drives) - len(before))
    notes = [*notes_on(drive, truck, taught, sensor_lost_at), *filter(None, [unused])]
    why = _REAR_AXLE_STEERS if is_combined(params_of(truck, None)) else _NOT_OBSERVABLE
    findings = (*findings_on(drive, truck, taught), *left_out)
    typer.echo(
        "\n".join([_in_words(table, why), *_asides(findings, notes)])
    )  # before the files, which a full disk may prevent
    if output is not None:
        with whole_file(output) as unfinished:
            given = in_degrees(table)
            if output.suffix == ".csv":
                given.write_csv(unfinished)
            else:
                given.write_parquet(unfinished, metadata=metadata("angle"))
    if report is not None:
        report_angle(
            table,
            drive,
            truck,
            report,
            method=method,
            sensor_lost_at=sensor_lost_at,
            smooth=smooth,
            taught_by=taught,
        )


def _asides(findings: Sequence[Finding], notes: Sequence[str]) -> list[str]:
    """Findings and notes on the logs, below an empty line."""
    lines = [f"  {finding.line()}" for finding in findings]
    lines += [f"  note: {note}" for note in notes]
    return ["", *lines] if lines else []


def _remembered(memory: Path | None, truck: oc.Vehicle) -> TruckMemory:
    """
    Raises:
        OncenterError: "memory_file", exit code 2: there is no such file, or as `oncenter.memory.read_memory`.
    """
    from oncenter.errors import WRONG_USAGE, OncenterError
    from oncenter.memory import TruckMemory, read_memory

    if memory is None:
        return TruckMemory(truck.name)
    if not memory.exists():
        raise OncenterError(
            f"memory file {memory} does not exist: make it by oncenter offset LOG --vehicle FILE --memory {memory}",
            code="memory_file",
            exit_code=WRONG_USAGE,
        )
    return read_memory(memory, truck.name)


def _in_words(table: object, why: str = _NOT_OBSERVABLE) -> str:
    """The share and the accuracy of each status of the angle; then faults of the sensor."""
    import polars as pl

    from oncenter.signals import DEGREE

    assert isinstance(table, pl.DataFrame)
    lines = []
    for name in table["status"].unique(maintain_order=True):
        rows = table.filter(pl.col("status") == name)
        sd = rows["standard_deviation_rad"].median()
        assert isinstance(sd, float)
        within_deg, share = 0.67 * sd / DEGREE, len(rows) / len(table)
        how_much = f"{share:.0%}" if share >= _SHARE_MIN else f"less than {_SHARE_MIN:.0%}"
        how_well = f"half of it within {within_deg:.1f} deg" if within_deg < _WITHIN_MAX_DEG else why
        lines.append(f"{name}: {how_much} of the drive, {how_well}")
    begin_s = table["time_s"][0]
    faults = table.filter(pl.col("sensor_fault") != "none").group_by("sensor_fault", maintain_order=True).first()
    for fault in faults.iter_rows(named=True):
        what = fault["sensor_fault"].replace("_", " ")
        since_s, found_s = fault["sensor_fault_since_s"] - begin_s, fault["time_s"] - begin_s
        lines.append(f"sensor {what} since {since_s:.1f} s, found at {found_s:.1f} s")
    return "\n".join(lines)
