"""Reads a vehicle file (TOML) and refuses a value without a unit or out of its range, by name."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError, field_validator, model_validator
from pydantic_core import ErrorDetails

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.shipped import shipped
from oncenter.files.toml_file import read_toml, refusal
from oncenter.nearest_name import did_you_mean, nearest
from oncenter.param_table import params
from oncenter.signals import DEGREE, SIGNALS, STANDARD_GRAVITY, SignalName
from oncenter.steering_ratio import SteeringRatio, near_centre

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]  # "3.7" and true are none
_Positive = Annotated[Number, Field(gt=0)]
_NotNegative = Annotated[Number, Field(ge=0)]
_TrackWidth = Annotated[Number, Field(ge=1, le=3)]
_Gradient = Annotated[Number, Field(ge=-5, le=5)]  # of trucks some 0 to 1
APPLIED_MAX_DEG = 720.0  # of a correction, either sign: two turns
OFFSET_LIMIT_DEG = 2.0  # thesis 5.6: the accuracy of its method on a well serviced truck
OFFSET_LIMIT_MAX_DEG = 30.0
_OffsetLimit = Annotated[Number, Field(gt=0, le=OFFSET_LIMIT_MAX_DEG)]
_AppliedOffset = Annotated[Number, Field(ge=-APPLIED_MAX_DEG, le=APPLIED_MAX_DEG)]
_Play = Annotated[Number, Field(ge=0, le=30)]
_PlaySd = Annotated[Number, Field(ge=0.1, le=30)]
_GradientSd = Annotated[Number, Field(ge=0.01, le=5)]
_Pull = Annotated[Number, Field(ge=-0.9, le=0.9)]
_AccelerometerBias = Annotated[Number, Field(ge=-0.9, le=0.9)]
_AccelerationSd = Annotated[Number, Field(ge=0.001, le=10)]
_YawRateBias = Annotated[Number, Field(ge=-10, le=10)]
_YawRateBiasSd = Annotated[Number, Field(ge=0.001, le=50)]
_CODE = "vehicle_file"  # of errors
_SWITCH = "use_accelerometer"  # of the params the one that is no quantity
# (m/s)^2, of `tandem_side_force_m2_s2`: between what laden and empty rigid trucks of that layout have
_TANDEM_SIDE_FORCE_M2_S2 = {"6x2": 12.0, "6x4": 19.0, "8x4": 10.0}
# By key: that of its standard deviation, and the params that have the two.
_KNOWN = {
    "play_deg": ("play_sd_deg", "known_play_deg", "known_play_sd_deg"),
    "understeer_gradient_deg_m_s2": (
        "understeer_gradient_sd_deg_m_s2",
        "known_understeer_gradient_deg_m_s2",
        "known_understeer_gradient_sd_deg_m_s2",
    ),
    "pull_m_s2": ("pull_sd_m_s2", "known_pull_m_s2", "known_pull_sd_m_s2"),
    "accelerometer_bias_m_s2": (
        "accelerometer_bias_sd_m_s2",
        "known_accelerometer_bias_m_s2",
        "known_accelerometer_bias_sd_m_s2",
    ),
    "yaw_rate_bias_deg_s": ("yaw_rate_bias_sd_deg_s", "known_yaw_rate_bias_deg_s", "known_yaw_rate_bias_sd_deg_s"),
}
_MAY_LACK_ITS_SD = "understeer_gradient_deg_m_s2"  # `oncenter.budget` takes it alone
_BOUNDED_BY = {  # params that another bounds more closely than the core's table of ranges does
    "delay_band_hz": "below 'cutoff_hz'",
    "understeer_acceleration_max_m_s2": "at least 'understeer_acceleration_min_m_s2'",
}


class _SignalEntry(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    unit: str | None = None
    sign: Literal[1, -1] = 1


class Sensors(BaseModel):
    """By how much a truck's sensors may be off: Table 1's worst where a file says nothing, and Figure 16's speed.

    Attributes:
        steering_wheel_angle_hysteresis_deg: what turning back and forth may leave.
        yaw_rate_bias_deg_s, lateral_acceleration_bias_m_s2: either sign.
        speed_scale_percent: by how much the speed reads too high, -20 to 20.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    steering_wheel_angle_hysteresis_deg: _NotNegative = 2.5
    yaw_rate_bias_deg_s: _NotNegative = 3.0
    lateral_acceleration_bias_m_s2: _NotNegative = 0.1 * STANDARD_GRAVITY
    speed_scale_percent: Annotated[Number, Field(ge=-20, le=20)] = 5.0


