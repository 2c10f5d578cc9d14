"""What outlives an ignition cycle: every member there and back, images that are refused, two slots, cycles."""

import math
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oncenter._native import ffi, lib
from random_drives import RATIO, WHEELBASE, Array, Truth, damaged, drive

import oncenter as oc
from oncenter import _core
from oncenter.vehicle import Vehicle

RATE_HZ = 100.0
TRACK = 1.9  # m
HEADER = struct.Struct("<4sIIIi")  # magic, layout, key, sequence, length
METHODS = _core.METHODS


class Ecu:
    """Coefficients and state as firmware holds them."""

    def __init__(self, method: str = "joint", rate_hz: float = RATE_HZ) -> None:
        self.coefficients, self.state = ffi.new("oc_coefficients *"), ffi.new("oc_state *")
        vehicle = _core._vehicle(WHEELBASE, RATIO, TRACK, TRACK, 1.0)
        assert lib.oc_setup(self.coefficients, vehicle, _core._params({}, method), rate_hz) == lib.OC_OK
        lib.oc_init(self.state)

    def run(self, columns: dict[str, Array]) -> "Ecu":
        native = ffi.new("oc_columns *", {"count": len(columns["time_s"])})
        kept = {_core.COLUMNS[name]: np.ascontiguousarray(values) for name, values in columns.items()}
        for name, values in kept.items():
            setattr(native, name, ffi.from_buffer("double[]", values))
        lib.oc_run(self.state, self.coefficients, native, ffi.NULL)
        return self

    def save(self, sequence: int = 1) -> bytes:
        image = bytearray(lib.oc_save_size())
        assert lib.oc_save(self.state, self.coefficients, sequence, ffi.from_buffer(image), len(image)) == len(image)
        return bytes(image)

    def restore(self, image: bytes) -> str:
        fault = lib.oc_restore(self.state, self.coefficients, ffi.from_buffer(image), len(image), ffi.new("uint32_t *"))
        return _core.IMAGE_FAULTS[fault]

    def evidence(self) -> Any:
        """Over the native memory itself."""
        native = np.frombuffer(ffi.buffer(self.state), _core.dtype_of(ffi.typeof("oc_state")))
        return native[0:1]["evidence"]

    def values(self) -> bytes:
        return _core._values(self.evidence()[0])

    def answer(self) -> dict[str, Any]:
        native = ffi.new("oc_answer *")
        lib.oc_answer_get(self.state, self.coefficients, native)
        return _core._members(native)


FRESH = Ecu().values()


def legs(count: int, seconds: float = 150.0, seed: int = 1) -> dict[str, Array]:
    """Drives one after the other, each of which begins and ends standing; with the rear wheels' speeds."""
    drives = [drive(seed + k, RATE_HZ, seconds) for k in range(count)]
    columns = {name: np.concatenate([d[name] for d in drives]) for name in drives[0]}
    columns["time_s"] = np.arange(len(columns["time_s"])) / RATE_HZ
    speed, turning = columns["vehicle_speed_m_s"], 0.5 * TRACK * columns["yaw_rate_rad_s"]
    return columns | {"wheel_speed_rear_left_m_s": speed - turning, "wheel_speed_rear_right_m_s": speed + turning}


def sliced(columns: dict[str, Array], begin: int, end: int) -> dict[str, Array]:
    return {name: values[begin:end] for name, values in columns.items()}


@pytest.fixture(scope="module")
def day() -> dict[str, Array]:
    return legs(3)


@pytest.fixture(scope="module")
def image(day: dict[str, Array]) -> bytes:
    return Ecu().run(day).save(sequence=7)


def sealed(image: bytes) -> bytes:
    """With the CRC-32 that its bytes ask for."""
    return image[:-4] + struct.pack("<I", zlib.crc32(image[:-4]))


# There and back


def leaves(values: np.ndarray[Any, Any], name: str = "") -> Iterator[tuple[str, np.ndarray[Any, Any]]]:
    """All numbers as arrays of one dimension that look at the same memory."""
    if values.dtype.names is None:
        yield name, values
        return
    for member in values.dtype.names:
        yield from leaves(values[member], f"{name}.{member}")


