"""Runs the checks that are too long for each change, part by part, and writes their results into docs/checks.md.

    make night              # each part that has not passed on this commit
    make night PART=fuzz    # one part, or several: PART='fuzz fmu'

A part is the make target of its name, and ends within an hour. What it prints is kept in build/night/PART.log.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "checks.md"
BEGIN, END = "<!-- results: make night -->\n", "<!-- end -->\n"
MAX_S = 3600.0
PARTS = {
    "slow": "errors and intervals over many drives, killed fleets, full disks, builds, exports, a log of 2 GB",
    "damaged": "damaged and hostile logs and vehicle files",
    "benches": "every bench, with small sizes",
    "pages": "the code of every page and notebook",
    "sanitize": "all tests that are not slow, the C compiled with address and undefined-behaviour sanitizers",
    "coverage": "the branches of the core that its tests take",
    "elsewhere": "the types as for Windows and macOS",
    "embedded": "the core on two emulated microcontrollers",
    "fmu": "the FMU's other platforms in emulators, two further importers",
    "wheels": "a wheel for each platform, checked where it can run",
    "zip": "the zip for Windows: complete, its install.cmd in wine",
    "lowest": "the lowest versions of all packages",
    "audit": "known vulnerabilities of the locked packages",
    "fuzz": "random bytes into the core, mutated logs into the readers",
}
HEAD = "| part | checks | date | commit | min | load | result |\n|---|---|---|---|--:|---|---|\n"
Row = tuple[str, ...]


def results(page: str) -> dict[str, Row]:
    """The rows of the page by their part."""
    table = page.split(BEGIN)[1].split(END)[0].splitlines()[2:]
    rows = [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in table]
    return {row[0]: row for row in rows}


def with_results(page: str, rows: dict[str, Row]) -> str:
    before, rest = page.split(BEGIN)
    nothing = ("", "", "", "", "not run yet")
    lines = [f"| {' | '.join(rows.get(part, (part, PARTS[part], *nothing)))} |\n" for part in PARTS]
    return before + BEGIN + HEAD + "".join(lines) + END + rest.split(END)[1]


def commit() -> str:
    """The last commit that changed more than the page of results; "changed" if the files differ from it."""
    others = ["--", ".", f":!{PAGE.relative_to(ROOT)}"]
    newest = git("log", "-1", "--format=%h", *others)
    return f"{newest}, changed" if git("status", "--porcelain", *others) else newest


def git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def failures(log: str) -> str:
    """What failed, for a table: the tests that pytest names, or else the last line."""
    tests = [name.split("::", 1)[-1] for name in re.findall(r"^(?:FAILED|ERROR) (\S+)", log, re.MULTILINE)]
    said = ", ".join(f"`{name}`" for name in dict.fromkeys(tests)) or (log.strip() or "no output").splitlines()[-1]
    return said.replace("|", "\\|")


def passed(log: str) -> str:
    """A part may say in its last line that it could not check anything here, and why."""
    if (last := (log.strip() or "no output").splitlines()[-1]).startswith("skipped: "):
        return last
    counts = [int(count) for count in re.findall(r"^.*?(\d+) passed", log, re.MULTILINE)]
    return f"passed, {sum(counts):,} tests" if counts else "passed"


def run(part: str) -> Row:
    kept = ROOT / "build" / "night" / f"{part}.log"
    kept.parent.mkdir(parents=True, exist_ok=True)
    tried, before, began = commit(), os.getloadavg()[0], time.monotonic()
    with kept.open("w", encoding="utf-8") as output:
        make = subprocess.Popen(
            ["make", part], cwd=ROOT, stdout=output, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            code = make.wait(MAX_S)
        except BaseException as ended:
            os.killpg(make.pid, signal.SIGKILL)
            if not isinstance(ended, subprocess.TimeoutExpired):
                raise
            code = None
    log = kept.read_text(encoding="utf-8", errors="replace")
    result = passed(log) if code == 0 else f"**{failures(log)}**" if code else "**did not end within an hour**"
    minutes = (time.monotonic() - began) / 60.0
    load = f"{before:.1f} to {os.getloadavg()[0]:.1f}"
    return (part, PARTS[part], f"{datetime.now(UTC):%Y-%m-%d}", tried, f"{minutes:.1f}", load, result)


def main(wanted: list[str]) -> int:
    if unknown := [part for part in wanted if part not in PARTS]:
        print(f"no part {unknown[0]}: the parts are {', '.join(PARTS)}", file=sys.stderr)
        return 2
    failed = False
    for part in wanted or PARTS:
        last = results(PAGE.read_text(encoding="utf-8")).get(part)
        if not wanted and last and last[3] == commit() and last[-1].startswith("passed"):
            print(f"{part}: has passed on {last[3]}")
            continue
        print(f"{part}: {PARTS[part]}", flush=True)
        row = run(part)
        print(f"{part}: {row[-1]}, {row[4]} min", flush=True)
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(with_results(page, results(page) | {part: row}), encoding="utf-8")
        failed |= not row[-1].startswith(("passed", "skipped: "))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
