"""Builds the sdist, and from it a wheel for each platform, with zig as the compiler.

Usage: build.py OUTPUT; needs the packages of requirements.txt. A commit gives the same bytes on any day and in any
folder: all files bear the time of the commit, and no archive an owner or a mode of this machine.
"""

from __future__ import annotations

import gzip
import io
import os
import shlex
import subprocess
import sys
import tarfile
import tempfile
from functools import cache
from multiprocessing.pool import ThreadPool
from pathlib import Path

from platforms import PLATFORMS, Platform

ROOT = Path(__file__).parents[1]


def sdist(folder: Path) -> Path:
    """Builds the sdist of the project into `folder`."""
    _build(ROOT, folder, "--sdist")
    archive = next(folder.glob("oncenter-*.tar.gz"))
    archive.write_bytes(_without_traces(archive.read_bytes()))
    return archive


def _without_traces(archive: bytes) -> bytes:
    """The same files in order, without times and owners of this machine."""
    content = io.BytesIO()
    with (
        tarfile.open(fileobj=io.BytesIO(archive)) as given,
        gzip.GzipFile(filename="", fileobj=content, mode="wb", mtime=commit_s()) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as clean,
    ):
        for member in sorted(given.getmembers(), key=lambda each: each.name):
            entry = tarfile.TarInfo(member.name)
            entry.type, entry.size, entry.linkname, entry.mtime = member.type, member.size, member.linkname, commit_s()
            entry.mode = 0o755 if member.isdir() or member.mode & 0o100 else 0o644
            clean.addfile(entry, given.extractfile(member) if member.isfile() else None)
    return content.getvalue()


@cache
def commit_s() -> int:
    """The time of the commit, or SOURCE_DATE_EPOCH where there is no git."""
    given = os.environ.get("SOURCE_DATE_EPOCH")
    command = ["git", "log", "-1", "--format=%ct"]
    return int(given or subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout)


def wheel(archive: Path, platform: Platform, folder: Path) -> Path:
    """Builds the wheel for one platform from the sdist into `folder`, without files of other platforms."""
    with tempfile.TemporaryDirectory() as place, tarfile.open(archive) as packed:
        packed.extractall(place, filter="data")
        _build_wheel(next(Path(place).iterdir()), platform, folder)
    return next(folder.glob(f"oncenter-*-{platform.tag}.whl"))


def _build_wheel(source: Path, platform: Platform, folder: Path) -> None:
    compiler = [sys.executable, "-m", "ziglang", "cc", "-target", platform.target]
    _build(source, folder, "--wheel", ONCENTER_PLATFORM=platform.tag, ONCENTER_CC=shlex.join(compiler))


def _build(source: Path, folder: Path, kind: str, **variables: str) -> None:
    command = [
        sys.executable,
        "-m",
        "build",
        kind,
        "--no-isolation",
        "--skip-dependency-check",
        "-o",
        str(folder),
        str(source),
    ]
    environment = os.environ | {"SOURCE_DATE_EPOCH": str(commit_s())} | variables
    done = subprocess.run(command, env=environment, umask=0o022, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(done.stdout + done.stderr)


def main() -> None:
    output = Path(sys.argv[1])
    output.mkdir(parents=True, exist_ok=True)
    archive = sdist(output)
    print(f"{archive.name}  {archive.stat().st_size / 1e6:.1f} MB", flush=True)
    with ThreadPool(os.cpu_count()) as pool:
        for made in pool.imap(lambda platform: wheel(archive, platform, output), PLATFORMS):
            print(f"{made.name}  {made.stat().st_size / 1e6:.1f} MB", flush=True)


if __name__ == "__main__":
    main()
