"""An unknown network: its DBC is read with any spelling of units, or the error lists its content."""

import struct
from pathlib import Path

import numpy as np
import pytest

import oncenter as oc
from oncenter.cli import run
from oncenter.nearest_name import did_you_mean
from oncenter.read.units import factors, unit_key
from oncenter.signals import DEGREE

NAMES = ("SteerAng", "YawRt", "VehSpd", "LatAccel")
TRUCK = "wheelbase_m = 3.7\nsteering_ratio = 19.3\n"
SIGNALS = """[signals]
steering_wheel_angle = { name = "SteerAng" }
yaw_rate = { name = "YawRt" }
vehicle_speed = { name = "VehSpd" }
lateral_acceleration = { name = "LatAccel" }
"""


def dbc(*units: str) -> str:
    return f"""VERSION ""

BU_: EPS ESP

BO_ 256 STEERING: 8 EPS
 SG_ SteerAng : 0|16@1- (0.1,0) [-800|800] "{units[0]}" ESP
 SG_ SteerTorque : 16|16@1- (0.01,0) [-100|100] "Nm" ESP

BO_ 257 DYNAMICS: 8 ESP
 SG_ YawRt : 0|16@1- (0.01,0) [-200|200] "{units[1]}" EPS
 SG_ VehSpd : 16|16@1+ (0.01,0) [0|300] "{units[2]}" EPS
 SG_ LatAccel : 32|16@1- (0.001,0) [-20|20] "{units[3]}" EPS
"""


def log() -> str:
    lines = []
    for t in np.arange(300) * 0.01:
        turn = np.sin(t)
        angle = struct.pack("<hhhh", int(200 * turn), 0, 0, 0)
        motion = struct.pack("<hHhh", int(300 * turn), 6000, int(800 * turn), 0)
        lines += [f"({t:.6f}) can0 100#{angle.hex()}", f"({t + 0.001:.6f}) can0 101#{motion.hex()}"]
    return "\n".join(lines) + "\n"


def network(folder: Path, database: bytes, signals: str = SIGNALS) -> list[str]:
    """Its files, as arguments of a verb."""
    (folder / "drive.log").write_text(log())
    (folder / "net.dbc").write_bytes(database)
    (folder / "truck.toml").write_text(TRUCK + signals)
    return [str(folder / "drive.log"), "--vehicle", str(folder / "truck.toml"), "--dbc", str(folder / "net.dbc")]


