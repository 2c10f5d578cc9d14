"""Vehicle files: valid values are read, a wrong one is refused by name in one line."""

import math
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_estimate import steady_drive

import oncenter as oc
from oncenter.errors import WRONG_USAGE
from oncenter.steering_ratio import polynomial_of
from oncenter.vehicle import core_params, vehicle_from

TRUCK = {"wheelbase_m": 3.7, "steering_ratio": 19.3}


def test_wheelbase_and_ratio_are_enough() -> None:
    truck = vehicle_from(TRUCK, "some/truck.toml")
    assert (truck.name, truck.wheelbase_m, truck.ratio_near_centre) == ("truck", 3.7, 19.3)


def test_the_shipped_truck_is_table_2() -> None:
    truck = oc.vehicle("scania_r730_4x2")
    assert (truck.wheelbase_m, truck.ratio_near_centre) == (3.7, 19.3)


def test_the_ratio_near_centre_is_the_inverse_slope_of_the_polynomial() -> None:
    truck = vehicle_from({**TRUCK, "steering_ratio": [0.0, 1 / 20, 0.0, 1e-4]}, "t.toml")
    assert math.isclose(truck.ratio_near_centre, 20.0)


def test_an_angle_among_the_params_may_be_given_in_degrees() -> None:
    truck = vehicle_from({**TRUCK, "params": {"offset_half_width_max_deg": 2.0}}, "t.toml")
    assert math.isclose(truck.params["offset_half_width_max_rad"], math.radians(2.0))


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"wheelbase_m": 0.0}, "wheelbase_m"),
        ({"wheelbase_m": -3.7}, "wheelbase_m"),
        ({"wheelbase_m": 100.0}, "wheelbase_m"),
        ({"wheelbase_m": math.nan}, "wheelbase_m"),
        ({"wheelbase_m": "long"}, "wheelbase_m"),
        ({"wheelbase_m": "3.7"}, "wheelbase_m"),
        ({"wheelbase_m": True}, "wheelbase_m"),
        ({"track_width_rear_m": "1.83"}, "track_width_rear_m"),
        ({"understeer_gradient_deg_m_s2": 1e9}, "understeer_gradient_deg_m_s2"),
        ({"sensors": {"yaw_rate_bias_deg_s": True}}, "sensors.yaw_rate_bias_deg_s"),
        ({"steering_ratio": 0.5}, "steering_ratio"),
        ({"steering_ratio": [1.0]}, "'steering_ratio' must be a number, or a polynomial of 2 to 8 terms"),
        ({"steering_ratio": [0.0, *[0.05] * 17]}, "'steering_ratio' must be a number, or a polynomial of 2 to 8 terms"),
        ({"steering_ratio": [math.nan, 0.05]}, "'steering_ratio' must be a finite number"),
        ({"steering_ratio": [0, 0.05, math.inf]}, "'steering_ratio' must be a finite number"),
        ({"steering_ratio": [0, 10**400]}, "'steering_ratio' must be a finite number"),
        ({"steering_ratio": True}, "'steering_ratio' must be a finite number"),
        ({"steering_ratio": "19.3"}, "'steering_ratio' must be a finite number"),
        ({"steering_ratio": [0, 0.05, 1e9]}, "'steering_ratio' must be a ratio of 1 to 60"),
        ({"steering_ratio": [0, 0.05, 0, -0.004]}, "'steering_ratio' must be a ratio of 1 to 60"),
        ({"steering_ratio": [1.0, 0.05]}, "'steering_ratio' must give front wheels within 2 deg"),
        ({"wheelbase": 3.7}, "wheelbase_m"),
        ({"params": {"bank_max": 0.5}}, "bank_max_m_s2"),
        ({"params": {"bank_max_m_s2": -1.0}}, "bank_max_m_s2"),
        ({"params": {"use_accelerometer": 2}}, "'use_accelerometer' must be 0 or 1, got 2"),
        ({"params": {"use_accelerometer": 0.5}}, "'use_accelerometer' must be 0 or 1, got 0.5"),
        ({"params": {"speed_min_m_s": True}}, "'speed_min_m_s' must be a finite number, got True"),
        ({"params": {"speed_min_m_s": "10"}}, "'speed_min_m_s' must be a finite number, got '10'"),
        (
            {"params": {"offset_half_width_max_deg": 1.5, "offset_half_width_max_rad": 0.02}},
            "'offset_half_width_max_deg' is also given as 'offset_half_width_max_rad'",
        ),
        ({"signals": {"yaw": {"name": "x"}}}, "yaw_rate"),
        ({"signals": {"yaw_rate": {"name": "x", "sign": 2}}}, "sign"),
        (
            {"signals": {"yaw_rate": {"nam": "x"}}},
            "'signals.yaw_rate.nam' is not a key of a vehicle file; did you mean name",
        ),
        ({"signals": {"yaw_rate": {"name": "x", "is": 1}}}, "the keys are name, unit, sign"),
        ({"traffic_side": "middle"}, "traffic_side"),
    ],
)
def test_a_wrong_value_is_refused_by_name_in_one_line(values: dict[str, object], named: str) -> None:
    with pytest.raises(oc.OncenterError) as refused:
        vehicle_from({**TRUCK, **values}, "t.toml")
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)
    assert (refused.value.code, refused.value.exit_code) == ("vehicle_file", WRONG_USAGE)


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"speed_min_m_s": -1}, "'speed_min_m_s' must be 1 to 40, got -1"),
        ({"offset_half_width_max_deg": 100}, "'offset_half_width_max_deg' must be 0.00573 to 57.3, got 100"),
        ({"delay_band_hz": 10}, "'delay_band_hz' must be below 'cutoff_hz', got 10"),
        ({"understeer_acceleration_max_m_s2": 0.1}, "at least 'understeer_acceleration_min_m_s2', got 0.1"),
    ],
)
def test_the_error_of_a_param_out_of_its_range_gives_the_range_in_the_given_unit(
    params: dict[str, float], message: str
) -> None:
    with pytest.raises(oc.OncenterError) as refused:
        vehicle_from({**TRUCK, "params": params}, "t.toml")
    assert message in str(refused.value)


