"""Writes docs/licences.md from the installed packages: run by `make lock`, after the lock itself."""

import tomllib
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PAGE = Path(__file__).with_name("licences.md")
PROJECT = tomllib.loads((PAGE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# Every system that a wheel is for: a package that one of them needs is listed.
SYSTEMS = (
    {"sys_platform": "linux", "platform_system": "Linux", "os_name": "posix", "platform_machine": "x86_64"},
    {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt", "platform_machine": "AMD64"},
    {"sys_platform": "darwin", "platform_system": "Darwin", "os_name": "posix", "platform_machine": "arm64"},
)

HEAD = """# Licences of what oncenter uses

oncenter itself is MIT. This page is made by `make lock` from the metadata of the packages that `requirements.lock`
pins, for every system that has a wheel. None of them is copied into this repository. The C core uses nothing but the C
library. Three things carry the work of others within themselves, with the texts of its licences:

- a report page: BokehJS (bokeh, BSD-3-Clause) and the libraries in it (`src/oncenter/report/licences.txt`),
- a wheel and an FMU: the headers of FMI (Modelica Association, BSD-2-Clause, `src/oncenter/export/fmi`),
- a library that zig compiled: zig's runtime, on Windows also that of MinGW-w64 (`wheels/licences`).

One file is made from the data of others: `src/oncenter/traffic_sides.txt`, from the borders of Natural Earth, which
is in the public domain.
"""


def needed(extra: str = "") -> set[str]:
    """The packages that oncenter needs, with those that they need in turn."""
    seen = {("oncenter", wanted) for wanted in {"", extra}}
    waiting = list(seen)
    while waiting:
        new = {(name, wanted) for name, extras in requirements(*waiting.pop()) for wanted in ["", *extras]} - seen
        seen |= new
        waiting += new
    return {name for name, _ in seen} - {"oncenter"}


def requirements(name: str, extra: str = "") -> list[tuple[str, set[str]]]:
    """The needs of a package with an extra of it, on any system: names with their own extras."""
    given = [Requirement(text) for text in _stated(name, extra)]
    return [(canonicalize_name(each.name), each.extras) for each in given if _holds(each, extra)]


def _stated(name: str, extra: str) -> list[str]:
    if name == "oncenter":
        return PROJECT["optional-dependencies"][extra] if extra else PROJECT["dependencies"]
    return distribution(name).requires or []


def _holds(requirement: Requirement, extra: str) -> bool:
    marker = requirement.marker
    return marker is None or any(marker.evaluate({"extra": extra, **system}) for system in SYSTEMS)


def licence(package: Distribution) -> str:
    """The SPDX expression where there is one, else the classifiers, else the first line of the free text, else what the
    licence's own file says in its head."""
    said = package.metadata
    classifiers = [c.split(" :: ")[-1] for c in said.get_all("Classifier", []) if c.startswith("License ::")]
    free_text = (said.get("License") or "").strip().splitlines()
    stated = said.get("License-Expression") or ", ".join(classifiers) or "".join(free_text[:1])
    return stated or _headline(package) or "not stated"


def _headline(package: Distribution) -> str:
    """The first line of the licence's file that names one."""
    files = [file for file in package.files or [] if file.name in package.metadata.get_all("License-File", [])]
    lines = [line.strip() for file in files[:1] for line in file.read_text().splitlines()]
    return next((line.rstrip(":") for line in lines if "license" in line.lower()), "")


def table(names: set[str]) -> str:
    packages = [distribution(name) for name in sorted(names)]
    rows = [f"| {p.metadata['Name']} | {p.version} | {licence(p)} |" for p in packages]
    return "\n".join(["| package | version | licence |", "|---|---|---|", *rows, ""])


def main() -> None:
    base = needed()
    users = needed("all") | needed("ray")
    developers = needed("dev")
    parts = [
        HEAD,
        *("## To run it: `pip install oncenter`\n", table(base)),
        *("## With all extras: `pip install 'oncenter[all,ray]'`\n", table(users - base)),
        *("## To test and measure it\n", table(developers - users)),
    ]
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