def refusal(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert run(arguments) in (1, 2)
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "Entry" not in said and "Input should" not in said
    return said


@pytest.mark.parametrize("written", ["utf-8", "utf-8-sig", "latin-1", "cp1252"])
def test_degree_signs_and_squares_of_any_encoding_are_units(written: str, tmp_path: Path) -> None:
    read_back(tmp_path, dbc("°", "°/s", "km/h", "m/s²").encode(written))


def test_units_in_text_that_was_encoded_twice_are_recognised(tmp_path: Path) -> None:
    read_back(tmp_path, dbc("°", "°/s", "km/h", "m/s²").encode().decode("latin-1").encode())
    thrice = dbc("°", "°/s", "km/h", "m/s²").encode().decode("latin-1").encode().decode("cp1252", "replace").encode()
    read_back(tmp_path, thrice)


def read_back(folder: Path, database: bytes) -> None:
    arguments = network(folder, database)
    signals = oc.read(arguments[0], names=oc.vehicle(arguments[2]).signal_names, dbc=[arguments[4]])
    table = signals.table
    assert table["steering_wheel_angle_rad"].max() == pytest.approx(20.0 * DEGREE, rel=0.02)
    assert table["yaw_rate_rad_s"].max() == pytest.approx(3.0 * DEGREE, rel=0.02)
    assert table["vehicle_speed_m_s"].max() == pytest.approx(60.0 / 3.6)
    assert table["lateral_acceleration_m_s2"].max() == pytest.approx(0.8, rel=0.02)


@pytest.mark.parametrize(
    ("signal", "key", "ways"),
    [
        ("steering_wheel_angle", "deg", "° º Â° Ã\x82Â° \ufffd deg Deg [deg] degree Degrees grad"),
        ("steering_wheel_angle", "rad", "rad RAD radian radians"),
        ("yaw_rate", "deg_s", "°/s Â°/s \ufffd/s º/sec deg/s Deg/Sec deg/second degree/s degrees/s grad/s dps deg_s"),
        ("yaw_rate", "rad_s", "rad/s rad/sec radian/s 1/s rad*s^-1 rad_s"),
        ("vehicle_speed", "km_h", "km/h Km/h KPH kph kmh km/hr kmph [km/h] km_h"),
        ("vehicle_speed", "m_s", "m/s M/S mps m/sec m*s^-1"),
        ("lateral_acceleration", "m_s2", "m/s2 m/s^2 m/s² m/sÂ² m/s\ufffd m/s**2 m/s/s m/sec^2 mps2 m*s^-2"),
        ("lateral_acceleration", "g", "g G [g]"),
        ("steering_wheel_torque", "nm", "Nm N*m N·m N.m NM"),
    ],
)
def test_every_spelling_of_a_unit_is_recognised(signal: str, key: str, ways: str) -> None:
    for written in ways.split():
        assert unit_key(written, factors(signal)) == key, written
    assert unit_key("furlong", factors(signal)) is None


def test_a_database_without_a_recognised_signal_lists_its_signals_best_match_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refusal(["signals", *network(tmp_path, dbc("°", "°/s", "km/h", "m/s²").encode(), "")], capsys)
    assert "no signal recognised in the database net.dbc: it has STEERING.SteerAng [°], " in said
    assert all(f"{name} [" in said for name in NAMES)


@pytest.mark.parametrize("written", ["YawRate", "yawrt", "DYNAMIC.YawRt", "Yaw_Rt"])
def test_a_name_missing_in_the_database_gives_the_most_similar_names(
    written: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = network(tmp_path, dbc("deg", "deg/s", "km/h", "g").encode(), SIGNALS.replace("YawRt", written))
    said = refusal(["offset", *arguments], capsys)
    assert f"[signals] names '{written}', which net.dbc does not have; did you mean " in said
    assert "YawRt" in said.split("did you mean ")[1].split("?")[0]


def test_a_name_missing_in_a_table_gives_the_most_similar_column(tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text("time_s,SteerAng,yaw_rate_deg_s\n0,1,1\n0.01,1,1\n")
    names = {"steering_wheel_angle": oc.signals.SignalName("SteerAngle", "deg")}
    notes = oc.read(tmp_path / "d.csv", names=names).notes
    assert notes == (
        "steering_wheel_angle: [signals] names column 'SteerAngle', which does not exist; did you mean SteerAng?",
    )


@pytest.mark.parametrize(
    ("signals", "says"),
    [
        (
            SIGNALS.replace('"YawRt"', '"VehSpd"'),
            "'VehSpd' has unit 'km/h', which does not fit: check the name, or give unit = ",
        ),
        (SIGNALS.replace('"YawRt"', '"YawRt", unit = "degs"'), 'unknown unit \'degs\', expected "rad_s" or "deg_s"'),
        ('[signals]\nyaw_rate = "YawRt"\n', "'signals.yaw_rate' must be a table such as { name = \"SteerAng\""),
        ('[signals]\nyaw_rate = ["YawRt"]\n', "'signals.yaw_rate' must be a table such as "),
        ('signals = ["YawRt"]\n', "'signals' must be a table, [signals], got ['YawRt']"),
        ("[signals]\nyaw_rate = { name = 3 }\n", "'signals.yaw_rate.name' must be text in quotes, got 3"),
        ('[signals]\nyaw_rate = { name = "YawRt", sign = 2 }\n', "'signals.yaw_rate.sign' must be 1 or -1, got 2"),
        ('[signals]\nyaw_rate = { name = "YawRt", sgn = -1 }\n', "did you mean sign"),
        ('[signals]\nyawrate = { name = "YawRt" }\n', "'yawrate' is not a signal; did you mean yaw_rate?"),
    ],
)
def test_an_invalid_signals_table_is_refused_with_the_allowed_values(
    signals: str, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert says in refusal(["offset", *network(tmp_path, dbc("°", "°/s", "km/h", "m/s²").encode(), signals)], capsys)


def test_names_with_nothing_in_common_are_not_suggested() -> None:
    assert did_you_mean("qqq", NAMES) == ""
