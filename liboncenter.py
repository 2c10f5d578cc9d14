"""The sources of the shared library `liboncenter`, the C core and the simulator, and their declarations for Python.

The C headers that firmware includes are the only declaration: cffi parses them here when the package is built, and the
package loads the library with the result (cffi's ABI mode). So one library per platform works with every Python.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cffi

ROOT = Path(__file__).parent
CORE, SIMULATOR = Path("core"), Path("src/oncenter/simulate/native")  # relative to ROOT, where build backends run
CORE_DOORS, SIMULATOR_DOORS = ("monitor.h", "save.h", "message.h", "trouble.h"), ("drive.h",)  # what firmware includes
INCLUDE_DIRS = [str(CORE), str(SIMULATOR)]
COMPILE_ARGS = ["-std=c99", "-O2", "-ffp-contract=off"]
MSVC_ARGS = ["/std:c11", "/O2", "/fp:precise"]

# More inlining gives about a tenth more ticks per second; code size does not matter here. No symbol interposition gives
# a fifth: the library's functions are not replaced at load time. Neither changes a bit of the result. Other compilers
# do both by default.
FASTER_GCC = ["-finline-limit=2000", "-fno-semantic-interposition"]

# Folders of the project's root that are shipped inside the package.
SHIPPED = {
    "core": ("*.[ch]", "params.toml"),
    "dbc": ("*.dbc",),
    "scenarios": ("*",),
    "vehicles": ("*.toml",),
    ".": ("LICENSE",),
}

_PROTOTYPE = re.compile(r"^\w[\w \*]*?\b(\w+)\(", re.MULTILINE)


def _declarations(header: Path, seen: set[Path]) -> str:
    """One header after the project's headers that it includes, without directives."""
    if header in seen:
        return ""
    seen.add(header)
    text = (ROOT / header).read_text(encoding="utf-8")
    names = re.findall(r'^#include "(.+)"', text, re.MULTILINE)
    return "".join(_declarations(_found(name), seen) for name in names) + re.sub(r"^#.*$", "", text, flags=re.MULTILINE)


def _found(name: str) -> Path:
    return next(folder / name for folder in (SIMULATOR, CORE) if (ROOT / folder / name).is_file())


def declared(doors: tuple[str, ...]) -> str:
    """The declarations of these headers and of all that they include, for cffi."""
    seen: set[Path] = set()
    return "".join(_declarations(_found(door), seen) for door in doors)


_ALL = declared(CORE_DOORS + SIMULATOR_DOORS)
FUNCTIONS = _PROTOTYPE.findall(re.sub(r"/\*.*?\*/", "", _ALL, flags=re.DOTALL))  # exported by the library

ffi = cffi.FFI()
ffi.cdef(_ALL)
ffi.set_source("oncenter._declarations", None)


def write_sources(folder: Path) -> list[str]:
    """The C files to compile; generated ones are written to `folder`."""
    core = folder / "liboncenter.c"
    core.write_text("\n".join(_core_in_one()) + "\n", encoding="utf-8")
    return [str(core), *(str(file.relative_to(ROOT)) for file in sorted((ROOT / SIMULATOR).glob("*.c")))]


def sources_read() -> list[str]:
    """All source files of the library: a change in one of them needs a rebuild."""
    files = [file for folder in (CORE, SIMULATOR) for file in sorted((ROOT / folder).glob("*.[ch]"))]
    return [str(file.relative_to(ROOT)) for file in files]


def _core_in_one() -> Iterator[str]:
    """One translation unit for the whole core: gives any compiler the effect of link-time optimisation."""
    yield from (f'#include "{file.name}"' for file in sorted((ROOT / CORE).glob("*.c")))
    yield from (f'#include "{door}"' for door in SIMULATOR_DOORS)  # for the check of its structs
    yield from _layout_checks()


def _layout_checks() -> Iterator[str]:
    """Makes compilation fail if the compiler's struct layout differs from cffi's, which accesses the members."""
    yield "#include <stddef.h>"
    for name in ffi.list_types()[0]:
        kind = ffi.typeof(name)
        if kind.kind in ("struct", "enum"):
            yield _check(f"sizeof({name}) == {ffi.sizeof(kind)}", f"size_of_{name}")
        for member, field in _members(kind):
            yield _check(f"offsetof({name}, {member}) == {field.offset}", f"place_of_{name}_{member}")


def _members(kind: Any) -> list[tuple[str, Any]]:
    return kind.fields if kind.kind == "struct" else []


def _check(condition: str, name: str) -> str:
    """A static assertion for C99: an array of negative size is an error in every compiler."""
    return f"typedef char {name}[({condition}) ? 1 : -1];"
