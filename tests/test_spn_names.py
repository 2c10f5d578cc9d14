"""Columns with names of J1939 parameters, and an angle of the road wheels."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io
from asammdf import MDF, Signal

from oncenter import OncenterError, read, vehicle
from oncenter.signals import DEGREE

TIME = np.arange(300) / 50
ANGLE, RATE, SPEED = 0.4 * np.sin(TIME), 0.1 * np.sin(TIME), 50.0 + TIME
TRUCK = "wheelbase_m = 3.7\nsteering_ratio = 20.0\ntrack_width_rear_m = 1.83\n"


def csv(folder: Path, angle: str, rate: str, speed: str, scale: float = 1.0, units: str = "") -> Path:
    rows = zip(TIME, ANGLE * scale, RATE * scale, SPEED, strict=True)
    lines = [f"time_s,{angle},{rate},{speed}", *filter(None, [units])]
    lines += [",".join(f"{cell:.9f}" for cell in row) for row in rows]
    (folder / "x.csv").write_text("\n".join(lines))
    return folder / "x.csv"


@pytest.mark.parametrize(
    ("angle", "rate", "speed", "scale"),
    [
        ("SPN 1807", "SPN 1808", "SPN 84", 1.0),
        ("spn1807", "SPN_1808", "SPN-84", 1.0),
        ("1807 - Steering Wheel Angle [rad]", "1808 - Yaw Rate [rad/s]", "84 - Wheel-Based Vehicle Speed [km/h]", 1.0),
        ("Steering Wheel Angle (SPN 1807)", "Yaw Rate (SPN 1808)", "Tachograph Vehicle Speed", 1.0),
        ("VDC2.SteeringWheelAngle", "VDC2_YawRate", "CCVS1.WheelBasedVehicleSpeed", 1.0),
        ("SteeringWheelAngle", "YawRate", "WheelBasedVehicleSpeed", 1.0),
        ("SteeringWheelAngle [deg]", "YawRate (deg/s)", "FrontAxleSpeed", 1 / DEGREE),
    ],
)
def test_columns_with_names_of_parameters_are_signals(
    angle: str, rate: str, speed: str, scale: float, tmp_path: Path
) -> None:
    log = csv(tmp_path, angle, rate, speed, scale)
    found, table = read(log), pd.read_csv(io.StringIO(log.read_text()))
    assert np.allclose(found.columns["steering_wheel_angle_rad"][:-1], table[angle][: found.ticks - 1] / scale)
    assert np.allclose(found.columns["yaw_rate_rad_s"][:-1], table[rate][: found.ticks - 1] / scale)
    assert np.allclose(found.columns["vehicle_speed_m_s"][:-1], table[speed][: found.ticks - 1] / 3.6)
    assert found.sources["steering_wheel_angle"].description == f"column {angle}"


def test_a_row_of_units_decides_and_a_name_of_any_network_needs_one(tmp_path: Path) -> None:
    units = "s,deg,deg/s,km/h"
    found = read(csv(tmp_path, "SPN 1807", "YawRate", "SPN 84", 1 / DEGREE, units)).columns
    assert np.allclose(found["yaw_rate_rad_s"][:-1], RATE[: len(found["yaw_rate_rad_s"]) - 1])
    assert set(read(csv(tmp_path, "angle", "YawRate", "SPN 84")).sources) == {"vehicle_speed"}
    with pytest.raises(OncenterError, match="beyond the range of SPN 1807 in rad"):
        read(csv(tmp_path, "SPN 1807", "SPN 1808", "SPN 84", 5 / DEGREE))


def test_codes_for_not_available_are_no_values(tmp_path: Path) -> None:
    log = csv(tmp_path, "SPN 1807", "SPN 1808", "SPN 84")
    log.write_text(log.read_text().replace(f",{ANGLE[7]:.9f},", f",{65535 / 1024 - 31.374:.9f},"))
    found = read(log)
    assert np.isnan(found.columns["steering_wheel_angle_rad"][7])
    assert found.account is not None
    assert found.account.signals["steering_wheel_angle"].left_out == {"error_code": 1}


def test_mat_and_mdf_have_these_names_as_well(tmp_path: Path) -> None:
    scipy.io.savemat(
        tmp_path / "x.mat", {"time_s": TIME, "SPN1807": ANGLE, "YawRate": RATE, "VDC2_LateralAcceleration": RATE}
    )
    with MDF() as mdf:
        mdf.append([Signal(ANGLE, TIME, name="SPN 1807"), Signal(RATE, TIME, name="1808 - Yaw Rate", unit="rad/s")])
        mdf.save(tmp_path / "x.mf4")
    for name in ("x.mat", "x.mf4"):
        found = read(tmp_path / name).columns
        assert np.allclose(found["steering_wheel_angle_rad"][:-1], ANGLE[: len(found["time_s"]) - 1])
        assert np.allclose(found["yaw_rate_rad_s"][:-1], RATE[: len(found["time_s"]) - 1])


def test_a_road_wheel_angle_times_the_ratio_is_the_steering_wheel_angle(tmp_path: Path) -> None:
    log = csv(tmp_path, "road_wheel_angle", "yaw_rate_rad_s", "vehicle_speed_km_h", 1 / 20)
    assert any("road_wheel = true" in note for note in read(log).notes)
    entry = (
        '[signals]\nsteering_wheel_angle = { name = "road_wheel_angle", unit = "rad", sign = -1, road_wheel = true }\n'
    )
    (tmp_path / "truck.toml").write_text(TRUCK + entry)
    found = read(log, vehicle=vehicle(tmp_path / "truck.toml")).columns
    assert np.allclose(found["steering_wheel_angle_rad"][:-1], -ANGLE[: len(found["time_s"]) - 1], atol=1e-6)
    (tmp_path / "truck.toml").write_text(TRUCK + '[signals]\nyaw_rate = { name = "r", road_wheel = true }\n')
    with pytest.raises(OncenterError, match="'yaw_rate' has no 'road_wheel'"):
        vehicle(tmp_path / "truck.toml")
