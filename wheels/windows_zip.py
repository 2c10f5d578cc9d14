"""Builds the zip for Windows: install.cmd, Python, oncenter and every package that `oncenter app` needs, as wheels.

Usage: windows_zip.py OUTPUT [PYTHON]; PYTHON is the file of `PYTHON` below, from python.org. Needs the packages of
requirements.txt. The wheels are those that requirements.lock has the hashes of. The finished zip is read again: each
requirement has its wheel in it, in the version and with a hash of the lock, and each C++ runtime that a library needs.

Python comes along as python.org's embeddable package, which is unpacked and not installed: it needs no administrator,
and it neither finds nor changes another Python. A virtual environment would depend on a Python that another program
updates or removes; the one of Microsoft's store redirects what is written to LOCALAPPDATA.
"""

from __future__ import annotations

import hashlib
import io
import re
import runpy
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from email import message_from_bytes
from pathlib import Path

from packaging.markers import default_environment
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename

ROOT = Path(__file__).parents[1]
PYTHON = "python-3.13.14-embed-amd64.zip"
PYTHON_SHA256 = "90b4e5b9898b72d744650524bff92377c367f44bd5fbd09e3148656c080ad907"
VERSION = "3.13"
LIBRARY = "python313"  # its name in that package
EXTRAS = ("can", "mat", "mf4", "report", "ros")  # the page, and all formats that it takes
RUNTIME = "msvc-runtime"  # the C++ runtime, which a new computer lacks and some of the packages need
TOOLS = ("pip", RUNTIME)
LOCKS = ("requirements.lock", "wheels/requirements.txt")  # the tools are in the second
PATH_LENGTH_MAX = 160  # of an installed file: Windows takes 259 characters, some 90 are those of the user's folder
ENVIRONMENT = {
    "sys_platform": "win32", "platform_system": "Windows", "os_name": "nt", "platform_machine": "AMD64",
    "python_version": VERSION, "python_full_version": f"{VERSION}.0", "implementation_name": "cpython",
    "platform_python_implementation": "CPython",
}  # fmt: skip


def requirements(wheel: Path | zipfile.Path, extras: Iterable[str]) -> list[Requirement]:
    """What a wheel needs on that Windows, with these extras."""
    with zipfile.ZipFile(io.BytesIO(wheel.read_bytes())) as packed:
        (name,) = [each for each in packed.namelist() if re.fullmatch(r"[^/]+\.dist-info/METADATA", each)]
        stated = message_from_bytes(packed.read(name)).get_all("Requires-Dist") or []
    environments = [default_environment() | ENVIRONMENT | {"extra": extra} for extra in ("", *extras)]
    needs = [Requirement(text) for text in stated]
    return [each for each in needs if each.marker is None or any(map(each.marker.evaluate, environments))]


def locked() -> dict[str, tuple[str, set[str]]]:
    """The version and the hashes of each package of the locks."""
    text = "\n".join((ROOT / lock).read_text(encoding="utf-8") for lock in LOCKS)
    entries = re.findall(r"^([\w.-]+)==(\S+)(.*(?:\n +--hash=\S+(?: \\)?)+)", text, re.MULTILINE)
    return {name: (version, set(re.findall(r"sha256:(\w+)", rest))) for name, version, rest in entries}


def download(names: Iterable[str], folder: Path) -> None:
    """The wheels of packages of the lock for that Windows, without what they need."""
    pins = locked()
    if unknown := sorted(set(names) - set(pins)):
        raise SystemExit(f"not in the lock: {', '.join(unknown)}")
    lines = [f"{name}=={pins[name][0]} {' '.join(f'--hash=sha256:{each}' for each in pins[name][1])}" for name in names]
    wanted = folder / "wanted.txt"
    wanted.write_text("\n".join(lines), encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "download", "-q", "--disable-pip-version-check", "--no-deps", "-d", str(folder)]
    pip += ["--platform=win_amd64", f"--python-version={VERSION}", "--only-binary=:all:", "--require-hashes"]
    subprocess.run([*pip, "-r", str(wanted)], check=True)
    wanted.unlink()


def collect(own: Path, folder: Path) -> None:
    """Downloads the tools, and all that our wheel needs: what a wheel needs stands in itself."""
    wanted = {name: set[str]() for name in TOOLS}
    waiting = [(own, set(EXTRAS))]
    seen: set[tuple[str, frozenset[str]]] = set()
    while waiting:
        for each, extras in waiting:
            for need in requirements(each, extras):
                wanted.setdefault(canonicalize_name(need.name), set()).update(need.extras)
        there = by_name(folder)
        download([name for name in wanted if name not in there], folder)
        there = by_name(folder)
        new = {(name, frozenset(extras)) for name, extras in wanted.items()} - seen
        seen |= new
        waiting = [(there[name], set(extras)) for name, extras in new]


def by_name(folder: Path) -> dict[str, Path]:
    return {parse_wheel_filename(each.name)[0]: each for each in folder.glob("*.whl")}


def texts(megabytes: int) -> dict[str, str]:
    """The files of wheels/windows, as Windows ends a line, with the names of this Python."""
    given = {"@PYTHON@": PYTHON, "@LIBRARY@": LIBRARY, "@MEGABYTES@": str(megabytes)}
    files = {}
    for path in (ROOT / "wheels" / "windows").iterdir():
        text = path.read_text(encoding="ascii")
        for mark, value in given.items():
            text = text.replace(mark, value)
        files[path.name] = text.replace("\n", "\r\n")
    return files


