"""Compiles the core for a board and reads flash, stack and called functions from compiler and linker."""

import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from replay import HERE, Board

CORE = HERE.parent / "core"
OFFSET_ONLY = HERE.parent / "src" / "oncenter" / "export" / "c" / "offset_only.c"
INCLUDES = [f"-I{folder}" for folder in CORE.glob("*/")]
GCC = "arm-none-eabi-gcc"
# -fno-short-enums: the struct layout of the host, so that bytes can be compared. -fno-math-errno: errno would take a
# kilobyte.
FLAGS = ("-std=c99", "-ffp-contract=off", "-fno-math-errno", "-fno-short-enums", "-mthumb", "-mfloat-abi=hard",
         "-ffunction-sections", "-fdata-sections", "-fno-inline-functions-called-once")  # fmt: skip
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Werror")
# newlib's sqrt without the wrapper that sets errno
LINK = ("-nostartfiles", "-Wl,--gc-sections", "-Wl,--no-enum-size-warning", "-Wl,--defsym=sqrt=__ieee754_sqrt")
# Functions that the core may call: the compiler's arithmetic, three functions of libm, copies of structs.
ALLOWED = re.compile(r"(oc_|__aeabi_)\w+|sqrtf?|floorf?|fabsf?|mem(cpy|set|move)")
# Functions that firmware calls: the monitor with its full answer and names;
MONITOR = ("oc_params_defaults", "oc_params_check", "oc_vehicle_check", "oc_setup", "oc_init", "oc_restart", "oc_step",
           "oc_answer_get", "oc_error_name", "oc_reason_name", "oc_status_name", "oc_fault_name")  # fmt: skip
# an ECU that saves the state over ignition and sends the result on the bus, as examples/integration.c;
ECU = ("oc_params_defaults", "oc_setup", "oc_restore_newest", "oc_restart", "oc_step", "oc_save_begin", "oc_save_piece",
       "oc_message_of", "oc_message_encode", "oc_message_parts_of", "oc_message_parts_encode", "oc_trouble_update",
       "oc_trouble_encode")  # fmt: skip
# and all other public functions except those for whole logs.
ALL = (*MONITOR, *ECU, "oc_version", "oc_method_name", "oc_angle_method_name", "oc_save_size", "oc_save", "oc_restore",
       "oc_restore_begin", "oc_restore_piece", "oc_newer_slot",
       "oc_image_fault_name", "oc_message_decode", "oc_message_measured", "oc_message_parts_decode",
       "oc_angle_source_name")  # fmt: skip
# Functions of the program that oncenter export c writes. Its options are those that its README gives.
PROGRAM = ("oncenter_ecu_defaults", "oncenter_ecu_start", "oncenter_ecu_tick", "oncenter_ecu_update_answer",
           "oncenter_ecu_save", "oncenter_ecu_save_piece", "oncenter_ecu_restore",
           "oncenter_ecu_restore_piece")  # fmt: skip
PLAIN = ("-std=c99", "-ffp-contract=off", "-mthumb", "-mfloat-abi=hard", "-ffunction-sections", "-fdata-sections")
PLAIN_LINK = ("-nostartfiles", "-Wl,--gc-sections", "-Wl,-e,oncenter_ecu_tick")
# Files that are compiled for size: no tick calls their functions, or the longest tick has room for them.
COLD = (
    "angle", "answer", "assignment", "assignment_verdict", "change", "front_wheel", "gyro_bias", "hypothesis_equations",
    "joint_answer", "joint_method", "joint_verdict", "message", "motion", "names", "offset", "params",
    "past_bias", "save", "saved_layout", "saved_plausible", "sensor_fault", "setup", "side_slip", "signal_pair",
    "standstill", "straight_ahead", "torque", "trig", "trouble", "understeer", "wheel_speed",
)  # fmt: skip


def _run(*command: str | Path) -> str:
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stderr.strip() or f"{command[0]} failed")
    return done.stdout


def compiler_version() -> str:
    return _run(GCC, "-dumpfullversion").strip()


