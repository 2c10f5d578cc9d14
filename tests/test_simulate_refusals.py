"""Impossible and contradictory scenarios: each is refused in one line that names the error, exit code 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.simulate import simulate
from oncenter.simulate.scenario import read_scenario

BASE = 'base = "thesis_drive"\nabout = "cannot be"\n'
TRAILER = """[truck.trailer]
hitch_m = 3.15
mass_kg = 7000.0
yaw_inertia_kg_m2 = 108000.0
cornering_stiffness_n_rad = 540000.0
axle_count = 3
"""
SECTIONS = '[road]\nkind = "sections"\ncrown_percent = 2.0\nclothoid_length_m = 10.0\n'
TAG_AXLE = '[truck]\naxle_layout = "6x2"\nrear_axle_spacing_m = 1.35\n'
RAMP = '[manoeuvre]\nkind = "ramp"\nbegin_s = 60.0\nfrom_deg = 1000.0\nhold_s = 1.0\nto_deg = 0.0\nrate_deg_s = 500.0'
OPEN = '[road]\nkind = "open"\ncrown_percent = 0.0\n[drive]\nduration_s = 120.0\n'
RELATIVE = "[sensors.steering_wheel_angle]\nrange_deg = 1500.0\n[sensors.steering_wheel_angle.relative]\n"

IMPOSSIBLE = [
    # numbers that are none
    ('[truck]\nmass_kg = "8100"', "truck.mass_kg"),
    ("[truck]\nmass_kg = true", "truck.mass_kg"),
    ("[truck]\nwheelbase_m = nan", "truck.wheelbase_m"),
    ('[drive]\nduration_s = "1800"', "drive.duration_s"),
    (SECTIONS + 'repeat = "yes"\nsections = [{ length_m = 300.0 }]', "road.repeat"),
    # no truck is like that
    ("[truck]\nmass_kg = -8100.0", "truck.mass_kg"),
    ("[truck]\nmass_kg = 1.0", "truck.mass_kg"),
    ("[truck]\nmass_kg = 1e9", "truck.mass_kg"),
    ("[truck]\nyaw_inertia_kg_m2 = 1.0", "yaw_inertia_kg_m2"),
    ("[truck]\nyaw_inertia_kg_m2 = 1e12", "yaw_inertia_kg_m2"),
    ("[truck]\nfront_cornering_stiffness_n_rad = 1e10", "truck.front_cornering_stiffness_n_rad"),
    ("[truck]\nrelaxation_length_m = 1e-6", "relaxation_length_m"),
    ("[truck]\ntrack_width_front_m = 30.0", "truck.track_width_front_m"),
    ("[truck.payload]\nmass_kg = 20000.0\ndistance_m = 8.0\nlength_m = 2.0", "has an axle without load"),
    (TRAILER + "gravity_centre_m = 9.0\naxles_m = 7.7", "so the hitch load is negative"),
    (TRAILER + "gravity_centre_m = 0.8\naxles_m = 1.2", "axles_m"),
    (TRAILER.replace("108000.0", "1.0") + "gravity_centre_m = 5.6\naxles_m = 7.7", "yaw_inertia_kg_m2"),
    (TAG_AXLE + "lift_axle_up_s = [[2000.0, 2500.0]]", "truck.lift_axle_up_s"),
    (TAG_AXLE + "lift_axle_up_s = [[10.0, 11.0]]", "lift_axle_up_s"),
    ('[truck]\naxle_layout = "6x4"\nrear_axle_spacing_m = 1.35\nrear_steering = {}', "rear_steering"),
    ("[truck]\nrear_steering = {}", "rear_steering.share"),
    ("[truck]\nrear_steering = { share = 0.2 }", "truck.rear_steering.share"),
    ("[sensors.rear_axle_angle]", "sensors.rear_axle_angle"),
    # no steering
    ("[steering.overlay_motor]\nlash_deg = 3.0\nhands_off_s = [[9.0, 8.0]]", "hands_off_s"),
    ("[steering]\nbacklash_deg = 18.0\nsteering_ratio = 6.0", "backlash_deg"),
    ("[steering]\nsteering_ratio = [0.5, 0.05]", "steering_ratio"),
    ("[steering]\nsteering_ratio = [true, 0.05]", "steering_ratio"),
    ("[steering]\ntrail_m = 100.0", "steering.trail_m"),
    ("[steering]\ncompliance_deg_kn_m = 1e6", "steering.compliance_deg_kn_m"),
    ("[steering]\npull_n_m = 1e6", "steering.pull_n_m"),
    ("[steering]\npull_n = -1e6", "steering.pull_n"),
    ("[steering]\nbrake_pull_n_m_per_m_s2 = 1e6", "steering.brake_pull_n_m_per_m_s2"),
    # no road, no driver
    ("[drive]\nreverse_s = [[100.0, 110.0]]", "reverse_s"),
    ("[drive]\nreverse_s = [[100.0, 160.0]]\nstanding_s = [[50.0, 120.0]]", "standing_s"),
    ("[drive]\nreverse_s = [[100.0, 160.0]]\n" + TRAILER + "gravity_centre_m = 5.6\naxles_m = 7.7", "drive.reverse_s"),
    ('interventions = [{ kind = "brake", begin_s = 9.0, length_s = 1.0 }]', "interventions.0.kind"),
    ("[road]\nstraight_length_m = [1e-9, 1e-9]", "road.straight_length_m"),
    ("[road]\nsuperelevation_max_percent = 9.0", "road.superelevation_max_percent"),
    (SECTIONS + "repeat = true\nsections = [{ length_m = 1e-6 }]", "road.sections.0.length_m"),
    (SECTIONS + "repeat = false\nsections = [{ length_m = 300.0 }]", "'road' is shorter than the drive"),
    ('[road]\nkind = "csv"\nfile = "."', "cannot be read: is a directory, not a file"),
    ('[road]\nkind = "csv"\nfile = "/dev/zero"', "cannot be read: is a device or a pipe, not a file"),
    ("[stops]\nspacing_m = [1e-9, 1e-9]\nduration_s = [5.0, 10.0]", "stops.spacing_m"),
    ("[driver]\nspeed_section_length_m = [1e-9, 1e-9]", "driver.speed_section_length_m"),
    ("[driver]\nspeed_km_h = [0.0, 50.0]", "driver.speed_km_h"),
    ("[driver]\nacceleration_max_m_s2 = 1e-9", "driver.acceleration_max_m_s2"),
    ("[driver]\nlane_wander_sd_m = 50.0", "driver.lane_wander_sd_m"),
    (
        OPEN + RAMP,
        "the truck tips over after 6",
    ),
    # no sensor
    ("[sensors.yaw_rate]\nbias_deg_s = 60.0", "range_deg_s"),
    ("[sensors.yaw_rate]\nremounts = [{ begin_s = 9.0, step_deg_s = -60.0 }]", "range_deg_s"),
    ("[sensors.yaw_rate]\nresolution_deg_s = 200.0", "resolution_deg_s"),
    ("[sensors.lateral_acceleration]\nwarm_up_m_s2 = 20.0", "range_m_s2"),
    ("[sensors.longitudinal_acceleration]\nresolution_m_s2 = 20.0", "resolution_m_s2"),
    ("[sensors.steering_wheel_angle]\nresolution_deg = 800.0", "resolution_deg"),
    ("[sensors.speed]\nresolution_m_s = 100.0", "sensors.speed.resolution_m_s"),
    (
        RELATIVE + "ignitions = [{ begin_s = 20, off_s = 50, turns = 1 }, { begin_s = 30, off_s = 5, turns = 0 }]",
        "ignitions",
    ),
    (RELATIVE + "turns = 1.0", "sensors.steering_wheel_angle.relative.turns"),
]


@pytest.mark.parametrize(("says", "names"), IMPOSSIBLE)
def test_impossible_values_are_refused_by_name_in_one_line(tmp_path: Path, says: str, names: str) -> None:
    file = tmp_path / "impossible.toml"
    file.write_text(BASE + says + "\n", encoding="utf-8")
    with pytest.raises(OncenterError) as refusal:
        simulate(file)
    message = str(refusal.value)
    assert names in message
    assert "\n" not in message
    assert (refusal.value.code, refusal.value.exit_code) == ("scenario_file", 2)


def test_the_command_line_prints_one_line_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, log = tmp_path / "impossible.toml", tmp_path / "drive.log"
    file.write_text(BASE + "[truck]\nmass_kg = -8100.0\n", encoding="utf-8")
    assert run(["simulate", str(file), "--output", str(log)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.splitlines() == [
        f"oncenter: scenario {file}: 'truck.mass_kg': Input should be greater than or equal to 500, got -8100.0"
    ]
    assert list(tmp_path.iterdir()) == [file]


def test_a_road_file_that_makes_the_truck_tip_over_is_refused(tmp_path: Path) -> None:
    (tmp_path / "road.csv").write_text(
        "station_m,curvature_1_m,cross_slope_1,speed_m_s\n0,0,0,20\n1000,0.05,0,20\n90000,0.05,0,20\n", encoding="utf-8"
    )
    file = tmp_path / "sharp.toml"
    file.write_text(BASE + '[road]\nkind = "csv"\nfile = "road.csv"\n', encoding="utf-8")
    with pytest.raises(OncenterError, match="tips over after"):
        simulate(file)


def test_a_long_chain_of_bases_is_refused(tmp_path: Path) -> None:
    for place in range(1500):
        base = f"{place + 1}.toml" if place < 1499 else "thesis_drive"
        (tmp_path / f"{place}.toml").write_text(f'base = "{base}"\n')
    with pytest.raises(OncenterError, match="more than 16 files") as refusal:
        read_scenario(tmp_path / "0.toml")
    assert refusal.value.exit_code == 2
    assert read_scenario(tmp_path / "1490.toml").name == "1490"
