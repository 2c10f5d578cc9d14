"""The result message and the trouble code: there and back through the shipped DBC and a J1939 stack, and once only."""

import math
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import cantools.database
import j1939
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_drives import RATIO, WHEELBASE, Array, drive

import oncenter as oc
from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.bus.message import PARTS_PGN, PGN, Message, decode, decode_parts
from oncenter.errors import OncenterError
from oncenter.vehicle import Vehicle

ROOT = Path(__file__).parents[1]
RATE_HZ = 100.0
ANGLE = "steering_wheel_angle_rad"
SPN, DM1_PGN = 1807, int(lib.OC_DM1_PGN)
FMI = {"lost": 9, "stuck": 2, "jumped": 10, "wrong_sign": 2, "remounted": 13}
DBC = cantools.database.load_file(ROOT / "dbc" / "oncenter_result.dbc")
RESULT, PARTS, DM1 = (DBC.get_message_by_name(name) for name in ("OncenterResult", "OncenterResultParts", "DM1"))


def payload_of(**values: Any) -> bytes:
    message = ffi.new("oc_message *", values)
    data = bytearray(8)
    lib.oc_message_encode(message, ffi.from_buffer(data))
    return bytes(data)


def by_dbc(payload: bytes) -> dict[str, float]:
    return RESULT.decode(payload, decode_choices=False)


SOURCES = {name: k for k, name in enumerate(_core.ANGLE_SOURCES)}
STATUSES = {name: k for k, name in enumerate(_core.STATUSES)}


# The message


@given(
    angle=st.floats(-31.37, 31.37),
    offset=st.floats(-7.84, 7.84),
    offset_sd=st.floats(0.0, 0.12),
    angle_sd=st.floats(0.0, 0.12),
    source=st.sampled_from([1, 2, 3]),
    status=st.integers(0, lib.OC_STATUS_COUNT - 1),
    fault=st.integers(0, lib.OC_FAULT_COUNT - 1),
    counter=st.integers(0, 15),
)
def test_the_message_is_decoded_alike_by_the_dbc_and_by_the_core(
    angle: float, offset: float, offset_sd: float, angle_sd: float, source: int, status: int, fault: int, counter: int
) -> None:
    values = {"angle": angle, "offset": offset, "offset_sd": offset_sd, "angle_sd": angle_sd, "source": source}
    payload = payload_of(**values, offset_status=status, fault=fault, counter=counter)
    read, decoded = by_dbc(payload), decode(payload)
    assert read["SteeringWheelAngleCorrected"] == pytest.approx(angle, abs=0.5001 / 1024)
    assert read["SteeringWheelAngleOffset"] == pytest.approx(offset, abs=0.5001 / 4096)
    for name, sd in (("Offset", offset_sd), ("Angle", angle_sd)):
        assert 0.0 <= read[f"{name}StandardDeviation"] - sd < 1.0 / 2048 + 1e-12  # never surer than it is
    assert (read["OffsetStatus"], read["AngleSource"]) == (status, source)
    assert (read["SensorFault"], read["Counter"]) == (fault, counter)
    assert decoded.angle_rad == pytest.approx(read["SteeringWheelAngleCorrected"], abs=1e-12)
    assert decoded.offset_rad == pytest.approx(read["SteeringWheelAngleOffset"], abs=1e-12)
    assert decoded.offset_sd_rad == read["OffsetStandardDeviation"]
    assert decoded.angle_sd_rad == read["AngleStandardDeviation"]
    assert RESULT.encode(read) == payload
    names = (_core.STATUSES[status], _core.ANGLE_SOURCES[source], _core.FAULTS[fault], counter)
    assert (decoded.offset_status, decoded.angle_source, decoded.sensor_fault, decoded.counter) == names


