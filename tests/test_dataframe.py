"""Tables in memory of any library are read like CSV files; objects have a readable repr at the prompt."""

import copy
import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from planted_faults import TRUCK, drive

import oncenter as oc
from oncenter.signals import DEGREE, SIGNALS

ROWS = 400
COLUMNS = {
    "time_s": np.arange(ROWS) / 100,
    "steering_wheel_angle_deg": np.round(20 * np.sin(np.arange(ROWS) / 30), 2),
    "yaw_rate_deg_s": np.round(3 * np.sin(np.arange(ROWS) / 30), 3),
    "driver": ["Ada"] * ROWS,
}


class OnlyArrow:
    """A table of an unknown library."""

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        return pl.DataFrame(COLUMNS).__arrow_c_stream__(requested_schema)


def dated(zone: str | None = None) -> pd.DatetimeIndex:
    return pd.date_range("2024-05-01", periods=ROWS, freq="10ms", tz=zone)


def pandas_with(**others: Any) -> pd.DataFrame:
    return pd.DataFrame({**COLUMNS, **others})


WAYS: dict[str, Any] = {
    "pandas": pd.DataFrame(COLUMNS),
    "pandas, the time as its index": pd.DataFrame(COLUMNS).set_index("time_s"),
    "pandas, an index of dates without a name": pd.DataFrame(COLUMNS, index=dated()).drop(columns="time_s"),
    "pandas, dates of a zone": pandas_with(time=dated("Europe/Stockholm")).drop(columns="time_s"),
    "pandas, nullable numbers": pd.DataFrame(COLUMNS).convert_dtypes(),
    "pandas, rows in another order of labels": pd.DataFrame(COLUMNS, index=range(ROWS, 0, -1)),
    "polars": pl.DataFrame(COLUMNS),
    "polars, lazy": pl.LazyFrame(COLUMNS),
    "pyarrow": pa.table(COLUMNS),
    "a library that speaks Arrow": OnlyArrow(),
    "a dict of arrays": COLUMNS,
    "a dict of lists": {name: list(values) for name, values in COLUMNS.items()},
    "a dict of series": {name: pd.Series(values) for name, values in COLUMNS.items()},
    "text": pl.DataFrame(COLUMNS).cast(pl.String),
}


@pytest.mark.parametrize("way", WAYS)
def test_tables_of_every_library_give_the_same_drive(way: str) -> None:
    signals = oc.from_dataframe(WAYS[way])
    assert signals.rate_hz == 100.0 and signals.notes == ()
    assert list(signals.sources) == ["steering_wheel_angle", "yaw_rate"]
    since = signals.table["time_s"].to_numpy() - signals.table["time_s"][0]
    assert np.allclose(since, COLUMNS["time_s"], atol=1e-6)
    assert np.allclose(signals.table["yaw_rate_rad_s"].to_numpy(), COLUMNS["yaw_rate_deg_s"] * DEGREE)


def test_every_missing_value_of_pandas_is_not_a_number() -> None:
    for missing in (np.nan, None, pd.NA):
        frame = pandas_with(vehicle_speed_km_h=pd.Series([missing, *[36.0] * (ROWS - 1)], dtype=object))
        speed = oc.from_dataframe(frame).table["vehicle_speed_m_s"].to_numpy()
        assert np.isnan(speed[0]) and np.allclose(speed[1:], 10.0)


def test_the_vehicles_names_apply_to_a_table_as_to_a_csv_file() -> None:
    truck = oc.Vehicle.model_validate(
        {
            "wheelbase_m": 3.7,
            "steering_ratio": 19.3,
            "signals": {"time": {"name": "t", "unit": "ms"}, "yaw_rate": {"name": "r", "unit": "deg/s", "sign": -1}},
        }
    )
    frame = pd.DataFrame({"t": COLUMNS["time_s"] * 1000, "r": COLUMNS["yaw_rate_deg_s"]})
    yaw_rate = oc.from_dataframe(frame, truck).table["yaw_rate_rad_s"].to_numpy()
    assert np.allclose(yaw_rate, -COLUMNS["yaw_rate_deg_s"] * DEGREE)


def test_a_frame_gives_the_answer_of_its_drive() -> None:
    whole = drive()
    assert oc.offset(oc.from_dataframe(whole.table.to_pandas()), TRUCK).offset == oc.offset(whole, TRUCK).offset


@pytest.mark.parametrize(
    ("frame", "says"),
    [
        (
            pandas_with(vehicle_speed=10.0),
            "column vehicle_speed of dataframe has no unit: rename it to vehicle_speed_m_s",
        ),
        (pd.DataFrame({"a": [1, 2]}), "no signal recognised in dataframe: its columns are 'a'"),
        (pd.DataFrame(COLUMNS).drop(columns="time_s"), "no time column 'time_s' in dataframe"),
        (
            pandas_with(vehicle_speed_km_h="fast"),
            "column vehicle_speed_km_h, row 1 of dataframe: 'fast' is not a number",
        ),
        (pd.concat([pd.DataFrame(COLUMNS)] * 2, axis=1), "two columns are called time_s: rename or delete one"),
        ({**COLUMNS, "yaw_rate_deg_s": [1.0]}, "all columns must have the same length, got time_s 400, "),
        ({**COLUMNS, "yaw_rate_deg_s": np.zeros((ROWS, 2))}, "column yaw_rate_deg_s: expected one number per row"),
        ({**COLUMNS, "yaw_rate_deg_s": [object()] * ROWS}, "column yaw_rate_deg_s"),
        ([1, 2, 3], "expected a DataFrame, an Arrow table or a dict of arrays, got list"),
        ("drive.csv", "expected a DataFrame, an Arrow table or a dict of arrays, got str"),
        (pd.DataFrame(COLUMNS)[:1], "dataframe is too short: at least 2 rows with a time are needed, got 1"),
    ],
)
def test_an_unusable_table_is_refused_in_one_line(frame: object, says: str) -> None:
    with pytest.raises(oc.OncenterError) as refused:
        oc.from_dataframe(frame)
    assert says in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("verb", [oc.offset, oc.angle, lambda given, truck: oc.reference(given)])
