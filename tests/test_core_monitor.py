"""Figure 15 by the public interface: symmetries, chunks, missing and damaged signals, no NaN."""

import itertools
import math
import struct
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_drives import RATIO, WHEELBASE, Array, damaged, drive

from oncenter import _core
from oncenter._native import lib

RATE_HZ = 100.0
ANGLE, YAW_RATE, SPEED, ACCELERATION, *WHEELS = (name for name in _core.COLUMNS if name != "time_s")


def core_of(rate_hz: float = RATE_HZ, **params: float) -> _core.Core:
    return _core.Core(WHEELBASE, RATIO, params, rate_hz)


def after(columns: Mapping[str, Array], rate_hz: float = RATE_HZ, **params: float) -> _core.Core:
    core = core_of(rate_hz, **params)
    core.run(columns)
    return core


def numbers(answer: Any) -> Iterator[float]:
    if isinstance(answer, dict | list | tuple):
        for value in answer.values() if isinstance(answer, dict) else answer:
            yield from numbers(value)
    else:
        yield answer


def status(estimate: dict[str, Any]) -> str:
    return str(_core.STATUSES[estimate["status"]])


def sliced(columns: Mapping[str, Array], rows: slice) -> dict[str, Array]:
    return {name: values[rows] for name, values in columns.items()}


def straight(seconds: float = 60.0, rate_hz: float = RATE_HZ, **constant: float) -> dict[str, Array]:
    """Straight driving at 20 m/s, with the given columns."""
    t = np.arange(int(seconds * rate_hz)) / rate_hz
    values = {ANGLE: 0.0356, YAW_RATE: 0.0, SPEED: 20.0, ACCELERATION: 0.0} | constant
    return {"time_s": t} | {name: np.full_like(t, value) for name, value in values.items()}


@pytest.fixture(scope="module")
def whole() -> dict[str, Array]:
    return drive(1, RATE_HZ, 200.0)


def test_the_answer_is_near_the_truth(whole: dict[str, Array]) -> None:
    answer = after(whole).answer()
    assert answer["offset"]["value"] == pytest.approx(0.035, abs=math.radians(0.3))
    assert answer["understeer_gradient"]["value"] == pytest.approx(0.007, rel=0.1)
    assert status(answer["offset"]) == status(answer["understeer_gradient"]) == "valid"


def test_a_mirrored_drive_has_the_mirrored_offset(whole: dict[str, Array]) -> None:
    mirrored = whole | {name: -whole[name] for name in (ANGLE, YAW_RATE, ACCELERATION)}
    there, back = after(whole).answer(), after(mirrored).answer()
    assert back["offset"]["value"] == -there["offset"]["value"] != 0.0
    assert back["offset"]["standard_deviation"] == there["offset"]["standard_deviation"]
    assert back["understeer_gradient"]["value"] == there["understeer_gradient"]["value"] != 0.0
    assert back["rejected"] == there["rejected"]


@pytest.mark.parametrize("c", [0.1, -0.3])  # from 20 deg on, the first standstill counts less
def test_a_sensor_turned_on_its_shaft_turns_the_offset_as_much(whole: dict[str, Array], c: float) -> None:
    there, back = after(whole).answer(), after(whole | {ANGLE: whole[ANGLE] + c}).answer()
    assert back["offset"]["value"] - there["offset"]["value"] == pytest.approx(c, abs=1e-12)
    assert back["understeer_gradient"]["value"] == pytest.approx(there["understeer_gradient"]["value"], abs=1e-12)
    assert back["offset"]["standard_deviation"] == pytest.approx(there["offset"]["standard_deviation"], rel=1e-6)


def test_a_gyro_bias_moves_the_offset_by_the_mean_of_iL_over_v() -> None:
    """(45), (48) without understeer: only the yaw rate changes, and the gate stays open."""
    b = 2e-4
    params = {"understeer_evidence_min_s": 1e5}
    columns = straight(**{ACCELERATION: 0.02}) | {SPEED: np.linspace(15.0, 25.0, 6000)}
    there = after(columns, **params).answer()
    back = after(columns | {YAW_RATE: columns[YAW_RATE] + b}, **params).answer()
    assert there["used"] == back["used"] > 50
    per_bias = there["offset_per_yaw_rate_bias"]
    assert per_bias == pytest.approx(RATIO * WHEELBASE / 20.0, rel=0.05)
    assert back["offset"]["value"] - there["offset"]["value"] == pytest.approx(-per_bias * b, rel=1e-9)


