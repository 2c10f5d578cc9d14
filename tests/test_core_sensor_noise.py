"""Sensor noise in a second's means: it is identified and does not flatten fitted slopes."""

import math

import numpy as np
import numpy.typing as npt
import pytest
from joint_drives import RATE_HZ, TIGHT, YAW_RATE, answer_of, core_for, driven, ran
from one_hypothesis import Learner, Play
from one_hypothesis import driven as hypothesis_drive
from scipy.signal import butter, lfilter, sosfilt

from oncenter._native import ffi, lib
from oncenter.signals import DEGREE

Array = npt.NDArray[np.float64]

LATERAL = "lateral_acceleration_m_s2"
SAMPLE_S = 0.1
SEEDS = range(1, 13)
DRIVE_S = 600.0
NOISY_ACCELEROMETER = "[sensors.lateral_acceleration]\nnoise_sd_m_s2 = 0.3\nresolution_m_s2 = 0.0\n"
NOISY_GYRO = "[sensors.yaw_rate]\nnoise_sd_deg_s = 0.6\nresolution_deg_s = 0.0\n"


def shaking(duration_s: float, band_hz: tuple[float, float], rms: float) -> Array:
    """Noise in this band only."""
    white = np.random.default_rng(7).normal(0.0, 1.0, int(duration_s * RATE_HZ) + 1)
    narrow = sosfilt(butter(4, band_hz, "bandpass", fs=RATE_HZ, output="sos"), white)
    return np.asarray(narrow * rms / narrow.std())


class Watch:
    """The core's two estimates of noise, from samples of equal weight."""

    def __init__(self, cutoff_hz: float, rate_hz: float) -> None:
        self.ticks_per_sample = round(SAMPLE_S * rate_hz)
        self.design, self.watch = ffi.new("oc_noise_design *"), ffi.new("oc_noise_watch *")
        self.noise = ffi.new("oc_noise *")
        lowpass = ffi.new("oc_lowpass *", lib.oc_lowpass_design(cutoff_hz, rate_hz))
        lib.oc_noise_setup(self.design, lowpass, rate_hz, self.ticks_per_sample)

    def variances(self, filtered: Array, raw: Array) -> tuple[Array, Array, Array]:
        """Variances of a second's mean: by samples, by ticks, and the combined one; signals of shape (n, 2)."""
        for count, last in enumerate(range(2, len(raw), self.ticks_per_sample), 1):
            lib.oc_noise_tick(self.watch, raw[last - 2].tolist())
            lib.oc_noise_tick(self.watch, raw[last - 1].tolist())
            lib.oc_noise_update(
                self.noise, self.watch, self.design, filtered[last].tolist(), raw[last].tolist(), 1.0 / count
            )
        by_samples, by_ticks = (np.array(list(part)) for part in (self.noise.by_samples, self.noise.by_ticks))
        return by_samples, by_ticks, np.array([lib.oc_noise_in_mean(ffi.addressof(self.noise[0]), k) for k in (0, 1)])


def lowpassed(signals: Array, cutoff_hz: float, rate_hz: float) -> Array:
    return np.asarray(lfilter(*butter(2, cutoff_hz, fs=rate_hz), signals, axis=0))


@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 100.0, 200.0])
@pytest.mark.parametrize("cutoff_hz", [2.0, 3.0, 5.0])
def test_white_noise_in_a_seconds_mean_is_identified_by_samples_and_ticks(rate_hz: float, cutoff_hz: float) -> None:
    white = np.random.default_rng(5).normal(0.0, 0.2, (int(1000 * rate_hz), 2))
    by_samples, by_ticks, _ = Watch(cutoff_hz, rate_hz).variances(lowpassed(white, cutoff_hz, rate_hz), white)
    in_mean = 0.2**2 / rate_hz  # of independent ticks
    assert by_samples == pytest.approx([in_mean] * 2, rel=0.06)
    assert by_ticks == pytest.approx([in_mean] * 2, rel=0.06)


@pytest.mark.parametrize("band_hz", [(1.5, 4.0), (8.0, 15.0)])
def test_vibration_is_hardly_attributed_to_sensor_noise(band_hz: tuple[float, float]) -> None:
    shaken = shaking(1000.0, band_hz, 0.3)[:, np.newaxis] * [1.0, DEGREE]
    _, _, identified = Watch(3.0, RATE_HZ).variances(lowpassed(shaken, 3.0, RATE_HZ), shaken)
    as_if_white = np.array([0.3, 0.3 * DEGREE]) ** 2 / RATE_HZ
    assert np.all(identified < 0.1 * as_if_white)


def test_a_kerb_is_no_noise() -> None:
    quiet = np.random.default_rng(6).normal(0.0, [0.1, 0.1 * DEGREE], (100_000, 2))
    kicked = quiet.copy()
    for begin in range(500, len(kicked), 3000):
        kicked[begin : begin + 20] += [3.0, 20.0 * DEGREE]
    *_, of_quiet = Watch(3.0, RATE_HZ).variances(lowpassed(quiet, 3.0, RATE_HZ), quiet)
    *_, of_kicked = Watch(3.0, RATE_HZ).variances(lowpassed(kicked, 3.0, RATE_HZ), kicked)
    assert of_kicked == pytest.approx(of_quiet, rel=0.2)