def test_a_function_without_signals_says_how_to_read_them(verb: Any) -> None:
    for given, how in (
        (pd.DataFrame(COLUMNS), "needs Signals, from oncenter.from_dataframe(frame); got DataFrame"),
        ("drive.csv", "needs Signals, from oncenter.read(path); got str"),
        (Path("drive.csv"), "needs Signals, from oncenter.read(path); got "),
        (None, "needs Signals, from "),
    ):
        with pytest.raises(oc.OncenterError, match=re.escape(how)):
            verb(given, TRUCK)


@pytest.mark.parametrize("verb", [oc.offset, oc.angle])
def test_a_function_without_a_vehicle_says_how_to_read_one(verb: Any) -> None:
    with pytest.raises(oc.OncenterError, match=r"takes a Vehicle: oncenter.vehicle\(path\); got dict"):
        verb(drive(), {"wheelbase_m": 3.7})


def test_pandas_and_pyarrow_are_not_imported() -> None:
    """A pandas frame needs no pyarrow."""
    code = (
        "import sys; import oncenter as oc\n"
        "oc.from_dataframe({'time_s': [0.0, 0.01, 0.02], 'yaw_rate_deg_s': [1.0, 2.0, 3.0]})\n"
        "assert not {'pandas', 'pyarrow'} & set(sys.modules), sys.modules\n"
        "sys.modules['pyarrow'] = None\n"
        "import pandas as pd\n"
        "frame = pd.DataFrame({'time_s': [0.0, 0.01, 0.02], 'yaw_rate_deg_s': [1.0, 2.0, 3.0], 'who': [*'abc']})\n"
        "assert oc.from_dataframe(frame).table.height == 3\n"
        "assert oc.from_dataframe(frame.set_index('time_s')).table.height == 3\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_completion_lists_only_public_names() -> None:
    assert dir(oc) == sorted(oc.__all__)
    assert all(hasattr(oc, name) for name in dir(oc))


def test_help_lists_every_function_with_one_line() -> None:
    for name in oc.__all__:
        if name[0].islower():
            assert re.search(rf"^    {name}\(.*\)  ", oc.__doc__ or "", re.MULTILINE), name


def test_the_repr_of_an_object_is_one_line() -> None:
    signals = drive()
    answer = oc.offset(signals, TRUCK)
    assert repr(signals).startswith("Signals('synthetic', 300.0 s at 50 Hz: steering_wheel_angle, yaw_rate, ")
    assert re.fullmatch(r"Answer\('synthetic', offset [\d.]+ deg, .*, \d+ findings\)", repr(answer))
    assert (
        repr(oc.vehicle("scania_r730_4x2")) == "Vehicle('Scania R730 LA4x2MNA', wheelbase_m=3.7, steering_ratio=19.3)"
    )
    assert repr(oc.Monitor(TRUCK, 50.0)) == "Monitor('unnamed', rate_hz=50, method='joint')"
    for given in (signals, answer, TRUCK):
        assert len(repr(given)) < 400 and "\n" not in repr(given)


def test_a_notebook_shows_a_small_table() -> None:
    signals = drive()
    html = signals._repr_html_()
    assert html.count("<tr>") == 1 + len(signals.sources) and html.count("<table>") == 1
    assert "<td>deg/s</td>" in html and len(html) < 5000
    answer = oc.offset(signals, TRUCK)
    html = answer._repr_html_()
    assert "straight-ahead offset" in html and "<td>deg</td>" in html and html.count("<li>") == len(answer.findings)
    assert set(SIGNALS) >= set(signals.sources)


def test_a_drive_is_the_same_from_its_table_and_from_its_columns() -> None:
    table = drive().table
    by_table, by_columns = drive(), replace(drive(), table=drive().columns)
    assert by_columns.table.equals(table)
    assert list(by_table.columns) == table.columns and by_table.ticks == by_columns.ticks == table.height
    for given in (by_table, by_columns):
        assert replace(given, log="other").table.equals(table)
        assert replace(given, table=table.head(10)).ticks == 10
        assert copy.deepcopy(given).table.equals(table) and pickle.loads(pickle.dumps(given)).table.equals(table)


def test_a_notebook_shows_the_text_of_a_log_as_text() -> None:
    signals = drive(duration_s=10.0)
    sources = {name: replace(source, description=f"column <{name}> & more") for name, source in signals.sources.items()}
    html = replace(signals, sources=sources, log="<b>log</b>")._repr_html_()
    assert html.count("<td>column &lt;") == len(sources) and "&amp; more" in html
    assert "&lt;b&gt;log" in html and "<b>" not in html
