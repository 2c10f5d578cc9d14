"""Runs the code blocks of a page in order, as a reader would, and compares what they print with what the page shows.

    python docs/run_code.py [--write] [PAGE…]        # all pages unless named; --write renews the outputs shown

A page's blocks run in one temporary folder, which holds this checkout's `vehicles`, `dbc`, `examples`, `scenarios` and
`bench`, and the drives of `DRIVES` that the page names. By the language of a block:

- `sh`: run by `sh -e`; `oncenter` and `python` are this checkout's. A line that installs or builds is not run: its
  extras must be in pyproject.toml, its make target in the Makefile, its folder must exist.
- `python`: run, in one namespace a page; saved as well if its first line is a comment `# NAME.py`.
- `text`, or no language: the output of the block before. Its lines occur there in this order, `...` stands for any.
  Without a language, a block that begins with a command is one of `sh`.
- `toml`: read as a vehicle file, a scenario or a pyproject; saved if its first line is a comment `# NAME.toml`.
- `json`: parsed. `c`: compiled against core/. `house`: tests/test_house.py compares it with the files.

A block that cannot run has `<!-- not run: reason -->` in the line above.
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import json
import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
import textwrap
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
PAGES = (
    *("README.md", "CONTRIBUTING.md", "SECURITY.md"),
    *("examples/README.md", "examples/ros2_node/README.md", "scenarios/README.md", "bench/README.md"),
    *("embedded/README.md", "wheels/README.md"),
)
# Written from the program, which their own test compares.
GENERATED = ("docs/reference/commands.md", "docs/reference/json.md", "docs/reference/vehicle_file.md")
FENCE = re.compile(
    r"^(?P<indent> *)```(?P<language>\w*)[^\n]*\n(?P<body>.*?)^(?P=indent)```[ ]*$", re.MULTILINE | re.DOTALL
)
MARK = re.compile(r"<!-- not run: \S.*-->\s*\Z")
# Files before the first block, by the scenario that makes them; the suffix selects the format.
DRIVES = {
    "drive.log": "thesis_drive",
    "drive.mf4": "thesis_drive",
    "drive.csv": "thesis_drive",
    "drive.parquet": "thesis_drive",
    "both_ways.log": "both_ways",
    "before.log": "thesis_drive",
    "after.log": "calibrated",
}
# A scenario that is not shipped: the truck of before.log once its sensor was calibrated.
CALIBRATED = 'base = "thesis_drive"\nabout = "calibrated"\n[sensors.steering_wheel_angle]\noffset_deg = 0.1\n'
COMMANDS = ("oncenter ", "pip ", "python ", "make ")
FOLDERS = ("vehicles", "dbc", "examples", "scenarios", "bench")
SET_UP = re.compile(
    r"^\s*(make\b|pip\d? |pipx |uv |python3? -m (pip|venv) |\.venv/bin/pip |git |\. |source |sudo |apt|brew )"
)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d,]*(?:\.\d+)?")


class DocsError(Exception):
    """A block does not do what its page says."""


@dataclass(frozen=True)
class Block:
    page: str
    line: int
    language: str
    source: str
    is_run: bool
    begin: int  # of the body, in characters
    end: int
    indent: str

    def fail(self, why: str) -> DocsError:
        return DocsError(f"{self.page}:{self.line}: {why}")


def pages() -> list[str]:
    """All pages with code, as paths from the root."""
    docs = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md"))
    return [name for name in (*PAGES, *docs) if (ROOT / name).exists() and name not in GENERATED]


def blocks(page: str) -> list[Block]:
    text = (ROOT / page).read_text(encoding="utf-8")
    found = []
    for fence in FENCE.finditer(text):
        above = text[: fence.start()]
        found.append(
            Block(
                page,
                above.count("\n") + 1,
                fence["language"] or ("sh" if fence["body"].lstrip().startswith(COMMANDS) else "text"),
                textwrap.dedent(fence["body"]),
                MARK.search(above) is None,
                fence.start("body"),
                fence.end("body"),
                fence["indent"],
            )
        )
    return found


class Desk:
    """The folder that a page's blocks run in."""

    def __init__(self, folder: Path, cache: Path, text: str) -> None:
        self.folder, self.namespace, self.output = folder, {"__name__": "__main__"}, ""
        for name in FOLDERS:
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        for name, scenario in DRIVES.items():
            if re.search(rf"(?<![\w/]){re.escape(name)}\b", text):
                shutil.copy(_drive(cache, name, scenario), folder / name)
        if re.search(r"(?<![\w/])truck\.toml\b", text):
            shutil.copy(ROOT / "vehicles" / "scania_r730_4x2.toml", folder / "truck.toml")
        programs = folder / ".programs"
        programs.mkdir()
        for name, command in {"oncenter": f"{sys.executable} -m oncenter", "python": sys.executable}.items():
            (programs / name).write_text(f'#!/bin/sh\nexec {command} "$@"\n')
            (programs / name).chmod(0o755)
        self.environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "COLUMNS": "120"}

    def run(self, block: Block) -> None:
        """Raises: DocsError."""
        action = getattr(self, f"_{block.language}", None)
        if action is None:
            raise block.fail(f"nothing runs {block.language}: say `<!-- not run: reason -->` above it")
        action(block)

    def _sh(self, block: Block) -> None:
        lines = [line for line in block.source.splitlines() if not self._is_set_up(line, block)]
        if not any(lines):
            return
        ran = subprocess.run(
            ["sh", "-e", "-c", "\n".join(lines)],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL,
            text=True,
            encoding="utf-8",
        )
        self.output = ran.stdout
        if ran.returncode != 0:
            raise block.fail(f"exit code {ran.returncode}: {ran.stdout.strip()}")

    def _is_set_up(self, line: str, block: Block) -> bool:
        """Whether the line installs or builds, which is looked at instead."""
        if not SET_UP.match(line):
            return False
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
        for target in re.findall(r"\bmake +([a-z]+)\b", line.split("#")[0]):
            if not re.search(rf"^{target}:", makefile, re.MULTILINE):
                raise block.fail(f"the Makefile has no {target}")
        for extras in re.findall(r"(?:oncenter|\.)\[([\w,]+)\]", line):
            for extra in set(extras.split(",")) - set(project["optional-dependencies"]):
                raise block.fail(f"pyproject.toml has no extra {extra}")
        for path in re.findall(r"\bpip install (examples/[\w/]+)", line):
            if not (ROOT / path).exists():
                raise block.fail(f"there is no {path}")
        return True

    def _python(self, block: Block) -> None:
        name = re.match(r"# (\w+\.py)\b", block.source)
        if name is not None:
            (self.folder / name[1]).write_text(block.source, encoding="utf-8")
        run_cell = runpy.run_path(str(ROOT / "docs" / "run_notebook.py"))["run_cell"]
        with contextlib.chdir(self.folder):
            try:
                self.output, _ = run_cell(block.source, self.namespace)
            except Exception as error:
                raise block.fail(f"{type(error).__name__}: {error}") from error

    def _text(self, block: Block) -> None:
        missing = first_missing(block.source, self.output)
        if missing is not None:
            raise block.fail(f"not in the output: {missing!r}\n{self.output}")

    def _toml(self, block: Block) -> None:
        name = re.match(r"# ([\w./]+\.toml)\b", block.source)
        file = self.folder / (name[1] if name else f"block_{block.line}.toml")
        file.parent.mkdir(parents=True, exist_ok=True)
        try:
            given = tomllib.loads(block.source)
            text = block.source
            if not {"base", "drive", "project"} & set(given) and "wheelbase_m" not in given:
                text = f"wheelbase_m = 3.7\nsteering_ratio = 19.3\n{text}"  # a part of a vehicle file
            file.write_text(text, encoding="utf-8")
            _read_toml(given, file)
        except Exception as error:
            raise block.fail(f"{type(error).__name__}: {error}") from error

    def _house(self, block: Block) -> None:
        """The picture of the house."""

    def _json(self, block: Block) -> None:
        try:
            json.loads(block.source)
        except ValueError as error:
            raise block.fail(str(error)) from error

    def _c(self, block: Block) -> None:
        include = [f"-I{folder}" for folder in ROOT.glob("core/*/")]
        command = ["cc", "-std=c99", "-fsyntax-only", "-Wall", "-Werror", *include, "-xc", "-"]
        compiled = subprocess.run(command, input=block.source, capture_output=True, text=True)
        if compiled.returncode != 0:
            raise block.fail(compiled.stderr)


