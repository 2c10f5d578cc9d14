"""--method wheel-speed at the door: what it needs, what it refuses, what it says."""

import dataclasses
import json
from collections.abc import Callable

import pytest
from typer.testing import CliRunner

import oncenter as oc
from oncenter.cli.program import program_of
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE, Signals
from oncenter.simulate import Truth
from oncenter.vehicle import vehicle_from

TRUCK = oc.vehicle("scania_r730_4x2")


@pytest.fixture(scope="module")
def drive() -> tuple[Signals, Truth]:
    return oc.simulate("thesis_drive", seed=41)


def without(signals: Signals, *names: str) -> Signals:
    lost = [column for column in signals.table.columns if column.startswith(names)]
    sources = {name: source for name, source in signals.sources.items() if not name.startswith(names)}
    return dataclasses.replace(signals, table=signals.table.drop(lost), sources=sources)


def refused(act: Callable[[], object]) -> OncenterError:
    with pytest.raises(OncenterError) as caught:
        act()
    return caught.value


def test_the_answer_names_the_method_and_the_radii(drive: tuple[Signals, Truth]) -> None:
    signals, truth = drive
    answer = oc.offset(signals, TRUCK, method="wheel-speed")
    given = answer.to_dict()
    assert given["method"] == "wheel-speed"
    assert given["wheel_radius_mismatch_rear"]["value"] == pytest.approx(0.0, abs=2e-4)
    assert given["wheel_radius_mismatch_rear"]["unit"] == "1"
    low, high = given["offset"]["ci95"]
    assert low < truth.offset_rad / DEGREE < high
    assert json.loads(answer.to_json()) == given


def test_it_needs_neither_gyro_nor_accelerometer_nor_vehicle_speed(drive: tuple[Signals, Truth]) -> None:
    signals = without(drive[0], "yaw_rate", "lateral_acc", "longitudinal_acc", "vehicle_speed")
    answer = oc.offset(signals, TRUCK, method="wheel-speed")
    assert answer.used_s > 300
    assert answer.yaw_rate_bias.value is None
    assert oc.trace(answer)["offset_rad"][-1] == pytest.approx(answer.offset.value, abs=1e-3)  # radii, to the last


def test_one_axle_is_enough(drive: tuple[Signals, Truth]) -> None:
    signals = without(drive[0], "wheel_speed_rear")
    assert oc.offset(signals, TRUCK, method="wheel-speed").used_s > 300


def test_a_log_without_wheel_speeds_is_refused_with_their_names(drive: tuple[Signals, Truth]) -> None:
    error = refused(lambda: oc.offset(without(drive[0], "wheel_speed"), TRUCK, method="wheel-speed"))
    assert (error.code, error.exit_code) == ("missing_signal", 1)
    assert set(error.needs) == {"wheel_speed_rear_left", "wheel_speed_rear_right"}


def test_a_vehicle_file_without_the_axles_track_is_refused(drive: tuple[Signals, Truth]) -> None:
    truck = TRUCK.model_copy(update={"track_width_rear_m": None})
    error = refused(lambda: oc.offset(drive[0], truck, method="wheel-speed"))
    assert (error.code, error.exit_code) == ("track_width", 2)
    assert "track_width_rear_m" in str(error)


@pytest.mark.parametrize("metres", [0.0, 0.9, 3.1])
def test_an_impossible_track_width_is_refused(metres: float) -> None:
    values = {"wheelbase_m": 3.7, "steering_ratio": 19.3, "track_width_rear_m": metres}
    error = refused(lambda: vehicle_from(values, "truck.toml"))
    assert error.code == "vehicle_file"
    assert "track_width_rear_m" in str(error)


def test_the_thesiss_answer_has_the_bias_from_the_wheel_speeds(drive: tuple[Signals, Truth]) -> None:
    signals, truth = drive
    biased = dataclasses.replace(
        signals, table=signals.table.with_columns(yaw_rate_rad_s=signals.table["yaw_rate_rad_s"] + 0.3 * DEGREE)
    )
    answer = oc.offset(biased, TRUCK, method="thesis")
    reported = next(finding for finding in answer.findings if finding.code == "yaw_rate_bias")
    assert reported.value == pytest.approx(truth.yaw_rate_bias_rad_s / DEGREE + 0.3, abs=0.05)
    assert "wheel speeds" in reported.text
    assert "does not correct" in reported.text


def test_the_verb_takes_the_method(drive: tuple[Signals, Truth], tmp_path_factory: pytest.TempPathFactory) -> None:
    log = tmp_path_factory.mktemp("wheels") / "drive.parquet"
    drive[0].table.write_parquet(log)
    ran = CliRunner().invoke(
        program_of(), ["offset", str(log), "--vehicle", "scania_r730_4x2", "--method", "wheel-speed", "--json"]
    )
    assert ran.exit_code == 0
    assert json.loads(ran.stdout)["method"] == "wheel-speed"
