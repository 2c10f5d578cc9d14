"""The angle without its sensor from a drive to a table: simulated trucks, a log at the command line, real cars."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl
import pytest
from drive_frames import candump
from drive_frames import drive as frames
from real_data import real_drive
from truck_rows import drive_row

import oncenter as oc
from oncenter import _core
from oncenter.angle.from_truck import known_by
from oncenter.angle.run import notes_on
from oncenter.cli import run
from oncenter.cli.angle import _in_words
from oncenter.errors import OncenterError
from oncenter.param_table import params as param_table
from oncenter.signals import DEGREE, Signals
from oncenter.simulate.truth import Truth

LOST_S = 600.0
FAST_M_S = 8.0
TRUCK = "scania_r730_4x2"


@pytest.fixture(scope="module")
def truck() -> oc.Vehicle:
    return oc.vehicle(TRUCK)


@pytest.fixture(scope="module")
def drive() -> tuple[Signals, Truth]:
    return oc.simulate("thesis_drive", 5)


def after_loss(table: pl.DataFrame, truth: Truth) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    """Error and standard deviation in deg, of all that is driven fast after the loss."""
    true = truth.table["steering_wheel_angle_rad"].to_numpy()
    when = (np.arange(len(true)) >= 100 * LOST_S) & (truth.table["vehicle_speed_m_s"].to_numpy() > FAST_M_S)
    error = table["steering_wheel_angle_rad"].to_numpy() - true
    return error[when] / DEGREE, table["standard_deviation_rad"].to_numpy()[when] / DEGREE


def test_estimates_with_the_sensor_give_the_angle_without_it(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    signals, truth = drive
    error, sd = after_loss(oc.angle(signals, truck, sensor_lost_at=LOST_S), truth)
    assert np.sqrt(np.mean(error**2)) < 1.5
    assert 0.92 < np.mean(np.abs(error) < 1.96 * sd) < 0.999
    for method in ("yaw-rate", "yaw-rate-understeer", "wheel-speed", "wheel-speed-exact"):
        theirs, _ = after_loss(oc.angle(signals, truck, sensor_lost_at=LOST_S, method=method), truth)
        assert np.sqrt(np.mean(theirs**2)) > 1.3 * np.sqrt(np.mean(error**2))


def test_a_sensor_that_is_dead_at_key_on_has_an_angle_by_the_trucks_former_drives(
    drive: tuple[Signals, Truth], truck: oc.Vehicle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    former = oc.offset(oc.simulate("thesis_drive", 6)[0], truck)
    signals, truth = drive
    error, sd = after_loss(oc.angle(signals, truck, sensor_lost_at=0.0, before=former.rows), truth)
    assert np.mean(np.abs(error) < 1.96 * sd) > 0.92
    blind_error, blind_sd = after_loss(oc.angle(signals, truck, sensor_lost_at=0.0), truth)
    assert np.median(sd) < 0.7 * np.median(blind_sd)
    assert np.sqrt(np.mean(error**2)) < 0.9 * np.sqrt(np.mean(blind_error**2))
    log, memory = tmp_path / "drive.parquet", tmp_path / "truck.toml"
    signals.table.head(6000).write_parquet(log)
    command = ["angle", str(log), "--vehicle", TRUCK, "--memory", str(memory)]
    assert run(command) == 2
    assert "truck.toml does not exist" in capsys.readouterr().err
    assert run(["offset", str(log), "--vehicle", TRUCK, "--memory", str(memory)]) == 0
    assert run(command) == 0
    assert "do not count" not in capsys.readouterr().out
    memory.write_text(memory.read_text().replace('settings = "oncenter', 'settings = "another'))
    assert run(command) == 0
    assert "note: 1 drive of the truck's memory" in (out := capsys.readouterr().out) and "do not count" in out


@pytest.mark.parametrize("method", ["observer", "yaw-rate-understeer"])
def test_without_an_accelerometer_the_usual_bank_is_assumed_before_and_after_the_loss(
    drive: tuple[Signals, Truth], truck: oc.Vehicle, method: str
) -> None:
    blind = truck.model_copy(update={"params": {**truck.params, "use_accelerometer": 0.0}})
    signals, truth = drive
    heard, _ = after_loss(oc.angle(signals, truck, sensor_lost_at=LOST_S, method=method), truth)
    error, sd = after_loss(oc.angle(signals, blind, sensor_lost_at=LOST_S, method=method), truth)
    assert np.sqrt(np.mean(error**2)) < 1.2 * np.sqrt(np.mean(heard**2))
    assert np.mean(np.abs(error) < 1.96 * sd) > 0.92


@pytest.mark.parametrize("silent", ["always", "after the sensor was lost", "now and then"])
def test_a_silent_accelerometer_costs_the_bank_and_not_the_angle(
    drive: tuple[Signals, Truth], truck: oc.Vehicle, silent: str
) -> None:
    signals, truth = drive
    time, lateral = signals.table["time_s"].to_numpy(), signals.table["lateral_acceleration_m_s2"].to_numpy()
    gone = time > LOST_S if silent.startswith("after") else time % 60.0 < 20.0
    heard = signals.table.with_columns(lateral_acceleration_m_s2=pl.Series(np.where(gone, np.nan, lateral)))
    table = signals.table.drop("lateral_acceleration_m_s2") if silent == "always" else heard
    stays = truck.model_copy(update={"params": {**truck.params, "accelerometer_wander_sd_m_s2": 0.0}})
    _, heard_sd = after_loss(oc.angle(signals, stays, sensor_lost_at=LOST_S), truth)
    error, sd = after_loss(oc.angle(replace(signals, table=table), stays, sensor_lost_at=LOST_S), truth)
    assert np.sqrt(np.mean(error**2)) < 2.0
    assert np.mean(np.abs(error) < 1.96 * sd) > 0.9
    assert np.mean(sd**2) > 1.1 * np.mean(heard_sd**2)
    assert np.median(sd) < 4.0


def test_the_estimates_stay_while_the_accelerometer_is_silent(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    core = _core.Core(truck.wheelbase_m, truck.ratio_near_centre, {}, 100.0, method="joint", angle_method="observer")
    columns = {name: drive[0].table[name].to_numpy().copy() for name in _core.COLUMNS if name in drive[0].table.columns}
    learned_s = []
    for rows in (slice(0, 60_000), slice(60_000, 90_000)):
        some = {name: column[rows] for name, column in columns.items()}
        if learned_s:
            some["lateral_acceleration_m_s2"][:] = np.nan
        core.run(some)
        learned_s.append(float(core.state()["evidence"]["angle"]["seconds"]))
    assert learned_s[0] > 100.0 and learned_s[1] == learned_s[0]


def test_fifteen_degrees_of_play_cost_less_than_three(truck: oc.Vehicle) -> None:
    signals, truth = oc.simulate("heavy_play", 5)
    error, sd = after_loss(oc.angle(signals, truck, sensor_lost_at=LOST_S), truth)
    assert np.sqrt(np.mean(error**2)) < 3.0
    assert np.mean(np.abs(error) < 1.96 * sd) > 0.92


def test_a_hard_turn_is_followed_early(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    """Figure 12: 90 % of 110 deg within 0.6 s, of which the wheel itself takes 0.38 s."""
    signals, truth = oc.simulate("hard_turn", 5)
    table = oc.angle(signals, truck, sensor_lost_at=0.0, taught_by=[drive[0]])
    true = truth.table["steering_wheel_angle_rad"].to_numpy()
    begin = int(np.flatnonzero(np.diff(true) < -1.0 * DEGREE)[0])
    found = table["steering_wheel_angle_rad"].to_numpy()[begin : begin + 300] / DEGREE
    assert np.flatnonzero(found <= -39.0)[0] <= 60
    assert found.min() > -50.0 - 11.0


def test_in_town_the_interval_holds_from_walking_speed_on_and_opens_while_standing(truck: oc.Vehicle) -> None:
    signals, truth = oc.simulate("town", 5)
    table = oc.angle(signals, truck, sensor_lost_at=LOST_S)
    error = (table["steering_wheel_angle_rad"] - truth.table["steering_wheel_angle_rad"]).to_numpy()
    within = np.abs(error) < 1.96 * table["standard_deviation_rad"].to_numpy()
    speed, status = truth.table["vehicle_speed_m_s"].to_numpy(), table["status"].to_numpy()
    lost = np.arange(len(speed)) >= 100 * LOST_S
    for low, high in ((1.2, 3.0), (3.0, 8.0)):
        assert np.mean(within[lost & (speed > low) & (speed < high)]) > 0.92
    standing = lost & (speed < 0.1)
    assert np.mean(within[standing]) > 0.95
    assert np.mean(status[standing] == "unobservable") > 0.95


def test_the_measured_column_is_the_reading_of_the_sensor(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    signals, _ = drive
    table = oc.angle(signals, truck, sensor_lost_at=LOST_S)
    np.testing.assert_array_equal(table["measured_rad"], signals.table["steering_wheel_angle_rad"])
    assert table["sensor_fault"][-1] == "lost"
    assert table["sensor_fault_since_s"][-1] == pytest.approx(signals.table["time_s"][0] + LOST_S, abs=0.02)


def spoiled(signals: Signals, measured: npt.NDArray[np.float64]) -> Signals:
    return replace(signals, table=signals.table.with_columns(steering_wheel_angle_rad=pl.Series(measured)))


@pytest.mark.parametrize("fault", ["jumped", "wrong_sign", "stuck", "drifting"])
def test_a_fault_is_named_and_the_estimate_takes_over_without_a_jump(
    drive: tuple[Signals, Truth], truck: oc.Vehicle, fault: str
) -> None:
    signals, truth = drive
    true = truth.table["steering_wheel_angle_rad"].to_numpy()
    fast = truth.table["vehicle_speed_m_s"].to_numpy() > FAST_M_S
    # in a bend of some 15 deg, at speed, well after what is there to learn
    at = int(np.flatnonzero(fast & (np.abs(true) > 15.0 * DEGREE) & (np.arange(len(true)) > 80_000))[0])
    measured = signals.table["steering_wheel_angle_rad"].to_numpy()
    after = np.arange(len(measured)) >= at
    wrong = {
        "jumped": measured + 40.0 * DEGREE,
        "wrong_sign": -measured,
        "stuck": np.full_like(measured, measured[at]),
        "drifting": measured + 0.5 * DEGREE / 100.0 * (np.arange(len(measured)) - at),
    }[fault]
    table = oc.angle(spoiled(signals, np.where(after, wrong, measured)), truck)
    healthy = oc.angle(signals, truck)
    assert set(healthy["sensor_fault"]) == {"none"}
    faults = table["sensor_fault"].to_numpy()
    assert set(faults[:at]) == {"none"}
    found = int(np.flatnonzero(faults != "none")[0])
    assert fault in faults[found : found + 2000]
    sd = oc.angle(signals, truck, sensor_lost_at=LOST_S)["standard_deviation_rad"].to_numpy()
    off = after & (np.abs(wrong - measured) > np.maximum(10.0 * DEGREE, 5.5 * sd)) & fast
    assert np.sum(off[:found]) < 500
    angles = table["steering_wheel_angle_rad"].to_numpy()
    assert np.abs(np.diff(angles[at - 1 : found + 500])).max() < 1.5 * DEGREE
    later = np.flatnonzero(fast[: found + 10_000] & (np.arange(found + 10_000) > found + 200))
    assert np.sqrt(np.mean((angles - true)[later] ** 2)) < 3.0 * DEGREE


def test_a_log_that_ends_with_a_stuck_sensor_has_the_same_fault_as_live(
    drive: tuple[Signals, Truth], truck: oc.Vehicle
) -> None:
    signals, _ = drive
    measured = signals.table["steering_wheel_angle_rad"].to_numpy()
    stuck = spoiled(signals, np.where(np.arange(len(measured)) >= 100_000, measured[100_000], measured))
    found = int(np.argmax(oc.angle(stuck, truck)["sensor_fault"].to_numpy() == "stuck"))
    answer = oc.offset(replace(stuck, table=stuck.table[: found + 100]), truck)
    assert (answer.offset.status, answer.sensor_fault) == ("invalid", "stuck")


@pytest.mark.parametrize("fault", ["wrong_sign", "stuck"])
def test_the_offset_of_a_faulty_sensor_is_invalid_and_from_before(
    drive: tuple[Signals, Truth], truck: oc.Vehicle, fault: str
) -> None:
    signals, truth = drive
    measured = signals.table["steering_wheel_angle_rad"].to_numpy()
    after = np.arange(len(measured)) >= 100_000
    wrong = {"wrong_sign": -measured, "stuck": np.full_like(measured, measured[100_000])}[fault]
    answer = oc.offset(spoiled(signals, np.where(after, wrong, measured)), truck)
    assert (answer.offset.status, answer.sensor_fault) == ("invalid", fault)
    assert answer.offset.value == pytest.approx(truth.offset_rad, abs=1.5 * DEGREE)
    assert answer.to_dict()["offset"]["status"] == "invalid"
    assert "straight-ahead offset invalid; before the fault " in str(answer)
    first = answer.findings[0]
    assert (first.code, first.severity) == ("steering_wheel_angle_sensor_at_fault", "error")
    assert oc.trace(answer)["offset_rad"][-1] == pytest.approx(answer.offset.value, abs=0.1 * DEGREE)
    healthy = oc.offset(signals, truck)
    assert (healthy.offset.status, healthy.sensor_fault) == ("valid", "none")


def test_a_sensor_fault_survives_ignition_and_ends_when_the_sensor_is_good(
    drive: tuple[Signals, Truth], truck: oc.Vehicle
) -> None:
    signals, _ = drive
    turned = spoiled(signals, -signals.table["steering_wheel_angle_rad"].to_numpy())
    tail = replace(turned, table=turned.table.tail(60_000))
    fault = oc.angle(tail, truck, taught_by=[signals, turned])["sensor_fault"]
    assert fault[0] == "wrong_sign"
    healed = oc.angle(replace(signals, table=signals.table.tail(60_000)), truck, taught_by=[signals, turned])
    assert healed["sensor_fault"][0] == "wrong_sign" and healed["sensor_fault"][-1] == "none"


def test_a_drift_is_found_also_on_a_clock_that_was_set_back(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    """Its sensor was not remounted in the future."""
    signals, _ = drive
    columns = {name: signals.table[name].to_numpy() for name in _core.COLUMNS if name in signals.table.columns}
    rows = np.arange(signals.table.height)
    columns["time_s"] = columns["time_s"] - np.where(rows >= 80_000, 7_200.0, 0.0)
    columns["steering_wheel_angle_rad"] = columns["steering_wheel_angle_rad"] + 0.5 * DEGREE / 100.0 * np.clip(
        rows - 100_000, 0, None
    )
    core = _core.Core(
        truck.wheelbase_m,
        truck.ratio_near_centre,
        {},
        signals.rate_hz,
        traffic_side=truck.traffic_sign,
        method="joint",
        angle_method="observer",
    )
    outputs = np.zeros(len(rows), _core.OUTPUT_DTYPE)
    core.run(columns, outputs)
    faults = [_core.FAULTS[fault] for fault in np.unique(outputs["fault"])]
    assert "drifting" in faults and "remounted" not in faults


def test_nothing_of_the_sensor_is_used_after_it_is_lost(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    signals, _ = drive
    angle = signals.table["steering_wheel_angle_rad"].to_numpy().copy()
    angle[round(100 * LOST_S) :] = 1.0
    names = [name for name in oc.angle(signals, truck, sensor_lost_at=LOST_S).columns if name != "measured_rad"]
    one, other = (
        oc.angle(drive, truck, sensor_lost_at=LOST_S).select(names) for drive in (signals, spoiled(signals, angle))
    )
    assert one.equals(other)


def test_a_drive_without_any_sensor_has_the_ackermann_angle(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    signals, truth = drive
    blind = replace(signals, table=signals.table.drop("steering_wheel_angle_rad"))
    table = oc.angle(blind, truck)
    assert set(table["status"]) == {"unobservable"}
    assert "measured_rad" not in table.columns
    error, sd = after_loss(table, truth)
    assert np.mean(np.abs(error) < 1.96 * sd) > 0.92
    assert np.median(sd) > 2.0


@pytest.mark.long
@pytest.mark.parametrize("scenario", ["country", "pulling_truck", "friction_play", "worn_truck"])
@pytest.mark.parametrize("hears", [True, False])
def test_the_ackermann_angles_interval_includes_understeer_and_play(
    truck: oc.Vehicle, scenario: str, hears: bool
) -> None:
    signals, truth = oc.simulate(scenario, 7)
    lacking = ["steering_wheel_angle_rad"] + ([] if hears else ["lateral_acceleration_m_s2"])
    error, sd = after_loss(oc.angle(replace(signals, table=signals.table.drop(lacking)), truck), truth)
    assert np.mean(np.abs(error) < 1.96 * sd) > 0.85


def test_smoothing_is_more_accurate_than_the_running_estimate(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    signals, truth = drive
    plain, smooth = (oc.angle(signals, truck, sensor_lost_at=LOST_S, smooth=on) for on in (False, True))
    one, other = after_loss(plain, truth)[0], after_loss(smooth, truth)[0]
    assert np.sqrt(np.mean(other**2)) < 0.85 * np.sqrt(np.mean(one**2))
    assert np.std(np.diff(other)) < 0.5 * np.std(np.diff(one))
    angles, lost = smooth["steering_wheel_angle_rad"].to_numpy(), round(100 * LOST_S)
    np.testing.assert_array_equal(angles[:lost], plain["steering_wheel_angle_rad"].to_numpy()[:lost])
    assert np.abs(np.diff(angles[lost - 10 : lost + 500])).max() < 1.0 * DEGREE
    assert not smooth["delay_s"].to_numpy()[lost:].any() and plain["delay_s"].to_numpy()[lost:].any()


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"method": "guess"}, "method"),
        ({"sensor_lost_at": -1.0}, "sensor_lost_at"),
        ({"sensor_lost_at": 1e9}, "sensor_lost_at"),
        ({"params": {"nope": 1.0}}, "params"),
    ],
)
def test_an_impossible_argument_is_refused_by_name(
    drive: tuple[Signals, Truth], truck: oc.Vehicle, options: dict[str, object], code: str
) -> None:
    with pytest.raises(OncenterError) as refusal:
        oc.angle(drive[0], truck, **options)  # type: ignore[arg-type]
    assert refusal.value.code == code


def by_gnss(signals: Signals, truth: Truth, *names: str) -> Signals:
    """The drive with columns of a receiver without noise."""
    true = {name: truth.table[name].to_numpy() for name in ("heading_rad", "lateral_speed_m_s", "vehicle_speed_m_s")}
    heading = 90.0 - true["heading_rad"] / DEGREE
    degree_m = 6_371_000.0 * DEGREE
    columns = {
        "lateral_speed_m_s": true["lateral_speed_m_s"],
        "heading_deg": np.mod(heading, 360.0),
        "course_deg": np.mod(
            heading - np.arctan2(true["lateral_speed_m_s"], true["vehicle_speed_m_s"]) / DEGREE, 360.0
        ),
        "latitude_deg": 58.0 + truth.table["north_m"].to_numpy() / degree_m,
        "longitude_deg": 16.0 + truth.table["east_m"].to_numpy() / degree_m / np.cos(58.0 * DEGREE),
    }
    return replace(signals, table=signals.table.with_columns(**{name: pl.Series(columns[name]) for name in names}))


@pytest.mark.parametrize(
    "names",
    [("lateral_speed_m_s",), ("heading_deg", "course_deg"), ("heading_deg", "latitude_deg", "longitude_deg")],
)
def test_side_slip_over_ground_gives_the_angle_after_the_tyre_slip_is_estimated(
    drive: tuple[Signals, Truth], truck: oc.Vehicle, names: tuple[str, ...]
) -> None:
    """(23), (24)."""
    signals, truth = drive
    table = oc.angle(by_gnss(signals, truth, *names), truck, method="side-slip", sensor_lost_at=LOST_S)
    error, sd = after_loss(table, truth)
    assert np.sqrt(np.mean(error**2)) < 1.8
    assert np.mean(np.abs(error) < 1.96 * sd) > 0.92


def test_without_gnss_there_is_no_side_slip(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    with pytest.raises(OncenterError, match="'heading_deg' with 'course_deg'") as refusal:
        oc.angle(drive[0], truck, method="side-slip")
    assert refusal.value.code == "missing_signal"


def test_without_yaw_rate_there_is_no_angle(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    lame = replace(drive[0], table=drive[0].table.drop("yaw_rate_rad_s"))
    with pytest.raises(OncenterError) as refusal:
        oc.angle(lame, truck)
    assert refusal.value.code == "missing_signal"


def test_the_command_writes_degrees(
    drive: tuple[Signals, Truth], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, output = tmp_path / "drive.parquet", tmp_path / "out.parquet"
    drive[0].table.head(90_000).write_parquet(log)
    arguments = ["angle", str(log), "--vehicle", TRUCK, "--sensor-lost-at", "600", "--output", str(output)]
    assert run(arguments) == 0
    assert "sensor lost since 600.0 s" in capsys.readouterr().out
    table = pl.read_parquet(output)
    assert table.columns[:4] == [
        "time_s",
        "steering_wheel_angle_deg",
        "steering_wheel_angle_rate_deg_s",
        "standard_deviation_deg",
    ]
    assert {"status", "measured_deg"} <= set(table.columns)
    assert run([*arguments[:-1], str(tmp_path / "out.xlsx")]) == 2


def test_without_evidence_for_the_angle_the_command_prints_no_degrees() -> None:
    """A fifth of a drive in town without its sensor is standing; a moment is reported as one."""
    table = pl.DataFrame(
        {"time_s": np.arange(1000.0), "status": ["valid"] * 799 + ["unobservable"] * 200 + ["converging"]}
    )
    sd = pl.Series([0.02] * 799 + [10.0] * 200 + [0.1])
    said = _in_words(
        table.with_columns(standard_deviation_rad=sd, sensor_fault=pl.lit("none"), sensor_fault_since_s=0.0)
    )
    assert said.splitlines() == [
        "valid: 80% of the drive, half of it within 0.8 deg",
        "unobservable: 20% of the drive, angle not observable: the truck stands, or its motion signals are missing",
        "converging: less than 1% of the drive, half of it within 3.8 deg",
    ]


def test_mixed_drives_use_the_accelerometer_where_most_of_them_have_one(
    drive: tuple[Signals, Truth], truck: oc.Vehicle
) -> None:
    """A note names only the drives that it is about."""
    signals, truth = drive
    blind = replace(signals, table=signals.table.drop("lateral_acceleration_m_s2"), log="blind")
    for teacher, then, word in (
        (blind, signals, "no lateral acceleration in blind: yaw rate times speed is used instead"),
        (signals, blind, "no lateral acceleration for 1800 s of blind: this time is not used"),
    ):
        error, sd = after_loss(oc.angle(then, truck, taught_by=[teacher], sensor_lost_at=1.0), truth)
        assert np.sqrt(np.mean(error**2)) < 2.0 and np.mean(np.abs(error) < 1.96 * sd) > 0.92
        (note,) = notes_on(then, truck, [teacher], 1.0)
        assert note.startswith(word)
    assert notes_on(signals, truck, (), None) == ()


def test_a_log_without_lateral_acceleration_is_answered_with_a_note(
    drive: tuple[Signals, Truth], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, page = tmp_path / "drive.parquet", tmp_path / "page.html"
    drive[0].table.head(90_000).drop("lateral_acceleration_m_s2").write_parquet(log)
    arguments = ["angle", str(log), "--vehicle", TRUCK, "--sensor-lost-at", "600", "--report", str(page)]
    assert run(arguments) == 0
    said = capsys.readouterr().out
    assert "valid" in said
    assert "note: no lateral acceleration in drive.parquet: yaw rate times speed is used instead" in said
    assert "no lateral acceleration in drive.parquet" in page.read_text()


def test_the_notes_on_a_log_are_those_of_offset(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, page = tmp_path / "drive.log", tmp_path / "page.html"
    log.write_text("no line of candump's\n" + candump(frames(4.0)))
    (tmp_path / "bad.csv").write_text("nothing\n")
    notes = {}
    for verb in ("offset", "angle"):
        assert run([verb, str(log), "--vehicle", TRUCK, "--report", str(page)]) == 0
        notes[verb] = [line for line in capsys.readouterr().out.splitlines() if line.startswith("  note: ")]
        assert "left out" in page.read_text()
    assert any("left out" in line for line in notes["angle"])
    assert notes["angle"] == notes["offset"]
    logs = ["--taught-by", str(log), "--taught-by", str(tmp_path / "bad.csv")]
    assert run(["angle", str(log), "--vehicle", TRUCK, *logs]) == 0
    assert "  warning: a log was left out: no signal recognised in bad.csv" in capsys.readouterr().out


def test_a_car_on_a_proving_ground_does_without_its_sensor_for_its_second_half() -> None:
    car = oc.vehicle(Path(__file__).parents[1] / "examples" / "genesis.toml")
    for name in ("cpg_fast_lap", "cpg_slow_lap"):
        signals = oc.read(real_drive(f"genesis/{name}.csv.gz"), names=car.signal_names)
        half_s = 0.5 * len(signals.table) / signals.rate_hz
        whole, half = oc.angle(signals, car), oc.angle(signals, car, sensor_lost_at=half_s)
        offset = np.nanmedian((whole["measured_rad"] - whole["steering_wheel_angle_rad"]).to_numpy())
        error = (half["steering_wheel_angle_rad"] - half["measured_rad"]).to_numpy() + offset
        when = (np.arange(len(error)) >= half_s * signals.rate_hz) & (
            signals.table["vehicle_speed_m_s"].to_numpy() > 3.0
        )
        assert np.sqrt(np.nanmean(error[when] ** 2)) / DEGREE < 2.5


def test_a_truck_by_its_rows_is_that_after_the_newest_drive_whatever_the_order() -> None:
    rows = [drive_row(day, 0.0 if day < 3 else 5.0, play_deg=12.0 if day < 3 else 3.0) for day in range(6)]
    known = known_by(rows, (), _core.default_params())
    assert known == known_by(rows[::-1], (), _core.default_params())
    assert known["known_play_rad"] == pytest.approx(3.0 * DEGREE, abs=0.5 * DEGREE)


def test_a_truck_by_its_rows_stays_within_what_may_be_configured() -> None:
    odd = [drive_row(day, 0.0, neutral=9.0, bank=9.0) for day in range(2)]
    known = known_by(odd, (), _core.default_params())
    assert known["known_accelerometer_bias_m_s2"] == param_table()["known_accelerometer_bias_m_s2"].high
