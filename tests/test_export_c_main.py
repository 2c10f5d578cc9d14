"""The main program of an exported README: it builds as C and as C++, and keeps its estimates over power-off."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import oncenter as oc
from oncenter import _core, export
from oncenter._native import lib
from oncenter.cli import run
from oncenter.vehicle import Vehicle, core_of, core_params

Array = npt.NDArray[np.float64]

TRUCK_FILE = """
name = "a **// 6x2 /* with play"
wheelbase_m = 3.7
steering_ratio = [0.0, 0.0518, 0.0, -0.00002]
track_width_rear_m = 1.83
axle_layout = "6x2"
traffic_side = "right"
play_deg = 4.0
play_sd_deg = 2.0
offset_limit_deg = 1.5

[params]
wind_sd_m_s2 = 0.03
"""
SIGNALS = [
    "time_s", "steering_wheel_angle_rad", "yaw_rate_rad_s", "vehicle_speed_m_s", "lateral_acceleration_m_s2"
]  # fmt: skip
STRICT = ["-O1", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-Icore", "-Iecu"]


@pytest.fixture(scope="module")
def truck_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("truck") / "truck.toml"
    path.write_text(TRUCK_FILE, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def truck(truck_file: Path) -> Vehicle:
    return oc.vehicle(truck_file)


@pytest.fixture(scope="module")
def folder(truck_file: Path) -> Path:
    """The exported folder, with its sources compiled and the README's program as main.c."""
    folder = truck_file.parent / "c"
    assert run(["export", "c", "--vehicle", str(truck_file), "--output", str(folder)]) == 0
    sources = [str(file.relative_to(folder)) for part in ("core", "ecu") for file in sorted(folder.glob(f"{part}/*.c"))]
    subprocess.run(["gcc", "-std=c99", "-ffp-contract=off", *STRICT, "-c", *sources], cwd=folder, check=True)
    (program,) = re.findall(r"^```c\n(.*?)^```", (folder / "README.md").read_text("utf-8"), re.MULTILINE | re.DOTALL)
    (folder / "main.c").write_text(program, encoding="utf-8")
    shutil.copy(Path(__file__).with_name("own_functions.c"), folder)
    return folder


@pytest.fixture(scope="module", params=["c", "c++"])
def program(request: pytest.FixtureRequest, folder: Path) -> Path:
    """The README's program, compiled as C or as C++."""
    compiler = ["gcc", "-std=c99"] if request.param == "c" else ["g++", "-std=c++11", "-x", "c++"]
    objects = [str(file.relative_to(folder)) for file in folder.glob("*.o")]
    name = "main_" + request.param.replace("+", "p")
    own = ["main.c", "own_functions.c", "-x", "none"]
    subprocess.run([*compiler, *STRICT, *own, *objects, "-lm", "-o", name], cwd=folder, check=True)
    return folder / name


@pytest.fixture(scope="module")
def legs() -> list[Array]:
    """Three ignition cycles of 150 s each, a row a tick; the time of each begins at 0."""
    drive, _ = oc.simulate("country", seed=2)
    rows = drive.table.select(SIGNALS).to_numpy()[: 3 * 15_000]
    cycles = np.split(rows, 3)
    for cycle in cycles:
        cycle[:, 0] -= cycle[0, 0]
    return cycles


def ignition(program: Path, rows: Array, slots: Path) -> list[tuple[float, float]]:
    """From power-up to ignition off: the valid offsets, each with its standard deviation."""
    done = subprocess.run([program], input=rows.tobytes(), capture_output=True, check=True, cwd=slots, timeout=60)
    lines = [line.split() for line in done.stdout.decode().splitlines()]
    return [(float.fromhex(offset), float.fromhex(sd)) for offset, sd in lines]


def never_off(truck: Vehicle, cycles: list[Array]) -> list[tuple[float, float]]:
    """The last cycle's valid offsets by a core that keeps its state in RAM."""
    core = core_of(truck, 100.0)
    outputs = np.zeros(0, _core.OUTPUT_DTYPE)
    for rows in cycles:
        core.restart()
        outputs = np.zeros(len(rows), _core.OUTPUT_DTYPE)
        core.run({name: np.ascontiguousarray(rows[:, k]) for k, name in enumerate(SIGNALS)}, outputs)
    valid = outputs[outputs["offset_status"] == _core.STATUSES.index("valid")]
    return list(zip(valid["offset"].tolist(), valid["offset_sd"].tolist(), strict=True))


