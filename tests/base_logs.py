"""One drive of five minutes in every format: the good logs that are mutated. Its offset is valid, with a margin."""

from __future__ import annotations

import re
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import signal_logs
from asammdf import MDF, Signal
from asammdf.blocks.v4_blocks import FileHistory

from oncenter.files.log_formats import OF_BAGS, WRITTEN
from oncenter.simulate import simulate_to_log, truth_files

VEHICLE = Path(__file__).parents[1] / "vehicles" / "scania_r730_4x2.toml"

# Sensors finer than Table 1's, or the offset is not valid after five minutes.
_SCENARIO = """
about = "Five minutes on country roads with fine sensors."
base = "thesis_drive"
[drive]
duration_s = 300.0
[driver]
speed_km_h = [60.0, 85.0]
[sensors.yaw_rate]
noise_sd_deg_s = 0.02
resolution_deg_s = 0.01
[sensors.lateral_acceleration]
noise_sd_m_s2 = 0.02
resolution_m_s2 = 0.01
"""
_NEEDED = ("steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2")
Writer = Callable[[pl.DataFrame, Path], None]
_START = datetime(2016, 6, 15, 12, tzinfo=UTC)
_SAVED = re.compile(rb"\w{3} \w{3} [ \d]\d \d\d:\d\d:\d\d \d{4}(?=: updated by)")  # asammdf writes the time
_UNITS = {"rad": "rad", "rad_s": "rad/s", "m_s": "m/s", "m_s2": "m/s²"}
_STEPS = {"rad": 1 / 1024, "rad_s": 1 / 8192, "m_s": 1 / 256, "m_s2": 1 / 2048}  # of integer channels


def write_base_logs(folder: Path) -> dict[str, tuple[Path, ...]]:
    """Logs by format; MF4 (frames, channels) and MDF3 (floats, integers with conversion) have two each."""
    scenario = folder / "five_minutes.toml"
    scenario.write_text(_SCENARIO, encoding="utf-8")
    logs = {suffix[1:]: (folder / f"drive{suffix}",) for suffix in WRITTEN}
    for (log,) in logs.values():
        simulate_to_log(scenario, 1, log)
        for truth in truth_files(log):
            truth.unlink()
    table = pl.read_parquet(folder / "drive.parquet")
    channels, numbers, whole = (folder / name for name in ("channels.mf4", "numbers.mdf", "whole.mdf"))
    _write_channels(table, channels, "4.10", whole_numbers=True)
    _write_channels(table, numbers, "3.30", whole_numbers=False)
    _write_channels(table, whole, "3.30", whole_numbers=True)
    logs |= {"mf4": (*logs["mf4"], channels), "mdf": (numbers, whole)}
    return {**logs, **_written_by_others(table, folder)}


def _written_by_others(table: pl.DataFrame, folder: Path) -> dict[str, tuple[Path, ...]]:
    """MATLAB: one of each version and one of Simulink. Bags have half of the messages, to be quick."""
    since = pl.col("time_s") - pl.col("time_s").min()
    needed = table.select(since, *_NEEDED).filter(pl.all_horizontal(pl.col(_NEEDED).is_not_nan()))
    writers: dict[str, list[Writer]] = {
        "dat": [signal_logs.inca],
        "vbo": [signal_logs.vbo],
        "mat": [signal_logs.mat_5, signal_logs.mat_hdf5, signal_logs.simulink, signal_logs.mat_4],
        **{suffix[1:]: [signal_logs.WRITERS[suffix]] for suffix in OF_BAGS},
    }
    logs = {}
    for log_format, of_format in writers.items():
        logs[log_format] = tuple(folder / f"other{place}.{log_format}" for place in range(len(of_format)))
        for writer, log in zip(of_format, logs[log_format], strict=True):
            writer(needed.gather_every(2) if log.suffix in OF_BAGS else needed, log)
    return logs


def _write_channels(table: pl.DataFrame, path: Path, version: str, *, whole_numbers: bool) -> None:
    with MDF(version=version) as log:
        log.start_time = _START
        log.append([_channel(table, name, whole_numbers) for name in table.columns if name != "time_s"])
        if version >= "4":
            written = FileHistory()
            written.time_stamp, written.comment = _START, "<FHcomment><TX>simulated</TX></FHcomment>"
            log.file_history.append(written)
            log.save(path, overwrite=True, add_history_block=False)
        else:
            log.header.author = "oncenter"  # instead of the user's name
            log.save(path, overwrite=True)
            path.write_bytes(_SAVED.sub(b"Wed Jun 15 12:00:00 2016", path.read_bytes()))


def _channel(table: pl.DataFrame, name: str, whole_numbers: bool) -> Signal:
    unit = next((unit for unit in sorted(_UNITS, key=len, reverse=True) if name.endswith(f"_{unit}")), "")
    values, time = table[name].to_numpy(), table["time_s"].to_numpy()
    conversion: dict[str, Any] | None = None
    if whole_numbers and unit:
        values = np.rint(np.nan_to_num(values) / _STEPS[unit]).astype(np.int16)
        conversion = {"a": _STEPS[unit], "b": 0.0}
    return Signal(values, time, name=name, unit=_UNITS.get(unit, ""), conversion=conversion)
