"""An output is never one of the inputs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping

from oncenter.errors import WRONG_USAGE, OncenterError


def spare_inputs(
    outputs: Mapping[str, str | os.PathLike[str] | None], inputs: Iterable[str | os.PathLike[str] | None]
) -> None:
    """Refuses, before anything is read, an output that is the same file as an input, whatever its name or link.

    Args:
        outputs: by the option that names it; None where it is not given.
        inputs: logs, vehicle file, DBCs; None where one is not given.

    Raises:
        OncenterError: "output", exit code 2.
    """
    read = [path for path in inputs if path is not None]
    for option, output in outputs.items():
        for path in read:
            if output is not None and _is_same_file(output, path):
                raise OncenterError(
                    f"{option} {os.fspath(output)} would overwrite the input {os.fspath(path)}: name another file",
                    code="output",
                    exit_code=WRONG_USAGE,
                )


def _is_same_file(one: str | os.PathLike[str], other: str | os.PathLike[str]) -> bool:
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):  # one does not exist or cannot be accessed: it is not overwritten either
        return False
