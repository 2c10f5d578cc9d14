"""Replays a golden drive on an emulated board and on this machine, compares all bits and counts instructions.

The drive is simulated anew each time from drive.toml and one seed. The host runs the library that also evaluates logs;
the board runs replay.c with the same core.
"""

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

import oncenter
from oncenter import _core
from oncenter._native import ffi

HERE = Path(__file__).parent
SEED = 7
RATE_HZ = 100.0
PARAMS = {"tandem_side_force_m2_s2": 12.0}  # of a 6x2; all others are defaults
TRUCK = {"track_width_front_m": 2.05, "track_width_rear_m": 1.83, "traffic_side": 1.0}
_STRUCTS = ("oc_vehicle", "oc_params", "oc_signals", "oc_output", "oc_coefficients", "oc_state", "oc_answer")
_TYPES = {name: _core.dtype_of(ffi.typeof(name)) for name in _STRUCTS}
_ROW = np.dtype([("output", _TYPES["oc_output"]), ("instructions", "u4"), ("unused", "u4")])
_TAIL = np.dtype(
    [(name.removeprefix("oc_"), _TYPES[name]) for name in ("oc_coefficients", "oc_state", "oc_answer")]
    + [(f"{name}_instructions", "u4") for name in ("setup", "answer")]
    + [(f"{name}_stack", "u4") for name in ("setup", "step", "answer")]
    + [(f"{name}_instructions", "u4") for name in ("save", "restore")]
    + [(name, "u4") for name in ("save_stack", "image_bytes", "comes_back")]
    + [("image", "u1", (_TYPES["oc_state"].itemsize + _core.lib.OC_SAVE_OVERHEAD,))],
    align=True,
)
_FAULTS = {
    1: "the drive file is missing",
    2: "its struct layout differs",
    3: "vehicle or params are invalid",
    4: "the drive file is truncated",
    100: "the processor faulted",
}


@dataclass(frozen=True)
class Board:
    """A board of QEMU and the compiler options for its processor."""

    name: str
    machine: str
    flags: tuple[str, ...]


