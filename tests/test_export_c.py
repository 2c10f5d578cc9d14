"""The core for firmware: C with its own test, a program for an ECU, and its description for calibration tools."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import cantools
import numpy as np
import pytest
from test_estimate import steady_drive

import oncenter as oc
from oncenter import _core, export
from oncenter._native import ffi, lib
from oncenter.cli import run

ROOT = Path(__file__).parents[1]
CC = ["cc", "-std=c99", "-ffp-contract=off", "-Icore"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export.write_c(tmp_path_factory.mktemp("c") / "oncenter")


@pytest.mark.slow
def test_the_command_in_the_folders_readme_builds_a_test_that_passes(folder: Path) -> None:
    readme = (folder / "README.md").read_text(encoding="utf-8")
    (line,) = re.findall(r"^cc .*$", readme, re.MULTILINE)
    done = subprocess.run(line, shell=True, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"oncenter {oc.__version__}: 3 cases of 6000 ticks are equal to the last bit\n"
    assert f"oncenter {oc.__version__}" in readme
    assert (folder / "LICENSE").read_text(encoding="utf-8").startswith("MIT License")


def test_a_core_that_differs_in_one_bit_fails_its_vectors_at_a_named_row(folder: Path) -> None:
    vectors = (folder / "test" / "vectors.h").read_text(encoding="utf-8")
    value = re.findall(r"(?<!-)0x1\.[0-9a-f]{12}[0-8]p-\d\b", vectors)[-1]
    last = value.index("p") - 1
    nudged = value[:last] + f"{int(value[last], 16) + 1:x}" + value[last + 1 :]
    at = vectors.rindex(value)
    other = folder / "test_nudged"
    other.mkdir()
    (other / "vectors.h").write_text(vectors[:at] + nudged + vectors[at + len(value) :], encoding="utf-8")
    (other / "test_vectors.c").write_bytes((folder / "test" / "test_vectors.c").read_bytes())
    sources = [str(file.relative_to(folder)) for file in sorted(folder.glob("core/*.c"))]
    subprocess.run([*CC, "-O0", *sources, "test_nudged/test_vectors.c", "-lm", "-o", "nudged"], cwd=folder, check=True)
    done = subprocess.run([folder / "nudged"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "1 values differ" in done.stdout
    assert f"expected {nudged}" in done.stdout


@pytest.mark.slow
def test_the_functions_for_simulink_give_the_offset_of_a_drive(folder: Path) -> None:
    example = ROOT / "examples" / "simulink"
    library = folder / "block.so"
    sources = [str(file) for part in ("core", "ecu") for file in sorted(folder.glob(f"{part}/*.c"))]
    sources.append(str(example / "oncenter_block.c"))
    strict = ["-Wall", "-Wextra", "-Wconversion", "-Werror", "-Iecu", f"-I{example}"]
    command = [*CC, "-O2", *strict, "-shared", "-fPIC", *sources, "-lm", "-o", str(library)]
    subprocess.run(command, cwd=folder, check=True)
    block = ctypes.CDLL(str(library))
    truck = oc.vehicle("scania_r730_4x2")
    truck = truck.model_copy(update={"traffic_side": "right"})  # as the block has it
    assert block.oncenter_block_start(ctypes.c_double(0.0), ctypes.c_double(19.3)) != 0
    start = [ctypes.c_double(value) for value in (truck.wheelbase_m, truck.ratio_near_centre)]
    assert block.oncenter_block_start(*start) == 0
    drive, _ = oc.simulate("country", seed=2)
    table = drive.table.head(24_000)
    outputs = [ctypes.c_double() for _ in range(3)]
    monitor = oc.Monitor(truck, 100.0)
    now = None
    columns = ("steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2")
    for k, row in enumerate(table.select(columns).iter_rows()):
        block.oncenter_block_step(*map(ctypes.c_double, row), *map(ctypes.byref, outputs))
        now = monitor.step(oc.Tick(k / 100.0, *row))
    assert now is not None and now.offset_status != "unobservable"
    assert [value.value for value in outputs[:2]] == [now.offset_rad, now.offset_sd_rad]
    assert _core.STATUSES[int(outputs[2].value)] == now.offset_status


@pytest.fixture(scope="module")
def ecu(folder: Path) -> Path:
    """The ECU's program as a shared library, with the debug information that calibration tools need."""
    strict = ["-Wall", "-Wextra", "-Wconversion", "-Werror", "-g", "-shared", "-fPIC"]
    sources = [str(file.relative_to(folder)) for file in sorted(folder.glob("core/*.c"))]
    library = folder / "ecu.elf"
    command = [*CC, *strict, "-Iecu", *sources, "ecu/oncenter_ecu.c", "ecu/oncenter_vehicle.c", "-lm", "-o"]
    subprocess.run([*command, library.name], cwd=folder, check=True)
    return library


