"""Kept files that a script writes: each script has a target, and what it takes seconds to write again is up to date."""

import re
import runpy
from collections.abc import Iterator

import pytest
from test_house import ROOT, kept_files, text

OPTION = re.compile(r'"(--(?:page|readme|write))"')
WRITES_A_KEPT_FILE = re.compile(r"\b[A-Z]+\.write_(?:text|bytes)\(")  # its path is a constant: PAGE, README
RECIPES = re.findall(r"^\t.*", text("Makefile").replace("\\\n", ""), re.MULTILINE)
WRITTEN = re.findall(r"docs/make_\w+\.py", re.findall(r"^written:.*\n((?:\t.*\n)+)", text("Makefile"), re.MULTILINE)[0])


def generators() -> Iterator[str]:
    """Scripts that write kept files, with the option that makes them do so."""
    for path in kept_files():
        source = path.read_text(encoding="utf-8") if path.suffix == ".py" else ""
        if "__main__" not in source:
            continue
        option = OPTION.search(source)
        if option or path.name.startswith("make_") or WRITES_A_KEPT_FILE.search(source):
            yield f"{path.relative_to(ROOT).as_posix()} {option[1] if option else ''}".strip()


def is_called(generator: str) -> bool:
    script, *option = generator.split()
    return any(script in line and set(option) <= set(line.split()) for line in RECIPES)


def test_a_target_calls_each_script_that_writes_a_kept_file() -> None:
    assert sorted(generator for generator in generators() if not is_called(generator)) == []


@pytest.mark.parametrize("script", WRITTEN)
def test_a_file_is_what_its_script_writes(script: str) -> None:
    made = runpy.run_path(str(ROOT / script))["made"]()
    stale = [path.name for path, written in made.items() if path.read_text(encoding="utf-8") != written]
    assert stale == [], "run make written"
