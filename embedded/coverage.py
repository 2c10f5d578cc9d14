"""Branch coverage of the core by its tests, from gcov; fails below 95 %.

Usage: coverage.py FOLDER, where the core was compiled with --coverage and the tests have run.
"""

import json
import subprocess
import sys
from pathlib import Path

SHARE_MIN = 0.95


def branches(folder: Path) -> dict[str, list[tuple[int, int]]]:
    """By file of the core: line and count of each branch."""
    data = next(folder.rglob("liboncenter.gcda")).resolve()
    command = ["gcov", "--json-format", "--branch-probabilities", "--stdout", str(data)]
    report = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return {
        "/".join(Path(file["file"]).parts[-2:]): [
            (line["line_number"], branch["count"]) for line in file["lines"] for branch in line["branches"]
        ]
        for file in report["files"]
        if Path(file["file"]).parent.parent.name == "core" and file["file"].endswith(".c")
    }


def main() -> None:
    found = branches(Path(sys.argv[1]))
    for name, counts in sorted(found.items()):
        never = sorted({line for line, taken in counts if not taken})
        taken = sum(1 for _, count in counts if count)
        lines = f"  not all branches: {', '.join(map(str, never))}" if never else ""
        print(f"core/{name:28} {taken:4} of {len(counts):4}{lines}")
    every = [count for counts in found.values() for _, count in counts]
    share = sum(1 for count in every if count) / len(every)
    print(f"{100 * share:.1f} % of {len(every)} branches")
    if share < SHARE_MIN:
        raise SystemExit(f"less than {100 * SHARE_MIN:.0f} %")


if __name__ == "__main__":
    main()
