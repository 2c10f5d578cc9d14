"""Without wheelbase or steering ratio a drive is answered, and the answer has their product."""

from __future__ import annotations

import dataclasses
import json
import tomllib
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from one_hypothesis import RATIO_TIMES_WHEELBASE, Learner, Play
from one_hypothesis import driven as driven_by_hypothesis
from real_data import real_drive

import oncenter as oc
from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.cli import run
from oncenter.estimates.estimates import Method
from oncenter.export.c_vehicle import vehicle_source
from oncenter.memory import TruckMemory, offset_with_memory
from oncenter.signals import DEGREE, Signals
from oncenter.simulate import Truth
from oncenter.vehicle import Vehicle, core_of, vehicle_from

PRODUCT_M = 3.7 * 19.3  # of the simulated truck
OXTS_DEG = {
    "cpg_fast_lap": 0.27,
    "cpg_slow_lap": 0.34,
    "rfs_2018-06-20_path1": 1.57,
    "rfs_2018-06-20_path2": 1.57,
    "rfs_2018-06-20_path3": 1.57,
}


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> tuple[Signals, Truth]:
    file = tmp_path_factory.mktemp("unknown") / "drive.toml"
    file.write_text('base = "country"\n[drive]\nduration_s = 900.0\n')
    return oc.simulate(file, 4)


@pytest.fixture(scope="module")
def answer(drive: tuple[Signals, Truth]) -> oc.Answer:
    return oc.offset(drive[0])


def target(truth: Truth) -> float:
    return float(truth.table["steering_wheel_angle_offset_rad"][-1]) + truth.straight_ahead_rad


def with_angle(signals: Signals, factor: float) -> Signals:
    column = pl.col("steering_wheel_angle_rad")
    return dataclasses.replace(signals, table=signals.table.with_columns(column * factor))


def codes(answer: oc.Answer) -> dict[str, str]:
    return {finding.code: finding.severity for finding in answer.findings}


def test_the_offset_of_an_unknown_truck_is_that_of_the_known_one(
    drive: tuple[Signals, Truth], answer: oc.Answer
) -> None:
    known = oc.offset(drive[0], oc.vehicle("scania_r730_4x2"))
    assert answer.offset.value is not None and answer.offset.ci95 is not None and known.offset.value is not None
    assert answer.offset.status == "valid"
    assert answer.offset.ci95[0] < target(drive[1]) < answer.offset.ci95[1]
    assert abs(answer.offset.value - known.offset.value) < 0.2 * DEGREE


def test_the_answer_has_the_product_and_neither_factor(answer: oc.Answer) -> None:
    given = answer.to_dict()
    assert given["ratio_times_wheelbase"]["value"] == pytest.approx(PRODUCT_M, rel=0.02)
    assert given["assumed"] == ["wheelbase_m", "steering_ratio"]
    assert given["understeer_at_steering_wheel"]["value"] == pytest.approx(19.3 * 0.4, rel=0.1)
    assert given["understeer_gradient"]["value"] is None and given["equivalent_wheelbase"]["value"] is None
    assert "understeer gradient" not in answer.quantities and "ratio times wheelbase" in answer.quantities


def test_the_answer_names_the_traffic_side_first_and_then_the_axles(answer: oc.Answer) -> None:
    (text,) = (each.text for each in answer.findings if each.code == "unknown_truck")
    assert "traffic_side, axle_layout, wheelbase_m, steering_ratio" in text
    assert "40 to 160 m were assumed" in text and "wrong scale hides" in text


def test_a_layout_that_is_not_given_widens_the_interval_as_a_cause_of_its_own(
    drive: tuple[Signals, Truth], answer: oc.Answer
) -> None:
    given = oc.offset(drive[0], vehicle_from({"axle_layout": "4x2"}, "t.toml"))
    (cause,) = (each for each in answer.not_identifiable if each.cause == "axle_layout")
    assert 0.01 * DEGREE < cause.sd_rad < 0.5 * DEGREE
    assert "axle_layout" not in {each.cause for each in given.not_identifiable}
    assert answer.params["tandem_side_force_m2_s2"] == 8.0 and given.params["tandem_side_force_m2_s2"] == 0.0
    known = {each.cause: each.sd_rad for each in answer.not_identifiable}
    assert answer.offset.ci95 is not None and answer.offset_half_width_rad is not None
    whole = 0.5 * (answer.offset.ci95[1] - answer.offset.ci95[0])
    assert whole > 1.96 * np.hypot(cause.sd_rad, 0.9 * known["pull"])


