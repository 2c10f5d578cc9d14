"""oncenter signals: the signals of a log, and whether they agree with each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from oncenter.cli.logs import read_log
from oncenter.cli.options import Dbc, Json, Source, VehicleFileIfAny, sources_of
from oncenter.files.file_name import printable_name
from oncenter.files.log_formats import SUFFIXES
from oncenter.signals import SIGNALS

if TYPE_CHECKING:
    import oncenter as oc
    from oncenter.plausibility import CannotTell, Plausibility

_WIDTH = 100  # characters of the table and of the words below it


def signals(
    log: Annotated[Path, typer.Argument(metavar="LOG", readable=False, help=f"A log: {' '.join(SUFFIXES)}")],
    vehicle_file: VehicleFileIfAny = None,
    json: Json = False,
    dbc: Dbc = None,
    source: Source = None,
) -> None:
    """List the signals of a log and check them.

    The list has sender, rate, range and gaps of each signal. The check compares the signals with each other, and with
    --vehicle also with the steering ratio and the wheelbase.
    """
    import oncenter as oc
    from oncenter.plausibility import check

    truck = None if vehicle_file is None else oc.vehicle(vehicle_file)
    drive = read_log(log, truck, dbc or (), sources_of(source))
    judged = check(drive, truck)
    typer.echo(_to_json(drive, judged) if json else _as_text(drive, judged))


# By SI unit: the unit in files, the unit for people, and the number of decimals.
_FILE_UNITS = {
    "rad": ("deg", "deg", 1),
    "rad_s": ("deg_s", "deg/s", 2),
    "m_s": ("km_h", "km/h", 1),
    "nm": ("nm", "N m", 2),
    "m_s2": ("m_s2", "m/s^2", 2),
    "deg": ("deg", "deg", 4),
    "1": ("1", "", 0),
}


def _rows(drive: oc.Signals) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each signal, its source, and its range in the units of files."""
    for name, source in drive.sources.items():
        signal = SIGNALS[name]
        file_unit, words, _ = _FILE_UNITS[signal.quantity.unit]
        values = drive.columns[signal.column] / signal.quantity.factors[file_unit]
        numbers = values[values == values]
        yield (
            name,
            {
                "source": source.description,
                "rate_hz": source.rate_hz,
                "samples": source.samples,
                "not_available": source.not_available,
                "ticks_without": len(values) - len(numbers),
                "min": float(numbers.min()) if len(numbers) else None,
                "max": float(numbers.max()) if len(numbers) else None,
                "unit": words or "1",
                "others": list(source.others),
            },
        )


def _to_json(drive: oc.Signals, judged: Plausibility) -> str:
    """The object of the schema oncenter/signals-1."""
    import json

    import oncenter as oc
    from oncenter.plausibility.recording import recorded

    of_drive = recorded(drive)
    whole = {
        "schema": "oncenter/signals-1",
        "version": oc.__version__,
        "log": drive.log,
        "rate_hz": drive.rate_hz,
        "duration_s": drive.duration_s,
        "recorded_s": of_drive.recorded_s,
        "holes": len(of_drive.holes_s),
        "signals": dict(_rows(drive)),
        "account": None if drive.account is None else drive.account.to_dict(),
        "findings": [finding.to_dict() for finding in judged.findings],
        "cannot_tell": [{"check": verdict.check, "why": verdict.why} for verdict in judged.cannot_tell],
        "notes": list(drive.notes),
    }
    return json.dumps(whole, ensure_ascii=False, allow_nan=False)


def _as_text(drive: oc.Signals, judged: Plausibility) -> str:
    """A table of the signals, then findings and checks that were not possible, in words."""
    name = printable_name(Path(drive.log).name)
    lines = [f"{name}: {drive.duration_s:.1f} s, brought to {drive.rate_hz:.4g} Hz", ""]
    lines += [*_table(drive), "", *_account(drive), ""]
    for finding in judged.findings:
        lines += _wrapped(finding.line())
    severities = {finding.severity for finding in judged.findings}
    if "error" not in severities:
        lines.append(f"All {'other ' if 'warning' in severities else ''}checks that were possible passed.")
    for why, checks in _by_reason(judged.cannot_tell).items():
        lines += _wrapped(f"not checked: {', '.join(checks)} ({why})")
    for note in drive.notes:  # among them the senders that were not taken
        lines += _wrapped(f"note: {note}")
    return "\n".join(lines)