def test_every_real_member_survives(day: dict[str, Array]) -> None:
    ecu = Ecu().run(day)
    evidence, count = ecu.evidence(), 0
    for _, numbers in leaves(evidence):
        if numbers.dtype.kind in "fu" and numbers.itemsize > 1 and numbers.dtype != np.uint32:
            for place in np.ndindex(numbers.shape):
                count += 1
                numbers[place] = count if numbers.dtype.kind == "u" else 0.125 + count * 2.0**-20
    evidence["gyro_bias"]["P"] += np.eye(lib.OC_GYRO_BIAS_STATES)  # a covariance still
    assert count > 2000
    other = Ecu()
    assert other.restore(ecu.save()) == "ok"
    for (name, theirs), (_, ours) in zip(leaves(other.evidence()), leaves(ecu.evidence()), strict=True):
        assert (theirs == ours).all(), name


def test_every_whole_member_survives() -> None:
    """One after the other, since flags have little to differ by."""
    names = [(name, n.shape) for name, n in leaves(Ecu().evidence()) if n.dtype in (np.int32, np.uint32)]
    assert len(names) > 20
    for k, (name, shape) in enumerate(names):
        for place in np.ndindex(shape):
            ecu, other = Ecu(), Ecu()
            dict(leaves(ecu.evidence()))[name][place] = 1
            if name == ".joint.started":
                make_plausible(ecu)
            assert other.restore(ecu.save()) == "ok", name
            assert other.values() == ecu.values(), names[k]


def make_plausible(ecu: Ecu) -> None:
    """Hypotheses that divide by no zero."""
    joint = ecu.evidence()["joint"]
    joint["second"]["second_s"] = joint["second"]["reference"] = 1.0
    for name in ("half_width", "creep"):
        joint["hypotheses"]["play"][name] = 0.1
    joint["hypotheses"]["variance"] = 1.0


@pytest.mark.parametrize("method", METHODS)
def test_whatever_a_drive_taught_is_believed_when_it_comes_back(method: str) -> None:
    columns = damaged(legs(2, 100.0, seed=5), 5)
    ecu = Ecu(method)
    for begin in range(0, 20_000, 1_237):
        ecu.run(sliced(columns, begin, begin + 1_237))
        other = Ecu(method)
        assert other.restore(ecu.save()) == "ok"
        assert other.values() == ecu.values()
        assert other.answer()["offset"] == ecu.answer()["offset"]


def test_an_image_has_the_same_bytes_on_every_machine(image: bytes) -> None:
    magic, _, _, sequence, length = HEADER.unpack(image[: HEADER.size])
    assert (magic, sequence, length) == (b"OCSV", 7, len(image))
    assert struct.unpack("<I", image[-4:]) == (zlib.crc32(image[:-4]),)
    ecu = Ecu()
    assert ecu.restore(image) == "ok"
    evidence = ecu.evidence()[0]
    assert image[HEADER.size :].startswith(struct.pack("<7d", *evidence["offset"]["ticks"]))
    assert struct.pack("<Q", int(evidence["ticks"])) in image
    assert struct.pack(f"<{lib.OC_TERMS_TRIANGLE}f", *evidence["joint"]["hypotheses"][5]["scatter"]) in image


def test_a_buffer_of_the_stated_size_holds_an_image_and_a_smaller_one_gets_none() -> None:
    ecu = Ecu()
    assert lib.oc_save_size() <= ffi.sizeof("oc_evidence") + lib.OC_SAVE_OVERHEAD
    small = bytearray(lib.oc_save_size() - 1)
    assert lib.oc_save(ecu.state, ecu.coefficients, 1, ffi.from_buffer(small), len(small)) == 0
    assert not any(small)


# Refused