def test_the_dbc_names_statuses_sources_and_faults_as_the_core_does() -> None:
    for signal, names in (
        ("OffsetStatus", _core.STATUSES),
        ("AngleSource", _core.ANGLE_SOURCES),
        ("SensorFault", _core.FAULTS),
    ):
        choices = RESULT.get_signal_by_name(signal).choices
        assert {int(k): str(v) for k, v in choices.items()} == dict(enumerate(names)) | {15: "not available"}
    pgns = [message.frame_id >> 8 & 0xFFFF for message in (RESULT, PARTS, DM1)]
    assert pgns == [PGN, PARTS_PGN, DM1_PGN] == [65292, 65293, 65226]


PART_SIGNALS = {"drive_sd": "Drive", "pull_sd": "Pull", "wind_sd": "Wind", "set_up_sd": "SetUp"}


def parts_payload_of(**values: Any) -> bytes:
    parts, data = ffi.new("oc_message_parts *", values), bytearray(8)
    lib.oc_message_parts_encode(parts, ffi.from_buffer(data))
    return bytes(data)


@given(sds=st.lists(st.floats(0.0, 0.122), min_size=4, max_size=4), counter=st.integers(0, 15))
def test_decoded_parts_of_the_sd_are_never_smaller_and_agree_with_the_dbc(sds: list[float], counter: int) -> None:
    given_parts = dict(zip(PART_SIGNALS, sds, strict=True))
    payload = parts_payload_of(**given_parts, counter=counter)
    read, decoded = PARTS.decode(payload), decode_parts(payload)
    assert read["PartsCounter"] == decoded.counter == counter
    for name, sd in given_parts.items():
        sent = read[f"Offset{PART_SIGNALS[name]}StandardDeviation"]
        assert 0.0 <= sent - sd < 1.0 / 2048 + 1e-12
        assert getattr(decoded, f"{name}_rad") == sent
    assert payload[4:6] == payload[7:] + b"\xff" == b"\xff\xff" and payload[6] & 15 == 15


def test_a_part_is_never_sent_smaller_and_a_missing_one_is_not_available() -> None:
    decoded = decode_parts(parts_payload_of(drive_sd=3.0, pull_sd=math.nan, wind_sd=0.0, set_up_sd=math.inf))
    assert (decoded.drive_sd_rad, decoded.pull_sd_rad) == (250 / 2048, None)
    assert (decoded.wind_sd_rad, decoded.set_up_sd_rad) == (0.0, 250 / 2048)
    with pytest.raises(OncenterError, match="8 bytes"):
        decode_parts(bytes(7))


def test_the_parts_squared_sum_to_the_sd_of_the_first_frame(
    truck: Vehicle, learned: bytes, columns: dict[str, Array]
) -> None:
    monitor = restored(truck, learned)
    for tick in ticks(columns, 9_000, 9_100):
        now = monitor.step(tick)
    first, second = decode(monitor.message(5)), decode_parts(monitor.message_parts(5))
    assert first.counter == second.counter == 5
    parts = [getattr(second, f"{name}_rad") for name in PART_SIGNALS]
    assert now.offset_drive_sd_rad <= parts[0] < now.offset_drive_sd_rad + 1 / 2048
    assert math.hypot(*parts) == pytest.approx(first.offset_sd_rad, abs=2 / 2048)
    assert parts[0] > 0.0


def test_each_part_is_sent_at_its_place() -> None:
    sds = {"drive_sd": 2 / 2048, "pull_sd": 15 / 2048, "wind_sd": 6 / 2048, "set_up_sd": 9 / 2048}
    output = ffi.new("oc_output *", {"offset_status": STATUSES["valid"], "offset_parts": sds})
    parts = ffi.new("oc_message_parts *", lib.oc_message_parts_of(output, 18))
    data = bytearray(8)
    lib.oc_message_parts_encode(parts, ffi.from_buffer(data))
    assert bytes(data) == bytes([2, 15, 6, 9, 0xFF, 0xFF, 0x2F, 0xFF])


