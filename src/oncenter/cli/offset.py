"""oncenter offset: the straight-ahead offset from logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from oncenter.cli.options import Dbc, FailOn, Json, Schema, Source, UnknownTruck, progress_bar, sources_of
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.log_formats import SUFFIXES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import oncenter as oc
    from oncenter.cli.places import Places
    from oncenter.estimates.estimates import Method
    from oncenter.memory import TruckMemory
    from oncenter.truck.events import Event


def offset(
    logs: Annotated[
        list[str],
        typer.Argument(
            metavar="LOG…",
            help=f"Logs of one truck, or a folder of them: {' '.join(SUFFIXES)}. From a folder oncenter takes all "
            "logs in it and in its subfolders, in order of their start times, or of their names if a log has none.",
        ),
    ],
    vehicle_file: UnknownTruck = None,
    each: Annotated[
        bool,
        typer.Option(
            "--each", help="Answer each log by itself, one line a log. Without it all logs must have the same VIN."
        ),
    ] = False,
    join: Annotated[
        bool,
        typer.Option(
            "--join",
            help="Put logs that overlap in time together: they are files of one drive, for example one for each bus.",
        ),
    ] = False,
    json: Json = False,
    schema: Schema = "offset-2",
    report: Annotated[Path | None, typer.Option(metavar="OUT.html", help="Write a report: one HTML page.")] = None,
    method: Annotated[
        Literal["joint", "thesis", "wheel-speed"],
        typer.Option(
            help="Method: joint estimates offset, play and biases together; thesis is the mean of the thesis; "
            "wheel-speed is the same with the yaw rate from wheel speeds."
        ),
    ] = "joint",
    no_accelerometer: Annotated[
        bool,
        typer.Option("--no-accelerometer", help="Use yaw rate and speed alone, without the lateral acceleration."),
    ] = False,
    applied: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Correction that the ECU already adds to the sensor's reading. It replaces that of the vehicle file.",
        ),
    ] = None,
    limit: Annotated[
        float | None,
        typer.Option(
            metavar="DEG",
            help="Recalibrate from an offset of this size on, either sign; in place of the vehicle file's "
            "offset_limit_deg, 2 where that has none.",
        ),
    ] = None,
    memory: Annotated[
        Path | None,
        typer.Option(
            metavar="TRUCK.toml",
            help="Memory of earlier drives of this truck: the answer is by them and these logs together, and these are "
            "added. A missing file is created.",
        ),
    ] = None,
    event: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND@DATE",
            help="What was done on the truck: calibrated@DATE=DEG (what was added to the reading, if known), "
            "repaired@DATE (play or steering), changed@DATE (sensor or wheels), another_truck@DATE. Repeat the option "
            "for several; --memory keeps them.",
        ),
    ] = None,
    fail_on: FailOn = None,
    dbc: Dbc = None,
    source: Source = None,
) -> None:
    """Estimate the straight-ahead offset of the angle sensor.

    The answer is the offset with its 95 % interval, the free play, biases of other sensors, and findings.
    """
    import oncenter as oc
    from oncenter.cli.each import answer_each
    from oncenter.cli.fail_on import fail_on_kinds, kinds_of
    from oncenter.cli.logs import read_log
    from oncenter.cli.places import logs_at
    from oncenter.truck.events import parse_event
    from oncenter.vehicle import JOINT_DOES, require_truck

    failing, take = kinds_of(fail_on), sources_of(source)
    if each:
        _refuse_of_one_answer({"--report": report, "--memory": memory, "--join": join, "--event": event})
    places = logs_at(logs)
    inputs = [*places.logs, *filter(None, [vehicle_file]), *(dbc or ())]
    truck = _truck(vehicle_file, inputs, report, memory, applied, limit)
    if method != "joint":
        require_truck(truck, f"method '{method}'", JOINT_DOES)  # before a long log is read
    params = {"use_accelerometer": 0.0} if no_accelerometer else None
    if each:
        databases = dbc or truck.databases()

        def one(log: Path) -> oc.Answer:
            return oc.offset(read_log(log, truck, databases, take), truck, method=method, params=params)

        logs_of = answer_each(places, one, schema if json else None)
        fail_on_kinds({status: len(some) for status, some in logs_of.items()}, failing, logs_of)
        return
    events = [parse_event(text) for text in event or ()]
    answer, after = _of_all(places, truck, dbc or (), take, method, params, memory, events, join)
    typer.echo(answer.to_json(schema) if json else as_table(answer))  # before a page that a full disk may refuse
    if memory is not None and after is not None:
        from oncenter.memory import write_memory

        write_memory(memory, after)
    if report is not None:
        oc.report(answer, report)
    fail_on_kinds({answer.offset.status: 1}, failing)


def _truck(
    vehicle_file: str | None,
    inputs: Sequence[str | Path],
    report: Path | None,
    memory: Path | None,
    applied: float | None,
    limit: float | None,
) -> oc.Vehicle:
    """The truck, after a check that each output has a place of its own."""
    from oncenter.cli.overwriting import spare_inputs
    from oncenter.files.whole_file import check_place
    from oncenter.report import check_report

    spare_inputs({"--memory": memory}, inputs)
    spare_inputs({"--report": report}, [*inputs, memory])
    refuse_one_place(report, memory)
    truck = with_limit(with_applied(vehicle_of(vehicle_file), applied), limit)
    spare_inputs({"--memory": memory, "--report": report}, truck.dbc)
    if report is not None:
        check_report(report, "--report")
    if memory is not None:
        check_place(memory)
    return truck


def _of_all(
    places: Places,
    truck: oc.Vehicle,
    dbc: Sequence[Path],
    take: Mapping[str, str],
    method: Method,
    params: dict[str, float] | None,
    memory: Path | None,
    events: Sequence[Event],
    join: bool,
) -> tuple[oc.Answer, TruckMemory | None]:
    """The answer of all logs together, and the memory after them if it has changed."""
    import oncenter as oc
    from oncenter.cli.logs import read_logs
    from oncenter.truck.events import with_stated

    before = None if memory is None else _remembered(memory, truck)
    stated = with_stated(() if before is None else before.events, events)
    drives, found = read_logs(places, truck, dbc, take, _wanted(method, truck, params), join, stated)
    with progress_bar("answering", *places.logs) as progress:
        if before is None:
            answer, after = (
                oc.offset(drives, truck, method=method, params=params, events=events, progress=progress),
                None,
            )
        else:
            from oncenter.memory import offset_with_memory

            answer, after = offset_with_memory(
                drives, truck, before, method=method, params=params, events=events, progress=progress
            )
    answer = replace(answer, findings=(*found, *answer.findings), notes=(*answer.notes, *places.notes))
    return answer, None if after == before else after


def _remembered(memory: Path, truck: oc.Vehicle) -> TruckMemory:
    from oncenter.memory import read_memory

    return read_memory(memory, truck.name)


def _wanted(method: Method, truck: oc.Vehicle, params: dict[str, float] | None) -> tuple[str, ...]:
    """Signals without which a log among others is left out; of wheel speeds, all logs together decide."""
    from oncenter.offset.inputs import needed, params_of

    if method == "wheel-speed":
        return ("steering_wheel_angle",)
    return needed(method, (), params_of(truck, params))


def _refuse_of_one_answer(options: Mapping[str, object]) -> None:
    """
    Args:
        options: their values; one that is not given has none, or False.

    Raises:
        OncenterError: "usage", exit code 2.
    """
    for option, given in options.items():
        if given:
            raise OncenterError(
                f"{option} needs one answer, and --each gives one for each log: leave one of them out",
                code="usage",
                exit_code=WRONG_USAGE,
            )


def refuse_one_place(report: Path | None, memory: Path | None) -> None:
    """Refuses one file for two outputs, which need not exist.

    Raises:
        OncenterError: "usage", exit code 2.
    """
    if report is not None and memory is not None and report.resolve() == memory.resolve():
        raise OncenterError(
            f"--report and --memory both name {report}: the page would replace the memory",
            code="usage",
            exit_code=WRONG_USAGE,
        )


def vehicle_of(vehicle_file: str | None) -> oc.Vehicle:
    """The vehicle of the command line, else an unknown truck."""
    import oncenter as oc
    from oncenter.vehicle import UNKNOWN_TRUCK

    return oc.Vehicle(name=UNKNOWN_TRUCK) if vehicle_file is None else oc.vehicle(vehicle_file)


def with_applied(truck: oc.Vehicle, applied_deg: float | None) -> oc.Vehicle:
    """The truck with the correction of the command line in place of that of the vehicle file.

    Raises:
        OncenterError: "usage", exit code 2: beyond two turns, or not a number.
    """
    from oncenter.vehicle_keys import APPLIED_MAX_DEG

    if applied_deg is None:
        return truck
    if not abs(applied_deg) <= APPLIED_MAX_DEG:
        raise OncenterError(
            f"--applied must be {-APPLIED_MAX_DEG:g} to {APPLIED_MAX_DEG:g}, got {applied_deg:g}",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    return truck.model_copy(update={"offset_applied_deg": applied_deg})


def with_limit(truck: oc.Vehicle, limit_deg: float | None) -> oc.Vehicle:
    """The truck with the limit of the command line in place of that of the vehicle file.

    Raises:
        OncenterError: "usage", exit code 2: out of the range of the vehicle file's `offset_limit_deg`.
    """
    from oncenter.vehicle_keys import OFFSET_LIMIT_MAX_DEG, OFFSET_LIMIT_MIN_DEG

    if limit_deg is None:
        return truck
    if not OFFSET_LIMIT_MIN_DEG <= limit_deg <= OFFSET_LIMIT_MAX_DEG:
        raise OncenterError(
            f"--limit must be {OFFSET_LIMIT_MIN_DEG:g} to {OFFSET_LIMIT_MAX_DEG:g} deg, got {limit_deg:g}",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    return truck.model_copy(update={"offset_limit_deg": limit_deg})


def as_table(answer: oc.Answer) -> str:
    """Verdicts, the answer in words, its quantities as a table, and its findings, for a person at the prompt."""
    from oncenter.findings import EXPLAINED, capitalised, large_losses
    from oncenter.signals import DEGREE
    from oncenter.verdict import lines_of

    losses = [f"{capitalised(loss)}." for loss in large_losses(answer.findings)]
    lines = [*losses, *lines_of(answer), answer.words(), ""]
    for name, estimate in answer.quantities.items():
        given = estimate.to_dict()
        value = "-" if given["value"] is None else f"{given['value']:.3f}"
        interval = "" if given["ci95"] is None else "{:.3f} to {:.3f}".format(*given["ci95"])
        lines.append(f"  {name:30}{value:>9} {given['unit']:<12}{interval:<22}{given['status']}")
        if estimate is answer.offset and answer.not_identifiable and answer.offset_ci95_drive is not None:
            of_drive = "{:.3f} to {:.3f}".format(*(bound / DEGREE for bound in answer.offset_ci95_drive))
            drives = "this drive" if len(answer.drives) == 1 else "these logs"
            lines.append(f"  {f'  from {drives}':30}{'':>9} {given['unit']:<12}{of_drive}")
    lines.append("")
    lines += [f"  {finding.line()}" for finding in answer.findings]
    lines += [f"  note: {note}" for note in answer.notes]
    lines += ["", f"  {EXPLAINED}"] if answer.findings else []
    return "\n".join(lines).rstrip()
