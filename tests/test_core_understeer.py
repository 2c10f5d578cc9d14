"""(38) in the core: the slope through the origin, jointly with the offset, against NumPy's least squares."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from test_core_mean import moments_of

from oncenter._native import ffi, lib

K, OFFSET = 0.0069, 0.0356  # rad/(m/s^2), rad: Fig. 14's truck and the thesis's offset


def bends(seed: int, noise: float = 0.01, lean: float = 0.2, count: int = 2000) -> npt.NDArray[np.float64]:
    """Columns y, x, w; `lean`: share of right-hand bends."""
    rng = np.random.default_rng(seed)
    sign = np.where(np.repeat(rng.random(count // 50), 50) < lean, -1.0, 1.0)
    x = 19.3 * rng.uniform(0.3, 1.5, count) * sign
    y = OFFSET + K * x + noise * np.repeat(rng.standard_normal(count // 50), 50)
    return np.column_stack([y, x, np.full(count, 3.5)])


def gathered(rows: npt.NDArray[np.float64], per_block: int = 10, per_batch: float = 100.0) -> Any:
    understeer = ffi.new("oc_understeer *")
    for block in np.split(rows, len(rows) // per_block):
        lib.oc_understeer_update(understeer, moments_of(block), per_batch)
    return understeer


def test_the_gradient_is_the_slope_through_the_origin() -> None:
    y, x, _ = (rows := bends(0)).T
    slope = np.linalg.lstsq(x[:, None], y - OFFSET, rcond=None)[0][0]
    assert lib.oc_understeer_value(gathered(rows), OFFSET) == pytest.approx(slope, rel=1e-11)


def test_without_noise_the_gradient_is_exact() -> None:
    understeer = gathered(bends(1, noise=0.0))
    assert lib.oc_understeer_value(understeer, OFFSET) == pytest.approx(K, rel=1e-11)
    assert lib.oc_understeer_variance(understeer, OFFSET, K) < (1e-6) ** 2


def test_the_gradient_changes_with_the_offset_by_its_derivative() -> None:
    understeer = gathered(bends(2))
    moved = lib.oc_understeer_value(understeer, OFFSET + 0.01) - lib.oc_understeer_value(understeer, OFFSET)
    assert moved == pytest.approx(0.01 * lib.oc_understeer_per_offset(understeer), rel=1e-9)
    assert moved < 0  # left-hand bends prevail


@pytest.mark.parametrize("straight_x", [0.0, 1.9, -3.0])
def test_offset_and_gradient_solve_both_equations_at_once(straight_x: float) -> None:
    """(37) on straights and (38) in bends: a fixed point, and the truth."""
    straight_y = OFFSET + K * straight_x
    understeer = gathered(bends(3, noise=0.0))
    found = lib.oc_understeer_with_offset(understeer, straight_y, straight_x)
    assert found == pytest.approx(K, rel=1e-10)
    offset = straight_y - found * straight_x
    assert lib.oc_understeer_value(understeer, offset) == pytest.approx(found, rel=1e-10)


def test_bends_similar_to_the_straights_do_not_separate_gradient_and_offset() -> None:
    rows = bends(4, lean=0.0)
    understeer = gathered(rows)
    same = float(np.sum(rows[:, 1] ** 2) / np.sum(rows[:, 1]))
    assert lib.oc_understeer_separability(understeer, same) == pytest.approx(0.0, abs=1e-12)
    assert lib.oc_understeer_separability(understeer, 0.0) == 1.0
    assert lib.oc_understeer_separability(understeer, -same) == pytest.approx(2.0)


def test_without_evidence_there_is_no_gradient() -> None:
    nothing = ffi.new("oc_understeer *")
    assert lib.oc_understeer_value(nothing, 0.1) == 0.0
    assert lib.oc_understeer_per_offset(nothing) == 0.0
    assert lib.oc_understeer_separability(nothing, 1.0) == 0.0
    assert lib.oc_understeer_variance(nothing, 0.1, 0.0) >= 1.0
    one_batch = gathered(bends(0, count=200)[:100])
    assert lib.oc_understeer_variance(one_batch, 0.1, 0.0) >= 1.0


@pytest.mark.long
def test_the_variance_is_that_of_many_drives() -> None:
    drives = [gathered(bends(seed)) for seed in range(300)]
    found = [lib.oc_understeer_value(d, OFFSET) for d in drives]
    factor = lib.oc_few_batches_factor(20.0)
    said = np.mean([lib.oc_understeer_variance(d, OFFSET, k) for d, k in zip(drives, found, strict=True)]) / factor**2
    assert said == pytest.approx(np.var(found), rel=0.25)