def test_no_axle_is_taken_for_lifted_from_an_assumed_wheelbase() -> None:
    joint, design = ffi.new("oc_joint *"), ffi.new("oc_joint_design *", {"tandem": 19.0})
    joint.hypotheses[0].wheelbase = -0.3
    assert lib.oc_joint_tandem(joint, design) == 0.0
    design.hypothesis.known.product_doubt = 0.6
    assert lib.oc_joint_tandem(joint, design) == 19.0


def test_a_given_ratio_makes_the_wheelbase_known(drive: tuple[Signals, Truth]) -> None:
    truck = vehicle_from({"steering_ratio": 19.3, "traffic_side": "right", "axle_layout": "4x2"}, "t.toml")
    answer = oc.offset(drive[0], truck)
    assert truck.assumed == ("wheelbase_m",) and truck.params["known_wheelbase_share_sd_1"] == 0.15
    assert answer.equivalent_wheelbase.value == pytest.approx(3.7, rel=0.02)
    assert answer.understeer_gradient.value == pytest.approx(0.4 * DEGREE, rel=0.1)


@pytest.mark.parametrize("method", ["thesis", "wheel-speed"])
def test_the_other_methods_refuse_an_unknown_truck_in_one_line(
    method: Method, drive: tuple[Signals, Truth], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "d.csv").write_text("time_s\n")
    assert run(["offset", str(tmp_path / "d.csv"), "--method", method]) == 2
    said = capsys.readouterr().err.strip()
    assert "needs wheelbase_m and steering_ratio" in said and "\n" not in said
    with pytest.raises(oc.OncenterError, match="needs wheelbase_m and steering_ratio"):
        oc.offset(drive[0], method=method)


def test_an_error_budget_needs_both_factors() -> None:
    with pytest.raises(oc.OncenterError, match="the error budget needs steering_ratio of the truck"):
        oc.budget(vehicle_from({"wheelbase_m": 3.7}, "t.toml"))


def test_a_gradient_at_the_road_wheel_is_no_prior_without_a_ratio() -> None:
    given = {"understeer_gradient_deg_m_s2": 0.4, "understeer_gradient_sd_deg_m_s2": 0.1}
    with pytest.raises(oc.OncenterError, match="as a prior it needs 'steering_ratio'"):
        vehicle_from(given, "t.toml")