def corrupted(image: bytes, rng: np.random.Generator) -> bytes:
    """As flash, power cuts and bad software leave it; never the image itself."""
    hurt = bytearray(image)
    begin, end = sorted(int(k) for k in rng.integers(0, len(image) + 1, 2))
    match int(rng.integers(0, 7)):
        case 0:
            for place in rng.integers(0, 8 * len(image), int(rng.integers(1, 9))):
                hurt[place // 8] ^= 1 << place % 8
        case 1:
            del hurt[begin:]
        case 2:
            hurt[begin:end] = b"\xff" * (end - begin)
        case 3:
            hurt[begin:end] = bytes(end - begin)
        case 4:
            hurt[begin:end] = rng.bytes(end - begin)
        case 5:
            del hurt[begin:end]
        case 6:
            hurt[begin:end] = hurt[begin:end][::-1]
    return bytes(hurt) if hurt != image else image[:-1]


def test_of_a_thousand_corrupted_images_none_is_believed(image: bytes) -> None:
    rng = np.random.default_rng(1)
    seen = set()
    for _ in range(1_000):
        ecu = Ecu()
        fault = ecu.restore(corrupted(image, rng))
        assert fault != "ok"
        assert ecu.values() == FRESH
        seen.add(fault)
    assert {"truncated", "damaged"} <= seen <= {"missing", "truncated", "damaged"}


def test_no_corrupted_image_that_is_sealed_anew_brings_the_core_down(image: bytes, day: dict[str, Array]) -> None:
    """As from an attacker, or a bug before the CRC: what is believed is at least no number that crashes."""
    rng = np.random.default_rng(2)
    seen = set()
    for _ in range(300):
        hurt = bytearray(image)
        for place in rng.integers(HEADER.size, len(image) - 4, int(rng.integers(1, 4))):
            hurt[place] = int(rng.integers(0, 256))
        ecu = Ecu()
        seen.add(ecu.restore(sealed(bytes(hurt))))
        ecu.run(sliced(day, 5_000, 5_400))
        ecu.answer()
    assert seen == {"ok", "implausible"}


def with_member(set_: Callable[[Any], None], day: dict[str, Array]) -> bytes:
    ecu = Ecu().run(day)
    set_(ecu.evidence())
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
        ("bank_sum", math.nan),
        ("bank_sum", math.inf),
        ("offset.ticks.weight", -1.0),
        ("standstill.yaw_rate", 11.0),
        ("gyro_bias.x", math.nan),
        ("gyro_bias.P", -1e-9),
        ("gyro_bias.status", 4),
        ("joint.best", lib.OC_JOINT_HYPOTHESES),
        ("joint.best", -1),
        ("joint.changes", -1),
        ("joint.concluded", lib.OC_JOINT_HYPOTHESES + 1),
        ("joint.hypotheses.offset_variance", -1e-9),
        ("joint.hypotheses.variance", 0.0),
        ("joint.hypotheses.scatter", -1.0),
        ("joint.hypotheses.places.inner", math.nan),
        ("joint.changed.change.kind", 3),
        ("ticks", 2**60),
    ],
)
def test_a_value_that_no_drive_can_have_taught_is_implausible(path: str, value: float, day: dict[str, Array]) -> None:
    ecu = Ecu()
    assert ecu.restore(with_member(_set(path, value), day)) == "implausible"
    assert ecu.values() == FRESH


def test_an_image_of_another_layout_is_refused_by_that_name(image: bytes) -> None:
    older = bytearray(image)
    older[4] ^= 1
    assert Ecu().restore(sealed(bytes(older))) == "layout"
    shorter = bytearray(image[:-12] + image[-4:])
    struct.pack_into("<I", shorter, 16, len(shorter))
    assert Ecu().restore(sealed(bytes(shorter))) == "layout"


def test_an_image_is_foreign_where_anything_differs_that_the_learned_depends_on(image: bytes) -> None:
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


def test_what_lies_behind_an_image_does_not_matter(image: bytes) -> None:
    assert Ecu().restore(image + b"\xff" * 100) == "ok"


# Two slots


def restore_newest(ecu: Ecu, slots: list[bytes]) -> tuple[str, int]:
    size = max(map(len, slots))
    padded = [slot + b"\xff" * (size - len(slot)) for slot in slots]
    sequence = ffi.new("uint32_t *")
    first, second = (ffi.from_buffer(slot) for slot in padded)
    fault = lib.oc_restore_newest(ecu.state, ecu.coefficients, first, second, size, sequence)
    return _core.IMAGE_FAULTS[fault], sequence[0]


