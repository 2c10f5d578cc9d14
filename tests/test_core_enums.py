"""Every value of every enum in the public headers is reached by a realistic cause."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from random_drives import Array, drive
from saved_ecu import Ecu, legs, sealed
from test_core_assignment import found as signal_faults
from test_core_change import bends, detected, noise
from test_core_reach import CAUSES, SPEED, WHEELS, YAW_RATE, core_of, refusal, steady
from test_core_sensor_fault import judged, weaving
from test_message import trouble_after

from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.signals import DEGREE, STATUSES

ENUMS = [name for name in ffi.list_types()[0] if name.startswith("oc_") and ffi.typeof(name).kind == "enum"]


def outputs_of(columns: dict[str, Array], method: str = "joint", angle_method: str = "observer") -> Any:
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core_of(method, angle_method).run(columns, outputs)
    return outputs


def ended(columns: dict[str, Array], method: str, angle_method: str) -> bytes:
    """State and outputs after a drive."""
    outputs, core = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE), core_of(method, angle_method)
    core.run(columns, outputs)
    return core.state_bytes() + _core._values(outputs)


def lost_for(begin: int, end: int) -> dict[str, Array]:
    """A drive of 200 s in which the sensor has no signal for some ticks."""
    columns = drive(1, 100.0, 200.0)
    columns["steering_wheel_angle_rad"][begin:end] = np.nan
    return columns


def with_all_signals() -> dict[str, Array]:
    moved = {name: 20.0 + 0.01 * k + np.sin(np.arange(6000) / (50 + k)) for k, name in enumerate(WHEELS)}
    columns = steady(**{SPEED: 20.0, YAW_RATE: 0.02 * np.sin(np.arange(6000) / 70.0), **moved})
    columns |= {"lateral_speed_m_s": 0.1 * np.sin(np.arange(6000) / 90.0)}
    columns |= {"steering_wheel_torque_nm": 0.5 * np.sin(np.arange(6000) / 40.0)}
    for k, status in enumerate(STATUSES):  # true for two seconds each
        columns[status] = (np.arange(6000) // 200 == 10 + k).astype(float)
    columns[SPEED][columns["reverse"] > 0.5] = 5.0
    return columns


CARRIED = {lib.OC_HAS_REAR_AXLE_ANGLE}  # bits that the core only carries so far


def own_way(names: tuple[str, ...], methods: Callable[[str], tuple[str, str]]) -> set[int]:
    """Methods whose result differs from those of all others."""
    made = [ended(with_all_signals(), *methods(name)) for name in names]
    return {k for k, end in enumerate(made) if made.count(end) == 1}


def signal_bits() -> set[int]:
    """Bits of the signals whose absence changes the result."""
    columns = with_all_signals()

    def ends(left_out: str | None) -> bytes:
        return ended({name: column for name, column in columns.items() if name != left_out}, "joint", "side-slip")

    whole = ends(None)
    return {_core._VALID_BITS[_core.COLUMNS[name]] for name in list(columns)[1:] if ends(name) != whole}


def reasons() -> set[int]:
    found = {int(np.bitwise_or.reduce(outputs_of(cause())["reasons"])) for cause in CAUSES.values()}
    core = core_of("thesis")
    core.run(steady())
    waits = core.answer()["rejected"][list(_core.REASONS).index("window")] > 0.0  # no tick has this reason
    return {1 << k for bits in found for k in range(32) if bits >> k & 1} | ({lib.OC_REASON_WINDOW} if waits else set())


def faults() -> set[int]:
    true, after = weaving(), np.arange(12_000) >= 4_000
    gone = after & (np.arange(12_000) < 4_300)
    spoiled = (
        np.where(after, np.nan, true),
        np.where(after, true[4_000], true),
        true + np.where(after, 30.0 * DEGREE, 0.0),
        true + np.maximum(np.arange(12_000) - 4_000, 0) * 0.004 * DEGREE,
        np.where(after, -true, true),
        np.where(gone, np.nan, true - np.where(after, 25.0 * DEGREE, 0.0)),
    )
    return {_core.FAULTS.index(name) for measured in spoiled for name in judged(measured, true)}


def changes() -> set[int]:
    after = np.arange(600) >= 300
    offset, loaded = noise(1, 600) + after * 3.0 * DEGREE, noise(2, 600) + after * 2.0 * DEGREE * np.sign(bends(600))
    return {lib.OC_CHANGE_NONE} | {
        change.kind for errors in (offset, loaded) for _, change in detected(errors, bends(600))
    }


def image_faults() -> set[int]:
    image = Ecu().run(legs(1, 60.0)).save()
    older, wild, damaged = bytearray(image), bytearray(image), bytearray(image)
    older[4] ^= 1
    damaged[-1] ^= 1
    wild[20:28] = b"\xff" * 8  # the clock
    images = (image, b"", image[:99], bytes(damaged), sealed(bytes(older)), sealed(bytes(wild)))
    names = [Ecu().restore(found) for found in images] + [Ecu("thesis").restore(image)]
    return {_core.IMAGE_FAULTS.index(name) for name in names}


def sources() -> set[int]:
    """The sources with a sensor before and after learning, and without a sensor, with and without a learned truck."""
    outputs = outputs_of(lost_for(19_000, 19_500), "thesis", "observer")
    measured, nothing = ffi.new("oc_signals *", {"valid": lib.OC_HAS_STEERING_WHEEL_ANGLE}), ffi.new("oc_signals *")
    ticks = (
        (outputs, 10, measured),
        (outputs, 18_900, measured),
        (outputs, 19_400, nothing),
        (outputs_of(lost_for(0, 500)), 300, nothing),
    )
    return {lib.oc_message_of(ffi.from_buffer("oc_output[]", rows) + k, tick, 0).source for rows, k, tick in ticks}


def failure_modes() -> set[int]:
    ended = [trouble_after([{"fault": k}], angle)[0].fmi for k in range(1, len(_core.FAULTS)) for angle in (0.2, -0.2)]
    return {int(fmi) for fmi in ended}


def errors() -> set[int]:
    wrong: tuple[dict[str, float], ...] = ({}, {"wheelbase": 0.0}, {"speed_min_m_s": -1.0}, {"rate_hz": 5.0})
    by_setup = {("ok", "vehicle", "params", "rate").index(refusal(**each)) for each in wrong}
    ecu, tick, zero = Ecu(), ffi.new("oc_signals *"), (ffi.new("oc_state *"), ffi.new("oc_coefficients *"))
    calls = ((ffi.NULL, ecu.coefficients), (ecu.state, zero[1]), (zero[0], ecu.coefficients))
    return by_setup | {lib.oc_step(state, coefficients, tick, ffi.NULL) for state, coefficients in calls}


def clock_verdicts() -> set[int]:
    clock = ffi.new("oc_clock *")
    return {lib.oc_clock_update(clock, 2, 1.0, time) for time in (5.0, 6.0, 1.0, 2.0, 3.0)}


def slopes() -> set[int]:
    """Parameters with a slope in a model of play, creep and wind-up on a winding road."""
    places, out = ffi.new("oc_places *"), ffi.new("float[]", lib.OC_SLOPE_COUNT)
    play = ffi.new("oc_play *", {"half_width": 0.05, "friction": 0.05, "creep": 1.0, "windup": 0.02, "unwinding": 0.5})
    with_slope = set()
    for k in range(400):
        by = {"angle": 0.2 * np.sin(k / 15.0), "centre": 0.0, "load": 0.5 * np.sin(k / 40.0), "step_s": 0.1}
        lib.oc_places_move(places, play, ffi.new("oc_play_motion *", by), out)
        with_slope |= {slope for slope in range(lib.OC_SLOPE_COUNT) if out[slope] != 0.0}
    return with_slope


REACHED: dict[str, Callable[[], set[int]]] = {
    "oc_signal_bit": lambda: signal_bits() | CARRIED,
    "oc_status": lambda: set(outputs_of(lost_for(18_000, 19_000), "thesis", "observer")["offset_status"].tolist()),
    "oc_reason": reasons,
    "oc_error": errors,
    "oc_clock_verdict": clock_verdicts,
    "oc_method": lambda: own_way(_core.METHODS, lambda name: (name, "observer")),
    "oc_angle_method": lambda: own_way(_core.ANGLE_METHODS, lambda name: ("joint", name)),
    "oc_fault": faults,
    "oc_signal_fault": signal_faults,
    "oc_change_kind": changes,
    "oc_image_fault": image_faults,
    "oc_angle_source": sources,
    "oc_fmi": failure_modes,
    "oc_slope": slopes,
}


@pytest.mark.parametrize("name", ENUMS)
def test_all_values_are_reached_and_all_have_names(name: str) -> None:
    named = {value for value, word in ffi.typeof(name).elements.items() if not word.endswith("_COUNT")}
    assert REACHED[name]() == named


# Effect of a fault on the offset


def test_during_a_fault_the_offset_is_invalid_and_keeps_its_value() -> None:
    begin, end = 18_000, 18_700
    for method in ("thesis", "joint"):
        outputs = outputs_of(lost_for(begin, end), method, "observer")
        status = np.array(_core.STATUSES)[outputs["offset_status"]]
        before = status[begin - 1]
        assert before in ("valid", "converging")
        assert set(status[begin : begin + 490]) == {before}  # a log or an ignition may end there
        assert set(status[begin + 500 : end + 99]) == {"invalid"}  # lost from 5 s on, back after a second
        assert outputs["offset"][end - 1] == pytest.approx(outputs["offset"][begin - 1], abs=0.1 * DEGREE)
        assert status[end + 110] == before
        core = core_of(method, "observer")
        core.run({name: column[:end] for name, column in lost_for(begin, end).items()})
        assert _core.STATUSES[core.answer()["offset"]["status"]] == "invalid"
        assert _core.FAULTS[core.answer()["fault"]] == "lost"


def test_an_offset_without_evidence_is_unobservable_even_during_a_fault() -> None:
    outputs = outputs_of(lost_for(0, 3_000), "joint", "observer")
    assert _core.FAULTS[outputs["fault"][2_000]] == "lost"
    assert _core.STATUSES[outputs["offset_status"][2_000]] == "unobservable"
