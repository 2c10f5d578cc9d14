"""Each row of the table in docs/real_logs.md: a fault of real sensors, planted in drives with a known offset."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import polars as pl
import pytest
from planted_faults import (
    WHEELS,
    Fault,
    axle_in_steps,
    axle_locked,
    both,
    changed,
    delayed,
    held,
    in_steps,
    scaled,
    shifted,
    wheels_swapped,
    without,
)

import oncenter as oc
from oncenter.findings import Finding
from oncenter.plausibility import check
from oncenter.signals import DEGREE, STANDARD_GRAVITY, Signals
from oncenter.simulate import simulate_to_log

PAGE = Path(__file__).parents[1] / "docs" / "real_logs.md"
TRUCK = oc.vehicle("scania_r730_4x2")
SCENARIOS = {"steering wheel angle": ("thesis_drive", "town"), "yaw rate": ("thesis_drive", "town")}  # else one
DURATION_S, RATE_HZ = 600.0, 100.0
MIDDLE_S = DURATION_S / 2
_FINE = f"""
[drive]
duration_s = {DURATION_S}
[sensors.steering_wheel_angle]
resolution_deg = 0.1
[sensors.yaw_rate]
noise_sd_deg_s = 0.025
resolution_deg_s = 0.0
[sensors.lateral_acceleration]
noise_sd_m_s2 = 0.05
resolution_m_s2 = 0.0
"""
ANGLE, YAW_RATE, SPEED = "steering_wheel_angle", "yaw_rate", "vehicle_speed"
LATERAL, LONGITUDINAL = "lateral_acceleration", "longitudinal_acceleration"


class Line(NamedTuple):
    signal: str
    quirk: str
    size: str
    interval: str
    offset_tells: str
    signals_tells: str

    @property
    def key(self) -> tuple[str, str, str]:
        return self[:3]


def lines() -> list[Line]:
    page = PAGE.read_text(encoding="utf-8").partition("\n## ")[0]
    rows = [row.strip("|").split("|") for row in page.splitlines() if row.startswith("| ")]
    return [Line(*(cell.strip() for cell in row)) for row in rows[1:]]


@lru_cache
def scenario_text(name: str) -> str:
    return f'base = "{name}"\n{_FINE}'


@lru_cache
def drive(scenario: str) -> tuple[Signals, float]:
    """The drive with its true offset, rad."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "drive.toml"
        path.write_text(scenario_text(scenario), encoding="utf-8")
        signals, truth = oc.simulate(path, seed=1)
    return signals, truth.offset_rad


@lru_cache
def frames(scenario: str) -> tuple[str, ...]:
    """The drive as a candump log."""
    with TemporaryDirectory() as folder:
        path, log = Path(folder) / "drive.toml", Path(folder) / "drive.log"
        path.write_text(scenario_text(scenario), encoding="utf-8")
        simulate_to_log(path, 1, log)
        return tuple(log.read_text(encoding="ascii").splitlines())


Spoil = Callable[[str], Signals]


def of_signals(fault: Fault) -> Spoil:
    return lambda scenario: fault(drive(scenario)[0])


def of_table(change: Callable[[pl.DataFrame], pl.DataFrame]) -> Spoil:
    """The drive as a table, with its times, read as a CSV file is."""
    return lambda scenario: oc.from_dataframe(change(drive(scenario)[0].table), TRUCK)


