"""Rows of bench/effects.py: what real trucks do beside the usual model, one effect at three sizes, and several at once.

A size of 1 is what was measured or is feared (the sources are in docs/accuracy.md); half and double frame it. Trucks,
roads and sensors are the accuracy matrix's, the vehicle file names no side of traffic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

from accuracy_rows import FRONT_OF_LIFT_AXLE_KG, FRONT_OF_THESIS_KG, Row, Table, laid_over
from population import Distribution, Normal, Random

from oncenter.simulate.sensor_sections import (
    LateralAccelerometer,
    SpeedSensor,
    SteeringWheelAngleSensor,
    WheelSpeedSensors,
    YawRateSensor,
)
from oncenter.thesis.steady import LAYOUTS

SIZES = {"half": 0.5, "": 1.0, "double": 2.0}
SPELL_S, BETWEEN_S = (60.0, 300.0), (30.0, 240.0)  # the motor carries the steering; the driver does
STOP_S = (600.0, 640.0)
PER_WIND_SPEED = 120.0  # N of lateral force per m/s of crosswind at 20 m/s on 9 m^2

Extra = Callable[[Random], Table]


def _side(random: Random) -> float:
    return float(random.choice([-1.0, 1.0]))


def accelerometer_drifts(size: float) -> Extra:
    def extra(random: Random) -> Table:
        drift = 0.03 * size * _side(random)
        return {"sensors": {"lateral_acceleration": {"drift_m_s2_min": drift, "drift_ends_min": 15.0}}}

    return extra


def accelerometer_relearns(size: float) -> Extra:
    def extra(random: Random) -> Table:
        fading = {"warm_up_m_s2": 0.3 * size * _side(random), "warm_up_time_min": 15.0}  # three time constants
        return {"sensors": {"lateral_acceleration": fading}}

    return extra


def motor_carries(size: float) -> Extra:
    def extra(random: Random) -> Table:
        spells, now = [], float(random.uniform(*BETWEEN_S))
        while now < 1190.0:
            until = now + float(random.uniform(*SPELL_S))
            spells.append([round(now, 1), round(min(until, 1199.0), 1)])
            now = until + float(random.uniform(*BETWEEN_S))
        return {"steering": {"overlay_motor": {"lash_deg": 3.0 * size, "carries_s": spells}}}

    return extra


def unloads_on_crown(size: float) -> Extra:
    return lambda random: {"steering": {"unloads_on_crown_percent": 2.0 * size}}


def wind_turns(size: float) -> Extra:
    def extra(random: Random) -> Table:
        lateral_m_s2 = size * (0.03 + abs(float(random.normal(0.0, 0.08))))
        mean_m_s = lateral_m_s2 * 9000.0 / PER_WIND_SPEED
        blows = {"mean_m_s": mean_m_s, "from_deg": float(random.uniform(0.0, 360.0)), "gust_sd_m_s": 0.3 * mean_m_s}
        acts = {"gust_time_s": 3.0, "side_area_m2": 9.0, "side_force_coefficient": 1.1, "force_arm_m": 1.0}
        return {"wind": {**blows, **acts, "open_share": 0.5, "open_length_m": [200.0, 1500.0]}}

    return extra


def fifth_wheel_rubs(size: float) -> Extra:
    return lambda random: {"truck": {"trailer": {"fifth_wheel_friction_n_m": 3000.0 * size}}}


def sun_on_the_left(size: float) -> Extra:
    grown = {"front_left": 0.08 * size, "rear_left": 0.08 * size}
    wheels = {"radius_warm_up_percent": grown, "radius_warm_up_time_min": 10.0}
    return lambda random: {"sensors": {"wheel_speed": wheels}}


def load_leaves(size: float) -> Extra:
    def extra(random: Random) -> Table:
        load = {"load_percent": max(-35.0 * size, -60.0), "ride_height_steer_deg": size * _side(random)}
        truck = {"load_change": {"begin_s": 620.0, **load}, "stiffness_load_exponent": 0.85}
        return {"drive": {"standing_s": [list(STOP_S)]}, "truck": truck}

    return extra


def patches_of_snow(size: float) -> Extra:
    patches = {"front_stiffness_percent": -35.0 * size, "rear_stiffness_percent": -25.0 * size}
    where = {"spacing_m": [300.0, 2000.0], "length_m": [50.0, 400.0]}
    return lambda random: {"road": {"patches": {**where, **patches}}}


def minor_physics(size: float) -> Extra:
    """Effects that every truck has: torsion bar, ripple of a joint, asymmetric ratios, brake and roll steer."""

    def extra(random: Random) -> Table:
        steering = {
            "torsion_bar_twist_deg": 1.0 * size,
            "torsion_bar_half_moment_n_m": 300.0,
            "universal_joint_ripple_deg": 0.5 * size,
            "universal_joint_phase_deg": float(random.uniform(0.0, 180.0)),
            "ratio_right_error_percent": 2.0 * size * _side(random),
            "brake_steer_deg_m_s2": 0.02 * size * _side(random),
            "roll_steer_deg_deg": 0.02 * size,
            "bump_steer_sd_deg": 0.01 * size,
        }
        sensors = {
            "yaw_rate": {"scale_error_percent": 1.0 * size * _side(random), "latency_s": 0.02 * size},
            "lateral_acceleration": {
                "ahead_of_gravity_centre_m": 1.0 * size,
                "tilt_deg": 1.0 * size * _side(random),
                "roll_share": 0.5,
                "filter_time_s": 0.05 * size,
            },
            "steering_wheel_angle": {"latency_s": 0.02 * size},
        }
        return {"steering": steering, "sensors": sensors, "truck": {"roll_deg_m_s2": 1.5}}

    return extra


def _spells(
    random: Random, between_s: tuple[float, float], length_s: tuple[float, float], until_s: float = 1180.0
) -> Iterator[tuple[float, float]]:
    """Begin and end of spells one after the other, from the first pause on."""
    now = 60.0 + float(random.uniform(*between_s))
    while now < until_s:
        end = min(now + float(random.uniform(*length_s)), until_s + 15.0)
        yield round(now, 1), round(end, 1)
        now = end + float(random.uniform(*between_s))


def hand_rests(random: Random) -> Table:
    """A lane-keeping motor with a dead band steers for minutes; a hand keeps the wheel on one side but for seconds."""
    motor = {
        "lash_deg": 3.0,
        "carries_s": [list(spell) for spell in _spells(random, (20.0, 90.0), (120.0, 360.0))],
        "dead_band_deg": 0.5,
        "resting_torque_n_m": float(random.uniform(0.5, 2.0)) * _side(random),
        "hands_off_s": [list(spell) for spell in _spells(random, (40.0, 120.0), (3.0, 10.0))],
    }
    return {"steering": {"overlay_motor": motor}}


def stability_control_works(random: Random) -> Table:
    """Brakes on one side: one rear wheel's some 5 to 15 kN at a metre."""
    spells = _spells(random, (60.0, 240.0), (2.0, 5.0))
    return {"interventions": [_braked("stability_control", spell, random, 5e3, 15e3, 0.5, 1.5) for spell in spells]}


