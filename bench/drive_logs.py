"""One simulated drive as a log of every format that is read."""

from __future__ import annotations

import sys
from pathlib import Path

import polars as pl
from cold import TRUCK, own_vehicle

import oncenter as oc
from oncenter.files.log_formats import SUFFIXES, WRITTEN
from oncenter.files.shipped import shipped
from oncenter.signals import SignalName
from oncenter.simulate import simulate_to_log, truth_files

BY_OTHERS = (".dat", ".mat", ".vbo", ".bag", ".mcap")  # which tests/signal_logs.py writes, where they are read
TESTS = Path(__file__).parents[1] / "tests"


def write_logs(scenario: str, folder: Path, only: tuple[str, ...] = ()) -> dict[str, Path]:
    """The logs by suffix, `only` these if given. Some have a vehicle file of their own, see `cold.vehicle_of`."""
    logs = {
        suffix: folder / f"drive{suffix}"
        for suffix in (*WRITTEN, *BY_OTHERS)
        if suffix in SUFFIXES and (not only or suffix in only)
    }
    for suffix in logs.keys() & set(WRITTEN):
        simulate_to_log(scenario, 1, logs[suffix])
        for truth in truth_files(logs[suffix]):
            truth.unlink()
    by_others = [log for suffix, log in logs.items() if suffix in BY_OTHERS]
    if by_others:
        _write_by_others(scenario, by_others)
    return logs


def _write_by_others(scenario: str, logs: list[Path]) -> None:
    """Signals that an answer needs, where they are numbers."""
    sys.path.append(str(TESTS))
    import signal_logs

    needed = ("steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2")
    table = oc.simulate(scenario)[0].table.select(pl.col("time_s") - pl.col("time_s").min(), *needed)
    table = table.filter(pl.all_horizontal(pl.col(needed).is_not_nan()))
    for log in logs:
        signal_logs.WRITERS[log.suffix](table, log)
        names = signal_logs.names_for(log.suffix)
        if names:
            own_vehicle(log).write_text(_vehicle_with(names), encoding="utf-8")


def _vehicle_with(names: dict[str, SignalName]) -> str:
    """TOML."""
    truck = (shipped("vehicles") / f"{TRUCK}.toml").read_text(encoding="utf-8")
    rows = (
        f'{signal} = {{ name = "{name.name}"' + (f', unit = "{name.unit}"' if name.unit else "") + " }"
        for signal, name in names.items()
    )
    return "\n".join([truck, "[signals]", *rows, ""])
