"""The signals of a truck whose network is not J1939: each beside what it should look like, with what is wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from oncenter.app.texts import ENGLISH
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.findings import Finding, capitalised
from oncenter.plausibility import check
from oncenter.plausibility.grid_signals import MIN_TIME_S
from oncenter.read import read
from oncenter.read.apart import names_in
from oncenter.read.named import Named
from oncenter.read.units import factors
from oncenter.signals import SIGNALS, SignalName, Signals, in_words, shown_unit
from oncenter.vehicle import Vehicle, vehicle_from
from oncenter.vehicle_file.by_log import is_named
from oncenter.vehicle_file.check import NEEDED
from oncenter.vehicle_file.new import proposals_for
from oncenter.vehicle_file.proposals import PROPOSED, chosen, proposals, time_proposal

Column = npt.NDArray[np.float64]
Entries = dict[str, dict[str, object]]  # a [signals] table

_WHEELS = tuple(name for name in PROPOSED if name.startswith("wheel_speed_"))
_WITHOUT_SIGN = ("vehicle_speed", *_WHEELS)
_FOR_ENGINEERS = ("unit ", "range ", "message ")  # reasons of a proposal that say nothing to a mechanic
_STEP_S = 0.25  # between the points of a picture
_SHOWN_S = 120.0  # of the drive, those with the most steering
_ROLLING_M_S = 2.0  # from which yaw rate over speed is a curvature
_TRACK_M = 1.9
_BACKWARD_M_S = -1.0  # noise of a signal that cannot be negative is smaller
_SPEED_M_S = (5.0, 36.0)  # range of the highest speed of a drive: 18 to 130 km/h
_ALIKE, _SIZE, _NEARLY = 0.6, 2.5, 0.2  # of two readings of one quantity: correlation, factor of size, share of values
_CURVATURE_M = (15.0, 400.0)  # steering wheel angle over curvature, of cars to heavy trucks
_BY_UNDERSTEER = (0.5, 4.0)  # the same over ratio times wheelbase


class Network(NamedTuple):
    """The databases of a network, and a drive on it."""

    databases: Sequence[Path]
    log: Path | None


class Said(NamedTuple):
    """A sentence at a row. `state` is "bad" where there is no answer with it, "open" where it needs a look, or "ok"."""

    state: str
    text: str


def network_entries(network: Network, asked: Any, former: Mapping[str, Any]) -> Entries:
    """The `[signals]` table that a person chose.

    Args:
        asked: by signal a name, and where it was set its unit and sign; as it came from the browser.
        former: the table until now; its other signals stay.

    Raises:
        OncenterError: "page": a name that neither the log nor the databases have, a wrong unit or sign.
    """
    columns, there = _names(network)
    by_name = {each.name: each for each in reversed(there)}
    table: Entries = {signal: entry for signal, entry in former.items() if signal not in PROPOSED}
    time = time_proposal(columns)
    if time is not None and "time" not in table:
        table["time"] = time.entry()
    for signal, given in asked.items() if isinstance(asked, dict) else ():
        if signal not in PROPOSED or not isinstance(given, dict):
            raise _refused(f"no such signal: {signal}")
        name, before = str(given.get("name")), former.get(signal, {})
        if name == before.get("name"):
            entry = {"unit": None, "sign": 1, **before}
        elif name in by_name:
            entry = chosen(signal, by_name[name], there).entry()
        else:
            files = [path.name for path in (*network.databases, network.log) if path is not None]
            raise _refused(f"{name[:100]} is not a signal of {', '.join(files)}: choose one of the list")
        unit, sign = given.get("unit") or entry["unit"], given.get("sign") or entry["sign"]
        if unit is not None and str(unit) not in factors(signal):
            raise _refused(f"{signal.replace('_', ' ')} has no unit {unit}: it is {' or '.join(factors(signal))}")
        if sign not in (1, -1):
            raise _refused(f"the sign of the {signal.replace('_', ' ')} is 1 or -1")
        table[signal] = {
            key: value for key, value in {**entry, "unit": unit, "sign": sign}.items() if value is not None
        }
    return table


def network_shown(
    values: Mapping[str, Any], network: Network, asked: Any, at_s: Any, progress: Callable[[float], None]
) -> dict[str, Any]:
    """The rows of the page: a signal each, with its picture and what is wrong with it.

    Args:
        values: of the vehicle file that is, or will be.
        asked: as of `network_entries`; None for the table of `values`, or what names and log propose.
        progress: as of `proposals_for`.
        at_s: where the pictures begin, in s from the first tick; anything but a number for the most steering.

    Raises:
        OncenterError: a file cannot be read; "page": as `network_entries`.
    """
    _, there = _names(network)
    former = values.get("signals", {})
    if not there and not former:
        return {"rows": [], "notes": [], "at_s": None, **_lists(there)}
    notes: list[str] = []
    why: dict[str, str] = {}
    if asked is not None:
        table = network_entries(network, asked, former)
    elif former:
        table = dict(former)
    else:
        found, notes = proposals_for(network.databases, network.log, NEEDED, progress)
        table = {each.signal: each.entry() for each in found}
        why = {
            each.signal: ", ".join(
                reason.partition(" (correlation")[0] for reason in each.reasons if not reason.startswith(_FOR_ENGINEERS)
            )
            for each in found
        }
    truck = vehicle_from({**values, "signals": table}, str(values.get("name", "")))
    drive, wrong = _drive(network, truck)
    said = {signal: list(_said(signal, table, drive, network, there)) for signal in PROPOSED}
    notes = [*notes, *_about_time(table, there), *_at_rows(wrong, said), *_findings(drive, truck, table, said)]
    pictures = {} if drive is None else _pictures(drive, truck, at_s)
    for signal, picture in pictures.items():
        if picture["fits"] and not said[signal]:
            said[signal].append(Said("ok", ENGLISH["row_fits"]))
    rows = []
    for signal in PROPOSED:
        source = None if drive is None else drive.sources.get(signal)
        row = _row(signal, table.get(signal), "" if source is None else source.description)
        rows.append(
            row
            | {
                "why": why.get(signal, ""),
                "said": sorted(said[signal], key=lambda each: each.state != "bad"),
                "picture": pictures.get(signal),
            }
        )
    at = next((picture["at_s"] for picture in pictures.values()), None)
    return {"rows": rows, "notes": notes, "at_s": at, **(_lists(there) if asked is None else {})}


def _row(signal: str, entry: Mapping[str, Any] | None, source: str) -> dict[str, Any]:
    """A row without its picture. Without an entry a log can have the signal by itself, from a `source`."""
    given = {"name": "", "unit": "", "sign": 1} | dict(entry or {})
    return {
        "signal": signal,
        "needed": signal in NEEDED,
        "has_sign": signal not in _WITHOUT_SIGN,
        "units": {unit: _in_words(unit) for unit in factors(signal)},
        "parts": [f"{ENGLISH[f'row_{key}']} {given[key]}" for key in ("sign_by", "plus") if key in given],
        "source": "" if entry else source,
        **{key: given[key] for key in ("name", "unit", "sign")},
    }


def _lists(there: Sequence[Named]) -> dict[str, Any]:
    """All names with their units, and for each signal those that are similar to it, the best first."""
    similar = {each.signal: [one.named.name for one in (each, *each.others)] for each in proposals(there)}
    return {"names": [[each.name, each.unit] for each in there], "similar": similar}


def _refused(message: str) -> OncenterError:
    return OncenterError(message, code="page", exit_code=WRONG_USAGE)


def _names(network: Network) -> tuple[list[Named], list[Named]]:
    """Columns or channels of the log, and all names."""
    columns = [] if network.log is None else _names_in(network.log, "log")
    return columns, [*columns, *(each for file in network.databases for each in _names_in(file, "database"))]


def _names_in(file: Path, kind: Literal["log", "database"]) -> list[Named]:
    """Read once while the file does not change: each choice needs them."""
    return _names_once(file, kind, _state(file))


@lru_cache(maxsize=8)
def _names_once(file: Path, kind: Literal["log", "database"], state: object) -> list[Named]:
    return names_in(file, kind)


def _state(file: Path) -> tuple[int, ...]:
    """Differs where a file changed."""
    try:
        status = file.stat()
    except OSError:  # the reader reports the error
        return ()
    return (status.st_ino, status.st_size, status.st_mtime_ns)


def _drive(network: Network, truck: Vehicle) -> tuple[Signals | None, OncenterError | None]:
    """The drive by the truck's signals, or why it cannot be read by them."""
    if network.log is None:
        return None, None
    files = (network.log, *network.databases)
    names = {signal: replace(name, sign=1) for signal, name in truck.signal_names.items()}
    try:
        drive = _read_once(files, tuple(names.items()), tuple(map(_state, files)))
    except OncenterError as error:
        return None, error
    turned = {
        SIGNALS[signal].column
        for signal, name in truck.signal_names.items()
        if name.sign == -1 and signal in drive.sources and is_named(drive.sources[signal], name.name)
    }
    columns = {name: -values if name in turned else values for name, values in drive.columns.items()}
    return drive.replaced(columns=columns), None


