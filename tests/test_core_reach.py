"""All reasons, statuses, errors and methods of the core are reachable, and have names."""

from collections.abc import Callable

import numpy as np
import pytest
from random_drives import RATIO, WHEELBASE, Array, drive

from oncenter import _core
from oncenter._native import ffi, lib

RATE_HZ = 100.0
ANGLE, YAW_RATE, SPEED, ACCELERATION = (
    "steering_wheel_angle_rad",
    "yaw_rate_rad_s",
    "vehicle_speed_m_s",
    "lateral_acceleration_m_s2",
)
WHEELS = [f"wheel_speed_{axle}_{side}_m_s" for axle in ("front", "rear") for side in ("left", "right")]


def core_of(method: str = "joint", angle_method: str = "observer") -> _core.Core:
    tracks = {"track_width_front_m": 2.0, "track_width_rear_m": 1.8}
    return _core.Core(WHEELBASE, RATIO, {}, RATE_HZ, method=method, angle_method=angle_method, **tracks)


def steady(**columns: float | Array) -> dict[str, Array]:
    """A minute at 20 m/s, straight ahead, with the given columns."""
    t = np.arange(6000) / RATE_HZ
    values: dict[str, float | Array] = {ANGLE: 0.03, YAW_RATE: 0.0, SPEED: 20.0, ACCELERATION: 0.0} | columns
    return {"time_s": t} | {name: value + np.zeros(len(t)) for name, value in values.items()}


def hole(columns: dict[str, Array]) -> dict[str, Array]:
    return columns | {"time_s": columns["time_s"] + np.where(np.arange(6000) > 3000, 5.0, 0.0)}


def running_away() -> dict[str, Array]:
    """A bias that changes by 2 deg/s within ten seconds, while the wheels show a straight."""
    bias = 0.035 * np.clip((np.arange(6000) - 3000) / 1000.0, 0.0, 1.0)
    return steady(**{YAW_RATE: bias + 1e-4 * np.sin(np.arange(6000)), **dict.fromkeys(WHEELS, 20.0)})


# Causes of the reasons, in the joint method unless noted.
CAUSES: dict[str, Callable[[], dict[str, Array]]] = {
    "missing_signal": lambda: steady(**{YAW_RATE: np.nan}),
    "time": lambda: steady() | {"time_s": np.zeros(6000)},
    "gap": lambda: hole(steady()),
    "settling": steady,
    "speed": lambda: steady(**{SPEED: 1.0}),
    "curvature": lambda: steady(**{YAW_RATE: 2.0}),
    "longitudinal_acceleration": lambda: steady(**{SPEED: 10.0 + np.minimum(np.arange(6000) / 50.0, 20.0)}),
    "bank": lambda: steady(**{ACCELERATION: 5.0}),
    "yaw_rate_bias": running_away,
    "lateral_acceleration": lambda: steady(**{YAW_RATE: 0.2, ACCELERATION: 4.0}),
    "intervention": lambda: steady(stability_control_active=1.0),
    "reverse": lambda: steady(**{SPEED: 5.0}, reverse=1.0),
    "steering_assist": lambda: steady(steering_assist_active=1.0),
    "signal_fault": lambda: steady(**{ANGLE: np.where(np.arange(6000) % 2 == 0, 0.03, 0.0)}),
}


@pytest.mark.parametrize("reason", _core.REASONS)
def test_there_is_a_drive_for_every_reason(reason: str) -> None:
    if reason == "window":  # no tick has it: it counts pending ticks
        core = core_of("thesis")
        core.run(steady())
        assert core.answer()["rejected"][list(_core.REASONS).index("window")] > 0.0
        return
    columns = CAUSES[reason]()
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core_of().run(columns, outputs)
    assert (outputs["reasons"] & _core.REASONS[reason]).any()


def test_an_estimate_is_first_unobservable_then_converging_then_valid() -> None:
    columns = drive(1, RATE_HZ, 200.0)
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core_of("thesis").run(columns, outputs)
    changes = np.flatnonzero(np.diff(outputs["offset_status"].astype(int)))
    statuses = [_core.STATUSES[outputs["offset_status"][k]] for k in (0, *(changes + 1))]
    assert statuses[:3] == ["unobservable", "converging", "valid"]


@pytest.mark.parametrize("method", _core.METHODS)
@pytest.mark.parametrize("angle_method", _core.ANGLE_METHODS)
def test_all_methods_work_with_all_angle_methods(method: str, angle_method: str) -> None:
    columns = steady(**dict.fromkeys(WHEELS, 20.0))
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core = core_of(method, angle_method)
    core.run(columns, outputs)
    assert (outputs["reasons"][-1000:] == 0).all()
    assert np.isfinite(outputs["angle"]["angle"]).all()
    assert outputs["angle"]["angle"].any()


def refusal(**wrong: float) -> str:
    """Setup's error for an impossible vehicle, params or rate."""
    vehicle = ffi.new("oc_vehicle *", {"wheelbase": WHEELBASE, "steering_ratio": RATIO})
    params = ffi.new("oc_params *")
    lib.oc_params_defaults(params)
    vehicle.wheelbase = wrong.get("wheelbase", WHEELBASE)
    params.speed_min_m_s = wrong.get("speed_min_m_s", params.speed_min_m_s)
    error = lib.oc_setup(ffi.new("oc_coefficients *"), vehicle, params, wrong.get("rate_hz", RATE_HZ))
    return str(ffi.string(lib.oc_error_name(error)).decode())


def test_setup_names_the_part_that_it_refuses() -> None:
    given = [{}, {"wheelbase": 0.0}, {"speed_min_m_s": -1.0}, {"rate_hz": 5.0}]
    assert [refusal(**wrong) for wrong in given] == ["ok", "vehicle", "params", "rate"]


@pytest.mark.parametrize(
    ("name_of", "count"),
    [
        (lib.oc_error_name, lib.OC_ERROR_COUNT),
        (lib.oc_status_name, lib.OC_STATUS_COUNT),
        (lib.oc_method_name, lib.OC_METHOD_COUNT),
        (lib.oc_angle_method_name, lib.OC_ANGLE_METHOD_COUNT),
        (lib.oc_fault_name, lib.OC_FAULT_COUNT),
    ],
)
def test_all_members_have_distinct_names_and_no_others(name_of: Callable[[int], object], count: int) -> None:
    names = [ffi.string(name_of(k)).decode() for k in range(count + 1)]
    assert len(set(names)) == len(names)
    assert names[count] == "unknown"


def test_a_combination_of_reasons_has_no_name() -> None:
    assert lib.oc_reason_name(3) == ffi.NULL
    assert lib.oc_reason_name(1 << lib.OC_REASON_COUNT) == ffi.NULL