def compiled(board: Board, sources: Sequence[Path], folder: Path) -> list[Path]:
    """Object files."""
    folder.mkdir(parents=True, exist_ok=True)
    objects = [folder / f"{source.stem}.o" for source in sources]
    for source, target in zip(sources, objects, strict=True):
        how = ("-Os",) if source.stem in COLD else ()
        _run(GCC, *FLAGS, *STRICT, *board.flags, *how, *INCLUDES, "-c", source, "-o", target)
    return objects


def of_offset_alone(board: Board, core_objects: Sequence[Path], folder: Path) -> list[Path]:
    """Object files without the sensor check and the angle without the sensor: one file takes the place of five."""
    replaced = re.findall(r"(\w+)\.c\b", OFFSET_ONLY.read_text(encoding="utf-8").split("*/")[0])
    kept = [target for target in core_objects if target.stem not in replaced]
    return [*kept, *compiled(board, [OFFSET_ONLY], folder)]


def linked(board: Board, objects: Sequence[Path], target: Path, called: Sequence[str], *more: str) -> Path:
    """An image for the board, with its call graph (`.ci`) next to it; the functions in `called` keep their names."""
    for graph in target.parent.glob(f"{target.name}.*.ci"):
        graph.unlink()
    kept = [f"-Wl,-u,{name}" for name in called]
    how = (*FLAGS, *board.flags, "-fcallgraph-info=su", *LINK, *more, *kept)  # for link-time optimisation
    _run(GCC, *how, "-T", HERE / "mps2.ld", *objects, "-lm", "-o", target)
    return target


def flash_bytes(board: Board, core_objects: Sequence[Path], target: Path, called: Sequence[str]) -> int:
    """Code and constants of a firmware that calls these functions, including libgcc and libm."""
    linked(board, core_objects, target, called, "-e", "oc_step")
    return sum(_sizes(target)[:2])


def _sizes(file: Path) -> list[int]:
    """Bytes of code and constants, of initialised and of other variables."""
    return [int(word) for word in _run("arm-none-eabi-size", file).splitlines()[1].split()[:3]]


def forbidden_calls(core_objects: Sequence[Path]) -> list[str]:
    """Called symbols that are not allowed: heap, files, clocks, other functions of libm.

    By readelf, which reads the machine code. nm reads the input of link-time optimisation, which lacks the compiler's
    own functions.
    """
    named = set(re.findall(r" UND (\w+)$", _run("arm-none-eabi-readelf", "-sW", *core_objects), re.MULTILINE))
    return sorted(name for name in named if not ALLOWED.fullmatch(name))


def variables(core_objects: Sequence[Path]) -> int:
    """Bytes of static variables in the core; must be 0."""
    sizes = _run("arm-none-eabi-size", *core_objects).splitlines()[1:]
    return sum(int(size) for line in sizes for size in line.split()[1:3])


