"""Ignition cycles: two slots, power cuts at any time, ignitions."""

import itertools
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from random_drives import RATIO, WHEELBASE, Array, Truth, drive
from saved_ecu import FRESH, RATE_HZ, Ecu, legs, sealed, sliced

import oncenter as oc
from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.vehicle import Vehicle

METHODS = _core.METHODS


@pytest.fixture(scope="module")
def day() -> dict[str, Array]:
    return legs(3)


@pytest.fixture(scope="module")
def image(day: dict[str, Array]) -> bytes:
    return Ecu().run(day).save(sequence=7)


# Two slots


def restore_newest(ecu: Ecu, slots: list[bytes]) -> tuple[str, int]:
    size = max(map(len, slots))
    padded = [slot + b"\xff" * (size - len(slot)) for slot in slots]
    sequence = ffi.new("uint32_t *")
    first, second = (ffi.from_buffer(slot) for slot in padded)
    fault = lib.oc_restore_newest(ecu.state, ecu.coefficients, first, second, size, sequence)
    return _core.IMAGE_FAULTS[fault], sequence[0]


def test_a_power_cut_during_writing_loses_only_that_interval(day: dict[str, Array]) -> None:
    ecu = Ecu()
    slots = [b"", b""]
    before = FRESH
    for sequence in range(1, 6):
        ecu.run(sliced(day, 6_000 * sequence, 6_000 * sequence + 6_000))
        new, old = ecu.save(sequence), slots[sequence % 2].ljust(lib.oc_save_size(), b"\xff")
        for cut in [*range(24), *range(24, len(new), 997), len(new) - 1]:
            torn = list(slots)
            torn[sequence % 2] = new[:cut] + old[cut:]
            if torn[sequence % 2] == new:  # the unwritten bytes were equal by chance
                continue
            after = Ecu()
            fault, found = restore_newest(after, torn)
            assert after.values() == before
            assert (fault, found) == (("ok", sequence - 1) if sequence > 1 else (fault, 0))
        slots[sequence % 2], before = new, ecu.values()
        after = Ecu()
        assert restore_newest(after, slots) == ("ok", sequence)
        assert after.values() == before


@pytest.mark.parametrize("newer", [1, 6, 2**31, 2**32 - 1, 2**32])
def test_the_newer_image_is_restored_also_when_the_sequence_overflows(newer: int, day: dict[str, Array]) -> None:
    images = [b"", b""]
    images[(newer - 1) % 2] = Ecu().run(sliced(day, 0, 2_000)).save((newer - 1) % 2**32)
    images[newer % 2] = Ecu().run(sliced(day, 0, 3_000)).save(newer % 2**32)
    ecu = Ecu()
    assert restore_newest(ecu, images) == ("ok", newer % 2**32)
    assert ecu.answer()["duration"] == pytest.approx(30.0)


# Ignition cycles


def cycled(ways: tuple[str, str], columns: dict[str, Array], cuts: list[int], outputs: Any = None) -> Ecu:
    """Power cuts at these ticks, without a lost tick: another ECU continues from the image."""
    ecu = Ecu(ways[0], angle_method=ways[1])
    for begin, end in itertools.pairwise([0, *cuts, len(columns["time_s"])]):
        if begin:
            image = ecu.save()
            ecu = Ecu(ways[0], angle_method=ways[1])
            assert ecu.restore(image) == "ok"
        ecu.run(sliced(columns, begin, end), None if outputs is None else outputs[begin:end])
    return ecu


def whole_day(seed: int) -> tuple[dict[str, Array], Array]:
    """Standstill, creeping, reversing, hairpins, hard braking, a steep bank, a lost signal, a hole; and the rows'
    reasons."""
    columns = legs(2, 150.0, seed)
    t = columns["time_s"] % 150.0
    slow, hairpin, back = (t > 50) & (t < 60), (t > 70) & (t < 75), (t > 85) & (t < 90)
    speed = columns["vehicle_speed_m_s"]
    speed[slow] *= 0.2
    speed[back] = -1.5
    speed += np.where((t > 100) & (t < 104), 1.5 * (t - 104), 0.0)
    columns["yaw_rate_rad_s"] += np.where(hairpin, 1.5, 0.0)
    columns["lateral_acceleration_m_s2"] += np.where(hairpin, 0.3 * speed, 0.0) + np.where(abs(t - 115) < 2, 2.0, 0.0)
    columns["steering_wheel_angle_rad"] += np.where(hairpin, RATIO * WHEELBASE * 1.5 / np.maximum(speed, 1.0), 0.0)
    columns["steering_wheel_angle_rad"][abs(t - 65) < 0.5] = np.nan
    columns = {name: values[abs(t - 120) > 1.0] for name, values in columns.items()}
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    cycled(("joint", "observer"), columns, [], outputs)
    return columns, outputs["reasons"]


REASONS_OF_A_DAY = [
    bit for name, bit in _core.REASONS.items() if name not in ("time", "window", "yaw_rate_bias", "signal_fault")
]
WAYS = [("joint", "observer"), ("thesis", "yaw-rate-understeer"), ("wheel-speed", "wheel-speed")]


