"""The core against the oracle: two derivations of the same answers, tick by tick and at the end of the drive."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import oracle
import pytest
from random_drives import RATIO, WHEELBASE, Array, Truth, damaged, drive

from oncenter import _core
from oncenter._native import lib

RATES = (20.0, 50.0, 100.0, 128.7, 200.0)
ANGLE = "steering_wheel_angle_rad"
NANODEGREE = np.radians(1e-9)


@pytest.fixture(autouse=True)
def _one_student(monkeypatch: pytest.MonkeyPatch) -> None:
    """Student's t is judged in test_core_estimate.py; here its approximation would hide other differences."""
    monkeypatch.setattr(oracle, "few_batches", lambda n: lib.oc_few_batches_factor(float(n)))


def both(
    columns: Mapping[str, Array], rate_hz: float, **params: float
) -> tuple[oracle.Answer, dict[str, Any], np.ndarray[Any, Any]]:
    core = _core.Core(WHEELBASE, RATIO, params, rate_hz)
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core.run(columns, outputs)
    heard = dict(columns) | {ANGLE: np.where(discarded(columns, outputs), np.nan, columns[ANGLE])}
    expected = oracle.estimate(heard, WHEELBASE, RATIO, {**_core.default_params(), **params}, rate_hz)
    return expected, core.answer(), outputs


def discarded(columns: Mapping[str, Array], outputs: np.ndarray[Any, Any]) -> npt.NDArray[np.bool_]:
    """Ticks whose angle the sensor check, which the oracle has not, kept from the method: there all signals are
    available, and still one is missing."""
    available = np.all([np.abs(column) < 1e30 for column in columns.values()], axis=0)
    return available & (outputs["reasons"] == _core.REASONS["missing_signal"])


def agree(expected: oracle.Answer, answer: dict[str, Any], outputs: np.ndarray[Any, Any]) -> None:
    different = np.flatnonzero(outputs["reasons"] != expected.reasons)
    assert not len(different), [(k, int(outputs["reasons"][k]), int(expected.reasons[k])) for k in different[:5]]
    offset, understeer = answer["offset"], answer["understeer_gradient"]
    assert abs(offset["value"] - expected.offset) < NANODEGREE
    assert abs(answer["offset_temporary"] - expected.offset_temporary) < NANODEGREE
    assert abs(understeer["value"] - expected.understeer) < NANODEGREE
    assert offset["standard_deviation"] == pytest.approx(expected.offset_sd, rel=1e-8)
    assert understeer["standard_deviation"] == pytest.approx(expected.understeer_sd, rel=1e-6)
    assert answer["offset_variance_if_independent"] == pytest.approx(expected.offset_variance_if_independent, rel=1e-8)
    assert _core.STATUSES[offset["status"]] == expected.offset_status
    assert _core.STATUSES[understeer["status"]] == expected.understeer_status
    assert answer["offset_per_yaw_rate_bias"] == pytest.approx(expected.offset_per_yaw_rate_bias, rel=1e-10)
    assert offset["evidence"] == pytest.approx(expected.used, abs=1e-9)
    assert understeer["evidence"] == pytest.approx(expected.understeer_evidence, abs=1e-9)
    rejected = dict.fromkeys(_core.REASONS, 0.0) | expected.rejected  # other methods' reasons are not the thesis's
    assert dict(zip(_core.REASONS, answer["rejected"], strict=True)) == pytest.approx(rejected, abs=1e-9)
    for name in ("bank_mean", "bank_time", "duration", "used", "unused"):
        assert answer[name] == pytest.approx(getattr(expected, name), abs=1e-9), name
    for ours, theirs in (
        (expected.yaw_rate_bias, answer["yaw_rate_bias"]),
        (expected.standstill_acceleration, answer["standstill_lateral_acceleration"]),
    ):
        assert (ours is None) == (_core.STATUSES[theirs["status"]] == "unobservable")
        if ours is not None:
            assert ours == pytest.approx((theirs["value"], theirs["standard_deviation"]), rel=1e-9)


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("seed", [0, 3])
def test_core_and_oracle_agree_on_a_whole_drive(rate_hz: float, seed: int) -> None:
    expected, answer, outputs = both(drive(seed, rate_hz), rate_hz)
    assert expected.used > 60
    agree(expected, answer, outputs)


@pytest.mark.parametrize("rate_hz", RATES)
@pytest.mark.parametrize("seed", [0, 4])
def test_core_and_oracle_agree_on_a_damaged_drive(rate_hz: float, seed: int) -> None:
    columns = damaged(drive(seed, rate_hz), seed)
    expected, answer, outputs = both(columns, rate_hz)
    assert expected.rejected["gap"] > 0 < expected.rejected["time"]
    agree(expected, answer, outputs)