class EcuProgram:
    """The exported program with variables of its own, for a truck of 3.9 m and a ratio of 19.3."""

    def __init__(self, ecu: Path, copy: Path) -> None:
        self.calls = ctypes.CDLL(shutil.copy(ecu, copy))
        self.calls.oncenter_ecu_defaults()
        self.vehicle = self.variable("oncenter_vehicle", "oc_vehicle")
        self.tick = self.variable("oncenter_tick", "oc_signals")
        self.vehicle["wheelbase"], self.vehicle["steering_ratio"] = 3.9, 19.3

    def variable(self, name: str, kind: str) -> Any:
        dtype = _core.dtype_of(ffi.typeof(kind))
        return np.frombuffer((ctypes.c_char * dtype.itemsize).in_dll(self.calls, name), dtype)[0:1]

    def drive(self, begin: int = 0, end: int = 3000) -> set[int]:
        """The results of the ticks."""
        results = set()
        for k, row in enumerate(steady_drive().table[begin:end].iter_rows(named=True), begin):
            for name, member in _core.COLUMNS.items():
                self.tick[member] = row.get(name, 0.0)
            self.tick["time"] = k / 100.0
            self.tick["valid"] = 15
            results.add(self.calls.oncenter_ecu_tick())
        return results

    def answered_s(self) -> float:
        self.calls.oncenter_ecu_update_answer()
        return float(self.variable("oncenter_answer", "oc_answer")["duration"][0])

    def save_piece(self) -> bytes:
        piece = ctypes.create_string_buffer(512)
        size = self.calls.oncenter_ecu_save_piece(piece, 512)
        return piece.raw[:size]

    def restore(self, image: bytes) -> str:
        self.calls.oncenter_ecu_restore()
        fault = [self.calls.oncenter_ecu_restore_piece(image[k : k + 512], 512) for k in range(0, len(image), 512)][-1]
        return _core.IMAGE_FAULTS[fault]


def test_an_ecu_with_another_calibration_discards_its_estimates(ecu: Path, tmp_path: Path) -> None:
    program = EcuProgram(ecu, tmp_path / "own.elf")
    assert program.calls.oncenter_ecu_start() == lib.OC_OK
    assert program.drive() == {lib.OC_OK}
    assert program.answered_s() == pytest.approx(30.0)
    assert program.calls.oncenter_ecu_start() == lib.OC_OK and program.answered_s() == pytest.approx(30.0)
    program.vehicle["steering_ratio"] = 20.0
    assert program.calls.oncenter_ecu_start() == lib.OC_OK and program.answered_s() == 0.0


