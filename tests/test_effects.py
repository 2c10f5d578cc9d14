"""The bench of real-truck effects: its rows are what they say, its figures are right, and its section stays."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

import accuracy_page
import accuracy_rows
import effects
import effects_page
from accuracy_rows import drive
from effects_rows import AT_SIZE_1, EFFECTS, PULLS, SIZES, STATUS_ROWS, VALID_MIN, WINDS
from layouts import scenario
from sections import EFFECTS as HEADING
from sections import section_of, with_section

from oncenter.signals import DEGREE
from oncenter.simulate import sensor_sections
from oncenter.simulate.drive import ffi, lib
from oncenter.simulate.scenario import Scenario, read_scenario
from oncenter.simulate.truck import native_truck

SENSORS = {
    "steering_wheel_angle": sensor_sections.SteeringWheelAngleSensor(),
    "yaw_rate": sensor_sections.YawRateSensor(),
    "lateral_acceleration": sensor_sections.LateralAccelerometer(),
    "speed": sensor_sections.SpeedSensor(),
    "wheel_speed": sensor_sections.WheelSpeedSensors(),
}
SIZED = [name.removesuffix("_half") for name in EFFECTS if f"{name.removesuffix('_half')}_double" in EFFECTS]
SIZED = list(dict.fromkeys(name for name in SIZED if name in EFFECTS))
LARGEST_DECREASE_PERCENT = -60.0  # of a load that leaves


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS | STATUS_ROWS)
def test_a_row_can_be_driven_with_real_sensors_and_names_no_traffic_side(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[Scenario] = []

    def read(file: Path) -> Scenario:
        kept.append(read_scenario(file))
        return kept[-1]

    monkeypatch.setattr(accuracy_rows, "read_scenario", read)
    driven = drive((EFFECTS | STATUS_ROWS)[name], 1, tmp_path)
    assert driven.vehicle.traffic_side is None
    assert np.isfinite(driven.target_rad).all()
    for sensor, real in SENSORS.items():
        given = getattr(kept[0].sensors, sensor).model_dump()
        for key, value in real.model_dump().items():
            if key.startswith(("noise", "resolution", "range", "repeat")):
                assert given[key] == value, f"{sensor}.{key}"
    for signal, step in (("steering_wheel_angle_rad", 0.11 * DEGREE), ("yaw_rate_rad_s", 0.028 * DEGREE)):
        steps = np.diff(np.unique(driven.signals.table[signal].drop_nans().to_numpy()))
        assert steps.min() == pytest.approx(step, rel=1e-6)


def leaves(values: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Numbers of a scenario with their paths."""
    items = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    for key, value in items:
        yield from leaves(value, f"{path}.{key}")
    if isinstance(values, float | int):
        yield path, float(values)


def scenario_values(name: str) -> dict[str, float]:
    row = EFFECTS[name]
    pull = row.fixed.get("pull_m_s2")
    spread = {} if pull is None else {"pull_sd_m_s2": pull.sd}
    return dict(leaves(row.extra(np.random.default_rng(3)) | spread))


def test_rows_come_in_three_sizes() -> None:
    assert len(SIZED) >= 11
    assert {f"{name}_{word}" if word else name for name in SIZED for word in SIZES} <= EFFECTS.keys()


@pytest.mark.parametrize("name", SIZED)
def test_half_and_double_are_half_and_double_of_the_full_size(name: str) -> None:
    half, full, double = (scenario_values(row) for row in (f"{name}_half", name, f"{name}_double"))
    assert half.keys() == full.keys() == double.keys()
    sized = [key for key, value in full.items() if half[key] != value]
    assert sized
    for key in sized:
        assert half[key] == pytest.approx(0.5 * full[key])
        at_double = 2.0 * full[key]
        if key.endswith("load_percent"):
            at_double = max(at_double, LARGEST_DECREASE_PERCENT)
        assert double[key] == pytest.approx(at_double)
    assert {key for key in full if double[key] != full[key]} == set(sized)


@pytest.mark.parametrize("name", [name for name in STATUS_ROWS if name.endswith("_with_status")])
def test_a_row_with_a_status_has_the_drives_of_the_row_without(name: str) -> None:
    without, sent = STATUS_ROWS[name.removesuffix("_with_status")], STATUS_ROWS[name]
    tables = [row.extra(np.random.default_rng(3)) for row in (without, sent)]
    said = [table["sensors"].pop(key, None) for table in tables for key in ("statuses", "rear_axle_angle")]
    assert said[:2] == [None, None]
    assert any(said[2:])
    assert tables[0] == tables[1]
    assert (sent.like, sent.base, sent.fixed) == (without.name, without.base, without.fixed)


