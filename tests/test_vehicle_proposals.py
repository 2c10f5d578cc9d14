"""`oncenter vehicle new` proposes signals by names, units, ranges and messages, and by their motion in a log."""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from asammdf import MDF, Signal
from real_data import real_drive

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

from by_database import encoded, rows_of

import oncenter as oc
from oncenter.read.named import Named, signals_of
from oncenter.signals import Signals
from oncenter.vehicle_file.new import proposals_for
from oncenter.vehicle_file.proposals import Proposal, proposals


def proposed(folder: Path, text: str) -> dict[str, Proposal]:
    (folder / "net.dbc").write_text(text, encoding="utf-8")
    return {each.signal: each for each in proposals(list(signals_of(folder / "net.dbc")))}


def test_the_listed_signals_of_a_community_s_databases_are_proposed_first_and_never_a_flag() -> None:
    folder = real_drive("opendbc")
    right = set()
    for file, rows in rows_of(folder).items():
        found = {each.signal: each for each in proposals(list(signals_of(folder / file)))}
        assert all(each.named.bits >= 8 for each in found.values()), file
        for row in rows:
            best = found.get(row["quantity"])
            if best is not None and (best.named.name, last(best.sign_by), last(best.plus)) == (
                f"{row['message']}.{row['signal']}",
                row["sign_signal"],
                row["added_signal"],
            ):
                right.add((file, row["quantity"]))
    with (folder / "signals.csv").open(newline="") as file:
        assert len({(row["file"], row["quantity"]) for row in csv.DictReader(file)}) == 21
    assert len(right) >= 18, right


def last(name: str | None) -> str:
    return (name or "").rpartition(".")[2]


def test_a_magnitude_is_proposed_with_its_sign_and_a_coarse_angle_with_its_fraction(tmp_path: Path) -> None:
    found = proposed(
        tmp_path,
        'BO_ 1 ESP_1: 8 X\n SG_ Yaw_Rate : 0|14@1+ (0.01,0) [0|0] "deg/s" X\n'
        ' SG_ Yaw_Rate_Sign : 14|1@1+ (1,0) [0|0] "" X\n'
        'BO_ 2 STEER: 8 X\n SG_ STEER_ANGLE : 0|12@1- (1.5,0) [0|0] "deg" X\n'
        ' SG_ STEER_FRACTION : 12|4@1- (0.1,0) [0|0] "deg" X\n'
        ' SG_ STEER_RATE_FRACTION : 16|4@1- (0.1,0) [0|0] "deg" X\n',
    )
    assert found["yaw_rate"].entry() == {
        "name": "ESP_1.Yaw_Rate", "unit": "deg_s", "sign": 1, "sign_by": "ESP_1.Yaw_Rate_Sign",
    }  # fmt: skip
    assert found["steering_wheel_angle"].plus == "STEER.STEER_FRACTION"
    fine = proposed(
        tmp_path,
        'BO_ 2 STEERING: 8 X\n SG_ STEER_ANGLE : 0|12@1- (0.5,0) [0|0] "deg" X\n'
        ' SG_ STEERING_ANGLE_HP : 12|4@1+ (0.02,0) [0|0] "deg" X\n',
    )
    assert fine["steering_wheel_angle"].plus == "STEERING.STEERING_ANGLE_HP"
    assert found["steering_wheel_angle"].remark.startswith("1. by its name, unit deg, range -3072 to 3070, with its")


@pytest.mark.parametrize(
    ("message", "line", "signal"),
    [
        ("EPAS", 'StePinComp_An_Est : 22|15@0+ (0.1,-1600) [-1600|1676.6] "degrees"', "steering_wheel_angle"),
        ("STEERING_ALT", 'ANGLE : 7|16@0- (0.1,0) [0|0] "deg"', "steering_wheel_angle"),
        ("VOLANT", 'ANGLE_VOLANT : 7|16@0- (0.1,0) [0|0] "deg"', "steering_wheel_angle"),
        ("BrakeSysFeatures", 'Veh_V_ActlBrk : 7|16@0+ (0.01,0) [0|655] "kph"', "vehicle_speed"),
        ("Accel_Data", 'VehLatComp_A_Actl : 7|13@0+ (0.01,-40) [-40|40] "m/s^2"', "lateral_acceleration"),
    ],
)
def test_names_of_further_makers_are_recognised(tmp_path: Path, message: str, line: str, signal: str) -> None:
    assert set(proposed(tmp_path, f"BO_ 1 {message}: 8 X\n SG_ {line} X\n")) == {signal}


