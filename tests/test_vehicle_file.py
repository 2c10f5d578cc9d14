"""`oncenter vehicle`: a new file is commented and valid, a checked one is described, shipped ones are listed."""

import os
import re
import sys
from pathlib import Path

import pytest
from test_estimate import steady_drive

import oncenter as oc
from oncenter import _core
from oncenter.cli import run
from oncenter.learned_priors import KEYS as KEYS_OF_PRIORS
from oncenter.learned_priors import SCHEMA, error_key
from oncenter.vehicle import Sensors, Vehicle, vehicle_from
from oncenter.vehicle_file.proposals import Named, proposals
from oncenter.vehicle_file.questions import answers
from oncenter.vehicle_file.shipped_files import shipped_names
from oncenter.vehicle_file.written import vehicle_text
from oncenter.vehicle_keys import KEYS, SIGNAL_ENTRY, TABLES

TRUCK = {"name": "truck 7", "wheelbase_m": 3.7, "steering_ratio": 19.3}
DBC = """VERSION ""
BU_: X
BO_ 512 ESP: 8 X
 SG_ YawRate : 0|16@1- (0.01,0) [0|0] "deg/s" X
 SG_ LatAcc : 16|16@1- (0.001,0) [0|0] "m/s^2" X
 SG_ YawRateStatus : 32|4@1+ (1,0) [0|0] "" X
BO_ 513 SAS: 8 X
 SG_ SteeringWheelAngle : 0|16@1- (0.1,0) [0|0] "deg" X
 SG_ SteeringWheelAngleSpeed : 16|16@1- (0.1,0) [0|0] "deg/s" X
"""


def test_every_key_of_the_vehicle_is_in_the_table_of_keys_and_no_other() -> None:
    assert set(KEYS) | set(TABLES) - {"sensors"} == (
        (set(Vehicle.model_fields) - {"sensors"}) | {f"sensors.{name}" for name in Sensors.model_fields}
    )
    assert set(SIGNAL_ENTRY) == set(Vehicle.model_fields["signals"].annotation.__args__[1].model_fields)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"axle_layout": "4x2", "rear_axle_steers": "tag"}, "'tag' needs three axles, and 'axle_layout' is '4x2'"),
        ({"axle_layout": "6x2", "rear_axle_steers": "rear"}, "'rear' is of two axles, and 'axle_layout' is '6x2'"),
        ({"set_up_for_crown": "yes"}, "'set_up_for_crown' must be true or false, without quotes, got 'yes'"),
        ({"rear_axle_zero_deg": 1.0, "rear_axle_zero_sd_deg": 0.1}, "'rear_axle_zero_deg' needs 'rear_axle_steers'"),
    ],
)
def test_an_axle_that_the_truck_cannot_have_is_refused_in_words(given: dict[str, object], said: str) -> None:
    with pytest.raises(oc.OncenterError, match=said):
        vehicle_from({**TRUCK, **given}, "truck.toml")


def test_the_range_of_the_wheelbase_is_the_core_s() -> None:
    low, high = KEYS["wheelbase_m"].low, KEYS["wheelbase_m"].high
    assert [_core.bad_vehicle(wheelbase, 19.3) for wheelbase in (low, high)] == [None, None]
    assert [_core.bad_vehicle(wheelbase, 19.3) for wheelbase in (0.99 * low, 1.01 * high)] == ["wheelbase"] * 2


@pytest.mark.parametrize("key", [key for key in KEYS.values() if key.usual], ids=lambda key: key.name)
def test_usual_values_are_accepted(key) -> None:
    assert key.low <= key.usual[0] <= key.usual[1] <= key.high


def test_a_new_file_has_every_key_and_each_example_is_valid(tmp_path: Path) -> None:
    text = vehicle_text(TRUCK)
    names = [name.removeprefix("sensors.") for name in KEYS]
    assert [name for name in names if not re.search(rf"^#?{name} = ", text, re.MULTILINE)] == []
    assert [name for name in TABLES if not re.search(rf"^#?\[{name}\]$", text, re.MULTILINE)] == []
    import tomllib

    assert set(tomllib.loads(text)) == set(TRUCK)
    all_in_force = re.sub(r"^#(?=\S)", "", text, flags=re.MULTILINE)
    of_fleet = "".join(f"{key} = 0.1\n{error_key(key)} = 0.1\n" for key in KEYS_OF_PRIORS)
    priors = f'schema = "{SCHEMA}"\n[priors]\ntrucks = 20\n{of_fleet}'
    (tmp_path / TABLES["priors"].example["from"]).write_text(priors)
    truck = vehicle_from(tomllib.loads(all_in_force), "all.toml", tmp_path)
    assert truck.model_fields_set == set(Vehicle.model_fields)


