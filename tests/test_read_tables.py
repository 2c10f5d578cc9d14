"""Tables written by spreadsheets, loggers and scripts: the same drive, or an error, never other values."""

from __future__ import annotations

import gzip
import math
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pytest

from oncenter.errors import OncenterError
from oncenter.read import read
from oncenter.signals import DEGREE, SignalName

ROWS = 200
NOON = datetime(2024, 5, 1, 12, tzinfo=UTC)
TABLE = pl.DataFrame(
    {
        "time_s": np.arange(ROWS) / 100,
        "steering_wheel_angle_deg": np.round(20 * np.sin(np.arange(ROWS) / 30), 2),
        "yaw_rate_deg_s": np.round(3 * np.sin(np.arange(ROWS) / 30), 3),
    }
)
HEADER, *LINES = TABLE.write_csv().splitlines()


def csv(*, header: str = HEADER, separator: str = ",", decimal: str = ".", end: str = "\n") -> str:
    rows = [line.replace(",", "\0").replace(".", decimal).replace("\0", separator) for line in LINES]
    return end.join([header.replace(",", separator), *rows]) + end


def with_time(head: str, time: Callable[[float], str], separator: str = ",") -> str:
    cells = [line.split(",") for line in LINES]
    header = HEADER.replace("time_s", head).split(",")
    return "\n".join(map(separator.join, [header, *([time(float(t)), *rest] for t, *rest in cells)]))


def clock(of: str, since: datetime = NOON) -> Callable[[float], str]:
    return lambda t: (since + timedelta(seconds=t)).strftime(of)[:-3]


