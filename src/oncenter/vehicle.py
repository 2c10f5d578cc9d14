"""Reads a vehicle file (TOML) and refuses, by name, a key without a unit and a value out of its range."""

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
from oncenter.learned_priors import LearnedPriors, learned_priors
from oncenter.nearest_name import did_you_mean, nearest
from oncenter.param_table import params
from oncenter.signals import DEGREE, SIGNALS, STANDARD_GRAVITY, STATUSES, SignalName
from oncenter.steering_ratio import SteeringRatio, near_centre
from oncenter.traffic_side import Side
from oncenter.vehicle_keys import KEYS, OFFSET_LIMIT_DEG, bounds

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]  # "3.7" and true are none
_CODE = "vehicle_file"  # of errors
_OUT_OF_RANGE = ("greater_than_equal", "less_than_equal")  # errors of pydantic
_SWITCH = "use_accelerometer"  # the only parameter that is not a quantity
_REAR_AXLE_WEIGHT_1 = {"rear": 1.0, "tag": 0.6}  # `rear_axle_weight_1`; rigid 6x2 trucks have 0.57 to 0.61
# `tandem_side_force_m2_s2`, (m/s)^2: between those of laden and of empty rigid trucks of that layout
_TANDEM_SIDE_FORCE_M2_S2 = {"6x2": 12.0, "6x4": 19.0, "8x4": 10.0}
ANY_SIDE_FORCE_M2_S2 = 8.0  # of an unknown truck without a layout: it halves the error of each layout
# By key: the key of its standard deviation, and the params of both.
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
    "rear_axle_zero_deg": ("rear_axle_zero_sd_deg", "known_rear_axle_zero_deg", "known_rear_axle_zero_sd_deg"),
}
# A file that lacks one of both, or both: their values in its place, and the sd of their product, as a share.
ASSUMED_WHEELBASE_M, ASSUMED_RATIO = 5.0, 20.0
UNKNOWN_TRUCK = "unknown truck"  # without a vehicle file
_FACTORS = {"wheelbase_m": (1.0, 20.0), "steering_ratio": (1.0, 60.0)}  # of the product, with the core's limits
_PRODUCT_SD = "known_wheelbase_share_sd_1"
_PRODUCT_SD_1 = {1: 0.15, 2: 0.3}
_TRAFFIC_SIGNS = {"right": 1.0, "left": -1.0}  # of the lateral acceleration on roads that fall to that side
SideBy = Literal["vehicle file", "position", "former drives"]
_ANGLE = "steering_wheel_angle"
_MAY_LACK_ITS_SD = "understeer_gradient_deg_m_s2"  # `oncenter.budget` takes it alone
_BOUNDED_BY = {  # params with a closer limit than their range, set by another param
    "delay_band_hz": "below 'cutoff_hz'",
    "understeer_acceleration_max_m_s2": "at least 'understeer_acceleration_min_m_s2'",
}


