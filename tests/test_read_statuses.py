"""Statuses of any network: `true_when` of `[signals]`, by the numbers of a log or the names of a database."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from drive_frames import START_S, Frame, candump

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.read import read
from oncenter.signals import SignalName, Signals

DBC = """VERSION ""
BU_: X
BO_ 291 GEARBOX: 8 X
 SG_ Lever : 0|4@1+ (1,0) [0|15] "" X
 SG_ Speed : 8|16@1+ (0.01,0) [0|300] "km/h" X
 SG_ Lift : 24|2@1+ (1,0) [0|3] "" X
VAL_ 291 Lever 0 "P" 1 "R" 2 "N" 3 "D" 15 "SNA" ;
"""
SPEED = SignalName("Speed", "km/h")
LEVERS = np.repeat([0, 1, 2, 3, 1, 15], 50)


def by_database(folder: Path, **entries: SignalName) -> Signals:
    """Fifty frames at each lever; the lift axle is 0, 1, 2 and 3 in turn, for ten frames each."""
    (folder / "truck.dbc").write_text(DBC)
    lift = np.arange(len(LEVERS)) // 10 % 4
    frames = [
        Frame(START_S + k / 100, 0x123, bytes([lever, 0x10, 0x27, lift[k], 0, 0, 0, 0]), extended=False)
        for k, lever in enumerate(LEVERS.tolist())
    ]
    (folder / "drive.log").write_text(candump(frames))
    return read(folder / "drive.log", names={"vehicle_speed": SPEED, **entries}, dbc=[folder / "truck.dbc"])


def by_table(folder: Path, **entries: SignalName) -> Signals:
    rows = [f"{k / 100},36.0,{lever}" for k, lever in enumerate(LEVERS.tolist())]
    (folder / "drive.csv").write_text("\n".join(["time_s,vehicle_speed_km_h,lever", *rows]))
    return read(folder / "drive.csv", names=entries)


@pytest.mark.parametrize("true_when", [("R",), (1,), (1.0, "R")])
def test_a_status_is_true_at_the_values_of_the_database_that_the_vehicle_file_names(
    tmp_path: Path, true_when: tuple[float | str, ...]
) -> None:
    signals = by_database(tmp_path, reverse=SignalName("GEARBOX.Lever", true_when=true_when))
    found = signals.columns["reverse"]
    assert np.array_equal(found[LEVERS != 15], (LEVERS == 1).astype(float)[LEVERS != 15])
    assert np.isnan(found[LEVERS == 15]).all()  # the database names it SNA


def test_a_status_is_true_at_the_numbers_of_a_table(tmp_path: Path) -> None:
    signals = by_table(tmp_path, reverse=SignalName("lever", true_when=(1, 15)))
    assert np.array_equal(signals.columns["reverse"], np.isin(LEVERS, (1, 15)).astype(float))


@pytest.mark.parametrize(
    ("read_by", "name", "codes"),
    [(by_database, "GEARBOX.Lift", np.arange(len(LEVERS)) // 10 % 4), (by_table, "lever", LEVERS)],
)
def test_without_values_one_is_true_zero_is_false_and_other_codes_are_unknown(
    tmp_path: Path, read_by: Callable[..., Signals], name: str, codes: npt.NDArray[np.int64]
) -> None:
    signals = read_by(tmp_path, axle_lifted=SignalName(name))
    expected = np.where(codes < 2, codes, np.nan)
    inner = np.zeros(len(codes), bool)  # a frame beside a code may stand for it
    inner[2:-2] = (codes[2:-2] == codes[4:]) & (codes[2:-2] == codes[:-4])
    assert np.array_equal(signals.columns["axle_lifted"][inner], expected[inner], equal_nan=True)
    assert signals.account is not None
    assert signals.account.signals["axle_lifted"].left_out["not_available"] == np.count_nonzero(codes > 1)


def test_a_column_with_the_name_of_a_status_needs_no_entry(tmp_path: Path) -> None:
    rows = [f"{k / 100},36.0,{int(k > 100)}" for k in range(300)]
    (tmp_path / "drive.csv").write_text("\n".join(["time_s,vehicle_speed_km_h,anti_lock_active", *rows]))
    assert np.array_equal(read(tmp_path / "drive.csv").columns["anti_lock_active"], np.arange(300) > 100)


def test_a_value_that_the_database_does_not_name_is_refused_with_the_names(tmp_path: Path) -> None:
    with pytest.raises(OncenterError, match=r"true_when = 'Reverse' is not the name of a value of") as no:
        by_database(tmp_path, reverse=SignalName("GEARBOX.Lever", true_when=("Reverse",)))
    assert "its names are 'P', 'R', 'N', 'D', 'SNA'" in str(no.value)
    assert (no.value.code, no.value.exit_code) == ("missing_part", 2)


@pytest.mark.parametrize("value", [1.5, 16, -1])
def test_a_number_that_the_signal_cannot_have_is_refused(tmp_path: Path, value: float) -> None:
    with pytest.raises(OncenterError, match=rf"true_when = {value} is no value that GEARBOX\.Lever can have"):
        by_database(tmp_path, reverse=SignalName("GEARBOX.Lever", true_when=(value,)))


def test_a_number_with_a_fraction_is_found_as_it_is_written(tmp_path: Path) -> None:
    frames = [Frame(START_S + k / 100, 0x123, bytes([3, *bytes(7)]), extended=False) for k in range(300)]
    (tmp_path / "drive.log").write_text(candump(frames))
    (tmp_path / "truck.dbc").write_text(DBC.replace("Lever : 0|4@1+ (1,0)", "Lever : 0|4@1+ (0.1,0)"))
    names = {"vehicle_speed": SPEED, "reverse": SignalName("GEARBOX.Lever", true_when=(0.3,))}
    assert np.all(read(tmp_path / "drive.log", names=names, dbc=[tmp_path / "truck.dbc"]).columns["reverse"] == 1.0)


def test_a_name_is_refused_where_no_database_gives_it(tmp_path: Path) -> None:
    with pytest.raises(OncenterError, match=r"of column lever of drive\.csv: give its number"):
        by_table(tmp_path, reverse=SignalName("lever", true_when=("R",)))


def test_a_vehicle_file_names_a_status_and_its_check_says_when_it_is_true(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "truck.toml"
    entry = 'reverse = { name = "GEARBOX.Lever", true_when = [1, "R"] }'
    file.write_text(f"wheelbase_m = 3.7\nsteering_ratio = 19.3\n[signals]\n{entry}\n")
    assert oc.vehicle(file).signal_names["reverse"].true_when == (1.0, "R")
    assert run(["vehicle", "check", str(file)]) == 0
    assert "signals.reverse = GEARBOX.Lever, true when 1 or R" in capsys.readouterr().out


def test_only_a_status_has_values_at_which_it_is_true(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "truck.toml"
    file.write_text('wheelbase_m = 3.7\nsteering_ratio = 19.3\n[signals]\nyaw_rate = { name = "Y", true_when = [1] }\n')
    assert run(["vehicle", "check", str(file)]) == 2
    assert "'yaw_rate' has no 'true_when'" in capsys.readouterr().err


@pytest.mark.parametrize("written", ["[]", "1"])
def test_values_that_are_no_list_are_refused_with_an_example(tmp_path: Path, written: str) -> None:
    file = tmp_path / "truck.toml"
    file.write_text(f'[signals]\nreverse = {{ name = "R", true_when = {written} }}\n')
    with pytest.raises(OncenterError, match=r"true_when' must be a list of values, such as \[1, 2\]"):
        oc.vehicle(file)