def test_a_param_given_in_degrees_replaces_that_of_the_vehicle_in_rad() -> None:
    truck = vehicle_from({**TRUCK, "params": {"offset_half_width_max_rad": 0.02}}, "t.toml")
    used = core_params(truck.params, {"offset_half_width_max_deg": 3.0})
    assert math.isclose(used["offset_half_width_max_rad"], math.radians(3.0))


def test_false_switches_the_accelerometer_off() -> None:
    truck = vehicle_from({**TRUCK, "params": {"use_accelerometer": False}}, "t.toml")
    assert truck.params["use_accelerometer"] == 0.0


def test_a_file_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    (tmp_path / "truck.toml").write_text("wheelbase_m = 3.7\nsteering_ratio = 19\n", encoding="utf-8-sig")
    assert oc.vehicle(tmp_path / "truck.toml").ratio_near_centre == 19.0


def test_a_missing_value_is_named() -> None:
    with pytest.raises(oc.OncenterError, match=r"'signals\.yaw_rate\.name' is missing"):
        vehicle_from({"signals": {"yaw_rate": {}}}, "t.toml")


def test_a_file_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(oc.OncenterError, match=r"none\.toml cannot be read"):
        oc.vehicle(tmp_path / "none.toml")


def test_a_pipe_or_a_folder_is_not_a_vehicle_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(oc.OncenterError, match=r"pipe\.toml cannot be read: is a device or a pipe"):
        oc.vehicle(tmp_path / "pipe.toml")
    with pytest.raises(oc.OncenterError, match="cannot be read: is a directory"):
        oc.vehicle(tmp_path)


BOUNDED = [
    ("# " + "x" * (1 << 20), "larger than 1048576 bytes"),
    ("source = " + "[" * 5000, "deeper than 16 levels"),
    ("source = " + "{ a = " * 20 + "1" + " }" * 20, "deeper than 16 levels"),
    (".".join("a" * 100_000) + " = 1", "a key of more than 16 parts"),
    ("[" + ' . "b\\"."'.join("a" * 100) + "]", "is not TOML"),
    ("mass_kg = " + "9" * 5000, "is not TOML"),
    ("mass_kg = 0x" + "f" * 5000, "an integer of more than 63 bits"),
    ('name = "\\u001b[2J"', "a control character"),
    ("name = 1979-05-27T07:32:00+99:99", "is not TOML"),
]


@pytest.mark.parametrize(("says", "named"), BOUNDED)
def test_a_file_beyond_the_bounds_is_refused_in_one_short_line(tmp_path: Path, says: str, named: str) -> None:
    (tmp_path / "t.toml").write_text(f"{says}\nwheelbase_m = 3.7\nsteering_ratio = 19\n", encoding="utf-8")
    with pytest.raises(oc.OncenterError, match=named) as refused:
        oc.vehicle(tmp_path / "t.toml")
    assert refused.value.exit_code == WRONG_USAGE
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 1500


def test_the_error_of_a_cutoff_too_high_for_the_log_s_rate_gives_the_limit() -> None:
    truck = vehicle_from({**TRUCK, "params": {"cutoff_hz": 50.0}}, "t.toml")
    with pytest.raises(oc.OncenterError, match=r"'cutoff_hz' must be below 22.5 at a rate of 50 Hz, got 50") as refused:
        oc.offset(steady_drive(), truck)
    assert (refused.value.code, refused.value.exit_code) == ("params", WRONG_USAGE)


@given(st.binary(max_size=200))
def test_any_bytes_are_a_vehicle_or_one_clear_refusal(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    file = tmp_path_factory.mktemp("vehicle") / "any.toml"
    file.write_bytes(content)
    try:
        oc.vehicle(file)
    except oc.OncenterError as refused:
        assert "\n" not in str(refused)


@given(
    st.dictionaries(
        st.sampled_from(["wheelbase_m", "steering_ratio", "params", "signals", "mass_kg", "source", "x"]),
        st.recursive(
            st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
            lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=2),
            max_leaves=5,
        ),
    )
)
def test_any_values_are_a_vehicle_in_range_or_one_clear_refusal(values: dict[str, object]) -> None:
    try:
        truck = vehicle_from(values, "any.toml")
    except oc.OncenterError as refused:
        assert "\n" not in str(refused)
    else:
        assert 1 <= truck.wheelbase_m <= 20
        assert 1 <= truck.ratio_near_centre <= 60
        assert all(map(math.isfinite, polynomial_of(truck.steering_ratio)))