@pytest.mark.parametrize("rate_hz", [20.0, 100.0])
@pytest.mark.parametrize("hurt", [False, True])
def test_core_and_oracle_agree_without_the_accelerometer(rate_hz: float, hurt: bool) -> None:
    columns = damaged(drive(3, rate_hz), 3) if hurt else drive(3, rate_hz)
    agree(*both(columns, rate_hz, use_accelerometer=0))
    agree(*both({k: v for k, v in columns.items() if not k.startswith("lateral")}, rate_hz, use_accelerometer=0))


def test_a_drive_that_ends_in_the_middle_has_a_temporary_offset() -> None:
    for rows in (9000, 9007, 9013):
        columns = {name: values[:rows] for name, values in drive(5, 100.0, truth=Truth(crown=0.02)).items()}
        expected, answer, outputs = both(columns, 100.0)
        assert expected.offset_temporary != expected.offset
        agree(expected, answer, outputs)


@pytest.mark.parametrize("seed", range(12))
def test_core_and_oracle_agree_whatever_the_params(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rate_hz = float(rng.uniform(20.0, 200.0))
    cutoff_hz = float(rng.uniform(1.0, 8.0))
    params = {
        "cutoff_hz": cutoff_hz,
        "delay_band_hz": cutoff_hz * float(rng.uniform(0.1, 0.99)),
        "speed_slope_window_s": float(rng.uniform(0.2, 4.0)),
        "gap_max_s": float(rng.uniform(0.01, 1.0)),
        "curvature_max_1_m": float(rng.uniform(5e-4, 0.01)),
        "clean_time_s": float(rng.uniform(0.1, 4.0)),
        "batch_s": float(rng.uniform(0.2, 10.0)),
        "offset_evidence_min_s": float(rng.uniform(0.0, 20.0)),
        "understeer_evidence_min_s": float(rng.uniform(0.0, 5.0)),
        "understeer_half_width_max_rad_m_s2": float(rng.uniform(1e-4, 1e-2)),
        "standstill_settling_s": float(rng.uniform(0.0, 2.0)),
    }
    columns = drive(seed, rate_hz, 120.0)
    agree(*both(damaged(columns, seed) if seed % 2 else columns, rate_hz, **params))


def motions(seed: int, rate_hz: float, truth: Truth) -> oracle.Answer:
    return oracle.estimate(drive(seed, rate_hz, truth=truth), WHEELBASE, RATIO, _core.default_params(), rate_hz)


def test_the_recursive_mean_is_the_least_squares_offset_is_the_cores() -> None:
    """(36) tick by tick, (42) at once, and the core's merged blocks."""
    expected, answer, _ = both(drive(0, 100.0), 100.0)
    delta_hat = expected.motion.angle - expected.motion.y + expected.understeer * expected.motion.x  # (37)
    rest = (expected.motion.angle - delta_hat)[expected.straight]
    assert len(rest) > 10_000
    assert abs(oracle.recursive_mean(rest) - np.mean(rest)) < NANODEGREE
    assert abs(oracle.recursive_mean(rest) - answer["offset"]["value"]) < NANODEGREE


def test_the_printed_understeer_equation_is_near_the_slope_where_no_road_banks() -> None:
    """(38) literally, the mean of ratios, against the slope; on a banked road it is far off, so it is not used."""
    flat, banked = (motions(3, 100.0, replace(Truth(), crown=crown)) for crown in (0.0, 0.15))

    def literal(drive: oracle.Answer) -> float:
        return oracle.understeer_literal(drive.motion, drive.bends, drive.offset, RATIO, WHEELBASE, 0.3)

    assert len(flat.bends) > 1000 < len(banked.bends)
    assert literal(flat) == pytest.approx(flat.understeer, rel=0.05)
    assert flat.understeer == pytest.approx(Truth().understeer, rel=0.05)
    assert banked.understeer == pytest.approx(Truth().understeer, rel=0.05)
    assert abs(literal(banked) - Truth().understeer) > 2 * abs(banked.understeer - Truth().understeer)


def test_play_moves_the_offset_by_its_mean_place_and_no_further_than_its_half() -> None:
    """(49)-(51): the mean of B[k] over the ticks used, seen by nobody; on one flank for ever it is half the play."""
    columns = drive(0, 100.0)
    half = np.radians(2.0)  # little enough for a standstill with straight wheels
    without = both(columns, 100.0, understeer_evidence_min_s=1e5)[0]
    flank = np.where(np.sin(2 * np.pi * columns["time_s"] / 17.0) > -0.6, half, -half)  # mostly the left one
    for place in (flank, np.full_like(flank, half), np.full_like(flank, -half)):
        played = columns | {"steering_wheel_angle_rad": columns["steering_wheel_angle_rad"] + place}
        expected, answer, outputs = both(played, 100.0, understeer_evidence_min_s=1e5)
        agree(expected, answer, outputs)
        delay = oracle.mean_group_delay(3.0, 2.0, 100.0) * 100.0
        error = np.mean(oracle.delayed(place, delay)[expected.straight])
        assert answer["offset"]["value"] - without.offset == pytest.approx(error, abs=1e-12)
        assert abs(error) <= half + 1e-12
        assert abs(error) > half / 3