def test_a_file_written_from_options_is_read_back(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "truck.toml"
    (tmp_path / "t.dbc").write_text(DBC)
    options = "--wheelbase-m 4.1 --steering-ratio 18 --axle-layout 6x2 --traffic-side left --track-width-rear-m 1.8"
    signal = ["--signal", "yaw_rate=ESP.YawRate,deg_s,-1", "--dbc", str(tmp_path / "t.dbc"), "--name", 'a "b"']
    assert run(["vehicle", "new", str(file), *options.split(), *signal]) == 0
    assert "oncenter vehicle check" in capsys.readouterr().out
    truck = oc.vehicle(file)
    assert (truck.name, truck.wheelbase_m, truck.steering_ratio, truck.axle_layout) == ('a "b"', 4.1, 18.0, "6x2")
    assert (truck.traffic_side, truck.track_width_rear_m) == ("left", 1.8)
    assert (truck.signal_names["yaw_rate"].unit, truck.signal_names["yaw_rate"].sign) == ("deg_s", -1)
    assert truck.databases()[0].samefile(tmp_path / "t.dbc")


def test_a_relative_database_is_found_from_the_folder_of_the_new_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "trucks").mkdir()
    (tmp_path / "t.dbc").write_text(DBC)
    monkeypatch.chdir(tmp_path)
    assert run("vehicle new trucks/a.toml --wheelbase-m 4 --steering-ratio 18 --dbc t.dbc".split()) == 0
    assert oc.vehicle("trucks/a.toml").databases()[0].samefile("t.dbc")


