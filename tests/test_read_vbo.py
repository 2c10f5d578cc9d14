"""Racelogic's `.vbo` as its loggers and other programs write it."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from oncenter import OncenterError, read
from oncenter.signals import DEGREE, STANDARD_GRAVITY, SignalName

HEADER = {
    **{"sats": "satellites", "time": "time", "lat": "latitude", "long": "longitude", "velocity": "velocity kmh"},
    **{"heading": "heading", "height": "height", "vert-vel": "vertical velocity kmh", "avitime": "avisynctime"},
}
ROWS = 60
CHANNELS = {  # by column; a bend to the right, driven to the south-east
    "sats": "012",
    "lat": lambda t: f"{3119.1 - 0.0002 * t:+.8f}",
    "long": lambda t: f"{-58.5 - 0.0003 * t:+.8f}",
    "velocity": lambda t: f"{50 + t:07.3f}",
    "heading": lambda t: f"{120 + t:06.2f}",
    "height": "+0152.58",
    "Steering_Angle": lambda t: f"{-20 - t:+.6E}",
    "YawRate": lambda t: f"{1 + t / 10:+.6E}",
    "Yaw_Rate": lambda t: f"{1.5 + t / 10:+.6E}",
    "X_Accel": "+1.0E-02",
    "Y_Accel": lambda t: f"{-0.04 - t / 1000:+.6E}",
}


def vbo(folder: Path, columns: str, units: tuple[str, ...] = (), *, names: bool = True, **channels: object) -> Path:
    """A file with these columns of `CHANNELS`, or of `channels`."""
    titles = [HEADER.get(name, name) for name in columns.split()]
    rows = []
    for tick in range(ROWS):
        t = tick / 10
        given = {**CHANNELS, "time": f"1200{t:06.3f}", **channels}
        cells = (given[name] for name in columns.split())
        rows.append(" ".join(cell(t) if callable(cell) else str(cell) for cell in cells))
    listed = ["[column names]", columns, ""] if names else []
    lines = ["File created on 15/06/2016 at 12:00:00", "", "[header]", *titles, "", "[channel units]", *units, ""]
    text = "\r\n".join([*lines, "[comments]", "(c) Racelogic", "", *listed, "[data]", *rows, ""])
    (folder / "x.vbo").write_bytes(text.encode("latin-1"))
    return folder / "x.vbo"


def by_pandas(log: Path) -> pd.DataFrame:
    head, body = log.read_text("latin-1").split("[data]\n")
    columns = head.split("[column names]\n")[1].split("\n")[0].split()
    return pd.read_csv(io.StringIO(body), sep=" ", names=columns)


def test_of_two_yaw_rates_the_one_beside_the_accelerometers_is_the_imu_s(tmp_path: Path) -> None:
    for columns in ("YawRate X_Accel Y_Accel Slip Yaw_Rate", "Yaw_Rate Slip YawRate X_Accel Y_Accel"):
        log = vbo(tmp_path, f"sats time lat long velocity heading Steering_Angle {columns}", Slip="+0.1")
        signals, table = read(log), by_pandas(log)
        assert signals.sources["yaw_rate"].description == "column YawRate"
        assert np.allclose(signals.columns["yaw_rate_rad_s"][::10], -table["YawRate"][::5] * DEGREE, atol=1e-6)


def test_two_yaw_rates_that_cannot_be_distinguished_have_to_agree(tmp_path: Path) -> None:
    columns = "sats time velocity Steering_Angle Yaw_Rate YawRate height Y_Accel"
    with pytest.raises(OncenterError, match='or "yaw_rate=column YawRate"') as refused:
        read(vbo(tmp_path, columns))
    assert refused.value.code == "sources_disagree"
    assert read(vbo(tmp_path, columns), take={"yaw_rate": "column Yaw_Rate"}).sources["yaw_rate"].others
    same = read(vbo(tmp_path, columns, Yaw_Rate=CHANNELS["YawRate"]))
    assert same.sources["yaw_rate"].others == ("column YawRate",)


def test_a_source_is_a_column_of_the_file(tmp_path: Path) -> None:
    columns = "sats time lat long velocity heading Steering_Angle Yaw_Rate Y_Accel"
    sources = read(vbo(tmp_path, columns)).sources
    assert {source.description.removeprefix("column ") for source in sources.values()} <= set(columns.split())


@pytest.mark.parametrize(
    ("columns", "units"),
    [
        ("sats time velocity Steering_Angle Yaw_Rate Y_Accel", ("rad", "rad/s", "m/s^2")),
        ("sats time velocity Tsample2 RPM Steering_Angle Yaw_Rate Y_Accel", ("rad", "rad/s", "m/s^2")),  # the last
        ("sats time velocity Steering_Angle Yaw_Rate Y_Accel RPM", ("rad", "rad/s", "m/s^2", "")),
        ("sats time velocity Steering_Angle Yaw_Rate Y_Accel", ("rad", "rad/s", "m/s^2", "", "", "")),
        ("sats time velocity Steering_Angle Yaw_Rate Y_Accel", ("(null)", "s", "kmh", "rad", "rad/s", "m/s^2")),
        ("sats time velocity avitime Steering_Angle Yaw_Rate Y_Accel", ("s", "rad", "rad/s", "m/s^2")),
        ("sats time velocity Steering_Angle Yaw_Rate Y_Accel", ("steering rad", "yaw rad/s", "acceleration m/s^2")),
    ],
)
def test_units_belong_to_the_channels_that_they_fit(columns: str, units: tuple[str, ...], tmp_path: Path) -> None:
    log = vbo(tmp_path, columns, units, Tsample2="0.1", RPM="+1.2E+03", avitime="0001")
    found, table = read(log).columns, by_pandas(log)
    assert np.allclose(found["steering_wheel_angle_rad"][::10], table["Steering_Angle"][::5], atol=1e-6)
    assert np.allclose(found["yaw_rate_rad_s"][::10], -table["Yaw_Rate"][::5], atol=1e-6)
    assert np.allclose(found["lateral_acceleration_m_s2"][::10], table["Y_Accel"][::5], atol=1e-6)


def test_a_title_of_the_header_gives_a_unit_and_in_place_of_missing_column_names_the_name(tmp_path: Path) -> None:
    log = vbo(tmp_path, "sats time lat long velocity heading Steering_Angle Y_Accel", names=False)
    text = log.read_text("latin-1").replace("\nSteering_Angle\n", "\nsteering angle rad\n").replace("kmh", "mph")
    log.write_text(text, "latin-1")
    signals = read(log)
    assert signals.columns["steering_wheel_angle_rad"][0] == pytest.approx(-20.0)
    assert signals.columns["vehicle_speed_m_s"][0] == pytest.approx(50 * 0.44704)
    assert signals.sources["vehicle_speed"].description == "column velocity mph"
    assert signals.columns["latitude_deg"][0] == pytest.approx(3119.1 / 60)


def test_positions_in_degrees_are_read_and_the_course_gives_the_side_of_the_longitude(tmp_path: Path) -> None:
    columns = "time lat long velocity heading Steering_Angle"  # no satellites either
    north = {"lat": lambda t: f"{51.985 - 2e-6 * t:.9f}"}
    for sign in (1, -1):
        found = read(vbo(tmp_path, columns, long=lambda t, s=sign: f"{s * (0.975 + 5e-6 * t):.9f}", **north)).columns
        assert found["latitude_deg"][0] == pytest.approx(51.985)
        assert found["longitude_deg"][0] == pytest.approx(0.975)  # the course is to the east
    west = read(vbo(tmp_path, columns, long=lambda t: f"{58.5 - 0.0003 * t:.8f}")).columns
    assert west["longitude_deg"][0] == pytest.approx(-58.5 / 60)


def test_rows_may_have_tabs_decimal_commas_and_times_with_colons(tmp_path: Path) -> None:
    columns = "sats time lat long velocity heading Steering_Angle"
    plain = read(vbo(tmp_path, columns)).columns
    log = vbo(tmp_path, columns)
    head, body = log.read_bytes().split(b"[data]")
    body = body.replace(b" ", b"\t  ").replace(b".", b",").replace(b"\t  1200", b"\t12:00:").replace(b"\r\n", b" \n\n")
    log.write_bytes(head + b"[DATA]" + body)
    found = read(log).columns
    assert found.keys() == plain.keys()
    assert all(np.array_equal(found[name], plain[name]) for name in plain)


def test_a_column_that_is_there_twice_is_refused_only_where_it_is_used(tmp_path: Path) -> None:
    log = vbo(tmp_path, "sats time velocity Steering_Angle Temp Temp Temp", Temp="+1.0")
    assert set(read(log).sources) == {"vehicle_speed", "steering_wheel_angle"}
    with pytest.raises(OncenterError, match=r"two columns of x.vbo are called Temp"):
        read(log, names={"yaw_rate": SignalName("Temp", "deg/s")})


def test_the_day_may_be_written_in_iso_form(tmp_path: Path) -> None:
    log = vbo(tmp_path, "sats time velocity Steering_Angle Y_Accel")
    log.write_bytes(log.read_bytes().replace(b"15/06/2016 at", b"2016-06-15 @"))
    signals = read(log)
    assert signals.columns["time_s"][0] == 1465992000.0  # 2016-06-15T12:00:00Z
    assert signals.columns["lateral_acceleration_m_s2"][0] == pytest.approx(-0.04 * STANDARD_GRAVITY)
