"""Saving and restoring: all members survive, and bad images are refused."""

import math
import struct
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from random_drives import RATIO, WHEELBASE, Array, damaged
from saved_ecu import FRESH, RATE_HZ, Ecu, legs, sealed, sliced

from oncenter import _core
from oncenter._native import ffi, lib

HEADER = struct.Struct("<4sIIIi")  # magic, layout, key, sequence, length
METHODS = _core.METHODS


@pytest.fixture(scope="module")
def day() -> dict[str, Array]:
    return legs(3)


@pytest.fixture(scope="module")
def image(day: dict[str, Array]) -> bytes:
    return Ecu().run(day).save(sequence=7)


# Round trip


def leaves(values: np.ndarray[Any, Any], name: str = "") -> Iterator[tuple[str, np.ndarray[Any, Any]]]:
    """All numbers as one-dimensional views of the same memory."""
    if values.dtype.names is None:
        yield name, values
        return
    for member in values.dtype.names:
        yield from leaves(values[member], f"{name}.{member}")


def test_every_real_member_survives(day: dict[str, Array]) -> None:
    ecu = Ecu().run(day)
    whole, count = ecu.whole(), 0
    for _, numbers in leaves(whole):
        if numbers.dtype.kind in "fu" and numbers.itemsize > 1 and numbers.dtype != np.uint32:
            for place in np.ndindex(numbers.shape):
                count += 1
                numbers[place] = count if numbers.dtype.kind == "u" else 0.125 + count * 2.0**-20
    covariance = ecu.evidence()["gyro_bias"]["P"]
    covariance[:] = np.eye(lib.OC_GYRO_BIAS_STATES) + 1e-3 * covariance  # symmetric up to rounding
    understeer = ecu.evidence()["understeer"]
    understeer["xx_xx"] = understeer["batches_xx"] ** 2  # as the squares of one batch
    assert count > 3000
    other = Ecu()
    assert other.restore(ecu.save()) == "ok"
    for (name, theirs), (_, ours) in zip(leaves(other.whole()), leaves(ecu.whole()), strict=True):
        assert (theirs == ours).all(), name


def test_every_whole_member_survives() -> None:
    """One after the other, since flags have few values."""
    names = [(name, n.shape) for name, n in leaves(Ecu().whole()) if n.dtype in (np.int32, np.uint32)]
    names.remove((".ready", (1,)))  # a restored state is ready
    assert len(names) > 50
    for k, (name, shape) in enumerate(names):
        for place in np.ndindex(shape):
            ecu, other = Ecu(), Ecu()
            dict(leaves(ecu.whole()))[name][place] = 1
            if name == ".evidence.joint.started":
                make_plausible(ecu)
            if name == ".evidence.torque.due":
                ecu.evidence()["torque"]["filling"]["ticks"] = 1
            if name == ".tracking.joint.due":
                for sd in ("unloading_sd", "yaw_rate_bias_sd"):
                    ecu.whole()["tracking"]["joint"]["prior"][sd] = 1.0
            assert other.restore(ecu.save()) == "ok", name
            assert other.values() == ecu.values(), names[k]


def make_plausible(ecu: Ecu) -> None:
    """Hypotheses without a division by zero."""
    joint = ecu.evidence()["joint"]
    joint["second"]["second_s"] = joint["second"]["reference"] = 1.0
    for name in ("half_width", "creep"):
        joint["hypotheses"]["play"][name] = 0.1
    joint["hypotheses"]["variance"] = 1.0
    joint["count"] = 1


@pytest.mark.parametrize("method", METHODS)
def test_the_state_of_any_drive_is_restored(method: str) -> None:
    columns = damaged(legs(2, 100.0, seed=5), 5)
    ecu = Ecu(method)
    for begin in range(0, 20_000, 1_237):
        ecu.run(sliced(columns, begin, begin + 1_237))
        other = Ecu(method)
        assert other.restore(ecu.save()) == "ok"
        assert other.values() == ecu.values()
        assert other.answer()["offset"] == ecu.answer()["offset"]


