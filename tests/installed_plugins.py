"""The plug-ins of examples/ in installed form: a module, and metadata with its entry points."""

import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

EXAMPLES = Path(__file__).parents[1] / "examples"
Run = Callable[..., subprocess.CompletedProcess[str]]


def installed(site: Path, *examples: str) -> Run:
    """The command line where these examples are installed in `site`."""
    for example in examples:
        project = tomllib.loads((EXAMPLES / example / "pyproject.toml").read_text(encoding="utf-8"))
        (module,) = project["tool"]["setuptools"]["py-modules"]
        shutil.copy(EXAMPLES / example / f"{module}.py", site)
        add_metadata(site, project["project"]["name"], project["project"]["entry-points"]["oncenter.readers"])
    return command_line(site)


def add_metadata(site: Path, package: str, entry_points: Mapping[str, str]) -> None:
    folder = site / f"{package.replace('-', '_')}-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    lines = [f"{name} = {value}" for name, value in entry_points.items()]
    (folder / "entry_points.txt").write_text("\n".join(["[oncenter.readers]", *lines, ""]))


def command_line(site: Path) -> Run:
    places = os.pathsep.join([str(site), *filter(None, [os.environ.get("PYTHONPATH")])])

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "oncenter", *arguments]
        environment = {**os.environ, "PYTHONPATH": places}
        return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)

    return run