def of_time(change: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    return of_table(lambda table: table.with_columns(pl.Series("time_s", change(table["time_s"].to_numpy()))))


def of_frames(change: Callable[[int, str], list[str]]) -> Spoil:
    """The drive as a candump log of which each line is put through `change(number, line)`."""

    def spoil(scenario: str) -> Signals:
        with TemporaryDirectory() as folder:
            log = Path(folder) / "drive.log"
            spoiled = [new for number, line in enumerate(frames(scenario)) for new in change(number, line)]
            log.write_text("\n".join(spoiled) + "\n", encoding="ascii")
            return oc.read(log)

    return spoil


def during(name: str, from_s: float, to_s: float, change: Callable[[np.ndarray], np.ndarray]) -> Fault:
    return lambda signals: changed(signals, name, lambda x, t: np.where((t >= from_s) & (t < to_s), change(x), x))


def in_second_half(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Fault:
    return during(name, MIDDLE_S, np.inf, change)


def absent(name: str, from_s: float, to_s: float = np.inf) -> Fault:
    return during(name, from_s, to_s, lambda x: np.full_like(x, np.nan))


def stuck(name: str, from_s: float, to_s: float) -> Fault:
    return during(name, from_s, to_s, lambda x: np.full_like(x, x[round(from_s * RATE_HZ)]))


def noisy(name: str, sd: float) -> Fault:
    noise = np.random.default_rng(sum(map(ord, name))).standard_normal
    return lambda signals: changed(signals, name, lambda x, t: x + sd * noise(len(x)))


def held_for(name: str, time_s: float) -> Fault:
    """Sampled and held."""
    every = round(time_s * RATE_HZ)
    return lambda signals: changed(signals, name, lambda x, t: x[np.arange(len(x)) // every * every])


def repeating(name: str, share: float) -> Fault:
    def repeat(x: np.ndarray, t: np.ndarray) -> np.ndarray:
        repeats = np.random.default_rng(sum(map(ord, name))).random(len(x)) < share
        repeats[0] = False
        return x[np.maximum.accumulate(np.where(repeats, 0, np.arange(len(x))))]

    return lambda signals: changed(signals, name, repeat)


def dropping_out(name: str, share: float, for_s: float) -> Fault:
    def drop(x: np.ndarray, t: np.ndarray) -> np.ndarray:
        block = ((t - t[0]) / for_s).astype(int)
        return np.where(np.random.default_rng(5).random(block[-1] + 1)[block] < share, np.nan, x)

    return lambda signals: changed(signals, name, drop)


def wheels(fault: Callable[[str], Fault]) -> Fault:
    return both(*map(fault, WHEELS))


def hrw(step_km_h: float, share: float, noise_m_s: float) -> Fault:
    """`noise_m_s` is that of the left-right difference."""
    noise = noise_m_s / np.sqrt(2.0)
    return wheels(lambda name: both(noisy(name, noise), in_steps(name, step_km_h / 3.6), repeating(name, share)))


def with_spikes(x: np.ndarray, t: np.ndarray) -> np.ndarray:
    return np.where(np.random.default_rng(1).random(len(x)) < 0.001, 10.0, x)


def without_rows(lost: Callable[[np.ndarray], np.ndarray]) -> Fault:
    def cut(signals: Signals) -> Signals:
        kept = ~lost(signals.table["time_s"].to_numpy())
        return replace(signals, table=signals.table.filter(pl.Series(kept)))

    return cut


RELATIVE = scaled("steering_wheel_angle_sensor_type", 0.0)


def no_wheels(signals: Signals) -> Signals:
    return without(signals, *WHEELS)


RESTART = both(in_second_half(ANGLE, lambda x: x + 2 * np.pi), absent(ANGLE, MIDDLE_S, MIDDLE_S + 5.0))
VDC2, OTHER_VDC2 = "18F0093E#", "18F0093F#"


def second_sender(angle_bits: int) -> Callable[[int, str], list[str]]:
    """A second sender: beside each frame of VDC2 another one, its angle so many bits of 1/1024 rad more."""

    def double(_: int, line: str) -> list[str]:
        before, vdc2, data = line.partition(VDC2)
        if not vdc2:
            return [line]
        angle = int.from_bytes(bytes.fromhex(data[:4]), "little") + angle_bits
        return [line, before + OTHER_VDC2 + angle.to_bytes(2, "little").hex().upper() + data[4:]]

    return double


def another_address(number: int, line: str) -> list[str]:
    return [line.replace(VDC2, OTHER_VDC2) if number > len(frames("thesis_drive")) // 2 else line]


def trembling(time: np.ndarray) -> np.ndarray:
    return time + np.random.default_rng(3).uniform(-0.02, 0.02, len(time))


_SIGNALS: dict[tuple[str, str, str], Fault] = {
    ("steering wheel angle", "steps", "0.1 deg"): in_steps(ANGLE, 0.1 * DEGREE),
    ("steering wheel angle", "steps", "1 deg"): in_steps(ANGLE, 1.0 * DEGREE),
    ("steering wheel angle", "steps", "2 deg"): in_steps(ANGLE, 2.0 * DEGREE),
    ("steering wheel angle", "steps", "4 deg"): in_steps(ANGLE, 4.0 * DEGREE),
    ("steering wheel angle", "repeats the last value", "30 % of samples"): repeating(ANGLE, 0.3),
    ("steering wheel angle", "repeats the last value", "for 0.1 s"): held_for(ANGLE, 0.1),
    ("steering wheel angle", "repeats the last value", "for 0.5 s"): held_for(ANGLE, 0.5),
    ("steering wheel angle", "repeats the last value", "for 1 s"): held_for(ANGLE, 1.0),
    ("steering wheel angle", "late", "0.06 s"): delayed(ANGLE, 0.06),
    ("steering wheel angle", "late", "0.1 s"): delayed(ANGLE, 0.1),
    ("steering wheel angle", "late", "0.3 s"): delayed(ANGLE, 0.3),
    ("steering wheel angle", "dropouts", "5 s, 30 % of the time"): dropping_out(ANGLE, 0.3, 5.0),
    ("steering wheel angle", "dropouts", "0.1 s, 30 % of the time"): dropping_out(ANGLE, 0.3, 0.1),
    ("steering wheel angle", "begins after the log", "120 s"): absent(ANGLE, 0.0, 120.0),
    ("steering wheel angle", "ends before the log", "3 s"): absent(ANGLE, DURATION_S - 3.0),
    ("steering wheel angle", "ends before the log", "300 s"): absent(ANGLE, MIDDLE_S),
    ("steering wheel angle", "wrong sign", "whole drive"): scaled(ANGLE, -1.0),
    ("steering wheel angle", "wrong unit: deg as rad", "whole drive"): scaled(ANGLE, 1.0 / DEGREE),
    ("steering wheel angle", "gain", "1.05"): scaled(ANGLE, 1.05),
    ("steering wheel angle", "constant zero error", "30 deg"): shifted(ANGLE, 30.0 * DEGREE),
    ("steering wheel angle", "whole turn, absolute sensor", "360 deg"): shifted(ANGLE, 2 * np.pi),
    ("steering wheel angle", "whole turn, relative sensor", "360 deg"): both(RELATIVE, shifted(ANGLE, 2 * np.pi)),
    (
        "steering wheel angle",
        "restarts a whole turn off, relative sensor",
        "360 deg, 5 s without angle",
    ): both(RELATIVE, RESTART),
    ("steering wheel angle", "restarts a whole turn off, absolute sensor", "360 deg, 5 s without angle"): RESTART,
    ("steering wheel angle", "single spikes", "573 deg, 1 of 1000 samples"): lambda s: changed(s, ANGLE, with_spikes),
    ("yaw rate", "steps", "0.028 deg/s"): in_steps(YAW_RATE, 0.028 * DEGREE),
    ("yaw rate", "steps", "0.1 deg/s"): in_steps(YAW_RATE, 0.1 * DEGREE),
    ("yaw rate", "steps", "0.25 deg/s"): in_steps(YAW_RATE, 0.25 * DEGREE),
    ("yaw rate", "steps", "1.3 deg/s"): in_steps(YAW_RATE, 1.3 * DEGREE),
    ("yaw rate", "noise", "0.1 deg/s"): noisy(YAW_RATE, 0.1 * DEGREE),
    ("yaw rate", "repeats the last value", "30 % of samples"): repeating(YAW_RATE, 0.3),
    ("yaw rate", "repeats the last value", "for 1 s"): held_for(YAW_RATE, 1.0),
    ("yaw rate", "late", "0.06 s"): delayed(YAW_RATE, 0.06),
    ("yaw rate", "late", "0.1 s"): delayed(YAW_RATE, 0.1),
    ("yaw rate", "late, no wheel speeds", "0.3 s"): both(no_wheels, delayed(YAW_RATE, 0.3)),
    ("yaw rate", "late", "0.6 s"): delayed(YAW_RATE, 0.6),
    ("yaw rate", "dropouts", "5 s, 30 % of the time"): dropping_out(YAW_RATE, 0.3, 5.0),
    ("yaw rate", "ends before the log", "300 s"): absent(YAW_RATE, MIDDLE_S),
    ("yaw rate", "stuck while it drives", "100 s"): stuck(YAW_RATE, 200.0, 300.0),
    ("yaw rate", "wrong sign", "whole drive"): scaled(YAW_RATE, -1.0),
    ("yaw rate", "wrong unit: deg/s as rad/s", "whole drive"): scaled(YAW_RATE, 1.0 / DEGREE),
    ("yaw rate", "gain", "1.05"): scaled(YAW_RATE, 1.05),
    ("yaw rate", "constant zero error", "2 deg/s"): shifted(YAW_RATE, 2.0 * DEGREE),
    ("yaw rate", "constant zero error, no wheel speeds", "2 deg/s"): both(no_wheels, shifted(YAW_RATE, 2.0 * DEGREE)),
    ("yaw rate", "another zero in mid-drive", "0.2 deg/s"): in_second_half(YAW_RATE, lambda x: x + 0.2 * DEGREE),
    ("yaw rate", "another zero in mid-drive", "1 deg/s"): in_second_half(YAW_RATE, lambda x: x + 1.0 * DEGREE),
    ("yaw rate", "another zero in mid-drive, no wheel speeds", "0.2 deg/s"): both(
        no_wheels, in_second_half(YAW_RATE, lambda x: x + 0.2 * DEGREE)
    ),
    ("yaw rate", "another zero in mid-drive, no wheel speeds", "1 deg/s"): both(
        no_wheels, in_second_half(YAW_RATE, lambda x: x + 1.0 * DEGREE)
    ),
    ("yaw rate", "another sign in mid-drive", "second half"): in_second_half(YAW_RATE, lambda x: -x),
    ("yaw rate", "another unit in mid-drive: deg/s as rad/s", "second half"): in_second_half(
        YAW_RATE, lambda x: x / DEGREE
    ),
    ("vehicle speed", "steps", "1 km/h"): in_steps(SPEED, 1.0 / 3.6),
    ("vehicle speed", "steps", "2 km/h"): in_steps(SPEED, 2.0 / 3.6),
    ("vehicle speed", "repeats the last value", "for 0.1 s"): held_for(SPEED, 0.1),
    ("vehicle speed", "repeats the last value", "for 1 s"): held_for(SPEED, 1.0),
    ("vehicle speed", "late", "0.2 s"): delayed(SPEED, 0.2),
    ("vehicle speed", "late", "1 s"): delayed(SPEED, 1.0),
    ("vehicle speed", "gain", "1.05"): scaled(SPEED, 1.05),
    ("vehicle speed", "gain", "1.1"): scaled(SPEED, 1.1),
    ("vehicle speed", "wrong unit: km/h as m/s", "whole drive"): scaled(SPEED, 3.6),
    ("vehicle speed", "reads zero", "whole drive"): scaled(SPEED, 0.0),
    ("vehicle speed", "ends before the log", "300 s"): absent(SPEED, MIDDLE_S),
    ("vehicle speed", "stuck while it drives", "300 s"): stuck(SPEED, MIDDLE_S, DURATION_S),
    ("lateral acceleration", "steps", "0.1 m/s^2"): in_steps(LATERAL, 0.1),
    ("lateral acceleration", "steps", "0.25 m/s^2"): in_steps(LATERAL, 0.25),
    ("lateral acceleration", "noise", "0.3 m/s^2"): noisy(LATERAL, 0.3),
    ("lateral acceleration", "repeats the last value", "for 0.1 s"): held_for(LATERAL, 0.1),
    ("lateral acceleration", "repeats the last value", "for 1 s"): held_for(LATERAL, 1.0),
    ("lateral acceleration", "late", "0.2 s"): delayed(LATERAL, 0.2),
    ("lateral acceleration", "late", "0.5 s"): delayed(LATERAL, 0.5),
    ("lateral acceleration", "dropouts", "5 s, 30 % of the time"): dropping_out(LATERAL, 0.3, 5.0),
    ("lateral acceleration", "ends before the log", "300 s"): absent(LATERAL, MIDDLE_S),
    ("lateral acceleration", "wrong sign", "whole drive"): scaled(LATERAL, -1.0),
    ("lateral acceleration", "wrong unit: g as m/s^2", "whole drive"): scaled(LATERAL, 1.0 / STANDARD_GRAVITY),
    ("lateral acceleration", "gain", "1.1"): scaled(LATERAL, 1.1),
    ("lateral acceleration", "constant zero error", "0.5 m/s^2"): shifted(LATERAL, 0.5),
    ("lateral acceleration", "another zero in mid-drive", "0.5 m/s^2"): in_second_half(LATERAL, lambda x: x + 0.5),
    ("lateral acceleration", "absent", "whole drive"): lambda s: without(s, LATERAL),
    ("longitudinal acceleration", "wrong sign", "whole drive"): scaled(LONGITUDINAL, -1.0),
    ("longitudinal acceleration", "constant zero error", "1 m/s^2"): shifted(LONGITUDINAL, 1.0),
    ("longitudinal acceleration", "stuck at zero", "whole drive"): scaled(LONGITUDINAL, 0.0),
    ("longitudinal acceleration", "absent", "whole drive"): lambda s: without(s, LONGITUDINAL),
    ("wheel speeds", "steps, repeats and noise of HRW", "0.125 km/h, 30 %, 0.06 m/s"): hrw(0.125, 0.3, 0.06),
    ("wheel speeds", "steps, repeats and noise of HRW", "0.5 km/h, 60 %, 0.06 m/s"): hrw(0.5, 0.6, 0.06),
    ("wheel speeds", "steps of EBC2", "0.0625 km/h"): both(
        *(axle_in_steps(axle, 1.0 / 16.0 / 3.6) for axle in ("front", "rear"))
    ),
    ("wheel speeds", "repeat the last value", "for 1 s"): wheels(lambda name: held_for(name, 1.0)),
    ("wheel speeds", "late", "0.1 s"): wheels(lambda name: delayed(name, 0.1)),
    ("wheel speeds", "dropouts", "0.1 s, 30 % of the time"): wheels(lambda name: dropping_out(name, 0.3, 0.1)),
    ("wheel speeds", "end before the log", "300 s"): wheels(lambda name: absent(name, MIDDLE_S)),
    ("wheel speeds", "one wheel larger", "1 %"): scaled("wheel_speed_rear_left", 1.01),
    ("wheel speeds", "one wheel stuck while it drives", "300 s"): held("wheel_speed_rear_left", MIDDLE_S),
    ("wheel speeds", "one wheel reads zero", "whole drive"): scaled("wheel_speed_rear_left", 0.0),
    ("wheel speeds", "locked differential", "rear axle"): axle_locked("rear"),
    ("wheel speeds", "left and right swapped", "both axles"): wheels_swapped,
    ("wheel speeds", "wrong unit: km/h as m/s", "both axles"): wheels(lambda name: scaled(name, 3.6)),
    ("the log", "holes", "10 s each minute"): without_rows(lambda t: t % 60.0 < 10.0),
    ("the log", "one hole", "200 s"): without_rows(lambda t: (t >= 200.0) & (t < 400.0)),
}
QUIRKS: dict[tuple[str, str, str], Spoil] = {key: of_signals(fault) for key, fault in _SIGNALS.items()} | {
    ("the log", "time in ms", "whole drive"): of_table(
        lambda table: table.with_columns(time_ms=1e3 * pl.col("time_s")).drop("time_s")
    ),
    ("the log", "time in ms since 1970 called s", "whole drive"): of_time(lambda t: 1e3 * (1.7e9 + t)),
    ("the log", "stamps tremble, in order", "20 ms"): of_time(lambda t: np.sort(trembling(t))),
    ("the log", "stamps tremble, out of order", "20 ms"): of_time(trembling),
    ("the log", "clock set back in mid-log", "1 h"): of_time(lambda t: np.where(t > MIDDLE_S, t - 3600.0, t)),
    ("the log", "clock set forward in mid-log", "1 h"): of_time(lambda t: np.where(t > MIDDLE_S, t + 3600.0, t)),
    ("the log", "a part is there twice", "10 s"): of_table(lambda table: pl.concat([table[:30_000], table[29_000:]])),
    ("the log", "low sample rate", "10 Hz"): of_table(lambda table: table[::10]),
    ("the log", "low sample rate", "5 Hz"): of_table(lambda table: table[::20]),
    ("the log", "low sample rate", "4 Hz"): of_table(lambda table: table[::25]),
    ("the log", "a second sender of VDC2 that agrees", "0 deg"): of_frames(second_sender(0)),
    ("the log", "a second sender of VDC2 that disagrees", "57 deg"): of_frames(second_sender(1024)),
    ("the log", "VDC2 from another address in mid-drive", "300 s"): of_frames(another_address),
}
# Additional offset of the sensor, deg; for a drive with two zeros, that at its end.
MORE_DEG = {
    ("steering wheel angle", "constant zero error", "30 deg"): 30.0,
    ("steering wheel angle", "whole turn, absolute sensor", "360 deg"): 360.0,
    ("steering wheel angle", "restarts a whole turn off, absolute sensor", "360 deg, 5 s without angle"): 360.0,
}


class Reported(NamedTuple):
    """Codes of all findings; those that are errors, and those that are warnings; notes and the code of a refusal."""

    codes: set[str]
    errors: set[str]
    warnings: set[str]
    notes: str


def reported(findings: tuple[Finding, ...], notes: tuple[str, ...]) -> Reported:
    by_severity = [{each.code for each in findings if each.severity == grave} for grave in ("error", "warning")]
    return Reported({each.code for each in findings}, *by_severity, "; ".join(notes))


@lru_cache
def of_healthy(scenario: str) -> set[str]:
    """The findings of the drive without any fault, and that of an offset so near the limit as the drive's."""
    signals, _ = drive(scenario)
    found = {each.code for each in (*oc.offset(signals, TRUCK).findings, *check(signals, TRUCK).findings)}
    return found | {"steering_wheel_angle_offset"}


def assert_tells(cell: str, found: Reported, usual: set[str]) -> None:
    if cell == "–":
        assert not (found.errors | found.warnings) - usual
    for code in re.findall(r"`(\w+)`", cell.partition("perhaps")[0]):
        assert code in found.codes, found
    for words in re.findall(r'"(.+?)"', cell):
        assert words in found.notes
    assert found.errors - usual <= set(re.findall(r"\w+", cell)), found


def refusal(cell: str) -> str | None:
    found = re.fullmatch(r"refused: `(\w+)`", cell)
    return found[1] if found else None


@pytest.mark.parametrize(
    ("line", "scenario"),
    [(line, scenario) for line in lines() for scenario in SCENARIOS.get(line.signal, ("thesis_drive",))],
    ids=lambda given: given if isinstance(given, str) else ", ".join(given.key),
)
def test_a_row_of_the_table_is_true(line: Line, scenario: str) -> None:
    spoil = QUIRKS[line.key]
    if code := refusal(line.signals_tells):
        with pytest.raises(oc.OncenterError) as refused:
            spoil(scenario)
        assert refused.value.code == code == refusal(line.offset_tells) and line.interval == "no value"
        return
    signals = spoil(scenario)
    assert_tells(line.signals_tells, reported(check(signals, TRUCK).findings, signals.notes), of_healthy(scenario))
    if code := refusal(line.offset_tells):
        with pytest.raises(oc.OncenterError) as refused:
            oc.offset(signals, TRUCK)
        assert refused.value.code == code and line.interval == "no value"
        return
    answer = oc.offset(signals, TRUCK)
    assert_tells(line.offset_tells, reported(answer.findings, signals.notes), of_healthy(scenario))
    offset_rad = drive(scenario)[1] + MORE_DEG.get(line.key, 0.0) * DEGREE
    if line.interval == "no value":
        assert answer.offset.value is None
    elif line.interval == "holds":
        assert answer.offset.ci95 is not None
        low, high = answer.offset.ci95
        assert low <= offset_rad <= high, [round(bound / DEGREE, 2) for bound in (low, offset_rad, high)]
    else:
        assert line.interval == "not always" and (line.offset_tells, line.signals_tells) != ("–", "–")


def test_each_row_has_a_fault_and_each_fault_a_row() -> None:
    assert sorted(line.key for line in lines()) == sorted(QUIRKS)
    assert set(MORE_DEG) <= set(QUIRKS)


def test_each_row_about_files_names_a_test() -> None:
    of_files = PAGE.read_text(encoding="utf-8").partition("\n## ")[2].partition("\n## Slow and noisy logs")[0]
    rows = [line for line in of_files.splitlines() if line.startswith("| ") and not line.startswith("| quirk ")]
    files = {path.name: path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("test_*.py")}
    tests = "".join(files.values())
    assert len(rows) > 20
    for row in rows:
        named = re.findall(r"`(test_[\w.]+)`", row.rstrip("| ").rpartition(" | ")[2])
        assert named, row
        assert all(name in files or f"def {name}(" in tests for name in named), row
