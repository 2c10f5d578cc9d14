"""Params: the defaults are those of Table 4, and a value out of its range is refused by name."""

import math
import re
from typing import Any

import pytest

from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.estimates.estimates import DEFAULT_METHOD
from oncenter.export.variables import UNITS
from oncenter.param_table import params

DEFAULTS = _core.default_params()


def test_the_defaults_are_the_thesiss() -> None:
    table_4 = {"curvature_max_1_m": 1 / 800, "longitudinal_acceleration_max_m_s2": 0.3, "bank_max_m_s2": 0.3,
               "clean_time_s": 2.0}  # fmt: skip
    chapter_5 = {"cutoff_hz": 3.0, "delay_band_hz": 2.0, "speed_min_m_s": 10.0,
                 "understeer_acceleration_max_m_s2": 1.5}  # fmt: skip
    about = "core/params.toml: a default that is not the thesis's leaves this list, and its row has another source"
    assert {name: DEFAULTS[name] for name in table_4 | chapter_5} == table_4 | chapter_5, about
    assert _core.bad_param({}) is None


def test_firmware_that_only_takes_the_defaults_runs_the_joint_method_as_python_does() -> None:
    native = ffi.new("oc_params *")
    lib.oc_params_defaults(native)
    assert _core.METHODS[native.method] == DEFAULT_METHOD == "joint"
    assert _core.ANGLE_METHODS[native.angle_method] == "observer"


def test_every_name_ends_in_its_unit() -> None:
    endings = {re.sub(r"\W+", "_", f"/{unit}/").rstrip("_").lower(): unit for unit in UNITS}
    for name, param in params().items():
        said = max((ending for ending in endings if name.endswith(ending)), key=len, default="")
        about = f"core/params.toml: {name} must end in {param.unit}, a row of UNITS of src/oncenter/export/variables.py"
        assert endings.get(said) == param.unit, about
    assert set(DEFAULTS) - set(params()) == {"use_accelerometer"}


@pytest.mark.parametrize("name", sorted(set(DEFAULTS) - {"use_accelerometer"}))
@pytest.mark.parametrize("value", [-1.0, 1e6, math.nan, math.inf, -math.inf])
def test_a_param_out_of_range_is_refused_by_name(name: str, value: float) -> None:
    named = _core.bad_param({name: value})
    assert named in _blamed(name), named
    with pytest.raises(ValueError, match="params"):
        _core.Core(3.9, 19.3, {name: value}, 100.0)


def _blamed(name: str) -> set[str]:
    """The name that the core may give; where a range depends on another param, the first of both."""
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


def test_a_cut_off_too_high_for_the_rate_is_refused() -> None:
    with pytest.raises(ValueError, match="rate"):
        _core.Core(3.9, 19.3, {"cutoff_hz": 9.0}, 20.0)
    _core.Core(3.9, 19.3, {"cutoff_hz": 8.9}, 20.0)


@pytest.mark.parametrize(
    ("named", "vehicle"),
    [
        ("ratio", {"ratio_polynomial": (0.0, math.nan)}),
        ("ratio", {"ratio_polynomial": (0.0, 0.05, math.inf)}),
        ("traffic_side", {"traffic_side": math.nan}),
        ("traffic_side", {"traffic_side": 2.0}),
    ],
)
def test_an_impossible_vehicle_is_refused_by_name(named: str, vehicle: dict[str, Any]) -> None:
    native = _core._vehicle(3.9, 19.3, 0.0, 0.0, **vehicle)
    assert ffi.string(lib.oc_vehicle_check(native)).decode() == named
    with pytest.raises(ValueError, match="vehicle"):
        _core.Core(3.9, 19.3, {}, 100.0, **vehicle)


@pytest.mark.parametrize("terms", [-1, 9])
def test_a_ratio_with_too_many_terms_is_refused(terms: int) -> None:
    native = _core._vehicle(3.9, 19.3, 0.0, 0.0)
    native.ratio.terms = terms
    assert ffi.string(lib.oc_vehicle_check(native)).decode() == "ratio"


@pytest.mark.parametrize("angle_method", ["wheel-speed", "wheel-speed-exact"])
def test_an_angle_by_the_front_wheels_needs_their_track_width(angle_method: str) -> None:
    with pytest.raises(ValueError, match="vehicle"):
        _core.Core(3.9, 19.3, {}, 100.0, angle_method=angle_method, track_width_rear_m=1.8)
    _core.Core(3.9, 19.3, {}, 100.0, angle_method=angle_method, track_width_front_m=2.0)
