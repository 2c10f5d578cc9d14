"""An interpreter with only the packages of `pip install oncenter`: all other installed packages are hidden from it and
its child processes. Commands run in it one after the other, because it takes a second to start."""

from __future__ import annotations

import contextlib
import io
import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import distribution, packages_distributions
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

# Python runs a file of this name when it begins, in each child process as well.
BLOCKER = """
import sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in BLOCKED:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

BLOCKED = frozenset({blocked!r})
sys.meta_path.insert(0, Blocker())
"""


@dataclass(frozen=True)
class Result:
    """The result of a command."""

    exit_code: int
    out: str
    err: str


class Interpreter:
    """One without some modules.

    Args:
        folder: empty, for what keeps the modules away.
        modules: by the names of their packages as they are imported.
    """

    def __init__(self, folder: Path, modules: Iterable[str]) -> None:
        (folder / "sitecustomize.py").write_text(BLOCKER.replace("{blocked!r}", repr(sorted(modules))))
        path = os.pathsep.join([str(folder), str(ROOT / "src"), os.environ.get("PYTHONPATH", "")])
        self._process = subprocess.Popen(
            [sys.executable, __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": path},
        )

    def oncenter(self, *arguments: object, folder: Path) -> Result:
        """Runs a command of oncenter in this folder."""
        return self._ask({"arguments": [str(argument) for argument in arguments], "folder": str(folder)})

    def python(self, program: str, folder: Path) -> Result:
        """Runs a program; `err` is its exception."""
        return self._ask({"program": program, "folder": str(folder)})

    def close(self) -> None:
        self._process.communicate()

    def _ask(self, request: dict[str, Any]) -> Result:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return Result(**json.loads(self._process.stdout.readline()))


def not_of_the_base() -> set[str]:
    """All installed modules that a base install does not have."""
    from packaging.utils import canonicalize_name

    base = _with_what_they_need(PROJECT["dependencies"]) | {"oncenter"}
    brought = packages_distributions()
    return {
        module
        for module, packages in brought.items()
        if not base & {canonicalize_name(package) for package in packages}
    }


def _with_what_they_need(requirements: Iterable[str]) -> set[str]:
    from packaging.requirements import Requirement  # late: a base install has no packaging
    from packaging.utils import canonicalize_name

    found: set[str] = set()
    waiting = [Requirement(text) for text in requirements]
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        if name in found or (requirement.marker and not requirement.marker.evaluate({"extra": ""})):
            continue
        found.add(name)
        waiting += [Requirement(text) for text in distribution(name).requires or []]
    return found


def _answer(request: dict[str, Any]) -> Result:
    """Within the interpreter."""
    os.chdir(request["folder"])
    out, err = io.StringIO(), io.StringIO()
    exit_code = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        if "arguments" in request:
            from oncenter.cli import run

            exit_code = run(request["arguments"])
        else:
            try:
                exec(request["program"], {})
            except Exception as error:
                print(f"{type(error).__name__}: {error}", file=sys.stderr)
    return Result(exit_code, out.getvalue(), err.getvalue())


if __name__ == "__main__":
    for line in sys.stdin:
        said = _answer(json.loads(line))
        print(json.dumps(said.__dict__), flush=True)