def anti_lock_works(random: Random) -> Table:
    """Hard braking on ground of unequal grip, with slipping wheels."""
    spells = _spells(random, (120.0, 300.0), (1.5, 3.0))
    slip = {"wheel_slip_percent": 15.0}
    return {"interventions": [_braked("anti_lock", spell, random, 0.0, 8e3, 2.0, 4.0) | slip for spell in spells]}


def _braked(
    kind: str, spell: tuple[float, float], random: Random, moment: float, moment_max: float, a: float, a_max: float
) -> Table:
    """N m and m/s^2, each from minimum to maximum."""
    return {
        "kind": kind,
        "begin_s": spell[0],
        "length_s": round(spell[1] - spell[0], 1),
        "yaw_moment_n_m": float(random.uniform(moment, moment_max)) * _side(random),
        "deceleration_m_s2": float(random.uniform(a, a_max)),
    }


def reverses(begins_s: tuple[float, ...], length_s: float) -> Extra:
    """Backwards fast enough for the comparison of signals at 2 m/s; each from within 350 s of a begin, 8 s standing."""

    def extra(random: Random) -> Table:
        drawn_s = [float(random.uniform(begin, begin + 350.0)) for begin in begins_s]
        spells = [[round(begin, 1), round(begin + length_s, 1)] for begin in drawn_s]
        speed_km_h, swing_m = float(random.uniform(7.5, 8.0)), float(random.uniform(0.5, 1.5))
        return {"drive": {"reverse_s": spells, "reverse_speed_km_h": speed_km_h, "reverse_swing_m": swing_m}}

    return extra