def test_of_an_offset_that_is_unobservable_no_part_is_sent(truck: Vehicle, columns: dict[str, Array]) -> None:
    monitor = oc.Monitor(truck, RATE_HZ)
    now = monitor.step(next(ticks(columns, 0, 1)))
    assert (now.offset_status, now.offset_drive_sd_rad) == ("unobservable", None)
    assert monitor.message_parts(3) == bytes.fromhex("ffffffffffff3fff")


@given(st.binary(min_size=8, max_size=8))
def test_any_eight_bytes_are_decoded_without_an_error(payload: bytes) -> None:
    try:
        decoded = decode(payload)
    except OncenterError as error:
        assert error.code == "message"
        return
    assert decoded.angle_rad is None or abs(decoded.angle_rad) < 31.4
    assert decoded.offset_rad is None or abs(decoded.offset_rad) < 7.85


def test_seven_bytes_are_no_message() -> None:
    with pytest.raises(OncenterError, match="8 bytes"):
        decode(bytes(7))


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -1e300, 40.0, -31.5])
def test_a_value_that_does_not_fit_is_not_available_and_no_angle_goes_without_its_offset(nothing: float) -> None:
    lost = {"source": SOURCES["compensated"], "offset_sd": 0.01, "angle_sd": 0.01}
    for payload in (payload_of(angle=nothing, offset=0.1, **lost), payload_of(angle=0.1, offset=nothing, **lost)):
        assert (decode(payload).angle_rad, decode(payload).angle_source) == (None, "none")
        assert decode(payload).measured_rad is None
    assert decode(payload_of(angle=0.1, offset=nothing, **lost)).offset_sd_rad is None


def test_an_interval_is_never_sent_narrower() -> None:
    decoded = decode(payload_of(source=SOURCES["estimated"], angle_sd=3.0, offset_sd=math.nan))
    assert decoded.angle_sd_rad == 250 / 2048
    assert decoded.offset_sd_rad is None


# A correction is applied once


@pytest.fixture(scope="module")
def truck() -> Vehicle:
    return oc.vehicle(ROOT / "vehicles" / "scania_r730_4x2.toml")


@pytest.fixture(scope="module")
def columns() -> dict[str, Array]:
    return drive(1, RATE_HZ, 200.0)


def ticks(columns: dict[str, Array], begin: int = 0, end: int | None = None) -> Iterator[oc.Tick]:
    rows = zip(*(columns[name][begin:end] for name in columns), strict=True)
    return (oc.Tick(**dict(zip(columns, map(float, row), strict=True))) for row in rows)


@pytest.fixture(scope="module")
def learned(truck: Vehicle, columns: dict[str, Array]) -> bytes:
    """The state after a drive with an observable offset, by the thesis's method, which needs the shortest drive."""
    monitor = oc.Monitor(truck, method="thesis")
    for tick in ticks(columns):
        monitor.step(tick)
    return monitor.save()


def restored(truck: Vehicle, image: bytes) -> oc.Monitor:
    monitor = oc.Monitor(truck, method="thesis")
    monitor.restore(image)
    return monitor


def test_the_angle_is_the_same_however_often_it_is_read_saved_and_restored(
    truck: Vehicle, learned: bytes, columns: dict[str, Array]
) -> None:
    tick = next(ticks(columns, 9_000))
    monitor = restored(truck, learned)
    for _ in range(3):
        now = monitor.step(tick)
        assert now.offset_rad is not None
        first = monitor.message()
        assert monitor.message() == monitor.message() == first
        decoded = decode(first)
        assert (decoded.angle_source, decoded.offset_status) == ("compensated", "valid")
        assert decoded.angle_rad == pytest.approx(tick.steering_wheel_angle_rad - now.offset_rad, abs=1e-3)
        assert decoded.measured_rad == pytest.approx(tick.steering_wheel_angle_rad, abs=1e-3)
        monitor = restored(truck, monitor.save())


