"""Builds the sdist, and from it a wheel for each platform, with zig as the compiler.

Usage: build.py OUTPUT; needs the packages build, setuptools, cffi and ziglang.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tarfile
import tempfile
from multiprocessing.pool import ThreadPool
from pathlib import Path

from platforms import PLATFORMS, Platform

ROOT = Path(__file__).parents[1]


def sdist(folder: Path) -> Path:
    """Builds the sdist of the project into `folder`."""
    _build(ROOT, folder, "--sdist")
    return next(folder.glob("oncenter-*.tar.gz"))


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
    done = subprocess.run(command, env=os.environ | variables, capture_output=True, text=True, check=False)
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