class Vehicle(BaseModel):
    """What a truck is. `wheelbase_m` and `steering_ratio` are enough; the rest sharpens or comes in later.

    Attributes:
        name: for people.
        wheelbase_m: first to (equivalent) rear axle, 1 to 20 m; Winkler's equivalent wheelbase for more than two axles.
        steering_ratio: steering wheel angle per front wheel angle near the centre, 1 to 60; or the polynomial's
            2 to 8 coefficients from the steering wheel angle to the front wheel angle (both rad, lowest power first),
            of which the ratio near the centre follows; it must be 1 to 60 up to 3 rad to either side.
        track_width_front_m, track_width_rear_m: between the middles of left and right tyres, 1 to 3 m; with them the
            wheel speeds tell the yaw rate's bias better.
        axle_layout: 4x2, 6x2, 6x4, 8x4; but for the first its rear axles resist turning, and load the front ones in
            bends: `tandem_side_force_m2_s2` where `params` do not say how much; an axle that steers itself hardly does.
        mass_kg: prior.
        understeer_gradient_deg_m_s2, understeer_gradient_sd_deg_m_s2: K_us/g at the road wheel, -5 to 5; for
            `oncenter.budget`, and with the standard deviation a prior of the joint method. It changes with load: the
            standard deviation must allow for that.
        play_deg, play_sd_deg: free play at the steering wheel, full width, wind-up of the column included, as an
            answer's `backlash`.
        pull_m_s2, pull_sd_m_s2: lateral acceleration at which the steering is without moment because of the wheel
            alignment, positive to the left.
        accelerometer_bias_m_s2, accelerometer_bias_sd_m_s2: what the lateral accelerometer reads on level ground.
        yaw_rate_bias_deg_s, yaw_rate_bias_sd_deg_s: what the yaw rate sensor reads at standstill.
        offset_applied_deg: a correction that the ECU already adds to the sensor's reading, so that logs contain it.
        offset_limit_deg: a straight-ahead offset of this size or more, either sign, needs a recalibration.
        traffic_side: which side of the road is driven on: tells the side to which the crown falls.
        sensors: by how much they may be off, for `oncenter.budget`.
        signals: by signal name, how this truck's logs call it, for logs that use other names.
        dbc: databases of this truck's logs, for those that are not J1939; a relative path is of the vehicle file's
            folder. `databases()` has them checked.
            A value with `_sd_` is a standard deviation; a known value needs its own.
        params: of the estimator, where they differ from the core's defaults; an angle may be given in `_deg`.
        source: by key, where a value comes from.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = "unnamed"
    wheelbase_m: _Positive
    steering_ratio: SteeringRatio
    track_width_front_m: _TrackWidth | None = None
    track_width_rear_m: _TrackWidth | None = None
    axle_layout: Literal["4x2", "6x2", "6x4", "8x4"] | None = None
    mass_kg: _Positive | None = None
    understeer_gradient_deg_m_s2: _Gradient | None = None
    understeer_gradient_sd_deg_m_s2: _GradientSd | None = None
    play_deg: _Play | None = None
    play_sd_deg: _PlaySd | None = None
    pull_m_s2: _Pull | None = None
    pull_sd_m_s2: _AccelerationSd | None = None
    accelerometer_bias_m_s2: _AccelerometerBias | None = None
    accelerometer_bias_sd_m_s2: _AccelerationSd | None = None
    yaw_rate_bias_deg_s: _YawRateBias | None = None
    yaw_rate_bias_sd_deg_s: _YawRateBiasSd | None = None
    offset_applied_deg: _AppliedOffset = 0.0
    offset_limit_deg: _OffsetLimit = OFFSET_LIMIT_DEG
    traffic_side: Literal["right", "left"] | None = None
    sensors: Sensors = Sensors()
    signals: Mapping[str, _SignalEntry] = {}
    dbc: tuple[Path, ...] = ()
    params: Mapping[str, float] = {}
    source: Mapping[str, str] = {}
    _origin: str = PrivateAttr("")  # the vehicle file, for messages

    @model_validator(mode="before")
    @classmethod
    def _side_force_of_layout(cls, values: Any) -> Any:
        """What is of no right kind is left to those who refuse it by name."""
        if not isinstance(values, dict):
            return values
        layout, params = values.get("axle_layout"), values.get("params", {})
        force = _TANDEM_SIDE_FORCE_M2_S2.get(layout) if isinstance(layout, str) else None
        if force is None or not isinstance(params, Mapping):
            return values
        return values | {"params": {"tandem_side_force_m2_s2": force, **params}}

    @model_validator(mode="before")
    @classmethod
    def _known_values(cls, values: Any) -> Any:
        """As params of the core; what is of no right kind is left to those who refuse it by name."""
        if not isinstance(values, dict) or not isinstance(values.get("params", {}), Mapping):
            return values
        given: dict[str, object] = {}
        for key, (sd_key, param, sd_param) in _KNOWN.items():
            value, sd = values.get(key), values.get(sd_key)
            if value is None and sd is not None:
                raise ValueError(f"'{sd_key}' is the standard deviation of '{key}', which is missing")
            if value is not None and sd is None and key != _MAY_LACK_ITS_SD:
                raise ValueError(f"'{key}' needs its standard deviation, '{sd_key}'")
            if _is_number(value) and _is_number(sd):
                given |= {param: value, sd_param: sd}
        return values | {"params": {**given, **values.get("params", {})}} if given else values

    @field_validator("signals")
    @classmethod
    def _known_signals(cls, value: Mapping[str, _SignalEntry]) -> Mapping[str, _SignalEntry]:
        for name in value:
            if name != "time" and name not in SIGNALS:
                meant = did_you_mean(name, SIGNALS) or f"; known are time, {', '.join(SIGNALS)}"
                raise ValueError(f"'{name}' is no signal{meant}")
        return value

    @field_validator("dbc", mode="before")
    @classmethod
    def _one_or_several(cls, value: object) -> object:
        several = [value] if isinstance(value, str | Path) else value
        if not isinstance(several, list | tuple) or not all(isinstance(each, str | Path) for each in several):
            raise ValueError(f"is a path or a list of paths, got {value!r}")
        return several

    @field_validator("params", mode="before")
    @classmethod
    def _known_params(cls, value: object) -> object:
        return core_params(value) if isinstance(value, Mapping) else value

    def __repr__(self) -> str:
        return f"Vehicle({self.name!r}, wheelbase_m={self.wheelbase_m:g}, steering_ratio={self.steering_ratio})"

    __str__ = __repr__

    @property
    def origin(self) -> str:
        """The vehicle file, as it was named; empty where there is none."""
        return self._origin

    @property
    def ratio_near_centre(self) -> float:
        return near_centre(self.steering_ratio)

    @property
    def traffic_sign(self) -> float:
        """1 where the road's crown falls to the right, -1 to the left, 0 where nobody knows."""
        return {"right": 1.0, "left": -1.0, None: 0.0}[self.traffic_side]

    @property
    def signal_names(self) -> dict[str, SignalName]:
        """The `[signals]` table as readers take it."""
        return {key: SignalName(entry.name, entry.unit, entry.sign) for key, entry in self.signals.items()}

    def databases(self) -> tuple[Path, ...]:
        """The files of `dbc`.

        Raises:
            OncenterError: "vehicle_file", exit code 2: one is not there.
        """
        for path in self.dbc:
            try:
                is_there = path.is_file()
            except (OSError, ValueError):  # a path that may not be looked at, or can be none
                is_there = False
            if not is_there:
                raise refusal(f"vehicle file {self._origin or self.name}: its dbc {path} is no file", _CODE)
        return self.dbc


