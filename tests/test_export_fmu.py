"""The core for other tools: FMUs with the bits of `oncenter offset`."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import process_time

import fmpy
import numpy as np
import polars as pl
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.model_description import ModelDescription
from fmpy.validation import validate_fmu
from test_estimate import steady_drive

import oncenter as oc
from oncenter import _core, export
from oncenter.cli import run
from oncenter.estimates.estimate import Estimate
from oncenter.export import binaries
from oncenter.export.page import page
from oncenter.export.variables import variables_of
from oncenter.param_table import params
from oncenter.signals import Signals

ROOT = Path(__file__).parents[1]
TRUCK = oc.vehicle("scania_r730_4x2")
LEFT_HAND = TRUCK.model_copy(update={"params": {"joint_evidence_min_s": 30.0}, "traffic_side": "left"})
INPUTS = {column: name for column, name in _core.COLUMNS.items() if name != "time"}
ESTIMATES = (
    "offset understeer_gradient backlash unloading_acceleration yaw_rate_bias "
    "wheel_radius_mismatch_front wheel_radius_mismatch_rear"
).split()


@pytest.fixture(scope="module", autouse=True)
def own_compiler() -> Iterator[None]:
    """This machine's compiler alone: test_export_fmu_platforms.py looks at what zig compiles."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(binaries, "has_zig", lambda: False)
        yield


@pytest.fixture(scope="module")
def drive() -> Signals:
    """Eight minutes of a worn truck: play, bends, four wheel speeds, sensors that drop out."""
    signals, _ = oc.simulate("worn_truck", seed=3)
    return Signals(signals.table.head(48_000), signals.sources, signals.rate_hz, signals.log)


class Fmu:
    """An FMU in an importer, by the names of its variables; it hides the differences of FMI 2.0 and 3.0."""

    def __init__(self, path: Path, folder: Path) -> None:
        self.description: ModelDescription = fmpy.read_model_description(str(path))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.types = {v.name: v.type for v in self.description.modelVariables}
        self.fmi2 = self.description.fmiVersion == "2.0"
        self.complaints: list[str] = []
        self.slave = (FMU2Slave if self.fmi2 else FMU3Slave)(
            guid=self.description.guid or self.description.instantiationToken,
            unzipDirectory=fmpy.extract(str(path), unzipdir=str(folder)),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="truck",
        )
        self.slave.instantiate()

    def begin(self, start: float = 0.0) -> None:
        if self.fmi2:
            self.slave.setupExperiment(startTime=start)
            self.slave.enterInitializationMode()
        else:
            self.slave.enterInitializationMode(startTime=start)
        self.slave.exitInitializationMode()

    def get(self, name: str) -> float:
        call = {"Enumeration": "Integer"} if self.fmi2 else {"Enumeration": "Int64"}
        kind = call.get(self.types[name], self.types[name])
        return getattr(self.slave, f"get{kind}")([self.references[name]])[0]

    def set(self, name: str, value: float) -> None:
        call = {"Enumeration": "Integer"} if self.fmi2 else {"Enumeration": "Int64"}
        kind = call.get(self.types[name], self.types[name])
        getattr(self.slave, f"set{kind}")([self.references[name]], [value])

    def drive(self, table: pl.DataFrame, rate_hz: float) -> None:
        """Row by row, as an importer that steps by ticks: inputs at a time, then the step from there."""
        columns = [column for column in INPUTS if column in table.columns]
        references = [self.references[INPUTS[column]] for column in columns]
        set_inputs = self.slave.setReal if self.fmi2 else self.slave.setFloat64
        for time, *values in table.select("time_s", *columns).iter_rows():
            set_inputs(references, values)
            self.slave.doStep(time, 1.0 / rate_hz)

    def has(self, table: pl.DataFrame) -> None:
        for column, name in INPUTS.items():
            self.set(f"{name}_available", column in table.columns)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("fmu")
    return {fmi: export.write_fmu(LEFT_HAND, folder / f"truck{fmi}.fmu", fmi=fmi) for fmi in (2, 3)}


