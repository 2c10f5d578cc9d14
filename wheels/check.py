"""Checks the wheels: contents, exported and needed symbols, and results where they can run on this machine. A second
build must give the same bytes.

Usage: check.py FOLDER, from build.py. Needs build, lief and ziglang; on Debian the packages qemu-user, wine, wine64,
musl and mmdebstrap (`make wheels` installs all). Wheels for macOS and for Windows on ARM cannot run here: only their
contents and symbols are checked.
"""

from __future__ import annotations

import json
import os
import runpy
import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile
from multiprocessing.pool import ThreadPool
from pathlib import Path

import lief
from platforms import PLATFORMS, Platform

ROOT = Path(__file__).parents[1]
FUNCTIONS = runpy.run_path(str(ROOT / "liboncenter.py"))["FUNCTIONS"]
CONTENTS = set((ROOT / "CONTENTS").read_text(encoding="utf-8").split())
BESIDE = {  # in the folder .dist-info
    "METADATA", "RECORD", "WHEEL", "entry_points.txt", "top_level.txt", "sboms/oncenter.cdx.json",
    "licenses/LICENSE", "licenses/src/oncenter/export/fmi/LICENSE.txt",
    "licenses/wheels/licences/mingw-w64.txt", "licenses/wheels/licences/zig.txt",
}  # fmt: skip
MACHINE_LIBRARIES = {  # allowed dependencies of a library: present on every such machine
    "manylinux": {"libc.so.6", "libm.so.6", "ld-linux-aarch64.so.1"},
    "musllinux": {"libc.so"},
    "macosx": {"/usr/lib/libSystem.B.dylib", "@rpath/liboncenter.dylib"},
    "win": {"KERNEL32.dll", "ntdll.dll"},
}
C_LIBRARY_OF_WINDOWS = "api-ms-win-crt-"
OLDEST_GLIBC = (2, 17)  # of manylinux2014
EMULATED = {  # emulator for each platform that can run here; empty: natively
    "manylinux2014_x86_64": [],
    "manylinux2014_aarch64": ["qemu-aarch64"],
    "musllinux_1_1_x86_64": [],
    "musllinux_1_1_aarch64": ["qemu-aarch64"],
    "win_amd64": ["wine"],
}
SCENARIO, SEED = "thesis_drive", "1"
CLOSE_ENOUGH = 1e-9  # difference of a value in the answer, by another machine's numpy


def main() -> None:
    lief.logging.disable()
    folder = Path(sys.argv[1]).resolve()
    archive = next(folder.glob("oncenter-*.tar.gz"))
    check_sdist(archive)
    check_second_build(folder, archive)
    with tempfile.TemporaryDirectory() as place:
        work = Path(place)
        reference = native_answer(work, next(folder.glob("*-manylinux2014_x86_64.whl")))
        arm64_root(work / "arm64")
        for platform in PLATFORMS:
            wheel = next(folder.glob(f"oncenter-*-{platform.tag}.whl"))
            library = check_contents(wheel, platform, work / platform.tag)
            check_library(library, platform)
            checked = "contents, symbols"
            if platform.tag in EMULATED:
                run_vectors(library, platform, work)
                checked += ", test vectors bit for bit"
            if platform.tag == "manylinux2014_aarch64":
                difference = emulated_answer(work, wheel, reference)
                checked += f", offset JSON within {difference:.1g}"
            print(f"{platform.tag:22} {checked}", flush=True)


