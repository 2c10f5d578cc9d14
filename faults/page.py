"""Writes docs/faults.md from the kept faults and the last complete round."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from checks import LEVELS
from kept import ROOT, Fault, kept_faults

PAGE = ROOT / "docs" / "faults.md"
ROUND = Path(__file__).with_name("round.json")
NOT_YET = {"check": "", "level": ""}
HEAD = """\
# Planted faults

The tests are checked as well. `make faults` plants 40 faults of one line in copies of the project, one at a time. It
runs the checks that concern the fault's file until one is red. The faults were drawn once, with seed 17: one for each
folder of `src/oncenter/`, and one for each of 20 files of `core/`. `faults/draw.py` finds the possible faults in the
source; `faults/faults.toml` keeps the drawn ones by function and expression.

The order of the checks: ruff and mypy, or gcc; the test files nearest to the file; all other tests of `make test`; the
further ones of `.ci/run`, then of `make night`. They end 20 minutes after the fault was planted. A check counts only if
it is red twice, and green without the fault. A test that hangs or ends its process has caught the fault. A fault that
changes no result is excused, with the reason.
"""


def row(fault: Fault, result: dict[str, Any]) -> str:
    check = f"`{result['check'].removeprefix('tests/')}`" if result["check"] else "**no check**"
    return f"| {fault.number} | {fault.kind} | {_place(fault)} | {_change(fault)} | {check} | {result['level']} |"


def _place(fault: Fault) -> str:
    return f"`{fault.file.removeprefix('src/oncenter/')}`, `{fault.function}`"


def _change(fault: Fault) -> str:
    return f"{_code(fault.expression)} → {_code(fault.replacement)}"


def _code(text: str) -> str:
    return f"`{text}`".replace("|", "\\|")


def made() -> str:
    round_ = json.loads(ROUND.read_text(encoding="utf-8"))
    faults = kept_faults()
    results = {f: round_["results"].get(str(f.number), NOT_YET) for f in faults if not f.excused}
    found = [result["level"] for result in results.values()]
    counts = ", ".join(f"`{level}` {found.count(level)}" for level in LEVELS)
    when = f"{round_['date']}, commit {round_['commit']}, {round_['spent_s'] / 60:.0f} min"
    lines = [
        HEAD,
        f"Last round: {when}. Of {len(found)} faults {counts}, no check {found.count('')}; excused "
        f"{len(faults) - len(found)}.\n",
        "| fault | kind | where | change | caught by | level |",
        "|---|---|---|---|---|---|",
        *(row(fault, result) for fault, result in results.items()),
    ]
    excused = [fault for fault in faults if fault.excused]
    if excused:
        lines += ["", "Excused:", ""]
        lines += [f"- {fault.number}, {_place(fault)}, {_change(fault)}: {fault.excused}" for fault in excused]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(made(), encoding="utf-8", newline="\n")