def test_a_power_cut_while_an_image_is_written_loses_that_interval_and_no_more(day: dict[str, Array]) -> None:
    ecu = Ecu()
    slots = [b"", b""]
    before = FRESH
    for sequence in range(1, 6):
        ecu.run(sliced(day, 6_000 * sequence, 6_000 * sequence + 6_000))
        new, old = ecu.save(sequence), slots[sequence % 2].ljust(lib.oc_save_size(), b"\xff")
        for cut in [*range(24), *range(24, len(new), 997), len(new) - 1]:
            torn = list(slots)
            torn[sequence % 2] = new[:cut] + old[cut:]
            after = Ecu()
            fault, found = restore_newest(after, torn)
            assert after.values() == before
            assert (fault, found) == (("ok", sequence - 1) if sequence > 1 else (fault, 0))
        slots[sequence % 2], before = new, ecu.values()
        after = Ecu()
        assert restore_newest(after, slots) == ("ok", sequence)
        assert after.values() == before


@pytest.mark.parametrize("newer", [1, 6, 2**31, 2**32 - 1, 2**32])
def test_the_newer_image_is_chosen_also_where_the_sequence_runs_over(newer: int, day: dict[str, Array]) -> None:
    images = [b"", b""]
    images[(newer - 1) % 2] = Ecu().run(sliced(day, 0, 2_000)).save((newer - 1) % 2**32)
    images[newer % 2] = Ecu().run(sliced(day, 0, 3_000)).save(newer % 2**32)
    ecu = Ecu()
    assert restore_newest(ecu, images) == ("ok", newer % 2**32)
    assert ecu.answer()["duration"] == pytest.approx(30.0)


# Ignition cycles


def cycled(method: str, day: dict[str, Array], cuts: list[int]) -> Ecu:
    ecu, begin = Ecu(method), 0
    for cut in cuts:
        image = ecu.run(sliced(day, begin, cut)).save()
        ecu, begin = Ecu(method), cut
        assert ecu.restore(image) == "ok"
    return ecu.run(sliced(day, begin, len(day["time_s"])))


@pytest.mark.parametrize("method", METHODS)
def test_cycles_while_the_truck_stands_change_no_bit_of_the_answer(method: str, day: dict[str, Array]) -> None:
    """Drives begin and end every 150 s and stand for some seconds there; any tick of that will do."""
    uninterrupted = cycled(method, day, [])
    rng = np.random.default_rng(3)
    for _ in range(5):
        cuts = sorted(15_000 * int(k) + int(rng.integers(-450, 250)) for k in rng.integers(1, 3, 3))
        ecu = cycled(method, day, cuts)
        assert ecu.answer() == uninterrupted.answer()
        assert ecu.values() == uninterrupted.values()


@pytest.mark.parametrize("cut", [0, 1, 27, 31, 150])
def test_a_bias_told_where_the_drive_ends_reaches_every_hypothesis_also_through_a_power_cut(cut: int) -> None:
    """0.57 deg/s of gyro bias that nothing shows but the last standstill, cut so many ticks after it began."""
    truth = Truth(yaw_rate_bias=0.01)
    columns = sliced(drive(2, RATE_HZ, 240.0, truth), 2_000, 24_000)
    stop = int(np.flatnonzero(columns["vehicle_speed_m_s"] > 0.1)[-1]) + 1
    ecu = Ecu().run(sliced(columns, 0, stop))
    before = ecu.answer()["offset"]
    other = Ecu()
    assert other.restore(ecu.run(sliced(columns, stop, stop + cut)).save()) == "ok"
    after = other.run(sliced(columns, stop + cut, len(columns["time_s"]))).answer()["offset"]
    assert abs(after["value"] - truth.offset) < 0.4 * abs(before["value"] - truth.offset)
    assert after["standard_deviation"] < 0.6 * before["standard_deviation"]


