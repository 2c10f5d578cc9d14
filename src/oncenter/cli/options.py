"""Options that several commands share, with one text for all of them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer

from oncenter.cli.completion import signal_names, vehicle_files
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.file_name import printable
from oncenter.vehicle_file.shipped_files import shipped_names

_LONG_LOG_BYTES = 20_000_000  # a shorter log is answered before a bar can be read

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object, also for errors (docs/reference/json.md).")]
Schema = Annotated[
    Literal["offset-1", "offset-2"],
    typer.Option(
        help="Schema of --json. offset-1 lacks the parts of the offset's interval (ci95_drive, not_identifiable)."
    ),
]
VEHICLE_HELP = (
    f"The truck: a vehicle file (TOML), or the name of a shipped one: {', '.join(shipped_names())}. "
    "`oncenter vehicle new truck.toml` writes a file."
)
UnknownTruck = Annotated[
    str | None,
    typer.Option(
        "--vehicle",
        metavar="FILE",
        help=f"{VEHICLE_HELP} Without it steering ratio times wheelbase is estimated from the drive (method joint).",
        autocompletion=vehicle_files,
    ),
]
VehicleFile = Annotated[str, typer.Option("--vehicle", metavar="FILE", help=VEHICLE_HELP, autocompletion=vehicle_files)]
VehicleFileIfAny = Annotated[
    str | None,
    typer.Option(
        "--vehicle",
        metavar="FILE",
        help="The truck, for signal names and databases: a vehicle file, or the name of a shipped one.",
        autocompletion=vehicle_files,
    ),
]
Dbc = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE",
        help="A CAN database for logs that are not J1939: .dbc .kcd .sym .arxml. It replaces the dbc of the vehicle "
        "file. Repeat the option for several databases.",
    ),
]
FailOn = Annotated[
    str | None,
    typer.Option(
        metavar="STATUS,…",
        help="Exit with code 3 if the offset has one of these statuses: valid, converging, unobservable, invalid. "
        "Separate several with commas.",
    ),
]
Source = Annotated[
    list[str] | None,
    typer.Option(
        metavar="SIGNAL=SENDER",
        help="Take a signal from this sender if several send it, e.g. yaw_rate=0x3E. Repeat the option for several "
        "signals.",
        autocompletion=signal_names,
    ),
]


def sources_of(pairs: Sequence[str] | None) -> dict[str, str]:
    """SIGNAL=SENDER pairs as a mapping.

    Raises:
        OncenterError: "usage", exit code 2, for a pair without "=".
    """
    chosen = {}
    for pair in pairs or ():
        signal, equals, source = pair.partition("=")
        if not (signal and equals and source):
            raise OncenterError(
                f"--source takes SIGNAL=SENDER, e.g. yaw_rate=0x3E, got '{pair}'", code="usage", exit_code=WRONG_USAGE
            )
        chosen[signal.strip()] = source.strip()
    return chosen


@contextmanager
def progress_bar(label: str, *logs: Path) -> Iterator[Callable[[float], None] | None]:
    """The function to which readers and estimators report progress: a bar on a terminal for long logs, else None."""
    try:
        size = sum(log.stat().st_size for log in logs)
    except (OSError, ValueError):  # reading the log gives the reason
        size = 0
    if size < _LONG_LOG_BYTES or not sys.stderr.isatty():
        yield None
        return
    with typer.progressbar(length=1000, label=printable(label), file=sys.stderr) as bar:
        yield lambda fraction: bar.update(int(1000 * fraction) - bar.pos)