def check_vehicle(given: object, verb: str) -> None:
    """
    Raises:
        OncenterError: "not_a_vehicle", exit code 2: a verb got something else.
    """
    if not isinstance(given, Vehicle):
        raise OncenterError(
            f"{verb} takes a Vehicle: oncenter.vehicle(path); got {type(given).__name__}",
            code="not_a_vehicle",
            exit_code=WRONG_USAGE,
        )


def core_of(
    vehicle: Vehicle,
    rate_hz: float,
    *,
    method: str = "joint",
    angle_method: str = "observer",
    params: Mapping[str, float] | None = None,
    track_widths: Mapping[str, float] | None = None,
) -> _core.Core:
    """The core as everybody has it, the desk, the bus, the fleet and the truck: its angle sensor is always judged.

    Args:
        vehicle: its `[params]` apply.
        rate_hz: of the ticks.
        method: one of `_core.METHODS`.
        angle_method: one of `_core.ANGLE_METHODS`.
        params: over the vehicle's.
        track_widths: `track_width_front_m` and `track_width_rear_m`, 0 where unknown; the vehicle's where left out.

    Raises:
        OncenterError: "params", exit code 2.
    """
    widths = track_widths or {
        "track_width_front_m": vehicle.track_width_front_m or 0.0,
        "track_width_rear_m": vehicle.track_width_rear_m or 0.0,
    }
    try:
        return _core.Core(
            vehicle.wheelbase_m,
            vehicle.ratio_near_centre,
            core_params(vehicle.params, params or {}),
            rate_hz,
            method=method,
            angle_method=angle_method,
            traffic_side=vehicle.traffic_sign,
            ratio_polynomial=vehicle.steering_ratio if isinstance(vehicle.steering_ratio, tuple) else (),
            **widths,
        )
    except ValueError as error:
        raise OncenterError(str(error), code="params", exit_code=WRONG_USAGE) from None


