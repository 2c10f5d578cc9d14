"""The FMU's binaries for other platforms: their contents, and the same bits as `oncenter offset`."""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import fmpy
import polars as pl
import pytest
from fmpy.validation import validate_fmu
from shared_libraries import libraries_in
from test_export_fmu import LEFT_HAND

import oncenter as oc
from oncenter import _core, export
from oncenter.cli import run
from oncenter.export.universal import universal
from oncenter.signals import Signals

pytest.importorskip("ziglang", reason="zig compiles for other platforms: make fmu, or pip install 'oncenter[fmu]'")

FMI = Path(__file__).parents[1] / "src" / "oncenter" / "export" / "fmi"
MAC = struct.pack("<8I", 0xFEEDFACF, 0x01000007, 3, 6, 0, 0, 0, 0)  # the header of an empty library
FOLDERS = {
    2: {"win64": ".dll", "linux64": ".so", "darwin64": ".dylib"},
    3: {
        "x86_64-windows": ".dll",
        "x86_64-linux": ".so",
        "aarch64-linux": ".so",
        "x86_64-darwin": ".dylib",
        "aarch64-darwin": ".dylib",
    },
}
OUTPUTS = (
    "offset offset_sd offset_drive_sd understeer_gradient backlash unloading_acceleration yaw_rate_bias used_time "
    "tick_time motion.curvature motion.residual angle angle_sd angle_estimate play_place"
).split()


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("fmu")
    return {fmi: export.write_fmu(LEFT_HAND, folder / f"truck{fmi}.fmu", fmi=fmi) for fmi in (2, 3)}


@pytest.fixture(scope="module")
def unzipped(written: dict[int, Path]) -> dict[int, Path]:
    folders = {fmi: path.with_suffix("") for fmi, path in written.items()}
    for fmi, path in written.items():
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folders[fmi])
    return folders


def binary(folder: Path, platform: str) -> Path:
    (found,) = (folder / "binaries" / platform).iterdir()
    return found


EACH = [(fmi, platform) for fmi, folders in FOLDERS.items() for platform in folders]


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_has_a_binary_for_windows_linux_and_macos_at_the_paths_of_the_standard(
    fmi: int, written: dict[int, Path], unzipped: dict[int, Path]
) -> None:
    found = {path.parent.name: path.name for path in (unzipped[fmi] / "binaries").glob("*/*")}
    assert found == {folder: f"oncenter{suffix}" for folder, suffix in FOLDERS[fmi].items()}
    assert validate_fmu(str(written[fmi])) == []


