"""The package is built completely or not at all, and cffi uses the library's own struct layout."""

import os
import runpy
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LIBRARY = runpy.run_path(str(ROOT / "liboncenter.py"))


def project_in(folder: Path) -> Path:
    """A copy of all files that a build reads."""
    for name in (ROOT / "MANIFEST.in").read_text(encoding="utf-8").split():
        if (ROOT / name).is_file():
            shutil.copy(ROOT / name, folder)
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    for name in ("core", "dbc", "docs", "embedded", "examples", "scenarios", "vehicles", "src"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info", "*.so"))
    shutil.copytree(ROOT / "wheels", folder / "wheels", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def built(project: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "setup.py", "-q", "bdist_wheel"]
    return subprocess.run(command, cwd=project, env=os.environ | variables, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_a_wheel_is_built_from_the_files_of_the_project(tmp_path: Path) -> None:
    done = built(project_in(tmp_path))
    assert done.returncode == 0, done.stderr
    assert [wheel.name.split("-")[2:4] for wheel in tmp_path.glob("dist/*.whl")] == [["py3", "none"]]


@pytest.mark.slow
def test_two_builds_in_two_folders_give_the_same_wheel_with_the_bill_of_its_parts(tmp_path: Path) -> None:
    wheels = []
    for name in ("here", "a/longer/folder"):
        project = tmp_path / name
        project.mkdir(parents=True)
        done = built(project_in(project), SOURCE_DATE_EPOCH="1700000000")
        assert done.returncode == 0, done.stderr
        wheels += project.glob("dist/*.whl")
    assert wheels[0].read_bytes() == wheels[1].read_bytes()
    with zipfile.ZipFile(wheels[0]) as packed:
        inside = {name.partition(".dist-info/")[2] for name in packed.namelist()}
    assert {"sboms/oncenter.cdx.json", "licenses/LICENSE", "licenses/wheels/licences/zig.txt"} <= inside


@pytest.mark.slow
@pytest.mark.parametrize("file", ["vehicles/rigid_6x2.toml", "src/oncenter/report/page.css"])
def test_a_build_without_a_file_of_the_package_names_it_and_fails(tmp_path: Path, file: str) -> None:
    project = project_in(tmp_path)
    (project / file).unlink()
    done = built(project)
    assert done.returncode != 0
    assert f"the package lacks oncenter/{file.removeprefix('src/oncenter/')}" in done.stderr.splitlines()


@pytest.mark.slow
def test_without_a_compiler_a_build_says_what_to_do(tmp_path: Path) -> None:
    done = built(project_in(tmp_path), CC="no-such-compiler")
    assert done.returncode != 0
    assert "apt-get install gcc libc6-dev" in done.stderr.splitlines()[-1]
    assert "--only-binary oncenter" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


def compiled(source: Path) -> int:
    folders = [f"-I{ROOT / folder}" for folder in LIBRARY["INCLUDE_DIRS"]]
    return subprocess.run(["cc", "-fsyntax-only", *folders, source], capture_output=True, check=False).returncode


def test_a_library_with_another_struct_layout_than_cffis_is_not_compiled(tmp_path: Path) -> None:
    source = Path(LIBRARY["write_sources"](tmp_path)[0])
    assert compiled(source) == 0
    size = LIBRARY["ffi"].sizeof("oc_state")
    text = source.read_text(encoding="utf-8")
    source.write_text(text.replace(f"sizeof(oc_state) == {size}", f"sizeof(oc_state) == {size + 8}"), encoding="utf-8")
    assert compiled(source) != 0


def test_the_library_exports_every_function_that_the_headers_declare() -> None:
    from oncenter._native import lib

    declared = set(LIBRARY["FUNCTIONS"])
    assert len(declared) > 150
    assert {name for name in declared if not callable(getattr(lib, name))} == set()
