"""The simulated steering: play, wind-up, pull and ratio, one at a time, then through whole manoeuvres of the truck."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from layouts import scenario, steered_by_machine

from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate.drive import ffi, lib
from oncenter.simulate.steering import (
    native_steering,
    set_moment_n_m,
    straight_ahead_rad,
    unloading_acceleration_m_s2,
)
from oncenter.simulate.truck import equivalent_wheelbase_m, native_truck, steered_force_n, understeer_gradient

TICK_S, STEP_S = 0.01, 0.0025
RATIO = 19.3
NO_PLAY = {"backlash_deg": 0.0}
FRICTION_PLAY = {"backlash_deg": 8.0, "king_pin_friction_n_m": 1e6}
ALIGNING_PLAY = {"backlash_deg": 8.0, "king_pin_friction_n_m": 0.0, "creep_deg_s_n_m": 100.0}


def steering(**changes: Any) -> Any:
    settings = scenario({"steering": changes})
    return native_steering(settings.steering, settings.truck)


def turn_to(state: Any, system: Any, angle: float, force: float = 0.0, a_x: float = 0.0, seconds: float = 0.01) -> Any:
    """Holds a steering wheel angle, a side force and a longitudinal acceleration."""
    for _ in range(round(seconds / TICK_S)):
        lib.sim_steering_step(state, system, angle, force, a_x, TICK_S)
    return state


# The play


def test_within_its_play_the_inner_element_rests_and_at_either_end_it_is_carried_along() -> None:
    play = ffi.new("oc_backlash *", {"half_width": 0.5})
    state = ffi.new("oc_backlash_state *")
    outer = np.r_[np.linspace(0, 3, 61), np.linspace(3, -3, 121)[1:], np.linspace(-3, 0, 61)[1:]]
    inner, place = np.empty_like(outer), np.empty_like(outer)
    for k, angle in enumerate(outer):
        place[k] = lib.oc_backlash_step(state, play, angle, 0.0, 0.01)
        inner[k] = state.inner
    up, down = slice(20, 61), slice(81, 181)
    np.testing.assert_allclose(inner[up], outer[up] - 0.5, atol=1e-12)
    np.testing.assert_allclose(inner[down], outer[down] + 0.5, atol=1e-12)
    np.testing.assert_allclose(outer[80] - outer[60], -1.0)  # the full width passes before the inner one moves back
    assert inner[80] == inner[60]
    assert place[60] == 1.0
    assert place[180] == -1.0


def test_the_play_operator_stays_in_its_play_and_moves_never_against_the_hand() -> None:
    play = ffi.new("oc_backlash *", {"half_width": 0.03, "friction": 35.0, "creep": 0.005})
    state = ffi.new("oc_backlash_state *")
    random = np.random.default_rng(7)
    for angle in np.cumsum(0.01 * random.standard_normal(5000)):
        before = state.inner
        place = lib.oc_backlash_step(state, play, angle, random.uniform(-30, 30), 0.01)
        assert -1.0 <= place <= 1.0
        moved = state.inner - before
        assert moved == 0.0 or (moved > 0) == (place > 0)
        assert angle - state.inner == pytest.approx(0.03 * place, abs=1e-12)


@pytest.mark.parametrize(("load", "place"), [(80.0, 1.0), (-80.0, -1.0), (30.0, 0.0), (-30.0, 0.0)])
def test_an_aligning_moment_above_king_pin_friction_carries_the_wheels_to_the_flank(load: float, place: float) -> None:
    play = ffi.new("oc_backlash *", {"half_width": 0.03, "friction": 35.0, "creep": 0.005})
    state = ffi.new("oc_backlash_state *")
    for _ in range(100):
        reached = lib.oc_backlash_step(state, play, 0.0, load, 0.01)
    assert reached == place


