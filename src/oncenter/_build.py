"""Compiles core/*.c into `oncenter._native`; the C headers that firmware includes are the one declaration of it."""

import re
from pathlib import Path

import cffi

CORE = Path("core")  # build backends run in the project's root
DOORS = ("monitor.h", "save.h", "message.h", "trouble.h")  # what firmware includes

# Here code may be long: some tenth more ticks a second by functions that gcc puts where they are called (clang passes
# over it). That changes no bit of what comes out.
FASTER = "-finline-limit=2000"
COMPILE_ARGS = ["-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", FASTER]


def declarations(header: Path, seen: set[Path]) -> str:
    """One header after the core headers it includes, without directives."""
    if header in seen:
        return ""
    seen.add(header)
    text = header.read_text(encoding="utf-8")
    included = re.findall(r'^#include "(.+)"', text, re.MULTILINE)
    before = "".join(declarations(header.parent / name, seen) for name in included)
    return before + re.sub(r"^#.*$", "", text, flags=re.MULTILINE)


ffi = cffi.FFI()
seen: set[Path] = set()
for door in DOORS:
    ffi.cdef(declarations(CORE / door, seen))
ffi.set_source(
    "oncenter._native",
    # One translation unit: the compiler sees from room to room, as with link-time optimisation, with any compiler.
    "".join(f'#include "{file.name}"\n' for file in sorted(CORE.glob("*.c"))),
    depends=sorted(map(str, CORE.glob("*.[ch]"))),
    include_dirs=[str(CORE)],
    extra_compile_args=COMPILE_ARGS,
)

if __name__ == "__main__":
    ffi.compile(tmpdir="src", verbose=True)
