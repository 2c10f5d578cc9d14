"""`oncenter fleet priors`: the priors that a fleet's trucks teach, by type, as a file that vehicle files read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.files.toml_text import entry
from oncenter.files.whole_file import check_place, write_whole
from oncenter.fleet.ledger import Ledger, ledger_in
from oncenter.fleet.night import that_count
from oncenter.fleet.ranking import vehicle_file_of
from oncenter.fleet.several_logs import as_drives
from oncenter.fleet.summaries import params_of_drive, row_of_drive
from oncenter.learned_priors import OUTLIERS, SCHEMA, error_key
from oncenter.signals import DEGREE
from oncenter.truck.events import Event
from oncenter.truck.now import usable
from oncenter.truck.population import TRUCKS_MIN, Drives, Learned, Population, has_several_loads, population_of
from oncenter.truck.priors import priors_of
from oncenter.truck.pull_spread import Outlier

_DRIVES_MAX = 40  # of a truck, the newest: more add little to what its loads say
_GIVEN = ("known_pull_sd_m_s2", "known_play_sd_rad")  # params of a drive
_TRUCKS_MAX = 1000  # of a type
_DIGITS = 4


class Taught(NamedTuple):
    """A truck's drives that may teach, in order of time, and what a person stated about it."""

    name: str
    vehicle_file: str
    drives: Drives
    events: Sequence[Event] = ()


def write_priors(output: Path, path: Path) -> str:
    """Writes the file by the ledger of a fleet, and says of what: a line, and one for each outlier.

    Raises:
        OncenterError: "output", exit code 2: no ledger of a fleet. "too_few_loads", exit code 1: too few trucks were
            driven at several loads, and there is no file.
    """
    check_place(path)
    with ledger_in(output) as ledger:
        trucks = list(_by_truck(ledger))
    return write_taught(trucks, path)


def write_taught(trucks: Sequence[Taught], path: Path) -> str:
    """As `write_priors`, by these trucks."""
    found = _learned(trucks)
    if found is None:
        several = sum(has_several_loads(truck.drives, priors_of()) for truck in trucks)
        raise OncenterError(
            f"no priors: {several} of {len(trucks)} trucks were driven at loads whose understeer gradients differ by "
            f"20 % or more, {TRUCKS_MIN} are needed; one load cannot separate a pull from an accelerometer bias. "
            "Drives answered by a given pull or play do not count",
            code="too_few_loads",
        )
    stems = sorted({truck.vehicle_file for truck in trucks} - {""})
    types = {stem: _learned([truck for truck in trucks if truck.vehicle_file == stem]) for stem in stems}
    by_type = {stem: own for stem, own in types.items() if own is not None}
    of_no_type = {truck.name for truck in trucks if truck.vehicle_file not in by_type}
    outliers = {name: one for name, one in found.outliers.items() if name in of_no_type}
    for own in by_type.values():
        outliers |= own.outliers
    write_whole(path, "\n".join(_lines(found.population, by_type, outliers)) + "\n")
    return "\n".join([f"{path}: {_words(found.population)}", *map(_of_outlier, outliers.items())])


def _by_truck(ledger: Ledger) -> Iterator[Taught]:
    """Logs with short stops between are one drive. Without drives answered by a given pull or play: learned ones are no
    evidence."""
    for name, rows in ledger.by_truck():
        events = ledger.events_of(name)
        logs = [row for row in that_count(rows, events) if row.get("copy_of") is None]
        teach = [drive for drive in as_drives(logs, events) if not any(map(params_of_drive(drive).get, _GIVEN))]
        drives = usable((row for drive in teach if (row := row_of_drive(drive)) is not None), events)
        if name and drives:
            yield Taught(name, vehicle_file_of(logs) or "", drives[-_DRIVES_MAX:], events)


class _Learned(NamedTuple):
    """`outliers` by the truck's name."""

    population: Population
    outliers: Mapping[str, Outlier]


