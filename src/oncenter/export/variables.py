"""The variables of the FMU: one table of names, units, types and descriptions, and the C table from it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal

from oncenter import _core
from oncenter.estimates.estimates import DEFAULT_METHOD
from oncenter.param_table import params
from oncenter.signals import DEGREE
from oncenter.vehicle import Vehicle

Type = Literal["real", "integer", "boolean", "enumeration"]
Role = Literal["independent", "parameter", "input", "output", "answer"]

# By name: FMI's base units, each with its power.
UNITS: dict[str, dict[str, int]] = {
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "rad/(m/s2)": {"rad": 1, "m": -1, "s": 2},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "1/m": {"m": -1},
    "m2/s2": {"m": 2, "s": -2},
    "s2/m": {"m": -1, "s": 2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "N m/(m/s2)": {"kg": 1, "m": 1},
    "s": {"s": 1},
    "Hz": {"s": -1},
    "1": {},
}
DISPLAY_UNITS = {unit: unit.replace("rad", "deg") for unit in UNITS if unit.startswith("rad")}
RADIANS_TO_DEGREES = 1.0 / DEGREE

ENUMERATIONS: dict[str, dict[str, int]] = {
    "Status": {name: k for k, name in enumerate(_core.STATUSES)},
    "Method": {name: k for k, name in enumerate(_core.METHODS)},
    "AngleMethod": {name: k for k, name in enumerate(_core.ANGLE_METHODS)},
    "SensorFault": {name: k for k, name in enumerate(_core.FAULTS)},
    "SignalFault": {name: k for k, name in enumerate(_core.SIGNAL_FAULTS)},
    "TrafficSide": {"left": -1, "unknown": 0, "right": 1},
}

_UNOBSERVABLE = "unobservable"


@dataclass(frozen=True)
class Variable:
    """One variable; its value reference is its place in the table.

    Attributes:
        member: of `oc_fmu` in export/fmi/instance.h.
        unit: of UNITS, of a real one.
        enumeration: of ENUMERATIONS, of an enumeration.
        start: of parameters and inputs; None of outputs.
        low, high: the range that the core accepts, of parameters.
    """

    name: str
    member: str
    role: Role
    about: str
    type: Type = "real"
    unit: str = "1"
    enumeration: str = ""
    start: float | None = None
    low: float | None = None
    high: float | None = None


def variables_of(vehicle: Vehicle) -> list[Variable]:
    """All variables in the order of their value references, with the vehicle file's values as start values."""
    return [
        Variable("time", "now", "independent", "Simulation time", unit="s"),
        *_vehicle(vehicle),
        *_params(vehicle),
        *_inputs(),
        *_outputs(),
        *_answer(),
    ]


def _vehicle(vehicle: Vehicle) -> Iterator[Variable]:
    terms = vehicle.steering_ratio if isinstance(vehicle.steering_ratio, tuple) else ()

    def real(name: str, member: str, about: str, unit: str, start: float, low: float, high: float) -> Variable:
        return Variable(f"vehicle.{name}", f"vehicle.{member}", "parameter", about, "real", unit, "", start, low, high)

    yield real(
        "wheelbase_m", "wheelbase", "Wheelbase, equivalent for more than two axles", "m", vehicle.wheelbase_m, 1, 20
    )
    yield real(
        "steering_ratio",
        "steering_ratio",
        "Steering wheel angle per front wheel angle near the centre",
        "1",
        vehicle.ratio_near_centre,
        1,
        60,
    )
    for axle, width in (("front", vehicle.track_width_front_m), ("rear", vehicle.track_width_rear_m)):
        about = f"Track width of the {axle} axle, between tyre centres, 1 to 3; 0 if not given"
        yield real(f"track_width_{axle}_m", f"track_width_{axle}", about, "m", width or 0.0, 0, 3)
    yield Variable(
        "vehicle.traffic_side",
        "traffic_side",
        "parameter",
        "Side of the road that is driven on; its crown falls to it",
        "enumeration",
        enumeration="TrafficSide",
        start=vehicle.traffic_sign,
    )
    yield Variable(
        "vehicle.steering_ratio_terms",
        "vehicle.ratio.terms",
        "parameter",
        "Terms of the polynomial from steering wheel to front wheel angle; 0 for a constant ratio",
        "integer",
        start=len(terms),
        low=0,
        high=_core.RATIO_TERMS_MAX,
    )
    for k in range(_core.RATIO_TERMS_MAX):
        yield Variable(
            f"vehicle.steering_ratio_term[{k + 1}]",
            f"vehicle.ratio.coefficients[{k}]",
            "parameter",
            f"Front wheel angle in rad per (steering wheel angle in rad)^{k}",
            start=terms[k] if k < len(terms) else 0.0,
        )


