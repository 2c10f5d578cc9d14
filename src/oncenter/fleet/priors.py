"""`oncenter fleet priors`: the priors that a fleet's trucks teach, by type, as a file that vehicle files read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.files.toml_text import entry
from oncenter.files.whole_file import check_place, write_whole
from oncenter.fleet.sql import result_of
from oncenter.fleet.summaries import params_of_drive, row_of_drive
from oncenter.learned_priors import SCHEMA, error_key
from oncenter.signals import DEGREE
from oncenter.truck.population import TRUCKS_MIN, Drives, Learned, Population, has_several_loads, population_of
from oncenter.truck.priors import priors_of
from oncenter.truck.row import Row

_DRIVES_MAX = 40  # of a truck, the newest: more add little to what its loads say
_GIVEN = ("known_pull_sd_m_s2", "known_play_sd_rad")  # params of a drive
_TRUCKS_MAX = 1000  # of a type
_DIGITS = 4


def write_priors(output: Path, path: Path) -> str:
    """Writes the file, and says in a line of what.

    Raises:
        OncenterError: "output", exit code 2: no tables of a run. "too_few_loads", exit code 1: too few trucks were
            driven at several loads, and there is no file.
    """
    check_place(path)
    trucks = _by_truck(result_of("SELECT * FROM drives ORDER BY truck, start", output).to_dicts())
    everyone = [drives for _, drives in trucks]
    found = _learned(everyone)
    if found is None:
        several = sum(has_several_loads(drives, priors_of()) for drives in everyone)
        raise OncenterError(
            f"no priors: {several} of {len(everyone)} trucks were driven at loads whose understeer gradients differ by "
            f"20 % or more, {TRUCKS_MIN} are needed; one load cannot separate a pull from an accelerometer bias. "
            "Drives answered by a given pull or play do not count",
            code="too_few_loads",
        )
    types = {stem: [drives for one, drives in trucks if one == stem] for stem in sorted({stem for stem, _ in trucks})}
    by_type = {stem: own for stem, drives in types.items() if stem and (own := _learned(drives)) is not None}
    write_whole(path, "\n".join(_lines(found, by_type)) + "\n")
    return f"{path}: {_words(found)}"


def _by_truck(rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, Drives]]:
    """Vehicle file and drives of each truck, without those answered by a given pull or play: learned ones are no
    evidence."""
    trucks: dict[str, tuple[str, list[Row]]] = {}
    for drive in rows:
        params = params_of_drive(drive)
        teaches = drive["copy_of"] is None and drive["truck"] and not any(params[given] for given in _GIVEN)
        row = row_of_drive(drive) if teaches else None
        if row is not None:
            trucks.setdefault(drive["truck"], (drive["vehicle_file"] or "", []))[1].append(row)
    return [(stem, drives[-_DRIVES_MAX:]) for stem, drives in trucks.values()]


def _learned(trucks: Sequence[Drives]) -> Population | None:
    """Of the trucks with several loads; None where they are too few."""
    priors = priors_of()
    chosen = [drives for drives in trucks if has_several_loads(drives, priors)]
    if len(chosen) < TRUCKS_MIN:
        return None
    some = chosen[:: 1 + (len(chosen) - 1) // _TRUCKS_MAX]  # of all depots, where names begin with theirs
    return population_of(some, priors, _core.default_params()["set_up_probability_1"])


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


def _lines(found: Population, by_type: Mapping[str, Population]) -> Iterator[str]:
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
        yield from _table(own)


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
