"""TOML that oncenter writes is TOML: any text in it comes back."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from truck_rows import drive_row

import oncenter as oc
from oncenter.files.toml_text import entry
from oncenter.memory.file import text_of
from oncenter.memory.truck import PastDrive, TruckMemory
from oncenter.simulate.truth import write_truth
from oncenter.vehicle_file.written import vehicle_text

NASTY = 'a\x7fb "quoted" \\ \x00\x1b[31m\n\t\u2028 ü 🚚'


@pytest.mark.parametrize(
    "value", [NASTY, -0.0, 1e-5, 1e300, float("inf"), 3, True, [1, [NASTY, 2.5]], {"a b": [1.0], "c": {NASTY: 1}}, {}]
)
def test_a_value_comes_back_with_its_name(value: object) -> None:
    for name in ("plain", "with a blank", "", NASTY):
        assert tomllib.loads(entry(name, value)) == {name: value}


def test_a_vehicle_file_a_memory_and_a_truth_are_toml_whatever_the_names_in_them(tmp_path: Path) -> None:
    vehicle = vehicle_text({"name": NASTY, "signals": {"yaw_rate": {"signal": NASTY, "unit": "deg/s"}}})
    assert tomllib.loads(vehicle)["name"] == NASTY
    assert tomllib.loads(vehicle)["signals"]["yaw_rate"]["signal"] == NASTY
    row = drive_row(0.0, 2.0, status=NASTY, logs=(NASTY,))
    memory = TruckMemory(NASTY, vin=NASTY, drives=(PastDrive((NASTY,), row, NASTY),))
    assert tomllib.loads(text_of(memory))["truck"].endswith("ü 🚚")
    _, truth = oc.simulate("thesis_drive", 1)
    write_truth(replace(truth, scenario="🚚\x7f\udcff"), tmp_path / "truth.parquet", tmp_path / "truth.toml")
    assert tomllib.loads((tmp_path / "truth.toml").read_text(encoding="utf-8"))["scenario"] == r"🚚\x7f\xff"
