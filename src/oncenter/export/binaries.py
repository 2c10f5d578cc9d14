"""The binaries of an FMU: for all platforms with zig, or for this machine with its own C compiler."""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.export.model_description import COMPILER_OPTIONS, MODEL_IDENTIFIER, Fmi
from oncenter.export.universal import universal

ALL_PLATFORMS = "pip install 'oncenter[fmu]'"  # brings the package ziglang, a C compiler for every platform
_ZIG = (sys.executable, "-m", "ziglang", "cc")


@dataclass(frozen=True)
class Platform:
    """A platform that an FMU has a binary for.

    Attributes:
        fmi2, fmi3: its folder in FMI 2.0 and in FMI 3.0; "" if FMI 2.0 has none.
        suffix: of a shared library there.
        target: the name for `zig cc`, with the oldest C library or system that loads the binary.
    """

    fmi2: str
    fmi3: str
    suffix: str
    target: str = ""

    def folder(self, fmi: Fmi) -> str:
        return self.fmi2 if fmi == 2 else self.fmi3

    def path(self, fmi: Fmi) -> str:
        return f"binaries/{self.folder(fmi)}/{self.library}"

    @property
    def library(self) -> str:
        return f"{MODEL_IDENTIFIER}.{self.suffix}"


_PLATFORMS = (  # the two that share a folder in FMI 2.0 are neighbours
    Platform("win64", "x86_64-windows", "dll", "x86_64-windows-gnu"),
    Platform("linux64", "x86_64-linux", "so", "x86_64-linux-gnu.2.17"),
    Platform("", "aarch64-linux", "so", "aarch64-linux-gnu.2.17"),
    Platform("darwin64", "x86_64-darwin", "dylib", "x86_64-macos.11.0"),
    Platform("darwin64", "aarch64-darwin", "dylib", "aarch64-macos.11.0"),
)


def platforms(fmi: Fmi) -> tuple[Platform, ...]:
    """The platforms that `binaries` compiles for: all if zig is installed, else this machine's."""
    if not has_zig():
        return (this_platform(),)
    return tuple(p for p in _PLATFORMS if p.folder(fmi))


def has_zig() -> bool:
    """Whether the package ziglang is installed."""
    return find_spec("ziglang") is not None


def this_platform() -> Platform:
    """This machine's platform, with the folder names of FMI."""
    system = {"win32": "windows"}.get(sys.platform, sys.platform)
    suffix = {"windows": "dll", "darwin": "dylib"}.get(system, "so")
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    bits = 64 if sys.maxsize > 2**32 else 32
    return Platform(f"{'win' if system == 'windows' else system}{bits}", f"{machine}-{system}", suffix)


def binaries(fmi: Fmi, sources: Mapping[str, bytes], compiled: Sequence[str]) -> dict[str, bytes]:
    """The shared libraries by their paths in the FMU.

    Args:
        fmi: 2 or 3.
        sources: all files by name, headers among them.
        compiled: the files to compile.

    Raises:
        OncenterError: "compiler": there is none, or it reports an error.
    """
    wanted = platforms(fmi)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor() as pool:
        for name, data in sources.items():
            (Path(folder) / name).write_bytes(data)
        libraries = list(pool.map(lambda p: _compile(p, Path(folder), compiled), wanted))
    by_path = groupby(zip(wanted, libraries, strict=True), key=lambda pair: pair[0].path(fmi))
    return {path: _one_file([library for _, library in pairs]) for path, pairs in by_path}


def licences() -> dict[str, bytes]:
    """Licence texts by name, for the C runtimes that zig links into a binary."""
    spec = find_spec("ziglang") if has_zig() else None
    if spec is None or spec.origin is None:
        return {}
    package = Path(spec.origin).parent
    texts = {"zig.txt": package / "LICENSE", "mingw-w64.txt": package / "lib" / "libc" / "mingw" / "COPYING"}
    return {name: text.read_bytes() for name, text in texts.items()}


def _one_file(libraries: Sequence[bytes]) -> bytes:
    return libraries[0] if len(libraries) == 1 else universal(libraries)


def _compile(wanted: Platform, sources: Path, compiled: Sequence[str]) -> bytes:
    """The shared library, in a folder of its own beside the sources."""
    folder = sources / wanted.fmi3
    folder.mkdir()
    compiler = _compiler(wanted)
    given = [str(Path("..") / name) for name in compiled]
    command = [*compiler, *COMPILER_OPTIONS, *_linking(wanted), "-o", wanted.library, *given, *_libraries(wanted)]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        name = "zig" if wanted.target else compiler[0]
        first = next((line for line in run.stderr.splitlines() if "error" in line), "no error message")
        raise OncenterError(
            f"the C compiler '{name}' cannot compile the FMU for {wanted.fmi3}: {first.strip()}",
            code="compiler",
            exit_code=WRONG_USAGE,
        )
    return (folder / wanted.library).read_bytes()


def _compiler(wanted: Platform) -> list[str]:
    """zig for its targets; for this machine $CC, or else the system's cc."""
    if wanted.target:
        return [*_ZIG, "-target", wanted.target, "-s"]
    compiler = shlex.split(os.environ.get("CC", "")) or ["cc"]
    if shutil.which(compiler[0]) is None:
        raise OncenterError(
            f"no C compiler: '{compiler[0]}' is not found; {ALL_PLATFORMS} brings one for all platforms, "
            "or install gcc, or name a compiler in CC",
            code="compiler",
            exit_code=WRONG_USAGE,
        )
    return compiler


def _linking(wanted: Platform) -> list[str]:
    if wanted.suffix == "dll":
        return ["-shared"]
    options = ["-shared", "-fPIC", "-fvisibility=hidden"]
    # The default install name is the path of the compilation.
    return [*options, f"-Wl,-install_name,@rpath/{wanted.library}"] if wanted.suffix == "dylib" else options


def _libraries(wanted: Platform) -> list[str]:
    return ["-lm"] if wanted.suffix == "so" else []