def test_an_fmu_has_the_licences_of_the_runtimes_that_zig_links(unzipped: dict[int, Path]) -> None:
    texts = unzipped[2] / "documentation" / "licenses"
    assert "Zope Public License" in (texts / "mingw-w64.txt").read_text(encoding="utf-8")
    assert "Zig contributors" in (texts / "zig.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize(("fmi", "platform"), EACH)
def test_a_binary_exports_each_function_of_the_standard_and_nothing_else(
    fmi: int, platform: str, unzipped: dict[int, Path]
) -> None:
    header = (FMI / f"fmi{fmi}Functions.h").read_text(encoding="utf-8")
    before, _, rest = header.rpartition("Functions for FMI2 for Model Exchange")  # the FMU is for co-simulation only
    _, _, after = rest.rpartition("Functions for FMI2 for Co-Simulation")
    given = set(re.findall(rf"FMI{fmi}_Export \w+ +(\w+);", before + after))
    libraries = libraries_in(binary(unzipped[fmi], platform).read_bytes())
    marks = {"__dso_handle", "_mh_dylib_header"} if "darwin" in platform else set()  # zig adds them to each
    assert [library.exports ^ given for library in libraries] == [marks] * len(libraries)


@pytest.mark.parametrize(("fmi", "platform"), EACH)
def test_a_binary_needs_only_libraries_of_its_system(fmi: int, platform: str, unzipped: dict[int, Path]) -> None:
    data = binary(unzipped[fmi], platform).read_bytes()
    for library in libraries_in(data):
        if ".dll" in FOLDERS[fmi][platform]:
            assert all(re.fullmatch(r"KERNEL32\.dll|api-ms-win-crt-\w+-l1-1-0\.dll", name) for name in library.needs)
        elif ".so" in FOLDERS[fmi][platform]:
            assert library.needs <= {"libc.so.6", "libm.so.6"}
            assert max(int(minor) for minor in re.findall(rb"GLIBC_2\.(\d+)", data)) <= 17
        else:
            assert library.needs == {"/usr/lib/libSystem.B.dylib"}


def test_the_mac_binary_of_fmi_2_is_for_both_processors_and_runs_from_macos_11_on(unzipped: dict[int, Path]) -> None:
    libraries = libraries_in(binary(unzipped[2], "darwin64").read_bytes())
    assert [library.machine for library in libraries] == ["x86_64", "aarch64"]
    for library in libraries:
        assert struct.unpack_from("<I", library.facts[0x32], 12) == (11 << 16,)  # LC_BUILD_VERSION
        assert b"@rpath/oncenter.dylib" in library.facts[0x0D]  # LC_ID_DYLIB
    assert 0x1D in libraries[1].facts  # LC_CODE_SIGNATURE: macOS loads no other on its own processor


def test_only_mac_binaries_are_made_universal(unzipped: dict[int, Path]) -> None:
    with pytest.raises(ValueError, match="Mach-O"):
        universal([binary(unzipped[2], "linux64").read_bytes()] * 2)


def test_the_same_vehicle_gives_the_same_fmu_to_the_byte(written: dict[int, Path], tmp_path: Path) -> None:
    again = export.write_fmu(LEFT_HAND, tmp_path / "again.fmu", fmi=2)
    assert again.read_bytes() == written[2].read_bytes()


def test_the_command_names_the_platforms(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("oncenter.export.binaries._compile", lambda platform, sources, compiled: MAC)
    assert run(["export", "fmu", "--vehicle", "scania_r730_4x2", "--output", str(tmp_path / "t.fmu")]) == 0
    said = capsys.readouterr()
    assert said.out.endswith("for win64, linux64, darwin64\n")
    assert said.err == "compiling for win64, linux64, darwin64; the first time takes minutes\n"


def test_an_error_of_zig_is_one_line_that_names_the_platform(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("oncenter.export.fmu._core_in_one", lambda sources: "#error of a test\n")
    with pytest.raises(oc.OncenterError) as raised:
        export.write_fmu(LEFT_HAND, tmp_path / "t.fmu")
    said = str(raised.value)
    assert said.startswith("the C compiler 'zig' cannot compile the FMU for x86_64-windows: ")
    assert said.endswith("error: of a test") and "\n" not in said


# --- The same bits on other platforms ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def drive() -> Signals:
    """Four minutes of a worn truck at 100 Hz: play, bends, sensors that drop out."""
    signals, _ = oc.simulate("worn_truck", seed=3)
    return Signals(signals.table.head(24_000), signals.sources, signals.rate_hz, signals.log)


def as_bits(value: float) -> str:
    return struct.pack(">d", value).hex()


INPUTS = "steering_wheel_angle yaw_rate vehicle_speed lateral_acceleration".split()


@pytest.fixture(scope="module")
def drives(written: dict[int, Path], drive: Signals) -> dict[int, Path]:
    """The drive by FMI version, as tests/fmu_importer.c reads it."""
    files = {}
    columns = {name: column for column, name in _core.COLUMNS.items()}
    rows = drive.table.select(pl.col(columns[name]) for name in INPUTS).rows()
    for fmi, path in written.items():
        references = {v.name: v.valueReference for v in fmpy.read_model_description(str(path)).modelVariables}
        head = [f"{fmi}", as_bits(1.0 / drive.rate_hz), as_bits(drive.table["time_s"][0])]
        head += [f"{n:x}" for n in (len(INPUTS), len(OUTPUTS), len(rows))]
        head += [f"{references[name]:x}" for name in (*INPUTS, *OUTPUTS)]
        lines = [" ".join(head), *(" ".join(map(as_bits, row)) for row in rows)]
        files[fmi] = path.with_suffix(".drive")
        files[fmi].write_text("\n".join(lines), encoding="ascii")
    return files


def importer(folder: Path, target: str) -> Path:
    """tests/fmu_importer.c for another platform."""
    program = folder / f"importer_{target.split('.')[0]}.exe"
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", target, "-O2", "-s"]
    subprocess.run([*zig, str(Path(__file__).with_name("fmu_importer.c")), "-o", str(program)], check=True)
    return program


def steps(command: list[str], fmi: int, folder: Path, platform: str, drive: Path, **environment: str) -> list[str]:
    """The lines of bits that an importer prints."""
    token = re.search(r'(?:guid|instantiationToken)="(.+?)"', (folder / "modelDescription.xml").read_text())
    assert token is not None
    done = subprocess.run(
        [*command, str(binary(folder, platform)), token[1], str(drive)],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split("\n")[:-1]


@pytest.fixture(scope="module")
def on_linux(unzipped: dict[int, Path], drives: dict[int, Path]) -> dict[int, list[str]]:
    """The output of the Linux binaries, by FMI version."""
    if sys.platform != "linux" or os.uname().machine != "x86_64":
        pytest.skip("the binaries are compared with those for Linux on x86-64, which this machine cannot run")
    program = importer(unzipped[2].parent, "x86_64-linux-gnu.2.17")
    names = {2: "linux64", 3: "x86_64-linux"}
    return {fmi: steps([str(program)], fmi, unzipped[fmi], names[fmi], drives[fmi]) for fmi in (2, 3)}


def test_the_linux_binary_gives_the_bits_of_offset(on_linux: dict[int, list[str]], drive: Signals) -> None:
    columns = [name for name in drive.table.columns if not name.startswith("wheel_speed")]
    answer = oc.offset(Signals(drive.table.select(columns), drive.sources, drive.rate_hz, drive.log), LEFT_HAND)
    assert answer.offset.value is not None and answer.backlash.value is not None
    for fmi in (2, 3):
        assert len(on_linux[fmi]) == 240
        outputs = dict(zip(OUTPUTS, on_linux[fmi][-1].split(), strict=True))
        assert outputs["offset"] == as_bits(answer.offset.value)
        assert outputs["backlash"] == as_bits(answer.backlash.value)


@pytest.fixture(scope="module")
def wine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[list[str], dict[str, str]]]:
    """Wine's command, and its environment with a Windows that is removed afterwards: it is half a gigabyte."""
    found = shutil.which("wine64", path=f"{os.environ.get('PATH', '')}:/usr/lib/wine")
    if found is None:
        pytest.skip("the binary for Windows runs under Wine: make fmu, or apt-get install wine64")
    prefix = tmp_path_factory.mktemp("wine")
    environment = {"WINEPREFIX": str(prefix), "WINEDEBUG": "-all", "DISPLAY": ""}
    yield [found], environment
    server = shutil.which("wineserver64", path="/usr/lib/wine") or shutil.which("wineserver")
    if server is not None:
        subprocess.run([server, "-k", "-w"], env={**os.environ, **environment}, check=False)
    shutil.rmtree(prefix, ignore_errors=True)


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_windows_binary_gives_the_bits_of_the_linux_binary_under_wine(
    fmi: int,
    wine: tuple[list[str], dict[str, str]],
    unzipped: dict[int, Path],
    drives: dict[int, Path],
    on_linux: dict[int, list[str]],
) -> None:
    command, environment = wine
    program = importer(unzipped[2].parent, "x86_64-windows-gnu")
    platform = {2: "win64", 3: "x86_64-windows"}[fmi]
    said = steps([*command, str(program)], fmi, unzipped[fmi], platform, drives[fmi], **environment)
    assert [line.rstrip("\r") for line in said] == on_linux[fmi]


def test_the_arm_binary_gives_the_bits_of_the_x86_binary(
    unzipped: dict[int, Path], drives: dict[int, Path], on_linux: dict[int, list[str]]
) -> None:
    system = Path("/usr/aarch64-linux-gnu")
    emulator = shutil.which("qemu-aarch64")
    if emulator is None or not system.is_dir():
        pytest.skip("the binary for ARM runs in an emulator: make fmu, or apt-get install qemu-user libc6-arm64-cross")
    program = importer(unzipped[2].parent, "aarch64-linux-gnu.2.17")
    command = [emulator, "-L", str(system), str(program)]
    assert steps(command, 3, unzipped[3], "aarch64-linux", drives[3]) == on_linux[3]