def _table(drive: oc.Signals) -> list[str]:
    """A line a signal; n/a is the share of samples marked not available, gaps the share of all ticks without a number.

    Long sources replace the column of samples; longer ones are printed below their signals.
    """
    from oncenter.plausibility.recording import recorded

    in_holes = round(sum(recorded(drive).holes_s) * drive.rate_hz)  # ticks; a longer hole has no rows
    columns: dict[str, list[str]] = {name: [name] for name in ("signal", "rate", "samples", "n/a", "gaps", "range")}
    sources = ["source"]
    for name, row in _rows(drive):
        missing = _percent(row["not_available"], row["samples"])
        gaps = _percent(row["ticks_without"] + in_holes, drive.ticks + in_holes)
        cells = (name, f"{row['rate_hz']:.0f} Hz", str(row["samples"]), missing, gaps, _range(name, row))
        for column, cell in zip(columns.values(), cells, strict=True):
            column.append(cell)
        sources.append(row["source"])
    whole = _aligned(columns)
    for lines in (whole, _aligned({name: cells for name, cells in columns.items() if name != "samples"})):
        if len(lines[0]) + 2 + max(map(len, sources)) <= _WIDTH:
            return [f"{line}  {source}" for line, source in zip(lines, sources, strict=True)]
    pairs = zip(whole, sources, strict=True)
    return [part for line, source in pairs for part in (line.rstrip(), *_wrapped(f"    {source}"))]


def _account(drive: oc.Signals) -> list[str]:
    """Counts of the frames or rows of the file, then of each signal's samples; one line for equal accounts."""
    if drive.account is None:
        return []
    of_file = drive.account.file
    lines = _wrapped(f"account: {of_file.in_file} {of_file.unit} = {of_file.used} used{_left_out(of_file.left_out)}")
    together: dict[str, list[str]] = {}
    for name, account in drive.account.signals.items():
        superseded = f" + {account.superseded} superseded" if account.superseded else ""
        samples = f"{account.in_file} samples = {account.used} used{superseded}{_left_out(account.left_out)}"
        ticks = f"{account.ticks} ticks = {account.fresh} fresh + {account.held} held + {account.missing} missing"
        beyond = f"; {account.outside_range} outside the range of the database, kept" if account.outside_range else ""
        together.setdefault(f"{samples}; {ticks}{beyond}", []).append(name)
    for counts, names in together.items():
        lines += _wrapped(f"  {', '.join(names)}: {counts}")
    return lines


def _left_out(counts: Mapping[str, int]) -> str:
    if not counts:
        return ""
    reasons = ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in counts.items())
    return f" + {sum(counts.values())} left out ({reasons})"


def _aligned(columns: Mapping[str, list[str]]) -> list[str]:
    """Lines of one length: names and ranges to the left, numbers to the right."""
    padded = []
    for name, cells in columns.items():
        pad = str.ljust if name in ("signal", "range") else str.rjust
        width = max(map(len, cells))
        padded.append([pad(cell, width) for cell in cells])
    return ["  ".join(cells) for cells in zip(*padded, strict=True)]


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole if whole else 100.0:.0f}%"


def _range(name: str, row: dict[str, Any]) -> str:
    if row["min"] is None:
        return "-"
    _, words, decimals = _FILE_UNITS[SIGNALS[name].quantity.unit]
    return f"{row['min']:.{decimals}f}..{row['max']:.{decimals}f} {words}"


def _by_reason(verdicts: tuple[CannotTell, ...]) -> dict[str, list[str]]:
    by_reason: dict[str, list[str]] = {}
    for verdict in verdicts:
        by_reason.setdefault(verdict.why, []).append(verdict.check)
    return by_reason


def _wrapped(text: str, width: int = _WIDTH) -> list[str]:
    import textwrap

    return textwrap.wrap(text, width, subsequent_indent="    ")
