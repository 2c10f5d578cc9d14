"""Axles behind that resist turning load the front tyres in bends, and so decide on which flank the play is."""

from pathlib import Path

import numpy as np
import pytest
from joint_drives import ANGLE, core_for, driven, ran
from layouts import scenario
from test_core_angle import K_US, RATIO, WHEELBASE, observe

import oncenter as oc
from oncenter._native import ffi, lib
from oncenter.signals import DEGREE
from oncenter.simulate.truck import steered_force_n
from oncenter.thesis.steady import LAYOUTS
from oncenter.vehicle import vehicle_from

LOADED_IN_BENDS = ("6x2", "6x4", "8x4")
SIDE_FORCE = "tandem_side_force_m2_s2"


def of_layout(layout: str | None, **more: object) -> oc.Vehicle:
    named = {"axle_layout": layout} if layout else {}
    return vehicle_from({"wheelbase_m": 5.16, "steering_ratio": 19.3, **named, **more}, "truck.toml")


def by_curvature(layout: str, *, laden: bool) -> float:
    """m^2/s^2: the front tyres' side force in a bend by itself over that of a lateral acceleration by itself."""
    settings = scenario({}, layout)
    truck = settings.truck if laden else settings.truck.model_copy(update={"payload": None})
    return steered_force_n(truck, settings.steering, 0.0, 1.0) / steered_force_n(truck, settings.steering, 1.0)


def test_in_a_bend_the_front_tyres_turn_the_tandem_against_its_own() -> None:
    """Moments about where the tandem's tyres act as one: its axles' forces by turning alone against the front's."""
    settings = scenario({"truck": {"payload": {"mass_kg": 0.001, "distance_m": 4.5, "length_m": 7.5}}}, "6x2")
    truck = settings.truck
    assert truck.rear_axle_spacing_m is not None
    first, last = ((1.0 - s) * truck.rear_cornering_stiffness_n_rad for s in (0.4, 0.6))
    spacing_m = truck.rear_axle_spacing_m
    resists_n_m2 = first * last / (first + last) * spacing_m**2
    lever_m = truck.wheelbase_m + spacing_m * last / (first + last)
    force_n = steered_force_n(truck, settings.steering, 0.0, 1e-3)
    assert force_n == pytest.approx(1e-3 * resists_n_m2 / lever_m, rel=1e-3)


@pytest.mark.parametrize("layout", LOADED_IN_BENDS)
def test_a_layout_stands_for_trucks_between_empty_and_laden(layout: str) -> None:
    assert by_curvature(layout, laden=False) < of_layout(layout).params[SIDE_FORCE] < by_curvature(layout, laden=True)


def test_two_axles_do_not_resist_and_a_param_says_more_than_a_layout() -> None:
    assert by_curvature("4x2", laden=True) == pytest.approx(0.0, abs=1e-9)
    assert SIDE_FORCE not in of_layout("4x2").params and SIDE_FORCE not in of_layout(None).params
    assert of_layout("6x4", params={SIDE_FORCE: 3}).params == {SIDE_FORCE: 3.0}
    assert of_layout("6x4", params={"pull_sd_m_s2": 0.1}).params == {SIDE_FORCE: 19.0, "pull_sd_m_s2": 0.1}


def test_a_tag_axle_that_steers_rolls_along_the_bend_and_resists_nothing() -> None:
    assert SIDE_FORCE not in of_layout("6x2", rear_axle_steers="tag").params


def test_an_axle_that_is_up_resists_no_more() -> None:
    """Its truck turns as if it were 15 % shorter; a file that is 5 % off lifts none, nor adds one."""
    joint, design = ffi.new("oc_joint *"), ffi.new("oc_joint_design *", {"tandem": 12.0})
    joint.best = 3
    for wheelbase, left in ((0.0, 1.0), (0.1, 1.0), (-0.05, 1.0), (-0.1, 0.5), (-0.15, 0.0), (-0.3, 0.0)):
        joint.hypotheses[3].wheelbase = wheelbase
        assert lib.oc_joint_tandem(joint, design) == pytest.approx(12.0 * left, abs=1e-5)


