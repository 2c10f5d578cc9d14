"""The core as one folder of C for an ECU project."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.export.a2l import a2l
from oncenter.export.core_source import LICENCE, core_files
from oncenter.export.variables import variables_of
from oncenter.export.vectors import vectors_header, vectors_truck
from oncenter.files.whole_file import write_whole

_C = Path(__file__).with_name("c")
_PARTS = ("core", "ecu", "test")


def write_c(output: str | os.PathLike[str]) -> Path:
    """Writes the core with README, licence, test vectors, a plain C test, and an A2L description.

    Args:
        output: the folder to write, which is new or empty.

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
        _fill(folder, _contents())
    except OSError as error:
        raise OncenterError(
            f"cannot write {folder}: {error.strerror or error}", code="output", exit_code=WRONG_USAGE
        ) from None
    return folder


def _fill(folder: Path, contents: Mapping[str, str]) -> None:
    """All of it or nothing: the next run would reject a folder with a part."""
    try:
        for name in _PARTS:
            (folder / name).mkdir(parents=True, exist_ok=True)
        for name, text in contents.items():
            write_whole(folder / name, text)
    except BaseException:  # an interruption as well
        with suppress(OSError):
            _empty(folder, contents)
        raise


def _empty(folder: Path, names: Iterable[str]) -> None:
    for name in names:
        (folder / name).unlink(missing_ok=True)
    for part in _PARTS:
        with suppress(FileNotFoundError):
            (folder / part).rmdir()


def _contents() -> dict[str, str]:
    def ours(name: str) -> str:
        return (_C / name).read_text(encoding="utf-8")

    return {
        "README.md": ours("README.md").replace("@VERSION@", _core.version()),
        "LICENSE": LICENCE.read_text(encoding="utf-8"),
        "Makefile": ours("Makefile"),
        **{f"core/{file.name}": file.read_text(encoding="utf-8") for file in core_files()},
        "ecu/oncenter_ecu.h": ours("oncenter_ecu.h"),
        "ecu/oncenter_ecu.c": ours("oncenter_ecu.c"),
        "ecu/oncenter.a2l": a2l(variables_of(vectors_truck())),
        "test/test_vectors.c": ours("test_vectors.c"),
        "test/vectors.h": vectors_header(),
    }
