"""The core as one folder of C that an ECU project takes in."""

from __future__ import annotations

import os
from pathlib import Path

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.export.a2l import a2l
from oncenter.export.core_source import LICENCE, core_files
from oncenter.export.variables import variables_of
from oncenter.export.vectors import vectors_header, vectors_truck

_C = Path(__file__).with_name("c")


def write_c(output: str | os.PathLike[str]) -> Path:
    """Writes the core with README, licence, test vectors, a plain C test, and an A2L description.

    Args:
        output: the folder to write, which is new or empty.

    Returns:
        The path written.

    Raises:
        OncenterError: "output", exit code 2: it holds something already, or cannot be written.
    """
    folder = Path(output)
    try:
        if folder.exists() and any(folder.iterdir()):
            raise OncenterError(
                f"{folder} is not empty: --output takes a folder that is new or empty",
                code="output",
                exit_code=WRONG_USAGE,
            )
        for name in ("core", "ecu", "test"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        for name, text in _contents().items():
            (folder / name).write_text(text, encoding="utf-8")
    except OSError as error:
        raise OncenterError(
            f"cannot write {folder}: {error.strerror or error}", code="output", exit_code=WRONG_USAGE
        ) from None
    return folder


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