def test_a_steady_wind_comes_from_either_side_and_is_judged_away() -> None:
    assert WINDS <= PULLS
    sides = {STATUS_ROWS["steady_wind_5_9"].extra(np.random.default_rng(k))["wind"]["from_deg"] for k in range(20)}
    assert sides == {90.0, 270.0}


def test_the_angle_held_against_a_wind_keeps_the_truck_straight() -> None:
    """Formula against simulation: neither yaw rate nor lateral acceleration under the same force."""
    wind = {"mean_m_s": 8.0, "from_deg": 270.0, "from_side": True, "gust_sd_m_s": 0.0, "gust_time_s": 3.0}
    acts = {"side_area_m2": 9.0, "side_force_coefficient": 1.1, "force_arm_m": 1.0}
    settings = scenario({"wind": wind | acts})
    table = pl.DataFrame({"vehicle_speed_m_s": [0.0, 20.0], "wind_side_force_n": [9000.0, -1200.0]})
    truth = SimpleNamespace(table=table, steering_ratio=settings.steering.ratio_near_centre)
    angle = effects.held_against_wind_rad(SimpleNamespace(scenario=settings, truth=truth))
    truck, state = native_truck(settings.truck, settings.steering), ffi.new("sim_truck_state *")
    acting = {"front_wheel_angle": angle / truth.steering_ratio, "speed": 20.0, "wind_force": -1200.0, "wind_arm": 1.0}
    for _ in range(4000):
        lib.sim_truck_step(state, truck, ffi.new("sim_truck_input *", acting), 0.0025)
    assert angle > 0.5 * DEGREE
    assert state.yaw_rate == pytest.approx(0.0, abs=1e-9)
    assert sum(state.axle_forces) == pytest.approx(1200.0, rel=1e-6)


def test_the_row_option_names_a_row() -> None:
    assert VALID_MIN.keys() <= EFFECTS.keys()
    assert set(AT_SIZE_1) <= EFFECTS.keys()
    assert {name for name in EFFECTS if name.startswith("combined")} <= set(AT_SIZE_1)
    assert {row for _, row in effects_page.WHY} <= {*EFFECTS, ""}


def record(row: str, *, error: float = 0.1, half_width: float = 0.3, pull: float = 0.0, **given: Any) -> dict[str, Any]:
    """A record of bench/effects.py, in deg; `pull` is i K_us times the pull."""
    said: dict[str, Any] = {"row": row, "seed": 1001, "valid": True, "findings": [], "errors": [], "fault": "none"}
    for prefix, off in (("", error), ("less_pull_", error - pull)):
        said |= {f"{prefix}offset_error": off, f"{prefix}offset_half_width": half_width}
        said |= {f"{prefix}offset_holds": abs(off) <= half_width, f"{prefix}offset_status": "valid"}
    for name in effects.OTHERS:
        said |= {f"{name}_error": 0.01, f"{name}_half_width": 0.1, f"{name}_holds": True, f"{name}_status": "valid"}
    return said | {"names_accelerometer": False, "changes_deg": [], "drive_ratio": 0.3} | given


def summaries_of(table: pl.DataFrame) -> list[dict[str, Any]]:
    return [effects.summary(str(row), part) for (row,), part in table.group_by("row", maintain_order=True)]


def test_coverage_counts_valid_drives_and_all_drives() -> None:
    unknown = {key: None for key in record("none") if key.startswith(("offset_", "less_pull_"))}
    table = pl.DataFrame(
        [
            record("none", error=0.2),
            record("none", error=-0.4),
            record("none", error=0.25, valid=False),
            record("none", **{"valid": False, **unknown}),
        ],
        infer_schema_length=None,
    )
    (s,) = summaries_of(table)
    assert (s["drives"], s["valid"], s["covered_valid"], s["covered"]) == (4, 2, 1, 2)
    assert s["valid_error"] == pytest.approx([0.3, 0.39, 0.4])


