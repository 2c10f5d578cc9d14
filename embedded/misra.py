"""Compares the findings of cppcheck's MISRA add-on in the core with the deviations listed in misra.md."""

import re
import subprocess
from pathlib import Path

HERE = Path(__file__).parent
CORE = HERE.parent / "core"


def found() -> dict[str, list[str]]:
    """Places by rule: "core/numbers/trig.c:37"."""
    files = [*(f"-I{folder}" for folder in CORE.glob("*/")), *sorted(CORE.glob("*/*.c"))]
    command = ["cppcheck", "-q", "--std=c99", "--addon=misra", "--enable=style", *files]
    said = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True).stderr
    places: dict[str, list[str]] = {}
    for path, line, rule in re.findall(r"^(.+?):(\d+):.*\[misra-c2012-([\d.]+)\]$", said, re.MULTILINE):
        places.setdefault(rule, []).append(f"core/{Path(path).relative_to(CORE)}:{line}")
    return places


def main() -> None:
    rows = re.findall(r"^\| ([\d.]+) \|(.*)", (HERE / "misra.md").read_text(encoding="utf-8"), re.MULTILINE)
    listed = {rule for rule, _ in rows}
    by_one_version = {rule for rule, rest in rows if "(cppcheck " in rest}
    places = found()
    for rule in sorted(places.keys() - listed):
        print(f"MISRA {rule} is violated and not listed in embedded/misra.md: {', '.join(places[rule])}")
    without = sorted(listed - by_one_version - places.keys())
    for rule in without:
        print(f"MISRA {rule} is listed in embedded/misra.md without a violation")
    if without or places.keys() - listed:
        raise SystemExit(1)
    print(f"MISRA C:2012: {sum(map(len, places.values()))} places by {len(places)} rules of embedded/misra.md")


if __name__ == "__main__":
    main()
