"""(36), (37), (42), (43) in the core, block by block, against batch NumPy."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from test_core_mean import moments_of, random_rows

from oncenter._native import ffi, lib

UNKNOWN_VARIANCE = 10.0  # rad^2


def gathered(rows: npt.NDArray[np.float64], per_block: int = 10, per_batch: float = 50.0) -> Any:
    offset = ffi.new("oc_offset *")
    for block in np.split(rows, len(rows) // per_block):
        lib.oc_offset_update(offset, moments_of(block), per_batch)
    return offset


@pytest.mark.parametrize("K", [0.0, 0.007, -0.1])
def test_the_offset_is_the_mean_of_the_residual(K: float) -> None:
    rows = random_rows(11, 400)
    left = rows[:, 0] - K * rows[:, 1]
    offset = gathered(rows)
    assert lib.oc_offset_value(offset, K) == pytest.approx(np.mean(left), rel=1e-12)  # (42)
    recursive = 0.0
    for k, value in enumerate(left, start=1):
        recursive += (value - recursive) / k  # (36)
    assert lib.oc_offset_value(offset, K) == pytest.approx(recursive, rel=1e-11)
    independent = lib.oc_offset_variance_if_independent(offset, K)
    assert independent == pytest.approx(np.var(left, ddof=1) / len(left), rel=1e-10)  # (43)


def test_the_variance_comes_from_batch_means() -> None:
    rows = random_rows(12, 430)  # the last 30 do not fill a batch
    means = (rows[:400, 0] - 0.01 * rows[:400, 1]).reshape(8, 50).mean(axis=1)
    expected = np.var(means, ddof=1) / 8 * lib.oc_few_batches_factor(8.0) ** 2
    assert lib.oc_offset_variance(gathered(rows), 0.01) == pytest.approx(expected, rel=1e-10)


def test_a_batch_consists_of_whole_blocks() -> None:
    assert gathered(random_rows(1, 120), per_block=10, per_batch=35.0).batches.weight == 3.0


def test_one_batch_has_the_unknown_variance() -> None:
    assert lib.oc_offset_variance(ffi.new("oc_offset *"), 0.0) == UNKNOWN_VARIANCE
    assert lib.oc_offset_variance(gathered(random_rows(1, 90)), 0.0) == UNKNOWN_VARIANCE
    assert lib.oc_offset_variance_if_independent(ffi.new("oc_offset *"), 0.0) == UNKNOWN_VARIANCE
    assert lib.oc_offset_value(ffi.new("oc_offset *"), 0.0) == 0.0


@pytest.mark.long
def test_batches_include_the_correlation_that_43_ignores() -> None:
    """Residuals constant for 2 s at 100 Hz: the scatter of such drives' means is that of batches, not that of (43)."""
    rng = np.random.default_rng(4)
    ticks, alike = 12_000, 200
    drives = []
    for _ in range(200):
        y = np.repeat(rng.standard_normal(ticks // alike), alike) * 0.02
        drives.append(gathered(np.column_stack([y, np.ones(ticks), np.ones(ticks)]), 100, 1000.0))
    truth = np.var([lib.oc_offset_value(d, 0.0) for d in drives])
    said = np.mean([lib.oc_offset_variance(d, 0.0) for d in drives]) / lib.oc_few_batches_factor(12.0) ** 2
    independent = np.mean([lib.oc_offset_variance_if_independent(d, 0.0) for d in drives])
    assert said == pytest.approx(truth, rel=0.3)
    assert independent < truth / 100
