"""What a tick costs without the sensor check and the angle, which no product leaves out: each part alone.

The core is compiled twice as the package compiles it, once with nothing where the tick comes to the angle.
"""

from __future__ import annotations

import importlib
import runpy
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cffi
import drives
import numpy as np
from turns import best_of

from oncenter import _core

ROOT = Path(__file__).parents[1]
WITHOUT_ANGLE = """
#include "methods.h"
#define oc_observe_motion(...) ((void)0)
#define oc_follow_angle(...) ((void)0)
#include "monitor.c"
#undef oc_observe_motion
#undef oc_follow_angle
"""


def compiled(name: str, begin: str, left_out: str, folder: str) -> Any:
    """The module of one translation unit; its headers and options are the package's."""
    build = runpy.run_path(str(ROOT / "liboncenter.py"))
    ffi = cffi.FFI()
    ffi.cdef(build["declared"](build["CORE_HEADERS"]))
    files = [file.name for file in sorted((ROOT / "core").glob("*/*.c")) if file.name != left_out]
    ffi.set_source(
        name,
        begin + "".join(f'#include "{file}"\n' for file in files),
        include_dirs=[str(ROOT / folder) for folder in build["INCLUDE_DIRS"]],
        extra_compile_args=build["COMPILE_ARGS"] + build["FASTER_GCC"],
    )
    ffi.compile(tmpdir=folder)
    sys.path.insert(0, folder)
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(folder)


def runner(module: Any, method: str, columns: dict[str, drives.Column]) -> Callable[[], object]:
    """A whole drive by that method. It reads the columns' own memory: they must outlive it, contiguous."""
    ffi, lib = module.ffi, module.lib
    params, coefficients = ffi.new("oc_params *"), ffi.new("oc_coefficients *")
    lib.oc_params_defaults(params)
    params.method = getattr(lib, f"OC_METHOD_{method.upper()}")
    vehicle = {"wheelbase": drives.WHEELBASE_M, "steering_ratio": drives.STEERING_RATIO}
    assert lib.oc_setup(coefficients, ffi.new("oc_vehicle *", vehicle), params, drives.RATE_HZ) == lib.OC_OK
    native = ffi.new("oc_columns *", {"count": len(columns["time_s"])})
    for name, column in columns.items():
        setattr(native, _core.COLUMNS[name], ffi.from_buffer("double[]", column))
    state = ffi.new("oc_state *")

    def run() -> None:
        lib.oc_init(state)
        lib.oc_run(state, coefficients, native, ffi.NULL)

    return run


def parts_table(ticks: int, rounds: int) -> list[dict[str, Any]]:
    """M ticks/s by method, as in the product, without check and angle, and what these take alone; best of the rounds,
    which take turns."""
    columns = {name: np.ascontiguousarray(column) for name, column in drives.ticks(ticks).items()}
    with tempfile.TemporaryDirectory() as folder:
        whole = compiled("core_whole", "", "", folder)
        without = compiled("core_without_angle", WITHOUT_ANGLE, "monitor.c", folder)
    runs = {
        (method, how): runner(module, method, columns)
        for method in ("thesis", "joint")
        for how, module in (("whole", whole), ("without", without))
    }
    best = best_of(runs, rounds)
    return [
        {
            "method": method,
            "whole_mticks_s": ticks / best[method, "whole"] / 1e6,
            "alone_mticks_s": ticks / best[method, "without"] / 1e6,
            "angle_mticks_s": ticks / (best[method, "whole"] - best[method, "without"]) / 1e6,
        }
        for method in ("thesis", "joint")
    ]