def test_a_log_alone_is_answered_at_the_command_line(
    drive: tuple[Signals, Truth], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive[0].table.head(12_000).write_csv(tmp_path / "d.csv")
    assert run(["offset", str(tmp_path / "d.csv"), "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert given["vehicle"] == "unknown truck" and given["offset"]["value"] is not None


def test_a_new_vehicle_file_names_the_product_of_its_log(
    drive: tuple[Signals, Truth], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive[0].table.write_parquet(tmp_path / "d.parquet")
    assert (
        run(
            [
                "vehicle",
                "new",
                str(tmp_path / "t.toml"),
                "--traffic-side",
                "right",
                "--log",
                str(tmp_path / "d.parquet"),
            ]
        )
        == 0
    )
    assert "show steering ratio times wheelbase, 71." in capsys.readouterr().out


def test_a_product_far_from_the_assumed_one_accuses_no_signal(drive: tuple[Signals, Truth]) -> None:
    """A car's 46 m: the comparison of signals must allow for it as the prior does."""
    found = oc.offset(with_angle(drive[0], 46.0 / PRODUCT_M))
    assert found.offset.status == "valid" and "error" not in codes(found).values()
    assert found.ratio_times_wheelbase.value == pytest.approx(46.0, rel=0.03)


def test_a_product_of_no_truck_is_not_valid(drive: tuple[Signals, Truth]) -> None:
    found = oc.offset(with_angle(drive[0], 27.0 / PRODUCT_M))
    assert found.offset.status != "valid"
    assert codes(found)["unknown_truck"] == "warning"


def test_live_gives_the_first_pass_of_the_desk(drive: tuple[Signals, Truth]) -> None:
    columns = {name: column[:12_000] for name, column in drive[0].columns.items() if name in _core.COLUMNS}
    at_once, monitor = core_of(Vehicle(), drive[0].rate_hz), oc.Monitor(Vehicle(), drive[0].rate_hz)
    at_once.run(columns)
    for k in range(len(columns["time_s"])):
        now = monitor.step(oc.Tick(**{name: float(column[k]) for name, column in columns.items()}))
    assert now.offset_rad == at_once.answer()["offset"]["value"]


def test_the_exported_c_has_the_prior_of_the_product() -> None:
    text = vehicle_source(Vehicle(name="unknown"))
    assert "known_wheelbase_share_sd_1 = 0.3" in text


def test_the_memory_keeps_the_product_and_the_next_drive_starts_from_it(drive: tuple[Signals, Truth]) -> None:
    truck = Vehicle(name="unknown truck")
    _, after = offset_with_memory([drive[0]], truck, TruckMemory(truck.name))
    assert after.ratio_times_wheelbase is not None
    assert after.ratio_times_wheelbase.value == pytest.approx(PRODUCT_M, rel=0.02)
    later = dataclasses.replace(drive[0], log="later", table=drive[0].table[20_000:60_000])
    forgotten = dataclasses.replace(after, drives=())
    answer, _ = offset_with_memory([later], truck, forgotten)
    alone = oc.offset(later, truck)
    assert answer.vehicle.ratio_times_wheelbase_m == pytest.approx(after.ratio_times_wheelbase.value, rel=0.02)
    assert alone.vehicle.ratio_times_wheelbase_m == pytest.approx(100.0)


def test_a_late_yaw_rate_bias_acts_by_the_fitted_product_of_an_unknown_truck() -> None:
    """The truck has 0.6 of the assumed product, and the yaw rates of its drive were corrected by 0.1 deg/s too little:
    corrected by the assumed product alone, the offset is 0.09 deg off (median)."""
    bias, share = 0.1 * DEGREE, -0.4
    left = []
    for seed in range(5, 11):
        true = driven_by_hypothesis(seed, Play(), 300)
        true = dataclasses.replace(true, residual=true.residual + share * RATIO_TIMES_WHEELBASE * true.curvature)
        late = dataclasses.replace(
            true,
            residual=true.residual - RATIO_TIMES_WHEELBASE * bias * true.per_speed,
            curvature=true.curvature + bias * true.per_speed,
        )
        wrong, right = (Learner(Play(), 0.1) for _ in range(2))
        for learner in (wrong, right):
            learner.design.known.product_doubt = 0.6
            learner.design.known.wheelbase.information = (0.05 / 0.3) ** 2
        wrong.learn(late)
        right.learn(true)
        lib.oc_hypothesis_correct(wrong.h, wrong.design, bias)
        wrong.solve()
        assert right.h.wheelbase == pytest.approx(share, abs=0.02)
        left.append(abs(wrong.h.offset - right.h.offset))
    assert np.median(left) < 0.03 * DEGREE


@pytest.mark.parametrize("name", OXTS_DEG)
def test_the_interval_of_a_real_car_without_its_numbers_holds_the_reference(name: str) -> None:
    genesis = oc.vehicle(Path(__file__).parents[1] / "examples" / "genesis.toml")
    signals = oc.read(real_drive(f"genesis/{name}.csv.gz"), names=genesis.signal_names)
    answer = oc.offset(signals)
    assert answer.offset.ci95 is not None
    assert answer.offset.ci95[0] < OXTS_DEG[name] * DEGREE < answer.offset.ci95[1]


def test_most_of_the_short_drives_of_the_car_are_narrow_with_its_gates_and_play_alone() -> None:
    given = tomllib.loads((Path(__file__).parents[1] / "examples" / "genesis.toml").read_text(encoding="utf-8"))
    unknown = vehicle_from({key: given[key] for key in given.keys() - {"wheelbase_m", "steering_ratio"}}, "car.toml")
    assert unknown.assumed == ("wheelbase_m", "steering_ratio")
    wide = []
    for name in OXTS_DEG:
        answer = oc.offset(oc.read(real_drive(f"genesis/{name}.csv.gz"), names=unknown.signal_names), unknown)
        assert answer.offset.ci95 is not None and answer.offset_half_width_rad is not None
        assert answer.offset.ci95[0] < OXTS_DEG[name] * DEGREE < answer.offset.ci95[1]
        wide += [name] if answer.offset_half_width_rad > 5.0 * DEGREE else []
    assert len(wide) <= 2