def test_an_image_is_restored_during_a_round_and_during_restarts_of_hypotheses() -> None:
    columns = legs(3, seed=11)
    ecu, other = Ecu(angle_method="observer"), Ecu(angle_method="observer")
    for begin in range(0, 30_000, 101):
        image = ecu.run(sliced(columns, begin, begin + 101)).save()
        assert other.restore(image) == "ok", begin
        assert other.values() == ecu.values()


@pytest.mark.parametrize("method", METHODS)
def test_a_state_of_nearly_constant_signals_is_restored(method: str) -> None:
    """Rounding could make their sums of squares negative."""
    t = np.arange(1_000) / RATE_HZ
    columns = {name: np.full(1_000, 0.03) for name in ("steering_wheel_angle_rad", "lateral_acceleration_m_s2")}
    columns |= {name: np.full(1_000, 20.1) for name in ("vehicle_speed_m_s", "wheel_speed_rear_left_m_s")}
    columns |= {"yaw_rate_rad_s": np.full(1_000, 1e-3), "wheel_speed_rear_right_m_s": columns["vehicle_speed_m_s"]}
    ecu, other = Ecu(method).run({"time_s": t} | columns), Ecu(method)
    assert other.restore(ecu.save()) == "ok"


def test_the_state_of_signals_decoded_from_wrong_bits_is_restored() -> None:
    rng = np.random.default_rng(1)
    columns = legs(2, 100.0, seed=5)
    for name, largest in (("steering_wheel_angle_rad", 90.0), ("yaw_rate_rad_s", 3.0), ("vehicle_speed_m_s", 70.0)):
        columns[name] = rng.uniform(0.0 if name == "vehicle_speed_m_s" else -largest, largest, len(columns[name]))
    ecu, other = Ecu().run(columns), Ecu()
    assert other.restore(ecu.save()) == "ok"


# Plausible as a signal (core/signals/signals.c), but not together: name and limit, exclusive.
LARGEST = {
    "steering_wheel_angle_rad": 100.0,
    "yaw_rate_rad_s": 10.0,
    "vehicle_speed_m_s": 150.0,
    "lateral_acceleration_m_s2": 100.0,
    "wheel_speed_rear_left_m_s": 150.0,
    "wheel_speed_rear_right_m_s": 150.0,
    "steering_wheel_torque_nm": 1e5,
}


def odd_drive(rng: np.random.Generator, begin_s: float) -> dict[str, Array]:
    """Up to a minute of bends or standstill, in which some signals are wrong: constant or alternating, of any size."""
    count = int(rng.integers(1, 300 if rng.random() < 0.7 else 6_000))
    t = np.arange(count) / RATE_HZ
    speed = float(rng.choice([0.0, 30.0, 149.0])) * rng.random()
    curvature = 0.05 * 10.0 ** -rng.uniform(1.0, 4.0) * np.sin(rng.uniform(0.1, 3.0) * t)
    turned = 0.5 * 1.9 * curvature * speed
    columns = {
        "steering_wheel_angle_rad": 90.0 * curvature + 0.05,
        "yaw_rate_rad_s": curvature * speed,
        "vehicle_speed_m_s": np.full(count, speed),
        "lateral_acceleration_m_s2": curvature * speed**2 + 0.2,
        "wheel_speed_rear_left_m_s": speed - turned,
        "wheel_speed_rear_right_m_s": speed + turned,
        "steering_wheel_torque_nm": 2.0 * curvature * speed**2,
    }
    for name, largest in LARGEST.items():
        if rng.random() < 0.3:
            size = largest * float(rng.choice([0.0, 0.999999, 10.0 ** -rng.uniform(0.0, 6.0)]))
            swing = largest * float(rng.choice([0.0, 0.0, 10.0 ** -rng.uniform(0.0, 6.0)]))
            columns[name] = size * float(rng.choice([-1.0, 1.0])) + swing * np.where(np.arange(count) % 2, 1.0, -1.0)
    return {"time_s": begin_s + t} | columns


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(20))
def test_the_state_of_odd_ticks_is_restored(seed: int, method: str) -> None:
    """Signals that are plausible one by one but not together: their combinations stay within the ranges of an image."""
    rng = np.random.default_rng(seed)
    ecu, other = Ecu(method), Ecu(method)
    for k in range(12):
        if rng.random() < 0.2:
            lib.oc_restart(ecu.state, float(rng.choice([math.nan, -1.0, 1e30, math.inf, 3600.0])))
        image = ecu.run(odd_drive(rng, 100.0 * k)).save()
        assert other.restore(image) == "ok", k
        assert other.save() == image