class Stack:
    """Maximum stack: the compiler's frames summed over the call graph; libraries' frames from their machine code."""

    def __init__(self, image: Path, graphs: Sequence[str]) -> None:
        self._frames: dict[str, int] = {}
        self._calls: dict[str, set[str]] = {}
        self._worst: dict[str, int] = {}
        self._read_library(_run("arm-none-eabi-objdump", "-d", "--no-show-raw-insn", image))
        self._read_second_names(_run("arm-none-eabi-nm", image))
        for graph in graphs:
            self._read_nodes(graph)
        for graph in graphs:
            self._read_calls(graph)

    def _read_nodes(self, graph: str) -> None:
        for name, size, kind in re.findall(r'node: \{ title: "([^"]+)" label: "[^"]*\\n(\d+) bytes \((\w+)\)', graph):
            if kind != "static":
                raise SystemExit(f"{name}: its stack is {kind}")
            self._frames[name] = int(size)
            self._calls[name] = set()

    def _read_calls(self, graph: str) -> None:
        for caller, called in re.findall(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', graph):
            self._calls[caller].add(called)

    def _read_library(self, code: str) -> None:
        for name, body in re.findall(r"^[0-9a-f]+ <(\w+)>:\n((?:.+\n)*)", code, re.MULTILINE):
            pushed = sum(4 * _registers(group) for group in re.findall(r"\b(?:push|stmdb\s+sp!,)\s*\{([^}]+)\}", body))
            pushed += sum(8 * _registers(group) for group in re.findall(r"\bvpush\s+\{([^}]+)\}", body))
            taken = [int(n) for n in re.findall(r"\bsub(?:\.w)?\s+sp,(?: sp,)? #(\d+)", body)]
            taken += [int(n) for n in re.findall(r"\bstr\S*\s.*\[sp, #-(\d+)\]!", body)]
            self._frames[name] = pushed + sum(taken)
            self._calls[name] = {called for called in re.findall(r"\bbl\s+[0-9a-f]+ <(\w+)>", body) if called != name}

    def _read_second_names(self, symbols: str) -> None:
        """Functions of libgcc have two names; the disassembly has one of them."""
        names: dict[str, list[str]] = {}
        for address, name in re.findall(r"^([0-9a-f]+) [tTwW] (\w+)$", symbols, re.MULTILINE):
            names.setdefault(address, []).append(name)
        for alike in names.values():
            for first in [name for name in alike if name in self._frames][:1]:
                for name in alike:
                    self._frames[name], self._calls[name] = self._frames[first], self._calls[first]

    def worst(self, function: str, callers: tuple[str, ...] = ()) -> int:
        """Bytes, including the function's own frame.

        Raises:
            SystemExit: the function is recursive, or a called function is unknown.
        """
        if function in callers:
            raise SystemExit(f"recursion: {' -> '.join([*callers, function])}")
        if function not in self._frames:
            raise SystemExit(f"{callers[-1] if callers else '?'} calls {function}, whose stack is unknown")
        if function not in self._worst:
            below = [self.worst(called, (*callers, function)) for called in self._calls[function]]
            self._worst[function] = self._frames[function] + max(below, default=0)
        return self._worst[function]

    def frame(self, function: str) -> int:
        """Bytes of the function's own frame, or of its compiler-made copy; 0 if inlined."""
        return next((size for name, size in self._frames.items() if name.split(".")[0] == function), 0)

    def path(self, function: str) -> list[str]:
        """The calls of the maximum stack, each with its frame in bytes."""
        found = [f"{function.rsplit(':', 1)[-1]} {self._frames[function]}"]
        if self._calls[function]:
            found += self.path(max(self._calls[function], key=self.worst))
        return found


def whole_graph(image: Path) -> list[str]:
    """The call graph of an image of link-time optimisation."""
    graph = image.with_name(f"{image.name}.ltrans0.ltrans.ci").read_text(encoding="utf-8")
    return [re.sub(r"[^\s\"]+\.ltrans0\.o:", "", graph)]


@dataclass(frozen=True)
class Program:
    """An exported program, compiled file by file."""

    image: Path
    stack: Stack
    flash: int
    ram: int


def exported(board: Board, level: str, source: Path, folder: Path) -> Program:
    """The folder that oncenter export c wrote, compiled with `level`, such as -Os."""
    folder.mkdir(parents=True, exist_ok=True)
    processor = [flag for flag in board.flags if flag.startswith(("-mcpu=", "-mfpu="))]
    options = (*PLAIN, *processor, level)
    objects = []
    for file in (*sorted(source.glob("core/*.c")), *sorted(source.glob("ecu/*.c"))):
        objects.append(folder / f"{file.stem}.o")
        includes = (f"-I{source / 'core'}", f"-I{source / 'ecu'}")
        _run(GCC, *options, "-fcallgraph-info=su", *includes, "-c", file, "-o", objects[-1])
    image = folder / "program.elf"
    kept = [f"-Wl,-u,{name}" for name in PROGRAM]
    _run(GCC, *options, *PLAIN_LINK, *kept, "-T", HERE / "mps2.ld", *objects, "-lm", "-o", image)
    graphs = [each.with_suffix(".ci").read_text(encoding="utf-8") for each in objects]
    text, data = _sizes(image)[:2]
    ram = sum(_sizes(folder / "oncenter_ecu.o")[1:3])
    return Program(image, Stack(image, graphs), text + data, ram)


def _registers(group: str) -> int:
    """Number of registers in a list such as `r4-r7, lr`."""
    count = 0
    for part in group.split(","):
        ends = [int(n) for n in re.findall(r"\d+", part)]
        count += ends[1] - ends[0] + 1 if len(ends) == 2 else 1
    return count
