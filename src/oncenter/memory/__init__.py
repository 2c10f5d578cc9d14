"""What a truck is known to be: a small file per truck, from which each drive starts and to which it adds.

Play, understeer gradient by load, equivalent wheelbase and both sensors' zero errors belong to the truck and change
slowly. The offset does not: it is to be found anew in each drive, so that a change shows, and is only listed.
"""

from __future__ import annotations

from oncenter.memory.answer import offset_with_memory
from oncenter.memory.file import read_memory, write_memory
from oncenter.memory.truck import TruckMemory

__all__ = ["TruckMemory", "offset_with_memory", "read_memory", "write_memory"]