@pytest.fixture(params=[2, 3], ids=["FMI 2.0", "FMI 3.0"])
def path(request: pytest.FixtureRequest, written: dict[int, Path]) -> Path:
    return written[request.param]


@pytest.fixture
def fmu(path: Path, tmp_path: Path) -> Iterator[Fmu]:
    instance = Fmu(path, tmp_path / "unzipped")
    yield instance
    instance.slave.freeInstance()


def test_fmpy_finds_no_problem_in_an_fmu(path: Path) -> None:
    assert validate_fmu(str(path)) == []


def bits(value: float | None) -> str:
    assert value is not None
    return float(value).hex()


def about_value(estimate: Estimate) -> float:
    """Standard deviation of the truth about the value, whose interval is not always centred on it."""
    assert estimate.value is not None and estimate.ci95 is not None
    low, high = estimate.ci95
    return math.hypot((high - low) / (2.0 * 1.96), 0.5 * (low + high) - estimate.value)


def test_an_fmu_gives_the_bits_of_offset_for_a_drive(fmu: Fmu, drive: Signals) -> None:
    fmu.has(drive.table)
    fmu.begin(drive.table["time_s"][0])
    fmu.drive(drive.table, drive.rate_hz)
    answer = oc.offset(drive, LEFT_HAND)
    assert answer.offset.value is not None and answer.backlash.value is not None
    for name in ESTIMATES:
        estimate = getattr(answer, name)
        assert _core.STATUSES[int(fmu.get(f"{name}_status"))] == estimate.status
        if estimate.value is not None:
            assert bits(fmu.get(name)) == bits(estimate.value)
            if name == "offset":
                assert fmu.get("offset_sd") == pytest.approx(about_value(estimate), rel=1e-9)
            else:
                assert bits(fmu.get(name) - 1.96 * fmu.get(f"{name}_sd")) == bits(estimate.ci95[0])
    drive_sd = answer.offset_half_width_rad / 1.96
    assert fmu.get("offset_drive_sd") == pytest.approx(drive_sd, rel=1e-9)
    sds = dict(zip(("pull", "wind", "set_up"), answer.not_identifiable, strict=True))
    for name, cause in sds.items():
        assert bits(fmu.get(f"offset_{name}_sd")) == bits(cause.sd_rad)
    assert bits(fmu.get("offset_per_acceleration")) == bits(answer.offset_per_acceleration)
    assert bits(fmu.get("used_time")) == bits(answer.used_s)
    for reason, seconds in answer.rejected_s.items():
        assert bits(fmu.get(f"rejected_time.{reason}")) == bits(seconds)


def test_fmpy_itself_simulates_a_drive_to_the_same_offset(path: Path) -> None:
    given = steady_drive(minutes=3.0)
    table = given.table.with_columns(time_s=np.arange(given.table.height) * (1.0 / given.rate_hz))
    columns = {"time_s": "time", **{column: name for column, name in INPUTS.items() if column in table.columns}}
    inputs = table.select(pl.col(column).alias(name) for column, name in columns.items()).to_numpy(structured=True)
    result = fmpy.simulate_fmu(
        str(path),
        start_values={"rate_hz": given.rate_hz},
        stop_time=table.height / given.rate_hz,
        output_interval=1.0 / given.rate_hz,
        input=inputs,
        output=["offset", "offset_sd", "duration_time"],
    )
    answer = oc.offset(Signals(table, given.sources, given.rate_hz, given.log), LEFT_HAND)
    assert result["duration_time"][-1] == answer.duration_s
    assert bits(result["offset"][-1]) == bits(answer.offset.value)
    assert result["offset_sd"][-1] == pytest.approx(about_value(answer.offset), rel=1e-9)