class _SignalEntry(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    unit: str | None = None
    sign: Literal[1, -1] = 1
    sign_by: str | None = None
    plus: str | None = None
    time: str | None = None
    time_unit: str | None = None
    road_wheel: bool = False
    true_when: Annotated[tuple[float | str, ...], Field(min_length=1, max_length=64)] | None = None


class Sensors(BaseModel):
    """The largest errors of a truck's sensors: the worst of Table 1 where a file says nothing, and Figure 16's speed.

    Attributes: `oncenter.vehicle_keys.KEYS` has the meaning, unit and range of each.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    steering_wheel_angle_hysteresis_deg: Annotated[Number, bounds("sensors.steering_wheel_angle_hysteresis_deg")] = 2.5
    yaw_rate_bias_deg_s: Annotated[Number, bounds("sensors.yaw_rate_bias_deg_s")] = 3.0
    lateral_acceleration_bias_m_s2: Annotated[Number, bounds("sensors.lateral_acceleration_bias_m_s2")] = (
        0.1 * STANDARD_GRAVITY
    )
    speed_scale_percent: Annotated[Number, bounds("sensors.speed_scale_percent")] = 5.0


STATED_WRONG_1 = 0.05  # probability that the stated set-up of an axle is wrong, as of an axle that is set up


class _PriorsFrom(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    from_: str = Field(alias="from", min_length=1, max_length=4096)


class Vehicle(BaseModel):
    """A truck. All values narrow the interval or name signals. Without `wheelbase_m` or `steering_ratio` the joint
    method estimates their product from the drive.

    Attributes: `oncenter.vehicle_keys` has the meaning, unit and range of each, and docs/reference/vehicle_file.md
    shows them. A value whose name has `_sd_` is a standard deviation. A relative path of `dbc` is of the vehicle file's
    folder; `databases()` has the paths checked. The steering ratio is a number, or the 2 to 8 coefficients of a
    polynomial from the steering wheel angle to the front wheel angle (both rad, lowest power first), whose ratio must
    be 1 to 60 up to 3 rad to either side.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = "unnamed"
    wheelbase_m: Annotated[Number, bounds("wheelbase_m")] = ASSUMED_WHEELBASE_M
    steering_ratio: SteeringRatio = ASSUMED_RATIO
    track_width_front_m: Annotated[Number, bounds("track_width_front_m")] | None = None
    track_width_rear_m: Annotated[Number, bounds("track_width_rear_m")] | None = None
    axle_layout: Literal["4x2", "6x2", "6x4", "8x4"] | None = None
    rear_axle_steers: Literal["rear", "tag"] | None = None
    mass_kg: Annotated[Number, bounds("mass_kg")] | None = None
    understeer_gradient_deg_m_s2: Annotated[Number, bounds("understeer_gradient_deg_m_s2")] | None = None
    understeer_gradient_sd_deg_m_s2: Annotated[Number, bounds("understeer_gradient_sd_deg_m_s2")] | None = None
    play_deg: Annotated[Number, bounds("play_deg")] | None = None
    play_sd_deg: Annotated[Number, bounds("play_sd_deg")] | None = None
    pull_m_s2: Annotated[Number, bounds("pull_m_s2")] | None = None
    pull_sd_m_s2: Annotated[Number, bounds("pull_sd_m_s2")] | None = None
    set_up_for_crown: Annotated[bool, Field(strict=True)] | None = None
    accelerometer_bias_m_s2: Annotated[Number, bounds("accelerometer_bias_m_s2")] | None = None
    accelerometer_bias_sd_m_s2: Annotated[Number, bounds("accelerometer_bias_sd_m_s2")] | None = None
    yaw_rate_bias_deg_s: Annotated[Number, bounds("yaw_rate_bias_deg_s")] | None = None
    yaw_rate_bias_sd_deg_s: Annotated[Number, bounds("yaw_rate_bias_sd_deg_s")] | None = None
    rear_axle_zero_deg: Annotated[Number, bounds("rear_axle_zero_deg")] | None = None
    rear_axle_zero_sd_deg: Annotated[Number, bounds("rear_axle_zero_sd_deg")] | None = None
    offset_applied_deg: Annotated[Number, bounds("offset_applied_deg")] = 0.0
    offset_limit_deg: Annotated[Number, bounds("offset_limit_deg")] = OFFSET_LIMIT_DEG
    traffic_side: Side | None = None
    sensors: Sensors = Sensors()
    signals: Mapping[str, _SignalEntry] = {}
    dbc: tuple[Path, ...] = ()
    params: Mapping[str, float] = {}
    priors: _PriorsFrom | None = None
    source: Mapping[str, str] = {}
    _origin: str = PrivateAttr("")  # the vehicle file, for messages
    _assumed: tuple[str, ...] = PrivateAttr(())
    _learned: LearnedPriors | None = PrivateAttr(None)
    _side_by: SideBy | None = PrivateAttr(None)

    @model_validator(mode="before")
    @classmethod
    def _params_of_axles(cls, values: Any) -> Any:
        """Sets the params of the axles. A value of a wrong type stays as it is: its own check names it."""
        if not isinstance(values, dict) or not isinstance(values.get("params", {}), Mapping):
            return values
        layout, steers = values.get("axle_layout"), values.get("rear_axle_steers")
        if (layout, steers) == ("4x2", "tag"):
            raise ValueError("'rear_axle_steers' = 'tag' needs three axles, and 'axle_layout' is '4x2': give 'rear'")
        if steers == "rear" and isinstance(layout, str) and layout in _TANDEM_SIDE_FORCE_M2_S2:
            raise ValueError(
                f"'rear_axle_steers' = 'rear' is of two axles, and 'axle_layout' is '{layout}': give 'tag'"
            )
        if values.get("rear_axle_zero_deg") is not None and steers is None and not _gives_weight(values):
            raise ValueError("'rear_axle_zero_deg' needs 'rear_axle_steers'")
        given: dict[str, float] = {}
        if isinstance(layout, str) and layout in _TANDEM_SIDE_FORCE_M2_S2 and steers != "tag":
            given["tandem_side_force_m2_s2"] = _TANDEM_SIDE_FORCE_M2_S2[layout]
        if isinstance(steers, str) and steers in _REAR_AXLE_WEIGHT_1:
            given["rear_axle_weight_1"] = _REAR_AXLE_WEIGHT_1[steers]
        return values | {"params": {**given, **values.get("params", {})}} if given else values

    @model_validator(mode="before")
    @classmethod
    def _prior_of_product(cls, values: Any) -> Any:
        """Sets the prior of ratio times wheelbase where one of them is missing."""
        if not isinstance(values, dict) or not isinstance(values.get("params", {}), Mapping):
            return values
        lacks = sum(key not in values for key in _FACTORS)
        if lacks == 0:
            return values
        tandem = {"tandem_side_force_m2_s2": ANY_SIDE_FORCE_M2_S2} if values.get("axle_layout") is None else {}
        return values | {"params": {_PRODUCT_SD: _PRODUCT_SD_1[lacks], **tandem, **values.get("params", {})}}

    @model_validator(mode="before")
    @classmethod
    def _set_up(cls, values: Any) -> Any:
        """Sets the params of an axle that is, or is not, set up for the crown."""
        if not isinstance(values, dict) or not isinstance(values.get("params", {}), Mapping):
            return values
        is_set_up, side = values.get("set_up_for_crown"), values.get("traffic_side")
        if is_set_up is not True:
            given = {"set_up_probability_1": 0.0} if is_set_up is False else {}
        elif side is not None and not isinstance(side, str):
            given = {}  # its own check names it
        elif side not in _TRAFFIC_SIGNS:
            raise ValueError("'set_up_for_crown' needs 'traffic_side': the crown falls to that side")
        elif values.get("pull_m_s2") is not None:
            raise ValueError("give 'set_up_for_crown' or 'pull_m_s2': the pull contains the set-up")
        else:
            by_default = _core.default_params()
            crown = by_default["crown_m_s2"] * _TRAFFIC_SIGNS[side]
            sd = values.get("params", {}).get("pull_sd_m_s2", by_default["pull_sd_m_s2"])  # a fleet's, or the file's
            given = {"known_pull_m_s2": crown, "known_pull_sd_m_s2": sd, "set_up_probability_1": 1.0 - STATED_WRONG_1}
        return values | {"params": {**given, **values.get("params", {})}} if given else values

    @model_validator(mode="after")
    def _note_origins(self) -> Vehicle:
        self._assumed = tuple(key for key in _FACTORS if key not in self.model_fields_set)
        self._side_by = "vehicle file" if self.traffic_side else None
        return self

    @model_validator(mode="before")
    @classmethod
    def _known_values(cls, values: Any) -> Any:
        """Sets the params of priors. A value of a wrong type stays as it is: its own check names it."""
        if not isinstance(values, dict) or not isinstance(values.get("params", {}), Mapping):
            return values
        given: dict[str, object] = {}
        for key, (sd_key, param, sd_param) in _KNOWN.items():
            value, sd = values.get(key), values.get(sd_key)
            if value is None and sd is not None:
                raise ValueError(f"'{sd_key}' is the standard deviation of '{key}', which is missing")
            if value is not None and sd is None and key != _MAY_LACK_ITS_SD:
                raise ValueError(f"'{key}' needs its standard deviation, '{sd_key}'")
            if key == _MAY_LACK_ITS_SD and sd is not None and "steering_ratio" not in values:
                raise ValueError(f"'{key}' is at the road wheel: as a prior it needs 'steering_ratio'")
            if _is_number(value) and _is_number(sd):
                given |= {param: value, sd_param: sd}
        return values | {"params": {**given, **values.get("params", {})}} if given else values

    @field_validator("signals")
    @classmethod
    def _known_signals(cls, value: Mapping[str, _SignalEntry]) -> Mapping[str, _SignalEntry]:
        for name in value:
            if name != "time" and name not in SIGNALS:
                meant = did_you_mean(name, SIGNALS) or f"; the signals are time, {', '.join(SIGNALS)}"
                raise ValueError(f"'{name}' is not a signal{meant}")
            for key in ("sign_by", "plus", "time", "time_unit") if name == "time" else ():
                if getattr(value[name], key):
                    raise ValueError(f"'time' has no '{key}'")
            if value[name].road_wheel and name != _ANGLE:
                raise ValueError(f"'{name}' has no 'road_wheel': only {_ANGLE} can be an angle of the road wheels")
            if value[name].true_when is not None and name not in STATUSES:
                raise ValueError(f"'{name}' has no 'true_when': only {', '.join(STATUSES)} are true or false")
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
        given = [f"{key}={getattr(self, key)}" for key in _FACTORS if key not in self.assumed]
        return f"Vehicle({', '.join([repr(self.name), *given])})"

    __str__ = __repr__

    @property
    def origin(self) -> str:
        """The vehicle file, as it was named; empty where there is none."""
        return self._origin

    @property
    def learned(self) -> LearnedPriors | None:
        """The priors of a fleet that the file reads."""
        return self._learned

    @property
    def assumed(self) -> tuple[str, ...]:
        """The names of "wheelbase_m" and "steering_ratio" that are not given: only their product is estimated."""
        return self._assumed

    @property
    def ratio_near_centre(self) -> float:
        return near_centre(self.steering_ratio)

    @property
    def ratio_times_wheelbase_m(self) -> float:
        return self.ratio_near_centre * self.wheelbase_m

    @property
    def prior_of_product_m(self) -> tuple[float, float]:
        """Mean and standard deviation of ratio times wheelbase before the drive, where one of both is assumed."""
        wheelbase_m = ASSUMED_WHEELBASE_M if "wheelbase_m" in self.assumed else self.wheelbase_m
        ratio = ASSUMED_RATIO if "steering_ratio" in self.assumed else self.ratio_near_centre
        return ratio * wheelbase_m, ratio * wheelbase_m * _PRODUCT_SD_1[len(self.assumed)]

    def with_product(self, product_m: float) -> Vehicle | None:
        """The truck with another ratio times wheelbase, by an assumed factor; None where no truck has that."""
        key = self.assumed[0]
        value = getattr(self, key) * product_m / self.ratio_times_wheelbase_m
        low, high = _FACTORS[key]
        return self.model_copy(update={key: value}) if low < value < high else None

    @property
    def traffic_sign(self) -> float:
        """1 where roads fall to the right, -1 where they fall to the left, 0 where the side is not given."""
        return _TRAFFIC_SIGNS.get(self.traffic_side or "", 0.0)

    @property
    def traffic_side_by(self) -> SideBy | None:
        """The source of `traffic_side`; None where the side is not given."""
        return self._side_by

    def with_traffic_side(self, side: Side | None, by: SideBy | None) -> Vehicle:
        """The truck with the side of traffic from another source, or without one. An axle that is set up for the crown
        pulls to the side of the vehicle file, so this pull goes with that side."""
        of_set_up = _KNOWN["pull_m_s2"][1:] if self.set_up_for_crown else ()
        params = {name: value for name, value in self.params.items() if name not in of_set_up}
        other = self.model_copy(update={"traffic_side": side, "params": params})
        other._side_by = by
        return other

    @property
    def angle_sign(self) -> int:
        """-1 where the truck's network counts a steering wheel angle to the right as positive."""
        entry = self.signals.get(_ANGLE)
        return 1 if entry is None else entry.sign

    @property
    def signal_names(self) -> dict[str, SignalName]:
        """The `[signals]` table as readers take it.

        Raises:
            OncenterError: "vehicle_file", exit code 2: an angle of the road wheels without a steering ratio.
        """
        if any(entry.road_wheel for entry in self.signals.values()) and "steering_ratio" in self.assumed:
            raise OncenterError(
                f"{self.origin or self.name}: an angle of the road wheels needs 'steering_ratio', by which it is "
                "multiplied",
                code="vehicle_file",
                exit_code=WRONG_USAGE,
            )
        return {
            key: SignalName(
                **entry.model_dump(exclude={"road_wheel"}), gain=self.ratio_near_centre if entry.road_wheel else 1.0
            )
            for key, entry in self.signals.items()
        }

    def databases(self) -> tuple[Path, ...]:
        """The files of `dbc`.

        Raises:
            OncenterError: "vehicle_file", exit code 2: one does not exist.
        """
        for path in self.dbc:
            try:
                is_there = path.is_file()
            except (OSError, ValueError):  # no permission, or not a valid path
                is_there = False
            if not is_there:
                raise refusal(f"vehicle file {self._origin or self.name}: its dbc {path} does not exist", _CODE)
        return self.dbc


def tandem_side_force_m2_s2() -> Mapping[str, float]:
    """The parameter `tandem_side_force_m2_s2` by axle layout, where `[params]` does not give it."""
    return _TANDEM_SIDE_FORCE_M2_S2


def vehicle_of(given: object, verb: str) -> Vehicle:
    """The vehicle; of a path, the one that its file describes.

    Raises:
        OncenterError: "not_a_vehicle", exit code 2: `given` is something else; as `vehicle` for a path.
    """
    if isinstance(given, str | os.PathLike):
        return vehicle(given)
    if not isinstance(given, Vehicle):
        raise OncenterError(
            f"{verb} takes a Vehicle: oncenter.vehicle(path); got {type(given).__name__}",
            code="not_a_vehicle",
            exit_code=WRONG_USAGE,
        )
    return given


JOINT_DOES = ", or use --method joint"  # without wheelbase and ratio


def require_truck(vehicle: Vehicle, what: str, hint: str = "") -> None:
    """
    Args:
        vehicle: of the user.
        what: needs its wheelbase and ratio.
        hint: what does without them, as the end of the message.

    Raises:
        OncenterError: "vehicle_file", exit code 2: the wheelbase or the steering ratio is only assumed.
    """
    if vehicle.assumed:
        keys = " and ".join(vehicle.assumed)
        raise OncenterError(
            f"{what} needs {keys} of the truck: give {keys} in a vehicle file (--vehicle){hint}",
            code="vehicle_file",
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
    """The core with the same settings for logs, bus, fleet and ECU: the angle sensor is always checked.

    Args:
        vehicle: its `[params]` apply.
        rate_hz: of the ticks.
        method: one of `_core.METHODS`.
        angle_method: one of `_core.ANGLE_METHODS`.
        params: in place of the vehicle's.
        track_widths: `track_width_front_m` and `track_width_rear_m`, 0 where not given; by default the vehicle's.

    Raises:
        OncenterError: "params" or "vehicle_file", exit code 2.
    """
    if method != "joint":
        require_truck(vehicle, f"method '{method}'", JOINT_DOES)
    if angle_method != "observer":
        require_truck(vehicle, f"the angle's method '{angle_method}'")
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
    """Params by the core's names; a later layer replaces an earlier one, and an angle in `_deg` becomes `_rad`.

    Raises:
        ValueError: names a param that does not exist, lacks its unit, is not a number, is given twice in one layer, or
            is out of its range, with that range.
    """
    known = _core.default_params()
    values: dict[str, float] = {}
    given: dict[str, str] = {}  # by the core's name, the name that was given
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
        raise ValueError(f"parameter '{name}' must be {_accepted(bad, value, per_given)}, got {value / per_given:g}")
    return values


def _gives_weight(values: Mapping[str, Any]) -> bool:
    return "rear_axle_weight_1" in values.get("params", {})


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf


def _core_name(name: str, known: Mapping[str, float]) -> str:
    in_rad = re.sub(r"_deg(?=_|$)", "_rad", name)
    if in_rad not in known:
        near = [k for k in known if k.startswith(name) or name.startswith(k.rsplit("_", 1)[0])] or nearest(name, known)
        hint = f"did you mean {', '.join(near)}" if near else "docs/params.md lists all of them"
        raise ValueError(f"'{name}' is not a parameter; {hint}")
    return in_rad


def _refuse_twice(renamed: Mapping[str, str]) -> None:
    for name, in_rad in renamed.items():
        if name != in_rad and in_rad in renamed:
            raise ValueError(f"parameter '{name}' is also given as '{in_rad}': delete one of them")


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


def _accepted(name: str, value: float, per_given: float) -> str:
    """The range of a param in the unit in which it was given; or the limit that another param sets."""
    param = params()[name]
    low, high = param.low, param.high
    if low <= value <= high:
        return _BOUNDED_BY[name]
    return f"{low / per_given:.4g} to {high / per_given:.4g}"


def vehicle(path: str | os.PathLike[str]) -> Vehicle:
    """Reads a vehicle file.

    Args:
        path: a TOML file of at most 1 MiB, or the name of a shipped one, such as "scania_r730_4x2".

    Raises:
        OncenterError: "vehicle_file", exit code 2: not readable, not TOML, or a key is missing, does not exist or has a
            value out of its range.
    """
    file = Path(path)
    by_name = shipped("vehicles") / f"{file.name.removesuffix('.toml')}.toml"
    try:
        if not file.exists() and by_name.exists() and file.parent == Path("."):
            file = by_name
    except (OSError, ValueError):  # reading gives the reason
        pass
    truck = vehicle_from(read_toml(file, f"vehicle file {path}", code=_CODE), str(path), file.parent)
    return truck.model_copy(update={"dbc": tuple(file.parent / each for each in truck.dbc)})


def vehicle_from(values: Mapping[str, Any], origin: str, folder: Path | None = None) -> Vehicle:
    """A vehicle from the values of a vehicle file; raises as `vehicle` does, with `origin` in the message.

    `folder` is that of the file; without one, the values cannot read a fleet's priors from another file.
    """
    if "schema" in values:  # of what oncenter writes, such as the truth of a simulated drive
        raise refusal(f"vehicle file {origin}: holds {values['schema']}, and no vehicle", _CODE)
    try:
        learned = _learned(values, origin, folder)
        given = values if learned is None else {**values, "params": _below(learned.params, values.get("params", {}))}
        truck = Vehicle.model_validate({"name": Path(origin).stem, **given})
    except ValidationError as error:
        raise refusal(f"vehicle file {origin}: {_first_error(error)}", _CODE) from None
    truck._origin, truck._learned = origin, learned
    return truck


def _learned(values: Mapping[str, Any], origin: str, folder: Path | None) -> LearnedPriors | None:
    """The priors of the file that `[priors]` names; None where this table is wrong, which its own check names."""
    table = values.get("priors")
    path = table.get("from") if isinstance(table, Mapping) else None
    if not isinstance(path, str) or not isinstance(values.get("params", {}), Mapping):
        return None
    if folder is None:
        raise refusal(
            f"vehicle file {origin}: 'priors' needs a vehicle file on the disk, beside which the path is", _CODE
        )
    return learned_priors(folder / path, Path(origin).stem, values)


def _below(learned: Mapping[str, float], own: Mapping[str, Any]) -> dict[str, Any]:
    """The params of a file over learned ones, in whichever unit the file gives an angle."""
    return {name: value for name, value in learned.items() if name.replace("_deg", "_rad", 1) not in own} | dict(own)


def _first_error(error: ValidationError) -> str:
    """The first error in one line, with the names that exist: a misspelt key comes before the key missing by it."""
    errors = error.errors()
    first = next((each for each in errors if each["type"] == "extra_forbidden"), errors[0])
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] == "missing":
        return f"'{key}' is missing{_where_to_find(key)}"
    if first["type"] == "extra_forbidden":
        table, _, unknown = key.rpartition(".")
        if not table and unknown in (*SIGNALS, "time"):
            return f"'{key}' belongs under [signals]: write it below a line [signals]"
        fields = _fields_of(table)
        near = [field for field in fields if field.startswith(unknown)] or nearest(unknown, fields)
        hint = "did you mean" if near else "the keys are"
        return f"'{key}' is not a key of a vehicle file; {hint} {', '.join(near or fields)}"
    if first["type"] == "value_error":
        message = str(first["msg"]).removeprefix("Value error, ")
        return message if key in ("", "signals", "params") else f"'{key}' {message}"  # those name their entry
    given = first["input"]
    shown = f"{given:g}" if isinstance(given, float) else repr(given)
    return f"'{key}' {_required(key, first)}, got {shown}{_question(key, given)}"


def _where_to_find(key: str) -> str:
    return f": {KEYS[key].where}" if key in KEYS else ""


def _question(key: str, value: object) -> str:
    """Whether the value is in another unit."""
    if key not in KEYS or not isinstance(value, int | float):
        return ""
    try:
        question = KEYS[key].other_unit(float(value))
    except OverflowError:  # an integer beyond all floats
        return ""
    return f": {question}" if question else ""


def _required(key: str, error: ErrorDetails) -> str:
    """The value that is accepted, in words of a TOML file."""
    if error["type"] in _OUT_OF_RANGE and key in KEYS:
        return f"must be {KEYS[key].range}"
    if error["type"] in ("model_type", "model_attributes_type", "mapping_type", "dict_type"):
        if key.startswith("signals."):
            return 'must be a table such as { name = "SteerAng", unit = "deg", sign = -1 }'
        return f"must be a table, [{key}]"
    if error["type"] in ("tuple_type", "too_short") and key.endswith(".true_when"):
        return "must be a list of values, such as [1, 2]"
    if error["type"] in ("bool_type", "bool_parsing"):
        return "must be true or false, without quotes"
    if error["type"] == "string_type":
        return "must be text in quotes"
    return error["msg"].replace("Input should be", "must be")


def _fields_of(table: str) -> Mapping[str, object]:
    """The keys of a table of a vehicle file; the file itself is ""."""
    if table == "sensors":
        return Sensors.model_fields
    if table == "priors":
        return {str(field.alias): field for field in _PriorsFrom.model_fields.values()}
    return _SignalEntry.model_fields if table.startswith("signals.") else Vehicle.model_fields