def test_a_late_understeer_gradient_applies_to_all_evidence(whole: dict[str, Array]) -> None:
    answer = after(whole).answer()
    never = after(whole, understeer_evidence_min_s=1e5).answer()
    assert answer["used"] == never["used"]
    crown = 0.1  # m/s^2, of random_drives
    moved = never["offset"]["value"] - answer["offset"]["value"]
    assert moved == pytest.approx(answer["understeer_gradient"]["value"] * RATIO * crown, rel=0.5)


def stepped(core: _core.Core, columns: Mapping[str, Array]) -> list[dict[str, Any]]:
    names, rows = list(columns), np.column_stack(list(columns.values())).tolist()
    return [core.step(dict(zip(names, row, strict=True))) for row in rows]


@pytest.mark.parametrize("seed", [0, 1])
def test_a_run_is_its_chunks_is_its_steps(seed: int) -> None:
    columns = damaged(drive(seed, 50.0, 150.0), seed)
    count = len(columns["time_s"])
    whole, chunks, steps = core_of(50.0), core_of(50.0), core_of(50.0)
    outputs = np.zeros(count, _core.OUTPUT_DTYPE)
    whole.run(columns, outputs)
    cuts = [0, *sorted(np.random.default_rng(seed).integers(0, count, 20).tolist()), count]
    for start, stop in itertools.pairwise(cuts):
        chunks.run(sliced(columns, slice(start, stop)))
    singly = stepped(steps, columns)
    assert whole.state_bytes() == chunks.state_bytes() == steps.state_bytes()
    assert whole.answer() == steps.answer()
    assert [list(numbers(tick)) for tick in singly] == [list(numbers(row)) for row in outputs.tolist()]


@settings(max_examples=10)
@given(cut=st.floats(0.0, 1.0))
def test_a_copied_state_continues_identically(whole: dict[str, Array], cut: float) -> None:
    rows = int(cut * len(whole["time_s"]))
    first, second = after(sliced(whole, slice(0, rows))), core_of()
    second.copy_state_from(first)
    second.run(sliced(whole, slice(rows, None)))
    assert second.state_bytes() == after(whole).state_bytes()


@pytest.mark.parametrize(("rate_hz", "pieces"), [(20.0, 3), (24.9, 3), (31.0, 2), (50.0, 1), (100.0, 1), (200.0, 1)])
def test_each_tick_does_its_pieces_of_deferred_work_and_none_waits_for_a_second(rate_hz: float, pieces: int) -> None:
    """The pieces are those of the gyro's filter, the hypotheses and the torque."""
    columns = drive(1, rate_hz, 40.0)
    columns |= dict.fromkeys(WHEELS, columns[SPEED]) | {"steering_wheel_torque_nm": 2.0 * columns[ACCELERATION]}
    columns |= {"steering_assist_active": 0.0 * columns[SPEED]}  # it drops the work of the hypotheses, as a hole does
    core = _core.Core(WHEELBASE, RATIO, {}, rate_hz, method="joint")
    before, begun = np.zeros(3, int), np.zeros(3, int)
    for k in range(len(columns["time_s"])):
        core.step({name: column[k] for name, column in columns.items()})
        state = core.state()
        parts = state["evidence"]["gyro_bias"], state["tracking"]["joint"], state["evidence"]["torque"]
        due = np.array([part["due"] for part in parts])
        begins = due > before
        done = np.where(begins, before, before - due)
        assert done.sum() == min(pieces, before.sum())
        assert before[0] == 0 or done[0] > 0  # the gyro's filter comes first
        begun += begins
        before = due
    assert (begun >= 15).all()


def test_a_query_changes_nothing(whole: dict[str, Array]) -> None:
    core = after(sliced(whole, slice(0, 12_345)))
    before = core.state_bytes()
    assert core.answer() == core.answer()
    assert core.state_bytes() == before


