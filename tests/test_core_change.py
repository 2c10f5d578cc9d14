"""Whether what was learned still holds: CUSUMs on errors made of random numbers, before any drive."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from oncenter._native import ffi, lib

Array = npt.NDArray[np.float64]

DEGREE = math.pi / 180.0
USUAL = 0.4 * DEGREE
SHARP = 0.004  # 1/m


def told(
    errors: Array, curvature: Array | float = 0.0, watch: Any = None, least: Array | None = None
) -> list[tuple[int, Any]]:
    """Second and change of all that is proven. Errors in rad."""
    watch = ffi.new("oc_change_watch *") if watch is None else watch
    found = []
    for k, (error, bend) in enumerate(zip(errors, np.broadcast_to(curvature, len(errors)), strict=True)):
        change = lib.oc_change_update(watch, error, error if least is None else least[k], USUAL, bend, 1.0)
        if change.kind != lib.OC_CHANGE_NONE:
            found.append((k, change))
    return found


def noise(seed: int, seconds: int) -> Array:
    return USUAL * np.random.default_rng(seed).standard_normal(seconds)


def bends(seconds: int) -> Array:
    """Left, straight, right, straight, 10 s each."""
    return SHARP * np.array([1.0, 0.0, -1.0, 0.0])[(np.arange(seconds) // 10) % 4]


def test_nothing_is_found_where_nothing_changed() -> None:
    """A whole day's errors; seconds that resemble their neighbours are already in what is usual."""
    assert not told(noise(1, 86_400), bends(86_400))


@pytest.mark.parametrize("step", [1.0, -1.5, 5.0, -8.0])
def test_a_step_of_the_offset_is_told_with_size_and_time(step: float) -> None:
    for seed in range(5):
        errors = noise(seed, 600)
        errors[300:] += step * DEGREE
        (at, change), *more = told(errors[:400], bends(400))
        assert not more
        assert change.kind == lib.OC_CHANGE_OFFSET
        assert 300 < at <= 360
        assert at - change.seconds == pytest.approx(300, abs=12)
        assert change.size == pytest.approx(step * DEGREE, abs=4.0 * change.size_sd)
        assert change.size_sd < 0.1 * DEGREE


def test_what_does_not_surprise_all_is_no_change_and_what_does_has_the_size_of_the_best_ones_error() -> None:
    errors = noise(6, 600)
    errors[300:] += 5.0 * DEGREE
    calm = noise(7, 600)
    assert not told(errors, least=calm)
    ((_, change),) = told(errors[:400], least=np.where(np.arange(400) < 300, calm[:400], errors[:400] - 3.0 * DEGREE))
    assert change.size == pytest.approx(5.0 * DEGREE, abs=4.0 * change.size_sd)


def test_left_and_right_are_mirrored() -> None:
    errors = noise(2, 400)
    errors[300:] += 3.0 * DEGREE
    ((at, there),), ((also_at, back),) = told(errors), told(-errors)
    assert (at, there.size, there.seconds) == (also_at, -back.size, back.seconds)


@pytest.mark.parametrize("share", [1.0, -1.0])
def test_errors_that_go_with_the_bend_are_another_load_and_no_offset(share: float) -> None:
    bend = bends(900)
    errors = noise(3, 900) + np.where(np.arange(900) >= 300, share * 2.0 * DEGREE * bend / SHARP, 0.0)
    at, change = told(errors[:700], bend[:700])[0]
    assert change.kind == lib.OC_CHANGE_BENDS
    assert at < 500


@pytest.mark.parametrize("seconds", [1, 5, 20])
def test_what_passes_is_no_change(seconds: int) -> None:
    errors = noise(4, 600)
    errors[300 : 300 + seconds] += 5.0 * DEGREE
    assert not told(errors, bends(600))


def test_one_wild_second_is_not_even_suspicious_after_another_good_one() -> None:
    watch = ffi.new("oc_change_watch *")
    told(np.array([0.0, 1000.0 * DEGREE, 0.0, 0.0]), watch=watch)
    assert not lib.oc_change_suspected(watch)


def test_what_is_less_than_forgetting_takes_care_of_is_no_change() -> None:
    errors = noise(5, 900) * 0.1
    errors[300:] += 0.5 * DEGREE
    assert not told(errors)


def test_while_suspicious_it_says_so_and_once_proven_it_begins_anew() -> None:
    watch = ffi.new("oc_change_watch *")
    assert not told(noise(6, 300), watch=watch)
    assert not lib.oc_change_suspected(watch)
    assert not told(np.full(10, 3.0 * DEGREE), watch=watch)
    assert lib.oc_change_suspected(watch)
    assert told(np.full(60, 3.0 * DEGREE), watch=watch)
    assert not lib.oc_change_suspected(watch)
