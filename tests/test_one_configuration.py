"""The desk, a monitor tick by tick, a live bus and the exported C run one configuration, and give one answer to the
last bit when they are fed the same ticks."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import oncenter as oc
from oncenter import _core, export
from oncenter._native import ffi, lib
from oncenter.live.learner import Learner
from oncenter.read.whole_turns import without_whole_turns
from oncenter.signals import DEGREE, Signals
from oncenter.vehicle import core_of

# A step, whole turns, a correction; the others run at night.
KINDS = {"relative_angle", "remounted_sensor", "self_correction"}
# All but another truck, whose vehicle file only the desk fits.
NAMES = [
    pytest.param(file.stem, marks=() if file.stem in KINDS else pytest.mark.slow)
    for file in sorted((Path(__file__).parents[1] / "scenarios").glob("*.toml"))
    if file.stem != "lift_axle"
]
TRUCK = oc.vehicle("scania_r730_4x2")
LEARNED = ("offset", "understeer_gradient", "backlash", "unloading_acceleration", "equivalent_wheelbase")
CHECKED_S = 120.0  # of a drive tick by tick in Python, which is slow; whole drives elsewhere


def columns_of(drive: Signals) -> dict[str, np.ndarray[Any, Any]]:
    return {name: drive.table[name].to_numpy() for name in _core.COLUMNS if name in drive.table.columns}


def shared_part(native: dict[str, Any]) -> dict[str, Any]:
    """The part of an oc_answer that an `oc.Answer` has, too."""
    unobservable = _core.STATUSES.index("unobservable")
    estimates = {name: native[name] for name in (*LEARNED, "yaw_rate_bias")}
    values = {name: None if one["status"] == unobservable else one["value"] for name, one in estimates.items()}
    statuses = {name: _core.STATUSES[one["status"]] for name, one in estimates.items()}
    return {"values": values, "statuses": statuses, "fault": _core.FAULTS[native["fault"]], "used_s": native["used"]}


def by_desk(drive: Signals) -> dict[str, Any]:
    answer = oc.offset(drive, TRUCK)
    names = (*LEARNED, "yaw_rate_bias")
    values = {name: getattr(answer, name).value for name in names}
    statuses = {name: getattr(answer, name).status for name in names}
    return {"values": values, "statuses": statuses, "fault": answer.sensor_fault, "used_s": answer.used_s}


def by_monitor(drive: Signals) -> dict[str, Any]:
    monitor, columns = oc.Monitor(TRUCK, drive.rate_hz), columns_of(drive)
    for row in zip(*(column.tolist() for column in columns.values()), strict=True):
        monitor.step(oc.Tick(**dict(zip(columns, row, strict=True))))
    return shared_part(monitor._core.answer())


def by_live(drive: Signals) -> dict[str, Any]:
    columns = columns_of(drive)
    as_they_are: Any = {"add": lambda ticks: ticks, "pieces": lambda ticks: [ticks]}
    stream: Any = SimpleNamespace(listening=True, rate_hz=drive.rate_hz, notes=[], sources={}, **as_they_are)
    learner = Learner(stream, TRUCK)
    for begin in range(0, drive.table.height, 997):
        ticks: Any = {name: column[begin : begin + 997] for name, column in columns.items()}  # decoded already
        learner.take(ticks)
    assert learner.core is not None
    return shared_part(learner.core.answer())


@pytest.fixture(scope="module")
def ecu(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The exported program as a library."""
    folder = export.write_c(tmp_path_factory.mktemp("c") / "oncenter")
    sources = [
        *sorted(folder.glob("core/*.c")),
        *sorted(folder.glob("ecu/*.c")),
        Path(__file__).with_name("ecu_ticks.c"),
    ]
    library = folder / "ecu.so"
    command = ["cc", "-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-Icore", "-Iecu", *sources]
    subprocess.run([*command, "-lm", "-o", library], cwd=folder, check=True)
    return ctypes.CDLL(str(library))


def by_c(ecu: ctypes.CDLL, drive: Signals) -> dict[str, Any]:
    columns = columns_of(drive)
    ticks = np.zeros(drive.table.height, _core.dtype_of(ffi.typeof("oc_signals")))
    for name, column in columns.items():
        member = _core.COLUMNS[name]
        ticks[member] = column
        bit = 0 if member == "time" else _core._VALID_BITS[member]
        ticks["valid"] |= np.where(np.isnan(column), 0, bit).astype(np.uint32)
    vehicle = ffi.cast("oc_vehicle *", ctypes.addressof(ctypes.c_char.in_dll(ecu, "oncenter_vehicle")))
    ecu.oncenter_ecu_defaults()
    vehicle.wheelbase, vehicle.steering_ratio, vehicle.traffic_side = TRUCK.wheelbase_m, 19.3, TRUCK.traffic_sign
    vehicle.track_width_front, vehicle.track_width_rear = TRUCK.track_width_front_m, TRUCK.track_width_rear_m
    params = ffi.cast("oc_params *", ctypes.addressof(ctypes.c_char.in_dll(ecu, "oncenter_params")))
    for name, value in TRUCK.params.items():
        setattr(params, name, value)
    assert ecu.oncenter_ecu_start() == lib.OC_OK
    ecu.ecu_ticks(ticks.ctypes.data_as(ctypes.c_void_p), ctypes.c_size_t(len(ticks)))
    ecu.oncenter_ecu_update_answer()
    answer = ffi.cast("oc_answer *", ctypes.addressof(ctypes.c_char.in_dll(ecu, "oncenter_answer")))
    return shared_part(_core._members(answer))


@pytest.mark.parametrize("name", NAMES)
def test_desk_monitor_live_and_exported_c_give_one_answer(name: str, ecu: ctypes.CDLL) -> None:
    log = oc.simulate(name, seed=1)[0]
    drive, desk = cut(log, 1e9), by_desk(log)
    assert by_live(drive) == desk
    assert by_c(ecu, drive) == desk
    begin = cut(drive, CHECKED_S)
    assert by_monitor(begin) == by_core(begin)


def cut(drive: Signals, seconds: float) -> Signals:
    """The drive as its ticks are decoded: whole turns of a relative sensor are removed."""
    (decoded,) = without_whole_turns((drive,))
    time = decoded.table["time_s"]
    return Signals(decoded.table.filter(time < time[0] + seconds), decoded.sources, decoded.rate_hz, decoded.log)


def by_core(drive: Signals) -> dict[str, Any]:
    """All ticks at once."""
    core = core_of(TRUCK, drive.rate_hz)
    core.run(columns_of(drive))
    return shared_part(core.answer())


@pytest.mark.slow
def test_a_sensor_that_was_remounted_is_learned_anew_on_nearly_all_seeds() -> None:
    valid = []
    for seed in range(1, 21):
        drive, truth = oc.simulate("remounted_sensor", seed=seed)
        offset = oc.offset(drive, TRUCK).offset
        if offset.status == "valid":
            assert offset.value is not None
            valid.append(abs(offset.value - truth.offset_rad))
    assert len(valid) >= 16
    assert max(valid) < 0.3 * DEGREE