# All files are compiled together, as for the host's library. The M4F's image is optimised for size, since software
# doubles dominate its time: no reordering, no hoisting, no inlining that increases the stack by more than 10 %. The
# M7's image is optimised for speed: short loops are unrolled, and early computation is avoided to save registers.
WHOLE = ("-flto", "-flto-partition=one", "-ffat-lto-objects")
SMALL = (
    *("-Os", "-fno-expensive-optimizations"),
    *("-fno-reorder-blocks", "-fno-schedule-insns2", "-fno-move-loop-invariants"),
    *("-fno-optimize-sibling-calls", "-fno-caller-saves", "-fno-tree-fre"),
    *("-fno-tree-dominator-opts", "-fno-tree-pta", "-fno-ipa-sra"),
    *("--param=large-stack-frame=32", "--param=large-stack-frame-growth=10"),
)
FAST = ("-O2", "-fno-schedule-insns", "-fno-code-hoisting", "-fpeel-loops", "--param=max-completely-peeled-insns=60")
BOARDS = (
    Board("Cortex-M4F", "mps2-an386", ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", *WHOLE, *SMALL)),
    Board("Cortex-M7", "mps2-an500", ("-mcpu=cortex-m7", "-mfpu=fpv5-d16", *WHOLE, *FAST)),
)


@dataclass(frozen=True)
class Drive:
    """The columns of a drive, shape (n,) each, and the methods for it."""

    columns: dict[str, npt.NDArray[np.float64]]
    method: str
    angle_method: str


@dataclass(frozen=True)
class Replayed:
    """A board's result: rows and tail as defined in replay.c."""

    rows: npt.NDArray[np.void]
    tail: np.void


def golden_drive() -> dict[str, npt.NDArray[np.float64]]:
    """The columns that the core reads."""
    signals, _ = oncenter.simulate(HERE / "drive.toml", seed=SEED)
    return {name: signals.table[name].to_numpy() for name in _core.COLUMNS if name in signals.table.columns}


def _core_of(drive: Drive) -> _core.Core:
    return _core.Core(3.7, 19.3, PARAMS, RATE_HZ, method=drive.method, angle_method=drive.angle_method, **TRUCK)


def _bytes_of(core: _core.Core, member: str) -> bytes:
    return bytes(ffi.buffer(ffi.addressof(core._coefficients, member)))


def _ticks(columns: dict[str, npt.NDArray[np.float64]]) -> npt.NDArray[np.void]:
    ticks = np.zeros(len(columns["time_s"]), _TYPES["oc_signals"])
    for name, column in columns.items():
        member = _core.COLUMNS[name]
        ticks[member] = column
        ticks["valid"] |= np.uint32(_core._VALID_BITS.get(member, 0))
    return ticks


def replay(board: Board, program: Path, drive: Drive, folder: Path) -> Replayed:
    """Runs a drive in QEMU, where an instruction takes 64 ns of the board's time.

    Raises:
        SystemExit: the board failed; one line.
    """
    core = _core_of(drive)
    ticks = _ticks(drive.columns)
    sizes = [_TYPES[name].itemsize for name in ("oc_vehicle", "oc_params", "oc_signals")]
    with (folder / "drive.bin").open("wb") as file:
        file.write(np.array([*sizes, len(ticks)], "u4").tobytes() + np.float64(RATE_HZ).tobytes())
        file.write(_bytes_of(core, "vehicle") + _bytes_of(core, "params") + ticks.tobytes())
    command = ["qemu-system-arm", "-M", board.machine, "-kernel", str(program.resolve()), "-nographic"]
    command += ["-monitor", "none", "-serial", "none", "-semihosting-config", "enable=on,target=native"]
    run = subprocess.run([*command, "-icount", "shift=6,sleep=off"], cwd=folder, timeout=600, check=False)
    if run.returncode:
        raise SystemExit(f"{board.name}: {_FAULTS.get(run.returncode, f'QEMU ended with {run.returncode}')}")
    result = (folder / "result.bin").read_bytes()
    if len(result) != len(ticks) * _ROW.itemsize + _TAIL.itemsize:
        raise SystemExit(f"{board.name}: {_FAULTS[2]}")
    tail = np.frombuffer(result[-_TAIL.itemsize :], _TAIL)[0]
    return Replayed(np.frombuffer(result[: -_TAIL.itemsize], _ROW), tail)


def _differing(ours: npt.NDArray[np.void], theirs: npt.NDArray[np.void], path: str = "") -> list[tuple[str, int]]:
    """Members that differ in a bit, each with its first differing row."""
    if ours.dtype.names is not None:
        return [found for name in ours.dtype.names for found in _differing(ours[name], theirs[name], f"{path}.{name}")]
    bits = np.ascontiguousarray(ours).view("u1") != np.ascontiguousarray(theirs).view("u1")
    rows = np.flatnonzero(bits.reshape(len(ours), -1).any(axis=1))
    return [(path.lstrip("."), int(rows[0]))] if len(rows) else []


def differences(drive: Drive, replayed: Replayed) -> list[str]:
    """Bitwise differences to this machine: outputs, coefficients, state, answer, image."""
    core = _core_of(drive)
    outputs = np.zeros(len(replayed.rows), _TYPES["oc_output"])
    core.run(drive.columns, outputs)
    answer = ffi.new("oc_answer *")
    _core.lib.oc_answer_get(core._state, core._coefficients, answer)
    found = [f"{name} from tick {row} on" for name, row in _differing(outputs, replayed.rows["output"])]
    ends = {"coefficients": core._coefficients, "state": core._state, "answer": answer}
    for name, native in ends.items():
        ours = np.frombuffer(bytes(ffi.buffer(native)), _TYPES[f"oc_{name}"])
        found += [f"{name}: {path}" for path, _ in _differing(ours, replayed.tail[name][None])]
    image = bytes(replayed.tail["image"][: int(replayed.tail["image_bytes"])])
    found += ["the saved image"] if image != core.save(1) else []
    found += [] if replayed.tail["comes_back"] else ["the saved image changes by restoring and saving"]
    return found
