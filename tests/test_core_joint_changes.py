"""What changes in a drive, as the bank of hypotheses has it: found with size and time, and learned anew."""

import itertools
from typing import Any

import numpy as np
import pytest
from joint_drives import (
    ANGLE,
    CREEPING,
    DEGREE,
    DURATION_S,
    LIFTED,
    RATE_HZ,
    YAW_RATE,
    answer_of,
    core_for,
    driven,
    holds,
    ran,
    status,
)

from oncenter import _core
from oncenter._native import lib


@pytest.mark.parametrize("step", [5.0, -3.0])
def test_a_remounted_sensor_is_found_within_a_minute_with_its_size_and_time(step: float) -> None:
    """On most drives: the play is not found by then on some, and on others the truck drives straight on meanwhile."""
    found_well = 0
    for seed in range(1, 9):
        columns, truth = driven(CREEPING, seed)
        moved = columns | {ANGLE: columns[ANGLE] + np.where(columns["time_s"] > 600.0, step * DEGREE, 0.0)}
        core = core_for(truth)
        outputs = ran(moved, core)
        found = core.answer()
        assert holds(found["offset"], truth.offset_rad + step * DEGREE) or status(found["offset"]) == "converging"
        late = outputs["offset"][66_500:] - truth.offset_rad
        found_well += (
            found["changes"] == 1
            and is_remount(found["changed"][0], truth.offset_rad, step * DEGREE)
            and np.abs(outputs["offset"] - truth.offset_rad)[59_000:60_100].max() < 0.3 * DEGREE
            and np.abs(late - step * DEGREE).max() < 1.0 * DEGREE
            and late[-1] == pytest.approx(step * DEGREE, abs=0.4 * DEGREE)
        )
    assert found_well >= 5


def is_remount(change: Any, before: float, step: float) -> bool:
    """After 600 s, from there on, of that size."""
    return bool(
        change["change"]["kind"] == lib.OC_CHANGE_OFFSET
        and change["before"] == pytest.approx(before, abs=0.3 * DEGREE)
        and change["change"]["size"] == pytest.approx(step, abs=0.5 * DEGREE)
        and change["time"] == pytest.approx(600.0, abs=20.0)
    )


def test_nothing_is_found_where_nothing_changed() -> None:
    for seed in range(1, 21):
        assert answer_of(*driven(CREEPING if seed % 2 else "", seed))["changes"] == 0, f"seed {seed}"


def test_a_sender_that_takes_ten_degrees_out_by_itself_is_learned_anew_where_it_rests() -> None:
    """Within two minutes: on some drives a drift, until it has rested for five minutes; one change to three. A zero
    that wanders takes some of it, so that the changes need not sum to it."""
    step, told, near, held, at_rest = -10.0 * DEGREE, 0, 0, 0, 0
    for seed in range(1, 17):
        columns, truth = driven(CREEPING, seed, 1500.0)
        taken_out = step * np.clip((columns["time_s"] - 500.0) / 120.0, 0.0, 1.0)
        core = core_for(truth, angle_method="observer")
        faults = ran(columns | {ANGLE: columns[ANGLE] + taken_out}, core)["fault"]
        found = core.answer()
        assert set(faults[:50_000]) == {lib.OC_FAULT_NONE}
        at_rest += set(faults[-5_000:]) == {lib.OC_FAULT_NONE}
        held += holds(found["offset"], truth.offset_rad + step)
        near += abs(found["offset"]["value"] - truth.offset_rad - step) < 0.4 * DEGREE
        assert found["changes"] <= 3
        told += set(faults[70_000:90_000]) == {lib.OC_FAULT_DRIFTING}
    assert near >= 13
    assert held >= 14
    assert at_rest >= 15
    assert told >= 5