def test_an_unobservable_offset_is_not_subtracted(truck: Vehicle, columns: dict[str, Array]) -> None:
    monitor = oc.Monitor(truck, method="thesis")
    tick = next(ticks(columns, 9_000))
    monitor.step(tick)
    decoded = decode(monitor.message(counter=17))
    assert (decoded.angle_source, decoded.offset_rad, decoded.offset_sd_rad, decoded.counter) == (
        "measured",
        None,
        None,
        1,
    )
    assert decoded.angle_rad == decoded.measured_rad == pytest.approx(tick.steering_wheel_angle_rad, abs=1e-3)


@pytest.mark.long
def test_a_gateway_that_passes_the_corrected_angle_on_makes_the_next_monitor_find_none(
    truck: Vehicle, learned: bytes, columns: dict[str, Array]
) -> None:
    """Two monitors in a row take the offset off once; one behind its own gateway is given the angle as measured."""
    first, second, own = restored(truck, learned), oc.Monitor(truck, method="thesis"), restored(truck, learned)
    rest = dict(columns)
    before = decode_after(own, next(ticks(columns, 0)))
    for tick in ticks(rest):
        first.step(tick)
        decoded = decode(first.message())
        assert decoded.angle_rad is not None and decoded.measured_rad is not None
        values = {**tick.__dict__, ANGLE: decoded.angle_rad}
        passed_on = second.step(oc.Tick(**values))
        own.step(oc.Tick(**{**values, ANGLE: decoded.measured_rad}))
    assert passed_on.offset_rad == pytest.approx(0.0, abs=2e-3)
    assert decode(second.message()).angle_rad == pytest.approx(decoded.angle_rad, abs=3e-3)
    assert decode(own.message()).offset_rad == pytest.approx(before.offset_rad, abs=2e-3)


def decode_after(monitor: oc.Monitor, tick: oc.Tick) -> Message:
    monitor.step(tick)
    return decode(monitor.message())


# The trouble code


def trouble_after(outputs: list[dict[str, Any]], angle: float = 0.0, offset_max: float = 0.05) -> tuple[Any, bytes]:
    trouble, data = ffi.new("oc_trouble *"), bytearray(8)
    tick = ffi.new("oc_signals *", {"steering_wheel_angle": angle, "valid": lib.OC_HAS_STEERING_WHEEL_ANGLE})
    for output in outputs:
        native = ffi.new("oc_output *", {k: v for k, v in output.items() if k != "estimate"})
        native.angle.estimate = output.get("estimate", 0.0)
        lib.oc_trouble_update(trouble, native, tick, offset_max)
    lib.oc_trouble_encode(trouble, ffi.from_buffer(data))
    return trouble, bytes(data)


def valid(offset: float, sd: float = 0.01) -> dict[str, Any]:
    return {"offset": offset, "offset_sd": sd, "offset_status": STATUSES["valid"]}


@pytest.mark.parametrize(("fault", "fmi"), [*FMI.items()])
def test_each_fault_has_the_failure_mode_that_fits(fault: str, fmi: int) -> None:
    _, data = trouble_after([{"fault": _core.FAULTS.index(fault)}])
    read = DM1.decode(data)
    assert read["SuspectParameterNumber"] + (read["SuspectParameterNumberHigh"] << 16) == SPN
    assert (read["FailureModeIdentifier"], read["OccurrenceCount"]) == (fmi, 1)
    lamps = {name: int(value) for name, value in read.items() if "Lamp" in name}
    assert lamps.pop("AmberWarningLampStatus") == 1
    assert lamps.pop("FlashLamps") == 0xFF
    assert not any(lamps.values())
    assert data[6:] == b"\xff\xff"


@pytest.mark.parametrize(("angle", "fmi"), [(0.2, 20), (-0.2, 21)])
def test_a_sensor_that_drifts_to_the_left_drifts_high_and_stays_so(angle: float, fmi: int) -> None:
    drifting = {"fault": _core.FAULTS.index("drifting"), "estimate": 0.0}
    trouble, _ = trouble_after([drifting, drifting | {"estimate": 2 * angle}], angle)
    assert (trouble.fmi, trouble.occurrences) == (fmi, 1)