def test_the_readmes_program_gives_the_same_bits_after_its_memory_is_lost(
    program: Path, truck: Vehicle, legs: list[Array], tmp_path: Path
) -> None:
    for count in (1, 2, 3):
        assert ignition(program, legs[count - 1], tmp_path) == never_off(truck, legs[:count])
    assert len(never_off(truck, legs)) == 15_000
    assert never_off(truck, legs[2:]) == []  # all of it is from the saved cycles


def test_a_torn_image_is_refused_and_the_one_before_is_restored(
    program: Path, truck: Vehicle, legs: list[Array], tmp_path: Path
) -> None:
    for rows in legs:
        ignition(program, rows, tmp_path)
    newer = tmp_path / "slot_1"
    newer.write_bytes(newer.read_bytes()[:20_000])
    assert ignition(program, legs[2], tmp_path) == never_off(truck, legs) != []


def test_the_header_for_users_has_the_version_for_the_preprocessor(folder: Path) -> None:
    header = (folder / "ecu" / "oncenter.h").read_text(encoding="utf-8")
    number = lib.OC_VERSION_MAJOR * 10000 + lib.OC_VERSION_MINOR * 100 + lib.OC_VERSION_PATCH
    assert f"#define ONCENTER_VERSION {number}\n" in header


def test_the_folder_has_what_its_readme_names(folder: Path) -> None:
    readme = (folder / "README.md").read_text(encoding="utf-8")
    table = re.findall(r"^\| (`.+?) \| ", readme, re.MULTILINE)
    named = [name for cell in table for name in re.findall(r"`([^`]+)`", cell)]
    paths = {name.replace("{h,c}", kind) for name in named for kind in ("h", "c")}
    assert len(paths) > 10
    assert [path for path in paths if not (folder / path).exists()] == []
    assert "a **// 6x2 /* with play" in readme and "@" not in readme and "<!--" not in readme


def test_the_trucks_values_stand_in_the_program(folder: Path, truck: Vehicle) -> None:
    source = (folder / "ecu" / "oncenter_vehicle.c").read_text(encoding="utf-8")
    given = dict(re.findall(r"^    \w+->([\w.\[\]]+) = ([-\w.+]+);", source, re.MULTILINE))
    params = {name: value for name, value in core_params(truck.params).items() if name in given}
    assert {name: float(given[name]) for name in params} == params
    assert {"tandem_side_force_m2_s2", "known_play_rad", "known_play_sd_rad", "wind_sd_m_s2"} == set(params)
    assert (float(given["wheelbase"]), float(given["traffic_side"]), given["ratio.terms"]) == (3.7, 1.0, "4")


def test_a_folder_without_a_truck_is_the_program_of_a_calibrated_one(tmp_path: Path) -> None:
    folder = export.write_c(tmp_path / "c")
    assert "This folder has no truck" in (folder / "README.md").read_text(encoding="utf-8")
    source = (folder / "ecu" / "oncenter_vehicle.c").read_text(encoding="utf-8")
    assert "->" not in source


def test_the_offset_alone_is_the_same_to_the_last_bit(
    folder: Path, truck: Vehicle, legs: list[Array], tmp_path: Path
) -> None:
    source = (folder / "offset_only" / "offset_only.c").read_text(encoding="utf-8")
    replaced = re.findall(r"\w+\.c\b", source[: source.index("*/")])
    kept = [str(file) for file in folder.glob("*.o") if file.with_suffix(".c").name not in replaced]
    built = ["gcc", "-std=c99", "-ffp-contract=off", *STRICT, "offset_only/offset_only.c", "main.c", "own_functions.c"]
    subprocess.run([*built, *kept, "-lm", "-o", tmp_path / "main"], cwd=folder, check=True)
    for count in (1, 2, 3):
        assert ignition(tmp_path / "main", legs[count - 1], tmp_path) == never_off(truck, legs[:count])
    assert len(never_off(truck, legs)) == 15_000