def core_params(*layers: Mapping[str, float]) -> dict[str, float]:
    """Params by the core's names, later layers over earlier ones: an angle given with `_deg` becomes its `_rad`.

    Raises:
        ValueError: naming a param that is unknown, lacks its unit, is no number, is given twice in one layer, or is out
            of its range, which it tells.
    """
    known = _core.default_params()
    values: dict[str, float] = {}
    given: dict[str, str] = {}  # by the core's name, how it was called
    for layer in layers:
        renamed = {name: _core_name(name, known) for name in layer}
        _refuse_twice(renamed)
        for name, core_name in renamed.items():
            values[core_name] = _number(name, layer[name]) * (DEGREE if core_name != name else 1.0)
            given[core_name] = name
    bad = _core.bad_param(values)
    if bad is not None:
        name = given.get(bad, bad)
        per_given = DEGREE if name != bad else 1.0
        value = values.get(bad, known[bad])
        raise ValueError(f"parameter '{name}' must be {_would_do(bad, value, per_given)}, got {value / per_given:g}")
    return values


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf


def _core_name(name: str, known: Mapping[str, float]) -> str:
    in_rad = re.sub(r"_deg(?=_|$)", "_rad", name)
    if in_rad not in known:
        near = [k for k in known if k.startswith(name) or name.startswith(k.rsplit("_", 1)[0])]
        hint = "did you mean" if near else "known are"
        raise ValueError(f"'{name}' is no parameter; {hint} {', '.join(near or known)}")
    return in_rad


def _refuse_twice(renamed: Mapping[str, str]) -> None:
    for name, in_rad in renamed.items():
        if name != in_rad and in_rad in renamed:
            raise ValueError(f"parameter '{name}' is also given as '{in_rad}': which one is meant?")


