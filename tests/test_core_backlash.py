"""Properties of the play operator (hysteresis), which the simulator and the joint method share."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oncenter.simulate.drive import ffi, lib

Array = npt.NDArray[np.float64]
STEP_S = 0.1

angles = st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=60)
plays = st.fixed_dictionaries(
    {"half_width": st.floats(0.0, 0.3), "friction": st.floats(0.0, 0.5), "creep": st.floats(0.0, 20.0)}
)


def carried(angle: Any, load: Any = 0.0, *, inner: float | None = None, step_s: float = STEP_S, **play: float) -> Array:
    """The inner element after each step."""
    native = ffi.new("oc_backlash *", play)
    now = float(angle[0]) if inner is None else inner
    course = np.empty(len(angle))
    for k, (outer, force) in enumerate(zip(angle, np.broadcast_to(load, len(angle)), strict=True)):
        now = course[k] = lib.oc_backlash_carry(now, native, outer, force, step_s)
    return course


@given(angles, plays)
def test_the_place_is_that_of_the_outer_element_in_the_play(angle: list[float], play: dict[str, float]) -> None:
    native = ffi.new("oc_backlash *", play)
    state = ffi.new("oc_backlash_state *", {"inner": angle[0]})
    for outer, inner in zip(angle, carried(angle, 0.7, **play), strict=True):
        place = lib.oc_backlash_step(state, native, outer, 0.7, STEP_S)
        if play["half_width"] > 0.0:
            assert state.inner == inner
        assert place * play["half_width"] == pytest.approx(outer - state.inner, abs=1e-12)


@given(angles, st.floats(0.0, 0.3), st.integers(1, 20))
def test_without_a_load_only_the_turning_points_count_not_the_rate(
    angle: list[float], half_width: float, slower: int
) -> None:
    at = np.arange(len(angle))
    slowly = np.interp(np.arange((len(angle) - 1) * slower + 1) / slower, at, angle)
    at_the_turns = carried(slowly, half_width=half_width)[::slower]
    np.testing.assert_allclose(at_the_turns, carried(angle, half_width=half_width), atol=1e-12)


@given(angles, angles, plays)
def test_a_larger_motion_erases_the_effect_of_a_smaller_one(
    before: list[float], after: list[float], play: dict[str, float]
) -> None:
    """Full lock to both sides gives the same state after any history."""
    tail = [-6.0, 6.0, *after]
    here, there = (carried([*start, *tail], **play)[-len(after) :] for start in (before, [0.0]))
    assert (here == there).all()


@given(angles, plays, st.floats(-2.0, 2.0))
def test_left_and_right_are_mirrored(angle: list[float], play: dict[str, float], load: float) -> None:
    assert (carried(angle, load, **play) == -carried([-a for a in angle], -load, **play)).all()


@given(angles, st.floats(0.0, 0.15), st.floats(0.0, 0.15))
def test_two_plays_in_series_without_load_are_one_of_the_summed_width(
    angle: list[float], one: float, other: float
) -> None:
    start = angle[0]
    through_both = carried(carried(angle, inner=start, half_width=one), inner=start, half_width=other)
    np.testing.assert_allclose(through_both, carried(angle, inner=start, half_width=one + other), atol=1e-12)


def test_a_load_beyond_friction_carries_at_its_own_rate_whatever_the_step() -> None:
    """2 rad/s per unit, 0.3 units beyond friction: 0.06 rad in 0.1 s, then the end of the play."""
    play = {"half_width": 0.1, "friction": 0.2, "creep": 2.0}
    for step_s in (0.01, 0.02, 0.1):
        steps = round(0.1 / step_s)
        course = carried(np.zeros(3 * steps), 0.5, step_s=step_s, **play)
        assert course[steps - 1] == pytest.approx(-0.06)
        assert course[-1] == -0.1
    assert (carried(np.zeros(30), 0.2, **play) == 0.0).all()
    assert (carried(np.zeros(30), -0.2, **play) == 0.0).all()


def test_without_play_the_inner_element_is_the_outer_one() -> None:
    angle = [0.0, 0.5, -0.2]
    assert carried(angle, 1.0, half_width=0.0, creep=5.0).tolist() == angle