def test_ticks_are_refused_until_the_last_piece_is_saved_and_a_start_keeps_what_was_restored(
    ecu: Path, tmp_path: Path
) -> None:
    program = EcuProgram(ecu, tmp_path / "first.elf")
    assert program.calls.oncenter_ecu_save(1) == lib.OC_ERROR_SETUP
    assert program.drive(0, 1) == {lib.OC_ERROR_SETUP}
    assert program.calls.oncenter_ecu_start() == lib.OC_OK
    program.drive()
    image = b""
    assert program.calls.oncenter_ecu_save(1) == lib.OC_OK
    while piece := program.save_piece():
        image += piece
        assert program.drive(3000, 3001) == {lib.OC_ERROR_STATE}
    assert len(image) == lib.oc_save_size() and program.drive(3000, 3001) == {lib.OC_OK}
    other = EcuProgram(ecu, tmp_path / "second.elf")
    assert other.restore(image.ljust(len(image) // 512 * 512 + 512, b"\xff")) == "ok"
    assert other.drive(0, 1) == {lib.OC_ERROR_SETUP}
    assert other.calls.oncenter_ecu_start() == lib.OC_OK
    assert other.answered_s() == pytest.approx(30.0)
    assert other.restore(image[:-512]) == "truncated"
    assert other.calls.oncenter_ecu_start() == lib.OC_OK and other.answered_s() == 0.0
    other.vehicle["steering_ratio"] = 20.0
    assert other.restore(image.ljust(len(image) // 512 * 512 + 512, b"\xff")) == "foreign"


def test_the_example_for_j1939_decodes_as_the_database_and_drops_a_message_that_stays_away(
    folder: Path, tmp_path: Path
) -> None:
    library = tmp_path / "j1939.so"
    strict = ["-Wall", "-Wextra", "-Wconversion", "-Werror", "-shared", "-fPIC"]
    subprocess.run([*CC, *strict, "example/j1939.c", "-o", library], cwd=folder, check=True)
    calls = ctypes.CDLL(str(library))
    bus, tick = ctypes.create_string_buffer(256), ffi.new("oc_signals *")
    database = cantools.database.load_file(ROOT / "dbc" / "oncenter_j1939.dbc")
    calls.j1939_init(bus)

    def at(time_s: float) -> set[str]:
        out = ctypes.c_void_p(int(ffi.cast("uintptr_t", tick)))
        calls.j1939_tick(bus, ctypes.c_double(time_s), out)
        return {name for name, bit in _core._VALID_BITS.items() if tick.valid & bit}

    def receive(name: str, **values: float) -> None:
        message = database.get_message_by_name(name)
        pgn = message.frame_id >> 8 & 0x3FFFF
        default = {signal.name: signal.maximum for signal in message.signals}
        data = message.encode(default | values, strict=False)
        calls.j1939_receive(bus, pgn, bytes(data), ctypes.c_double(10.0))

    assert at(10.0) == set()
    receive("VDC2", SteeringWheelAngle=-0.5, YawRate=0.125, LateralAcceleration=-1.5)
    receive("CCVS1", WheelBasedVehicleSpeed=72.0)
    receive("EBC2", FrontAxleSpeed=72.0, RelativeSpeedFrontAxleLeftWheel=0.5, RelativeSpeedRearAxle1RightWheel=-0.5)
    assert len(at(10.0)) == 8
    assert tick.steering_wheel_angle == pytest.approx(-0.5, abs=1 / 2048) and tick.time == 10.0
    assert tick.yaw_rate == pytest.approx(0.125, abs=1 / 16384)
    assert tick.lateral_acceleration == pytest.approx(-1.5, abs=1 / 4096)
    assert tick.vehicle_speed == pytest.approx(20.0, abs=1e-3)
    assert tick.wheel_speed_front_left == pytest.approx(72.5 / 3.6, abs=1e-2)
    assert tick.wheel_speed_rear_right == pytest.approx(71.5 / 3.6, abs=1e-2)
    assert at(10.1) == {"vehicle_speed", *(name for name in at(10.0) if name.startswith("wheel_speed"))}
    assert at(11.0) == set()
    calls.j1939_receive(bus, 61449, b"\xff" * 8, ctypes.c_double(11.0))
    assert at(11.0) == set()
    statuses = {"stability_control_active": 1.0, "anti_lock_active": 1.0, "reverse": 1.0}
    receive("VDC1", YCBrakeControlActive=1, ROPBrakeControlActive=3, ROPEngineControlActive=0, YCEngineControlActive=3)
    receive("EBC1", AntiLockBrakingActive=1)
    receive("ETC2", TransmissionCurrentGear=-1)
    assert at(10.2) == {
        *statuses,
        "vehicle_speed",
        *(name for name in _core.COLUMNS.values() if name.startswith("wheel_speed")),
    }
    assert {name: getattr(tick, name) for name in statuses} == statuses
    receive("ETC2", TransmissionCurrentGear=12)
    assert "reverse" in at(10.2) and tick.reverse == 0.0
    for pgn, data in ((65103, b"\xff" * 8), (61441, b"\xff" * 8), (61445, b"\0" * 8)):
        calls.j1939_receive(bus, pgn, data, ctypes.c_double(10.0))
    assert at(10.2).isdisjoint(statuses)


def items_of(a2l: Path) -> list[str]:
    """Parameters and measurements without their addresses; the tool formats some signs differently."""
    text = a2l.read_text(encoding="utf-8").lower().replace("\\", "")
    blocks = re.findall(r"/begin (?:characteristic|measurement) .*?/end", text, re.DOTALL)
    blocks = [re.sub(r"(ecu_address|value) 0x[0-9a-f]+", r"\1", block) for block in blocks]
    return [" ".join(map(as_number, block.split())) for block in blocks]


def as_number(word: str) -> str:
    try:
        return str(float(word))
    except ValueError:
        return word


def enumerations_of(a2l: Path) -> dict[str, list[tuple[str, str]]]:
    """The values of each enumeration with their words, as the program or its description calls them."""
    text = a2l.read_text(encoding="utf-8")
    tables = re.findall(r"/begin COMPU_VTAB (\w+) .*?TAB_VERB \d+(.*?)/end", text, re.DOTALL)
    return {name: re.findall(r'(\d+) "(.*?)"', rows) for name, rows in tables}


def a2ltool(*arguments: str | Path) -> str:
    tool = Path(sys.executable).with_name("a2ltool")
    found = tool if tool.exists() else "a2ltool"
    done = subprocess.run([found, "--strict", "--check", *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_the_a2l_file_names_only_variables_of_the_program(folder: Path, ecu: Path, tmp_path: Path) -> None:
    given = folder / "ecu" / "oncenter.a2l"
    assert "No problems found" in a2ltool("-v", given)
    linked = tmp_path / "linked.a2l"
    update = ("--elffile", ecu, "--update", "--update-mode", "STRICT")
    printed = a2ltool("-v", *update, "-o", linked, given)
    assert len(re.findall(r"\b0 not found", printed)) >= 2 and not re.search(r"[1-9]\d* not found", printed)
    assert items_of(linked) == items_of(given)  # no type and no limit had to be corrected
    theirs = enumerations_of(linked)
    for name, values in enumerations_of(given).items():
        for (ours, word), (value, constant) in zip(values, theirs[name], strict=False):
            assert ours == value and constant.lower().endswith(word.replace("-", "_").lower())
    addresses = re.findall(r"ECU_ADDRESS (0x[0-9A-Fa-f]+)", linked.read_text(encoding="utf-8"))
    assert len(addresses) > 50 and all(int(address, 16) > 0 for address in addresses)


def test_the_command_of_the_docs_gives_the_types_of_a_target_with_short_enums(folder: Path, tmp_path: Path) -> None:
    (update,) = re.findall(r"^a2ltool .*--update (\w+)", (ROOT / "docs" / "export.md").read_text("utf-8"), re.MULTILINE)
    short = ["-fshort-enums", "-g", "-shared", "-fPIC", "-Iecu", "ecu/oncenter_ecu.c"]
    subprocess.run([*CC, *short, "-o", "short.elf"], cwd=folder, check=True)
    linked = tmp_path / "linked.a2l"
    a2ltool("--elffile", folder / "short.elf", "--update", update, "-o", linked, folder / "ecu" / "oncenter.a2l")
    of_enums = re.findall(
        r"((?:RL_)?U(?:BYTE|LONG)) (?:0 )?CM_(?:Status|Method|AngleMethod|SensorFault|SignalFault) ",
        linked.read_text("utf-8"),
    )
    assert len(of_enums) > 10 and set(of_enums) == {"UBYTE", "RL_UBYTE"}


def test_the_a2l_file_has_the_fault_of_the_sensor_and_of_the_signals(folder: Path) -> None:
    names = re.findall(
        r"/begin MEASUREMENT oncenter_output\.(\w*fault\w*) ", (folder / "ecu" / "oncenter.a2l").read_text("utf-8")
    )
    assert {"fault", "signal_fault", "signals_at_fault"} <= set(names)


def test_the_ecus_program_rejects_ticks_before_its_truck_is_calibrated(ecu: Path) -> None:
    program = ctypes.CDLL(str(ecu))
    program.oncenter_ecu_defaults()
    assert program.oncenter_ecu_start() == lib.OC_ERROR_VEHICLE
    assert program.oncenter_ecu_tick() == program.oncenter_ecu_update_answer() == lib.OC_ERROR_SETUP
    wheelbase, ratio = (ctypes.c_double * 2).in_dll(program, "oncenter_vehicle"), 1
    wheelbase[0], wheelbase[ratio] = 3.7, 19.3
    assert program.oncenter_ecu_start() == 0


def test_a_folder_that_is_not_empty_is_left_unchanged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    assert run(["export", "c", "--output", str(tmp_path)]) == 2
    assert "is not empty" in capsys.readouterr().err
    assert run(["export", "c", "--output", str(tmp_path / "mine.txt")]) == 2
    assert "cannot write" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
