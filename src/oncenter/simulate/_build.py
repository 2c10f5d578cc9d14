"""Compiles native/*.c to `oncenter._simulate`; cffi reads the headers that the C files include.

The play operator is the core's own, so that what the simulator does is what the truck's ECU assumes.
"""

from __future__ import annotations

import re
from pathlib import Path

import cffi

NATIVE = Path("src/oncenter/simulate/native")  # build backends run in the project's root
CORE = Path("core")


def declarations(header: Path, seen: set[Path]) -> str:
    """One header after the headers of ours that it includes, without directives."""
    if header in seen:
        return ""
    seen.add(header)
    text = header.read_text(encoding="utf-8")
    names = re.findall(r'^#include "(.+)"', text, re.M)
    folders = {name: NATIVE if (NATIVE / name).is_file() else CORE for name in names}
    before = "".join(declarations(folder / name, seen) for name, folder in folders.items())
    return before + re.sub(r"^#.*$", "", text, flags=re.M)


ffi = cffi.FFI()
ffi.cdef(declarations(NATIVE / "drive.h", set()))
ffi.set_source(
    "oncenter._simulate",
    '#include "drive.h"',
    sources=[*sorted(map(str, NATIVE.glob("*.c"))), str(CORE / "backlash.c")],
    depends=[*sorted(map(str, NATIVE.glob("*.h"))), str(CORE / "backlash.h")],
    include_dirs=[str(NATIVE), str(CORE)],
    extra_compile_args=["-std=c99", "-O2", "-ffp-contract=off"],
)