def test_a_state_of_constant_signals_at_standstill_is_restored() -> None:
    """Rounding carries their mean beyond the reading."""
    for reading in np.random.default_rng(1).uniform(-0.1, 0.1, 20):
        t = np.arange(2_000) / RATE_HZ
        columns = {"time_s": t, "vehicle_speed_m_s": np.zeros(2_000)}
        columns["steering_wheel_angle_rad"] = np.full(2_000, 3.0)  # in a turn it may creep, so a tick counts less
        columns |= {name: np.full(2_000, reading) for name in ("yaw_rate_rad_s", "lateral_acceleration_m_s2")}
        assert Ecu().restore(Ecu().run(columns).save()) == "ok", reading


@pytest.mark.parametrize("slope", [0.05, 2.0, 1000.0])
def test_a_state_with_the_force_of_a_rod_as_torque_is_restored(slope: float) -> None:
    """Its unit is that of the prior slope."""
    columns = legs(1)
    columns["steering_wheel_torque_nm"] = slope * columns["lateral_acceleration_m_s2"]
    ecu, other = (
        _core.Core(WHEELBASE, RATIO, {"torque_slope_n_m_m_s2": slope}, RATE_HZ, method="joint") for _ in range(2)
    )
    for begin in range(0, 15_000, 1_237):
        ecu.run(sliced(columns, begin, begin + 1_237))
        assert other.restore(ecu.save(1))[0] == "ok"


def test_an_image_has_the_same_bytes_on_every_machine(image: bytes) -> None:
    magic, _, _, sequence, length = HEADER.unpack(image[: HEADER.size])
    assert (magic, sequence, length) == (b"OCSV", 7, len(image))
    assert struct.unpack("<I", image[-4:]) == (zlib.crc32(image[:-4]),)
    ecu = Ecu()
    assert ecu.restore(image) == "ok"
    evidence = ecu.evidence()[0]
    clock = ecu.whole()["tracking"]["clock"][0]
    ints = [int(ecu.whole()["tracking"][name][0]) for name in ("has_complete", "running")]
    first = struct.pack("<ddiiddiiiid", *clock, *ints, float(ecu.whole()["tracking"]["last_complete"][0]))
    assert image[HEADER.size :].startswith(first)
    assert struct.pack("<7d", *evidence["offset"]["ticks"]) in image
    assert struct.pack("<Q", int(evidence["ticks"])) in image
    assert struct.pack(f"<{lib.OC_TERMS_TRIANGLE}f", *evidence["joint"]["hypotheses"][5]["scatter"]) in image


def test_a_buffer_of_the_stated_size_suffices_and_a_smaller_one_does_not() -> None:
    ecu = Ecu()
    assert lib.oc_save_size() <= ffi.sizeof("oc_state") + lib.OC_SAVE_OVERHEAD
    small = bytearray(lib.oc_save_size() - 1)
    assert lib.oc_save(ecu.state, ecu.coefficients, 1, ffi.from_buffer(small), len(small)) == 0
    assert not any(small)


# In pieces


