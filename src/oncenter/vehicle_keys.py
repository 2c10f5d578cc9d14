"""The keys of a vehicle file in one table: unit, range, usual values, meaning, and where to find the value.

`oncenter.vehicle` takes its ranges from here; `oncenter vehicle new`, `oncenter vehicle check` and
docs/reference/vehicle_file.md take their words from here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pydantic import Field

APPLIED_MAX_DEG = 720.0  # two turns of the steering wheel
OFFSET_LIMIT_DEG = 2.0  # thesis 5.6: the accuracy of its method on a well serviced truck
OFFSET_LIMIT_MIN_DEG, OFFSET_LIMIT_MAX_DEG = 0.1, 30.0  # offsets are printed to 0.1 deg


@dataclass(frozen=True)
class Key:
    """One key of a vehicle file.

    Attributes:
        name: as in the file; a key of a table as "sensors.yaw_rate_bias_deg_s".
        meaning: whole sentences.
        example: a value that is valid by itself, as TOML holds it.
        unit: of the value; empty where it has none.
        low, high: what is accepted, in `unit`; None where there is no limit.
        usual: what trucks have, in `unit`; a value outside is accepted and deserves a second look.
        where: where a person finds the value.
        without: what oncenter does where the file does not have the key; empty where the key is required, as `name` in
            `[signals]`.
        choices: the only values that are accepted.
    """

    name: str
    meaning: str
    example: Any
    unit: str = ""
    low: float | None = None
    high: float | None = None
    usual: tuple[float, float] | None = None
    where: str = ""
    without: str = ""
    choices: tuple[str, ...] = ()

    @property
    def range(self) -> str:
        """The range in words: "1 to 20 m", "at least 0 deg"; empty where everything is accepted."""
        if self.choices:
            return ", ".join(self.choices)
        unit = f" {self.unit}" if self.unit else ""
        if self.low is not None and self.high is not None:
            return f"{self.low:g} to {self.high:g}{unit}"
        return f"at least {self.low:g}{unit}" if self.low is not None else ""

    def is_unusual(self, value: float) -> bool:
        return self.usual is not None and not self.usual[0] <= value <= self.usual[1]

    def about_unusual(self, value: float) -> str:
        """An unusual value beside the usual ones: "5530 m; trucks have 2.5 to 8 m: in mm? 5530 mm are 5.53 m"."""
        low, high = self.usual or (math.nan, math.nan)
        unit = f" {self.unit}" if self.unit else ""
        other = self.other_unit(value)
        return f"{value:g}{unit}; trucks have {low:g} to {high:g}{unit}{f': {other}' if other else ''}"

    def other_unit(self, value: float) -> str:
        """A question about a value that would be usual in another unit: "in mm? 5530 mm are 5.53 m"; else empty."""
        low, high = self.usual or (self.low, self.high)
        if low is None or high is None:
            return ""
        for unit, factor in _OTHER_UNITS.get(self.unit, {}).items():
            if low <= value * factor <= high:
                return f"in {unit}? {value:g} {unit} are {value * factor:g} {self.unit}"
        return ""


_OTHER_UNITS = {"m": {"mm": 0.001, "cm": 0.01, "in": 0.0254}, "kg": {"t": 1000.0}}

_PRIOR = "A prior of the joint method; the key with `_sd_` is its standard deviation and must be given, too."
_SD = "Standard deviation of `{}`; only together with it."

KEYS: dict[str, Key] = {
    key.name: key
    for key in (
        Key(
            "name",
            "Name of the truck, for people. Memories of earlier drives are kept under it: two trucks need two names.",
            "truck 17",
            without="the name of the file",
        ),
        Key(
            "wheelbase_m",
            "Distance from the first axle to the rear axle. With several rear axles: the equivalent wheelbase, which "
            "is the distance to the middle of the rear axles plus 0.3 to 0.6 m.",
            3.7,
            unit="m",
            low=1.0,
            high=20.0,
            usual=(2.5, 8.0),
            where="Type plate, registration papers or the body builder's drawing; or measure between the wheel hubs. "
            "Usual: 3.6 to 3.9 m for a 4x2 tractor, 4 to 6.5 m for a rigid truck.",
            without="the joint method estimates steering ratio times wheelbase from the drive, with a prior of 5 m and "
            "a standard deviation of 15 %, of 30 % without steering_ratio as well; the other methods need the key",
        ),
        Key(
            "steering_ratio",
            "Steering wheel angle per front wheel angle near straight ahead. Or a polynomial from the steering wheel "
            "angle to the front wheel angle, both in rad: 2 to 8 coefficients, lowest power first, such as "
            "[0.0, 0.0518, 0.0, 0.0001].",
            19.3,
            low=1.0,
            high=60.0,
            usual=(13.0, 27.0),
            where="Data sheet of the steering gear times the ratio of the linkage; or turn the front wheels on turn "
            "plates and divide the steering wheel angle by the front wheels' angle. Usual: 16 to 24.",
            without="as without wheelbase_m, with a prior of 20; the answer then has the understeer at the steering "
            "wheel and steering ratio times wheelbase, no understeer gradient at the road wheel and no wheelbase",
        ),
        Key(
            "axle_layout",
            "Number of wheels x number of driven wheels. Rear axles that resist turning load the front axle in bends: "
            "for 6x2, 6x4 and 8x4 oncenter sets the parameter `tandem_side_force_m2_s2`, unless the tag axle steers or "
            "[params] gives it.",
            "4x2",
            choices=("4x2", "6x2", "6x4", "8x4"),
            where="Model name or type plate. 4x2: two axles; 6x2, 6x4: three; 8x4: four, two of them steered. "
            "Leave it out when all rear axles but one steer themselves.",
            without="one rear axle is assumed, as for 4x2; without wheelbase_m or steering_ratio a force between those "
            "of all layouts",
        ),
        Key(
            "rear_axle_steers",
            "Whether a rear axle is steered: `rear`, the only rear axle; `tag`, the last one of three. The truck then "
            "turns by the angles of both axles together: oncenter sets the parameter `rear_axle_weight_1` to 1 or 0.6, "
            "unless [params] gives it, and uses the signal `rear_axle_angle`. The offset is then the combined one of "
            "both sensors.",
            "rear",
            choices=("rear", "tag"),
            where="Model name, data sheet, or the steering linkage at that axle.",
            without="no rear axle is steered",
        ),
        Key(
            "track_width_front_m",
            "Distance between the middles of the left and the right front tyre. With it wheel speeds give the yaw "
            "rate, and its bias more accurately.",
            2.05,
            unit="m",
            low=1.0,
            high=3.0,
            usual=(1.7, 2.2),
            where="Data sheet of the axle, or measure from tyre middle to tyre middle. Usual: 2.0 to 2.1 m.",
            without="1.9 m with a standard deviation of 0.1 m, and front wheel speeds give the yaw rate's bias less "
            "accurately",
        ),
        Key(
            "track_width_rear_m",
            "Distance between the middles of the left and the right rear tyres; of dual tyres, between the middles of "
            "the two pairs. With it wheel speeds give the yaw rate, and its bias more accurately.",
            1.83,
            unit="m",
            low=1.0,
            high=3.0,
            usual=(1.6, 2.2),
            where="Data sheet of the axle, or measure from tyre middle to tyre middle. Usual: 1.8 to 1.9 m.",
            without="1.9 m with a standard deviation of 0.1 m, and rear wheel speeds give the yaw rate's bias less "
            "accurately",
        ),
        Key(
            "traffic_side",
            "Side of the road on which the truck is driven. Roads fall to that side, which shifts the offset and its "
            "interval.",
            "right",
            choices=("right", "left"),
            where="The country of the drives.",
            without="it is the side at the log's positions, else that of the truck's former drives; without both the "
            "road's crown may fall to either side, and the interval of the offset is wider",
        ),
        Key(
            "dbc",
            "CAN database of this truck's logs, for logs that are not J1939: .dbc .kcd .sym .arxml; a path or a list "
            "of paths, relative to the folder of the vehicle file.",
            ["truck.dbc"],
            where="The maker of the truck or of the logger.",
            without="J1939 frames are read without a database",
        ),
        Key(
            "offset_applied_deg",
            "Correction that the ECU already adds to the sensor's reading, positive to the left, so that the logs "
            "contain it. oncenter then also gives the total to set.",
            0.0,
            unit="deg",
            low=-APPLIED_MAX_DEG,
            high=APPLIED_MAX_DEG,
            usual=(-30.0, 30.0),
            where="Workshop tool or parameter set of the ECU.",
            without="0 deg",
        ),
        Key(
            "offset_limit_deg",
            "Straight-ahead offset, to either side, from which the verdict is to recalibrate.",
            OFFSET_LIMIT_DEG,
            unit="deg",
            low=OFFSET_LIMIT_MIN_DEG,
            high=OFFSET_LIMIT_MAX_DEG,
            usual=(0.5, 10.0),
            where="Service manual, or the requirement of the function that uses the angle.",
            without=f"{OFFSET_LIMIT_DEG:g} deg",
        ),
        Key(
            "mass_kg",
            "Mass of the loaded truck. It is kept for the record; no estimate uses it.",
            18000.0,
            unit="kg",
            low=1.0,
            high=1e6,
            usual=(3000.0, 60000.0),
            where="Weighbridge or registration papers.",
            without="nothing changes",
        ),
        Key(
            "understeer_gradient_deg_m_s2",
            "Understeer gradient at the front wheels, K_us/g: additional front wheel angle per lateral acceleration. "
            "`oncenter budget` uses it; with its standard deviation it is a prior of the joint method. It changes "
            "with load, and the standard deviation must allow for that.",
            0.3,
            unit="deg/(m/s^2)",
            low=-5.0,
            high=5.0,
            usual=(0.0, 1.0),
            where="Steady-state cornering test, or the answer of another drive (`understeer gradient`).",
            without="estimated from the drive alone",
        ),
        Key(
            "understeer_gradient_sd_deg_m_s2",
            _SD.format("understeer_gradient_deg_m_s2"),
            0.2,
            unit="deg/(m/s^2)",
            low=0.01,
            high=5.0,
            without="the gradient is used by `oncenter budget` only",
        ),
        Key(
            "play_deg",
            f"Free play of the steering at the steering wheel, full width, twist of the column included. {_PRIOR}",
            4.0,
            unit="deg",
            low=0.0,
            high=30.0,
            usual=(0.0, 15.0),
            where="Turn the steering wheel to and fro with the engine running until the front wheels just move; or "
            "the answer of another drive (`play`).",
            without="estimated from the drive alone",
        ),
        Key("play_sd_deg", _SD.format("play_deg"), 2.0, unit="deg", low=0.1, high=30.0, without="none"),
        Key(
            "pull_m_s2",
            "Lateral acceleration at which the steering is free of moment because of the wheel alignment (pull), "
            f"positive to the left. {_PRIOR}",
            0.0,
            unit="m/s^2",
            low=-0.9,
            high=0.9,
            usual=(-0.2, 0.2),
            where="A drive both ways over one straight (`oncenter reference`), or many drives of the same truck.",
            without="0 with the standard deviation of the parameter `pull_sd_m_s2`",
        ),
        Key("pull_sd_m_s2", _SD.format("pull_m_s2"), 0.03, unit="m/s^2", low=0.001, high=10.0, without="none"),
        Key(
            "set_up_for_crown",
            "Whether the front axle is set up so that the truck drives straight on a road crown of 2 %. It needs "
            "`traffic_side`.",
            False,
            where="The workshop that aligned the front axle.",
            without="one axle in twenty is",
        ),
        Key(
            "accelerometer_bias_m_s2",
            f"Reading of the lateral accelerometer on level ground, positive to the left. {_PRIOR}",
            0.0,
            unit="m/s^2",
            low=-0.9,
            high=0.9,
            usual=(-0.4, 0.4),
            where="Park on level ground, once in each direction, and take the mean of both readings.",
            without="estimated from the drive alone",
        ),
        Key(
            "accelerometer_bias_sd_m_s2",
            _SD.format("accelerometer_bias_m_s2"),
            0.05,
            unit="m/s^2",
            low=0.001,
            high=10.0,
            without="none",
        ),
        Key(
            "yaw_rate_bias_deg_s",
            f"Reading of the yaw rate sensor at standstill. {_PRIOR}",
            0.0,
            unit="deg/s",
            low=-10.0,
            high=10.0,
            usual=(-3.0, 3.0),
            where="The signal's mean while the truck stands (`oncenter signals LOG`).",
            without="estimated from the drive: at standstill and from wheel speeds",
        ),
        Key(
            "yaw_rate_bias_sd_deg_s",
            _SD.format("yaw_rate_bias_deg_s"),
            0.05,
            unit="deg/s",
            low=0.001,
            high=50.0,
            without="none",
        ),
        Key(
            "rear_axle_zero_deg",
            "Reading of the steered rear axle's angle sensor with that axle straight, road wheel angle, positive to "
            "the left. With it the offset is that of the steering wheel angle sensor alone.",
            0.0,
            unit="deg",
            low=-20.0,
            high=20.0,
            usual=(-5.0, 5.0),
            where="Lock or align the rear axle, and read the signal (`oncenter signals LOG`).",
            without="estimated where the axle is locked in bends for a minute or more and steers again later; else the "
            "offset is the combined one of both sensors",
        ),
        Key(
            "rear_axle_zero_sd_deg",
            _SD.format("rear_axle_zero_deg"),
            0.01,
            unit="deg",
            low=0.001,
            high=20.0,
            without="none",
        ),
        Key(
            "sensors.steering_wheel_angle_hysteresis_deg",
            "Hysteresis of the steering wheel angle sensor, for `oncenter budget`.",
            2.5,
            unit="deg",
            low=0.0,
            where="Data sheet of the sensor.",
            without="2.5 deg, the worst of Table 1",
        ),
        Key(
            "sensors.yaw_rate_bias_deg_s",
            "Largest bias of the yaw rate sensor, either sign, for `oncenter budget`.",
            3.0,
            unit="deg/s",
            low=0.0,
            where="Data sheet of the sensor.",
            without="3 deg/s, the worst of Table 1",
        ),
        Key(
            "sensors.lateral_acceleration_bias_m_s2",
            "Largest bias of the lateral accelerometer, either sign, for `oncenter budget`.",
            0.98,
            unit="m/s^2",
            low=0.0,
            where="Data sheet of the sensor.",
            without="0.1 g, the worst of Table 1",
        ),
        Key(
            "sensors.speed_scale_percent",
            "Share by which the vehicle speed reads too high, for `oncenter budget`.",
            5.0,
            unit="%",
            low=-20.0,
            high=20.0,
            where="Comparison with GNSS speed.",
            without="5 %",
        ),
    )
}

TABLES: dict[str, Key] = {
    key.name: key
    for key in (
        Key(
            "sensors",
            "Errors of this truck's sensors, for `oncenter budget`.",
            {},
            without="the worst values of Table 1 of the thesis",
        ),
        Key(
            "signals",
            "Names by which this truck's logs call a signal, for logs that are not J1939 and whose columns do not end "
            "in a unit. By signal: `name` (column, channel, or Message.Signal of a database), `unit` (left out: the "
            "unit in the log or database), `sign` (-1 where right is positive), `sign_by` (the signal that has the "
            "sign of a magnitude), `plus` (the second part of a signal in two parts), `time` (its time column or "
            "group, where a log has several), `time_unit`, `road_wheel` (true for the angle of the road wheels) and "
            "`true_when` (the values of a true status).",
            {"yaw_rate": {"name": "ESP.YawRate", "unit": "deg_s", "sign": 1}},
            where="`oncenter signals LOG` shows the signals that a log has; `oncenter vehicle new --log LOG --dbc "
            "FILE` proposes names.",
            without="J1939 signals, and columns such as yaw_rate_deg_s",
        ),
        Key(
            "params",
            "Parameters of the estimator that differ from their defaults; docs/params.md lists all of them. An angle "
            "may be given in degrees: `_deg` in place of `_rad`.",
            {"bank_max_m_s2": 0.3},
            without="the defaults",
        ),
        Key(
            "priors",
            "`from`: the file that `oncenter fleet priors` has written, relative to the folder of the vehicle file. "
            "Its values for the type of this name, else for all trucks, replace the defaults of pull, axle set-up, "
            "play and understeer gradient; values of this file replace them.",
            {"from": "fleet_priors.toml"},
            without="the defaults",
        ),
        Key(
            "source",
            "By key, where its value comes from. For people; nothing is computed from it.",
            {"wheelbase_m": "data sheet of the maker"},
            without="nothing changes",
        ),
    )
}

SIGNAL_ENTRY: dict[str, Key] = {
    key.name: key
    for key in (
        Key("name", "Name in the log: column, channel, or Message.Signal of a database.", "ESP.YawRate"),
        Key(
            "unit",
            "Unit of the values in the log: rad or deg, rad_s or deg_s, m_s, km_h or mph, m_s2 or g, nm; of `time`: s, "
            "ms, us, ns, min, h or d.",
            "deg_s",
            without="the unit in the log or database, or the ending of the name",
        ),
        Key("sign", "-1 where the log counts right turns as positive.", 1, choices=("1", "-1"), without="1"),
        Key(
            "sign_by",
            "Where `name` is a magnitude: the signal of the same message that is not zero to the right.",
            "LWI_01.LWI_VZ_Lenkradwinkel",
            without="`name` has its sign",
        ),
        Key(
            "plus",
            "Where the signal comes in two parts: the other one, of the same message. It is added in its own unit.",
            "STEER_ANGLE_SENSOR.STEER_FRACTION",
            without="`name` is the whole signal",
        ),
        Key(
            "time",
            "Where a log has several times: the column or variable with the times of this signal, or the group or "
            "struct that it is in.",
            "time_2",
            without="the time of its group, by names and lengths",
        ),
        Key(
            "time_unit",
            "Unit of that time: s, ms, us, ns, min, h or d.",
            "ms",
            choices=("s", "ms", "us", "ns", "min", "h", "d"),
            without="the unit in its name, or that of `time`",
        ),
        Key(
            "road_wheel",
            "true where the log has the angle of the road wheels in place of the steering wheel angle: it is "
            "multiplied by `steering_ratio`, near the centre of one that is not constant.",
            True,
            choices=("true", "false"),
            without="false",
        ),
        Key(
            "true_when",
            "Of a status (`reverse`, `axle_lifted`, ..._active): the values at which it is true, numbers as the log or "
            "database has them, or their names in the database. All others are false.",
            ["R"],
            without="1 is true, 0 is false, and other values are not available",
        ),
    )
}


def bounds(name: str) -> Any:
    """The limits of a key as pydantic takes them in an annotation, with its meaning."""
    key = KEYS[name]
    return Field(ge=key.low, le=key.high, description=key.meaning)
