"""The parts of the build that pyproject.toml cannot describe: version in a C header, shared library, more files."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import sysconfig
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any

from setuptools import Extension, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build import build
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py
from setuptools.errors import CompileError, PlatformError

ROOT = Path(__file__).parent
sys.path.insert(0, str(ROOT))

import liboncenter  # noqa: E402

# A wheel's platform tag, and the command of a cross compiler (wheels/build.py).
PLATFORM = os.environ.get("ONCENTER_PLATFORM", sysconfig.get_platform()).replace("-", "_").replace(".", "_")
OTHER_COMPILER = shlex.split(os.environ.get("ONCENTER_CC", ""))

MINGW = "MinGW-w64 runtime of zig"
LINKED = {"compiler runtime of zig": {"id": "MIT"}, MINGW: {"id": "ZPL-2.1"}}

NO_COMPILER = (
    "oncenter's core is written in C, and the C compiler failed (see its message above). Install one: on Debian "
    "`apt-get install gcc libc6-dev`, on macOS `xcode-select --install`, on Windows the Visual Studio Build Tools; "
    "or take a wheel, which needs none: `pip install --only-binary oncenter oncenter`"
)


def version() -> str:
    text = (ROOT / "core" / "monitor" / "monitor.h").read_text(encoding="utf-8")
    return ".".join(re.findall(r"\bOC_VERSION_(?:MAJOR|MINOR|PATCH) = (\d+)", text))


def parts_inside() -> dict[str, Any]:
    """zig links its runtime into a library, and for Windows that of MinGW-w64."""
    parts: dict[str, Any] = json.loads((ROOT / "wheels" / "inside.cdx.json").read_text(encoding="utf-8"))
    parts["metadata"]["component"]["version"] = version()
    for name, licence in LINKED.items() if OTHER_COMPILER else ():
        if name != MINGW or PLATFORM.startswith("win"):
            linked = {"type": "library", "bom-ref": name, "name": name, "version": version_of("ziglang")}
            parts["components"].append({**linked, "licenses": [{"license": licence}]})
            parts["dependencies"][0]["dependsOn"].append(name)
    return parts


class BuildPackage(build_py):
    """Adds the folders of the root that are shipped inside the package."""

    def run(self) -> None:
        super().run()
        for source, target in {} if self.editable_mode else self._shipped():
            self.mkpath(os.path.dirname(target))
            self.copy_file(source, target)

    def _shipped(self) -> list[tuple[str, str]]:
        inside = Path(self.build_lib) / "oncenter"
        files = [
            file
            for folder, kinds in liboncenter.SHIPPED.items()
            for kind in kinds
            for file in (ROOT / folder).glob(kind)
        ]
        return [(str(file), str(inside / file.relative_to(ROOT))) for file in sorted(files)]

    def get_outputs(self, include_bytecode: bool = True) -> list[str]:
        shipped = [] if self.editable_mode else [target for _, target in self._shipped()]
        return super().get_outputs(include_bytecode) + shipped


class BuildLibrary(build_ext):
    """A plain shared library and cffi's description of it, instead of an extension module for one Python."""

    def run(self) -> None:
        super().run()
        package = Path(self.get_ext_fullpath("oncenter.liboncenter")).parent
        liboncenter.ffi.emit_python_code(str(package / "_declarations.py"))

    def get_ext_filename(self, fullname: str) -> str:
        suffix = ".dll" if PLATFORM.startswith("win") else ".dylib" if PLATFORM.startswith("macosx") else ".so"
        return os.path.join(*fullname.split(".")) + suffix

    def get_export_symbols(self, ext: Extension) -> list[str]:
        return liboncenter.FUNCTIONS  # no PyInit

    def build_extension(self, ext: Extension) -> None:
        folder = Path(self.build_temp)
        folder.mkdir(parents=True, exist_ok=True)
        ext.sources = liboncenter.write_sources(folder)
        if OTHER_COMPILER:
            compile_with = [] if PLATFORM.startswith("win") else ["-fPIC"]
            link_with = ["-shared", "-s", *self._link_arguments()]
            self.compiler.set_executables(
                compiler_so=OTHER_COMPILER + compile_with, linker_so=OTHER_COMPILER + link_with
            )
        try:
            ext.extra_compile_args = self._arguments()
            super().build_extension(ext)
        except (CompileError, PlatformError, OSError) as error:
            raise SystemExit(NO_COMPILER) from error

    def _arguments(self) -> list[str]:
        if self.compiler.compiler_type == "msvc":
            return liboncenter.MSVC_ARGS
        command = [*self.compiler.compiler_so, "--version"]
        compiler = subprocess.run(command, capture_output=True, text=True, check=False).stdout
        # the sanitizers' checks make the code large: inlined more, gcc takes five times as long, and no test is faster
        has_checks = any(word.startswith("-fsanitize") for word in command)
        faster = [] if "clang" in compiler or has_checks else liboncenter.FASTER_GCC
        # debug information, which Python's own options ask for, without the name of this folder
        return [*liboncenter.COMPILE_ARGS, *faster, f"-fdebug-prefix-map={os.getcwd()}=."]

    def _link_arguments(self) -> list[str]:
        """Windows' unused import library goes to the build folder; Apple's library gets a name without a path."""
        if PLATFORM.startswith("win"):
            return [f"-Wl,--out-implib,{Path(self.build_temp) / 'liboncenter.lib'}"]
        return ["-Wl,-install_name,@rpath/liboncenter.dylib"] if PLATFORM.startswith("macosx") else []

    def get_outputs(self) -> list[str]:
        library = super().get_outputs()
        return [*library, *(os.path.join(os.path.dirname(each), "_declarations.py") for each in library)]


class Build(build):
    """Fails if the files of the package differ from CONTENTS, and names them."""

    def run(self) -> None:
        super().run()
        if self.get_finalized_command("build_py").editable_mode:
            return
        package = Path(self.build_lib)
        built = {file.relative_to(package).as_posix() for file in package.rglob("*") if file.is_file()}
        built -= {f"oncenter/{file}" for file in ("liboncenter.so", "liboncenter.dylib", "liboncenter.dll")}
        listed = set((ROOT / "CONTENTS").read_text(encoding="utf-8").split())
        wrong = [f"lacks {file}" for file in sorted(listed - built)]
        wrong += [f"has {file} that CONTENTS lacks" for file in sorted(built - listed) if "__pycache__" not in file]
        if wrong:
            raise SystemExit("the package " + "; ".join(wrong))


class Wheel(bdist_wheel):
    """For any Python 3 of one platform, with a bill of the parts inside, where PEP 770 looks for it."""

    def finalize_options(self) -> None:
        super().finalize_options()
        self.root_is_pure = False

    def get_tag(self) -> tuple[str, str, str]:
        return "py3", "none", PLATFORM

    def write_wheelfile(self, folder: str, *given: str) -> None:
        super().write_wheelfile(folder, *given)
        place = Path(folder) / "sboms"
        place.mkdir()
        (place / "oncenter.cdx.json").write_text(json.dumps(parts_inside(), indent=1) + "\n", encoding="utf-8")


setup(
    version=version(),
    ext_modules=[
        Extension(
            "oncenter.liboncenter",
            sources=[],
            depends=liboncenter.sources_read(),
            include_dirs=liboncenter.INCLUDE_DIRS,
        )
    ],
    cmdclass={
        "build": Build,
        "build_py": BuildPackage,
        "build_ext": BuildLibrary,
        "bdist_wheel": Wheel,
    },
)
