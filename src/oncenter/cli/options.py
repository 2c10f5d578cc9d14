"""Options that several verbs share, so that they read alike everywhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer

from oncenter.errors import WRONG_USAGE, OncenterError

_LONG_LOG_BYTES = 20_000_000  # below it the answer is there before a bar could be read

Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout, also for errors.")]
Schema = Annotated[
    Literal["offset-1", "offset-2"],
    typer.Option(help="Of --json: offset-1 lacks ci95_drive and not_identifiable, the parts of the offset's interval."),
]
VehicleFile = Annotated[
    str, typer.Option("--vehicle", metavar="FILE", help="What the truck is: a TOML file, or a shipped one's name.")
]
Dbc = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE",
        help="A database for logs that are not J1939: .dbc .kcd .sym .arxml; repeatable. "
        "In place of the vehicle file's dbc.",
    ),
]
FailOn = Annotated[
    str | None,
    typer.Option(
        metavar="STATUS,…",
        help="Exit code 3 where the offset's status is one of these: valid, converging, unobservable, invalid.",
    ),
]
Source = Annotated[
    list[str] | None,
    typer.Option(metavar="SIGNAL=ADDRESS", help="Which sender to believe, e.g. yaw_rate=0x3E; repeatable."),
]


def sources_of(pairs: Sequence[str] | None) -> dict[str, str]:
    """SIGNAL=SOURCE pairs as a mapping.

    Raises:
        OncenterError: "usage", exit code 2, for a pair without "=".
    """
    chosen = {}
    for pair in pairs or ():
        signal, equals, source = pair.partition("=")
        if not (signal and equals and source):
            raise OncenterError(
                f"--source takes SIGNAL=SOURCE, e.g. yaw_rate=0x3E, got '{pair}'", code="usage", exit_code=WRONG_USAGE
            )
        chosen[signal.strip()] = source.strip()
    return chosen


@contextmanager
def progress_bar(label: str, *logs: Path) -> Iterator[Callable[[float], None] | None]:
    """Gives what readers and estimators report their progress to: a bar on a terminal for long logs, else None."""
    try:
        size = sum(log.stat().st_size for log in logs)
    except (OSError, ValueError):  # reading says what is wrong with it
        size = 0
    if size < _LONG_LOG_BYTES or not sys.stderr.isatty():
        yield None
        return
    with typer.progressbar(length=1000, label=label, file=sys.stderr) as bar:
        yield lambda fraction: bar.update(int(1000 * fraction) - bar.pos)
