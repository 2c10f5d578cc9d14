"""Writes the bill of materials of a base install and of each extra: the packages that `pip install` brings, with their
versions, licences and who needs whom, as CycloneDX.

Usage: sbom.py OUTPUT. The versions are those of the locks; the rest is read from the installed packages of [dev], of
the compiler zig from those that built the wheels.
"""

from __future__ import annotations

import re
import runpy
import sys
import uuid
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import Distribution, DistributionFinder
from pathlib import Path
from typing import Any

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL

ROOT = Path(__file__).parents[1]
LOCKS = ("requirements.lock", "wheels/requirements.txt")  # ziglang, of the extra fmu, is in the second
NOT_FOR_USERS = ("all", "dev", "docs")
PYTHON = "py" + "pi"  # the type of a package in its URL
_licences = runpy.run_path(str(ROOT / "docs" / "make_licences.py"))
PROJECT: dict[str, Any] = _licences["PROJECT"]


def extras() -> list[str]:
    return ["", *sorted(set(PROJECT["optional-dependencies"]) - set(NOT_FOR_USERS))]


def bill(extra: str, version: str, built: datetime) -> str:
    """The bill of an extra, of the base install if empty, as JSON; the same for the same commit."""
    pins = pinned()
    waiting = [("oncenter", wanted) for wanted in {"", extra}]
    needs: dict[str, set[str]] = {}
    seen = set(waiting)
    while waiting:
        name, of_extra = waiting.pop()
        found = [(other, wanted) for other, own in _requirements(name, of_extra) for wanted in ("", *own)]
        needs.setdefault(name, set()).update({other for other, _ in found} - {name})
        waiting += set(found) - seen
        seen |= set(found)
    ours = f"oncenter[{extra}]" if extra else "oncenter"
    components = {name: _component(name, pins[name]) for name in needs if name != "oncenter"}
    components["oncenter"] = _described("oncenter", ours, version, PROJECT["license"])
    bom = Bom(serial_number=uuid.uuid5(uuid.NAMESPACE_URL, f"{ours}=={version}"))
    bom.metadata.timestamp, bom.metadata.component = built, components["oncenter"]
    bom.components.update(components[name] for name in needs if name != "oncenter")
    for name, others in needs.items():
        bom.register_dependency(components[name], [components[other] for other in others])
    return JsonV1Dot6(bom).output_as_string(indent=1) + "\n"


def pinned() -> dict[str, str]:
    texts = [(ROOT / lock).read_text(encoding="utf-8") for lock in reversed(LOCKS)]
    return dict(re.findall(r"^([\w.-]+)==([\w.]+)", "\n".join(texts), re.MULTILINE))


def _requirements(name: str, extra: str) -> list[tuple[str, set[str]]]:
    """None of a package that only another system needs, which is not installed here."""
    is_known = name == "oncenter" or _installed(name) is not None
    return _licences["requirements"](name, extra) if is_known else []


@cache
def _installed(name: str, elsewhere: str = "") -> Distribution | None:
    places = [*sys.path, *map(str, ROOT.glob(elsewhere))] if elsewhere else sys.path
    return next(iter(Distribution.discover(context=DistributionFinder.Context(name=name, path=places))), None)


def _component(name: str, version: str) -> Component:
    return _described(name, name, version, _licence(name))


def _licence(name: str) -> str:
    """As in docs/licences.md, which lists the packages of other systems too."""
    package = _installed(name, "build/wheels/lib/python*/site-packages")
    if package is not None:
        return str(_licences["licence"](package))
    row = re.search(rf"^\| {name} \| \S+ \| (.+) \|$", _licences["PAGE"].read_text(encoding="utf-8"), re.MULTILINE)
    return row[1] if row else ""


def _described(reference: str, name: str, version: str, licence: str) -> Component:
    return Component(
        bom_ref=reference,
        type=ComponentType.LIBRARY,
        name=name,
        version=version,
        purl=PackageURL(PYTHON, None, reference, version),
        licenses=[LicenseFactory().make_from_string(licence)] if licence else [],
    )


def faults(text: str) -> str | None:
    """Why a text is no CycloneDX 1.6, by its schema; None if it is."""
    found = JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)
    return None if found is None else str(found)


def main() -> None:
    folder = Path(sys.argv[1])
    built = datetime.fromtimestamp(runpy.run_path(str(ROOT / "wheels" / "build.py"))["commit_s"](), UTC)
    version = next(folder.glob("oncenter-*.tar.gz")).name.removeprefix("oncenter-").removesuffix(".tar.gz")
    for extra in extras():
        text = bill(extra, version, built)
        if (why := faults(text)) is not None:
            raise SystemExit(f"the bill of materials of '{extra}' is no CycloneDX: {why.splitlines()[0]}")
        file = folder / f"oncenter-{version}{extra and '-'}{extra}.cdx.json"
        file.write_text(text, encoding="utf-8")
        print(f"{file.name}  {text.count('bom-ref')} packages")


if __name__ == "__main__":
    main()