def check_sdist(archive: Path) -> None:
    """Checks that it has every file in git."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )
    with tarfile.open(archive) as packed:
        there = {name.partition("/")[2] for name in packed.getnames()}
    if lacking := sorted(set(listed) - there - {"", ".gitignore"}):
        raise SystemExit(f"{archive.name} lacks {', '.join(lacking)}")
    print(f"{archive.name}: all {len(listed)} files of the project")


def check_second_build(folder: Path, archive: Path) -> None:
    """Builds all once more, later, in other folders and with nothing that zig has kept."""
    build = runpy.run_path(str(ROOT / "wheels" / "build.py"))
    with tempfile.TemporaryDirectory() as place, ThreadPool(os.cpu_count()) as pool:
        os.environ["ZIG_GLOBAL_CACHE_DIR"] = f"{place}/zig"
        again = build["sdist"](Path(place))
        wheels = pool.map(lambda platform: build["wheel"](again, platform, Path(place)), PLATFORMS)
        if other := [each.name for each in (again, *wheels) if each.read_bytes() != (folder / each.name).read_bytes()]:
            raise SystemExit(f"a second build differs: {', '.join(other)}")
        del os.environ["ZIG_GLOBAL_CACHE_DIR"]
    print(f"{archive.name} and {len(wheels)} wheels: a second build has the same bytes", flush=True)


def check_contents(wheel: Path, platform: Platform, place: Path) -> Path:
    """Unpacks to `place` and checks the list of files; returns the library."""
    with zipfile.ZipFile(wheel) as packed:
        there = {name.partition(".dist-info/")[2] or name for name in packed.namelist()}
        packed.extractall(place)
    expected = CONTENTS | {f"oncenter/{platform.library}"} | BESIDE
    if wrong := sorted(there ^ expected):
        raise SystemExit(f"{wheel.name}: missing or unexpected files: {', '.join(wrong)}")
    return place / "oncenter" / platform.library


def check_library(library: Path, platform: Platform) -> None:
    binary = lief.parse(library)
    exported = {str(getattr(symbol, "name", symbol)).removeprefix("_") for symbol in binary.exported_functions}
    if lacking := sorted(set(FUNCTIONS) - exported):
        raise SystemExit(f"{library.parent.parent.name}: the library does not export {', '.join(lacking)}")
    known = next(names for kind, names in MACHINE_LIBRARIES.items() if platform.tag.startswith(kind))
    needed = [str(getattr(each, "name", each)) for each in binary.libraries]
    if strange := [name for name in needed if name not in known and not name.startswith(C_LIBRARY_OF_WINDOWS)]:
        raise SystemExit(f"{platform.tag}: the library needs {', '.join(strange)}")
    if platform.tag.startswith("manylinux") and (newer := [v for v in _glibc_versions(binary) if v > OLDEST_GLIBC]):
        raise SystemExit(f"{platform.tag}: the library needs glibc {newer}")
    if platform.tag == "macosx_11_0_arm64" and not binary.has_code_signature:
        raise SystemExit(f"{platform.tag}: the library is not signed, which Apple processors require")


def _glibc_versions(binary: lief.ELF.Binary) -> list[tuple[int, ...]]:
    names = [
        auxiliary.name
        for version in binary.symbols_version_requirement
        for auxiliary in version.get_auxiliary_symbols()
    ]
    return [tuple(map(int, name.removeprefix("GLIBC_").split("."))) for name in names if name.startswith("GLIBC_")]


def native_answer(work: Path, wheel: Path) -> bytes:
    """The answer of the wheel in an empty environment, checked against this checkout; also writes test vectors."""
    python = work / "native" / "bin" / "python"
    venv.create(work / "native", with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", wheel], check=True)
    command = [python, "-m", "oncenter"]
    subprocess.run(
        [*command, "simulate", SCENARIO, "--seed", SEED, "--output", work / "drive.log"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    subprocess.run([*command, "export", "c", "--output", work / "c"], check=True, stdout=subprocess.DEVNULL)
    given = _offset(command, work / "drive.log")
    own = _offset([ROOT / ".venv" / "bin" / "python", "-m", "oncenter"], work / "drive.log")
    if given != own:
        raise SystemExit("the wheel's answer differs from the checkout's")
    print(f"{wheel.name}: installed, its offset JSON equals the checkout's, byte for byte")
    return given


def _offset(command: list[str | Path], log: Path, **variables: str) -> bytes:
    command = [*command, "offset", log, "--vehicle", "scania_r730_4x2", "--json"]
    return subprocess.run(command, check=True, capture_output=True, env=os.environ | variables).stdout


def run_vectors(library: Path, platform: Platform, work: Path) -> None:
    """Runs the test vectors of the firmware folder with the wheel's library in place of its core."""
    place = library.parent
    program = place / ("vectors.exe" if platform.library.endswith(".dll") else "vectors")
    compiler = [
        sys.executable,
        "-m",
        "ziglang",
        "cc",
        "-target",
        platform.target,
        "-std=c99",
        "-O2",
        f"-I{work / 'c' / 'core'}",
    ]
    link = [] if platform.library.endswith(".dll") else ["-Wl,-rpath,$ORIGIN"]
    dynamic = ["-dynamic"] if "musl" in platform.target else []
    source = work / "c" / "test" / "test_vectors.c"
    subprocess.run([*compiler, *dynamic, source, library, *link, "-o", program], check=True)
    emulators = {"QEMU_LD_PREFIX": str(work / "arm64"), "WINEPREFIX": str(work / "wine"), "WINEDEBUG": "-all"}
    done = subprocess.run(
        [*EMULATED[platform.tag], program], env=os.environ | emulators, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{platform.tag}: {done.stdout[:500]}{done.stderr[-500:]}")


def arm64_root(folder: Path) -> None:
    """Debian's Python and musl for ARM64, unpacked without setup, which is enough for qemu-user."""
    command = [
        "mmdebstrap",
        "--quiet",
        "--variant=extract",
        "--arch=arm64",
        "--include=python3.11,libstdc++6,musl",
        "bookworm",
        folder,
    ]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)


def emulated_answer(work: Path, wheel: Path, reference: bytes) -> float:
    """The maximum difference between the reference and the wheel's answer on an emulated ARM64."""
    site = work / "site"
    platforms = [f"--platform=manylinux{kind}_aarch64" for kind in ("2014", "_2_17", "_2_24", "_2_28")]
    pip = [sys.executable, "-m", "pip", "install", "-q", "--disable-pip-version-check", "--target", site, *platforms]
    subprocess.run([*pip, "--python-version=3.11", "--only-binary=:all:", wheel], check=True)
    python = ["qemu-aarch64", work / "arm64" / "usr" / "bin" / "python3.11", "-m", "oncenter"]
    given = _offset(python, work / "drive.log", QEMU_LD_PREFIX=str(work / "arm64"), PYTHONPATH=str(site))
    return _greatest_difference(json.loads(given), json.loads(reference))


def _greatest_difference(one: object, other: object) -> float:
    """Maximum difference between the numbers of two answers, which must agree in everything else."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        return max((_greatest_difference(one[key], other[key]) for key in one), default=0.0)
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return max((_greatest_difference(a, b) for a, b in zip(one, other, strict=True)), default=0.0)
    if isinstance(one, float) and isinstance(other, float) and abs(one - other) <= CLOSE_ENOUGH:
        return abs(one - other)
    if one != other:
        raise SystemExit(f"the emulated machine's answer has {one!r} for {other!r}")
    return 0.0


if __name__ == "__main__":
    main()