def pieces_of(ecu: Ecu, sequence: int, size: int, *, tick_after: int = -1) -> bytes:
    """An image in pieces of `size` bytes; a tick comes after the piece of that number."""
    place, piece, image = ffi.new("oc_image_place *"), bytearray(size), b""
    lib.oc_save_begin(place, ecu.state, sequence)
    while written := lib.oc_save_piece(place, ecu.state, ecu.coefficients, ffi.from_buffer(piece), size):
        image += piece[:written]
        if len(image) == size * tick_after:
            lib.oc_step(ecu.state, ecu.coefficients, ffi.new("oc_signals *"), ffi.NULL)
    return image


def restored_in_pieces(ecu: Ecu, image: bytes, size: int) -> str:
    place, fault = ffi.new("oc_image_place *"), lib.OC_IMAGE_TRUNCATED
    lib.oc_restore_begin(place, ecu.state)
    for at in range(0, len(image), size):
        piece = image[at : at + size]
        fault = lib.oc_restore_piece(place, ecu.state, ecu.coefficients, ffi.from_buffer(piece), len(piece))
    return _core.IMAGE_FAULTS[fault]


@pytest.mark.parametrize("size", [4, 12, 256, 60_000])
def test_an_image_in_pieces_is_the_image_in_one(size: int, day: dict[str, Array], image: bytes) -> None:
    assert pieces_of(Ecu().run(day), 7, size) == image
    ecu, other = Ecu(), Ecu()
    assert restored_in_pieces(ecu, image + b"\xff" * 300, size) == other.restore(image) == "ok"
    assert ecu.values() == other.values()


def test_a_tick_while_an_image_is_saved_in_pieces_ends_the_saving(day: dict[str, Array]) -> None:
    ecu = Ecu().run(day)
    torn = pieces_of(ecu, 7, 256, tick_after=20)
    assert len(torn) == 20 * 256
    assert Ecu().restore(torn.ljust(lib.oc_save_size(), b"\xff")) == "damaged"


def test_a_state_that_is_half_restored_takes_no_tick(image: bytes) -> None:
    ecu, tick = Ecu(), ffi.new("oc_signals *")
    assert restored_in_pieces(ecu, image[:-4], 256) == "truncated"
    assert lib.oc_step(ecu.state, ecu.coefficients, tick, ffi.NULL) == lib.OC_ERROR_STATE
    assert lib.oc_save_piece(ffi.new("oc_image_place *"), ecu.state, ecu.coefficients, ffi.new("uint8_t[4]"), 4) == 0
    lib.oc_init(ecu.state)
    assert lib.oc_step(ecu.state, ecu.coefficients, tick, ffi.NULL) == lib.OC_OK


def test_a_damaged_image_in_pieces_leaves_nothing_learned(image: bytes) -> None:
    rng = np.random.default_rng(4)
    for _ in range(100):
        ecu = Ecu()
        bad = corrupted(image, rng)
        fault = restored_in_pieces(ecu, bad, 256)
        assert fault in ("missing", "truncated", "damaged")
        if fault != "truncated":
            assert ecu.values() == FRESH
            assert lib.oc_step(ecu.state, ecu.coefficients, ffi.new("oc_signals *"), ffi.NULL) == lib.OC_OK


# Refused


