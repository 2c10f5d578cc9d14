"""What the shared library `liboncenter` is made of: the C core and the simulator, and how Python sees them.

The C headers that firmware includes are the one declaration of it: cffi reads them here, when the package is built, and
the package loads the library by what cffi wrote down (its ABI mode). So one library a platform does for every Python.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cffi

ROOT = Path(__file__).parent
CORE, SIMULATOR = Path("core"), Path("src/oncenter/simulate/native")  # within ROOT, where build backends run
CORE_DOORS, SIMULATOR_DOORS = ("monitor.h", "save.h", "message.h", "trouble.h"), ("drive.h",)  # what firmware includes
INCLUDE_DIRS = [str(CORE), str(SIMULATOR)]
COMPILE_ARGS = ["-std=c99", "-O2", "-ffp-contract=off"]
MSVC_ARGS = ["/std:c11", "/O2", "/fp:precise"]

# The core's code may be long here: some tenth more ticks a second by functions that gcc puts where they are called. And
# nobody puts functions of their own in place of ours, for which gcc else gives up a fifth of the speed. Neither changes
# a bit of what comes out; other compilers do so unasked.
FASTER_GCC = ["-finline-limit=2000", "-fno-semantic-interposition"]

# Of the project's root, carried inside the package.
SHIPPED = {
    "core": ("*.[ch]", "params.toml"),
    "dbc": ("*.dbc",),
    "docs/reference": ("findings.md",),
    "scenarios": ("*",),
    "vehicles": ("*.toml",),
    ".": ("LICENSE",),
}

_PROTOTYPE = re.compile(r"^\w[\w \*]*?\b(\w+)\(", re.MULTILINE)


def _declarations(header: Path, seen: set[Path]) -> str:
    """One header after the headers of ours that it includes, without directives."""
    if header in seen:
        return ""
    seen.add(header)
    text = (ROOT / header).read_text(encoding="utf-8")
    names = re.findall(r'^#include "(.+)"', text, re.MULTILINE)
    return "".join(_declarations(_found(name), seen) for name in names) + re.sub(r"^#.*$", "", text, flags=re.MULTILINE)


def _found(name: str) -> Path:
    return next(folder / name for folder in (SIMULATOR, CORE) if (ROOT / folder / name).is_file())


def declared(doors: tuple[str, ...]) -> str:
    """What these headers declare, and all that they include, as cffi takes it."""
    seen: set[Path] = set()
    return "".join(_declarations(_found(door), seen) for door in doors)


_ALL = declared(CORE_DOORS + SIMULATOR_DOORS)
FUNCTIONS = _PROTOTYPE.findall(re.sub(r"/\*.*?\*/", "", _ALL, flags=re.DOTALL))  # what the library exports

ffi = cffi.FFI()
ffi.cdef(_ALL)
ffi.set_source("oncenter._declarations", None)


def write_sources(folder: Path) -> list[str]:
    """The C files to compile; that which is made goes to `folder`."""
    core = folder / "liboncenter.c"
    core.write_text("\n".join(_core_in_one()) + "\n", encoding="utf-8")
    return [str(core), *(str(file.relative_to(ROOT)) for file in sorted((ROOT / SIMULATOR).glob("*.c")))]


def sources_read() -> list[str]:
    """All files that the library is made of, for those who compile again when one has changed."""
    files = [file for folder in (CORE, SIMULATOR) for file in sorted((ROOT / folder).glob("*.[ch]"))]
    return [str(file.relative_to(ROOT)) for file in files]


def _core_in_one() -> Iterator[str]:
    """One translation unit: the compiler sees from room to room, as with link-time optimisation, with any compiler."""
    yield from (f'#include "{file.name}"' for file in sorted((ROOT / CORE).glob("*.c")))
    yield from (f'#include "{door}"' for door in SIMULATOR_DOORS)  # for the check of its structs
    yield from _layout_checks()


def _layout_checks() -> Iterator[str]:
    """No compilation where the compiler lays out a struct otherwise than cffi, which reads and writes its members."""
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
    """C99 has no static assertion: an array of no size is an error everywhere."""
    return f"typedef char {name}[({condition}) ? 1 : -1];"