@pytest.mark.parametrize("time_s", [math.nan, math.inf, -math.inf, 59.99, 12.0, -1.0])
def test_time_that_does_not_increase_changes_only_its_count(time_s: float) -> None:
    columns = straight()
    core, other = after(columns), after(columns)
    out = core.step({"time_s": time_s, ANGLE: 5.0, YAW_RATE: 1.0, SPEED: 3.0, ACCELERATION: 9.0})
    assert out["reasons"] == lib.OC_REASON_TIME
    before, now = other.answer(), core.answer()
    assert now["rejected"][1] == pytest.approx(1 / RATE_HZ)
    now["rejected"][1] = 0.0
    assert now == before
    following = {name: values[-1:] + (0.01 if name == "time_s" else 0.0) for name, values in columns.items()}
    core.run(following)
    other.run(following)
    assert core.answer()["offset"] == other.answer()["offset"]
    assert core.answer()["used"] == other.answer()["used"]


@pytest.mark.parametrize("name", [ANGLE, YAW_RATE, SPEED, ACCELERATION])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e308, -1e4])
def test_an_invalid_signal_is_counted_and_not_used(name: str, value: float) -> None:
    columns = straight()
    columns[name][3000] = value
    core = core_of()
    outputs = np.zeros(6000, _core.OUTPUT_DTYPE)
    core.run(columns, outputs)
    answer = core.answer()
    assert outputs["reasons"][3000] == lib.OC_REASON_MISSING_SIGNAL
    assert np.count_nonzero(outputs["reasons"] & lib.OC_REASON_MISSING_SIGNAL) == 1
    assert answer["rejected"][0] == pytest.approx(1 / RATE_HZ)
    assert answer["offset"]["value"] == pytest.approx(0.0356, abs=1e-14)
    assert all(map(math.isfinite, numbers(answer)))


@pytest.mark.parametrize("name", [ANGLE, YAW_RATE, SPEED, ACCELERATION])
def test_a_missing_column_is_a_missing_signal_on_every_tick(name: str) -> None:
    answer = after({key: values for key, values in straight().items() if key != name}).answer()
    assert answer["rejected"][0] == answer["unused"] == answer["duration"] == pytest.approx(60.0)
    assert status(answer["offset"]) == "unobservable"