def corrupted(image: bytes, rng: np.random.Generator) -> bytes:
    """Damage as by flash, power cuts and bad software; never the valid image."""
    damaged_image = bytearray(image)
    begin, end = sorted(int(k) for k in rng.integers(0, len(image) + 1, 2))
    match int(rng.integers(0, 7)):
        case 0:
            for place in rng.integers(0, 8 * len(image), int(rng.integers(1, 9))):
                damaged_image[place // 8] ^= 1 << place % 8
        case 1:
            del damaged_image[begin:]
        case 2:
            damaged_image[begin:end] = b"\xff" * (end - begin)
        case 3:
            damaged_image[begin:end] = bytes(end - begin)
        case 4:
            damaged_image[begin:end] = rng.bytes(end - begin)
        case 5:
            del damaged_image[begin:end]
        case 6:
            damaged_image[begin:end] = damaged_image[begin:end][::-1]
    return bytes(damaged_image) if damaged_image != image else image[:-1]


def test_none_of_a_thousand_corrupted_images_is_restored(image: bytes) -> None:
    rng = np.random.default_rng(1)
    faults = set()
    for _ in range(1_000):
        ecu = Ecu()
        fault = ecu.restore(corrupted(image, rng))
        assert fault != "ok"
        assert ecu.values() == FRESH
        faults.add(fault)
    assert {"truncated", "damaged"} <= faults <= {"missing", "truncated", "damaged"}


def test_no_corrupted_image_with_a_valid_crc_crashes_the_core(image: bytes, day: dict[str, Array]) -> None:
    """An attacker or an error before the CRC makes such images: an accepted value does not crash the core."""
    rng = np.random.default_rng(2)
    faults = set()
    for _ in range(300):
        damaged_image = bytearray(image)
        for place in rng.integers(HEADER.size, len(image) - 4, int(rng.integers(1, 4))):
            damaged_image[place] = int(rng.integers(0, 256))
        ecu = Ecu()
        faults.add(ecu.restore(sealed(bytes(damaged_image))))
        ecu.run(sliced(day, 5_000, 5_400))
        ecu.answer()
    assert faults == {"ok", "implausible"}


EXTREMES = [math.nan, math.inf, *(s * x for x in (0.0, 1e-45, 1e-20, 1.0, 1e3, 1e6, 1e15, 3e38) for s in (1.0, -1.0))]


def with_wrong_members(ecu: Ecu, rng: np.random.Generator) -> bytes:
    """An image in which a few numbers of one member are huge, tiny, negated or NaN."""
    members = [numbers for _, numbers in leaves(ecu.whole()) if numbers.dtype.kind == "f"]
    sizes = np.array([numbers.size for numbers in members])
    numbers = members[int(rng.choice(len(members), p=sizes / sizes.sum() if rng.random() < 0.5 else None))]
    for place in rng.integers(0, numbers.size, int(rng.integers(1, 4))):
        value = float(numbers.flat[place])
        exponent = float(rng.uniform(-44.0, 38.0))
        wrong = (float(rng.choice(EXTREMES)), -value, 10.0**exponent, -(10.0**exponent), value * 1e4)
        with np.errstate(over="ignore", under="ignore"):
            numbers[np.unravel_index(place, numbers.shape)] = wrong[int(rng.integers(len(wrong)))]
    return ecu.save()


def with_wrong_bits(image: bytes, rng: np.random.Generator) -> bytes:
    damaged_image = bytearray(image)
    for place in rng.integers(8 * HEADER.size, 8 * (len(image) - 4), int(rng.integers(1, 9))):
        damaged_image[place // 8] ^= 1 << place % 8
    return sealed(bytes(damaged_image))


def numbers_of(answer: Any) -> Iterator[float]:
    """All numbers of an answer, including its parts."""
    if isinstance(answer, float):
        yield answer
    elif isinstance(answer, dict | list):
        for part in answer.values() if isinstance(answer, dict) else answer:
            yield from numbers_of(part)


def tells_numbers(ecu: Ecu, columns: dict[str, Array]) -> bool:
    """Whether all following outputs and the answers before and after are finite."""
    outputs = np.zeros(len(columns["time_s"]), _core.dtype_of(ffi.typeof("oc_output")))
    before = ecu.answer()
    after = ecu.run(columns, outputs).answer()
    return bool(np.isfinite([*numbers_of(before), *numbers_of(after)]).all()) and all(
        np.isfinite(values).all() for _, values in leaves(outputs) if values.dtype.kind == "f"
    )


@pytest.mark.parametrize(
    ("method", "angle_method", "count"),
    [("joint", "observer", 700), ("thesis", "yaw-rate-understeer", 150), ("wheel-speed", "wheel-speed-exact", 150)],
)
def test_a_corrupted_image_with_a_valid_crc_is_refused_or_gives_finite_numbers(
    method: str, angle_method: str, count: int
) -> None:
    columns = legs(3, 120.0, seed=11)
    for side in ("left", "right"):
        columns[f"wheel_speed_front_{side}_m_s"] = columns[f"wheel_speed_rear_{side}_m_s"]
    ecu, saved, at = Ecu(method, angle_method=angle_method), [], 0
    for end in (2_000, 9_003, 16_050, 26_059):  # the second and the fourth during a round
        saved.append((end, ecu.run(sliced(columns, at, end)).save()))
        at = end
    rng = np.random.default_rng(3)
    accepted, silent = 0, []
    for k in range(count):
        begin, image = saved[k % len(saved)]
        ecu = Ecu(method, angle_method=angle_method)
        assert ecu.restore(image) == "ok"
        damaged_image = with_wrong_members(ecu, rng) if rng.random() < 0.6 else with_wrong_bits(image, rng)
        if ecu.restore(damaged_image) == "ok":
            accepted += 1
            if not tells_numbers(ecu, sliced(columns, begin, begin + 9_000)):
                silent.append(k)
    assert silent == []
    assert accepted > count // 4


def with_member(set_: Callable[[Any], None], day: dict[str, Array]) -> bytes:
    ecu = Ecu().run(day)
    set_(ecu.whole())
    return ecu.save()


def _set(path: str, value: float) -> Callable[[Any], None]:
    *outer, last = path.split(".")

    def put(evidence: Any) -> None:
        for name in outer:
            evidence = evidence[name]
        evidence[last] = value

    return put


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("evidence.bank_sum", math.nan),
        ("evidence.bank_sum", math.inf),
        ("evidence.offset.ticks.weight", -1.0),
        ("evidence.offset.batches.xx", -1.0),
        ("evidence.offset.batches.x", 201.0),
        ("evidence.understeer.filling.xx", -1.0),
        ("evidence.understeer.filling.y", -201.0),
        ("evidence.understeer.xx_xx", -1.0),
        ("evidence.standstill.yaw_rate.mean", 11.0),
        ("evidence.standstill.lateral_acceleration.squares", -1.0),
        ("evidence.gyro_bias.x", math.nan),
        ("evidence.gyro_bias.x", 11.0),
        ("evidence.gyro_bias.P", -1e-9),
        ("evidence.gyro_bias.sd", -1e-9),
        ("evidence.gyro_bias.still.mean", 11.0),
        ("evidence.gyro_bias.past.covariance", 1.1),
        ("evidence.gyro_bias.axles.blocks", -1.0),
        ("evidence.gyro_bias.axles.noise", 1.1),
        ("evidence.gyro_bias.status", 4),
        ("evidence.joint.best", lib.OC_JOINT_HYPOTHESES),
        ("evidence.joint.best", -1),
        ("evidence.joint.changes", -1),
        ("evidence.joint.count", lib.OC_JOINT_HYPOTHESES + 1),
        ("evidence.joint.along", 1.6),
        ("evidence.joint.second.memory_share", 1.1),
        ("evidence.joint.hypotheses.long_blocks.factor", -1.0),
        ("evidence.joint.hypotheses.weight", -1.0),
        ("evidence.joint.hypotheses.set_up_variance", -1e-9),
        ("evidence.joint.hypotheses.pull_variance", -1e-9),
        ("evidence.joint.hypotheses.gradient", 2e5),
        ("evidence.joint.hypotheses.means", 2e6),
        ("evidence.joint.hypotheses.play.unwinding", -201.0),
        ("evidence.joint.hypotheses.variances.of", -1e-9),
        ("evidence.joint.hypotheses.variance", 0.0),
        ("evidence.joint.hypotheses.scatter", -1.0),
        ("evidence.joint.hypotheses.places.inner", math.nan),
        ("evidence.joint.changed.change.kind", 3),
        ("evidence.ticks", 2**60),
        ("evidence.torque.covariance", 2e4),
        ("evidence.torque.filling.place", 2e6),
        ("evidence.angle.seconds", -1.0),
        ("learned.offset.standard_deviation", -1.0),
        ("learned.understeer_gradient.evidence", -1.0),
        ("learned.equivalent_wheelbase.value", 2e5),
        ("learned.truck.offset_sd", 2e5),
        ("tracking.clock.last_time", math.nan),
        ("tracking.preprocess.angle", 201.0),
        ("tracking.preprocess.angle_next", lib.OC_DELAY_MAX),
        ("tracking.preprocess.speed_next", -1),
        ("tracking.assignment.pairs.oldest", lib.OC_LAG_COUNT),
        ("tracking.straight.first", lib.OC_PENDING_MAX),
        ("tracking.straight.blocks.xx", -1.0),
        ("tracking.cornering.blocks.y", 201.0),
        ("tracking.cornering.filling.y", 2e5),
        ("tracking.cornering.count", lib.OC_PENDING_MAX + 1),
        ("tracking.joint.filling.count", lib.OC_JOINT_SAMPLES),
        ("tracking.joint.due", 2 * lib.OC_JOINT_HYPOTHESES + 2),
        ("tracking.joint.prior.unloading_mean", 101.0),
        ("tracking.angle.estimate", math.inf),
        ("tracking.angle.yaw_rate", -11.0),
        ("tracking.angle.place_variance", -1e-9),
        ("tracking.fault.fault", lib.OC_FAULT_COUNT),
    ],
)
def test_a_value_that_no_drive_can_produce_is_implausible(path: str, value: float, day: dict[str, Array]) -> None:
    ecu = Ecu()
    assert ecu.restore(with_member(_set(path, value), day)) == "implausible"
    assert ecu.values() == FRESH