def test_a_row_with_a_pull_is_judged_without_the_pull() -> None:
    drives = [{"error": 1.2, "pull": 1.1}, {"error": -0.1, "pull": 1.1}]
    table = pl.DataFrame([record(row, **drive) for row in ("pull", "wind_moment") for drive in drives])
    assert "pull" in PULLS
    pulled, blown = summaries_of(table)
    assert pulled["covered"] == 1
    assert pulled["valid_error"][2] == pytest.approx(1.2)
    assert blown["covered"] == 1
    assert blown["valid_error"][2] == pytest.approx(1.2)
    assert effects_page.off_by_more(table, "pull", 1.0) == 1
    table = table.with_columns(less_pull_offset_error=pl.lit(0.1))
    assert effects_page.off_by_more(table, "pull", 1.0) == 0
    assert effects_page.off_by_more(table, "wind_moment", 1.0) == 1


def test_a_drive_with_several_false_reports_counts_once() -> None:
    table = pl.DataFrame(
        [
            record("none"),
            record("none", findings=["backlash"]),
            record("none", findings=["offset_changed"], errors=["signals_at_fault"], fault="stuck"),
            record("pull", errors=["signals_at_fault"]),
            record("pull", fault="stuck"),
        ]
    )
    assert effects_page.accused_drives(table) == {"none": 1, "pull": 2}
    text = "\n".join(effects_page.section(table, summaries_of(table), range(1001, 1004)))
    assert "3 of 5 drives have a finding `offset_changed`" in text
    assert "at most 1 drive in 200: **missed** (3 of 5)." in text


def test_an_estimate_of_the_truck_counts_where_its_own_status_is_valid() -> None:
    elsewhere = {"backlash_status": "uncertain", "backlash_holds": False, "backlash_error": 5.0}
    table = pl.DataFrame([record("none"), record("none", **elsewhere), record("none", backlash_holds=False)])
    (s,) = summaries_of(table)
    assert s["backlash"] == (1, 2, pytest.approx(0.01))
    assert s["understeer_gradient"] == (3, 3, pytest.approx(0.01))


def test_the_bound_of_a_row_is_the_binomial_1_percent_quantile() -> None:
    def below(count: int, held: int) -> float:
        from math import comb

        return sum(comb(count, k) * 0.95**k * 0.05 ** (count - k) for k in range(held))

    for count in (1, 4, 24, 60, 240):
        minimum = effects_page.bound(count)
        assert below(count, minimum) <= 0.01 < below(count, minimum + 1)
    assert effects_page.bound(0) == 0


def test_the_list_gives_missed_rows_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effects_page, "WHY", {("play_largest", "play_15"): "The play is wide."})
    table = pl.DataFrame([record("none"), record("play_12"), record("play_15", error=0.7, half_width=0.8)])
    lines = list(effects_page.section(table, summaries_of(table), range(1001, 1002)))
    assert "- `none`: the median error of the valid drives is at most 0.10 deg: met (0.10 deg)." in lines
    assert "    - `play_15`: **missed** (0.70 deg). The play is wide." in lines
    row = next(line for line in lines if line.startswith("| `play_15`"))
    assert "| 0.70 / 0.70 / **0.70** | 1 of 1 | 1 of 1 |" in row


def test_a_row_with_too_few_intervals_that_hold_is_bold() -> None:
    drives = [record("none", error=0.1 if seed < 50 else 0.9) for seed in range(60)]
    table = pl.DataFrame(drives)
    lines = list(effects_page.section(table, summaries_of(table), range(1001, 1061)))
    assert any("| **50 of 60** | **50 of 60** |" in line for line in lines)
    assert any(line.endswith("all intervals contain the truth: **missed** (50 of 60).") for line in lines)


PAGE = "# Accuracy\n\nText.\n\n## Time\n\nMore.\n"
SECTION = "## Real-truck effects\n\nFirst.\n\n### A part\n\nOf it."


def test_the_section_is_appended_once_and_replaced_after_that() -> None:
    first = with_section(PAGE, SECTION)
    assert first == f"{PAGE}\n{SECTION}\n"
    assert section_of(first, HEADING) == SECTION
    again = with_section(first, SECTION.replace("First", "Second"))
    assert again == first.replace("First", "Second")


def test_a_section_in_the_middle_ends_at_the_next_heading_of_its_level() -> None:
    page = f"# Accuracy\n\n{SECTION}\n\n## Time\n\nMore.\n"
    assert section_of(page, HEADING) == SECTION
    assert with_section(page, "## Real-truck effects\n\nShort.") == (
        "# Accuracy\n\n## Real-truck effects\n\nShort.\n\n## Time\n\nMore.\n"
    )


def test_a_page_without_the_section_stays_as_it_is() -> None:
    assert section_of(PAGE, HEADING) == ""
    assert with_section(PAGE, "") == PAGE


