"""Change detection by CUSUMs, on errors of random numbers."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from oncenter._native import ffi, lib
from oncenter.signals import DEGREE

Array = npt.NDArray[np.float64]

USUAL = 0.4 * DEGREE
SHARP = 0.004  # 1/m


def detected(
    errors: Array, curvature: Array | float = 0.0, watch: Any = None, min_error: Array | None = None
) -> list[tuple[int, Any]]:
    """Second and change of each proven change. Errors in rad."""
    watch = ffi.new("oc_change_watch *") if watch is None else watch
    found = []
    for k, (error, bend) in enumerate(zip(errors, np.broadcast_to(curvature, len(errors)), strict=True)):
        change = lib.oc_change_update(watch, error, error if min_error is None else min_error[k], USUAL, bend, 1.0)
        if change.kind != lib.OC_CHANGE_NONE:
            found.append((k, change))
    return found


def noise(seed: int, seconds: int) -> Array:
    return USUAL * np.random.default_rng(seed).standard_normal(seconds)


def bends(seconds: int) -> Array:
    """Left, straight, right, straight, 10 s each."""
    return SHARP * np.array([1.0, 0.0, -1.0, 0.0])[(np.arange(seconds) // 10) % 4]


def test_without_a_change_none_is_detected() -> None:
    """A day of errors; the sd includes the correlation of seconds."""
    assert not detected(noise(1, 86_400), bends(86_400))


@pytest.mark.parametrize("step", [1.0, -1.5, 5.0, -8.0])
def test_a_step_of_the_offset_is_detected_with_size_and_time(step: float) -> None:
    for seed in range(5):
        errors = noise(seed, 600)
        errors[300:] += step * DEGREE
        (at, change), *more = detected(errors[:400], bends(400))
        assert not more
        assert change.kind == lib.OC_CHANGE_OFFSET
        assert 300 < at <= 360
        assert at - change.seconds == pytest.approx(300, abs=12)
        assert change.size == pytest.approx(step * DEGREE, abs=4.0 * change.size_sd)
        assert change.size_sd < 0.1 * DEGREE


def test_the_minimum_error_decides_on_a_change_and_the_best_error_gives_its_size() -> None:
    errors = noise(6, 600)
    errors[300:] += 5.0 * DEGREE
    calm = noise(7, 600)
    assert not detected(errors, min_error=calm)
    ((_, change),) = detected(
        errors[:400], min_error=np.where(np.arange(400) < 300, calm[:400], errors[:400] - 3.0 * DEGREE)
    )
    assert change.size == pytest.approx(5.0 * DEGREE, abs=4.0 * change.size_sd)


def test_left_and_right_are_mirrored() -> None:
    errors = noise(2, 400)
    errors[300:] += 3.0 * DEGREE
    ((at, there),), ((also_at, back),) = detected(errors), detected(-errors)
    assert (at, there.size, there.seconds) == (also_at, -back.size, back.seconds)


@pytest.mark.parametrize("share", [1.0, -1.0])
def test_errors_proportional_to_curvature_are_a_load_change_not_an_offset(share: float) -> None:
    bend = bends(900)
    errors = noise(3, 900) + np.where(np.arange(900) >= 300, share * 2.0 * DEGREE * bend / SHARP, 0.0)
    at, change = detected(errors[:700], bend[:700])[0]
    assert change.kind == lib.OC_CHANGE_BENDS
    assert at < 500


@pytest.mark.parametrize("seconds", [1, 5, 20])
def test_a_temporary_error_is_no_change(seconds: int) -> None:
    errors = noise(4, 600)
    errors[300 : 300 + seconds] += 5.0 * DEGREE
    assert not detected(errors, bends(600))


def test_a_single_outlier_gives_no_suspicion() -> None:
    watch = ffi.new("oc_change_watch *")
    detected(np.array([0.0, 1000.0 * DEGREE, 0.0, 0.0]), watch=watch)
    assert not lib.oc_change_suspected(watch)


def test_a_change_small_enough_for_forgetting_is_not_detected() -> None:
    errors = noise(5, 900) * 0.1
    errors[300:] += 0.5 * DEGREE
    assert not detected(errors)


def test_a_suspicion_lasts_until_the_change_is_proven() -> None:
    watch = ffi.new("oc_change_watch *")
    assert not detected(noise(6, 300), watch=watch)
    assert not lib.oc_change_suspected(watch)
    assert not detected(np.full(10, 3.0 * DEGREE), watch=watch)
    assert lib.oc_change_suspected(watch)
    assert detected(np.full(60, 3.0 * DEGREE), watch=watch)
    assert not lib.oc_change_suspected(watch)