@lru_cache(maxsize=1)  # the last: another sign, or another part of the drive, is shown at once
def _read_once(files: tuple[Path, ...], names: tuple[tuple[str, SignalName], ...], state: object) -> Signals:
    return read(files[0], names=dict(names), dbc=files[1:])


def _said(
    signal: str, table: Entries, drive: Signals | None, network: Network, there: Sequence[Named]
) -> Iterator[Said]:
    """Sentences at a row that need no comparison of signals."""
    entry = table.get(signal)
    if entry is None:
        if signal in NEEDED and (drive is None or signal not in drive.sources):
            yield Said("bad", ENGLISH["row_empty"])
        return
    named = next((each for each in there if each.name == entry["name"]), None)
    if [each["name"] for each in table.values()].count(entry["name"]) > 1:
        yield Said("bad", ENGLISH["row_twice"])
    if named is not None and chosen(signal, named, there).unit is None:
        yield (
            Said("bad", ENGLISH["row_other_unit"].format(named.unit))
            if named.unit
            else Said("open", ENGLISH["row_no_unit"])
        )
    if signal == "vehicle_speed" and drive is not None and signal in drive.sources:
        yield from _said_of_speed(drive.columns[SIGNALS[signal].column])
    if drive is not None and network.log is not None and signal not in drive.sources:
        notes = [note.partition(": ")[2] for note in drive.notes if note.partition(":")[0] == signal]
        why = "; ".join(notes) or ENGLISH["row_no_values"]
        yield Said("bad", f"{network.log.name}: {why}. {ENGLISH['remedy_other_signal']}")