def test_an_image_of_another_layout_is_refused_by_name(image: bytes) -> None:
    older = bytearray(image)
    older[4] ^= 1
    assert Ecu().restore(sealed(bytes(older))) == "layout"
    shorter = bytearray(image[:-12] + image[-4:])
    struct.pack_into("<I", shorter, 16, len(shorter))
    assert Ecu().restore(sealed(bytes(shorter))) == "layout"


def test_an_image_of_other_vehicle_params_methods_or_rate_is_foreign(image: bytes) -> None:
    keyed = 0
    for struct_name in ("vehicle", "params"):
        dtype = _core.dtype_of(ffi.typeof("oc_coefficients"))
        blank = np.zeros(1, dtype)[struct_name]
        for name, numbers in leaves(blank):
            for place in np.ndindex(numbers.shape):
                ecu = Ecu()
                native = np.frombuffer(ffi.buffer(ecu.coefficients), dtype)[0:1][struct_name]
                dict(leaves(native))[name][place] += 1
                assert ecu.restore(image) == "foreign", name
                assert ecu.values() == FRESH
                keyed += 1
    assert keyed > 50
    assert Ecu(rate_hz=50.0).restore(image) == "foreign"
    assert Ecu().restore(image) == "ok"


@pytest.mark.parametrize(
    ("bytes_", "fault"),
    [(b"", "missing"), (b"\xff" * 14_000, "missing"), (bytes(14_000), "missing"), (b"OCSV", "truncated")],
)
def test_a_slot_that_was_never_written_holds_no_image(bytes_: bytes, fault: str) -> None:
    assert Ecu().restore(bytes_) == fault


def test_bytes_after_an_image_are_ignored(image: bytes) -> None:
    assert Ecu().restore(image + b"\xff" * 100) == "ok"
