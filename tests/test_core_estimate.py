"""Status with hysteresis, and Student's factor for few batches."""

import pytest
from scipy import stats

from oncenter._native import lib


@pytest.mark.parametrize("batches", [2, 3, 4, 5, 7, 10, 20, 50, 200, 10_000])
def test_few_batches_widen_the_interval_by_students_factor(batches: int) -> None:
    expected = stats.t.ppf(0.975, batches - 1) / 1.96
    tolerance = 0.009 if batches == 3 else 0.002  # see the comment in estimate.c
    assert lib.oc_few_batches_factor(float(batches)) == pytest.approx(expected, rel=tolerance)


def test_more_batches_never_widen_the_interval() -> None:
    factors = [lib.oc_few_batches_factor(float(n)) for n in range(2, 500)]
    assert factors == sorted(factors, reverse=True)


def test_the_status_has_hysteresis() -> None:
    status = lib.OC_CONVERGING
    valid = []
    for half_width in (2.0, 1.2, 1.0, 1.3, 1.34, 1.2, 0.9):
        status = lib.oc_status_next(status, half_width / 1.96, 1.0)
        valid.append(status == lib.OC_VALID)
    assert valid == [False, False, True, True, False, False, True]


def test_a_nan_interval_is_not_valid() -> None:
    assert lib.oc_status_next(lib.OC_VALID, float("nan"), 1.0) == lib.OC_CONVERGING