def _said_of_speed(speed: Column) -> Iterator[Said]:
    low, high = np.nanmin(speed), np.nanmax(speed)
    if low < _BACKWARD_M_S:
        yield Said("bad", ENGLISH["row_backward"])
    elif not _SPEED_M_S[0] < high < _SPEED_M_S[1]:
        yield Said("open", ENGLISH["row_unusual_speed"].format(3.6 * high))


def _about_time(table: Entries, there: Sequence[Named]) -> Iterator[str]:
    """A column of times whose unit is assumed."""
    name = table.get("time", {}).get("name")
    time = time_proposal([each for each in there if each.name == name])
    if time is not None and time.unit is None:
        yield f"{name}: {ENGLISH['time_no_unit']}"


def _at_rows(error: OncenterError | None, said: Mapping[str, list[Said]]) -> list[str]:
    """Puts the reason of an unread log at the rows that need it; returns it where it concerns no row."""
    if error is None:
        return []
    rows = [signal for signal in error.needs if signal in said]
    for signal in rows:
        said[signal].append(Said("bad", capitalised(str(error))))
    return [] if rows else [capitalised(str(error))]


def _findings(drive: Signals | None, truck: Vehicle, table: Entries, said: Mapping[str, list[Said]]) -> list[str]:
    """Puts findings of the checks at the rows that they concern; returns the rest."""
    if drive is None:
        return []
    rest = []
    for finding in check(drive, truck).findings:
        remedy = ENGLISH.get(f"remedy_{finding.code}")
        if finding.code == "missing_signal" or (finding.severity != "error" and remedy is None):
            continue  # said at the row, or of the truck and the drive: the report has it
        rows = [signal for signal in PROPOSED if signal in finding.signals and signal in table]
        for signal in rows:
            state = "bad" if finding.severity == "error" else "open"
            said[signal].append(Said(state, _with_remedy(finding, remedy, table[signal])))
        if not rows:
            rest.append(f"{capitalised(finding.text)}.")
    return rest


def _with_remedy(finding: Finding, remedy: str | None, entry: Mapping[str, object]) -> str:
    """The observation, and what to do in this row in place of the vehicle file."""
    if remedy is None:
        return f"{capitalised(finding.text)}."
    if finding.code == "sign_reversed" and entry.get("sign") == -1:
        remedy = ENGLISH["remedy_sign_reversed_back"]
    return f"{capitalised(finding.text.partition('. ')[0])}. {remedy}"


