"""Test vectors: a drive in whole numbers and the core's outputs for it, as a C header."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import reduce
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.simulate import simulate
from oncenter.vehicle import Vehicle, vehicle

_SCENARIO, _SEED = "worn_truck", 1  # play, biases, dropouts, all wheel speeds: much of the core is in use
_RATE_HZ = 20.0
_ROWS, _EVERY = 6000, 100  # five minutes; outputs are listed every _EVERY rows
_NOT_AVAILABLE = -32768
_RESOLUTIONS = {  # in the order of oc_signals.valid's bits, as test_vectors.c has them
    "steering_wheel_angle_rad": 1 / 1024,
    "yaw_rate_rad_s": 1 / 8192,
    "vehicle_speed_m_s": 1 / 512,
    "lateral_acceleration_m_s2": 1 / 2048,
    "wheel_speed_front_left_m_s": 1 / 512,
    "wheel_speed_front_right_m_s": 1 / 512,
    "wheel_speed_rear_left_m_s": 1 / 512,
    "wheel_speed_rear_right_m_s": 1 / 512,
}
_CASES = (("joint", "observer"), ("thesis", "yaw-rate"), ("wheel-speed", "wheel-speed"))
_OUTPUTS = (  # as list_output of test_vectors.c
    "time vehicle_speed motion.curvature motion.longitudinal_acceleration motion.bank motion.residual reasons "
    "offset_status offset offset_sd offset_parts.drive_sd offset_parts.pull_sd offset_parts.wind_sd "
    "offset_parts.set_up_sd understeer_gradient backlash place unloading_acceleration evidence yaw_rate_bias "
    "yaw_rate_bias_sd angle.angle angle.standard_deviation angle.estimate fault"
).split()
_ANSWERS = (  # as list_answer of test_vectors.c
    "offset.value offset.standard_deviation offset.status understeer_gradient.value "
    "understeer_gradient.standard_deviation backlash.value backlash.standard_deviation unloading_acceleration.value "
    "equivalent_wheelbase.value yaw_rate_bias.value wheel_radius_mismatch_front.value "
    "wheel_radius_mismatch_rear.value bank_mean used unused"
).split()


def vectors_truck() -> Vehicle:
    """The truck of the vectors: the thesis's."""
    return vehicle("scania_r730_4x2")


_CASE_TYPE = (
    "typedef struct {",
    "    oc_method method;",
    "    oc_angle_method angle_method;",
    "    double outputs[VECTORS_ROWS / VECTORS_EVERY][VECTORS_OUTPUTS];",
    "    double answer[VECTORS_ANSWERS];",
    "} vectors_case;",
    "",
)


def vectors_header() -> str:
    """vectors.h for c/test_vectors.c: the drive, and for each case every hundredth tick's outputs and the answer."""
    drive = _drive()
    truck = vectors_truck()
    constants = {
        "ROWS": _ROWS,
        "EVERY": _EVERY,
        "NOT_AVAILABLE": _NOT_AVAILABLE,
        "OUTPUTS": len(_OUTPUTS),
        "ANSWERS": len(_ANSWERS),
        "CASES": len(_CASES),
    }
    numbers = {
        "WHEELBASE": truck.wheelbase_m,
        "STEERING_RATIO": truck.ratio_near_centre,
        "TRACK_WIDTH_FRONT": truck.track_width_front_m or 0.0,
        "TRACK_WIDTH_REAR": truck.track_width_rear_m or 0.0,
    }
    head = [
        "#ifndef ONCENTER_VECTORS_H",
        "#define ONCENTER_VECTORS_H",
        f"/* Written by oncenter {_core.version()}: a simulated drive, {_SCENARIO} with seed {_SEED}, and the",
        " * core's outputs for it, as doubles to the last bit. */",
        "",
        '#include "monitor.h"',
        "",
        "enum {",
        *(f"    VECTORS_{name} = {value}," for name, value in constants.items()),
        "};",
        "",
        *(f"#define VECTORS_{name} {value!r}" for name, value in numbers.items()),
        "",
        f"static const double vectors_rate_hz = {_RATE_HZ!r};",
        "",
        *_CASE_TYPE,
    ]
    rows = ["    {" + ", ".join(map(str, row)) + "}," for row in drive.tolist()]
    cases = [_case(truck, method, angle_method, drive) for method, angle_method in _CASES]
    drive_rows = ["static const int16_t vectors_drive[VECTORS_ROWS][8] = {", *rows, "};", ""]
    case_rows = ["static const vectors_case vectors_cases[VECTORS_CASES] = {", *cases, "};", ""]
    return "\n".join([*head, *drive_rows, *case_rows, "#endif", ""])


def _drive() -> npt.NDArray[np.int64]:
    """Raw values, shape (_ROWS, 8)."""
    signals, _ = simulate(_SCENARIO, seed=_SEED)
    table = signals.table.gather_every(round(signals.rate_hz / _RATE_HZ)).head(_ROWS)
    raw = np.column_stack([table[name].to_numpy() / resolution for name, resolution in _RESOLUTIONS.items()])
    inside = np.abs(raw) < -_NOT_AVAILABLE - 1  # NaN is not inside
    return np.where(inside, np.rint(np.where(inside, raw, 0.0)), _NOT_AVAILABLE).astype(np.int64)


def _case(truck: Vehicle, method: str, angle_method: str, drive: npt.NDArray[np.int64]) -> str:
    core = _core.Core(
        truck.wheelbase_m,
        truck.ratio_near_centre,
        {},
        _RATE_HZ,
        track_width_front_m=truck.track_width_front_m or 0.0,
        track_width_rear_m=truck.track_width_rear_m or 0.0,
        traffic_side=1.0,
        method=method,
        angle_method=angle_method,
    )
    columns = {
        name: np.where(drive[:, k] == _NOT_AVAILABLE, np.nan, drive[:, k] * resolution)
        for k, (name, resolution) in enumerate(_RESOLUTIONS.items())
    }
    outputs = np.zeros(len(drive), _core.OUTPUT_DTYPE)
    core.run({"time_s": np.arange(len(drive)) / _RATE_HZ, **columns}, outputs)
    listed = outputs[::_EVERY]
    table = np.column_stack([_member(listed, path).astype(np.float64) for path in _OUTPUTS])
    answer = core.answer()
    head = f"    {{{_core.METHODS.index(method)}, {_core.ANGLE_METHODS.index(angle_method)}, {{"
    final = _numbers(float(_member(answer, path)) for path in _ANSWERS)
    return "\n".join([head, *(f"        {{{_numbers(row)}}}," for row in table.tolist()), f"    }}, {{{final}}}}},"])


def _member(struct: Any, path: str) -> Any:
    return reduce(lambda value, name: value[name], _parts(path), struct)


def _parts(path: str) -> Sequence[str]:
    return path.split(".")


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(float(value).hex() for value in values)
