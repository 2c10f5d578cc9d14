"""Compiles native/*.c to `oncenter._simulate`; cffi reads the headers that the C files include."""

from __future__ import annotations

import re
from pathlib import Path

import cffi

NATIVE = Path("src/oncenter/simulate/native")  # build backends run in the project's root


def declarations(header: Path, seen: set[Path]) -> str:
    """One header after the headers of ours that it includes, without directives."""
    if header in seen:
        return ""
    seen.add(header)
    text = header.read_text(encoding="utf-8")
    before = "".join(declarations(header.parent / name, seen) for name in re.findall(r'^#include "(.+)"', text, re.M))
    return before + re.sub(r"^#.*$", "", text, flags=re.M)


ffi = cffi.FFI()
ffi.cdef(declarations(NATIVE / "drive.h", set()))
ffi.set_source(
    "oncenter._simulate",
    '#include "drive.h"',
    sources=sorted(map(str, NATIVE.glob("*.c"))),
    depends=sorted(map(str, NATIVE.glob("*.h"))),
    include_dirs=[str(NATIVE)],
    extra_compile_args=["-std=c99", "-O2", "-ffp-contract=off"],
)
