"""The trace of an answer: flat, with units in its names and words for codes, as data frames take it."""

import functools
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd
import polars as pl

import oncenter as oc
from oncenter import _core
from oncenter.offset.run import outputs_of
from oncenter.offset.trace import _NUMBERS, _WORDS

UNITS = ("_s", "_rad", "_m_s", "_m_s2", "_1_m", "_rad_s", "_rad_m_s2")
CHECKED = 6_000  # ticks of the monitor in Python, which is slow; whole drives in test_one_configuration.py
WITHOUT_UNIT = {"place_in_play", "sensor_fault_confidence"}


@functools.cache
def answer() -> oc.Answer:
    drive, _ = oc.simulate("weave", seed=1)
    return oc.offset(drive, oc.vehicle("scania_r730_4x2"))


def leaves(outputs: np.ndarray[Any, Any], above: str = "") -> Iterator[tuple[str, np.ndarray[Any, Any]]]:
    for name in outputs.dtype.names or ():
        if outputs[name].dtype.names:
            yield from leaves(outputs[name], f"{above}{name}.")
        else:
            yield above + name, outputs[name]


def test_the_trace_has_every_number_of_the_core_under_a_name_with_its_unit() -> None:
    table, members = oc.trace(answer()), dict(leaves(outputs_of(answer())))
    assert set(members) == {*_NUMBERS.values(), *(member for member, _ in _WORDS.values())}
    for name, member in _NUMBERS.items():
        assert name in WITHOUT_UNIT or name.endswith(UNITS), name
        assert np.array_equal(table[name], members[member]), name
    assert table["offset_status"].tolist() == [_core.STATUSES[code] for code in members["offset_status"].tolist()]


def test_polars_and_pandas_take_the_trace_as_it_is() -> None:
    table = oc.trace(answer())
    polars, pandas = pl.DataFrame(table), pd.DataFrame(table)
    names = list(table.dtype.names or ())
    assert polars.columns == list(pandas.columns) == names
    assert {polars[name].dtype for name in names} == {pl.Float64(), pl.String()}
    for name in names:
        assert polars[name].to_list() == pandas[name].tolist() == table[name].tolist()


def test_a_row_of_the_trace_is_what_the_monitor_gives_at_that_tick() -> None:
    (drive,), rows = answer().drives, oc.trace(answer())
    monitor = oc.Monitor(oc.vehicle("scania_r730_4x2"), drive.rate_hz)
    ticks = drive.table.select(name for name in drive.table.columns if name in _core.COLUMNS)
    for tick, row in zip(ticks.head(CHECKED).iter_rows(named=True), rows[:CHECKED], strict=True):
        now = asdict(monitor.step(oc.Tick(**tick)))
        now |= {name: ", ".join(now[name]) for name in ("reasons", "signals_at_fault")}
        for name, value in now.items():
            assert value is None or value == row[name], name
