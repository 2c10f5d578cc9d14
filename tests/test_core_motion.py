"""(32)-(35) in the core: the motion, the gate at its limits, and the blocks pending for t1."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oncenter._native import ffi, lib


def motion_of(
    r: float, v: float, a_y: float = 0.0, angle: float = 0.0, accelerometer: bool = True, rear: float = 0.0
) -> Any:
    motion = {"yaw_rate": r, "vehicle_speed": v, "lateral_acceleration": a_y}
    tick = ffi.new("oc_filtered *", {**motion, "steering_wheel_angle": angle, "rear_axle_angle": rear})
    return lib.oc_motion_of(tick, 75.0, 12.0, accelerometer)


def test_the_motion_follows_the_equations() -> None:
    m = motion_of(r=0.02, v=20.0, a_y=0.7, angle=0.5)
    assert m.curvature == pytest.approx(0.001)  # (32)
    assert m.bank == pytest.approx(0.3)  # (33): specific force, the road falls to the right
    assert m.lateral_acceleration == 0.7
    assert m.residual == pytest.approx(0.5 - 75.0 * 0.001)


def test_without_an_accelerometer_the_lateral_acceleration_is_yaw_rate_times_speed() -> None:
    m = motion_of(r=0.02, v=20.0, a_y=0.7, accelerometer=False)
    assert m.lateral_acceleration == pytest.approx(0.4)
    assert m.bank == 0.0


def test_below_one_metre_per_second_the_curvature_is_bounded() -> None:
    for v in (1.0, 0.5, 0.0, -20.0):
        assert motion_of(r=0.01, v=v).curvature == 0.01


def gate(speed: float = 20.0, **motion: float) -> int:
    params = ffi.new("oc_params *")
    lib.oc_params_defaults(params)
    return int(lib.oc_gate(params, ffi.new("oc_motion *", motion), speed))


@pytest.mark.parametrize(
    ("name", "limit", "reason"),
    [
        ("curvature", 1.0 / 800.0, lib.OC_REASON_CURVATURE),
        ("longitudinal_acceleration", 0.3, lib.OC_REASON_LONGITUDINAL_ACCELERATION),
        ("bank", 0.3, lib.OC_REASON_BANK),
    ],
)
def test_the_gate_closes_at_its_limit_on_both_sides(name: str, limit: float, reason: int) -> None:
    below = float(np.nextafter(limit, 0.0))
    assert gate(**{name: below}) == gate(**{name: -below}) == 0
    assert gate(**{name: limit}) == gate(**{name: -limit}) == reason


def test_the_gate_needs_more_than_ten_metres_per_second() -> None:
    assert gate(speed=10.0) == lib.OC_REASON_SPEED
    assert gate(speed=float(np.nextafter(10.0, 11.0))) == 0
    assert gate(speed=-20.0) == lib.OC_REASON_SPEED


def test_a_nan_motion_is_never_clean() -> None:
    nan = float("nan")
    everything = gate(speed=nan, curvature=nan, longitudinal_acceleration=nan, bank=nan)
    assert everything == (
        lib.OC_REASON_SPEED | lib.OC_REASON_CURVATURE | lib.OC_REASON_LONGITUDINAL_ACCELERATION | lib.OC_REASON_BANK
    )


def final_ticks(clean: list[bool], per_block: int, until_final: int) -> list[int]:
    """Numbers of the ticks that the core makes final; tick k carries y = 2^-k apart from others by its number."""
    pending, final = ffi.new("oc_pending *"), ffi.new("oc_moments *")
    given_back: list[int] = []
    for k, is_clean in enumerate(clean):
        if not is_clean:
            lib.oc_pending_drop(pending)
            assert pending.ticks == pending.count == 0
        elif lib.oc_pending_add(pending, per_block, until_final, float(k), -2.0 * k, 1.0, final):
            assert final.weight == per_block
            assert final.x == pytest.approx(-2.0 * final.y)
            first = round(final.y - (per_block - 1) / 2)
            given_back += range(first, first + per_block)
            assert (pending.ticks, pending.count) == (0, until_final)
    return given_back


def by_definition(clean: list[bool], per_block: int, until_final: int) -> list[int]:
    """A block of a clean run is final when blocks that cover t1 follow it in the same run."""
    final: list[int] = []
    start = 0
    for k in range(len(clean) + 1):
        if k < len(clean) and clean[k]:
            continue
        for block in range(start, k, per_block):
            if block + (1 + until_final) * per_block <= k:
                final += range(block, block + per_block)
        start = k + 1
    return final


RUNS = st.lists(st.tuples(st.integers(0, 60), st.integers(1, 3)), max_size=8)


@given(RUNS, st.integers(1, 6), st.integers(1, lib.OC_PENDING_MAX))
def test_a_block_is_final_exactly_when_the_clean_time_after_it_is_clean(
    runs: list[tuple[int, int]], per_block: int, until_final: int
) -> None:
    clean = [flag for good, bad in runs for flag in [True] * good + [False] * bad]
    assert final_ticks(clean, per_block, until_final) == by_definition(clean, per_block, until_final)


def test_a_run_shorter_than_the_clean_time_is_not_used() -> None:
    assert final_ticks([True] * 209 + [False], 10, 20) == []
    assert final_ticks([True] * 210 + [False], 10, 20) == list(range(10))


def test_the_ring_loses_no_block_in_a_long_run() -> None:
    assert final_ticks([True] * 5000, 3, 20) == by_definition([True] * 5000, 3, 20)


def test_a_block_has_the_moments_of_its_ticks() -> None:
    pending, final = ffi.new("oc_pending *"), ffi.new("oc_moments *")
    rows = np.random.default_rng(5).standard_normal((8, 3))
    done = [bool(lib.oc_pending_add(pending, 4, 1, *row, final)) for row in rows.tolist()]
    assert done == [False] * 7 + [True]
    y, x, w = rows[:4].T
    assert [final.y, final.x, final.w] == pytest.approx([y.mean(), x.mean(), w.mean()])
    assert [final.yy, final.xy, final.xx] == pytest.approx(
        [np.var(y) * 4, np.cov(x, y, ddof=0)[0, 1] * 4, np.var(x) * 4]
    )
