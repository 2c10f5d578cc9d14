"""The next command for an error: appended to its line, where a command or another name would help."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from oncenter.errors import OncenterError
from oncenter.files.log_formats import DATABASES, SUFFIXES
from oncenter.files.shipped import shipped
from oncenter.nearest_name import did_you_mean, nearest
from oncenter.read.wording import ASSIGN_THEM, FOUND
from oncenter.vehicle_file.shipped_files import shipped_names

_SIMILAR_MAX = 2  # names of files
_WITH_COLUMNS = (".csv", ".csv.gz", ".parquet")  # logs of which `vehicle new --log` takes the names
_LOG_FIRST = ("offset", "angle", "reference", "signals")  # commands whose first argument is a log


def advised(message: str, code: str, arguments: Sequence[str]) -> str:
    """An error's message with the next command.

    Args:
        message: of the error.
        code: of the error.
        arguments: of the command line.
    """
    advice = _BY_CODE.get(code, _nothing)(message, arguments)
    return f"{message}; {advice}" if advice else message


def _nothing(message: str, arguments: Sequence[str]) -> str:
    return ""


def _log_of(arguments: Sequence[str]) -> str:
    """The log of the command line as a shell takes it, "LOG" if it is not clear."""
    if len(arguments) > 1 and arguments[0] in _LOG_FIRST and not arguments[1].startswith("-"):
        return shlex.quote(arguments[1])
    return "LOG"


def _unreadable(message: str, arguments: Sequence[str]) -> str:
    """The advice on a file that does not exist: files of similar names in its folder."""
    for argument in arguments[1:]:
        if argument in message and not argument.startswith("-") and not os.path.lexists(argument):
            is_database = argument.lower().endswith(DATABASES)
            return _similar_files(Path(argument), DATABASES if is_database else SUFFIXES)
    return ""


def _similar_files(path: Path, suffixes: Sequence[str]) -> str:
    """Only the names before the suffix are compared: a common suffix makes no two names similar."""
    try:
        names = [each.name for each in path.parent.iterdir() if each.name.lower().endswith(tuple(suffixes))]
    except (OSError, ValueError):
        return ""
    by_stem = {name.partition(".")[0]: name for name in sorted(names)}
    near = nearest(path.name.partition(".")[0], by_stem, _SIMILAR_MAX)
    return f"did you mean {' or '.join(by_stem[stem] for stem in near)}?" if near else ""


def _missing_signal(message: str, arguments: Sequence[str]) -> str:
    """Of a log with other signals the list of them; of a table without any the command that proposes entries."""
    log = _log_of(arguments)
    if log.lower().endswith(_WITH_COLUMNS) and _has_proposal(Path(arguments[1]), message):
        return f"{_new_vehicle(arguments, '--log', log)} proposes entries"
    if FOUND not in message or f"{FOUND}PGN" in message:  # there is no signal to list
        return f"{_new_vehicle(arguments)} writes one" if ASSIGN_THEM in message else ""
    options = [word for option in ("--vehicle", "--dbc") for word in _option(option, arguments)]
    listing = " ".join(["oncenter signals", log, *options])
    return "" if arguments[:1] == ["signals"] else f"{listing} lists the signals of the log"


def _has_proposal(log: Path, message: str) -> bool:
    """Whether a column of a table may be one of the signals that the message misses."""
    from oncenter.vehicle_file.new import proposals_for  # late import: an answer needs none of it

    try:
        proposed, _ = proposals_for((), log)
    except OncenterError:
        return False
    missing = ("no signal recognised", "column {signal} of", "no {words} (")
    return any(
        text.format(signal=each.signal, words=each.signal.replace("_", " ")) in message
        for each in proposed
        for text in missing
    )


def _unit_missing(message: str, arguments: Sequence[str]) -> str:
    """Of a column; an entry of a vehicle file is mended there."""
    log = _log_of(arguments)
    is_of_column = "[signals] " not in message.partition(":")[0] and "rename it to time_" not in message
    return _missing_signal(message, arguments) if is_of_column and log.lower().endswith(_WITH_COLUMNS) else ""


def _not_j1939(message: str, arguments: Sequence[str]) -> str:
    database = _option("--dbc", arguments) or ["--dbc", "FILE"]
    return f"{_new_vehicle(arguments, *database, '--log', _log_of(arguments))} proposes entries"


def _new_vehicle(arguments: Sequence[str], *more: str) -> str:
    """The command that writes a vehicle file: with the numbers of the one that was given, at a place that is free."""
    places = ("new_truck.toml", *(f"new_truck{number}.toml" for number in range(2, 100)))
    free = next((name for name in places if not os.path.lexists(name)), "NAME.toml")
    numbers: list[str] = []
    given = _after("--vehicle", arguments)
    if given:
        from oncenter.vehicle import vehicle  # late import: it is loaded already, since the command read it

        with suppress(OncenterError):
            truck = vehicle(given)
            known = {"wheelbase_m": f"{truck.wheelbase_m:g}", "steering_ratio": f"{truck.ratio_near_centre:.4g}"}
            for key in (each for each in known if each not in truck.assumed):
                numbers += [f"--{key.replace('_', '-')}", known[key]]
    return " ".join(["oncenter vehicle new", free, *numbers, *more])


def _option(name: str, arguments: Sequence[str]) -> list[str]:
    """An option of the command line with its value as a shell takes it; empty if it is not given."""
    value = _after(name, arguments)
    return [name, shlex.quote(value)] if value else []


def _unknown_format(message: str, arguments: Sequence[str]) -> str:
    given = next((each for each in arguments[1:] if Path(each).name and Path(each).name in message), "")
    suffix = Path(given).suffix.lower()
    if suffix in DATABASES:
        return f"a database follows --dbc: oncenter offset LOG --vehicle FILE --dbc {shlex.quote(given)}"
    if suffix == ".toml":
        return f"a vehicle file follows --vehicle: oncenter offset LOG --vehicle {shlex.quote(given)}"
    return "rename a text file with columns to .csv" if suffix == ".txt" else ""


def _vehicle_file(message: str, arguments: Sequence[str]) -> str:
    given = _after("--vehicle", arguments) or (arguments[2] if arguments[:2] == ["vehicle", "check"] else "")
    if not given or not ("is not TOML" in message or "cannot be read" in message):
        return ""
    name, quoted = given.lower(), shlex.quote(given)
    if name.endswith(DATABASES):
        return f"a database follows --dbc: --dbc {quoted}"
    if name.endswith(SUFFIXES):
        return f"a log comes first: oncenter {arguments[0]} {quoted} --vehicle FILE"
    if os.path.lexists(given):
        return "numbers need a decimal point and text needs quotes" if "is not TOML" in message else ""
    near = _similar_files(Path(given), (".toml",)) or did_you_mean(given, shipped_names()).removeprefix("; ")
    if near:
        return near
    file = quoted if name.endswith(".toml") else "truck.toml"
    return f"oncenter vehicle new {file} writes one, oncenter vehicle list shows the shipped ones"


def _scenario_file(message: str, arguments: Sequence[str]) -> str:
    if len(arguments) < 2 or f"'{arguments[1]}'" not in message:
        return ""
    return did_you_mean(arguments[1], (path.stem for path in shipped("scenarios").glob("*.toml"))).removeprefix("; ")


def _after(option: str, arguments: Sequence[str]) -> str:
    """The value of an option; empty if it is not given."""
    for place, argument in enumerate(arguments):
        if argument == option and place + 1 < len(arguments):
            return arguments[place + 1]
        if argument.startswith(f"{option}="):
            return argument.partition("=")[2]
    return ""


_BY_CODE: Mapping[str, Callable[[str, Sequence[str]], str]] = {
    "unreadable_log": _unreadable,
    "bad_dbc": _unreadable,
    "missing_signal": _missing_signal,
    "unit_missing": _unit_missing,
    "not_j1939": _not_j1939,
    "unknown_format": _unknown_format,
    "vehicle_file": _vehicle_file,
    "scenario_file": _scenario_file,
}