def test_the_best_signals_of_a_database_are_in_force_and_other_candidates_are_comments(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "truck.toml"
    (tmp_path / "t.dbc").write_text(DBC + ' SG_ SteeringAngle2 : 32|16@1- (0.1,0) [0|0] "deg" X\n')
    arguments = ["--wheelbase-m", "4", "--steering-ratio", "18", "--dbc", str(tmp_path / "t.dbc")]
    assert run(["vehicle", "new", str(file), *arguments]) == 0
    text, signals = file.read_text(), oc.vehicle(file).signals
    assert {signal: entry.name for signal, entry in signals.items()} == {
        "steering_wheel_angle": "SAS.SteeringWheelAngle",
        "yaw_rate": "ESP.YawRate",
        "lateral_acceleration": "ESP.LatAcc",
    }
    assert "# Proposed from t.dbc: check name, unit and sign" in text
    assert '#steering_wheel_angle = { name = "SAS.SteeringAngle2", unit = "deg", sign = 1 }' in text
    assert "note: vehicle_speed: no name fits; add an entry to [signals]" in capsys.readouterr().out


def test_the_columns_of_a_log_are_proposed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, file = tmp_path / "log.csv", tmp_path / "truck.toml"
    log.write_text("t_s,swa_deg,yaw_rate_dps,lat_accel_mps2,other\n0,1,2,3,4\n")
    assert run(["vehicle", "new", str(file), "--wheelbase-m", "4", "--steering-ratio", "18", "--log", str(log)]) == 0
    assert "4 signals proposed" in capsys.readouterr().out
    signals = oc.vehicle(file).signals
    assert (signals["yaw_rate"].name, signals["time"].name, signals["time"].unit) == ("yaw_rate_dps", "t_s", "s")
    assert "# Proposed from log.csv" in file.read_text()


def test_of_a_database_only_signals_that_the_log_has_are_proposed(tmp_path: Path) -> None:
    log, file = tmp_path / "log.log", tmp_path / "truck.toml"
    (tmp_path / "t.dbc").write_text(DBC)
    log.write_text("".join(f"({k / 100:.2f}) can0 200#0A00{k % 50:02X}0000000000\n" for k in range(300)))
    options = ["--wheelbase-m", "4", "--steering-ratio", "18", "--dbc", str(tmp_path / "t.dbc"), "--log", str(log)]
    assert run(["vehicle", "new", str(file), *options]) == 0
    assert "ESP.YawRate" in file.read_text() and "SAS.SteeringWheelAngle" not in file.read_text()


@pytest.mark.parametrize(
    ("there", "expected"),
    [
        ("SAS11.SAS_Angle|deg SAS11.SAS_Speed|deg/s", {"steering_wheel_angle": "SAS11.SAS_Angle"}),
        ("A.STEER_RATE|deg/s A.STEER_ANGLE|deg", {"steering_wheel_angle": "A.STEER_ANGLE"}),
        ("STEERING.WheelAngle|deg STEERING.WheelSpeed|deg/s", {"steering_wheel_angle": "STEERING.WheelAngle"}),
        ("A.YawAngle|deg A.YawRate|deg/s", {"yaw_rate": "A.YawRate"}),
        ("A.YawRateOffset|deg/s", {}),
        ("W.WHL_SPD_FL|km/h W.WHL_SPD_FL_Stat|", {"wheel_speed_front_left": "W.WHL_SPD_FL"}),
        ("W.WheelSpeedRearRight|rad/s", {"wheel_speed_rear_right": "W.WheelSpeedRearRight"}),
        ("C.EngineSpeed|rpm C.VehicleSpeed|km/h", {"vehicle_speed": "C.VehicleSpeed"}),
        ("L.LWI_Lenkradwinkel|Unit_DegreOfArc", {"steering_wheel_angle": "L.LWI_Lenkradwinkel"}),
        ("K.ACCEL_Y|m/s^2", {"lateral_acceleration": "K.ACCEL_Y"}),
    ],
)  # fmt: skip
def test_names_of_other_makers_are_recognised(there: str, expected: dict[str, str]) -> None:
    named = [Named(*each.split("|")) for each in there.split()]
    assert {each.signal: each.named.name for each in proposals(named)} == expected


def test_an_unclear_unit_is_left_to_the_user() -> None:
    (proposed,) = proposals([Named("L.LWI_Lenkradwinkel", "Unit_Winkel")])
    assert proposed.unit is None
    assert proposed.remark == ("1. by its name. It has the unit Unit_Winkel there; deg is assumed: check the unit.")


def answered(*lines: str) -> tuple[dict[str, object], list[str]]:
    written, said = iter(lines), []
    return answers(lambda prompt: next(written), said.append, "truck"), said


def test_enter_leaves_a_value_out_or_takes_the_default() -> None:
    values, _ = answered("", "3,7", "", "", "", "", "", "", "")
    assert values["name"] == "truck" and values["wheelbase_m"] == 3.7
    assert set(values) == {"name", "wheelbase_m"}  # the joint method estimates its product with the ratio


def test_an_unusual_value_is_asked_again_and_taken_when_it_is_given_again() -> None:
    values, said = answered("", "5530", "5.53", "3.7", "3.7", "", "", "", "", "", "")
    assert (values["wheelbase_m"], values["steering_ratio"]) == (5.53, 3.7)
    assert any("3.7; trucks have 13 to 27; enter it again if it is right" in line for line in said)


def test_an_unusual_option_is_taken_with_a_note(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["vehicle", "new", str(tmp_path / "a.toml"), "--wheelbase-m", "3.7", "--steering-ratio", "3.7"]) == 0
    assert "note: steering_ratio is 3.7; trucks have 13 to 27" in capsys.readouterr().out


def test_a_value_that_an_option_gives_is_not_asked() -> None:
    said: list[str] = []
    lines = iter(("t", "3.7", "19", "", "", "", "", ""))
    values = answers(lambda prompt: next(lines), said.append, "truck", given=("dbc",))
    assert values["wheelbase_m"] == 3.7 and "dbc" not in "\n".join(said)


def test_a_wrong_answer_is_asked_again_with_the_reason() -> None:
    values, said = answered("t", "5530", "5.53 m", "19", "6x3", "6x2", "", "", "up", "right", "", "")
    assert (values["wheelbase_m"], values["axle_layout"], values["traffic_side"]) == (5.53, "6x2", "right")
    text = "\n".join(said)
    assert "in mm? 5530 mm are 5.53 m" in text and "'6x3'" in text and "'up'" in text


@pytest.mark.posix  # Windows has no pseudo-terminal
def test_in_a_terminal_it_prompts_for_the_values(tmp_path: Path) -> None:
    import pty
    import subprocess

    controller, terminal = pty.openpty()
    command = [sys.executable, "-m", "oncenter", "vehicle", "new", str(tmp_path / "t.toml")]
    done = subprocess.Popen(command, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    os.write(controller, b"\n4.2\n18\n\n\n\nright\n\n\n")
    out, err = done.communicate(timeout=60)
    assert done.returncode == 0, err
    assert "wheelbase_m in m" in err and "wrote" in out and "wheelbase_m in m" not in out
    truck = oc.vehicle(tmp_path / "t.toml")
    assert (truck.wheelbase_m, truck.steering_ratio, truck.traffic_side) == (4.2, 18.0, "right")


def test_a_file_without_numbers_is_that_of_an_unknown_truck(tmp_path: Path) -> None:
    assert run(["vehicle", "new", str(tmp_path / "t.toml"), "--traffic-side", "left"]) == 0
    truck = oc.vehicle(tmp_path / "t.toml")
    assert truck.assumed == ("wheelbase_m", "steering_ratio") and truck.traffic_side == "left"


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--wheelbase-m", "5530", "--steering-ratio", "18"], "in mm? 5530 mm are 5.53 m"),
        (["--wheelbase-m", "4", "--steering-ratio", "18", "--signal", "yaw_rate"], "--signal takes"),
        (["--wheelbase-m", "4", "--steering-ratio", "18", "--signal", "yaw=a"], "yaw_rate"),
        (["--wheelbase-m", "4", "--steering-ratio", "18", "--dbc", "none.dbc"], "none.dbc"),
    ],
)
def test_what_is_missing_or_wrong_is_one_line_and_writes_no_file(
    arguments: list[str], named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["vehicle", "new", str(tmp_path / "t.toml"), *arguments]) == 2
    out, err = capfd.readouterr()
    assert err.count("\n") == 1 and named in err and out == ""
    assert not (tmp_path / "t.toml").exists()


