"""The shared library `liboncenter`: the C core, the simulator, the filter over drives, and their declarations.

The C headers that firmware includes are the only declarations: cffi reads them here, when the package is built. The
package loads the library with the declarations that cffi wrote (ABI mode), so one library per platform serves every
Python.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cffi

ROOT = Path(__file__).parent
CORE = Path("core")  # within ROOT, where build backends run
BESIDE_CORE = (Path("src/oncenter/simulate/native"), Path("src/oncenter/truck/native"))  # not for the truck
CORE_HEADERS = ("monitor.h", "save.h", "message.h", "trouble.h")  # firmware includes these
HEADERS_BESIDE = ("drive.h", "truck_filter.h")
FOLDERS = [*sorted(folder.relative_to(ROOT) for folder in (ROOT / CORE).glob("*/")), *BESIDE_CORE]
INCLUDE_DIRS = list(map(str, FOLDERS))
COMPILE_ARGS = ["-std=c99", "-O2", "-ffp-contract=off"]
MSVC_ARGS = ["/std:c11", "/O2", "/fp:precise"]

# Code size does not matter here: more inlining gives a fifth more ticks a second. No program replaces the library's
# functions by its own (semantic interposition), a possibility that costs gcc a fifth of the speed. No option changes a
# bit of the results; other compilers do both by default.
FASTER_GCC = ["-finline-limit=2000", "--param=large-function-growth=1000", "--param=inline-unit-growth=1000"]
FASTER_GCC += ["-fno-semantic-interposition"]

# Of the project's root, carried inside the package.
SHIPPED = {
    "core": ("*/*.[ch]", "*.toml"),
    "dbc": ("*.dbc",),
    "docs": ("method.md",),
    "docs/reference": ("findings.md",),
    "embedded": ("misra.md",),
    "examples": ("integration.c",),
    "scenarios": ("*",),
    "vehicles": ("*.toml",),
    ".": ("LICENSE",),
}

_PROTOTYPE = re.compile(r"^\w[\w \*]*?\b(\w+)\(", re.MULTILINE)


def _declarations(header: Path, seen: set[Path]) -> str:
    """The included headers of oncenter, then this one, without directives."""
    if header in seen:
        return ""
    seen.add(header)
    text = (ROOT / header).read_text(encoding="utf-8")
    names = re.findall(r'^#include "(.+)"', text, re.MULTILINE)
    return "".join(_declarations(_found(name), seen) for name in names) + re.sub(r"^#.*$", "", text, flags=re.MULTILINE)


def _found(name: str) -> Path:
    return next(folder / name for folder in FOLDERS if (ROOT / folder / name).is_file())


def declared(headers: tuple[str, ...]) -> str:
    """The declarations of these headers and of all that they include, in the form for cffi."""
    seen: set[Path] = set()
    return "".join(_declarations(_found(header), seen) for header in headers)


_ALL = declared(CORE_HEADERS + HEADERS_BESIDE)
FUNCTIONS = _PROTOTYPE.findall(re.sub(r"/\*.*?\*/", "", _ALL, flags=re.DOTALL))  # the exports of the library

ffi = cffi.FFI()
ffi.cdef(_ALL)
ffi.set_source("oncenter._declarations", None)


def write_sources(folder: Path) -> list[str]:
    """The C files to compile; the generated one is written to `folder`."""
    core = folder / "liboncenter.c"
    core.write_text("\n".join(_core_in_one()) + "\n", encoding="utf-8")
    beside = (file for folder in BESIDE_CORE for file in sorted((ROOT / folder).glob("*.c")))
    return [str(core), *(str(file.relative_to(ROOT)) for file in beside)]


def sources_read() -> list[str]:
    """All source files of the library; it is compiled again when one has changed."""
    files = [file for folder in FOLDERS for file in sorted((ROOT / folder).glob("*.[ch]"))]
    return [str(file.relative_to(ROOT)) for file in files]


def _core_in_one() -> Iterator[str]:
    """One translation unit, so that any compiler can inline across files, as with link-time optimisation."""
    yield from (f'#include "{file.name}"' for file in sorted((ROOT / CORE).glob("*/*.c")))
    yield from (f'#include "{header}"' for header in HEADERS_BESIDE)  # for the check of its structs
    yield from _layout_checks()


def _layout_checks() -> Iterator[str]:
    """Stops the compilation if the compiler's layout of a struct differs from cffi's, which accesses its members."""
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