def pack(wheels: Sequence[Path], python: Path | None, output: Path, at_s: int) -> None:
    """The same bytes for the same commit, whose time its files bear."""
    files: dict[str, bytes] = {f"wheels/{each.name}": each.read_bytes() for each in wheels}
    if python is not None:
        with zipfile.ZipFile(python) as packed:
            files |= {f"python/{name}": packed.read(name) for name in packed.namelist()}
    files["wheels/requirements.txt"] = "\n".join(sorted(map(_pin, wheels))).encode()
    files["licences.md"] = (ROOT / "docs" / "licences.md").read_bytes()
    megabytes = sum(_unpacked(content) for content in files.values()) // 1_000_000
    files |= {name: text.encode("ascii") for name, text in texts(megabytes).items()}
    stamp = time.gmtime(at_s)[:6]
    with zipfile.ZipFile(output, "w") as packed:
        for name, content in sorted(files.items()):
            entry = zipfile.ZipInfo(f"{output.stem}/{name}", stamp)
            entry.compress_type = zipfile.ZIP_STORED if name.endswith(".whl") else zipfile.ZIP_DEFLATED
            packed.writestr(entry, content)


def _pin(wheel: Path) -> str:
    name, version, *_ = parse_wheel_filename(wheel.name)
    extras = f"[{','.join(EXTRAS)}]" if name == "oncenter" else ""
    return f"{name}{extras}=={version} --hash=sha256:{hashlib.sha256(wheel.read_bytes()).hexdigest()}"


def _unpacked(content: bytes) -> int:
    if not content.startswith(b"PK"):
        return len(content)
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        return sum(each.file_size for each in packed.infolist())


def faults(output: Path, pins: Mapping[str, tuple[str, set[str]]]) -> list[str]:
    """What a zip lacks, or has otherwise than the lock says; a line each."""
    root = zipfile.Path(output) / output.stem
    wheels = {parse_wheel_filename(each.name)[:2]: each for each in (root / "wheels").iterdir() if "whl" in each.name}
    names = {name: (version, each) for (name, version), each in wheels.items()}
    found = []
    waiting = [("oncenter", frozenset(EXTRAS)), *((name, frozenset[str]()) for name in TOOLS)]
    seen = set(waiting)
    while waiting:
        name, extras = waiting.pop()
        if name not in names:
            found.append(f"no wheel of {name}")
            continue
        needs = {
            (canonicalize_name(each.name), frozenset(each.extras)) for each in requirements(names[name][1], extras)
        }
        waiting += needs - seen
        seen |= needs
    needed = {name for name, _ in seen}
    runtimes = {"vcruntime140.dll", "vcruntime140_1.dll", *_files(names[RUNTIME][1])} if RUNTIME in names else set()
    found += [f"nothing needs {name}" for name in names if name not in needed]
    for name, (version, wheel) in names.items():
        content = wheel.read_bytes()
        pinned, hashes = pins.get(name, ("", set()))
        if name != "oncenter" and (str(version) != pinned or hashlib.sha256(content).hexdigest() not in hashes):
            found.append(f"{wheel.name} is not the file of the lock")
        found += [f"{wheel.name}: {fault}" for fault in _file_faults(content, runtimes)]
    return found


def _file_faults(wheel: bytes, runtimes: set[str]) -> list[str]:
    """Microsoft's C++ runtimes are in Python's package, in a wheel of their own, or in the one that needs them."""
    with zipfile.ZipFile(io.BytesIO(wheel)) as packed:
        names = packed.namelist()
        libraries = {name: packed.read(name) for name in names if name.lower().endswith((".dll", ".pyd"))}
    there = runtimes | {name.rpartition("/")[2].lower() for name in names}
    found = [f"a long path: {name}" for name in names if len(name) > PATH_LENGTH_MAX]
    for name, content in libraries.items():
        found += [f"{name} needs {each}" for each in sorted(_runtimes_of(content) - there)]
    return found


def _runtimes_of(library: bytes) -> set[str]:
    import lief

    parsed = lief.PE.parse(library)
    needed = {each.lower() for each in parsed.libraries} if parsed else set()
    return {each for each in needed if re.match("msvcp|vcruntime|concrt|vcomp|libgcc|libstdc", each)}


def _files(wheel: zipfile.Path) -> set[str]:
    with zipfile.ZipFile(io.BytesIO(wheel.read_bytes())) as packed:
        return {name.rpartition("/")[2].lower() for name in packed.namelist()}


def main() -> None:
    output = Path(sys.argv[1])
    python = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    if python is not None and hashlib.sha256(python.read_bytes()).hexdigest() != PYTHON_SHA256:
        raise SystemExit(f"{python} is not {PYTHON} from python.org: its SHA-256 is another")
    output.mkdir(parents=True, exist_ok=True)
    build = runpy.run_path(str(ROOT / "wheels" / "build.py"))
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        platform = next(each for each in build["PLATFORMS"] if each.tag == "win_amd64")
        own = build["wheel"](build["sdist"](folder), platform, folder)
        collect(own, folder)
        made = output / f"oncenter-{parse_wheel_filename(own.name)[1]}-windows.zip"
        pack(sorted(folder.glob("*.whl")), python, made, build["commit_s"]())
    if found := faults(made, locked()):
        raise SystemExit("\n".join(found))
    print(f"{made.name}  {made.stat().st_size / 1e6:.0f} MB, {len(zipfile.ZipFile(made).namelist())} files")
    if python is None:
        print(f"without Python: make zip WINDOWS_PYTHON={PYTHON} adds it")


if __name__ == "__main__":
    main()