@pytest.mark.parametrize(
    "line",
    [
        ' SG_ SteeringAngleQF : 0|2@1+ (1,0) [0|3] "" X',
        ' SG_ Lenkwinkel : 0|1@1+ (1,0) [0|1] "" X',
        ' SG_ YawRateValid : 0|8@1+ (1,0) [0|1] "" X',
        ' SG_ TrlrYawRate : 0|16@1- (0.01,0) [0|0] "deg/s" X',
        ' SG_ SteeringAngleReq : 0|16@1- (0.1,0) [0|0] "deg" X',
        ' SG_ TargetSteeringAngle : 0|16@1- (0.1,0) [0|0] "deg" X',
        ' SG_ RoadWheelSteeringAngle : 0|16@1- (0.001,0) [0|0] "deg" X',
        ' SG_ YawRate : 0|16@1- (0.01,0) [0|0] "V" X',
        ' SG_ YawRate : 0|8@1- (0.01,0) [0|0] "deg/s" X',
    ],
)
def test_no_flag_request_target_trailer_or_short_range_is_proposed(tmp_path: Path, line: str) -> None:
    assert proposed(tmp_path, f"BO_ 1 ESP_1: 8 X\n{line}\n") == {}


@pytest.mark.parametrize(
    ("column", "signal", "unit"),
    [
        ("Speed (MPH)", "vehicle_speed", "mph"),
        ("Yaw Rate (rad/s)", "yaw_rate", "rad_s"),
        ("Steering Wheel Angle [deg]", "steering_wheel_angle", "deg"),
        ("Lateral Acceleration (g)", "lateral_acceleration", "g"),
    ],
)
def test_a_unit_in_brackets_in_a_name_is_its_unit(column: str, signal: str, unit: str) -> None:
    (found,) = proposals([Named(column, "")])
    assert (found.signal, found.unit) == (signal, unit)


@pytest.mark.parametrize(
    ("header", "expected"),
    [("t_ms,swa_deg", ("t_ms", "ms")), ("Time (s),swa_deg", ("Time (s)", "s")), ("time_s,swa_deg", None)],
)
def test_the_time_of_a_table_is_proposed_where_it_needs_an_entry(
    header: str, expected: tuple[str, str] | None, tmp_path: Path
) -> None:
    (tmp_path / "log.csv").write_text(header + "\n" + "".join(f"{k},{k % 7}\n" for k in range(50)))
    found = {each.signal: each.signal_name() for each in proposals_for([], tmp_path / "log.csv")[0]}
    assert expected == ((found["time"].name, found["time"].unit) if "time" in found else None)


def test_the_channels_of_a_measurement_file_are_proposed(tmp_path: Path) -> None:
    time = np.arange(0.0, 2.0, 0.01)
    with MDF() as mdf:
        mdf.append([Signal(np.sin(time), time, unit="deg/s", name="ESP_YawRate")])
        mdf.append([Signal(20.0 * np.sin(time), time, unit="deg", name="LWI_Lenkradwinkel")])
        mdf.save(tmp_path / "drive.mf4")
    found = {each.signal: each for each in proposals_for([], tmp_path / "drive.mf4")[0]}
    assert {signal: (each.named.name, each.unit) for signal, each in found.items()} == {
        "steering_wheel_angle": ("LWI_Lenkradwinkel", "deg"),
        "yaw_rate": ("ESP_YawRate", "deg_s"),
    }


def weave(turn: float = 1.0) -> Signals:
    """A minute of bends both ways; with turn = -1 the angle counts right turns as positive."""
    time = np.arange(0.0, 60.0, 0.01)
    yaw_rate, speed = 0.1 * np.sin(time / 2.0), 15.0 + 5.0 * np.sin(time / 9.0)
    columns = {
        "time_s": time,
        "steering_wheel_angle_rad": turn * 70.0 * yaw_rate / speed,
        "yaw_rate_rad_s": yaw_rate,
        "vehicle_speed_m_s": speed,
        "lateral_acceleration_m_s2": yaw_rate * speed,
    }
    return Signals(columns, {}, 100.0, "weave", ())