def _number(name: str, value: Any) -> float:
    if name == _SWITCH and value not in (0, 1):
        raise ValueError(f"parameter '{name}' must be 0 or 1, got {value!r}")
    is_number = isinstance(value, Real) and (name == _SWITCH or not isinstance(value, bool))
    try:
        number = float(value) if is_number else math.nan
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"parameter '{name}' must be a finite number, got {value!r}")
    return number


def _would_do(name: str, value: float, per_given: float) -> str:
    """The range of a param in the unit in which it was given; or what bounds it where the core's table does not."""
    param = params()[name]
    low, high = param.low, param.high
    if low <= value <= high:
        return _BOUNDED_BY[name]
    return f"{low / per_given:.4g} to {high / per_given:.4g}"


def vehicle(path: str | os.PathLike[str]) -> Vehicle:
    """Reads a vehicle file.

    Args:
        path: a TOML file of at most 1 MiB; the shipped ones may be given by their name alone, as "scania_r730_4x2".

    Raises:
        OncenterError: "vehicle_file", exit code 2: unreadable, no TOML, or a value is missing, unknown or out of range.
    """
    file = Path(path)
    by_name = shipped("vehicles") / f"{file.name.removesuffix('.toml')}.toml"
    try:
        if not file.exists() and by_name.exists() and file.parent == Path("."):
            file = by_name
    except (OSError, ValueError):  # reading it says why
        pass
    truck = vehicle_from(read_toml(file, f"vehicle file {path}", code=_CODE), str(path))
    return truck.model_copy(update={"dbc": tuple(file.parent / each for each in truck.dbc)})


def vehicle_from(values: Mapping[str, Any], origin: str) -> Vehicle:
    """A vehicle from a mapping as a vehicle file holds it; raises as `vehicle` does, naming `origin`."""
    try:
        truck = Vehicle.model_validate({"name": Path(origin).stem, **values})
    except ValidationError as error:
        raise refusal(f"vehicle file {origin}: {_first_error(error)}", _CODE) from None
    truck._origin = origin
    if _core.bad_vehicle(truck.wheelbase_m, truck.ratio_near_centre) is not None:
        raise refusal(f"vehicle file {origin}: 'wheelbase_m' must be 1 to 20, got {truck.wheelbase_m:g}", _CODE)
    return truck


def _first_error(error: ValidationError) -> str:
    """One complaint in one line, with the names that would do: a misspelt key comes before what is missing by it."""
    errors = error.errors()
    first = next((each for each in errors if each["type"] == "extra_forbidden"), errors[0])
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "missing":
        return f"'{key}' is missing"
    if first["type"] == "extra_forbidden":
        table, _, unknown = key.rpartition(".")
        fields = _fields_of(table)
        near = [field for field in fields if field.startswith(unknown)] or nearest(unknown, fields)
        hint = "did you mean" if near else "known are"
        return f"'{key}' is not known here; {hint} {', '.join(near or fields)}"
    if first["type"] == "value_error":
        message = str(first["msg"]).removeprefix("Value error, ")
        return message if key in ("", "signals", "params") else f"'{key}' {message}"  # those name what is in them
    return f"'{key}' {_would_be(key, first)}, got {first['input']!r}"


def _would_be(key: str, error: ErrorDetails) -> str:
    """What a value must be, in words of a TOML file."""
    if error["type"] in ("model_type", "model_attributes_type", "mapping_type", "dict_type"):
        if key.startswith("signals."):
            return 'must be a table such as { name = "SteerAng", unit = "deg", sign = -1 }'
        return f"must be a table, [{key}]"
    if error["type"] == "string_type":
        return "must be text in quotes"
    return error["msg"].replace("Input should be", "must be")


def _fields_of(table: str) -> Mapping[str, object]:
    """What a table of a vehicle file may hold; the file itself is ""."""
    if table == "sensors":
        return Sensors.model_fields
    return _SignalEntry.model_fields if table.startswith("signals.") else Vehicle.model_fields
