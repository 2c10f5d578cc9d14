"""Means by their innovation, (36), and their merging: against batch NumPy, in any order, over years."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oncenter._native import ffi, lib

MEMBERS = ("weight", "y", "x", "w", "yy", "xy", "xx")


def moments_of(rows: npt.NDArray[np.float64]) -> Any:
    sums = ffi.new("oc_sums *")
    for y, x, w in rows.tolist():
        lib.oc_sums_add(sums, y, x, w)
    return ffi.new("oc_moments *", lib.oc_moments_of(sums))


def in_batch(rows: npt.NDArray[np.float64]) -> list[float]:
    y, x, w = rows.T
    dy, dx = y - y.mean(), x - x.mean()
    return [len(rows), y.mean(), x.mean(), w.mean(), dy @ dy, dx @ dy, dx @ dx]


def members(moments: Any) -> list[float]:
    return [getattr(moments, name) for name in MEMBERS]


def random_rows(seed: int, count: int) -> npt.NDArray[np.float64]:
    return np.random.default_rng(seed).standard_normal((count, 3)) * [0.05, 3.0, 0.2] + [0.04, 1.0, 3.5]


@given(st.integers(0, 1000), st.lists(st.integers(1, 40), min_size=1, max_size=8))
def test_merged_blocks_are_the_whole(seed: int, sizes: list[int]) -> None:
    rows = random_rows(seed, sum(sizes))
    total = ffi.new("oc_moments *")
    for block in np.split(rows, np.cumsum(sizes)[:-1]):
        lib.oc_moments_merge(total, moments_of(block))
    assert members(total) == pytest.approx(in_batch(rows), rel=1e-10, abs=1e-12)


def test_the_order_of_merging_does_not_matter() -> None:
    blocks = np.split(random_rows(7, 90), [20, 25, 70])
    there, back = ffi.new("oc_moments *"), ffi.new("oc_moments *")
    for block in blocks:
        lib.oc_moments_merge(there, moments_of(block))
    for block in blocks[::-1]:
        lib.oc_moments_merge(back, moments_of(block))
    assert members(there) == pytest.approx(members(back), rel=1e-12)


def test_merging_nothing_changes_nothing() -> None:
    total = moments_of(random_rows(1, 10))
    before = members(total)
    lib.oc_moments_merge(total, ffi.new("oc_moments *"))
    assert members(total) == before
    assert members(moments_of(np.empty((0, 3)))) == [0.0] * 7


def test_the_variance_is_that_of_the_residual() -> None:
    rows = random_rows(3, 200)
    for slope in (0.0, 0.007, -2.0):
        left = rows[:, 0] - slope * rows[:, 1]
        assert lib.oc_moments_variance(moments_of(rows), slope) == pytest.approx(np.var(left, ddof=1), rel=1e-10)


def test_one_tick_or_a_constant_has_no_variance() -> None:
    assert lib.oc_moments_variance(moments_of(random_rows(0, 1)), 0.0) == 0.0
    assert 0.0 <= lib.oc_moments_variance(moments_of(np.full((50, 3), 0.1)), 0.3) < 1e-16


def test_the_mean_is_still_updated_after_years() -> None:
    """In float32 (36) stops learning at some 10^7 ticks. Here the angle changes by 1 mrad after 10^10 ticks."""
    long_ago = ffi.new("oc_moments *", {"weight": 1e10, "y": 0.1, "x": 1.0, "w": 3.0})
    block = np.tile([0.101, 1.0, 3.0], (10, 1))
    for _ in range(1000):
        lib.oc_moments_merge(long_ago, moments_of(block))
    assert long_ago.y - 0.1 == pytest.approx(1e-3 * 1e4 / (1e10 + 1e4), rel=1e-4)
