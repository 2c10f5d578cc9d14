"""The angle without its sensor from a drive to a table: simulated trucks, a log at the command line, real cars."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from real_data import real_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
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


def test_what_was_learned_with_the_sensor_tells_the_angle_without_it(
    drive: tuple[Signals, Truth], truck: oc.Vehicle
) -> None:
    signals, truth = drive
    error, sd = after_loss(oc.angle(signals, truck, sensor_lost_at=LOST_S), truth)
    assert np.sqrt(np.mean(error**2)) < 1.5
    assert 0.92 < np.mean(np.abs(error) < 1.96 * sd) < 0.999
    for method in ("yaw-rate", "yaw-rate-understeer", "wheel-speed", "wheel-speed-exact"):
        theirs, _ = after_loss(oc.angle(signals, truck, sensor_lost_at=LOST_S, method=method), truth)
        assert np.sqrt(np.mean(theirs**2)) > 1.3 * np.sqrt(np.mean(error**2))


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


def test_the_measured_column_stays_as_the_sensor_said_it(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    signals, _ = drive
    table = oc.angle(signals, truck, sensor_lost_at=LOST_S)
    np.testing.assert_array_equal(table["measured_rad"], signals.table["steering_wheel_angle_rad"])
    assert table["sensor_fault"][-1] == "lost"
    assert table["sensor_fault_since_s"][-1] == pytest.approx(signals.table["time_s"][0] + LOST_S, abs=0.02)


def test_nothing_of_the_sensor_is_used_after_it_is_lost(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    signals, _ = drive
    angle = signals.table["steering_wheel_angle_rad"].to_numpy().copy()
    angle[round(100 * LOST_S) :] = 1.0
    spoiled = replace(signals, table=signals.table.with_columns(steering_wheel_angle_rad=pl.Series(angle)))
    names = [name for name in oc.angle(signals, truck, sensor_lost_at=LOST_S).columns if name != "measured_rad"]
    one, other = (oc.angle(drive, truck, sensor_lost_at=LOST_S).select(names) for drive in (signals, spoiled))
    assert one.equals(other)


def test_a_drive_that_never_had_a_sensor_claims_the_ackermann_angle(
    drive: tuple[Signals, Truth], truck: oc.Vehicle
) -> None:
    signals, truth = drive
    blind = replace(signals, table=signals.table.drop("steering_wheel_angle_rad"))
    table = oc.angle(blind, truck)
    assert set(table["status"]) == {"unobservable"}
    assert "measured_rad" not in table.columns
    error, sd = after_loss(table, truth)
    assert np.mean(np.abs(error) < 1.96 * sd) > 0.92
    assert np.median(sd) > 2.0


def test_smoothing_takes_noise_away_and_moves_nothing_else(drive: tuple[Signals, Truth], truck: oc.Vehicle) -> None:
    signals, truth = drive
    plain, smooth = (oc.angle(signals, truck, sensor_lost_at=LOST_S, smooth=on) for on in (False, True))
    one, other = after_loss(plain, truth)[0], after_loss(smooth, truth)[0]
    assert np.abs(one - other).mean() < 0.5
    assert np.std(np.diff(other)) < 0.7 * np.std(np.diff(one))


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"method": "guess"}, "method"),
        ({"sensor_lost_at": -1.0}, "sensor_lost_at"),
        ({"params": {"nope": 1.0}}, "params"),
    ],
)
def test_what_cannot_be_asked_is_refused_by_name(
    drive: tuple[Signals, Truth], truck: oc.Vehicle, options: dict[str, object], code: str
) -> None:
    with pytest.raises(OncenterError) as refusal:
        oc.angle(drive[0], truck, **options)  # type: ignore[arg-type]
    assert refusal.value.code == code


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