REVERSES = reverses((250.0, 700.0), 68.0)  # a tenth of the drive


def axle_lifts(random: Random) -> Table:
    up, down = float(random.uniform(200.0, 500.0)), float(random.uniform(600.0, 1000.0))
    return {"truck": {"lift_axle_up_s": [[round(up, 1), round(down, 1)]]}}


def tag_axle_steers(random: Random) -> Table:
    """A rigid 6x2 between empty and laden, whose tag axle steers below 40 km/h."""
    goods = LAYOUTS["6x2"]["payload"]
    laden = {"payload": {**goods, "mass_kg": float(random.uniform(0.0, goods["mass_kg"]))}}
    return {"truck": {**LAYOUTS["6x2"], **laden, "rear_steering": {"locks_above_km_h": 40.0}}}


def rear_axle_opposes(random: Random) -> Table:
    return {"truck": {"rear_steering": {"share": -0.25}}}


def rear_axle_locks(random: Random) -> Table:
    """On country roads locked for about a third of the drive."""
    return {"truck": {"rear_steering": {"share": -0.25, "locks_above_km_h": 60.0}}}


def _rear_sensor(offset_deg: float) -> Extra:
    return lambda random: {"sensors": {"rear_axle_angle": {"offset_deg": offset_deg * _side(random)}}}


def steady_wind(speed_m_s: float, area_m2: float) -> Extra:
    """From one side of the truck for the whole drive."""

    def extra(random: Random) -> Table:
        blows = {"mean_m_s": speed_m_s, "from_deg": 180.0 - 90.0 * _side(random), "from_side": True}
        acts = {"side_area_m2": area_m2, "side_force_coefficient": 1.1, "force_arm_m": 1.0}
        return {"wind": {**blows, **acts, "gust_sd_m_s": 0.2 * speed_m_s, "gust_time_s": 3.0}}

    return extra


def _all_of(*extras: Extra) -> Extra:
    def extra(random: Random) -> Table:
        values: Table = {}
        for one in extras:
            values = laid_over(values, one(random))
        return values

    return extra


def _real_sensors() -> Table:
    """Noise and steps of the sensors that a scenario has which names none."""
    sensors = {
        "steering_wheel_angle": SteeringWheelAngleSensor(),
        "yaw_rate": YawRateSensor(),
        "lateral_acceleration": LateralAccelerometer(),
        "speed": SpeedSensor(),
        "wheel_speed": WheelSpeedSensors(),
    }
    kinds = ("noise", "resolution", "range", "repeat")
    return {
        name: {key: value for key, value in sensor.model_dump().items() if key.startswith(kinds)}
        for name, sensor in sensors.items()
    }


def _row(name: str, about: str, *, extra: Extra = lambda random: {}, **keys: Any) -> Row:
    def with_sensors(random: Random) -> Table:
        return laid_over({"sensors": _real_sensors()}, extra(random))

    return Row(name, about, required="", given_side=None, extra=with_sensors, **keys)


def _at_sizes(name: str, about: str, made: Callable[[float], Extra], **keys: Any) -> list[Row]:
    return [_row(_named(name, word), about, extra=made(size), **keys) for word, size in SIZES.items()]


def _named(name: str, size: str) -> str:
    return f"{name}_{size}" if size else name


def _pulls(size: float) -> Mapping[str, Distribution]:
    return {"pull_m_s2": Normal(0.0, 0.1 * size)}


SEMITRAILER = {"base": "semitrailer_half", "front_axle_load_kg": FRONT_OF_THESIS_KG}