def test_a_method_that_cannot_learn_anew_keeps_a_sensor_that_sits_elsewhere_at_fault() -> None:
    columns, truth = driven("", 1, 1800.0)
    moved = 25.0 * DEGREE * np.clip((columns["time_s"] - 600.0) / 40.0, 0.0, 1.0)
    core = core_for(truth, method="thesis", angle_method="observer")
    outputs = ran(columns | {ANGLE: columns[ANGLE] + moved}, core)
    rests = np.flatnonzero(outputs["fault"] == lib.OC_FAULT_REMOUNTED)
    assert len(rests) and core.answer()["changes"] == 0
    off = np.abs(outputs["offset"] - truth.offset_rad - moved)[rests[0] :] > 5.0 * DEGREE
    assert off[:6_000].all()
    assert not (off & (outputs["offset_status"][rests[0] :] == lib.OC_VALID)).any()


def test_an_offset_that_was_moved_is_no_surer_than_the_move_though_the_truck_creeps_or_stands() -> None:
    columns, truth = driven(CREEPING)
    for speed in (0.0, 2.0):
        core = core_for(truth)
        core.run(columns)
        before = core.answer()["offset"]
        change = _core.ffi.new("oc_change *", {"kind": lib.OC_CHANGE_OFFSET, "size": 0.1, "size_sd": 2.0 * DEGREE})
        estimate = _core.ffi.new("oc_estimate *", before)
        lib.oc_joint_note_change(_core.ffi.addressof(core._state.evidence, "joint"), change, estimate, DURATION_S)
        still = {name: np.full(3000, column[-1]) for name, column in columns.items()}
        still |= {name: np.full(3000, speed) for name in still if "speed" in name}
        still |= {"time_s": columns["time_s"][-1] + np.arange(1, 3001) / RATE_HZ, YAW_RATE: np.zeros(3000)}
        core.run(still)
        after = core.answer()["offset"]
        assert after["value"] == pytest.approx(before["value"] + 0.1, abs=0.1 * DEGREE)
        assert after["standard_deviation"] > 1.5 * DEGREE > 3.0 * before["standard_deviation"]
        assert status(after) != "valid"


def test_an_offset_that_has_just_jumped_is_not_valid_before_it_has_stayed() -> None:
    columns, truth = driven(duration_s=1500.0)
    core, ends = core_for(truth), [int(s * RATE_HZ) for s in (0, 1100, 1120, 1500)]
    told = []
    for begin, end in itertools.pairwise(ends):
        core.run({name: column[begin:end] for name, column in columns.items()})
        told.append(status(core.answer()["offset"]))
        if begin == 0:
            core._state.evidence.verdicts.lately -= 1.0 * DEGREE
    assert told == ["valid", "converging", "valid"]


def test_a_lifted_axle_is_told_as_another_load_as_often_as_not_and_rarely_as_another_offset() -> None:
    """Where bends are few it comes too slowly; what gradient and wheelbase learn anew takes the offset along."""
    told, held, moved = [], [], []
    for seed in range(1, 11):
        columns, truth = driven(LIFTED, seed)
        core = core_for(truth)
        outputs = ran(columns, core)
        found = core.answer()
        told += [(change["change"]["kind"], change["time"]) for change in found["changed"][: found["changes"]]]
        moved.append(np.abs(outputs["offset"] - truth.offset_rad)[46_000:].max())
        held.append(holds(found["offset"], truth.offset_rad))
    assert sum(held) >= 9
    assert np.median(moved) < 0.5 * DEGREE
    assert np.sort(moved)[-2] < 1.2 * DEGREE
    assert max(moved) < 2.0 * DEGREE
    as_load = [time for kind, time in told if kind == lib.OC_CHANGE_BENDS]
    assert len(as_load) >= 5
    assert sum(abs(time - 450.0) < 40.0 for time in as_load) >= len(as_load) - 1
    assert len(told) - len(as_load) <= 1


def test_a_suspicion_does_not_keep_a_young_hypothesis_from_learning() -> None:
    """Else it would stay young, the watch would rest, and nothing would be learned ever after."""
    columns, truth = driven(CREEPING)
    core = core_for(truth)
    core.run({name: column[:60_000] for name, column in columns.items()})
    joint = core._state.evidence.joint
    joint.watch.offset.up = 15.0
    for hypothesis in joint.hypotheses[0 : joint.count]:
        hypothesis.age = 100.0
    before = joint.second.used_s
    core.run({name: column[60_000:62_000] for name, column in columns.items()})
    assert joint.second.used_s > before + 5.0