def test_a_drive_identifies_the_noise_of_its_sensors() -> None:
    columns, truth = driven(TIGHT + NOISY_ACCELEROMETER + NOISY_GYRO, 1, DRIVE_S)
    core = core_for(truth)
    ran(columns, core)
    noise = core.state()["evidence"]["joint"]["second"]["noise"]
    of_acceleration, of_yaw_rate = noise["by_ticks"]
    assert of_acceleration == pytest.approx(0.3**2 / RATE_HZ, rel=0.1)
    assert of_yaw_rate == pytest.approx((0.6 * DEGREE) ** 2 / RATE_HZ, rel=0.1)
    of_bank, of_yaw_rate = noise["by_samples"]
    moving = columns["vehicle_speed_m_s"][columns["vehicle_speed_m_s"] > 8.0]
    of_both = (0.3**2 + (0.6 * DEGREE) ** 2 * float(np.mean(moving**2))) / RATE_HZ
    assert of_bank == pytest.approx(of_both, rel=0.15)
    assert of_yaw_rate == pytest.approx((0.6 * DEGREE) ** 2 / RATE_HZ, rel=0.15)


def test_without_an_accelerometer_no_noise_is_identified() -> None:
    """Lateral force and curvature then share the yaw rate's noise, which this method does not separate."""
    columns, truth = driven(TIGHT + NOISY_GYRO, 1, DRIVE_S)
    core = core_for(truth, params={"use_accelerometer": 0.0})
    ran(columns, core)
    noise = ffi.new("oc_noise *")
    identified = core.state()["evidence"]["joint"]["second"]["noise"]
    for member in ("by_samples", "by_ticks"):
        setattr(noise, member, identified[member].tolist())
    assert [lib.oc_noise_in_mean(noise, k) for k in (0, 1)] == [0.0, 0.0]


@pytest.mark.parametrize("bias_sd_deg_s", [0.02, 1.0])
@pytest.mark.parametrize("variance", [1e-8, 1e-6, 1e-3, 1e3])
def test_half_of_the_gradients_information_stays_however_large_the_noise(variance: float, bias_sd_deg_s: float) -> None:
    learner = Learner(Play(), yaw_rate_bias_sd=bias_sd_deg_s * DEGREE).learn(hypothesis_drive(3, Play(), 120))
    learner.solve()
    gradient, quiet = learner.h.gradient, math.sqrt(learner.h.variances.of[lib.OC_OF_GRADIENT])
    learner.second.noise.by_samples = learner.second.noise.by_ticks = (variance, variance)
    learner.solve()
    assert 1.0 <= math.sqrt(learner.h.variances.of[lib.OC_OF_GRADIENT]) / quiet < 1.001 * math.sqrt(2.0)
    assert abs(learner.h.gradient) < 2.5 * abs(gradient)


def test_the_noise_is_removed_after_a_remounting_as_before() -> None:
    """The gradient's evidence and its noise are kept, although the new constant has little evidence."""
    learner = Learner(Play()).learn(hypothesis_drive(3, Play(), 300))
    learner.solve()
    quiet = learner.h.gradient
    learner.second.noise.by_samples = learner.second.noise.by_ticks = (3e-3, 1e-7)
    learner.solve()
    before = learner.h.gradient
    lib.oc_hypothesis_shift_offset(learner.h, 2.0 * DEGREE, 5.0)
    learner.solve()
    assert abs(before - quiet) > 0.01 * DEGREE
    assert learner.h.gradient == pytest.approx(before, rel=1e-6)


def errors_of(tables: str, shaken: str = "", rms: float = 0.0, every: int = 1) -> tuple[float, float]:
    """Means over drives: of the understeer gradient in deg/(m/s^2), and of the wheelbase as a share. `shaken`
    names a signal; only every `every`-th tick at 100 Hz is used."""
    errors = []
    for seed in SEEDS:
        columns, truth = driven(tables, seed, DRIVE_S)
        if shaken:
            columns = columns | {shaken: columns[shaken] + shaking(DRIVE_S, (1.5, 4.0), rms)[: len(columns[shaken])]}
        answer = answer_of({name: column[::every] for name, column in columns.items()}, truth, rate_hz=RATE_HZ / every)
        gradient = answer["understeer_gradient"]["value"] - truth.understeer_gradient
        wheelbase = answer["equivalent_wheelbase"]["value"] / truth.equivalent_wheelbase_m - 1.0
        errors.append((gradient / DEGREE, wheelbase))
    gradient, wheelbase = np.mean(errors, axis=0)
    return float(gradient), float(wheelbase)


@pytest.mark.long
def test_accelerometer_noise_does_not_bias_the_gradient() -> None:
    gradient, wheelbase = errors_of(TIGHT + NOISY_ACCELEROMETER)
    assert abs(gradient) < 0.02  # of 0.4; -0.05 where noise is attributed to lateral force
    assert abs(wheelbase) < 0.02


@pytest.mark.slow
def test_gyro_noise_does_not_bias_the_wheelbase() -> None:
    of_quiet, of_noisy = errors_of(TIGHT), errors_of(TIGHT + NOISY_GYRO)
    gradient, wheelbase = np.subtract(of_noisy, of_quiet)
    assert abs(wheelbase) < 0.03  # -0.06 where noise is attributed to bends
    assert abs(gradient) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize(
    ("signal", "rms", "every"), [(LATERAL, 0.3, 1), (LATERAL, 0.3, 2), (YAW_RATE, 0.3 * DEGREE, 1)]
)
def test_vibration_does_not_bias_the_gradient(signal: str, rms: float, every: int) -> None:
    of_shaken, of_quiet = errors_of(TIGHT, signal, rms, every), errors_of(TIGHT, every=every)
    gradient, wheelbase = np.subtract(of_shaken, of_quiet)
    assert abs(gradient) < 0.03
    assert abs(wheelbase) < 0.03
