"""What MATLAB's variables are here, whichever of its formats they come from."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

_DEPTH_MAX, _STRUCTS_MAX = 32, 100_000


@dataclass(frozen=True)
class Opaque:
    """An object that only MATLAB can read; `kind` is its class, as "timetable", empty where nobody tells."""

    kind: str


# A matrix of numbers as MATLAB orders it, a struct, a struct array, text, an object; None for all else.
Value = Any


class Budget:
    """How many structs a file may have, and how deep: a damaged one may hold itself."""

    def __init__(self) -> None:
        self._depth = self._structs = 0

    @contextlib.contextmanager
    def deeper(self, structs: int = 1) -> Iterator[None]:
        """
        Raises:
            ValueError: there are too many.
        """
        self._depth += 1
        self._structs += structs
        if self._depth > _DEPTH_MAX or self._structs > _STRUCTS_MAX:
            raise ValueError("it has too many structs in structs")
        try:
            yield
        finally:
            self._depth -= 1