_ROWS = [
    _row("none", "no effect"),
    _row("play_12", "12 deg of play", fixed={"backlash_deg": 12.0}),
    _row("play_15", "15 deg of play", fixed={"backlash_deg": 15.0}),
    _row(
        "motorway", "no effect, motorway", base="motorway", extra=lambda random: {"drive": {"standing_at_start_s": 0.0}}
    ),
    _row("country", "no effect, country roads", base="country"),
    _row("trailer", "no effect, semitrailer, half laden", **SEMITRAILER),
    *_at_sizes("accelerometer_drift", "accelerometer drifts 0.03 m/s² a minute for 15 minutes", accelerometer_drifts),
    _row("accelerometer_drift_thesis", "the same, 0.3 m/s² a minute (thesis 2.5)", extra=accelerometer_drifts(10.0)),
    *_at_sizes("relearning", "its zero is 0.3 m/s² off, fading with 5 minutes", accelerometer_relearns),
    *_at_sizes("overlay_motor", "a motor carries the steering for minutes, column lash of 3 deg", motor_carries),
    *_at_sizes("axle_set_up", "axle set up to unload on 2 %", unloads_on_crown),
    *(
        _row(_named("pull", word), "alignment that pulls, sd 0.1 m/s²", pulls=True, fixed=_pulls(size))
        for word, size in SIZES.items()
    ),
    _row("pull_and_wind", "pull and wind by their priors", pulls=True, wind=True),
    *_at_sizes("wind_moment", "wind 1 m ahead of the centre of gravity, gusts, open stretches", wind_turns),
    *_at_sizes("fifth_wheel", "fifth wheel with 3 kNm of dry friction", fifth_wheel_rubs, **SEMITRAILER),
    *_at_sizes("tyres_in_the_sun", "both left tyres grow by 8e-4 within 10 minutes", sun_on_the_left),
    *_at_sizes("load_change", "35 % less on the rear axle at a stop, ride height steers by 1 deg", load_leaves),
    *_at_sizes("slippery_patches", "cornering stiffness 35 % less in front, 25 % behind, in patches", patches_of_snow),
    *_at_sizes(
        "minor_physics", "torsion bar, joint ripple, uneven ratio, roll and brake steer, latency", minor_physics
    ),
    _row("minor_physics_town", "the same in town", base="town", extra=minor_physics(1.0)),
    _row("minor_physics_yard", "the same at 3 to 8 m/s", base="yard", extra=minor_physics(1.0)),
    _row(
        "combined_sensors",
        "half of: drift, tyres in the sun, patches, pull, minor physics",
        extra=_all_of(*(m(0.5) for m in (accelerometer_drifts, sun_on_the_left, patches_of_snow, minor_physics))),
        pulls=True,
        fixed=_pulls(0.5),
    ),
    _row(
        "combined_steering",
        "half of: motor, relearning, wind with a moment, load change",
        extra=_all_of(*(m(0.5) for m in (motor_carries, accelerometer_relearns, wind_turns, load_leaves))),
    ),
    _row(
        "combined_trailer",
        "half of: fifth wheel, drift, wind with a moment, minor physics; 12 deg of play",
        extra=_all_of(*(m(0.5) for m in (fifth_wheel_rubs, accelerometer_drifts, wind_turns, minor_physics))),
        **{**SEMITRAILER, "fixed": {"backlash_deg": 12.0}},
    ),
]
EFFECTS = {row.name: row for row in _ROWS}


def _and_with_status(row: Row, *statuses: str, extra: Extra = lambda random: {}) -> list[Row]:
    """The row, and the same drives with these statuses, or with the signals that `extra` adds."""
    sent: Table = {"sensors": {"statuses": list(statuses)}}

    def with_statuses(random: Random) -> Table:
        return laid_over(laid_over(row.extra(random), sent), extra(random))

    about = f"the same, the bus sends {', '.join(statuses) or 'rear_axle_angle'}"
    return [row, replace(row, name=f"{row.name}_with_status", about=about, like=row.name, extra=with_statuses)]


