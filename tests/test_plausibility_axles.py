"""An axle that does not turn with the truck is named and teaches nothing; an axle that fits is never left out."""

from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from planted_faults import (
    EXAMPLES,
    WHEELS,
    Fault,
    axle_in_steps,
    axle_leads,
    axle_locked,
    axle_turns,
    both,
    changed,
    delayed,
    held,
    scaled,
    without,
)
from real_data import real_drive

import oncenter as oc
from oncenter.angle.run import findings_on
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.findings import Finding
from oncenter.plausibility import check
from oncenter.plausibility.axles import without_unfit_axles
from oncenter.signals import DEGREE, SIGNALS, Signals, Source

TRUCK = oc.vehicle("scania_r730_4x2")
REAR = ("wheel_speed_rear_left", "wheel_speed_rear_right")
FRONT = ("wheel_speed_front_left", "wheel_speed_front_right")
EBC2_STEP_M_S = 1.0 / 16.0 / 3.6


@cache
def simulated(name: str, seed: int) -> Signals:
    return oc.simulate(name, seed=seed)[0]


def of_axles(findings: tuple[Finding, ...]) -> list[Finding]:
    return [finding for finding in findings if finding.code == "wheel_speeds_of_axle"]


def left_out(signals: Signals) -> set[str]:
    kept = without_unfit_axles(signals, TRUCK)[0]
    assert {SIGNALS[name].column for name in kept.sources} | {"time_s"} == set(kept.table.columns)
    return set(signals.sources) - set(kept.sources)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["country", "town"])
def test_a_locked_axle_and_an_early_one_give_the_answer_without_wheel_speeds(name: str, seed: int) -> None:
    healthy = simulated(name, seed)
    answer = oc.offset(both(axle_locked("rear"), axle_leads("front", 0.3))(healthy), TRUCK)
    alone = oc.offset(without(healthy, *WHEELS), TRUCK)
    assert (answer.offset, answer.yaw_rate_bias, answer.used_s) == (alone.offset, alone.yaw_rate_bias, alone.used_s)
    front, rear = of_axles(answer.findings)
    assert front.severity == rear.severity == "warning"
    assert front.value == pytest.approx(-300.0, abs=15.0) and "ms before the yaw rate" in front.text
    assert "left and right rear wheel speeds are nearly the same in bends (0 % of the expected difference)" in rear.text


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("fault", "gone", "says"),
    [
        (axle_locked("rear"), REAR, "A locked differential"),
        (axle_locked("front"), FRONT, "one speed sent for both wheels"),
        (axle_turns("rear", -1.0), REAR, "left and right are exchanged"),
        (axle_turns("front", -1.0), FRONT, "left and right are exchanged"),
        (axle_turns("front", 4.0), FRONT, "4.0 times the expected one"),
        (both(*(scaled(name, 3.6) for name in REAR)), REAR, "too large by a factor of 3.6 (km/h read as m/s)"),
        (both(*(scaled(name, 19.1) for name in FRONT)), FRONT, "19.1 times the vehicle speed"),
        (
            both(*(scaled(name, 1 / 3.6) for name in WHEELS)),
            (*FRONT, *REAR),
            "front and rear wheel speeds are too small",
        ),
        (axle_leads("front", -0.4), FRONT, " ms after the yaw rate"),
        (delayed("yaw_rate", 0.3), (*FRONT, *REAR), "Check the time stamps and filters of both"),
    ],
    ids=["rear locked", "front locked", "rear swapped", "front swapped", "large", "km/h", "rpm", "m/s", "late", "gyro"],
)
def test_wheel_speeds_that_contradict_the_yaw_rate_are_named_and_not_used(
    fault: Fault, gone: tuple[str, ...], says: str, seed: int
) -> None:
    faulty = fault(simulated("country", seed))
    assert left_out(faulty) == set(gone)
    checked = check(faulty, TRUCK).findings
    for findings in (checked, oc.offset(faulty, TRUCK).findings):
        (named,) = of_axles(findings)
        assert says in named.text
    assert not [finding for finding in checked if finding.severity == "error"]


def test_a_locked_axle_on_a_motorway_costs_no_usable_time() -> None:
    answer = oc.offset(axle_locked("rear")(simulated("motorway", 1)), TRUCK)
    assert answer.offset.status == "valid" and answer.used_s > 3000.0


@pytest.mark.parametrize(
    "name",
    [
        *("country", "town", "lift_axle"),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("motorway", "straight_runs", "semitrailer_full")),
    ],
)
def test_an_axle_that_fits_is_never_left_out(name: str) -> None:
    """Nor under load transfer (test_simulate_multibody.py: 1.7), in EBC2's steps, with tyres worn unlike, or late."""
    healthy = simulated(name, 2)
    steps = both(*(axle_in_steps(axle, EBC2_STEP_M_S) for axle in ("front", "rear")))
    leaning = both(*(axle_turns(axle, 1.7) for axle in ("front", "rear")))
    worn = both(scaled("wheel_speed_rear_left", 1.01), scaled("wheel_speed_front_right", 1.006))
    for fault in (steps, leaning, worn, both(leaning, steps), axle_leads("front", -0.12)):
        assert left_out(fault(healthy)) == set()
    assert left_out(healthy) == set()


