"""`sign_by` and `plus` of `[signals]`: an angle whose sign is another signal, or that comes in two parts."""

from __future__ import annotations

from pathlib import Path

import cantools
import numpy as np
import polars as pl
import pytest
from drive_frames import START_S, Frame, candump
from real_data import real_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.read import read
from oncenter.signals import DEGREE, SignalName

ANGLE_DEG = np.array([-30.0, -1.5, 0.0, 0.3, 12.7, 400.0])
SPLIT = """VERSION ""
BU_: X
BO_ 37 WHEEL: 8 X
 SG_ Coarse : 0|16@1- (1.5,0) [0|0] "deg" X
 SG_ Fraction : 16|16@1- (0.001,0) [0|0] "rad" X
 SG_ Size : 32|16@1+ (0.1,0) [0|0] "Unit_DegreOfArc" X
 SG_ Right : 48|1@1+ (1,0) [0|1] "" X
BO_ 38 OTHER: 8 X
 SG_ Sign : 0|1@1+ (1,0) [0|1] "" X
"""


def log_of(folder: Path, message: str, values: list[dict[str, float]], database: Path) -> Path:
    """Each of the values for 30 frames of 100 Hz."""
    of = cantools.database.load_file(database, strict=False).get_message_by_name(message)  # type: ignore[union-attr]
    frames = []
    for k in range(30 * len(values)):
        data = bytes(of.encode(values[k // 30], padding=True, strict=False))
        frames.append(Frame(START_S + k / 100, of.frame_id, data, of.is_extended_frame))
    (folder / "drive.log").write_text(candump(frames))
    return folder / "drive.log"


def angles_deg(log: Path, entry: SignalName, dbc: list[Path]) -> list[float]:
    """The angle in the middle of each value."""
    drive = read(log, names={"steering_wheel_angle": entry}, dbc=dbc)
    return [float(value) for value in drive.columns["steering_wheel_angle_rad"][15::30] / DEGREE]


@pytest.fixture
def split(tmp_path: Path) -> Path:
    (tmp_path / "split.dbc").write_text(SPLIT)
    return tmp_path / "split.dbc"


def test_a_magnitude_is_negative_where_its_sign_signal_is_not_zero(tmp_path: Path, split: Path) -> None:
    values = [
        {"Coarse": 0, "Fraction": 0, "Size": abs(angle), "Right": float(angle < 0)} for angle in ANGLE_DEG.tolist()
    ]
    log = log_of(tmp_path, "WHEEL", values, split)
    entry = SignalName("WHEEL.Size", "deg", sign_by="WHEEL.Right")
    assert angles_deg(log, entry, [split]) == pytest.approx(ANGLE_DEG, abs=1e-9)
    reverse = SignalName("WHEEL.Size", "deg", sign=-1, sign_by="Right")
    assert angles_deg(log, reverse, [split]) == pytest.approx(-ANGLE_DEG, abs=1e-9)


def test_a_source_says_which_bits_of_which_database_it_is(tmp_path: Path, split: Path) -> None:
    log = log_of(tmp_path, "WHEEL", [{"Coarse": 0, "Fraction": 0, "Size": 1, "Right": 0}], split)
    entry = SignalName("WHEEL.Size", "deg", sign_by="WHEEL.Right")
    source = read(log, names={"steering_wheel_angle": entry}, dbc=[split]).sources["steering_wheel_angle"]
    assert source.place == "WHEEL.Size 32|16@1+, WHEEL.Right 48|1@1+ of split.dbc"


def test_an_angle_in_two_parts_is_their_sum_each_in_its_unit(tmp_path: Path, split: Path) -> None:
    coarse = 1.5 * np.round(ANGLE_DEG / 1.5)
    fraction = np.round((ANGLE_DEG - coarse) * DEGREE, 3)
    values = [
        {"Coarse": one, "Fraction": other, "Size": 0, "Right": 0}
        for one, other in zip(coarse.tolist(), fraction.tolist(), strict=True)
    ]
    log = log_of(tmp_path, "WHEEL", values, split)
    whole = coarse + fraction / DEGREE
    assert angles_deg(log, SignalName("WHEEL.Coarse", plus="WHEEL.Fraction"), [split]) == pytest.approx(whole)
    reverse = SignalName("WHEEL.Coarse", sign=-1, plus="WHEEL.Fraction")
    assert angles_deg(log, reverse, [split]) == pytest.approx(-whole)


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        (SignalName("WHEEL.Size", "deg", sign_by="WHEEL.Port"), "sign_by = 'WHEEL.Port'"),
        (SignalName("WHEEL.Size", "deg", sign_by="OTHER.Sign"), "does not exist in message WHEEL"),
        (SignalName("WHEEL.Coarse", plus="Fractoin"), "did you mean WHEEL.Fraction"),
    ],
)
def test_a_missing_part_is_named_and_no_value_is_given(
    entry: SignalName, said: str, tmp_path: Path, split: Path
) -> None:
    log = log_of(tmp_path, "WHEEL", [{"Coarse": 0, "Fraction": 0, "Size": 1, "Right": 0}], split)
    with pytest.raises(OncenterError) as refused:
        angles_deg(log, entry, [split])
    assert (refused.value.code, refused.value.exit_code) == ("missing_part", 2)
    assert "steering_wheel_angle" in str(refused.value)
    assert said in str(refused.value)


def tables(folder: Path) -> dict[str, Path]:
    """One drive as CSV, Parquet and MF4, with a magnitude, a sign and a fraction."""
    from asammdf import MDF, Signal

    time = np.arange(600) / 100
    angle = 20.0 * np.sin(time)
    coarse = np.trunc(np.abs(angle))
    columns = {"size": coarse, "right": (angle < 0).astype(float), "rest_deg": np.abs(angle) - coarse}
    table = pl.DataFrame({"time_s": time, "yaw_rate_deg_s": angle, **columns})
    table.write_csv(folder / "drive.csv")
    table.write_parquet(folder / "drive.parquet")
    with MDF() as mdf:
        units = {"size": "deg", "rest_deg": "deg"}
        mdf.append([Signal(values, time, name=name, unit=units.get(name, "")) for name, values in columns.items()])
        mdf.save(folder / "drive.mf4")
    return {name: folder / f"drive.{name}" for name in ("csv", "parquet", "mf4")}


def test_columns_and_channels_have_parts_as_databases_have(tmp_path: Path) -> None:
    entry = SignalName("size", "deg", sign_by="right", plus="rest_deg")
    for name, log in tables(tmp_path).items():
        drive = read(log, names={"steering_wheel_angle": entry})
        time = drive.columns["time_s"] - drive.columns["time_s"][0]
        assert drive.columns["steering_wheel_angle_rad"] / DEGREE == pytest.approx(20.0 * np.sin(time), abs=1e-5), name
        with pytest.raises(OncenterError, match="sign_by = 'rihgt' does not exist") as refused:
            read(log, names={"steering_wheel_angle": SignalName("size", "deg", sign_by="rihgt")})
        assert refused.value.code == "missing_part", name
    frame = oc.from_dataframe(
        pl.read_parquet(tmp_path / "drive.parquet"),
        oc.vehicle(_vehicle_file(tmp_path, 'name = "size", unit = "deg", sign_by = "right", plus = "rest_deg"')),
    )
    assert frame.columns["steering_wheel_angle_rad"].min() == pytest.approx(-20.0 * DEGREE, abs=1e-3)


def _vehicle_file(folder: Path, entry: str) -> Path:
    path = folder / "truck.toml"
    path.write_text(f"wheelbase_m = 3.7\nsteering_ratio = 19.3\n[signals]\nsteering_wheel_angle = {{ {entry} }}\n")
    return path


@pytest.mark.parametrize(
    ("file", "message", "magnitude", "sign", "fraction"),
    [
        ("vw_mqb.dbc", "LWI_01", "LWI_Lenkradwinkel", "LWI_VZ_Lenkradwinkel", None),
        ("toyota_prius_2010_pt.dbc", "STEER_ANGLE_SENSOR", "STEER_ANGLE", None, "STEER_FRACTION"),
    ],
)
def test_the_angle_of_public_networks_is_proposed_and_read_with_its_parts(
    file: str, message: str, magnitude: str, sign: str | None, fraction: str | None, tmp_path: Path
) -> None:
    database, truck = real_drive(f"opendbc/{file}"), tmp_path / "truck.toml"
    numbers = ["--wheelbase-m", "2.7", "--steering-ratio", "15"]
    assert run(["vehicle", "new", str(truck), *numbers, "--dbc", str(database)]) == 0
    entry = oc.vehicle(truck).signal_names["steering_wheel_angle"]
    assert entry.name == f"{message}.{magnitude}"
    assert entry.sign_by == (sign and f"{message}.{sign}")
    assert entry.plus == (fraction and f"{message}.{fraction}")
    of = cantools.database.load_file(database, strict=False).get_message_by_name(message)  # type: ignore[union-attr]
    silent = {each.name: each.raw_initial or 0 for each in of.signals}
    values = [{**silent, magnitude: 30.0, **({sign: 1} if sign else {}), **({fraction: 0.4} if fraction else {})}]
    log = log_of(tmp_path, message, values, database)
    (angle,) = angles_deg(log, entry, [database])
    assert angle == pytest.approx(-30.0 if sign else 30.4)
