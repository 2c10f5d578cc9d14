"""Lag and interval of the steering wheel angle without its sensor, by steering rate.

    python bench/angle_lag.py [--tuning] [--smoke] [--jobs N] [--page]

Ten minutes with the sensor, then without it. `weave` is sines of 15 deg at 80 km/h; its truck is learned from ten
minutes of an ordinary drive with the same play, so that no sine is learned. Seeds 11 to 20 are for reporting, seeds
1 to 3 (--tuning) for tuning. --page writes the tables into docs/angle.md.
"""

from __future__ import annotations

import argparse
import cmath
import math
import multiprocessing
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain, pairwise, repeat
from pathlib import Path

import numpy as np
from angle_drives import LEARNING_S, AngleDrive, Array, Table, named, simulated
from sections import between

import oncenter as oc
from oncenter.signals import DEGREE

SCENARIOS = ("weave", "town", "yard", "thesis_drive", "heavy_play")
TEACHERS = {"weave": ("thesis_drive", 3.0), "weave, play 15 deg": ("heavy_play", 15.0)}  # with their play, deg
RATES_DEG_S = (0.0, 5.0, 20.0, 60.0, 150.0)
FREQUENCIES_HZ = (0.1, 0.2, 0.3, 0.4, 0.5)
BEGIN_S, CYCLES, PAUSE_S, END_S, ROUNDS = 45.0, 8, 5.0, 60.0, 6
WALKING_M_S = 1.2  # below, the angle is held
ENOUGH_S = 30.0  # of a class in a scenario, for its coverage to be asked
COVERAGE_MIN, SPREAD_MIN, SPREAD_MAX = 0.92, 0.25, 1.5
WEAVE_RMS_MAX_DEG = 2.0  # of `weave` at 0.5 Hz
PAGE = Path(__file__).parents[1] / "docs" / "angle.md"
BEGIN, END = "<!-- bench/angle_lag.py --page -->", "<!-- end of lag -->"


@dataclass(frozen=True)
class Ticks:
    """Ticks without sensor of one drive, deg and s; `sines` has the frequency and rows of each sine of a weave."""

    error: Array
    sd: Array
    true: Array
    delay: Array
    moving: Array
    sines: tuple[tuple[float, slice], ...] = ()

    def of(self, rows: Array | slice) -> Ticks:
        return Ticks(self.error[rows], self.sd[rows], self.true[rows], self.delay[rows], self.moving[rows])


def weave(seed: int, play_deg: float, rounds: int, folder: Path) -> AngleDrive:
    manoeuvre = {
        "kind": "weave",
        "begin_s": BEGIN_S,
        "amplitude_deg": 15.0,
        "frequency_hz": list(FREQUENCIES_HZ) * rounds,
        "cycles": CYCLES,
        "pause_s": PAUSE_S,
    }
    values: Table = {
        "base": "weave",
        "about": "drawn",
        "drive": {"duration_s": BEGIN_S + rounds * sum(CYCLES / hz + PAUSE_S for hz in FREQUENCIES_HZ) + END_S},
        "driver": {"speed_km_h": [80.0, 80.0]},
        "steering": {"backlash_deg": play_deg},
        "manoeuvre": manoeuvre,
    }
    return simulated(values, seed, folder)


def sines(rounds: int, rate_hz: float) -> Iterator[tuple[float, slice]]:
    begin_s = BEGIN_S
    for hz in FREQUENCIES_HZ * rounds:
        end_s = begin_s + CYCLES / hz
        yield hz, slice(round(begin_s * rate_hz), round(end_s * rate_hz))
        begin_s = end_s + PAUSE_S


def ticks_of(scenario: str, seed: int, rounds: int) -> Ticks:
    learning = round(LEARNING_S * 100.0)
    if scenario not in TEACHERS:
        drive = named(scenario, seed)
        table = oc.angle(drive.signals, drive.vehicle, sensor_lost_at=LEARNING_S)
        return _ticks(drive, table).of(slice(learning, None))
    teacher, play_deg = TEACHERS[scenario]
    taught = named(teacher, seed).signals
    with tempfile.TemporaryDirectory() as folder:
        drive = weave(seed, play_deg, rounds, Path(folder))
    first_minutes = replace(taught, table=taught.table.head(learning))
    table = oc.angle(drive.signals, drive.vehicle, sensor_lost_at=0.0, taught_by=[first_minutes])
    return replace(_ticks(drive, table), sines=tuple(sines(rounds, drive.signals.rate_hz)))


def _ticks(drive: AngleDrive, table: object) -> Ticks:
    angle, sd, delay = (
        table[name].to_numpy() for name in ("steering_wheel_angle_rad", "standard_deviation_rad", "delay_s")
    )
    true = drive.true_rad / DEGREE
    return Ticks(angle / DEGREE - true, sd / DEGREE, true, delay, drive.speed_m_s > WALKING_M_S)


