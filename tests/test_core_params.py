"""Params: defaults are Table 4's, and each one out of its range is refused by its name."""

import math

import pytest

from oncenter import _core

DEFAULTS = _core.default_params()


def test_the_defaults_are_the_thesiss() -> None:
    table_4 = {"curvature_max_1_m": 1 / 800, "longitudinal_acceleration_max_m_s2": 0.3, "bank_max_m_s2": 0.3,
               "clean_time_s": 2.0}  # fmt: skip
    chapter_5 = {"cutoff_hz": 3.0, "delay_band_hz": 2.0, "speed_min_m_s": 10.0,
                 "understeer_acceleration_max_m_s2": 1.5}  # fmt: skip
    assert {name: DEFAULTS[name] for name in table_4 | chapter_5} == table_4 | chapter_5
    assert _core.bad_param({}) is None


def test_every_name_says_its_unit() -> None:
    units = ("_s", "_hz", "_m_s", "_1_m", "_m_s2", "_rad", "_rad_s", "_rad_s2", "_rad_m_s2", "_1", "_s2_m")
    assert [name for name in DEFAULTS if not name.endswith(units)] == ["use_accelerometer"]


@pytest.mark.parametrize("name", sorted(set(DEFAULTS) - {"use_accelerometer"}))
@pytest.mark.parametrize("value", [-1.0, 1e6, math.nan, math.inf, -math.inf])
def test_a_param_out_of_range_is_refused_by_name(name: str, value: float) -> None:
    named = _core.bad_param({name: value})
    assert named in _blamed(name), named
    with pytest.raises(ValueError, match="params"):
        _core.Core(3.9, 19.3, {name: value}, 100.0)


def _blamed(name: str) -> set[str]:
    """Whom the core may name: where one range hangs on another param, the first of the two."""
    return {name, "delay_band_hz"} if name == "cutoff_hz" else {name}


def test_params_that_contradict_each_other_are_refused() -> None:
    assert _core.bad_param({"delay_band_hz": 3.0}) == "delay_band_hz"
    assert _core.bad_param({"understeer_acceleration_min_m_s2": 1.6}) == "understeer_acceleration_max_m_s2"
    assert _core.bad_param({"use_accelerometer": 2}) == "use_accelerometer"
    assert _core.bad_param({"use_accelerometer": 0}) is None


@pytest.mark.parametrize("rate_hz", [19.9, 200.1, 0.0, -100.0, math.nan, math.inf])
def test_a_rate_out_of_range_is_refused(rate_hz: float) -> None:
    with pytest.raises(ValueError, match="rate"):
        _core.Core(3.9, 19.3, {}, rate_hz)


def test_a_cut_off_that_the_rate_cannot_carry_is_refused() -> None:
    with pytest.raises(ValueError, match="rate"):
        _core.Core(3.9, 19.3, {"cutoff_hz": 9.0}, 20.0)
    _core.Core(3.9, 19.3, {"cutoff_hz": 8.9}, 20.0)