def test_the_bench_writes_its_section_into_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(effects_page, "PAGE", tmp_path / "accuracy.md")
    effects_page.PAGE.write_text(PAGE, encoding="utf-8")
    table = pl.DataFrame([record("none"), record("pull")])
    for _ in range(2):
        effects_page.write_section(table, summaries_of(table), range(1001, 1002))
    page = effects_page.PAGE.read_text(encoding="utf-8")
    assert page.startswith(PAGE)
    assert page.count(HEADING) == 1


@pytest.mark.parametrize("there", [True, False])
def test_the_accuracy_page_keeps_the_section(there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parts = ["required", "why", "errors", "how_soon", "how_sure", "real", "spent", "priors", "study"]
    for part in parts:
        monkeypatch.setattr(accuracy_page, f"_{part}", lambda *given: iter(()))
    monkeypatch.setattr(accuracy_page, "_head", lambda *given: iter(["# Accuracy", "", "Anew."]))
    for name in ("study", "draw", "real_drives"):
        monkeypatch.setattr(accuracy_page, name, lambda *given: ())
    monkeypatch.setattr(accuracy_page, "DOCS", tmp_path)
    file = tmp_path / "accuracy.md"
    if there:
        file.write_text(with_section(PAGE, SECTION), encoding="utf-8")
    for _ in range(2):
        accuracy_page.write_page(pl.DataFrame(), [], range(1001, 1002))
        assert file.read_text(encoding="utf-8") == "# Accuracy\n\nAnew.\n" + (f"\n{SECTION}\n" if there else "")


@pytest.mark.parametrize("also", [["--tuning"], ["--rows", "none"], ["--params", "pull_sd_m_s2=0.1"]])
def test_a_page_takes_all_rows_and_the_reported_seeds(also: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["effects.py", "--page", *also])
    monkeypatch.setattr(effects, "run", lambda *given: pytest.fail("it drove"))
    with pytest.raises(SystemExit) as refused:
        effects.main()
    assert refused.value.code == 2


def answered(row: str, seeds: range, folder: Path, *, with_angle: bool = False) -> pl.DataFrame:
    return pl.DataFrame([effects.record(row, seed, folder, with_angle, {}) for seed in seeds], infer_schema_length=None)


@pytest.mark.slow
def test_a_wide_play_with_a_late_second_flank_is_estimated_without_a_false_report(tmp_path: Path) -> None:
    """Seeds 11 and 22 had half of 12 deg taken for offset, and the other flank for a sensor that was remounted."""
    drives = pl.concat([answered("play_12", range(seed, seed + 1), tmp_path) for seed in (8, 11, 22)])
    assert drives["backlash_error"].abs().max() < 1.0
    assert drives["offset_error"].abs().max() < 0.5
    assert not any("offset_changed" in findings for findings in drives["findings"])


@pytest.mark.slow
def test_a_drifting_accelerometer_does_not_shift_the_offset(tmp_path: Path) -> None:
    """It drifts by 0.45 m/s^2 in 15 minutes: a constant zero put the offset 1 to 8 deg off, and changes into it."""
    drives = answered("accelerometer_drift", range(1, 9), tmp_path)
    assert drives["offset_error"].abs().max() < 0.5
    assert drives["valid"].sum() >= 4
    assert drives["offset_holds"].all()


@pytest.mark.slow
def test_a_strongly_drifting_accelerometer_is_reported_and_nothing_is_valid(tmp_path: Path) -> None:
    drives = answered("accelerometer_drift_thesis", range(1, 7), tmp_path)
    assert drives["names_accelerometer"].all()
    assert not drives["valid"].any()
    assert "valid" not in {*drives["understeer_gradient_status"], *drives["backlash_status"]}


@pytest.mark.slow
def test_unloading_is_attributed_to_the_truck_and_not_to_the_sensor(tmp_path: Path) -> None:
    drives = answered("load_change", range(1, 9), tmp_path)
    assert not any("offset_changed" in findings for findings in drives["findings"])
    assert set(drives["fault"]) == {"none"}
    assert drives["offset_holds"].all()


@pytest.mark.slow
def test_tyres_that_grow_in_the_sun_keep_the_gyro_bias_within_its_interval(tmp_path: Path) -> None:
    drives = answered("tyres_in_the_sun", range(1, 9), tmp_path)
    assert drives["yaw_rate_bias_holds"].sum() >= 7
    assert drives["offset_holds"].all()