WAYS: dict[str, str | bytes] = {
    "decimal commas between semicolons": csv(separator=";", decimal=","),
    "decimal commas between tabs": csv(separator="\t", decimal=","),
    "decimal points between semicolons": csv(separator=";"),
    "a byte order mark": "\ufeff" + csv(),
    "UTF-16": csv().encode("utf-16"),
    "UTF-16, big end first": ("\ufeff" + csv(separator=";", decimal=",")).encode("utf-16-be"),
    "a carriage return and a line feed": csv(end="\r\n"),
    "carriage returns": csv(end="\r"),
    "a separator at each line's end": csv(end=",\n"),
    "a separator at each row's end": "\n".join([HEADER, *(line + "," for line in LINES)]),
    "quoted names": csv(header=",".join(f'"{name}"' for name in HEADER.split(","))),
    "a row of units": csv(header=HEADER + "\ns,deg,deg/s"),
    "a row of units in brackets, below names without": csv(
        header="time,steering_wheel_angle,yaw_rate\n[s],[°],[deg/s]"
    ),
    "comments and Excel's mark first": "# logger 3\n\nsep=;\n" + csv(separator=";"),
    "empty lines": csv(end="\n\n"),
    "gzip that does not say so": gzip.compress(csv().encode()),
    "milliseconds": with_time("time_ms", lambda t: f"{1000 * t:.0f}"),
    "microseconds": with_time("time_us", lambda t: f"{1e6 * t:.0f}"),
    "ISO dates": with_time("time_s", clock("%Y-%m-%dT%H:%M:%S.%f")),
    "ISO dates in UTC": with_time("timestamp", lambda t: clock("%Y-%m-%dT%H:%M:%S.%f")(t) + "Z"),
    "ISO dates of a zone": with_time("Time", lambda t: clock("%Y-%m-%d %H:%M:%S.%f")(t) + "+02:00"),
    "the time of day past midnight": with_time("time", clock("%H:%M:%S.%f", datetime(2024, 5, 1, 23, 59, 59))),
    "German dates past midnight": with_time("time_s", clock("%d.%m.%Y %H:%M:%S.%f", datetime(2024, 5, 1, 23, 59, 59))),
    "German dates with decimal commas": with_time("time_s", clock("%d.%m.%Y %H:%M:%S,%f"), ";"),
    "American dates past midnight": with_time("time", clock("%m/%d/%Y %H:%M:%S.%f", datetime(2024, 5, 1, 23, 59, 59))),
    "British dates past midnight": with_time("time", clock("%d/%m/%Y %H:%M:%S.%f", datetime(2024, 5, 1, 23, 59, 59))),
    "American dates with am and pm": with_time("time", lambda t: f"05/01/2024 12:00:0{t:.3f} PM"),
    "dates with the month's name": with_time("time", clock("%d-%b-%Y %H:%M:%S.%f")),
    "dates of two digits": with_time("time", clock("%d.%m.%y %H:%M:%S.%f")),
    "dates with slashes, the year first": with_time("time", clock("%Y/%m/%d %H:%M:%S.%f")),
    "ISO dates with decimal commas": with_time("time_s", clock("%Y-%m-%d %H:%M:%S,%f"), ";"),
    "the time of day with am and pm": with_time("time", lambda t: f"1:02:0{t:.3f} PM"),
    "the time of day with milliseconds after a colon": with_time("time", lambda t: f"12:00:0{t:.3f}".replace(".", ":")),
    "elapsed hours": with_time("time", lambda t: f"25:00:0{t:.3f}"),
    "minutes and seconds as Excel shows them": with_time(
        "time", lambda t: f"{59 if t < 1 else 0:02d}:{(59 + t) % 60:06.3f}"
    ),
    "days since 1900, as Excel counts": with_time("time", lambda t: f"{45413.5 + t / 86400:.12f}"),
    "a unit in the name of the time": with_time("Time [ms]", lambda t: f"{1000 * t:.0f}"),
    "a unit in round brackets": with_time("Zeit (s)", lambda t: f"{t:.2f}"),
    "asammdf's times": with_time("timestamps", lambda t: f"{t:.2f}"),
    "lines about the recording first": "Logger;L3\nStart;01.05.2024 12:00\nDriver;A, B\n\n"
    + csv(separator=";", decimal=","),
    "lines about the recording with separators": "Logger,L3,\nRate,100,Hz\n,,\n" + csv(header=HEADER + "\ns,deg,deg/s"),
    "a line of text first": "Measurement of 1 May\n" + csv(separator="\t"),
    "comments below the names, and units": csv(header=HEADER + "\nclock,angle of EPS,gyro\ns,deg,deg/s"),
    "units below the names, and comments": csv(header=HEADER + "\ns,deg,deg/s\nclock,angle of EPS,gyro"),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_of_writing_a_table_gives_the_same_drive(way: str, tmp_path: Path) -> None:
    content = WAYS[way]
    (tmp_path / "drive.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    signals = read(tmp_path / "drive.csv")
    assert signals.rate_hz == 100.0
    assert signals.notes == ()
    since = signals.table["time_s"].to_numpy() - signals.table["time_s"][0]
    assert np.allclose(since, TABLE["time_s"], atol=1e-6)
    assert np.allclose(signals.table["steering_wheel_angle_rad"], TABLE["steering_wheel_angle_deg"] * DEGREE, atol=1e-9)
    assert np.allclose(signals.table["yaw_rate_rad_s"], TABLE["yaw_rate_deg_s"] * DEGREE, atol=1e-9)


@pytest.mark.parametrize("head", ["time", "time_d"])
def test_days_of_matlab_s_calendar_are_times_since_1970(head: str, tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(with_time(head, lambda t: f"{739373.5 + t / 86400:.12f}"))
    assert read(tmp_path / "drive.csv").table["time_s"][0] == pytest.approx(NOON.timestamp(), abs=2e-5)


@pytest.mark.parametrize("way", [way for way in WAYS if "dates" in way.lower() and "zone" not in way])
def test_a_date_is_the_one_that_pandas_reads(way: str, tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(str(WAYS[way]))
    first = str(WAYS[way]).splitlines()[1].split(";" if "commas" in way else ",")[0].replace(",", ".")
    day_first = not way.startswith(("ISO", "American")) and "year" not in way
    expected = pd.to_datetime(first, dayfirst=day_first, utc=True).timestamp()
    assert read(tmp_path / "drive.csv").table["time_s"][0] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([*LINES, *LINES], "runs backward once, by up to 1.99 s, first after row 200"),
        ([*LINES, *LINES[50:], *LINES[100:]], "runs backward 2 times, by up to 1.49 s, first after row 200"),
    ],
)
@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_part_recorded_twice_gives_a_note_with_the_backward_step(
    rows: list[str], words: str, suffix: str, tmp_path: Path
) -> None:
    path = tmp_path / f"drive.{suffix}"
    path.write_text("\n".join([HEADER, *rows]) + "\n")
    if suffix == "parquet":
        pl.read_csv(path).write_parquet(path)
    assert read(path).notes == (f"time of {path.name} {words}: a part that was recorded twice is used twice",)


def test_dates_without_a_zone_are_seconds_since_1970_in_utc(tmp_path: Path) -> None:
    for way, start in (("ISO dates", 0), ("ISO dates in UTC", 0), ("ISO dates of a zone", -7200)):
        (tmp_path / "drive.csv").write_text(str(WAYS[way]))
        assert read(tmp_path / "drive.csv").table["time_s"][0] == pytest.approx(NOON.timestamp() + start, abs=1e-6)


SINCE_NOON = pl.lit(NOON.replace(tzinfo=None)) + pl.duration(
    milliseconds=(pl.col("time_s") * 1000).round().cast(pl.Int64)
)
PARQUET: dict[str, pl.DataFrame] = {
    "32 bits": TABLE.with_columns(pl.exclude("time_s").cast(pl.Float32)),
    "decimals": TABLE.with_columns(pl.all().cast(pl.String).cast(pl.Decimal(12, 3))),  # a number's cast cuts digits off
    "whole milliseconds": TABLE.select(
        (pl.col("time_s") * 1000).round().cast(pl.Int64).alias("time_ms"), pl.exclude("time_s")
    ),
    "text": TABLE.cast(pl.String),
    **{
        f"dates in {u}": TABLE.with_columns(SINCE_NOON.cast(pl.Datetime(u)).alias("time_s")) for u in ("ms", "us", "ns")
    },
    "dates of a zone": TABLE.with_columns(SINCE_NOON.dt.replace_time_zone("UTC").alias("time_s")),
    "durations": TABLE.with_columns((SINCE_NOON - pl.lit(NOON.replace(tzinfo=None))).alias("time_s")),
    "times of day": TABLE.with_columns(SINCE_NOON.dt.time().alias("time_s")),
    "others beside": TABLE.with_columns(pl.lit(b"x").alias("blob"), pl.lit(None).alias("nothing")),
}


@pytest.mark.parametrize("kind", PARQUET)
def test_parquet_of_any_type_is_the_same_drive(kind: str, tmp_path: Path) -> None:
    PARQUET[kind].write_parquet(tmp_path / "drive.parquet")
    signals = read(tmp_path / "drive.parquet")
    assert np.allclose(signals.table["time_s"] - signals.table["time_s"][0], TABLE["time_s"], atol=1e-6)
    assert np.allclose(signals.table["yaw_rate_rad_s"], TABLE["yaw_rate_deg_s"] * DEGREE, atol=1e-7)


def test_parquet_in_many_parts_and_under_any_name_is_the_same_drive(tmp_path: Path) -> None:
    TABLE.write_parquet(tmp_path / "whole.parquet")
    TABLE.write_parquet(tmp_path / "tour [1]*.parquet", row_group_size=7)
    assert read(tmp_path / "tour [1]*.parquet").table.equals(read(tmp_path / "whole.parquet").table)


def test_a_null_is_not_available(tmp_path: Path) -> None:
    missing = TABLE.with_columns(
        pl.when(pl.int_range(pl.len()) == 7).then(None).otherwise("yaw_rate_deg_s").alias("yaw_rate_deg_s")
    )
    missing.write_parquet(tmp_path / "drive.parquet")
    assert math.isnan(read(tmp_path / "drive.parquet").table["yaw_rate_rad_s"][7])


REFUSED: dict[str, tuple[str | bytes, str, str]] = {
    "decimal commas between commas": (csv(decimal=","), "unreadable_log", "the header has 3"),
    "commas between thousands": (csv(separator=";").replace("\n0.07;", "\n1,000;"), "not_a_number", "row 8 "),
    "UTF-16 without its mark": (csv().encode("utf-16-le"), "unreadable_log", "UTF-16"),
    "a time without a unit": (csv(header=HEADER.replace("time_s", "time")), "unit_missing", "time_ms"),
    "two units": (csv(header=HEADER + "\ns,rad,deg/s"), "unit_ambiguous", "'rad'"),
    "a signal that is there twice": (
        "\n".join([HEADER + ",yaw_rate_deg_s", *(line + ",9" for line in LINES)]),
        "ambiguous_column",
        "yaw_rate_deg_s",
    ),
    "a time that is there twice": (
        "\n".join([HEADER + ",time_s", *(f"{r},9" for r in LINES)]),
        "ambiguous_column",
        "time_s",
    ),
    "a date that does not exist": (with_time("time_s", lambda t: "31.13.2024 12:00:00.0"), "not_a_time", "31.13.2024"),
    "dates of two kinds": (
        with_time("time_s", lambda t: clock("%d.%m.%Y %H:%M:%S.%f" if t < 1 else "%Y-%m-%d %H:%M:%S.%f")(t)),
        "not_a_time",
        "2024-05-01",
    ),
    "noon": (with_time("time_s", lambda t: "noon" if t > 1 else clock("%H:%M:%S.%f")(t)), "not_a_time", "'noon'"),
    "whole seconds": (with_time("time_s", lambda t: clock("%H:%M:%S.%f")(t)[:8]), "time_backward", "does not increase"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_ambiguous_tables_are_refused(what: str, tmp_path: Path) -> None:
    content, code, said = REFUSED[what]
    (tmp_path / "drive.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(OncenterError) as refused:
        read(tmp_path / "drive.csv")
    assert (refused.value.code, refused.value.exit_code) == (code, 1)
    assert said in str(refused.value) and "drive.csv" in str(refused.value)


def test_a_time_column_named_in_the_vehicle_file_may_contain_dates(tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(with_time("Zeit", clock("%Y-%m-%d %H:%M:%S.%f")))
    table = read(tmp_path / "drive.csv", names={"time": SignalName("Zeit")}).table
    assert table["time_s"][0] == pytest.approx(NOON.timestamp(), abs=1e-6)


def test_empty_cells_of_a_slower_signal_are_interpolated_and_gaps_are_not(tmp_path: Path) -> None:
    row = pl.int_range(pl.len())
    slow = (row % 10 == 3) & ~row.is_between(60, 140)
    sparse = TABLE.with_columns(pl.when(slow).then(72.0 + row).alias("vehicle_speed_km_h"))
    sparse.write_csv(tmp_path / "drive.csv")
    signals = read(tmp_path / "drive.csv")
    speed = 3.6 * signals.table["vehicle_speed_m_s"].to_numpy() - 72
    assert signals.sources["vehicle_speed"].rate_hz == pytest.approx(10.0)
    known = np.r_[3:54, 143:194]
    assert np.allclose(speed[known], known, atol=1e-9)
    assert np.isnan(np.delete(speed, known)).all()


def test_an_angle_slower_than_its_table_has_its_own_rate(tmp_path: Path) -> None:
    every_25th = pl.when(pl.int_range(pl.len()) % 25 == 0).then("steering_wheel_angle_deg")
    TABLE.with_columns(every_25th.alias("steering_wheel_angle_deg")).write_csv(tmp_path / "drive.csv")
    with pytest.raises(OncenterError, match="is recorded at 4 Hz") as refused:
        read(tmp_path / "drive.csv")
    assert refused.value.code == "rate_too_low"


@pytest.mark.parametrize(("every", "rest"), [(2, 1), (4, 2)])
def test_an_angle_in_every_second_or_fourth_row_sets_the_tick(tmp_path: Path, every: int, rest: int) -> None:
    row = pl.int_range(pl.len())
    sparse = TABLE.with_columns(
        pl.when(row % every == 0).then("steering_wheel_angle_deg").alias("steering_wheel_angle_deg"),
        pl.when(row % every == rest).then("yaw_rate_deg_s").alias("yaw_rate_deg_s"),
    )
    sparse.write_csv(tmp_path / "drive.csv")
    signals = read(tmp_path / "drive.csv")
    assert signals.rate_hz == pytest.approx(100.0 / every)
    assert np.diff(signals.table["time_s"]) == pytest.approx(every / 100.0)
    thinned = TABLE.gather_every(every)
    angle = signals.table["steering_wheel_angle_rad"].to_numpy()[: len(thinned)]
    assert angle == pytest.approx(thinned["steering_wheel_angle_deg"].to_numpy() * DEGREE, abs=1e-12)
    assert np.isfinite(signals.table["yaw_rate_rad_s"].to_numpy()[1 : len(thinned) - 1]).all()


def test_a_slow_course_does_not_set_the_tick_of_a_table_without_angle_and_yaw_rate(tmp_path: Path) -> None:
    time = TABLE["time_s"].to_numpy().copy()
    time[100:] -= 0.5
    columns = {"time_s": time, "vehicle_speed_km_h": np.full(ROWS, 60.0)}
    columns |= {f"wheel_speed_rear_{side}_km_h": np.full(ROWS, 60.0) for side in ("left", "right")}
    course = pl.when(pl.int_range(pl.len()) % 50 == 0).then(10.0).alias("course_deg")
    pl.DataFrame(columns).with_columns(course).write_csv(tmp_path / "drive.csv")
    signals = read(tmp_path / "drive.csv")
    assert signals.table["time_s"].to_list() == pytest.approx(time)
    assert any("runs backward once" in note for note in signals.notes)


def test_rows_that_each_hold_one_event_give_each_signal_its_own_rate(tmp_path: Path) -> None:
    angle = TABLE.select("time_s", "steering_wheel_angle_deg")
    yaw = TABLE.gather_every(2).select(pl.col("time_s") + 0.003, "yaw_rate_deg_s")
    pl.concat([angle, yaw], how="diagonal").sort("time_s").write_csv(tmp_path / "drive.csv")
    signals = read(tmp_path / "drive.csv")
    assert signals.rate_hz == 100.0
    assert [signals.sources[s].rate_hz for s in ("steering_wheel_angle", "yaw_rate")] == pytest.approx([100.0, 50.0])
    at_ticks = np.interp(signals.table["time_s"], yaw["time_s"], yaw["yaw_rate_deg_s"]) * DEGREE
    inside = signals.table["time_s"].is_between(0.004, 1.98).to_numpy()
    assert np.allclose(signals.table["yaw_rate_rad_s"].to_numpy()[inside], at_ticks[inside], atol=1e-9)


GROUPS = {  # the angle at 100 Hz, the yaw rate at 50 Hz and 2 ms later
    "numbers": ("time_1", "time_2", {"time": SignalName("time_1", "s")}),
    "units in the names": ("Time 1 [s]", "Time 2 [s]", {}),
    "one name": ("time_s", "time_s", {}),
    "names of [signals]": (
        "Zeit EPS",
        "Zeit ESP",
        {
            "steering_wheel_angle": SignalName("angle", "deg", time="Zeit EPS", time_unit="s"),
            "yaw_rate": SignalName("rate", "deg/s", time="Zeit ESP", time_unit="s"),
        },
    ),
}


@pytest.mark.parametrize("way", GROUPS)
def test_each_group_of_columns_has_its_time(way: str, tmp_path: Path) -> None:
    one, other, names = GROUPS[way]
    angle, rate = ("angle", "rate") if "yaw_rate" in names else ("steering_wheel_angle_deg", "yaw_rate_deg_s")
    rows = [f"{one},{angle},{other},{rate}"]
    for tick in range(ROWS):
        late = f"{tick / 50 + 0.002:.3f},{tick}" if tick < ROWS // 2 else ","
        rows.append(f"{tick / 100:.2f},{10 + tick},{late}")
    (tmp_path / "drive.csv").write_text("\n".join(rows))
    signals = read(tmp_path / "drive.csv", names=names)
    assert {name: source.rate_hz for name, source in signals.sources.items()} == {
        "steering_wheel_angle": pytest.approx(100.0),
        "yaw_rate": pytest.approx(50.0),
    }
    time, table = signals.columns["time_s"], signals.columns
    assert np.allclose(table["steering_wheel_angle_rad"] / DEGREE, 10 + 100 * time, atol=1e-6)
    known = np.isfinite(table["yaw_rate_rad_s"])
    assert np.allclose(table["yaw_rate_rad_s"][known] / DEGREE, 50 * (time[known] - 0.002), atol=1e-6)
    assert signals.account is not None and "without_time" not in signals.account.file.left_out


def test_columns_called_t_are_no_times_beside_a_time(tmp_path: Path) -> None:
    rows = [f"{line.split(',')[0]},{line.split(',')[1]},20.5,{line.split(',')[2]},21" for line in LINES]
    (tmp_path / "drive.csv").write_text("\n".join(["time_s,steering_wheel_angle_deg,T1,yaw_rate_deg_s,T2", *rows]))
    assert read(tmp_path / "drive.csv").sources["yaw_rate"].rate_hz == 100.0


def test_a_time_column_that_is_not_there_is_named(tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(csv())
    names = {"yaw_rate": SignalName("yaw_rate_deg_s", time="time_z")}
    with pytest.raises(OncenterError, match=r"time = 'time_z' does not exist in drive.csv; did you mean time_s"):
        read(tmp_path / "drive.csv", names=names)
