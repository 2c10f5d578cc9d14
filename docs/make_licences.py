"""Writes docs/licences.md from the installed packages: run by `make lock`, after the lock itself."""

from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PAGE = Path(__file__).with_name("licences.md")

HEAD = """# Licences of what oncenter uses

oncenter itself is MIT. This page is made by `make lock` from the metadata of the packages that `requirements.lock`
pins; none of them is copied into this repository. The C core uses nothing but the C library. A report page carries
BokehJS (bokeh, BSD-3-Clause) within itself, an FMU the headers of its standard (Modelica Association, BSD-2-Clause,
their text beside them in `src/oncenter/export/fmi`).
"""


def needed(names: list[str], extra: str = "") -> set[str]:
    """The packages by these names and all that they need in turn, oncenter itself left out."""
    seen = {(name, extra) for name in names}
    waiting = list(seen)
    while waiting:
        name, extra = waiting.pop()
        for text in distribution(name).requires or []:
            requirement = Requirement(text)
            if requirement.marker and not requirement.marker.evaluate({"extra": extra}):
                continue
            needs = canonicalize_name(requirement.name)
            new = {(needs, wanted) for wanted in ["", *requirement.extras]} - seen
            seen |= new
            waiting += new
    return {name for name, _ in seen} - {"oncenter"}


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
    base = needed(["oncenter"])
    users = needed(["oncenter"], extra="all")
    developers = needed(["oncenter"], extra="dev")
    parts = [
        HEAD,
        *("## To run it: `pip install oncenter`\n", table(base)),
        *("## With all extras: `pip install 'oncenter[all]'`\n", table(users - base)),
        *("## To test and measure it\n", table(developers - users)),
    ]
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