def interval_table(drives: Mapping[str, Sequence[Ticks]]) -> list[str]:
    head = "| Scenario | Steering rate, deg/s | s | Interval covers | error²/sd² | Half-width, deg | RMS, deg |"
    lines = [head, "|---|---|--:|--:|--:|--:|--:|"]
    for name, several in {"all": list(chain(*drives.values())), **drives}.items():
        error, sd, rate = (
            np.concatenate(parts)
            for parts in zip(*((d.error[d.moving], d.sd[d.moving], _rate(d)[d.moving]) for d in several), strict=True)
        )
        for low, high in pairwise(RATES_DEG_S):
            here = (rate >= low) & (rate < high)
            seconds = np.count_nonzero(here) / 100.0
            if seconds < (0.0 if name == "all" else ENOUGH_S):
                continue
            covered, spread = np.mean(np.abs(error[here]) < 1.96 * sd[here]), np.mean((error[here] / sd[here]) ** 2)
            fits = name != "all" or low < RATES_DEG_S[1] or SPREAD_MIN <= spread <= SPREAD_MAX
            lines.append(
                f"| {name} | {low:g} to {high:g} | {seconds:.0f} "
                f"| {_judged(f'{covered:.1%}', covered >= COVERAGE_MIN)} | {_judged(f'{spread:.2f}', fits)} "
                f"| {1.96 * np.median(sd[here]):.2f} | {_rms(error[here]):.2f} |"
            )
    return lines


def lag_table(drives: Mapping[str, Sequence[Ticks]]) -> list[str]:
    """Gain and phase are of the estimate's first harmonic over the true angle's."""
    head = "| Drive | Frequency, Hz | Gain | Phase, deg | Lag, s | `delay_s` | Interval covers | RMS, deg |"
    lines = [head, "|---|--:|--:|--:|--:|--:|--:|--:|"]
    for name, several in drives.items():
        for hz in FREQUENCIES_HZ:
            parts = [drive.of(rows) for drive in several for at, rows in drive.sines if at == hz]
            response = _response(parts, hz)
            error, sd = np.concatenate([p.error for p in parts]), np.concatenate([p.sd for p in parts])
            phase = cmath.phase(response)
            asked = name != "weave" or hz < FREQUENCIES_HZ[-1] or _rms(error) <= WEAVE_RMS_MAX_DEG
            lines.append(
                f"| {name} | {hz:g} | {abs(response):.2f} | {math.degrees(phase):.0f} | {-phase / math.tau / hz:.3f} "
                f"| {np.mean(np.concatenate([p.delay for p in parts])):.3f} | {np.mean(np.abs(error) < 1.96 * sd):.1%} "
                f"| {_judged(f'{_rms(error):.2f}', asked)} |"
            )
    return lines


def _response(parts: Sequence[Ticks], hz: float) -> complex:
    given, found = 0.0, 0.0j
    for part in parts:
        turn = np.exp(-2j * np.pi * hz * np.arange(len(part.true)) / 100.0)
        true, error = np.sum(part.true * turn), np.sum(part.error * turn)
        given += abs(true) ** 2
        found += (true + error) * np.conj(true)
    return complex(found / given)


def _rate(ticks: Ticks) -> Array:
    return np.abs(np.gradient(ticks.true)) * 100.0


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _judged(text: str, met: object) -> str:
    return text if met else f"**{text}**"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tuning", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="one seed, two scenarios, short sines")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--page", action="store_true")
    given = parser.parse_args()
    seeds = range(1, 2) if given.smoke else range(1, 4) if given.tuning else range(11, 21)
    names = ("weave", "town") if given.smoke else (*SCENARIOS, *TEACHERS)
    drives: dict[str, list[Ticks]] = {}
    with ProcessPoolExecutor(given.jobs, multiprocessing.get_context("spawn")) as pool:
        for name in dict.fromkeys(names):
            drives[name] = list(pool.map(ticks_of, repeat(name), seeds, repeat(1 if given.smoke else ROUNDS)))
    rates = interval_table({name: drives[name] for name in SCENARIOS if name in drives})
    lags = lag_table({name: drives[name] for name in TEACHERS if name in drives})
    about = (
        f"{len(seeds)} drives a scenario, seeds {seeds[0]} to {seeds[-1]}; **bold** misses what is asked: coverage at "
        f"least {COVERAGE_MIN:.0%}, mean of error²/sd² {SPREAD_MIN:g} to {SPREAD_MAX:g} above 5 deg/s, RMS of "
        f"`weave` at 0.5 Hz at most {WEAVE_RMS_MAX_DEG:g} deg."
    )
    written = "\n".join([about, "", *lags, "", *rates])
    print(written)
    if given.page:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), BEGIN, END, f"\n{written}\n"), encoding="utf-8")


if __name__ == "__main__":
    main()
