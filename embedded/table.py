"""Builds, replays, compares and measures the core on both boards, and updates the table of README.md.

Fails where a bit differs, the core calls a forbidden function, or the table differed from the measurement.
"""

import re
import sys
from dataclasses import dataclass
from pathlib import Path

import firmware
import numpy as np
from replay import BOARDS, HERE, Board, Drive, Replayed, differences, golden_drive, replay

README = HERE / "README.md"
SHORT = 12000  # ticks of the drives by other methods
SAME = 0.02  # of a figure: the simulator's libm may differ in the last bits on another processor

# Limits by row of the table, for each board. A saved image takes flash for its checks: its matrices must be covariances
# and its equations must have solutions, or NaN could result.
KIB = 1024
ROWS = {
    "flash of the monitor, KiB": ("72", "72"),
    "flash with saved image, message and trouble code, KiB": ("72", "72"),
    "flash with all public functions, KiB": ("", ""),
    "RAM: state, KiB": ("28", "28"),
    "RAM: coefficients, KiB": ("", ""),
    "stack of a tick, maximum, bytes": ("1,280", "1,280"),
    "stack of setup, answer, saving and restoring, maximum, bytes": ("1,280", "1,280"),
    "instructions a tick, mean": ("", ""),
    "instructions a tick, 99th percentile": ("", ""),
    "instructions a tick, maximum": ("60,000", "20,000"),
    "instructions of an answer": ("", ""),
    "instructions to save": ("", ""),
    "instructions to restore": ("", ""),
    "bytes of a saved image": ("", ""),
}


@dataclass(frozen=True)
class Measured:
    """A board's column of the table."""

    board: Board
    figures: list[str]


def _kib(size: int) -> str:
    return f"{size / KIB:.1f}"


def _fail(problems: list[str]) -> None:
    for problem in problems:
        print(problem, file=sys.stderr)
    if problems:
        raise SystemExit(1)


def _compared(board: Board, program: Path, drive: Drive, folder: Path) -> Replayed:
    replayed = replay(board, program, drive, folder)
    _fail([f"{board.name}, {drive.method}: {found}" for found in differences(drive, replayed)])
    print(f"{board.name}: {len(replayed.rows)} ticks by the {drive.method} method, bit by bit as on this machine")
    return replayed


def measure(board: Board, folder: Path) -> Measured:
    """All figures of one board, measured on the golden drive."""
    core = firmware.compiled(board, sorted(firmware.CORE.glob("*/*.c")), folder / "core")
    _fail([f"{board.name}: the core calls {name}" for name in firmware.forbidden_calls(core)])
    written = firmware.variables(core)
    _fail([f"{board.name}: the core has {written} bytes of static variables"] if written else [])
    own = firmware.compiled(board, sorted(HERE.glob("*.c")), folder)
    program = firmware.linked(board, [*core, *own], folder / "replay.elf", firmware.ALL)
    stack = firmware.Stack(program)

    columns = golden_drive()
    short = {name: column[:SHORT] for name, column in columns.items()}
    for method, angle_method in (("thesis", "yaw-rate-understeer"), ("wheel-speed", "wheel-speed-exact")):
        _compared(board, program, Drive(short, method, angle_method), folder)
    whole = _compared(board, program, Drive(columns, "joint", "observer"), folder)

    tick = stack.worst("oc_step")
    print(f"{board.name}: maximum stack of a tick: {', '.join(stack.path('oc_step'))}")
    rest = max(map(stack.worst, ("oc_setup", "oc_answer_get", "oc_save", "oc_restore")))
    measured_rest = max(int(whole.tail[name]) for name in ("setup_stack", "answer_stack", "save_stack"))
    measured_tick = int(whole.tail["step_stack"]) - stack.frame("measured")  # which calls oc_step in replay.c
    for used, by_graph in ((measured_tick, tick), (measured_rest, rest)):
        _fail([f"{board.name}: {used} bytes of stack used, {by_graph} by the call graph"] if used > by_graph else [])
    instructions = whole.rows["instructions"]
    figures = [
        *(
            _kib(firmware.flash_bytes(board, core, folder / "core.elf", called))
            for called in (firmware.MONITOR, firmware.ECU, firmware.ALL)
        ),
        _kib(whole.tail["state"].dtype.itemsize),
        _kib(whole.tail["coefficients"].dtype.itemsize),
        f"{tick:,}",
        f"{rest:,}",
        f"{instructions.mean():,.0f}",
        f"{np.percentile(instructions, 99):,.0f}",
        f"{instructions.max():,}",
        *(f"{int(whole.tail[f'{what}_instructions']):,}" for what in ("answer", "save", "restore")),
        f"{int(whole.tail['image_bytes']):,}",
    ]
    return Measured(board, figures)


def table(columns: list[Measured]) -> str:
    """The table in Markdown."""
    names = [c.board.name for c in columns]
    lines = [f"| | {' | '.join(f'{name} | limit' for name in names)} |"]
    lines.append("|---" + "|--:|--:" * len(names) + "|")
    for k, (row, limits) in enumerate(ROWS.items()):
        cells = [cell for c, limit in zip(columns, limits, strict=True) for cell in (c.figures[k], limit)]
        lines.append(f"| {row} | {' | '.join(cells)} |")
    return "\n".join([*lines, "", f"By {firmware.GCC} {firmware.compiler_version()}."])


def _figures(text: str) -> list[float]:
    return [float(word.replace(",", "")) for word in re.findall(r"\d[\d,]*(?:\.\d+)?", text)]


def same(old: str, new: str) -> bool:
    """Whether two tables are equal within SAME."""
    if re.sub(r"[\d,.]+", "", old) != re.sub(r"[\d,.]+", "", new):
        return False
    pairs = zip(_figures(old), _figures(new), strict=True)
    return all(abs(a - b) <= SAME * max(abs(a), abs(b)) for a, b in pairs)


def keep(new: str) -> None:
    """Writes the table into README.md between its two marks.

    Raises:
        SystemExit: the former table differed from the measurement.
    """
    page = README.read_text(encoding="utf-8")
    begin, end = "<!-- table: make embedded -->\n", "\n<!-- end -->"
    before, rest = page.split(begin)
    old, after = rest.split(end)
    if not same(old, new):
        README.write_text(before + begin + new + end + after, encoding="utf-8")
        raise SystemExit("the table of embedded/README.md differed from the measurement; it is updated")


def main() -> None:
    folder = HERE.parent / "build" / "embedded"
    new = table([measure(board, folder / board.machine) for board in BOARDS])
    print(new)
    keep(new)


if __name__ == "__main__":
    main()
