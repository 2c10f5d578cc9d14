"""The core for other tools: as an FMU for function developers, as a folder of C for firmware.

>>> import oncenter as oc
>>> from oncenter import export
>>> export.write_fmu(oc.vehicle("truck.toml"), "truck.fmu", fmi=3)  # doctest: +SKIP
>>> export.write_c("oncenter-c")  # doctest: +SKIP
"""

from oncenter.export.c_folder import write_c as write_c
from oncenter.export.fmu import write_fmu as write_fmu

__all__ = ["write_c", "write_fmu"]
