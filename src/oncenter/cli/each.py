"""oncenter offset --each: an answer or an error for each log, one line a log, or one JSON object for all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from oncenter.errors import LOG_CANNOT_BE_ANSWERED, OncenterError
from oncenter.files.file_name import printable, printable_name

if TYPE_CHECKING:
    from oncenter.cli.places import Places
    from oncenter.offset.answer import Answer, Schema

_NAME_MAX = 60  # characters of a column
_OFFSET_WIDTH, _STATUS_WIDTH, _STATE_WIDTH = 38, 12, 16
_NO_ANSWER = "no answer"  # in place of a status


def answer_each(places: Places, answered: Callable[[Path], Answer], schema: Schema | None) -> dict[str, list[str]]:
    """Prints the answer or the error of each log as soon as it is there; with a schema of `Answer.to_dict`, all of them
    in one object at the end.

    Returns:
        The logs by the status of their offset.

    Raises:
        typer.Exit: no log can be answered: the exit code of all logs, or 1 if they differ.
    """
    width = min(max(len(printable_name(str(log))) for log in places.logs), _NAME_MAX)
    objects: list[dict[str, Any]] = []
    by_status: dict[str, list[str]] = {}
    exit_codes: set[int] = set()
    for log in places.logs:
        try:
            answer = answered(log)
        except OncenterError as error:
            exit_codes.add(error.exit_code)
            objects.append(_refusal(str(log), error))
            line = _line(str(log), width, "-", _NO_ANSWER, str(error))
        else:
            by_status.setdefault(answer.offset.status, []).append(str(log))
            objects.append(answer.to_dict(schema) if schema else {})
            line = _line(str(log), width, _offset(answer), answer.offset.status, _first_warning(answer), _state(answer))
        if schema is None:
            typer.echo(line)
    _print_notes(places, objects, schema)
    if not by_status:
        raise typer.Exit(exit_codes.pop() if len(exit_codes) == 1 else LOG_CANNOT_BE_ANSWERED)
    return by_status


def _print_notes(places: Places, objects: list[dict[str, Any]], schema: Schema | None) -> None:
    """Notes that belong to no single log; with a schema the object."""
    notes = [
        *(f"{log} is given twice; it is answered once" for log in places.twice),
        *places.unlisted,
        *places.notes,
    ]
    if schema is None:
        for note in notes:
            typer.echo(f"note: {printable(str(note))}")
        return
    import json

    from oncenter import _core

    whole = {
        "schema": "oncenter/offsets-1",
        "version": _core.version(),
        "answers": objects,
        "notes": [*map(str, notes)],
    }
    typer.echo(json.dumps(whole, ensure_ascii=False, allow_nan=False, indent=2))


def _refusal(log: str, error: OncenterError) -> dict[str, Any]:
    return {
        "schema": "oncenter/error-1",
        "log": log,
        "code": error.code,
        "message": _one_line(str(error)),
        "needs": list(error.needs),
    }


def _line(log: str, width: int, offset: str, status: str, why: str, state: str = "") -> str:
    columns = (
        f"{printable_name(log):{width}}  {offset:{_OFFSET_WIDTH}}  {status:{_STATUS_WIDTH}}  {state:{_STATE_WIDTH}}"
    )
    return f"{columns}  {_one_line(why)}".rstrip()


def _state(answer: Answer) -> str:
    """The word of the verdict on the offset."""
    from oncenter.verdict import verdicts_of

    return verdicts_of(answer)[0].word


def _offset(answer: Answer) -> str:
    """The offset, this drive's part of its interval, and the whole interval; an invalid value is marked."""
    from oncenter.offset.answer import NOT_YET_OR_NO_MORE
    from oncenter.signals import DEGREE

    offset, half_width = answer.offset, answer.offset_half_width_rad
    if offset.value is None or offset.ci95 is None or half_width is None:
        return "-"
    value = f"{offset.value / DEGREE:+.2f} ± {half_width / DEGREE:.2f} deg"
    if offset.status == "invalid":
        return f"- ({NOT_YET_OR_NO_MORE['invalid']} {value})"
    low, high = (bound / DEGREE for bound in offset.ci95)
    return f"{value} ({low:+.2f} to {high:+.2f})"


def _first_warning(answer: Answer) -> str:
    grave = (finding.text for finding in answer.findings if finding.severity != "info")
    return next(grave, "")


def _one_line(text: str) -> str:
    return " ".join(text.split())