def test_a_hole_restarts_the_filters_and_drops_pending_ticks() -> None:
    columns = straight(30.0)
    kept = np.ones(3000, bool)
    kept[1500:1520] = False
    core = core_of()
    outputs = np.zeros(2980, _core.OUTPUT_DTYPE)
    core.run({name: values[kept] for name, values in columns.items()}, outputs)
    design = core.coefficients()["preprocess"]
    settling = 10 * design["slope_every"] + design["delay_ticks"]
    assert outputs["reasons"][1500] == lib.OC_REASON_GAP | lib.OC_REASON_SETTLING
    assert (outputs["reasons"][1501 : 1500 + settling] == lib.OC_REASON_SETTLING).all()
    assert (outputs["reasons"][1500 + settling :] == 0).all()
    answer = core.answer()
    used = sum((run - settling) // 10 - 20 for run in (1500, 1480)) / 10  # s: whole blocks less t1, each
    assert answer["used"] == pytest.approx(used)
    assert answer["rejected"][8] == pytest.approx(29.8 - 2 * settling / RATE_HZ - used)


def test_a_short_hole_is_no_gap() -> None:
    columns = straight(30.0)
    kept = np.ones(3000, bool)
    kept[1500:1505] = False
    assert after({name: values[kept] for name, values in columns.items()}).answer()["rejected"][2] == 0.0


def test_while_the_filters_settle_there_is_no_braking_reason() -> None:
    """After a hole on a straight the only reasons are those of the hole."""
    columns = straight(20.0)
    columns["time_s"][1000:] += 5.0
    rejected = dict(zip(_core.REASONS, after(columns).answer()["rejected"], strict=True))
    assert {name for name, seconds in rejected.items() if seconds} == {"gap", "settling", "window"}


def test_ignition_loses_pending_ticks_and_keeps_the_evidence() -> None:
    core = after(straight())
    before = core.answer()
    core.restart()
    assert core.answer()["offset"] == before["offset"]
    assert core.answer()["offset_temporary"] == before["offset"]["value"]
    again = straight(30.0, **{ANGLE: 0.05})  # its time starts at zero again
    core.run(again)
    answer = core.answer()
    alone = after(again).answer()
    assert answer["used"] == pytest.approx(before["used"] + alone["used"])
    mean = (before["used"] * 0.0356 + alone["used"] * 0.05) / answer["used"]
    assert answer["offset"]["value"] == pytest.approx(mean, rel=1e-12)
    assert answer["rejected"][1] == answer["rejected"][2] == 0.0


def test_the_temporary_offset_includes_pending_ticks_to_the_last_one() -> None:
    """Another angle in the last clean ticks affects only the temporary offset."""
    columns = straight(20.0)
    columns[ANGLE][-105:] += 0.1
    answer = after(columns).answer()
    assert answer["offset"]["value"] == pytest.approx(0.0356, abs=1e-14)
    delay = lib.oc_lowpass_delay(3.0, 2.0, RATE_HZ) * RATE_HZ
    clean = answer["used"] * RATE_HZ + answer["rejected"][8] * RATE_HZ
    assert answer["offset_temporary"] - 0.0356 == pytest.approx(0.1 * (105 - delay) / clean, rel=1e-6)


def test_one_wrong_time_stamp_costs_a_second() -> None:
    """A time far ahead counts as a hole. Then the clock seems set back, and a second in order confirms it."""
    columns = straight(60.0)
    undisturbed = after(columns).answer()
    columns["time_s"][2000] = 1e9
    answer = after(columns).answer()
    assert answer["rejected"][1] == pytest.approx(1.0, abs=0.02)
    assert undisturbed["used"] - 8.0 < answer["used"] < undisturbed["used"]
    assert answer["offset"]["value"] == pytest.approx(0.0356, abs=1e-12)


def test_a_clock_that_is_set_back_after_a_wrong_rate_begins_anew() -> None:
    """The first second shows the wrong rate, 14 s are rejected for it, and a second in order confirms the new clock."""
    columns = straight(40.0)
    columns["time_s"][:1500] *= 3.0
    answer = after(columns).answer()
    assert answer["rejected"][1] == pytest.approx(15.0, abs=0.02)


def test_time_stamps_in_disorder_never_become_a_new_clock() -> None:
    columns = straight(20.0)
    columns["time_s"][1::2] = columns["time_s"][0:-1:2] - 5.0  # every other one is five seconds late
    answer = after(columns).answer()
    assert answer["rejected"][1] == pytest.approx(10.0)


def test_the_longest_hole_is_bridged_whatever_the_last_bit_of_its_time_stamps() -> None:
    for start in range(0, 100):
        columns = {name: np.delete(column, slice(1000, 1009)) for name, column in straight(20.0).items()}
        columns["time_s"] = columns["time_s"] + start / 7.0
        assert after(columns).answer()["rejected"][2] == 0.0


def test_after_a_hole_a_standstill_settles_again() -> None:
    """The truck may have moved in the hole, so a new stop follows."""
    stand = straight(2.0, **{SPEED: 0.0, YAW_RATE: 0.004})
    whole = after(stand).answer()["yaw_rate_bias"]["evidence"]
    stand["time_s"][100:] += 1.0
    assert after(stand).answer()["yaw_rate_bias"]["evidence"] == pytest.approx(whole - 0.2)


def test_missing_signals_change_nothing() -> None:
    core = after(straight())
    before = core.state_bytes()
    core.run(straight(0.0))
    assert core.state_bytes() == before
    fresh = core_of()
    assert fresh.answer()["duration"] == 0.0
    assert all(map(math.isfinite, numbers(fresh.answer())))


def test_a_run_shorter_than_the_clean_time_is_not_used() -> None:
    design = core_of().coefficients()["preprocess"]
    settling = 10 * design["slope_every"] + design["delay_ticks"]
    for extra, used in ((209, 0.0), (210, 0.1)):
        answer = after(sliced(straight(), slice(0, settling + extra))).answer()
        assert answer["used"] == pytest.approx(used)
        assert answer["rejected"][8] == pytest.approx((extra - used * RATE_HZ) / RATE_HZ)


@pytest.mark.parametrize("rate_hz", [20.0, 128.7, 200.0])
def test_used_and_unused_are_the_whole_duration(rate_hz: float) -> None:
    columns = damaged(drive(2, rate_hz, 150.0), 2)
    core = core_of(rate_hz)
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core.run(columns, outputs)
    answer = core.answer()
    forward = (outputs["reasons"] & lib.OC_REASON_TIME) == 0
    assert answer["duration"] == pytest.approx(np.sum(forward) / rate_hz)
    assert answer["used"] + answer["unused"] == pytest.approx(answer["duration"])
    clean = np.sum(outputs["reasons"] == 0) / rate_hz
    assert answer["rejected"][8] == pytest.approx(clean - answer["used"])
    assert answer["offset"]["evidence"] == answer["used"] > 10


def reasons_of(columns: dict[str, Array], **params: float) -> npt.NDArray[np.uint32]:
    outputs = np.zeros(len(columns["time_s"]), _core.OUTPUT_DTYPE)
    core_of(**params).run(columns, outputs)
    return np.asarray(outputs["reasons"])


@pytest.mark.parametrize(
    ("reason", "constant"),
    [
        ("speed", {SPEED: 9.9}),
        ("curvature", {YAW_RATE: 0.03, ACCELERATION: 0.6}),
        ("bank", {ACCELERATION: 0.35}),
        ("missing_signal", {ANGLE: math.nan}),
        ("settling", {}),
    ],
)
def test_each_reason_is_given_under_its_condition(reason: str, constant: dict[str, float]) -> None:
    reasons = reasons_of(straight(5.0, **constant))
    bit = _core.REASONS[reason]
    if reason == "settling":
        assert reasons[0] == bit
        assert not (reasons[200:]).any()
    else:
        assert (reasons[200:] == bit).all()


def test_braking_closes_the_gate() -> None:
    columns = straight(10.0)
    for braking, reason in ((0.31, lib.OC_REASON_LONGITUDINAL_ACCELERATION), (0.29, 0)):
        columns[SPEED] = 25.0 - braking * columns["time_s"]
        assert (reasons_of(columns)[300:] == reason).all()


def test_all_reasons_have_names_and_are_reached(whole: dict[str, Array]) -> None:
    assert list(_core.REASONS.values()) == [1 << k for k in range(lib.OC_REASON_COUNT)]
    columns = damaged(whole, 1)
    columns[ACCELERATION] = columns[ACCELERATION] + 0.2
    answer = after(columns).answer()
    reached = {name for name, seconds in zip(_core.REASONS, answer["rejected"], strict=True) if seconds > 0}
    assert reached == set(oracle.REASONS)  # the others are of other methods


def test_a_bank_always_above_the_limit_is_reported() -> None:
    """The Genesis drives have one: an accelerometer bias of 0.6 m/s^2 closes the gate permanently."""
    answer = after(straight(**{ACCELERATION: -0.6})).answer()
    assert answer["used"] == 0.0
    assert status(answer["offset"]) == "unobservable"
    assert answer["bank_mean"] == pytest.approx(-0.6)
    assert answer["bank_time"] == pytest.approx(answer["rejected"][7], abs=1.2)


def test_a_standstill_at_the_end_counts_like_one_at_the_start() -> None:
    """5.3.1: the interval includes a gyro bias from any standstill of the drive."""
    stand = straight(3.0, **{SPEED: 0.0, YAW_RATE: 0.004})
    go = straight(**{YAW_RATE: 0.004})

    def joined(first: dict[str, Array], second: dict[str, Array]) -> dict[str, Array]:
        both = {name: np.concatenate([first[name], second[name]]) for name in first}
        return both | {"time_s": np.arange(len(both["time_s"])) / RATE_HZ}

    before, after_it = after(joined(stand, go)).answer(), after(joined(go, stand)).answer()
    assert before["yaw_rate_bias"] == after_it["yaw_rate_bias"]
    widths = [answer["offset"]["standard_deviation"] for answer in (before, after_it)]
    assert widths[0] == pytest.approx(before["offset_per_yaw_rate_bias"] * 0.004, rel=0.05)
    assert widths[1] == pytest.approx(widths[0], rel=0.02)


def cornering(seed: int, straight_a_y: float, bend_a_y: tuple[float, float], noise: float = 0.02) -> dict[str, Array]:
    """40 s straight at a constant lateral acceleration, a minute of left-hand bends; K_us 0.007, offset 0.035."""
    rng = np.random.default_rng(seed)
    count = 10_000
    t = np.arange(count) / RATE_HZ
    a_y = np.where(t < 40.0, straight_a_y, np.interp(t, np.arange(0, 101, 5), rng.uniform(*bend_a_y, 21)))
    v = 20.0
    r = a_y / v
    angle = 0.035 + RATIO * (WHEELBASE * r / v + 0.007 * a_y)
    wobble = np.interp(t, np.arange(0, 102), noise * rng.standard_normal(102))
    return {"time_s": t, ANGLE: angle + wobble, YAW_RATE: r, SPEED: np.full(count, v), ACCELERATION: a_y}


def test_bends_similar_to_the_straights_leave_the_gradient_unobservable() -> None:
    """Always the same lateral acceleration: K_us and offset are not separable, and K_us = 0 is no result."""
    answer = after(cornering(0, 0.35, (0.36, 0.42), noise=0.002)).answer()
    assert answer["understeer_gradient"]["evidence"] > 10.0
    assert status(answer["understeer_gradient"]) == "unobservable"
    assert abs(answer["offset"]["value"] - 0.035) < 1.96 * answer["offset"]["standard_deviation"]


@pytest.mark.parametrize("straight_a_y", [0.05, 0.4])
def test_the_intervals_hold_the_truth_at_their_nominal_rate(straight_a_y: float) -> None:
    """Where straights resemble bends, offset and K_us have common errors, which both intervals include."""
    held = {"offset": 0, "understeer_gradient": 0}
    drives = 60
    for seed in range(drives):
        answer = after(cornering(seed, straight_a_y, (0.45, 0.9)), yaw_rate_bias_sd_rad_s=0.0).answer()
        for name, truth in (("offset", 0.035), ("understeer_gradient", 0.007)):
            held[name] += abs(answer[name]["value"] - truth) < 1.96 * answer[name]["standard_deviation"]
    assert min(held.values()) >= 0.85 * drives, held


DOUBLES = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.binary(min_size=8, max_size=8).map(lambda raw: struct.unpack("d", raw)[0]),
    st.sampled_from([0.0, -0.0, 5e-324, 1e308, -1e308, 149.9, 99.99, 9.99, -9.99, 20.0, 0.05, 1e-310]),
)
TICKS = st.lists(st.tuples(DOUBLES, DOUBLES, DOUBLES, DOUBLES), max_size=60)


