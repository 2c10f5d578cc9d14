"""The values of MATLAB variables, the same for all versions of its format."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

_DEPTH_MAX, _STRUCTS_MAX = 32, 100_000


@dataclass(frozen=True)
class Opaque:
    """An object that only MATLAB can read; `kind` is its class, as "timetable", or empty if unknown."""

    kind: str


# A matrix of numbers in MATLAB's order, a struct, a struct array, text, or an object; None for anything else.
Value = Any


class Budget:
    """Limits the number and depth of structs: in a damaged file a struct may contain itself."""

    def __init__(self) -> None:
        self._depth = self._structs = 0

    @contextlib.contextmanager
    def deeper(self, structs: int = 1) -> Iterator[None]:
        """
        Raises:
            ValueError: the limit is exceeded.
        """
        self._depth += 1
        self._structs += structs
        if self._depth > _DEPTH_MAX or self._structs > _STRUCTS_MAX:
            raise ValueError("it has too many nested structs")
        try:
            yield
        finally:
            self._depth -= 1
