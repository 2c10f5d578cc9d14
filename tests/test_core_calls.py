"""Wrong calls of the core are errors, and ticks at a wrong rate have a reason; neither gives an answer."""

from typing import Any

import numpy as np
import pytest
from random_drives import RATIO, WHEELBASE, Array, drive
from saved_ecu import RATE_HZ, Ecu

from oncenter import _core
from oncenter._native import ffi, lib

TIME = _core.REASONS["time"]


def step(ecu: Ecu, tick: Any = None) -> tuple[int, Any]:
    output = ffi.new("oc_output *", {"offset_status": lib.OC_VALID, "offset": 1.0})
    tick = ffi.new("oc_signals *", {"valid": 15}) if tick is None else tick
    return lib.oc_step(ecu.state, ecu.coefficients, tick, output), output


def test_a_null_pointer_is_an_error() -> None:
    ecu, nothing = Ecu(), ffi.NULL
    vehicle, params = _core._vehicle(WHEELBASE, RATIO, 0.0, 0.0), _core._params({}, "joint")
    coefficients, tick, image = ecu.coefficients, ffi.new("oc_signals *"), ffi.new("uint8_t[24]")
    errors = [
        lib.oc_setup(nothing, vehicle, params, RATE_HZ),
        lib.oc_setup(ffi.new("oc_coefficients *"), nothing, params, RATE_HZ),
        lib.oc_setup(ffi.new("oc_coefficients *"), vehicle, nothing, RATE_HZ),
        lib.oc_step(nothing, coefficients, tick, nothing),
        lib.oc_step(ecu.state, nothing, tick, nothing),
        lib.oc_step(ecu.state, coefficients, nothing, nothing),
        lib.oc_answer_get(nothing, coefficients, ffi.new("oc_answer *")),
        lib.oc_answer_get(ecu.state, nothing, ffi.new("oc_answer *")),
        lib.oc_answer_get(ecu.state, coefficients, nothing),
    ]
    assert set(errors) == {lib.OC_ERROR_NULL}
    assert lib.oc_save(nothing, coefficients, 1, image, 10**6) == 0
    assert lib.oc_save(ecu.state, nothing, 1, image, 10**6) == 0
    assert lib.oc_save(ecu.state, coefficients, 1, nothing, 10**6) == 0
    for state, of, slot in (
        (nothing, coefficients, image),
        (ecu.state, nothing, image),
        (ecu.state, coefficients, nothing),
    ):
        assert lib.oc_restore(state, of, slot, 24, nothing) == lib.OC_IMAGE_MISSING
        assert lib.oc_restore_newest(state, of, slot, slot, 24, nothing) == lib.OC_IMAGE_MISSING
    lib.oc_init(nothing)
    lib.oc_restart(nothing, 0.0)
    assert step(ecu)[0] == lib.OC_OK


@pytest.mark.parametrize("byte", [0x00, 0xA5])
def test_a_state_without_init_takes_no_tick_and_gives_no_answer(byte: int) -> None:
    ecu, answer = Ecu(), ffi.new("oc_answer *", {"offset": {"status": lib.OC_VALID}})
    ffi.memmove(ecu.state, bytes([byte]) * ffi.sizeof("oc_state"), ffi.sizeof("oc_state"))
    error, output = step(ecu)
    assert (error, output.offset_status, output.offset, output.reasons) == (lib.OC_ERROR_STATE, 0, 0.0, 1)
    assert lib.oc_answer_get(ecu.state, ecu.coefficients, answer) == lib.OC_ERROR_STATE
    assert answer.offset.status == lib.OC_UNOBSERVABLE
    assert lib.oc_save(ecu.state, ecu.coefficients, 1, ffi.new("uint8_t[]", 60_000), 60_000) == 0


def test_coefficients_without_a_successful_setup_take_no_tick() -> None:
    ecu = Ecu()
    assert step(ecu)[0] == lib.OC_OK
    wrong = _core._vehicle(0.0, RATIO, 0.0, 0.0)
    assert lib.oc_setup(ecu.coefficients, wrong, _core._params({}, "joint"), RATE_HZ) == lib.OC_ERROR_VEHICLE
    assert step(ecu)[0] == lib.OC_ERROR_SETUP
    ecu.coefficients = ffi.new("oc_coefficients *")
    error, output = step(ecu)
    assert (error, output.offset_status) == (lib.OC_ERROR_SETUP, lib.OC_UNOBSERVABLE)
    assert lib.oc_answer_get(ecu.state, ecu.coefficients, ffi.new("oc_answer *")) == lib.OC_ERROR_SETUP


def driven(factor: float, method: str = "joint", seconds: float = 300.0) -> tuple[Ecu, Any]:
    """An ECU set up for 100 Hz after a drive whose times are stretched by a factor, and its outputs."""
    columns = drive(3, RATE_HZ, seconds)
    columns["time_s"] = columns["time_s"] * factor
    return run(Ecu(method), columns)


def run(ecu: Ecu, columns: dict[str, Array]) -> tuple[Ecu, Any]:
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    return ecu.run(columns, outputs), outputs


@pytest.mark.parametrize("method", ["joint", "thesis"])
@pytest.mark.parametrize("factor", [0.5, 2.0, 1e3, 1e-3])
def test_ticks_at_half_or_twice_the_rate_or_in_milliseconds_give_no_offset(factor: float, method: str) -> None:
    ecu, outputs = driven(factor, method)
    assert (outputs["offset_status"] == lib.OC_UNOBSERVABLE).all()
    assert (outputs["reasons"][100:] == TIME).all()
    assert ecu.answer()["used"] == 0.0
    right, _ = driven(1.0, method)
    assert right.answer()["used"] > 60.0


def test_a_log_that_lacks_a_quarter_of_its_ticks_is_used() -> None:
    columns = drive(3, RATE_HZ, 300.0)
    kept = np.random.default_rng(1).random(len(columns["time_s"])) > 0.25
    _, outputs = run(Ecu(), {name: values[kept] for name, values in columns.items()})
    assert not (outputs["reasons"] & TIME).any()


def test_a_rate_that_changes_is_found_after_ten_seconds_and_its_return_after_one() -> None:
    columns = drive(3, RATE_HZ, 90.0)
    steps = np.full(9_000, 0.01)
    steps[3_000:6_000] = 0.02
    columns["time_s"] = np.cumsum(steps)
    rejected = np.flatnonzero(run(Ecu(), columns)[1]["reasons"] & TIME)
    assert (rejected == np.arange(rejected[0], rejected[-1] + 1)).all()
    assert 4_000 <= rejected[0] <= 4_200 and 6_000 <= rejected[-1] <= 6_200


def test_a_hole_of_a_minute_costs_no_tick() -> None:
    columns = drive(3, RATE_HZ, 90.0)
    columns["time_s"] = columns["time_s"] + np.where(columns["time_s"] > 30.0, 60.0, 0.0)
    assert not (run(Ecu(), columns)[1]["reasons"] & TIME).any()