def test_without_a_fault_there_is_no_trouble_code() -> None:
    for outputs in ([], [valid(0.01)], [valid(0.3) | {"offset_status": STATUSES["converging"]}]):
        assert trouble_after(outputs)[1] == bytes.fromhex("00ff00000000ffff")


def test_an_offset_is_trouble_while_its_interval_or_then_its_value_is_beyond() -> None:
    outputs, said = [], []
    for offset in (0.06, 0.08, 0.06, -0.06, 0.04, 0.06, 0.08):
        outputs.append(valid(offset))
        said.append(bool(trouble_after(outputs)[0].active))
    assert said == [False, True, True, True, False, False, True]
    trouble, data = trouble_after(outputs)
    assert (trouble.occurrences, DM1.decode(data)["FailureModeIdentifier"]) == (2, 13)


def test_a_remounted_sensor_leaves_no_trouble_of_an_offset_whose_interval_is_not_beyond() -> None:
    remounted = valid(0.06) | {"fault": _core.FAULTS.index("remounted")}
    assert trouble_after([remounted])[0].active
    assert not trouble_after([remounted, valid(0.06)])[0].active


def test_occurrences_stop_at_what_the_field_holds() -> None:
    stuck = {"fault": _core.FAULTS.index("stuck")}
    assert trouble_after([stuck, valid(0.0)] * 200)[0].occurrences == 126


# On a bus


@pytest.fixture
def applications() -> Iterator[tuple[Any, Any, SimpleQueue[tuple[int, bytes]]]]:
    """A sender and a listener on a virtual bus, both by can-j1939; and all frames that pass."""
    seen: SimpleQueue[tuple[int, bytes]] = SimpleQueue()
    ecus, found = [], []
    for address in (0x80, 0x81):
        name = j1939.Name(identity_number=address, manufacturer_code=0)
        application = j1939.ControllerApplication(name, address, bypass_address_claim=True)
        ecu = j1939.ElectronicControlUnit()
        ecu.connect(interface="virtual", channel="oncenter")
        ecu.add_ca(controller_application=application)
        application.start()
        ecus.append(ecu)
        found.append(application)
    ecus[1].subscribe(lambda priority, pgn, sa, timestamp, data: seen.put((pgn, bytes(data))))
    yield found[0], found[1], seen
    for ecu in ecus:
        ecu.stop()
        ecu.disconnect()


def test_a_j1939_stack_reads_the_result_and_the_trouble_code_from_the_bus(
    applications: tuple[Any, Any, SimpleQueue[tuple[int, bytes]]],
    truck: Vehicle,
    learned: bytes,
    columns: dict[str, Array],
) -> None:
    sender, listener, seen = applications
    heard, arrived = [], threading.Event()

    def on_dm1(address: int, lamps: dict[str, int], codes: list[dict[str, int]], timestamp: float) -> None:
        heard.append((address, dict(lamps), [dict(code) for code in codes]))
        arrived.set()

    def send(pgn: int, payload: bytes) -> None:
        sender.send_pgn(0, pgn >> 8, pgn & 0xFF, 6, list(payload))

    j1939.Dm1(listener).subscribe(on_dm1)
    monitor = restored(truck, learned)
    for k, tick in enumerate(ticks(columns, 9_000, 9_020)):
        monitor.step(tick)
        send(PGN, monitor.message(k))
        send(PARTS_PGN, monitor.message_parts(k))
    send(DM1_PGN, trouble_after([valid(0.06), valid(0.08)])[1])
    assert arrived.wait(10.0)
    frames = [seen.get(timeout=10.0) for _ in range(41)]
    results = [decode(data) for pgn, data in frames if pgn == PGN]
    assert [r.counter for r in results] == [k % 16 for k in range(20)]
    assert [decode_parts(data).counter for pgn, data in frames if pgn == PARTS_PGN] == [r.counter for r in results]
    assert {(r.angle_source, r.offset_status) for r in results} == {("compensated", "valid")}
    ((address, lamps, (code,)),) = heard
    assert (address, lamps["awl"], lamps["rsl"]) == (0x80, j1939.DtcLamp.ON, j1939.DtcLamp.OFF)
    assert (code["spn"], code["fmi"], code["oc"]) == (SPN, 13, 1)


