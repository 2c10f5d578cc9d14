"""What sensors' noise puts into a second's means, and that it does not flatten what is fitted to them."""

import numpy as np
import pytest
from joint_drives import DEGREE, TIGHT, answer_of, core_for, driven, ran
from oncenter._native import ffi, lib
from scipy.signal import butter, lfilter

SAMPLE_S = 0.1
SEEDS = range(1, 13)
DRIVE_S = 600.0
NOISY_ACCELEROMETER = "[sensors.lateral_acceleration]\nnoise_sd_m_s2 = 0.3\nresolution_m_s2 = 0.0\n"
NOISY_GYRO = "[sensors.yaw_rate]\nnoise_sd_deg_s = 0.6\nresolution_deg_s = 0.0\n"


def design_of(cutoff_hz: float, rate_hz: float) -> object:
    design = ffi.new("oc_noise_design *")
    lowpass = ffi.new("oc_lowpass *", lib.oc_lowpass_design(cutoff_hz, rate_hz))
    lib.oc_noise_setup(design, lowpass, rate_hz, round(SAMPLE_S * rate_hz))
    return design


def told_by(design: object, samples: np.ndarray) -> np.ndarray:
    """The two variances after the samples, shape (n, 2), each of which counts as much as the others."""
    watch, variances = ffi.new("oc_noise_watch *"), ffi.new("float[2]")
    for count, sample in enumerate(samples, 1):
        lib.oc_noise_update(watch, design, [float(value) for value in sample], 1.0 / count, variances)
    return np.array(list(variances))


@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 100.0, 200.0])
@pytest.mark.parametrize("cutoff_hz", [2.0, 3.0, 5.0])
def test_white_noise_in_a_second_s_mean_is_told_from_filtered_samples_at_any_rate_and_cut_off(
    rate_hz: float, cutoff_hz: float
) -> None:
    random = np.random.default_rng(5)
    white = random.normal(0.0, 0.2, (int(2000 * rate_hz), 2))
    filtered = lfilter(*butter(2, cutoff_hz, fs=rate_hz), white, axis=0)
    told = told_by(design_of(cutoff_hz, rate_hz), filtered[:: round(SAMPLE_S * rate_hz)])
    in_means = white.reshape(-1, int(rate_hz), 2).mean(axis=1).var(axis=0)
    assert told == pytest.approx(in_means, rel=0.1)


def test_a_kick_is_no_noise() -> None:
    random = np.random.default_rng(6)
    quiet = random.normal(0.0, [0.02, 0.02 * DEGREE], (3000, 2))
    kicked = quiet.copy()
    kicked[100::300] += [3.0, 20.0 * DEGREE]
    design = design_of(3.0, 100.0)
    assert told_by(design, kicked) == pytest.approx(told_by(design, quiet), rel=0.6)


def test_a_drive_tells_the_noise_that_its_sensors_have() -> None:
    columns, truth = driven(TIGHT + NOISY_ACCELEROMETER + NOISY_GYRO, 1, DRIVE_S)
    core = core_for(truth)
    ran(columns, core)
    of_bank, of_yaw_rate = core.state()["evidence"]["joint"]["second"]["noise"]
    assert of_yaw_rate == pytest.approx((0.6 * DEGREE) ** 2 / 100.0, rel=0.15)
    moving = columns["vehicle_speed_m_s"][columns["vehicle_speed_m_s"] > 8.0]
    of_both = (0.3**2 + (0.6 * DEGREE) ** 2 * float(np.mean(moving**2))) / 100.0
    assert of_bank == pytest.approx(of_both, rel=0.15)


def errors_of(tables: str) -> tuple[float, float]:
    """Means over drives: of the understeer gradient in deg/(m/s^2), and of the equivalent wheelbase as a share."""
    errors = []
    for seed in SEEDS:
        columns, truth = driven(tables, seed, DRIVE_S)
        answer = answer_of(columns, truth)
        gradient = answer["understeer_gradient"]["value"] - truth.understeer_gradient
        wheelbase = answer["equivalent_wheelbase"]["value"] / truth.equivalent_wheelbase_m - 1.0
        errors.append((gradient / DEGREE, wheelbase))
    gradient, wheelbase = np.mean(errors, axis=0)
    return float(gradient), float(wheelbase)


def test_a_noisy_accelerometer_makes_no_truck_understeer_less() -> None:
    gradient, wheelbase = errors_of(TIGHT + NOISY_ACCELEROMETER)
    assert abs(gradient) < 0.02  # of 0.4; -0.05 where noise is taken for side force
    assert abs(wheelbase) < 0.02


def test_a_noisy_gyro_makes_no_truck_shorter() -> None:
    of_quiet, of_noisy = errors_of(TIGHT), errors_of(TIGHT + NOISY_GYRO)
    gradient, wheelbase = np.subtract(of_noisy, of_quiet)
    assert abs(wheelbase) < 0.03  # -0.06 where noise is taken for bends
    assert abs(gradient) < 0.02
