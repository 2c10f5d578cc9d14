"""The core as one folder of C for an ECU project."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.export.a2l import a2l
from oncenter.export.c_vehicle import vehicle_source
from oncenter.export.core_source import LICENCE, core_files
from oncenter.export.variables import variables_of
from oncenter.export.vectors import vectors_header, vectors_truck
from oncenter.files.shipped import shipped
from oncenter.files.whole_file import write_whole
from oncenter.vehicle import Vehicle

_C = Path(__file__).with_name("c")


def write_c(output: str | os.PathLike[str], vehicle: Vehicle | None = None) -> Path:
    """Writes the core and one truck's monitor, with README, licence, test vectors, a plain C test, and an A2L file.

    Args:
        output: the folder to write, which is new or empty.
        vehicle: the truck of `ecu/`; without one, the calibration of the ECU sets `oncenter_vehicle`.

    Returns:
        The path written.

    Raises:
        OncenterError: "output", exit code 2: it is not empty, or cannot be written.
    """
    folder = Path(output)
    try:
        if folder.exists() and any(folder.iterdir()):
            raise OncenterError(
                f"{folder} is not empty: --output takes a folder that is new or empty",
                code="output",
                exit_code=WRONG_USAGE,
            )
        _fill(folder, _contents(vehicle))
    except OSError as error:
        raise OncenterError(
            f"cannot write {folder}: {error.strerror or error}", code="output", exit_code=WRONG_USAGE
        ) from None
    return folder


def _fill(folder: Path, contents: Mapping[str, str]) -> None:
    """All of it or nothing: the next run would reject a folder with a part."""
    try:
        for name, text in contents.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_whole(folder / name, text)
    except BaseException:  # an interruption as well
        with suppress(OSError):
            _empty(folder, contents)
        raise


def _empty(folder: Path, names: Iterable[str]) -> None:
    for name in names:
        (folder / name).unlink(missing_ok=True)
    for part in {(folder / name).parent for name in names} - {folder}:
        with suppress(FileNotFoundError):
            part.rmdir()


def _contents(vehicle: Vehicle | None) -> dict[str, str]:
    def ours(name: str) -> str:
        return (_C / name).read_text(encoding="utf-8")

    def of_project(name: str) -> str:
        return shipped(name).read_text(encoding="utf-8")

    own = ("CMakeLists.txt", "Makefile", "zephyr/CMakeLists.txt", "zephyr/Kconfig", "zephyr/module.yml")
    ecu = ("oncenter_ecu.h", "oncenter_ecu.c", "oncenter_vehicle.h")
    readme = re.sub(r"^<!--.*-->\n", "", ours("README.md"), flags=re.MULTILINE).replace("@VERSION@", _core.version())
    return {
        "README.md": readme.replace("@VEHICLE@", _about(vehicle)),
        "LICENSE": LICENCE.read_text(encoding="utf-8"),
        **{name: ours(name) for name in own},
        **{f"core/{file.name}": file.read_text(encoding="utf-8") for file in core_files()},
        **{f"ecu/{name}": ours(name) for name in ecu},
        "ecu/oncenter.h": ours("oncenter.h").replace("@VERSION_NUMBER@", str(_version_number())),
        "ecu/oncenter_vehicle.c": vehicle_source(vehicle),
        "ecu/oncenter.a2l": a2l(variables_of(vehicle or vectors_truck())),
        "bus/oncenter_result.dbc": of_project("dbc/oncenter_result.dbc"),
        "doc/method.md": of_project("docs/method.md"),
        "doc/misra.md": of_project("embedded/misra.md"),
        "example/integration.c": of_project("examples/integration.c"),
        **{f"example/{name}": ours(name) for name in ("j1939.c", "j1939.h")},
        "offset_only/offset_only.c": ours("offset_only.c"),
        "test/test_vectors.c": ours("test_vectors.c"),
        "test/vectors.h": vectors_header(),
    }


def _about(vehicle: Vehicle | None) -> str:
    if vehicle is None:
        return (
            "This folder has no truck: `oncenter export c --vehicle truck.toml` writes one into "
            "`ecu/oncenter_vehicle.c`.\nWithout it your code fills `oncenter_vehicle` after `oncenter_ecu_defaults`."
        )
    return (
        f"`ecu/` is the monitor of one truck: {vehicle.name}. All values of its vehicle file that the core uses are in."
    )


def _version_number() -> int:
    """As ONCENTER_VERSION has it."""
    major, minor, patch = map(int, _core.version().split("."))
    return major * 10000 + minor * 100 + patch
