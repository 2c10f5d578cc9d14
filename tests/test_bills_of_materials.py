"""A release says what it brings: a bill of the base install and of each extra, of the inside of a wheel, of a page."""

from __future__ import annotations

import json
import re
import runpy
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from base_install import PROJECT
from locked import pinned

ROOT = Path(__file__).parents[1]
WHEN = datetime(2026, 11, 27, tzinfo=UTC)
BASE = {"cffi", "numpy", "polars", "polars-runtime-32", "psutil", "pydantic", "tomlkit", "typer"}


@pytest.fixture(scope="module")
def sbom() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "wheels" / "sbom.py"))


@pytest.fixture(scope="module")
def bills(sbom: dict[str, Any]) -> dict[str, str]:
    return {extra: sbom["bill"](extra, "1.2.3", WHEN) for extra in sbom["extras"]()}


def names(bill: str) -> set[str]:
    return {component["name"] for component in json.loads(bill)["components"]}


def test_there_is_a_bill_of_the_base_install_and_of_each_extra_for_users(bills: dict[str, str]) -> None:
    assert set(bills) == {""} | set(PROJECT["optional-dependencies"]) - {"all", "dev", "docs"}


def test_each_bill_follows_the_schema_of_cyclonedx_and_is_the_same_again(
    sbom: dict[str, Any], bills: dict[str, str]
) -> None:
    for extra, bill in bills.items():
        assert sbom["faults"](bill) is None, extra
    assert sbom["bill"]("live", "1.2.3", WHEN) == bills["live"]
    assert sbom["faults"](bills[""].replace('"type": "library"', '"type": "of no kind"')) is not None


def test_a_bill_has_the_packages_that_the_extra_installs_at_the_locked_versions(bills: dict[str, str]) -> None:
    locked = pinned("wheels/requirements.txt") | pinned("requirements.lock")
    for extra, bill in bills.items():
        for component in json.loads(bill)["components"]:
            assert component["version"] == locked[component["name"]]
            assert component.get("licenses") or component["name"] == "ziglang", (extra, component["name"])
    assert names(bills[""]) >= BASE
    assert names(bills["fleet"]) - names(bills["report"]) == {"blake3"}
    assert "ray" in names(bills["ray"]) and "pyarrow" in names(bills["s3"])
    assert "tzdata" in names(bills["mf4"]), "which pandas needs on Windows"
    assert not names(bills["live"]) & {"pytest", "can-j1939"}


def test_a_bill_says_which_package_needs_which(bills: dict[str, str]) -> None:
    needs = {each["ref"]: set(each.get("dependsOn", ())) for each in json.loads(bills["fleet"])["dependencies"]}
    assert {"blake3", "bokeh", "polars"} <= needs["oncenter"]
    assert needs["polars"] == {"polars-runtime-32"}
    assert set(needs) == names(bills["fleet"]) | {"oncenter"}


def test_the_bill_inside_a_wheel_follows_the_schema(sbom: dict[str, Any]) -> None:
    assert sbom["faults"]((ROOT / "wheels" / "inside.cdx.json").read_text(encoding="utf-8")) is None


def test_the_licences_in_a_page_name_each_library_that_bokehjs_names_in_its_code() -> None:
    import bokeh

    code = (Path(bokeh.__file__).parent / "server" / "static" / "js" / "bokeh.min.js").read_text(encoding="utf-8")
    licences = (ROOT / "src" / "oncenter" / "report" / "licences.txt").read_text(encoding="utf-8")
    heads = re.findall(r"/\*!\n *\* *(.+)", code)
    named = [re.sub(r"\.js$| [\d.]+$", "", head) for head in heads if not head.startswith("Copyright (c) Anaconda")]
    assert "numbro" in named
    assert not [name for name in named if name not in licences]


def test_a_page_with_pictures_has_the_licences_before_the_code_that_they_are_of() -> None:
    from oncenter.report.document import document

    page = document("a truck", "", "<script>pictures</script>")
    assert (
        page.index("sprintf-js: Copyright") < page.index("Redistribution and use in source") < page.index("root.Bokeh")
    )
    assert page.count("<!--") == page[: page.index("root.Bokeh")].count("-->") == 1