@pytest.mark.parametrize(
    "fault",
    [
        scaled("yaw_rate", -1.0),
        scaled("yaw_rate", 1.0 / DEGREE),
        scaled("vehicle_speed", 3.6),
        scaled("vehicle_speed", 0.0),
        scaled("vehicle_speed", 1 / 3.6),
        held("vehicle_speed", 1200.0),
        both(scaled("steering_wheel_angle", -1.0), scaled("lateral_acceleration", -1.0)),
    ],
    ids=["yaw rate reversed", "deg/s", "km/h", "no speed", "m/s", "stuck speed", "angle and acceleration reversed"],
)
def test_wheel_speeds_are_not_blamed_for_a_wrong_yaw_rate_or_speed(fault: Fault) -> None:
    for name in ("country", "motorway"):
        assert left_out(fault(simulated(name, 1))) == set()


def test_no_axle_is_blamed_for_noise_on_a_straight_road() -> None:
    straight = simulated("straight_runs", 1)
    assert left_out(changed(straight, "yaw_rate", lambda x, t: np.full_like(x, x.mean()))) == set()


def test_the_wheel_speed_method_uses_the_other_axle_or_names_the_reason() -> None:
    healthy = simulated("country", 1)
    one = oc.offset(axle_locked("rear")(healthy), TRUCK, method="wheel-speed")
    assert "wheel_speed_front_left" in one.sources and "wheel_speed_rear_left" not in one.sources
    neither = both(axle_locked("rear"), axle_locked("front"))(healthy)
    with pytest.raises(
        OncenterError, match=r"front and rear wheel speeds are nearly the same in bends \(0 %"
    ) as refused:
        oc.offset(neither, TRUCK, method="wheel-speed")
    assert refused.value.code == "missing_signal"
    with pytest.raises(
        OncenterError, match=r"front wheel speeds are nearly the same in bends \(0 % of the expected difference\)$"
    ):
        oc.angle(axle_locked("front")(healthy), TRUCK, method="wheel-speed")


def test_the_angle_without_such_an_axle_has_a_warning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    healthy = simulated("town", 1)
    faulty = axle_locked("rear")(healthy)
    assert oc.angle(faulty, TRUCK).equals(oc.angle(without(healthy, *REAR), TRUCK))
    (named,) = findings_on(faulty, TRUCK, ())
    assert "rear wheel speeds" in named.text
    faulty.table.drop("steering_wheel_angle_sensor_type", strict=False).write_csv(tmp_path / "drive.csv")
    assert run(["angle", str(tmp_path / "drive.csv"), "--vehicle", "scania_r730_4x2"]) == 0
    assert "warning: the left and right rear wheel speeds are nearly the same" in capsys.readouterr().out


def test_only_a_valid_gyro_bias_is_reported_as_corrected() -> None:
    from dataclasses import replace

    answer = oc.offset(simulated("country", 1), TRUCK)
    bias = replace(answer.yaw_rate_bias, value=0.68 * DEGREE)
    assert "corrected for a gyro bias" in replace(answer, yaw_rate_bias=bias).words()
    for status in ("invalid", "unobservable"):
        assert "corrected" not in replace(answer, yaw_rate_bias=replace(bias, status=status)).words()


def a_city_drive() -> Signals:
    """Topics of a real car, each on its own clock's stamps, brought to one tick."""
    topics = {
        "steering_wheel_angle": ("steering", "swa", DEGREE),
        "yaw_rate": ("vehicle_imu", "yaw_rate", DEGREE),
        "lateral_acceleration": ("vehicle_imu", "lat_accel", 1.0),
        "wheel_speed_front_left": ("wheel_speeds", "ws_fl", 1.0),
        "wheel_speed_front_right": ("wheel_speeds", "ws_fr", 1.0),
        "wheel_speed_rear_left": ("wheel_speeds", "ws_rl", 1.0),
        "wheel_speed_rear_right": ("wheel_speeds", "ws_rr", 1.0),
    }
    time = np.arange(0.0, 80.0, 0.02)
    columns = {"time_s": time}
    for name, (topic, column, factor) in topics.items():
        table = pl.read_csv(real_drive(f"genesis_raw_multirate/{topic}.csv.gz"))
        columns[SIGNALS[name].column] = factor * np.interp(time, table["t_s"], table[column])
    rear = [columns[SIGNALS[name].column] for name in REAR]
    columns[SIGNALS["vehicle_speed"].column] = np.mean(rear, axis=0)
    sources = {name: Source("topic", 50.0, len(time), 0) for name in (*topics, "vehicle_speed")}
    return Signals(pl.DataFrame(columns), sources, 50.0, "city")


@pytest.mark.parametrize("vehicle", [None, oc.vehicle(EXAMPLES / "genesis.toml")], ids=["no vehicle", "genesis"])
def test_a_real_cars_axles_agree_with_its_yaw_rate_until_one_is_locked(vehicle: oc.Vehicle | None) -> None:
    city = a_city_drive()
    assert without_unfit_axles(city, vehicle)[1] == ()
    (found,) = without_unfit_axles(axle_locked("rear")(city), vehicle)[1]
    assert found.axles == ("rear",)


def test_no_axle_is_blamed_in_a_nearly_straight_real_minute() -> None:
    import importlib.util

    file = EXAMPLES / "comma2k19_reader" / "comma2k19_reader.py"
    spec = importlib.util.spec_from_file_location("comma2k19_reader", file)
    assert spec is not None and spec.loader is not None
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    drive = oc.from_dataframe(example.read(real_drive("comma2k19_example/processed_log").parent))
    assert without_unfit_axles(drive, oc.vehicle(EXAMPLES / "rav4.toml"))[1] == ()