def _drive(cache: Path, name: str, scenario: str) -> Path:
    from oncenter.simulate import simulate_to_log

    file = cache / name
    if not file.exists():
        if scenario == "calibrated":
            (cache / "calibrated.toml").write_text(CALIBRATED, encoding="utf-8")
            scenario = str(cache / "calibrated.toml")
        simulate_to_log(scenario, 2 if name == "after.log" else 1, file)
        if name == "after.log":  # 10^6 s later: every simulated log begins at the same time
            file.write_text(file.read_text().replace("(1466", "(1467"))
    return file


def _read_toml(given: dict[str, Any], file: Path) -> None:
    import oncenter as oc
    from oncenter.simulate.scenario import read_scenario

    if "project" in given:
        return
    if "base" in given or "drive" in given:
        read_scenario(file)
    else:
        oc.vehicle(file)


def first_missing(shown: str, output: str) -> str | None:
    """The first line shown that the output does not have, after those before it; None where it has all."""
    lines = iter(output.splitlines())
    for line in shown.splitlines():
        if line.strip() in ("", "..."):
            continue
        if not any(is_alike(line, each) for each in lines):
            return line
    return None


def is_alike(shown: str, printed: str) -> bool:
    """Every word is the same. A number may differ by 10 % or by three units of its last digit.

    Each change of the method moves the numbers of a simulated drive a little.
    """
    if NUMBER.sub("#", " ".join(shown.split())) != NUMBER.sub("#", " ".join(printed.split())):
        return False
    return all(_is_near(a, b) for a, b in zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True))