def _pictures(drive: Signals, truck: Vehicle, at_s: Any) -> dict[str, dict[str, Any]]:
    """Each signal over a part of the drive, in the unit for people, beside what it should look like."""
    step = max(1, round(_STEP_S * drive.rate_hz))
    step_s = step / drive.rate_hz
    means = {signal: _means(drive.columns[SIGNALS[signal].column], step) for signal in drive.sources}
    count = len(next(iter(means.values())))
    if not count:
        return {}
    length = min(count, round(_SHOWN_S / step_s))
    first = (
        round(at_s / step_s) if isinstance(at_s, int | float) and np.isfinite(at_s) else _most_steering(means, length)
    )
    first = max(0, min(first, count - length))
    pictures = {}
    for signal in (signal for signal in PROPOSED if signal in means):
        quantity = SIGNALS[signal].quantity
        unit = shown_unit(quantity)
        like, expected = _expected(signal, means, truck, step_s)
        curves = [means[signal]] if expected is None else [means[signal], expected]
        pictures[signal] = {
            "at_s": round(first * step_s, 2),
            "step_s": step_s,
            "unit": _in_words(unit),
            "like": like,
            "fits": expected is not None and _fits(means[signal], expected),
            "curves": [_numbers(each[first : first + length] / quantity.factors[unit]) for each in curves],
        }
    return pictures


def _in_words(unit: str) -> str:
    return in_words(unit).replace("^2", "²").replace("_", "/")


def _means(values: Column, step: int) -> Column:
    return np.asarray(values[: len(values) // step * step].reshape(-1, step).mean(axis=1))


def _numbers(values: Column) -> list[float | None]:
    """For JSON, which has no NaN."""
    return [float(f"{value:.4g}") if np.isfinite(value) else None for value in values]


def _most_steering(means: Mapping[str, Column], length: int) -> int:
    """The first point of the part in which the truck turns most."""
    for signal in ("yaw_rate", "steering_wheel_angle", "lateral_acceleration", "vehicle_speed"):
        if signal in means:
            values = np.nan_to_num(means[signal])
            starts = range(0, max(1, len(values) - length + 1), max(1, length // 4))
            spreads = [float(np.std(values[start : start + length])) for start in starts]
            if max(spreads) > 0.0:
                return starts[int(np.argmax(spreads))]
    return 0


def _expected(signal: str, means: Mapping[str, Column], truck: Vehicle, step_s: float) -> tuple[str, Column | None]:
    """The name of a text, and the same quantity by the other signals; None where they are not there."""
    rate, speed, lateral = (means.get(name) for name in ("yaw_rate", "vehicle_speed", "lateral_acceleration"))
    rolling = None if speed is None else np.where(speed > _ROLLING_M_S, speed, np.nan)
    if signal == "steering_wheel_angle" and rate is not None and rolling is not None:
        curvature = rate / rolling
        return "like_angle", _size_like(means[signal], curvature, truck) * curvature
    if signal == "yaw_rate" and rolling is not None:
        for axle in ("rear", "front"):
            left, right = (means.get(f"wheel_speed_{axle}_{side}") for side in ("left", "right"))
            if left is not None and right is not None:
                return "like_yaw_rate_wheels", (right - left) / _TRACK_M
        if lateral is not None:
            return "like_yaw_rate", lateral / rolling
    if signal == "vehicle_speed":
        wheel = next((means[name] for name in _WHEELS if name in means), None)
        return "like_speed", wheel
    if signal == "lateral_acceleration" and rate is not None and speed is not None:
        return "like_lateral", rate * speed
    if signal == "longitudinal_acceleration" and speed is not None and len(speed) > 1:
        return "like_longitudinal", np.gradient(speed, step_s)
    if signal in _WHEELS and speed is not None:
        return "like_wheel", speed
    return "", None


def _fits(values: Column, expected: Column) -> bool:
    """Whether two readings of one quantity move alike, or are nearly the same, as a speed that a driver holds."""
    both = np.isfinite(values) & np.isfinite(expected)
    x, y = values[both], expected[both]
    if len(x) * _STEP_S < MIN_TIME_S:
        return False
    if float(np.mean(np.square(x - y))) < _NEARLY**2 * float(np.mean(np.square(y))):
        return True
    of_x, of_y = float(np.std(x)), float(np.std(y))
    together = float(np.mean((x - x.mean()) * (y - y.mean())))
    return of_y / _SIZE < of_x < of_y * _SIZE and together > _ALIKE * of_x * of_y


def _size_like(angle: Column, curvature: Column, truck: Vehicle) -> float:
    """Angle over curvature in m, as the drive has it, but not beyond what trucks have: a wrong unit stays visible."""
    il = truck.ratio_times_wheelbase_m
    low, high = _CURVATURE_M if truck.assumed else (_BY_UNDERSTEER[0] * il, _BY_UNDERSTEER[1] * il)
    both = np.isfinite(angle) & np.isfinite(curvature)
    spread = float(np.std(curvature[both])) if both.any() else 0.0
    return min(max(float(np.std(angle[both])) / spread, low), high) if spread > 0.0 else il