def test_an_existing_file_is_not_written_over(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "t.toml"
    file.write_text("mine")
    assert run(["vehicle", "new", str(file), "--wheelbase-m", "4", "--steering-ratio", "18"]) == 2
    assert "exists" in capfd.readouterr().err and file.read_text() == "mine"


def test_a_check_says_what_a_file_has_and_what_would_help(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "t.toml"
    file.write_text('wheelbase_m = 14.5\nsteering_ratio = 19.3\naxle_layout = "4x2"\n')
    assert run(["vehicle", "check", str(file)]) == 0
    out = capsys.readouterr().out
    assert "4x2, wheelbase 14.5 m, steering ratio 19.3" in out
    assert "unusual: wheelbase_m is 14.5 m; trucks have 2.5 to 8 m" in out
    assert "track_width_rear_m" in out and "axle_layout " not in out


def test_a_check_with_a_log_names_the_signals_that_are_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, log = tmp_path / "t.toml", tmp_path / "log.csv"
    steady_drive(minutes=0.5).table.rename({"yaw_rate_rad_s": "gyro"}).write_csv(log)
    for column, exit_code in (("gyro", 0), ("giro", 2)):
        file.write_text(
            f'wheelbase_m = 4\nsteering_ratio = 19.3\n[signals]\nyaw_rate = {{ name = "{column}", unit = "rad_s" }}\n'
        )
        assert run(["vehicle", "check", str(file), str(log)]) == exit_code
        out = capsys.readouterr().out
        assert "steering_wheel_angle: column steering_wheel_angle_rad" in out
        assert ("yaw_rate: not in the log" in out) == (column == "giro")
    assert "gyro" in out


def test_a_needed_signal_without_an_entry_is_called_not_assigned(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The database's YawRate is recognised by its name; its angle is not."""
    file, log = tmp_path / "t.toml", tmp_path / "log.log"
    (tmp_path / "t.dbc").write_text(DBC.replace("YawRate :", "yaw_rate :"))
    log.write_text("".join(f"({k / 100:.2f}) can0 200#0A00{k % 50:02X}0000000000\n" for k in range(300)))
    file.write_text('wheelbase_m = 4\nsteering_ratio = 18\ndbc = "t.dbc"\n')
    assert run(["vehicle", "check", str(file), str(log)]) == 2
    out = capfd.readouterr().out
    assert "steering_wheel_angle: not assigned: add it to [signals]" in out and "not in the log" not in out
    assert run(["offset", str(log), "--vehicle", str(file)]) == 1
    err = capfd.readouterr().err
    assert f"assign steering_wheel_angle, vehicle_speed, lateral_acceleration in [signals] of {file}" in err
    assert "--dbc" not in err and "PGN" not in err


def test_a_signal_outside_its_table_is_named_with_the_table(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "t.toml").write_text('wheelbase_m = 4\nsteering_ratio = 18\nyaw_rate = { name = "gyro" }\n')
    assert run(["vehicle", "check", str(tmp_path / "t.toml")]) == 2
    assert "'yaw_rate' belongs under [signals]" in capfd.readouterr().err


def test_a_check_of_a_wrong_file_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "t.toml").write_text("wheelbase_m = 5530\nsteering_ratio = 19.3\n")
    assert run(["vehicle", "check", str(tmp_path / "t.toml")]) == 2
    assert "must be 1 to 20 m, got 5530: in mm? 5530 mm are 5.53 m" in capfd.readouterr().err


def test_the_list_shows_each_shipped_vehicle_and_where_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["vehicle", "list"]) == 0
    out = capsys.readouterr().out
    assert shipped_names() and all(name in out for name in shipped_names())
    folder = Path(out.splitlines()[-1].removeprefix("in "))
    assert {path.stem for path in folder.glob("*.toml")} == set(shipped_names())