def _is_near(shown: str, printed: str) -> bool:
    a, b = (float(text.replace(",", "")) for text in (shown, printed))
    digits = len(shown.partition(".")[2])
    return abs(a - b) <= max(0.1 * abs(a), 3.001 * 10.0**-digits if digits else 1.0)


def run_page(page: str, cache: Path, *, write: bool = False) -> None:
    """Runs all blocks of a page.

    Raises:
        DocsError: a block fails, or prints something else than the page shows.
    """
    text = (ROOT / page).read_text(encoding="utf-8")
    renewed = text
    found = blocks(page)
    with tempfile.TemporaryDirectory() as name:
        desk = Desk(Path(name), cache, text)
        for block in found:
            if not block.is_run:
                continue
            if write and block.language == "text":
                shown = textwrap.indent(_renewed(block.source, desk.output), block.indent)
                grown = len(renewed) - len(text)
                renewed = renewed[: block.begin + grown] + shown + renewed[block.end + grown :]
            else:
                desk.run(block)
    if renewed != text:
        (ROOT / page).write_text(renewed, encoding="utf-8")


def _renewed(shown: str, output: str) -> str:
    """The output; a block that shows only part of it keeps its lines, each as the most similar one printed."""
    lines, kept = [line.rstrip() for line in output.splitlines()], shown.splitlines()
    is_part = "..." in [line.strip() for line in kept] or 1 < len(kept) < 0.8 * len(lines)
    if not is_part:
        return "\n".join(lines).strip("\n") + "\n"
    for number, line in enumerate(kept):
        near = [] if line.strip() in ("", "...") else difflib.get_close_matches(line, lines, 1, 0.4)
        kept[number] = near[0] if near else line
    return "\n".join(kept) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description="Runs the code blocks of pages.")
    parser.add_argument("pages", nargs="*", metavar="PAGE", help="all of them unless named")
    parser.add_argument("--write", action="store_true", help="write the outputs as they are now into the pages")
    arguments = parser.parse_args()
    failed = False
    with tempfile.TemporaryDirectory() as cache:
        for page in arguments.pages or pages():
            try:
                run_page(page, Path(cache), write=arguments.write)
            except DocsError as error:
                print(error)
                failed = True
    sys.exit(failed)


if __name__ == "__main__":
    main()