# An ECU


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The example and an ECU around it, as usual and with enums as short as can be, as ARM has them."""
    folder = tmp_path_factory.mktemp("ecu")
    compiler = shutil.which("gcc") or shutil.which("cc")
    assert compiler, "needs a C compiler"
    sources = [ROOT / "examples" / "integration.c", ROOT / "tests" / "ecu.c", *sorted(ROOT.glob("core/*/*.c"))]
    options = "-std=c99 -ffp-contract=off -Wall -Wextra -Wconversion -Werror".split()
    options += [f"-I{folder}" for folder in ROOT.glob("core/*/")]

    @cache
    def program(name: str) -> Path:
        further = {"usual": [], "short": ["-fshort-enums"]}[name]
        command = [compiler, *options, *further, *map(str, sources), "-o", str(folder / name), "-lm"]
        subprocess.run(command, check=True)
        return folder / name

    return program


def ignition(program: Path, columns: dict[str, Array], slots: Path) -> list[tuple[int, bytes]]:
    """A drive from power-on to ignition off, and the frames it sent."""
    slots.mkdir(exist_ok=True)
    rows = np.column_stack(list(columns.values())).tobytes()
    run = subprocess.run([str(program)], input=rows, capture_output=True, check=True, cwd=slots, timeout=60)
    lines = [line.split() for line in run.stdout.decode().splitlines()]
    return [(int(pgn), bytes.fromhex(data)) for pgn, data in lines]


@pytest.mark.slow
def test_two_compilers_that_lay_structs_out_differently_write_the_same_image(
    compiled: Callable[[str], Path], tmp_path: Path, columns: dict[str, Array]
) -> None:
    usual, short = (ignition(compiled(name), columns, tmp_path / name) for name in ("usual", "short"))
    assert usual == short
    assert ignition(compiled("usual"), columns, tmp_path / "usual") == (
        ignition(compiled("short"), columns, tmp_path / "short")
    )
    for slot in ("slot_0", "slot_1"):
        assert (tmp_path / "usual" / slot).read_bytes() == (tmp_path / "short" / slot).read_bytes()
    again = ignition(compiled("short"), columns, tmp_path / "usual")  # from the other's image
    assert again == ignition(compiled("usual"), columns, tmp_path / "short") != usual


@pytest.mark.long
def test_the_integration_example_runs_and_keeps_its_estimates_overnight(
    compiled: Callable[[str], Path], tmp_path: Path, columns: dict[str, Array]
) -> None:
    first, second = (ignition(compiled("usual"), columns, tmp_path) for _ in range(2))
    for frames in (first, second):
        assert sum(pgn == PGN for pgn, _ in frames) == 2_000
        assert sum(pgn == PARTS_PGN for pgn, _ in frames) == 2_000
        assert sum(pgn == DM1_PGN for pgn, _ in frames) == 200
    results = [decode(data) for pgn, data in first if pgn == PGN]
    assert results[0].offset_status == "unobservable"
    assert results[-1].offset_rad is not None
    restored_result = next(decode(data) for pgn, data in second if pgn == PGN)
    assert restored_result.offset_rad == pytest.approx(results[-1].offset_rad, abs=1e-3)
    core = _core.Core(WHEELBASE, RATIO, {}, RATE_HZ, traffic_side=1.0, method="joint", angle_method="observer")
    core.run(columns)
    assert results[-1].offset_rad == pytest.approx(core.answer()["offset"]["value"], abs=1e-3)