@pytest.mark.parametrize(("axle", "tandem"), [(1, 12.0), (-1, 0.0)])
def test_the_status_of_the_axle_says_more_than_a_wheelbase_that_fits(axle: int, tandem: float) -> None:
    joint, design = ffi.new("oc_joint *", {"axle": axle}), ffi.new("oc_joint_design *", {"tandem": 12.0})
    for wheelbase, doubt in ((0.0, 0.0), (-0.3, 0.0), (-0.3, 0.1)):
        joint.hypotheses[0].wheelbase = wheelbase
        design.hypothesis.known.product_doubt = doubt
        assert lib.oc_joint_tandem(joint, design) == tandem


@pytest.mark.parametrize("v", [8.0, -8.0])
@pytest.mark.parametrize(("tandem", "place"), [(0.0, 1.0), (40.0, -1.0)])
def test_without_its_sensor_the_wheel_is_on_the_flank_that_the_front_tyres_are_pushed_to(
    tandem: float, place: float, v: float
) -> None:
    """A slow turn to the right, banked so that it is no side force to the truck, but to its front axle, whether the
    truck drives forward or backs up."""
    n, r, play, a = 3000, -0.1, 6.0 * DEGREE, 0.25
    found = observe(
        np.full(n, r), np.full(n, v), np.full(n, a), np.full(n, np.nan), backlash=play, tandem=tandem, friction=0.1
    )
    steady = RATIO * (WHEELBASE * r / v + K_US * a)
    assert found["angle"][-1] == pytest.approx(steady + 0.5 * place * play, abs=0.1 * DEGREE)


def test_estimates_with_an_axle_layout_are_used_with_it() -> None:
    """Once the sensor is gone no hypothesis learns any more: what differs is where in its play the wheel is said to
    be."""
    columns, truth = driven("[steering]\nbacklash_deg = 8.0\n", duration_s=600.0)
    angles = []
    for tandem in (0.0, 60.0):
        core = core_for(truth, angle_method="observer")
        core.run({name: column[:40_000] for name, column in columns.items()})
        core._coefficients.joint.tandem = tandem
        core.run({name: column[40_000:40_500] for name, column in columns.items()})
        after = {name: column[40_500:] for name, column in columns.items()}
        angles.append(ran(after | {ANGLE: np.full(len(after[ANGLE]), np.nan)}, core)["angle"]["angle"])
    assert np.abs(angles[0] - angles[1]).max() > 1.0 * DEGREE


@pytest.mark.slow
def test_a_laden_three_axle_truck_is_measured_the_better_for_its_layout(tmp_path: Path) -> None:
    """On a crowned road bends to one side alone take the side force away, so that what they add goes one way."""
    truck = {key: value for key, value in LAYOUTS["6x4"].items() if key != "payload"}
    lines = [f"{key} = {value!r}".replace("'", '"') for key, value in truck.items()]
    file = tmp_path / "three.toml"
    file.write_text(
        'base = "country"\nabout = "A laden 6x4."\n[drive]\nduration_s = 1200.0\n[truck]\n'
        + "\n".join(lines)
        + "\npayload = {mass_kg = 14000.0, distance_m = 4.2, length_m = 5.5}\n[steering]\nbacklash_deg = 8.0\n",
        encoding="utf-8",
    )
    with_layout, without = [], []
    for seed in range(8):
        signals, truth = oc.simulate(file, seed)
        configured = of_layout("6x4", wheelbase_m=truth.equivalent_wheelbase_m, traffic_side="right")
        true = truth.offset_rad + truth.straight_ahead_rad
        for vehicle, errors in ((configured, with_layout), (configured.model_copy(update={"params": {}}), without)):
            offset = oc.offset(signals, vehicle).offset
            assert offset.value is not None
            errors.append((offset.value - true) / DEGREE)
    assert abs(np.median(without)) > 0.12 > abs(np.median(with_layout))
    assert abs(np.median(without) - np.median(with_layout)) > 0.04


def test_gradient_and_wheelbase_are_learned_anew_when_an_axle_is_lifted() -> None:
    columns, truth = driven()
    drive_s = truth.table["time_s"].to_numpy()
    sds = []
    for since_s in (np.inf, drive_s[-1] - 120.0):
        core = core_for(truth)
        core.run(columns | {"axle_lifted": (drive_s > since_s).astype(float)})
        answer = core.answer()
        sds.append([answer[name]["standard_deviation"] for name in ("understeer_gradient", "equivalent_wheelbase")])
    assert all(anew > 1.05 * before for before, anew in zip(*sds, strict=True))
