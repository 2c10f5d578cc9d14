"""The core's tangent and arcsine against the C library's, and their identical bits on all machines."""

import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from oncenter._native import lib

CORE = Path(__file__).parents[1] / "core"


def units_in_the_last_place(ours: float, theirs: float) -> float:
    return abs(ours - theirs) / float(np.spacing(abs(theirs)))


@pytest.mark.parametrize(
    ("ours", "theirs", "low", "high"),
    [
        (lib.oc_tan, np.tan, -np.pi / 4, np.pi / 4),
        (lib.oc_tan, np.tan, -1.5, 1.5),
        (lib.oc_asin, np.arcsin, -1.0, 1.0),
    ],
)
def test_a_dense_sample_differs_by_few_units_in_the_last_place(ours, theirs, low, high) -> None:  # type: ignore[no-untyped-def]
    arguments = np.concatenate([np.linspace(low, high, 20_001), np.geomspace(1e-300, high, 2_000)])
    worst = max(units_in_the_last_place(ours(x), float(theirs(x))) for x in arguments.tolist() if x)
    assert worst <= 4.0


def test_the_tangent_is_periodic() -> None:
    for x in np.linspace(-100, 100, 20_011).tolist():
        assert lib.oc_tan(x) == pytest.approx(float(np.tan(x)), rel=1e-10)


def test_the_arcsine_inverts_the_sine_and_is_clamped() -> None:
    for x in np.linspace(-1.5, 1.5, 1001).tolist():
        assert lib.oc_asin(math.sin(x)) == pytest.approx(x, abs=1e-14)
    assert lib.oc_asin(1.0) == lib.oc_asin(7.0) == np.pi / 2
    assert lib.oc_asin(-1.0) == lib.oc_asin(-7.0) == -np.pi / 2
    assert (lib.oc_tan(0.0), lib.oc_asin(0.0)) == (0.0, 0.0)


def test_left_and_right_are_the_same_bits() -> None:
    for x in np.random.default_rng(0).uniform(-1, 1, 2000).tolist():
        assert lib.oc_asin(-x) == -lib.oc_asin(x)
        assert lib.oc_tan(-x) == -lib.oc_tan(x)


@pytest.mark.long
def test_the_core_calls_only_functions_with_the_same_bits_on_all_machines(tmp_path: Path) -> None:
    """No heap, no I/O, no clock, and of libm only functions that IEEE 754 defines to the last bit."""
    compiler = shutil.which("cc")
    assert compiler and shutil.which("nm"), "needs a C compiler and binutils"
    objects = []
    for source in sorted(CORE.glob("*/*.c")):
        target = tmp_path / f"{source.stem}.o"
        command = [compiler, "-std=c99", "-O0", "-ffp-contract=off", "-fno-builtin", "-fno-stack-protector"]
        subprocess.run(
            [*command, *(f"-I{folder}" for folder in CORE.glob("*/")), "-c", str(source), "-o", str(target)], check=True
        )
        objects.append(str(target))
    listing = subprocess.run(["nm", *objects], check=True, capture_output=True, text=True).stdout
    symbols = [line.split()[-2:] for line in listing.splitlines() if len(line.split()) > 1]
    defined = {name for kind, name in symbols if kind != "U"}
    outside = {name for kind, name in symbols if kind == "U"} - defined - {"_GLOBAL_OFFSET_TABLE_"}
    assert outside <= {"sqrt", "sqrtf", "fabs", "fabsf", "floor", "memset", "memcpy"}
    assert not [name for kind, name in symbols if kind in "BbCD"], "the core has globals that can be written"
    assert all(name.startswith("oc_") for kind, name in symbols if kind == "T")