def _params(vehicle: Vehicle) -> Iterator[Variable]:
    used = _core.default_params() | dict(vehicle.params)
    yield Variable("rate_hz", "rate_hz", "parameter", "Ticks per second", unit="Hz", start=100.0, low=20.0, high=200.0)
    yield Variable(
        "method",
        "method",
        "parameter",
        "Estimation method",
        "enumeration",
        enumeration="Method",
        start=_core.METHODS.index(DEFAULT_METHOD),
    )
    yield Variable(
        "angle_method",
        "angle_method",
        "parameter",
        "Method of the steering wheel angle without its sensor; the sensor is checked against it",
        "enumeration",
        enumeration="AngleMethod",
        start=_core.ANGLE_METHODS.index("observer"),
    )
    yield Variable(
        "params.use_accelerometer",
        "params.use_accelerometer",
        "parameter",
        "Use the lateral acceleration; otherwise yaw rate times speed",
        "boolean",
        start=used["use_accelerometer"],
    )
    for param in params().values():
        yield Variable(
            f"params.{param.name}",
            f"params.{param.name}",
            "parameter",
            param.about,
            unit=param.unit,
            start=used[param.name],
            low=param.low,
            high=param.high,
        )


_INPUTS = (  # by the bits of oc_signals.valid: name, unit, description, default of its _available input
    ("steering_wheel_angle", "rad", "Steering wheel angle as measured, left positive", True),
    ("yaw_rate", "rad/s", "Yaw rate as measured, left positive", True),
    ("vehicle_speed", "m/s", "Vehicle speed, forward positive", True),
    ("lateral_acceleration", "m/s2", "Lateral acceleration, specific force, left positive", True),
    ("wheel_speed_front_left", "m/s", "Wheel speed at the tread, front left", False),
    ("wheel_speed_front_right", "m/s", "Wheel speed at the tread, front right", False),
    ("wheel_speed_rear_left", "m/s", "Wheel speed at the tread, rear left", False),
    ("wheel_speed_rear_right", "m/s", "Wheel speed at the tread, rear right", False),
    ("lateral_speed", "m/s", "Lateral speed over ground, left positive; only for the angle by side slip", False),
    ("steering_wheel_torque", "N m", "Steering wheel torque that the driver applies, left positive", False),
    ("stability_control_active", "1", "1 while stability control, roll-over or brake intervention is active", False),
    ("anti_lock_active", "1", "1 while the anti-lock brakes regulate", False),
    ("steering_assist_active", "1", "1 while a motor steers, as for lane keeping", False),
    ("reverse", "1", "1 while the truck drives backward or is in reverse gear", False),
    ("axle_lifted", "1", "1 while the axle that resists turning is lifted", False),
    (
        "rear_axle_angle",
        "rad",
        "Road wheel angle of a steered rear axle, left positive; used by rear_axle_weight_1",
        False,
    ),
)


def _inputs() -> Iterator[Variable]:
    for name, unit, about, _ in _INPUTS:
        yield Variable(name, f"tick.{name}", "input", about, unit=unit, start=0.0)
    for k, (name, _, _, available) in enumerate(_INPUTS):
        about = f"{name} is measured at this tick"
        yield Variable(f"{name}_available", f"available[{k}]", "input", about, "boolean", start=float(available))


def _outputs() -> Iterator[Variable]:
    def real(name: str, member: str, unit: str, about: str) -> Variable:
        return Variable(name, f"output.{member}", "output", about, unit=unit)

    def status(name: str, member: str, enumeration: str, about: str) -> Variable:
        return Variable(name, member, "output", about, "enumeration", enumeration=enumeration)

    yield real("tick_time", "time", "s", "Time of the last tick")
    yield real("motion.curvature", "motion.curvature", "1/m", "Curvature of the path, one filter delay old")
    yield real(
        "motion.longitudinal_acceleration",
        "motion.longitudinal_acceleration",
        "m/s2",
        "From the vehicle speed, one filter delay old",
    )
    yield real("motion.bank", "motion.bank", "m/s2", "Lateral acceleration minus yaw rate times speed: the road's bank")
    yield real(
        "motion.residual", "motion.residual", "rad", "Measured angle minus the angle for this yaw rate and speed"
    )
    for k, (reason, bit) in enumerate(_core.REASONS.items()):
        if reason != "window":  # is never the reason of one tick
            assert bit == 1 << k
            about = f"The last tick is not used: {reason.replace('_', ' ')}"
            yield Variable(f"reason.{reason}", f"reasons[{k}]", "output", about, "boolean")
    yield real("play_place", "place", "1", "Position in the free play: 1 on the left flank, -1 on the right flank")
    yield real("angle", "angle.angle", "rad", "True steering wheel angle")
    yield real("angle_rate", "angle.rate", "rad/s", "Rate of the true steering wheel angle")
    yield real("angle_sd", "angle.standard_deviation", "rad", "Standard deviation of angle")
    yield real("angle_estimate", "angle.estimate", "rad", "Steering wheel angle estimated from motion only")
    yield real("angle_delay", "angle.delay", "s", "Delay of an estimated angle; angle_sd contains it")
    yield status("angle_status", "angle_status", "Status", f"Status of angle; ignore angle while {_UNOBSERVABLE}")
    yield status("sensor_fault", "fault", "SensorFault", "Fault of the steering wheel angle sensor")
    yield real("sensor_fault_since", "fault_since", "s", "Time at which the sensor's fault began")
    yield real("sensor_fault_confidence", "fault_confidence", "1", "Minimum probability of the sensor's fault")
    yield status("signal_fault", "signal_fault", "SignalFault", "Fault of signals_at_fault; offset is invalid then")
    bits = ", ".join(f"{bit} {name.replace('_', ' ')}" for name, bit in _core.SIGNAL_BITS.items())
    yield Variable("signals_at_fault", "signals_at_fault", "output", f"Sum of the signals at fault: {bits}", "integer")