def _learned(trucks: Sequence[Taught]) -> _Learned | None:
    """Of the trucks with several loads; None where they are too few."""
    priors = priors_of()
    chosen = [truck for truck in trucks if has_several_loads(truck.drives, priors)]
    if len(chosen) < TRUCKS_MIN:
        return None
    some = chosen[:: 1 + (len(chosen) - 1) // _TRUCKS_MAX]  # of all depots, where names begin with theirs
    probability = _core.default_params()["set_up_probability_1"]
    found = population_of([truck.drives for truck in some], priors, probability, [truck.events for truck in some])
    return _Learned(found, {some[one.at].name: one for one in found.outliers})


def _values(found: Population) -> dict[str, tuple[Learned, float]]:
    """By key, and the key's unit in SI or rad."""
    values = {
        "pull_sd_m_s2": (found.pull_sd, 1.0),
        "play_deg": (found.play_mean, DEGREE),
        "play_sd_deg": (found.play_sd, DEGREE),
        "understeer_gradient_deg_m_s2": (found.gradient_mean, DEGREE),
        "understeer_gradient_sd_deg_m_s2": (found.gradient_sd, DEGREE),
    }
    return values | ({"set_up_probability_1": (found.set_up, 1.0)} if found.set_up is not None else {})


def _lines(found: Population, by_type: Mapping[str, _Learned], outliers: Mapping[str, Outlier]) -> Iterator[str]:
    trucks = found.pull_sd.trucks
    today = datetime.now(UTC).date().isoformat()
    yield f"# Priors that {trucks} trucks teach, by oncenter {_core.version()} on {today}: oncenter fleet priors."
    yield "# Each value has its standard error beside it. A vehicle file reads them by [priors] with from = this file."
    yield "# All trucks; a type below, the name of its vehicle file, replaces them."
    yield entry("schema", SCHEMA)
    yield ""
    yield "[priors]"
    yield from _table(found)
    for stem, own in by_type.items():
        yield ""
        yield f"[types.{entry(stem, 0).rpartition(' = ')[0]}]"
        yield from _table(own.population)
    if outliers:
        yield ""
        yield "# Trucks whose pull is outside the spread of the others, and does not count for it."
        yield f"[{OUTLIERS}]"
    for name, one in outliers.items():
        values = {"pull_m_s2": round(one.pull, _DIGITS), "pull_error_m_s2": round(one.pull_sd, _DIGITS)}
        yield entry(name, values)


def _of_outlier(named: tuple[str, Outlier]) -> str:
    """The line of a truck that does not count: observation, meaning, action."""
    name, one = named
    return (
        f"{name}: pull {one.pull:+.2f} ± {one.pull_sd:.2f} m/s^2, outside the spread of the others. It does not count "
        "for that spread. Align its wheels, or give it its own vehicle file with pull_m_s2 and pull_sd_m_s2"
    )


def _table(found: Population) -> Iterator[str]:
    yield entry("trucks", found.pull_sd.trucks)
    for key, (learned, unit) in _values(found).items():
        yield entry(key, round(learned.value / unit, _DIGITS))
        yield entry(error_key(key), round(learned.error / unit, _DIGITS))


def _words(found: Population) -> str:
    parts = [
        f"pull sd {found.pull_sd.value:.3f} ± {found.pull_sd.error:.3f} m/s^2",
        f"play {found.play_mean.value / DEGREE:.1f} deg (sd {found.play_sd.value / DEGREE:.1f})",
        f"understeer gradient {found.gradient_mean.value / DEGREE:.2f} deg/(m/s^2) "
        f"(sd {found.gradient_sd.value / DEGREE:.2f})",
    ]
    if found.set_up is not None:
        parts.append(f"{100.0 * found.set_up.value:.0f} axles in 100 set up for the crown")
    return f"{found.pull_sd.trucks} trucks with several loads: {', '.join(parts)}"