def test_the_vehicle_files_values_are_the_fmus_start_values_and_an_importer_may_change_them(
    fmu: Fmu,
) -> None:
    steady = steady_drive()
    assert fmu.get("params.joint_evidence_min_s") == 30.0
    assert fmu.get("vehicle.traffic_side") == -1
    assert fmu.get("vehicle.wheelbase_m") == TRUCK.wheelbase_m
    for name, value in {**_core.default_params(), **LEFT_HAND.params}.items():
        assert fmu.get(f"params.{name}") == value
    fmu.set("method", _core.METHODS.index("thesis"))
    fmu.set("params.speed_min_m_s", 15.0)
    fmu.set("rate_hz", steady.rate_hz)
    fmu.has(steady.table)
    fmu.begin(steady.table["time_s"][0])
    fmu.drive(steady.table, steady.rate_hz)
    answer = oc.offset(steady, LEFT_HAND, method="thesis", params={"speed_min_m_s": 15.0})
    assert answer.offset.status == "valid"
    assert bits(fmu.get("offset")) == bits(answer.offset.value)


def test_the_fmus_angle_without_its_sensor_is_that_of_angle_bit_for_bit(fmu: Fmu, drive: Signals) -> None:
    part = Signals(drive.table.head(20_000), drive.sources, drive.rate_hz, drive.log)
    lost = part.table.with_columns(
        steering_wheel_angle_rad=pl.when(pl.col("time_s") < 150.0 + pl.col("time_s").first())
        .then("steering_wheel_angle_rad")
        .otherwise(float("nan"))
    )
    fmu.set("angle_method", _core.ANGLE_METHODS.index("observer"))
    fmu.has(lost)
    fmu.begin(lost["time_s"][0])
    expected = oc.angle(part, LEFT_HAND, sensor_lost_at=150.0)
    for rows, expected_row in ((lost.head(14_000), 13_999), (lost.slice(14_000), 19_999)):
        fmu.drive(rows, part.rate_hz)
        row = expected.row(expected_row, named=True)
        assert bits(fmu.get("angle")) == bits(row["steering_wheel_angle_rad"])
        assert bits(fmu.get("angle_sd")) == bits(row["standard_deviation_rad"])
        assert _core.STATUSES[int(fmu.get("angle_status"))] == row["status"]
        assert _core.FAULTS[int(fmu.get("sensor_fault"))] == row["sensor_fault"]
    assert fmu.get("sensor_fault_since") == expected["sensor_fault_since_s"][-1]


def test_each_variable_has_a_unit_or_a_type_and_a_description(path: Path) -> None:
    for variable in fmpy.read_model_description(str(path)).modelVariables:
        assert variable.description, variable.name
        if variable.type in ("Real", "Float64"):
            assert variable.unit, variable.name
        if variable.min is not None and variable.type in ("Real", "Float64"):
            assert float(variable.min) <= float(variable.start) <= float(variable.max), variable.name
        if variable.unit and variable.unit.startswith("rad"):
            assert variable.displayUnit == variable.unit.replace("rad", "deg")


def test_the_exported_ranges_are_those_of_the_core() -> None:
    listed = list(params().values())
    assert {p.name for p in listed} == set(_core.default_params()) - {"use_accelerometer"}
    widest = {"delay_band_hz": {"cutoff_hz": 50.0}, "understeer_acceleration_min_m_s2": {}}
    for p in listed:
        others = widest.get(p.name, {})
        if p.name == "cutoff_hz":
            others = {"delay_band_hz": 0.1}
        if p.name.startswith("understeer_acceleration_"):
            others = {"understeer_acceleration_min_m_s2": 0.01, "understeer_acceleration_max_m_s2": 10.0}
        for bound, beyond in ((p.low, p.low - 1e-6 * max(1.0, abs(p.low))), (p.high, 1.001 * p.high)):
            assert _core.bad_param({**others, p.name: bound}) is None, (p.name, bound)
            assert _core.bad_param({**others, p.name: beyond}) == p.name, (p.name, beyond)