_ESTIMATES = (  # name, member of oc_answer, unit, description
    (
        "offset",
        "offset",
        "rad",
        "Straight-ahead offset of the steering wheel angle: true angle = measured angle - offset",
    ),
    ("understeer_gradient", "understeer_gradient", "rad/(m/s2)", "Understeer gradient over g at the road wheel"),
    ("backlash", "backlash", "rad", "Free play of the steering at the steering wheel, full width"),
    (
        "unloading_acceleration",
        "unloading_acceleration",
        "m/s2",
        "Neutral lateral acceleration: measured value without lateral force in the steering",
    ),
    ("equivalent_wheelbase", "equivalent_wheelbase", "m", "Wheelbase that fits the bends"),
    ("yaw_rate_bias", "yaw_rate_bias", "rad/s", "Bias of the yaw rate, now"),
    ("wheel_radius_mismatch_front", "wheel_radius_mismatch_front", "1", "Left over right radius minus one, front"),
    ("wheel_radius_mismatch_rear", "wheel_radius_mismatch_rear", "1", "Left over right radius minus one, rear"),
)


# In the order of oc_offset_parts and of the FMU's mirror of it: name, member, unit, description.
OFFSET_PARTS = (
    ("offset_drive_sd", "drive_sd", "rad", "Part of offset_sd from this drive; offset_status depends on it"),
    ("offset_pull_sd", "pull_sd", "rad", "Part of offset_sd from a pull, not identifiable from one drive"),
    ("offset_wind_sd", "wind_sd", "rad", "Part of offset_sd from the mean crosswind, not identifiable from one drive"),
    (
        "offset_set_up_sd",
        "set_up_sd",
        "rad",
        "Part of offset_sd from an axle set up for the crown, not identifiable from one drive",
    ),
    ("offset_per_acceleration", "per_acceleration", "rad/(m/s2)", "Change of offset by a pull or a mean crosswind"),
)


def _answer() -> Iterator[Variable]:
    for name, member, unit, about in _ESTIMATES:
        yield Variable(name, f"answer.{member}.value", "answer", about, unit=unit)
        sd = f"Standard deviation of the truth about {name}; 1.96 of it on both sides is a 95 % interval"
        yield Variable(f"{name}_sd", f"answer.{member}.standard_deviation", "answer", sd, unit=unit)
        status = f"Status of {name}; ignore its value while {_UNOBSERVABLE}"
        yield Variable(
            f"{name}_status", f"answer.{member}.status", "answer", status, "enumeration", enumeration="Status"
        )
    for k, (name, _, unit, about) in enumerate(OFFSET_PARTS):
        yield Variable(name, f"offset_parts[{k}]", "answer", about, unit=unit)
    yield Variable(
        "changes", "answer.changes", "answer", "Number of detected changes of the offset or of the bends", "integer"
    )
    for name, about in (("duration", "All ticks"), ("used", "Ticks that were used"), ("unused", "All others")):
        yield Variable(f"{name}_time", f"answer.{name}", "answer", about, unit="s")
    for k, reason in enumerate(_core.REASONS):
        about = f"Not used for {reason.replace('_', ' ')}; reasons overlap"
        yield Variable(f"rejected_time.{reason}", f"answer.rejected[{k}]", "answer", about, unit="s")


def c_table(variables: Iterable[Variable], token: str) -> str:
    """The table of export/fmi/instance.h as C."""
    rows = [
        f"    {{OC_FMU_{v.type.upper()}, OC_FMU_{v.role.upper()}, offsetof(oc_fmu, {v.member}), "
        f'{float(v.start or 0.0).hex()}, "{v.name}"}},'
        for v in variables
    ]
    return "\n".join(
        [
            "/* Written by oncenter export; a variable's value reference is its index in this table. */",
            "",
            '#include "instance.h"',
            "",
            f"typedef char a_place_for_each_signal[OC_FMU_SIGNALS == {len(_INPUTS)} ? 1 : -1];",
            f"typedef char a_place_for_each_part[OC_FMU_PARTS == {len(OFFSET_PARTS)} ? 1 : -1];",
            "",
            "const oc_fmu_variable oc_fmu_variables[] = {",
            *rows,
            "};",
            "",
            "const uint32_t oc_fmu_variable_count = sizeof oc_fmu_variables / sizeof oc_fmu_variables[0];",
            "",
            f'const char oc_fmu_token[] = "{token}";',
            "",
        ]
    )
