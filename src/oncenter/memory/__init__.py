"""Memory of a truck: a small file with a row of evidence for each drive, and what a person stated."""

from __future__ import annotations

from oncenter.memory.answer import offset_with_memory
from oncenter.memory.file import read_memory, write_memory
from oncenter.memory.truck import TruckMemory

__all__ = ["TruckMemory", "offset_with_memory", "read_memory", "write_memory"]