@pytest.mark.parametrize("ways", WAYS)
@pytest.mark.parametrize("seed", [11, 12])
def test_cycles_while_the_gate_is_closed_change_no_bit_whatever_the_reason(ways: tuple[str, str], seed: int) -> None:
    columns, reasons = whole_day(seed)
    rng = np.random.default_rng(seed)
    there = [bit for bit in REASONS_OF_A_DAY if (reasons & bit).any()]
    cuts = [int(rng.choice(np.flatnonzero(reasons & bit))) + k for bit in there for k in (0, 1)]
    outputs, others = (np.zeros(len(reasons), _core.OUTPUT_DTYPE) for _ in range(2))
    uninterrupted, ecu = cycled(ways, columns, [], outputs), cycled(ways, columns, sorted({*cuts}), others)
    assert ecu.answer() == uninterrupted.answer()
    assert ecu.values() == uninterrupted.values()
    assert _core._values(others) == _core._values(outputs)


@pytest.mark.parametrize("ways", WAYS)
def test_a_power_cut_while_driving_without_lost_ticks_changes_no_bit(
    ways: tuple[str, str], day: dict[str, Array]
) -> None:
    uninterrupted = cycled(ways, day, [])
    ecu = cycled(ways, day, [2_500, 4_321, 7_003, 7_004, 20_000, 33_333])
    assert ecu.values() == uninterrupted.values()


@pytest.mark.parametrize("ways", WAYS)
@pytest.mark.parametrize("lost", [20, 100])
def test_a_power_cut_with_lost_ticks_costs_their_evidence_and_a_gate_window(
    ways: tuple[str, str], lost: int, day: dict[str, Array]
) -> None:
    """t1 of pending ticks, some 1.1 s of filter settling, and part of a block at each end."""
    uninterrupted = cycled(ways, day, []).answer()
    moved = []
    for cut in (2_500, 4_321, 7_003, 20_000, 33_333):
        columns = {name: np.delete(values, np.s_[cut : cut + lost]) for name, values in day.items()}
        found = cycled(ways, columns, [cut]).answer()
        assert -0.1 <= uninterrupted["used"] - found["used"] <= 2.0 + 1.2 + 2 * 0.1 + lost / RATE_HZ
        moved.append(found["offset"]["value"] - uninterrupted["offset"]["value"])
    assert np.sqrt(np.mean(np.square(moved))) < 0.25 * uninterrupted["offset"]["standard_deviation"]


def test_a_restored_state_detects_lost_ticks_by_their_time() -> None:
    """It acts as after any hole: the filters settle again and the heading is unknown."""
    columns = {name: np.delete(values, np.s_[6_000:6_500]) for name, values in legs(1).items()}
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    cycled(("joint", "observer"), columns, [6_000], outputs)
    assert outputs["reasons"][6_000] == _core.REASONS["gap"] | _core.REASONS["settling"]
    assert outputs["reasons"][6_050] & _core.REASONS["settling"]


@pytest.mark.parametrize("cut", [0, 1, 27, 31, 150])
def test_a_bias_identified_at_the_end_of_a_drive_corrects_all_hypotheses_also_after_a_power_cut(cut: int) -> None:
    """0.57 deg/s of gyro bias, observable only at the last standstill; power cut `cut` ticks after its start."""
    truth = Truth(yaw_rate_bias=0.01)
    columns = sliced(drive(2, RATE_HZ, 240.0, truth), 2_000, 24_000)
    stop = int(np.flatnonzero(columns["vehicle_speed_m_s"] > 0.1)[-1]) + 1
    ecu = Ecu().run(sliced(columns, 0, stop))
    before = ecu.answer()["offset"]
    other = Ecu()
    assert other.restore(ecu.run(sliced(columns, stop, stop + cut)).save()) == "ok"
    after = other.run(sliced(columns, stop + cut, len(columns["time_s"]))).answer()["offset"]
    assert abs(after["value"] - truth.offset) < 0.4 * abs(before["value"] - truth.offset)
    assert after["standard_deviation"] < 0.7 * before["standard_deviation"]  # the play is not identified


def test_a_correction_applies_to_all_hypotheses_at_once_after_the_round(
    day: dict[str, Array],
) -> None:
    """So that all of them use samples with the same bias."""
    ecu = Ecu().run(sliced(day, 0, 5_000))
    joint, tracking = ffi.addressof(ecu.state.evidence, "joint"), ffi.addressof(ecu.state.tracking, "joint")
    design, k = ffi.addressof(ecu.coefficients, "joint"), 5_000
    while tracking.due == 0:
        ecu.run(sliced(day, k, k + 1))
        k += 1
    assert not lib.oc_joint_correct(joint, tracking, design, 1e-3, True)
    while tracking.due > 0:
        ecu.run(sliced(day, k, k + 1))
        k += 1
    before = [h.target_mean for h in joint.hypotheses[0 : joint.count]]
    assert lib.oc_joint_correct(joint, tracking, design, 1e-3, True)
    after = [h.target_mean for h in joint.hypotheses[0 : joint.count]]
    assert all(a != b for a, b in zip(before, after, strict=True))
    assert joint.solves_all