@settings(max_examples=200)
@given(ticks=TICKS, repeats=st.integers(1, 40), accelerometer=st.integers(0, 1), rate_hz=st.sampled_from([20.0, 200.0]))
def test_no_input_gives_a_nan(
    ticks: list[tuple[float, float, float, float]], repeats: int, accelerometer: int, rate_hz: float
) -> None:
    core = core_of(
        rate_hz, use_accelerometer=accelerometer, clean_time_s=0.1, batch_s=0.1, speed_slope_window_s=0.2,
        speed_min_m_s=1.0, curvature_max_1_m=0.1, bank_max_m_s2=10.0, longitudinal_acceleration_max_m_s2=10.0,
        offset_evidence_min_s=0.0, understeer_evidence_min_s=0.0, standstill_settling_s=0.0, standstill_time_min_s=0.1,
    )  # fmt: skip
    rows = np.repeat(np.array(ticks, float).reshape(-1, 4), repeats, axis=0)
    columns = {"time_s": np.arange(len(rows)) / rate_hz} | dict(
        zip((ANGLE, YAW_RATE, SPEED, ACCELERATION), rows.T, strict=True)
    )
    outputs = np.zeros(len(rows), _core.OUTPUT_DTYPE)
    core.run(columns, outputs)
    answer = core.answer()
    assert all(map(math.isfinite, numbers(answer)))
    for name in ("offset", "offset_sd", "understeer_gradient", "vehicle_speed"):
        assert np.isfinite(outputs[name]).all()
    assert answer["used"] + answer["unused"] == pytest.approx(answer["duration"])


@settings(max_examples=200)
@given(times=st.lists(DOUBLES, max_size=100))
def test_no_time_gives_a_nan(times: list[float]) -> None:
    columns = straight(len(times) / RATE_HZ + 1.0) | {"time_s": np.array(times, float)}  # sliced to one length
    answer = after(sliced(columns, slice(0, len(times)))).answer()
    assert all(map(math.isfinite, numbers(answer)))
    assert answer["duration"] + answer["rejected"][1] == pytest.approx(len(times) / RATE_HZ)


def test_all_enum_values_have_names_and_no_others() -> None:
    assert _core.STATUSES == ("unobservable", "converging", "valid", "invalid")
    assert len(_core.REASONS) == lib.OC_REASON_COUNT
    assert not lib.oc_reason_name(3)