def test_a_correction_that_a_power_cut_halved_reaches_the_other_hypotheses_and_none_twice(
    day: dict[str, Array], image: bytes
) -> None:
    def gathered(correction: float) -> Array:
        ecu, after = Ecu(), Ecu()
        assert ecu.restore(image) == "ok"
        ecu.evidence()["joint"]["correction"], ecu.evidence()["joint"]["corrected"] = correction, 5
        assert after.restore(ecu.save()) == "ok"
        after.run(sliced(day, 5_000, 5_030))
        return np.array(after.evidence()["joint"]["hypotheses"]["target_mean"][0])

    moved = gathered(1e-3) != gathered(0.0)
    assert not moved[:5].any()
    assert moved[5:].all()


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
def test_a_cut_on_the_road_costs_no_more_than_a_gate_window(method: str, day: dict[str, Array]) -> None:
    """t1 of what was pending, the filters' settling of some 1.1 s, and the rest of a block at each end."""
    uninterrupted = cycled(method, day, []).answer()
    for cut in (2_500, 4_321, 7_003, 20_000, 33_333):
        found = cycled(method, day, [cut]).answer()
        assert -0.1 <= uninterrupted["used"] - found["used"] <= 2.0 + 1.2 + 2 * 0.1
        moved = found["offset"]["value"] - uninterrupted["offset"]["value"]
        assert abs(moved) < 0.25 * uninterrupted["offset"]["standard_deviation"]


@pytest.mark.parametrize("method", METHODS)
def test_an_ignition_is_the_same_with_and_without_a_loss_of_power(method: str, day: dict[str, Array]) -> None:
    for cut in (15_000, 20_000):
        kept = Ecu(method).run(sliced(day, 0, cut))
        lost = Ecu(method)
        assert lost.restore(kept.save()) == "ok"
        later = sliced(day, cut, len(day["time_s"])) | {"time_s": day["time_s"][: len(day["time_s"]) - cut]}
        for ecu in (kept, lost):
            lib.oc_restart(ecu.state)
            ecu.run(later)
        assert kept.values() == lost.values()


def test_an_ignition_leaves_the_gyro_less_sure_than_a_loss_of_power(image: bytes, day: dict[str, Array]) -> None:
    spreads = []
    for restart in (False, True):
        ecu = Ecu()
        assert ecu.restore(image) == "ok"
        if restart:
            lib.oc_restart(ecu.state)
        ecu.run(sliced(day, 2_000, 2_001))
        spreads.append(math.sqrt(ecu.evidence()["gyro_bias"]["P"][0, 0, 0]))
    assert spreads[0] < spreads[1]


def test_saving_and_restoring_over_and_over_changes_nothing(image: bytes) -> None:
    """A correction is in the evidence once, however often that is read."""
    ecu = Ecu()
    assert ecu.restore(image) == "ok"
    answer = ecu.answer()
    for _ in range(5):
        again = ecu.save(sequence=7)
        assert again == image
        ecu = Ecu()
        assert ecu.restore(again) == "ok"
        assert ecu.answer() == answer


# Through Python's door


@pytest.fixture(scope="module")
def truck() -> Vehicle:
    return oc.vehicle(Path(__file__).parents[1] / "vehicles" / "scania_r730_4x2.toml")


def stepped(monitor: oc.Monitor, columns: dict[str, Array]) -> list[Any]:
    rows = zip(*columns.values(), strict=True)
    return [monitor.step(oc.Tick(**dict(zip(columns, map(float, row), strict=True)))) for row in rows]


def test_a_monitor_goes_on_after_a_power_cut_where_it_stood(truck: Vehicle, day: dict[str, Array]) -> None:
    kept, lost = oc.Monitor(truck), oc.Monitor(truck)
    stepped(kept, sliced(day, 6_000, 15_000))
    lost.restore(kept.save())
    later = sliced(day, 15_000, 21_000)
    assert stepped(kept, later)[-1] == stepped(lost, later)[-1]
    sequences = [struct.unpack_from("<I", monitor.save(), 12)[0] for monitor in (kept, kept, lost)]
    assert sequences == [2, 3, 2]


def test_a_refused_image_says_why_in_a_line_and_leaves_a_monitor_that_knows_nothing(
    truck: Vehicle, day: dict[str, Array]
) -> None:
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
        assert "starts afresh" in str(error.value)
        assert taught._core.state_bytes() == fresh._core.state_bytes()