def test_a_hole_loses_the_heading_and_a_standstill_does_not(day: dict[str, Array]) -> None:
    def heading(ecu: Ecu) -> float:
        joint = ecu.evidence()["joint"][0]
        assert math.hypot(joint["along"], joint["across"]) == pytest.approx(1.0, abs=1e-5)
        return math.atan2(joint["across"], joint["along"])

    before, after = sliced(day, 0, 14_000), sliced(day, 14_200, 14_201)
    ecu = Ecu().run(before)
    assert abs(heading(ecu)) > 1e-3
    ecu.run(after)
    assert abs(heading(ecu)) < 1e-3
    standing = Ecu().run(sliced(day, 0, 14_800))
    kept = heading(standing)
    standing.run(sliced(day, 14_800, 15_200))
    assert heading(standing) == kept != 0.0


@pytest.mark.parametrize("method", METHODS)
def test_an_ignition_is_the_same_with_and_without_a_loss_of_power(method: str, day: dict[str, Array]) -> None:
    for cut in (15_000, 20_000):
        kept = Ecu(method).run(sliced(day, 0, cut))
        lost = Ecu(method)
        assert lost.restore(kept.save()) == "ok"
        later = sliced(day, cut, len(day["time_s"])) | {"time_s": day["time_s"][: len(day["time_s"]) - cut]}
        for ecu in (kept, lost):
            lib.oc_restart(ecu.state, 0.0)
            ecu.run(later)
        assert kept.values() == lost.values()


def test_an_ignition_adds_more_uncertainty_to_the_gyro_than_a_loss_of_power(
    image: bytes, day: dict[str, Array]
) -> None:
    spreads = []
    for restart in (False, True):
        ecu = Ecu()
        assert ecu.restore(image) == "ok"
        if restart:
            lib.oc_restart(ecu.state, 0.0)
        ecu.run(sliced(day, 2_000, 2_001))
        spreads.append(math.sqrt(ecu.evidence()["gyro_bias"]["P"][0, 0, 0]))
    assert spreads[0] < spreads[1]


def test_saving_and_restoring_over_and_over_changes_nothing(image: bytes) -> None:
    """A correction is applied once, however often the evidence is restored."""
    ecu = Ecu()
    assert ecu.restore(image) == "ok"
    answer = ecu.answer()
    for _ in range(5):
        again = ecu.save(sequence=7)
        assert again == image
        ecu = Ecu()
        assert ecu.restore(again) == "ok"
        assert ecu.answer() == answer


# Python's interface


@pytest.fixture(scope="module")
def truck() -> Vehicle:
    return oc.vehicle(Path(__file__).parents[1] / "vehicles" / "scania_r730_4x2.toml")


def stepped(monitor: oc.Monitor, columns: dict[str, Array]) -> list[Any]:
    rows = zip(*columns.values(), strict=True)
    return [monitor.step(oc.Tick(**dict(zip(columns, map(float, row), strict=True)))) for row in rows]


def test_a_monitor_continues_after_a_power_cut(truck: Vehicle, day: dict[str, Array]) -> None:
    kept, lost = oc.Monitor(truck), oc.Monitor(truck)
    stepped(kept, sliced(day, 6_000, 15_000))
    lost.restore(kept.save())
    later = sliced(day, 15_000, 21_000)
    assert stepped(kept, later)[-1] == stepped(lost, later)[-1]
    sequences = [struct.unpack_from("<I", monitor.save(), 12)[0] for monitor in (kept, kept, lost)]
    assert sequences == [2, 3, 2]


def test_a_refused_image_gives_a_reason_and_an_initial_monitor(truck: Vehicle, day: dict[str, Array]) -> None:
    taught = oc.Monitor(truck)
    stepped(taught, sliced(day, 6_000, 7_000))
    image = taught.save()
    nan = bytearray(image)
    nan[-12:-4] = struct.pack("<d", math.nan)
    layout = bytearray(image)
    layout[4] ^= 1
    flipped = bytearray(image)
    flipped[5_000] ^= 1
    foreign = oc.Monitor(truck.model_copy(update={"wheelbase_m": 4.0})).save()
    fresh = oc.Monitor(truck)
    for hurt, code in (
        (b"", "missing"),
        (image[:100], "truncated"),
        (bytes(flipped), "damaged"),
        (sealed(bytes(layout)), "layout"),
        (foreign, "foreign"),
        (sealed(bytes(nan)), "implausible"),
    ):
        with pytest.raises(oc.OncenterError) as error:
            taught.restore(hurt)
        assert error.value.code == f"image_{code}"
        assert "\n" not in str(error.value)
        assert "the estimates start without it" in str(error.value)
        assert taught._core.state_bytes() == fresh._core.state_bytes()