@pytest.mark.parametrize(("step_s", "steps"), [(0.001, 10_000), (0.003, 3_333), (0.05, 200), (0.01, 1000)])
def test_the_number_of_ticks_does_not_depend_on_the_importers_step(fmu: Fmu, step_s: float, steps: int) -> None:
    fmu.begin()
    for k in range(steps):
        fmu.slave.doStep(k * step_s, step_s)
    assert fmu.get("duration_time") == pytest.approx(10.0, abs=0.011)
    assert fmu.get("time") == pytest.approx(steps * step_s)


def test_a_step_of_one_tick_runs_one_tick_even_if_the_importers_clock_drifts(fmu: Fmu) -> None:
    fmu.begin()
    for k in range(1000):
        fmu.slave.doStep(k * 0.01004, 0.01004)
        assert fmu.get("tick_time") == k * 0.01004
    assert fmu.get("duration_time") == pytest.approx(10.0, abs=1e-9)


def test_a_signal_that_is_not_available_or_no_number_is_not_used(fmu: Fmu) -> None:
    fmu.begin()
    fmu.set("vehicle_speed", 20.0)
    fmu.slave.doStep(0.0, 0.01)
    assert not fmu.get("reason.missing_signal")
    fmu.set("yaw_rate_available", False)
    fmu.slave.doStep(0.01, 0.01)
    assert fmu.get("reason.missing_signal")
    fmu.set("yaw_rate_available", True)
    fmu.set("lateral_acceleration", float("nan"))
    fmu.slave.doStep(0.02, 0.01)
    assert fmu.get("reason.missing_signal")
    assert fmu.get("rejected_time.missing_signal") == pytest.approx(0.02)


def test_the_torque_of_a_drive_is_an_input_of_the_fmu_too(fmu: Fmu, tmp_path: Path) -> None:
    scenario = tmp_path / "torque.toml"
    text = (ROOT / "scenarios" / "worn_truck.toml").read_text(encoding="utf-8")
    scenario.write_text(f"{text}\n[sensors.steering_wheel_torque]\n", encoding="utf-8")
    simulated, _ = oc.simulate(str(scenario), seed=3)
    drive = Signals(simulated.table.head(30_000), simulated.sources, simulated.rate_hz, simulated.log)
    offsets = []
    for table in (drive.table, drive.table.drop("steering_wheel_torque_nm")):
        fmu.set("params.use_accelerometer", False)
        fmu.set("params.torque_for_accelerometer_1", 1.0)
        fmu.has(table)
        fmu.begin(table["time_s"][0])
        fmu.drive(table, drive.rate_hz)
        offsets.append(bits(fmu.get("offset")))
        fmu.slave.reset()
    expected = oc.offset(drive, LEFT_HAND, params={"use_accelerometer": 0.0})
    assert offsets[0] == bits(expected.offset.value)
    assert offsets[0] != offsets[1]


def refused(call: object, *arguments: object) -> bool:
    """True if the FMU rejects the call; fmpy raises then."""
    try:
        call(*arguments)  # type: ignore[operator]
    except Exception as error:
        assert "error" in str(error).lower()
        return True
    return False


def test_the_fmu_rejects_impossible_values(fmu: Fmu) -> None:
    assert refused(fmu.slave.doStep, 0.0, 0.01)
    fmu.set("params.cutoff_hz", 500.0)
    assert refused(fmu.begin)
    fmu.slave.reset()
    assert fmu.get("params.cutoff_hz") == 3.0
    fmu.begin()
    assert refused(fmu.set, "params.cutoff_hz", 4.0)
    assert refused(fmu.set, "offset", 0.0)
    assert refused(fmu.slave.doStep, 0.0, -0.01)
    assert refused(fmu.slave.doStep, float("nan"), 0.01)
    fmu.slave.doStep(10.0, 0.01)
    assert refused(fmu.slave.doStep, 5.0, 0.01)


