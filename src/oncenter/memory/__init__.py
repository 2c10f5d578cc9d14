"""Memory of a truck: a small file per truck, which gives each drive its priors and is updated by it.

Play, understeer gradient by load, equivalent wheelbase and the zero errors of both sensors belong to the truck and
change slowly. The offset is no prior: each drive estimates it anew, so that a change is found. It is only listed.
"""

from __future__ import annotations

from oncenter.memory.answer import offset_with_memory
from oncenter.memory.file import read_memory, write_memory
from oncenter.memory.truck import TruckMemory

__all__ = ["TruckMemory", "offset_with_memory", "read_memory", "write_memory"]