ROW = {"quantity": "steering_wheel_angle", "message": "EPS", "signal": "", "added_signal": "", "sign_signal": ""}
EPS = """BO_ 300 EPS: 8 X
 SG_ SteeringWheelAngle : 0|16@1- (0.1,0) [0|0] "deg" X
 SG_ SteerAngle : 16|16@1- (0.1,0) [0|0] "" X
 SG_ H3_BLW : 32|15@1+ (0.1,0) [0|0] "" X
 SG_ H3_BLW_Sign : 47|1@1+ (1,0) [0|0] "" X
"""


@pytest.fixture
def by_log(tmp_path: Path) -> Callable[..., dict[str, Proposal]]:
    def of(row: dict[str, str], turn: float = 1.0, text: str = EPS) -> dict[str, Proposal]:
        (tmp_path / "eps.dbc").write_text(text)
        log, databases = encoded(weave(turn), tmp_path / "eps.dbc", [ROW | row], tmp_path)
        return {each.signal: each for each in proposals_for(databases, log)[0]}

    return of


def test_of_two_names_that_fit_the_one_that_moves_like_yaw_rate_over_speed_is_proposed(by_log: Callable) -> None:
    found = by_log({"signal": "SteerAngle"})
    angle = found["steering_wheel_angle"]
    assert (angle.named.name, angle.sign, angle.signal_name().unit) == ("EPS.SteerAngle", 1, "deg")
    assert "moves like yaw rate over speed" in angle.remark


def test_an_angle_whose_name_says_nothing_is_found_by_its_motion_with_its_sign(by_log: Callable) -> None:
    text = "\n".join(line for line in EPS.splitlines() if "Steer" not in line) + "\n"
    angle = by_log({"signal": "H3_BLW", "sign_signal": "H3_BLW_Sign"}, text=text)["steering_wheel_angle"]
    assert (angle.named.name, angle.sign_by, angle.sign) == ("EPS.H3_BLW", "EPS.H3_BLW_Sign", 1)


def test_an_angle_that_is_positive_to_the_right_is_proposed_with_the_sign_of_its_motion(by_log: Callable) -> None:
    angle = by_log({"signal": "SteeringWheelAngle"}, turn=-1.0)["steering_wheel_angle"]
    assert (angle.named.name, angle.sign) == ("EPS.SteeringWheelAngle", -1)


def test_a_signal_that_never_moves_in_the_log_is_not_proposed(by_log: Callable) -> None:
    text = EPS + ' SG_ SteeringTorque : 48|12@1- (0.01,0) [0|0] "Nm" X\n'
    assert "steering_wheel_torque" not in by_log({"signal": "SteerAngle"}, text=text)


def test_a_clock_that_jumps_by_years_needs_no_more_memory(tmp_path: Path) -> None:
    drive = weave()
    time = drive.columns["time_s"] + np.where(drive.columns["time_s"] > 30.0, 1.7e9, 0.0)
    rows = np.stack([time, drive.columns["steering_wheel_angle_rad"], drive.columns["yaw_rate_rad_s"]], axis=1)
    np.savetxt(
        tmp_path / "log.csv", rows, fmt="%.6f", delimiter=",", header="time_s,SteerAngle_rad,YawRate_rad_s", comments=""
    )
    found = {each.signal: each.named.name for each in proposals_for([], tmp_path / "log.csv")[0]}
    assert found == {"steering_wheel_angle": "SteerAngle_rad", "yaw_rate": "YawRate_rad_s"}


def test_a_path_is_taken_in_place_of_a_vehicle(tmp_path: Path) -> None:
    (tmp_path / "truck.toml").write_text("wheelbase_m = 3.7\nsteering_ratio = 19.3\n")
    drive = weave()
    by_path = oc.offset(drive, tmp_path / "truck.toml")
    assert by_path.to_dict() == oc.offset(drive, oc.vehicle(tmp_path / "truck.toml")).to_dict()
