"""A yaw rate in coarse steps, and a slow log: answered, with an interval that is as wide as they leave it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from planted_faults import RATE_HZ, TRUCK, drive, in_steps

import oncenter as oc
from oncenter import _core
from oncenter.offset.coarse_recording import Coarseness, widened
from oncenter.plausibility import check
from oncenter.signals import DEGREE

PARAMS = _core.default_params()


def slow_log(tmp_path: Path, step_deg_s: float, seed: int, offset_deg: float) -> oc.Signals:
    """A drive of half an hour as a logger at 10 Hz has it."""
    (tmp_path / "drive.toml").write_text(
        'base = "thesis_drive"\n'
        f"[sensors.steering_wheel_angle]\noffset_deg = {offset_deg}\n"
        f"[sensors.yaw_rate]\nresolution_deg_s = {step_deg_s}\nbias_deg_s = 0.2\n"
    )
    signals, _ = oc.simulate(tmp_path / "drive.toml", seed=seed)
    signals.table[::10].write_csv(tmp_path / "drive.csv")
    return oc.read(tmp_path / "drive.csv")


@pytest.mark.parametrize(("seed", "offset_deg"), [(10, 3.65), (18, -0.81), (8, -1.38)])
def test_the_interval_of_a_coarse_log_at_10_hz_contains_the_truth(tmp_path: Path, seed: int, offset_deg: float) -> None:
    signals = slow_log(tmp_path, 1.3, seed, offset_deg)
    assert signals.notes == ("recorded at 10 Hz, resampled to 20 Hz",)
    answer = oc.offset(signals, oc.vehicle("scania_r730_4x2"))
    assert answer.offset.ci95 is not None and answer.offset_ci95_drive is not None
    for low, high in (answer.offset.ci95, answer.offset_ci95_drive):
        assert low <= offset_deg * DEGREE <= high
    assert answer.offset.status != "valid"
    (found,) = [finding for finding in answer.findings if finding.code == "yaw_rate_coarse"]
    assert (found.severity, found.unit) == ("warning", "deg/s") and found.value == pytest.approx(1.3, rel=0.02)
    assert "recorded at 10 Hz" in answer.to_json()
    assert answer.used_s > 1000.0 and not [f for f in check(signals).findings if f.code == "signal_stuck"]


@pytest.mark.parametrize(("seed", "offset_deg"), [(3, -3.31), (10, 3.65), (4, 3.54)])
def test_a_fine_log_at_10_hz_has_a_wider_interval(tmp_path: Path, seed: int, offset_deg: float) -> None:
    """The core's own interval misses two of these three."""
    answer = oc.offset(slow_log(tmp_path, 0.028, seed, offset_deg), oc.vehicle("scania_r730_4x2"))
    assert answer.offset_ci95_drive is not None
    low, high = (bound / DEGREE for bound in answer.offset_ci95_drive)
    assert low <= offset_deg <= high and high - low < 2.5
    codes = {finding.code for finding in answer.findings}
    assert "recorded_slowly" in codes and "yaw_rate_coarse" not in codes


def reported_step(signals: oc.Signals) -> float | None:
    found = [f for f in check(signals, TRUCK).findings if f.code == "signal_coarse" and "yaw rate" in f.text]
    return found[0].value if found else None


@pytest.mark.parametrize("every", [1, 2, 5])
def test_the_step_is_that_of_the_samples_not_of_interpolated_values(every: int) -> None:
    signals = in_steps("yaw_rate", 1.3 * DEGREE)(drive())
    time = signals.table["time_s"].to_numpy()
    between = np.interp(time, time[::every], signals.table["yaw_rate_rad_s"].to_numpy()[::every])
    sources = {**signals.sources, "yaw_rate": replace(signals.sources["yaw_rate"], rate_hz=RATE_HZ / every)}
    table = signals.table.with_columns(pl.Series("yaw_rate_rad_s", between))
    assert reported_step(replace(signals, table=table, sources=sources)) == pytest.approx(1.3)


@pytest.mark.parametrize("values", [np.zeros_like, lambda t: np.where(t < 9.0, 0.0, np.sin(t)), lambda t: np.sin(t)])
def test_a_yaw_rate_without_steps_has_none(values: Callable[[np.ndarray], np.ndarray]) -> None:
    table = drive().table.with_columns(pl.Series("yaw_rate_rad_s", values(drive().table["time_s"].to_numpy())))
    assert reported_step(replace(drive(), table=table)) is None


def estimate(sd: float, status: str = "valid") -> dict[str, float | int]:
    return {"value": 0.1, "standard_deviation": sd, "lean": 0.0, "status": _core.STATUSES.index(status)}


def test_a_step_acts_as_a_yaw_rate_bias_with_the_deviation_of_rounding() -> None:
    native = {
        "offset": estimate(0.3 * DEGREE),
        "offset_parts": {"drive_sd": 0.1 * DEGREE},
        "yaw_rate_bias": estimate(0.0),
        "offset_per_yaw_rate_bias": 4.0,
    }
    wider = widened(native, Coarseness(1.2 * DEGREE, 0.0), "joint", PARAMS)
    by_step = 4.0 * 1.2 / np.sqrt(12.0)
    assert wider["offset"]["standard_deviation"] / DEGREE == pytest.approx(np.hypot(0.3, by_step))
    assert wider["offset_parts"]["drive_sd"] / DEGREE == pytest.approx(np.hypot(0.1, by_step))
    assert _core.STATUSES[wider["offset"]["status"]] == "converging"
    small = Coarseness(0.11 * DEGREE, 0.0)
    assert _core.STATUSES[widened(native, small, "joint", PARAMS)["offset"]["status"]] == "valid"
    assert widened(native, Coarseness(0.0, 0.0), "joint", PARAMS) == native
    assert widened(native, Coarseness(1.2, 0.0), "wheel-speed", PARAMS) == native


def test_fewer_samples_per_second_widen_the_drives_part_more() -> None:
    native = {
        "offset": estimate(0.3 * DEGREE),
        "offset_parts": {"drive_sd": 0.1 * DEGREE},
        "yaw_rate_bias": estimate(0.0),
        "offset_per_yaw_rate_bias": 4.0,
    }
    sds = [
        widened(native, Coarseness(0.0, hz), "joint", PARAMS)["offset_parts"]["drive_sd"] for hz in (19.0, 10.0, 5.0)
    ]
    assert 0.1 * DEGREE < sds[0] < sds[1] < sds[2]
    assert sds[1] / DEGREE == pytest.approx(np.hypot(0.2, 0.15))
    wider = widened(native, Coarseness(0.0, 10.0), "joint", PARAMS)
    assert wider["offset"]["standard_deviation"] / DEGREE == pytest.approx(np.sqrt(0.3**2 - 0.1**2 + 0.2**2 + 0.15**2))
    assert wider["yaw_rate_bias"] == native["yaw_rate_bias"]


def test_a_yaw_rate_that_stays_through_bends_is_stuck_however_coarse() -> None:
    signals = in_steps("yaw_rate", 1.3 * DEGREE)(drive())
    yaw_rate = signals.table["yaw_rate_rad_s"].to_numpy().copy()
    yaw_rate[round(100 * RATE_HZ) : round(200 * RATE_HZ)] = 0.0
    stuck = replace(signals, table=signals.table.with_columns(pl.Series("yaw_rate_rad_s", yaw_rate)))
    assert "signal_stuck" in {finding.code for finding in check(stuck, TRUCK).findings}
    assert "signal_stuck" not in {finding.code for finding in check(signals, TRUCK).findings}