def test_a_wheel_speed_fmu_without_a_track_width_does_not_start(tmp_path: Path, path: Path) -> None:
    fmu = Fmu(path, tmp_path / "unzipped")
    fmu.set("method", _core.METHODS.index("wheel-speed"))
    for axle in ("front", "rear"):
        fmu.set(f"vehicle.track_width_{axle}_m", 0.0)
    assert refused(fmu.begin)
    fmu.slave.freeInstance()


def test_a_run_that_is_saved_and_continued_in_another_instance_ends_the_same(
    fmu: Fmu, path: Path, tmp_path: Path, drive: Signals
) -> None:
    first, second = drive.table.head(9_000), drive.table.slice(9_000, 3_000)
    fmu.has(drive.table)
    fmu.begin(first["time_s"][0])
    fmu.drive(first, drive.rate_hz)
    calls = "getFMUState setFMUState serializeFMUState deserializeFMUState".split()
    if fmu.fmi2:
        calls = "getFMUstate setFMUstate serializeFMUstate deSerializeFMUstate".split()
    get_state, set_state, to_bytes, from_bytes = calls
    state = getattr(fmu.slave, get_state)()
    image = getattr(fmu.slave, to_bytes)(state)
    fmu.drive(second, drive.rate_hz)
    names = (*ESTIMATES, "used_time", "tick_time", "motion.residual")
    values = [bits(fmu.get(name)) for name in names]

    getattr(fmu.slave, set_state)(state)
    assert fmu.get("tick_time") == first["time_s"][-1]
    fmu.drive(second, drive.rate_hz)
    assert [bits(fmu.get(name)) for name in names] == values

    other = Fmu(path, tmp_path / "elsewhere")
    other.begin()
    getattr(other.slave, set_state)(getattr(other.slave, from_bytes)(image))
    other.drive(second, drive.rate_hz)
    assert [bits(other.get(name)) for name in names] == values

    foreign = bytes([image[0], image[1] ^ 1]) + bytes(image[2:])
    assert refused(getattr(other.slave, from_bytes), foreign)
    assert refused(getattr(other.slave, from_bytes), bytes(image[:-1]))
    for place in range(40, len(image), len(image) // 50):  # a count in it may be an index of the core's tables
        damaged = bytearray(image)
        damaged[place] ^= 0x40
        assert refused(getattr(other.slave, from_bytes), bytes(damaged)), place
    other.slave.freeInstance()


def test_a_jump_of_the_importers_clock_is_a_hole_and_takes_no_time(fmu: Fmu, drive: Signals) -> None:
    fmu.has(drive.table)
    fmu.begin()
    fmu.slave.doStep(0.0, 0.01)
    assert refused(fmu.slave.doStep, 0.01, 9.9e5)
    began_s = process_time()
    fmu.slave.doStep(9.9e5, 0.01)
    assert process_time() - began_s < 1.0
    assert fmu.get("tick_time") == 9.9e5


def test_an_fmu_carries_its_sources_and_its_licences(path: Path, written: dict[int, Path]) -> None:
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        text = {name: archive.read(name).decode() for name in names if not name.startswith("binaries/")}
    assert {f"sources/{file.name}" for file in ROOT.glob("core/*/*.[ch]")} <= names
    assert "Permission is hereby granted" in text["documentation/licenses/license.txt"]
    assert "Redistribution and use" in text["documentation/licenses/fmi_headers.txt"]
    (configuration,) = fmpy.read_model_description(str(path)).buildConfigurations
    (given,) = configuration.sourceFileSets
    assert {f"sources/{name}" for name in given.sourceFiles} <= names
    if path == written[3]:
        assert "-ffp-contract=off" in text["sources/buildDescription.xml"]


TRUCK_FILE = "wheelbase_m = 3.7\nsteering_ratio = 19.3\n"


@pytest.mark.parametrize(
    ("truck", "arguments", "complaint"),
    [
        ("wheelbase_m = 0\n", ["--output", "t.fmu"], "wheelbase_m"),
        ("steering_ratio = 99\n", ["--output", "t.fmu"], "steering_ratio"),
        ("wheelbase_m = 3.7\nsteering_ratio = [0.0, 0.05, 1, 1, 1, 1, 1, 1, 1]\n", ["--output", "t.fmu"], "9 terms"),
        (TRUCK_FILE, ["--output", "t.zip"], "takes a .fmu file"),
        (TRUCK_FILE, ["--output", "nowhere/t.fmu"], "cannot write nowhere/t.fmu"),
        (TRUCK_FILE, ["--output", "t.fmu", "--fmi", "4"], "4"),
        (TRUCK_FILE, [], "--output"),
    ],
)
def test_an_fmu_that_cannot_be_written_is_one_line(
    truck: str,
    arguments: list[str],
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("truck.toml").write_text(truck, encoding="utf-8")
    assert run(["export", "fmu", "--vehicle", "truck.toml", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert complaint in said.err
    assert not list(tmp_path.glob("*.fmu"))


@pytest.mark.parametrize("compiler", ["/nowhere/cc", "false"])
def test_without_a_working_compiler_there_is_one_line_and_no_fmu(
    compiler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CC", compiler)
    assert run(["export", "fmu", "--vehicle", "scania_r730_4x2", "--output", str(tmp_path / "t.fmu")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and compiler in said and "C compiler" in said
    assert not (tmp_path / "t.fmu").exists()


@pytest.mark.parametrize(
    ("system", "machine", "expected"),
    [
        ("linux", "x86_64", ("binaries/linux64/oncenter.so", "binaries/x86_64-linux/oncenter.so")),
        ("linux", "aarch64", ("binaries/linux64/oncenter.so", "binaries/aarch64-linux/oncenter.so")),
        ("win32", "AMD64", ("binaries/win64/oncenter.dll", "binaries/x86_64-windows/oncenter.dll")),
        ("darwin", "x86_64", ("binaries/darwin64/oncenter.dylib", "binaries/x86_64-darwin/oncenter.dylib")),
        ("darwin", "arm64", ("binaries/darwin64/oncenter.dylib", "binaries/aarch64-darwin/oncenter.dylib")),
    ],
)
def test_this_machines_binary_is_at_the_path_of_the_fmi_standard(
    system: str, machine: str, expected: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.platform", system)
    monkeypatch.setattr("platform.machine", lambda: machine)
    platform = binaries.this_platform()
    assert (platform.path(2), platform.path(3)) == expected


@pytest.mark.slow
def test_without_zig_the_command_names_the_extra_for_the_other_platforms(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["export", "fmu", "--vehicle", "scania_r730_4x2", "--output", str(tmp_path / "t.fmu")]) == 0
    said = capsys.readouterr()
    assert said.out.rstrip().endswith(f"for {binaries.this_platform().fmi2}")
    assert said.err == "for all platforms: pip install 'oncenter[fmu]', then export again\n"


def test_without_any_compiler_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "/nowhere/cc")
    with pytest.raises(oc.OncenterError, match=r"pip install 'oncenter\[fmu\]' brings one .*, or install gcc"):
        export.write_fmu(TRUCK, tmp_path / "t.fmu")


def test_export_alone_says_what_can_be_exported(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "export fmu" in said and "export c" in said


def test_an_fmu_does_not_replace_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "t.fmu").mkdir()
    assert run(["export", "fmu", "--vehicle", "scania_r730_4x2", "--output", str(tmp_path / "t.fmu")]) == 2
    assert "cannot write" in capsys.readouterr().err


def test_the_page_shows_names_and_descriptions_as_text() -> None:
    variables = [replace(variable, about="<b>below</b> & above") for variable in variables_of(TRUCK)]
    text = page("<i>truck</i>", variables)
    assert text.count("<td>&lt;b&gt;below&lt;/b&gt; &amp; above</td>") == len(variables)
    assert "<b>below" not in text and "<i>truck" not in text