_LIFT_AXLE = {"base": "lift_axle", "front_axle_load_kg": FRONT_OF_LIFT_AXLE_KG}
_TAG_AXLE = {"front_axle_load_kg": 6550.0, "extra": tag_axle_steers}  # as the accuracy matrix's rigid 6x2
_STATUS_ROWS = [
    *_and_with_status(
        _row(
            "resting_hand", "lane keeping for minutes behind 3 deg of lash, a hand rests on the rim", extra=hand_rests
        ),
        "steering_assist_active",
    ),
    *_and_with_status(
        _row("stability_control", "brakes of a stability control at work", extra=stability_control_works),
        "stability_control_active",
    ),
    *_and_with_status(_row("anti_lock", "hard braking, slipping wheels", extra=anti_lock_works), "anti_lock_active"),
    *_and_with_status(_row("reverse", "a tenth of the drive backwards, unsigned speed", extra=REVERSES), "reverse"),
    *_and_with_status(_row("reverse_town", "the same in town", base="town", extra=REVERSES), "reverse"),
    *_and_with_status(_row("reverse_yard", "the same in the yard", base="yard", extra=REVERSES), "reverse"),
    *_and_with_status(
        _row("reverse_long", "the same for 180 s at a time", base="yard", extra=reverses((250.0,), 188.0)), "reverse"
    ),
    *_and_with_status(
        _row("axle_lifted", "6x2, tag axle up for some minutes", extra=axle_lifts, **_LIFT_AXLE), "axle_lifted"
    ),
    *_and_with_status(
        _row("tag_axle_town", "6x2, tag axle steers below 40 km/h, town", base="town", **_TAG_AXLE),
        extra=_rear_sensor(0.5),
    ),
    *_and_with_status(_row("tag_axle_yard", "the same in the yard", base="yard", **_TAG_AXLE), extra=_rear_sensor(0.5)),
    *_and_with_status(
        _row(
            "counter_phase_country",
            "rear axle in counter phase, country roads",
            base="country",
            extra=rear_axle_opposes,
        ),
        extra=_rear_sensor(3.0),
    ),
    *_and_with_status(
        _row("counter_phase_town", "the same in town", base="town", extra=rear_axle_opposes), extra=_rear_sensor(3.0)
    ),
    *_and_with_status(
        _row("rear_locks_country", "the same, locked above 60 km/h, country", base="country", extra=rear_axle_locks),
        extra=_rear_sensor(3.0),
    ),
    _row("steady_wind_5_9", "wind from one side, 5 m/s on 9 m²", extra=steady_wind(5.0, 9.0)),
    _row("steady_wind_8_9", "the same, 8 m/s on 9 m²", extra=steady_wind(8.0, 9.0)),
    _row("steady_wind_6_25", "the same, 6 m/s on 25 m²", extra=steady_wind(6.0, 25.0)),
]
# Rows with what a bus may send, outside the section of docs/accuracy.md, each with and without the status.
STATUS_ROWS = {row.name: row for row in _STATUS_ROWS}
WINDS = {name for name in STATUS_ROWS if name.startswith("steady_wind")}
# Errors are judged less i K_us times the pull, and less the angle that a steady wind needs.
PULLS = {name for name in EFFECTS if name.startswith(("pull", "axle_set_up"))} | {"combined_sensors"} | WINDS
# At the sizes that were measured or are feared, one effect or several at a time.
AT_SIZE_1 = [name for name in EFFECTS if not name.endswith(("_half", "_double", "_thesis"))]
# Minimum share of drives whose offset is valid, of the rows that ask for one.
VALID_MIN = {
    "none": 0.8,
    "play_12": 18 / 24,
    "accelerometer_drift": 0.5,
    "relearning": 10 / 24,
    "overlay_motor": 8 / 24,
    "pull": 14 / 24,
    "pull_and_wind": 10 / 24,
    "wind_moment": 0.2,
    "fifth_wheel": 0.2,
    "fifth_wheel_half": 6 / 24,
    "tyres_in_the_sun": 14 / 24,
    "load_change": 13 / 24,
    "slippery_patches": 0.2,
    "combined_sensors": 0.2,
    "combined_steering": 0.2,
    "combined_trailer": 0.2,
}
