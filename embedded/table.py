"""Builds, replays, compares and measures the core on both boards, and updates the tables of the docs.

Fails where a bit differs, the core calls a forbidden function, a figure exceeds its limit, or a table differed from the
measurement.
"""

import re
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

import firmware
import numpy as np
from replay import BOARDS, HERE, Board, Drive, Replayed, differences, golden_drive, replay

from oncenter import export, vehicle

README = HERE / "README.md"
EXPORTED = HERE.parent / "src" / "oncenter" / "export" / "c" / "README.md"
LEVELS = ("-O0", "-Os", "-O2")
SHORT = 12000  # ticks of the drives by other methods
SAME = 0.02  # of a figure: the simulator's libm may differ in the last bits on another processor

# Limits by row of the table, for each board. A saved image takes flash for its checks: its matrices must be covariances
# and its equations must have solutions, or NaN could result.
KIB = 1024
ROWS = {
    "flash of the monitor, KiB": ("72", "68"),
    "flash with saved image, message and trouble code, KiB": ("72", "68"),
    "flash with all public functions, KiB": ("", ""),
    "flash of the offset alone, KiB": ("64", "64"),
    "RAM: state, KiB": ("28", "28"),
    "RAM: coefficients, KiB": ("", ""),
    "stack of a tick, maximum, bytes": ("1,280", "1,280"),
    "stack of setup, answer, saving and restoring, maximum, bytes": ("1,280", "1,280"),
    "instructions a tick, mean": ("", ""),
    "instructions a tick, 99th percentile": ("", ""),
    "instructions a tick, maximum": ("52,000", "19,000"),
    "instructions of an answer": ("", ""),
    "instructions to save": ("", ""),
    "instructions to restore": ("", ""),
    "bytes of a saved image": ("", ""),
}


# The same of the exported program, for each level of optimisation, on the first board.
PROGRAM_ROWS = {
    "flash, KiB": "",
    "RAM with saving, KiB": "34",
    "stack of a tick, bytes": "4,096",
    "stack of start, answer, saving and restoring, bytes": "4,096",
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
    stack = firmware.Stack(program, firmware.whole_graph(program))

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
    alone = firmware.of_offset_alone(board, core, folder / "alone")
    figures = [
        *(
            _kib(firmware.flash_bytes(board, core, folder / "core.elf", called))
            for called in (firmware.MONITOR, firmware.ECU, firmware.ALL)
        ),
        _kib(firmware.flash_bytes(board, alone, folder / "alone.elf", firmware.MONITOR)),
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


def _keep_within(row: str, figure: str, limit: str) -> None:
    too_large = limit != "" and _figures(figure) > _figures(limit)
    _fail([f"{row}: {figure} exceeds the limit of {limit}"] if too_large else [])


def table(columns: list[Measured]) -> str:
    """The table in Markdown."""
    names = [c.board.name for c in columns]
    lines = [f"| | {' | '.join(f'{name} | limit' for name in names)} |"]
    lines.append("|---" + "|--:|--:" * len(names) + "|")
    for k, (row, limits) in enumerate(ROWS.items()):
        for c, limit in zip(columns, limits, strict=True):
            _keep_within(f"{c.board.name}, {row}", c.figures[k], limit)
        cells = [cell for c, limit in zip(columns, limits, strict=True) for cell in (c.figures[k], limit)]
        lines.append(f"| {row} | {' | '.join(cells)} |")
    return "\n".join([*lines, "", *_options(columns)])


def _options(columns: list[Measured]) -> list[str]:
    """The compiler's version and options, on lines of their own: some are longer than a line of text."""
    lines = [f"By {firmware.GCC} {firmware.compiler_version()} with", f"`{' '.join(firmware.FLAGS)}`,"]
    lines += [f"for {c.board.name} `{' '.join(c.board.flags)}`," for c in columns]
    return [*lines, f"linked with `{' '.join(firmware.LINK)}`; files for which the longest tick has room with `-Os`."]


def program_table(board: Board, folder: Path) -> str:
    """The table of the exported program in Markdown."""
    shutil.rmtree(folder, ignore_errors=True)
    source = export.write_c(folder / "c", vehicle("scania_r730_4x2"))
    columns = []
    for level in LEVELS:
        program = firmware.exported(board, level, source, folder / level.strip("-"))
        rest = [name for name in firmware.PROGRAM if name != "oncenter_ecu_tick"]
        deepest = max(rest, key=program.stack.worst)
        print(f"exported program, {level}: {', '.join(program.stack.path('oncenter_ecu_tick'))}")
        print(f"exported program, {level}: {', '.join(program.stack.path(deepest))}")
        stacks = (program.stack.worst("oncenter_ecu_tick"), program.stack.worst(deepest))
        columns.append([_kib(program.flash), _kib(program.ram), *(f"{stack:,}" for stack in stacks)])
    lines = [f"| {board.name}, `ecu/` and `core/` | {' | '.join(f'`{level}`' for level in LEVELS)} | limit |"]
    lines.append("|---" + "|--:" * (len(LEVELS) + 1) + "|")
    for k, (row, limit) in enumerate(PROGRAM_ROWS.items()):
        for level, column in zip(LEVELS, columns, strict=True):
            _keep_within(f"exported program, {level}, {row}", column[k], limit)
        lines.append(f"| {row} | {' | '.join(column[k] for column in columns)} | {limit} |")
    processor = " ".join(flag for flag in board.flags if flag.startswith(("-mcpu=", "-mfpu=")))
    flags = f"`{' '.join(firmware.PLAIN)} {processor}`, linked with `-Wl,--gc-sections`"
    return "\n".join([*lines, "", f"By {firmware.GCC} {firmware.compiler_version()} with {flags}."])


def _figures(text: str) -> list[float]:
    return [float(word.replace(",", "")) for word in re.findall(r"\d[\d,]*(?:\.\d+)?", text)]


def same(old: str, new: str) -> bool:
    """Whether two tables are equal within SAME."""
    if re.sub(r"[\d,.]+", "", old) != re.sub(r"[\d,.]+", "", new):
        return False
    pairs = zip(_figures(old), _figures(new), strict=True)
    return all(abs(a - b) <= SAME * max(abs(a), abs(b)) for a, b in pairs)


def keep(page: Path, name: str, new: str) -> bool:
    """Writes a table into a page between its two marks. False if the former table differed from the measurement."""
    text = page.read_text(encoding="utf-8")
    begin, end = f"<!-- {name}: make embedded -->\n", "\n<!-- end -->"
    before, rest = text.split(begin)
    old, after = rest.split(end, 1)
    if same(old, new):
        return True
    page.write_text(before + begin + new + end + after, encoding="utf-8")
    print(f"{name} of {page.relative_to(HERE.parent)} differed from the measurement; it is updated", file=sys.stderr)
    return False


def main() -> None:
    folder = HERE.parent / "build" / "embedded"
    whole = table([measure(board, folder / board.machine) for board in BOARDS])
    program = program_table(BOARDS[0], folder / "exported")
    print(whole, program, sep="\n\n")
    kept = [keep(README, "table", whole), keep(README, "program", program), keep(EXPORTED, "program", program)]
    if not all(kept):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
