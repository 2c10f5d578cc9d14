"""The maker of logs with a fault of the file: each has the fault that its name says, and no other."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import get_args

import cantools
import numpy as np
import polars as pl
import pytest
from cantools.database.can import Database
from faulty_logs import FAULTS, Given, Kind, of_column, of_table, two_trucks
from healthy_drive import ANGLE, LATERAL, SPEED, WHEELS, YAW_RATE, Array, HealthyDrive, healthy_drive
from own_network import CHASSIS, FIELDS, dbc

from oncenter.signals import DEGREE

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

from file_faults import KIND_WORDS, says_kind
from said import Statement

OF_TABLES = [name for name, row in FAULTS.items() if getattr(row.make, "func", None) in (of_column, of_table)]
OF_BITS = ("angle_byte_order", "yaw_rate_byte_order", "angle_one_bit_off", "angle_unsigned", "yaw_rate_other_bits")
OF_RANGES = ("angle_placeholder_range", "yaw_rate_placeholder_range", "lateral_placeholder_range")


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> HealthyDrive:
    """Three minutes with wheel speeds."""
    return healthy_drive(6, tmp_path_factory.mktemp("healthy"), minutes=3.0)


def made(name: str, drive: HealthyDrive, folder: Path) -> Given:
    return FAULTS[name].given(drive, folder)


def table(given: Given) -> dict[str, Array]:
    read = pl.read_parquet(given.arguments[0])
    return {name: read[name].to_numpy() for name in read.columns}


def frames(log: str) -> list[tuple[float, int, bytes]]:
    """Time, identifier and payload of each line."""
    lines = [line.split() for line in Path(log).read_text().splitlines()]
    split = [(stamp, *frame.split("#")) for stamp, _, frame in lines]
    return [(float(stamp.strip("()")), int(identifier, 16), bytes.fromhex(data)) for stamp, identifier, data in split]


def decoded(given: Given, text: str) -> dict[str, Array]:
    """CHASSIS by column, SI, with that database; each signal alone, since cantools refuses two with common bits."""
    payloads = [data for _, identifier, data in frames(given.arguments[0]) if identifier == CHASSIS][::10]
    columns = {}
    for column, (name, layout, _, bit) in FIELDS.items():
        lines = [line for line in text.splitlines() if " SG_ " not in line or f" {name} " in line]
        database = cantools.database.load_string("\n".join(lines), "dbc")
        assert isinstance(database, Database)
        si = bit / float(layout.split("(")[1].split(",")[0])
        rows = [database.decode_message(CHASSIS, data) for data in payloads]
        columns[column] = np.array([row[name] for row in rows], float) * si  # type: ignore[index, call-overload]
    return columns


def test_the_bench_has_words_for_every_kind() -> None:
    assert set(KIND_WORDS) == set(get_args(Kind)) == {row.kind for row in FAULTS.values()}


@pytest.mark.parametrize("name", OF_TABLES)
def test_a_fault_of_a_table_changes_one_column(name: str, drive: HealthyDrive, tmp_path: Path) -> None:
    given = made(name, drive, tmp_path)
    columns = table(given)
    changed = {name for name, values in drive.columns.items() if not np.array_equal(values, columns[name])}
    assert changed == {FAULTS[name].column}
    assert given.offsets_deg == (drive.offset_deg,)


@pytest.mark.parametrize(
    ("name", "share", "values"),
    [
        ("angle_zero_every_second_row", 0.5, (0.0,)),
        ("yaw_rate_zero_every_second_row", 0.5, (0.0,)),
        ("lateral_zero_every_second_row", 0.5, (0.0,)),
        ("angle_zero_at_random", 0.1, (0.0,)),
        ("yaw_rate_zero_at_random", 0.1, (0.0,)),
        ("speed_zero_at_random", 0.1, (0.0,)),
        ("angle_sentinel_at_random", 0.1, (-1.0, 327.67, 655.35)),
        ("yaw_rate_sentinel_at_random", 0.1, (-1.0, 327.67, 655.35)),
    ],
)
def test_one_value_fills_that_share_of_the_rows(
    name: str, share: float, values: tuple[float, ...], drive: HealthyDrive, tmp_path: Path
) -> None:
    column = FAULTS[name].column
    moves = drive.columns[SPEED] > 1.0
    healthy = drive.columns[column][moves]
    filled = table(made(name, drive, tmp_path))[column][moves]
    filler = np.unique(filled[filled != healthy]) / DEGREE
    assert len(filler) == 1 and any(filler[0] == pytest.approx(value) for value in values)
    has_it_anyway = np.mean(np.isclose(healthy / DEGREE, filler[0]))
    assert np.mean(filled != healthy) == pytest.approx(share * (1.0 - has_it_anyway), abs=0.02)


@pytest.mark.parametrize("name", ["angle_magnitude", "yaw_rate_magnitude", "lateral_magnitude"])
def test_a_magnitude_has_no_sign(name: str, drive: HealthyDrive, tmp_path: Path) -> None:
    column = FAULTS[name].column
    assert drive.columns[column].min() < 0.0 <= table(made(name, drive, tmp_path))[column].min()


@pytest.mark.parametrize("name", ["angle_late", "yaw_rate_late"])
def test_a_late_signal_is_the_same_up_to_a_second_later(name: str, drive: HealthyDrive, tmp_path: Path) -> None:
    column = FAULTS[name].column
    healthy, late = drive.columns[column], table(made(name, drive, tmp_path))[column]
    errors = [np.mean(np.abs(late[200:] - np.roll(healthy, by)[200:])) for by in range(0, 150)]
    assert 29 <= int(np.argmin(errors)) <= 101


@pytest.mark.parametrize("name", ["angle_stuck", "yaw_rate_stuck", "speed_stuck"])
def test_a_stuck_signal_keeps_its_last_value(name: str, drive: HealthyDrive, tmp_path: Path) -> None:
    column = FAULTS[name].column
    values = table(made(name, drive, tmp_path))[column]
    begin = int(np.argmax(values != drive.columns[column]))
    assert 0.3 <= begin / len(values) <= 0.75
    assert len(np.unique(values[begin:])) == 1


def test_a_wrapped_angle_counts_from_zero_to_a_turn(drive: HealthyDrive, tmp_path: Path) -> None:
    wrapped = table(made("angle_wrapped", drive, tmp_path))[ANGLE]
    assert wrapped.min() >= 0.0 and wrapped.max() < 2.0 * np.pi
    assert np.sin(wrapped) == pytest.approx(np.sin(drive.columns[ANGLE]))


def test_an_angle_a_turn_off_is_360_deg_more_or_less(drive: HealthyDrive, tmp_path: Path) -> None:
    more = table(made("angle_a_turn_off", drive, tmp_path))[ANGLE] - drive.columns[ANGLE]
    assert np.abs(more) == pytest.approx(2.0 * np.pi)


@pytest.mark.parametrize("name", ["speed_dead_zone", "speed_whole_km_h"])
def test_a_creeping_truck_turns_while_its_speed_reads_zero(name: str, drive: HealthyDrive, tmp_path: Path) -> None:
    columns = table(made(name, drive, tmp_path))
    creeps = columns["time_s"] < columns["time_s"][0] + 45.0
    assert not columns[SPEED][creeps].any() and not columns[WHEELS[2]][creeps].any()
    turns = columns[YAW_RATE][creeps] - drive.truth.yaw_rate_bias_rad_s
    assert 0.4 < abs(np.mean(turns)) / DEGREE < 1.0
    assert (np.diff(columns["time_s"]) > 0.0).all()


@pytest.mark.parametrize("name", OF_BITS)
def test_only_the_bits_of_one_signal_are_wrong(name: str, drive: HealthyDrive, tmp_path: Path) -> None:
    given = made(name, drive, tmp_path)
    right = decoded(given, dbc())
    as_described = decoded(given, (tmp_path / "network.dbc").read_text())
    for column in FIELDS:
        assert right[column] == pytest.approx(drive.columns[column][::10], abs=0.002)
        assert (column == FAULTS[name].column) != np.allclose(right[column], as_described[column])


@pytest.mark.parametrize("name", OF_RANGES)
def test_a_range_leaves_the_bits_right(name: str, drive: HealthyDrive, tmp_path: Path) -> None:
    given = made(name, drive, tmp_path)
    text = (tmp_path / "network.dbc").read_text()
    signal = FIELDS[FAULTS[name].column][0]
    ranged = [line.split()[1] for line in text.splitlines() if "SG_" in line and "[0|0]" not in line]
    assert ranged == [signal]
    assert decoded(given, text)[FAULTS[name].column] == pytest.approx(
        drive.columns[FAULTS[name].column][::10], abs=0.002
    )


def test_a_clock_is_set_back_once(drive: HealthyDrive, tmp_path: Path) -> None:
    time = [stamp for stamp, _, _ in frames(made("clock_set_back", drive, tmp_path).arguments[0])]
    assert int(np.sum(np.diff(time) < -1.0)) == 1


def test_frames_of_a_burst_have_one_time(drive: HealthyDrive, tmp_path: Path) -> None:
    time = [stamp for stamp, _, _ in frames(made("stamps_in_bursts", drive, tmp_path).arguments[0])]
    steps = np.diff(time)
    assert set(np.round(steps[steps > 0.0], 3)) <= {0.05, 0.1} and np.mean(steps == 0.0) > 0.8


def test_a_second_sender_has_another_angle_and_the_same_rest(drive: HealthyDrive, tmp_path: Path) -> None:
    given = made("two_senders", drive, tmp_path)
    vdc2 = [frame for frame in frames(given.arguments[0]) if frame[1] >> 8 & 0xFFFF == 0xF009]
    first = [data for _, identifier, data in vdc2 if identifier & 0xFF == 0x3E]
    second = [data for _, identifier, data in vdc2 if identifier & 0xFF != 0x3E]
    more = [
        int.from_bytes(b[:2], "little") - int.from_bytes(a[:2], "little") for a, b in zip(first, second, strict=True)
    ]
    assert abs(np.unique(more).item()) / 1024 / DEGREE == pytest.approx(0.8, abs=0.05)
    assert {a[2:] == b[2:] for a, b in zip(first, second, strict=True)} == {True}
    assert given.offsets_deg == ()


def test_only_vdc2_is_marked_can_fd(drive: HealthyDrive, tmp_path: Path) -> None:
    from asammdf import MDF

    with MDF(made("can_fd", drive, tmp_path).arguments[0]) as log:
        identifier, marked = (log.get(f"CAN_DataFrame.{name}").samples for name in ("ID", "EDL"))
    assert ((identifier >> 8 & 0xFFFF == 0xF009) == (marked == 1)).all() and marked.any()


@pytest.mark.parametrize("seed", range(6))
def test_two_trucks_have_two_vins(seed: int, drive: HealthyDrive, tmp_path: Path) -> None:
    """Whatever the dialect."""
    given = two_trucks(drive, np.random.default_rng(seed), tmp_path)
    for log, vin in zip(given.arguments[:2], ("YS2R4X20001234567", "YS2R4X20007654321"), strict=True):
        data = Path(log).read_bytes()
        text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8")
        assert vin in text.splitlines()[-1]
    assert given.offsets_deg == ()


def test_the_truth_lies_beside_the_log(drive: HealthyDrive, tmp_path: Path) -> None:
    log, truth, *_ = made("truth_as_log", drive, tmp_path).arguments
    assert table(Given((log,), ())).keys() == drive.columns.keys()
    assert "place_in_play" in pl.read_parquet_schema(truth)


@pytest.mark.parametrize(
    ("text", "is_advice"),
    [
        ("Repair: the sensor jumped.", True),
        ("Check that it turns with the column; replace it if it does.", True),
        ("The sign is reversed or the sensor was remounted.", True),
        ("Signal or sensor: check both, first the byte order. No repair is advised.", False),
        ("Do not replace anything before the file is right.", False),
        ("Check the signal.", False),
    ],
)
def test_advice_to_repair_is_recognised(text: str, is_advice: bool) -> None:
    assert Statement("error", "", text).is_repair == is_advice


@pytest.mark.parametrize(
    ("name", "text", "is_named"),
    [
        ("angle_zero_at_random", "10 % of the steering wheel angle are zeros between normal samples", True),
        ("angle_zero_at_random", "10 % of the yaw rate are zeros between normal samples", False),
        ("angle_sign", "signal or sensor: check both, first the sign of the steering wheel angle", True),
        ("angle_magnitude", "signal or sensor: check the steering wheel angle", False),
        ("yaw_rate_sign", "the sign of the steering wheel angle is reversed: it agrees with the yaw rate", False),
        ("lateral_placeholder_range", "12 % of the lateral acceleration are beyond the range of the database", True),
        ("two_trucks", "the logs are of two trucks, by their VIN", True),
        ("truth_as_log", "between /logs/drive.parquet and /logs/drive.truth.parquet the offset changed", False),
        ("angle_doubled", "the steering wheel angle jumped. Then drive again", False),
    ],
)
def test_a_kind_is_named_by_its_words_and_its_signal(name: str, text: str, is_named: bool) -> None:
    assert says_kind(FAULTS[name], Statement("error", "", text)) == is_named


def test_lateral_acceleration_is_not_longitudinal(drive: HealthyDrive) -> None:
    """Else the exchanged signal would be the same."""
    assert not np.allclose(drive.columns[LATERAL], drive.columns["longitudinal_acceleration_m_s2"])
