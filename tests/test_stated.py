"""What a user states is evidence: where a drive contradicts it, that is said, and the answer does not rest on it."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest
from test_core_reach import SPEED, steady
from test_findings import PARAMS, core_says, estimate, findings, parts
from test_statuses import Columns, during, in_a_yard

import oncenter as oc
from oncenter.findings import Finding
from oncenter.offset.stated import without_contradicted, without_inverted_assistance
from oncenter.plausibility import check, statuses
from oncenter.signals import DEGREE, SIGNALS, STATUSES, Signals, Source

CROWN = 0.2  # m/s^2, of the params
EFFECT_DEG = 7.5 * CROWN  # of parts()


def fell(by: float, **others: Any) -> dict[str, Finding]:
    """Findings on roads that fall by that to the side of traffic, the right one, by the neutral acceleration."""
    return findings(traffic_sign=1.0, bank_mean=by, unloading_acceleration=estimate(0.0, 0.01), **others)


def test_a_truck_that_is_said_to_be_set_up_and_is_not_is_a_warning() -> None:
    found = fell(0.25, set_up=True)["set_up_contradicted"]
    assert found.severity == "warning" and found.value == pytest.approx(2.55, abs=0.01)
    assert "'set_up_for_crown' is true" in found.text and "About 0 % is usual then, and 2 % otherwise" in found.text


def test_a_truck_that_is_said_not_to_be_set_up_and_is_is_a_warning() -> None:
    assert fell(-0.05, set_up=False)["set_up_contradicted"].severity == "warning"


@pytest.mark.parametrize("set_up", [False, True])
def test_where_a_set_up_axle_and_a_usual_one_are_possible_it_is_an_info(set_up: bool) -> None:
    assert fell(0.1, set_up=set_up)["set_up_contradicted"].severity == "info"


@pytest.mark.parametrize(("set_up", "by"), [(True, 0.0), (True, -0.2), (False, 0.2), (False, 0.35), (None, 0.0)])
def test_a_right_statement_of_the_set_up_is_not_contradicted(set_up: bool | None, by: float) -> None:
    assert "set_up_contradicted" not in fell(by, set_up=set_up)


def test_a_drive_that_does_not_show_the_neutral_acceleration_contradicts_no_statement() -> None:
    unseen = {"unloading_acceleration": estimate(0.0, 0.05, "converging"), "bank_mean": 0.2}
    assert "set_up_contradicted" not in findings(traffic_sign=1.0, set_up=True, **unseen)


def test_level_roads_leave_an_axle_that_is_set_up_or_a_wrong_side_of_traffic() -> None:
    found = fell(-0.05)["side_or_set_up"]
    assert found.severity == "warning" and found.value == pytest.approx(EFFECT_DEG)
    assert "1.5 deg lower, which its interval allows for" in found.text
    assert "1.5 deg higher, which its interval does not contain" in found.text
    assert fell(0.1)["side_or_set_up"].severity == "info"


def test_roads_that_fall_as_usual_say_nothing_of_side_and_set_up() -> None:
    assert "side_or_set_up" not in fell(0.2)
    assert "side_or_set_up" not in fell(0.0, set_up=True)
    assert "side_or_set_up" not in fell(0.0, offset_parts=parts(0.1) | {"per_acceleration": 0.0})


def test_roads_that_fall_to_the_other_side_are_said_once() -> None:
    found = fell(-0.2)
    assert "roads_fall_to_other_side" in found and "side_or_set_up" not in found


def test_a_set_up_axle_on_a_road_that_hardly_falls_is_no_wrong_side() -> None:
    assert "roads_fall_to_other_side" not in fell(-0.12, set_up=True)


def test_banked_bends_contradict_a_side_of_traffic() -> None:
    found = findings(traffic_sign=1.0, traffic_side=0.0)["roads_fall_to_other_side"]
    assert "slope down to the left" in found.text and "does not use 'traffic_side'" in found.text


@cache
def country() -> tuple[Signals, float, Mapping[str, Any]]:
    """On roads that fall to the right, with banked bends; the offset in deg, and the keys of a right vehicle file."""
    signals, truth = oc.simulate("country", seed=3)
    keys = {"wheelbase_m": truth.equivalent_wheelbase_m, "steering_ratio": truth.steering_ratio}
    keys |= {"play_deg": (truth.backlash_rad + truth.windup_rad) / DEGREE, "play_sd_deg": 0.5}
    return signals, (truth.offset_rad + truth.straight_ahead_rad) / DEGREE, keys | {"traffic_side": "right"}


def answered(**keys: Any) -> oc.Answer:
    signals, _, right = country()
    return oc.offset(signals, oc.Vehicle(**{**right, **keys}))


def codes(answer: oc.Answer) -> set[str]:
    return {finding.code for finding in answer.findings}


STATED = {"set_up_contradicted", "play_contradicted", "side_or_set_up", "roads_fall_to_other_side"}


def test_right_statements_are_not_contradicted() -> None:
    assert not STATED & codes(answered()) and not STATED & codes(answered(set_up_for_crown=False))


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"play_deg": 16.0}, "play_contradicted"),
        ({"play_deg": 0.5}, "play_contradicted"),
    ],
)
def test_an_answer_does_not_rest_on_a_statement_that_its_drive_contradicts(wrong: Mapping[str, Any], code: str) -> None:
    signals, offset_deg, right = country()
    own = {key: value for key, value in right.items() if key not in ("play_deg", "play_sd_deg")}
    without = oc.offset(signals, oc.Vehicle(**own))
    answer = answered(**wrong)
    assert code in codes(answer) and answer.offset.status == "valid" and answer.offset.value is not None
    assert abs(answer.offset.value / DEGREE - offset_deg) < 0.5
    assert answer.offset == without.offset


def test_the_interval_holds_though_a_usual_axle_is_said_to_be_set_up() -> None:
    offset_deg, answer = country()[1] * DEGREE, answered(set_up_for_crown=True)
    assert "set_up_contradicted" in codes(answer) and answer.offset.status == "valid"
    assert answer.offset.ci95 is not None and answer.offset.ci95[0] < offset_deg < answer.offset.ci95[1]


def test_a_side_of_traffic_that_banked_bends_contradict_is_not_used() -> None:
    left, right = answered(traffic_side="left"), answered()
    assert "roads_fall_to_other_side" in codes(left) and left.offset.status == "valid"
    assert left.offset.ci95 is not None and right.offset.ci95 is not None
    width, of_right = (high - low for low, high in (left.offset.ci95, right.offset.ci95))
    assert width < 1.4 * of_right  # resting on the wrong side, twice as wide


def contradicting(stated_deg: float, found_deg: float, sd_deg: float, **others: Any) -> tuple[Finding, ...]:
    vehicle = oc.Vehicle(play_deg=stated_deg, play_sd_deg=0.5, steering_ratio=19.3, wheelbase_m=3.7)
    native = core_says(backlash=estimate(found_deg * DEGREE, sd_deg * DEGREE), **others)
    params = PARAMS | vehicle.params
    found: tuple[Finding, ...] = without_contradicted(native, params, vehicle, lambda other: native)[1]
    return found


def test_a_given_play_is_contradicted_by_three_standard_deviations() -> None:
    assert [found.code for found in contradicting(3.0, 6.0, 0.5)] == ["play_contradicted"]
    assert not contradicting(3.0, 4.9, 0.5) and not contradicting(3.0, 6.0, 1.0)
    assert not contradicting(3.0, 6.0, 0.5, lacking_to_left=2.0)


def log(**columns: float | np.ndarray) -> Signals:
    return logged(steady(**columns))


def logged(columns: Columns) -> Signals:
    sources = {name: Source("bus", 100.0, 6000, 0) for name, of in SIGNALS.items() if of.column in columns}
    return Signals(columns, sources, 100.0, "drive")


def contradicted(signals: Signals) -> list[str]:
    rest, found = statuses.without_contradicted(signals)
    assert all(status in rest.columns or found for status in STATUSES if status in signals.columns)
    assert {each.code for each in found} <= {"status_contradicted"}
    return [status for status in STATUSES if status in signals.columns and status not in rest.columns]


@pytest.mark.parametrize("status", ["stability_control_active", "anti_lock_active"])
def test_an_intervention_most_of_the_time_is_an_inverted_status(status: str) -> None:
    assert contradicted(log(**{status: 1.0 - during(20.0, 23.0)})) == [status]
    assert contradicted(log(**{status: during(20.0, 30.0)})) == []


def test_a_motor_that_steers_a_standing_truck_is_an_inverted_status() -> None:
    speed, assisted = 20.0 * during(10.0, 60.0), during(20.0, 50.0)
    assert contradicted(log(**{SPEED: speed, "steering_assist_active": 1.0 - assisted})) == ["steering_assist_active"]
    assert contradicted(log(**{SPEED: speed, "steering_assist_active": assisted})) == []


def test_a_truck_that_reverses_most_of_the_time_and_turns_as_forward_has_an_inverted_status() -> None:
    columns, backward = in_a_yard()
    assert contradicted(logged(columns | {"reverse": 1.0 - backward})) == ["reverse"]
    assert contradicted(logged(columns | {"reverse": backward})) == []
    mostly, backward = in_a_yard(40.0, 350.0)
    assert contradicted(logged(mostly | {"reverse": backward})) == []


def test_a_contradicted_status_is_said_by_the_check_of_the_signals_as_well() -> None:
    found = check(log(anti_lock_active=1.0 - during(20.0, 23.0))).findings
    assert [each.code for each in found if "anti_lock_active" in each.text] == ["status_contradicted"]


def played(deg: float, sd_deg: float = 0.3) -> Any:
    return core_says(backlash=estimate(deg * DEGREE, sd_deg * DEGREE))


@pytest.mark.parametrize(("unassisted", "assisted", "is_inverted"), [(4.0, 7.0, True), (7.0, 4.0, False)])
def test_a_hand_that_rests_while_a_motor_steers_shows_less_play(
    unassisted: float, assisted: float, is_inverted: bool
) -> None:
    long = {"time_s": np.arange(20_000) / 100.0, "steering_assist_active": np.repeat([0.0, 1.0], 10_000)}
    logs, found = without_inverted_assistance(played(unassisted), (logged(long),), lambda some: played(assisted))
    assert (found is not None) is is_inverted
    assert ("steering_assist_active" in logs[0].columns) is not is_inverted


def test_a_log_that_ends_soon_after_an_assistance_has_an_answer() -> None:
    """Within the second that the hypotheses would begin with."""
    signals, _, right = country()
    columns = {name: values[:60_000] for name, values in signals.columns.items()}
    columns["steering_assist_active"] = np.repeat([0.0, 1.0, 0.0], [59_000, 920, 80])
    source = {"steering_assist_active": next(iter(signals.sources.values()))}
    answer = oc.offset(signals.replaced(columns, {**signals.sources, **source}), oc.Vehicle(**right))
    assert answer.offset.value is not None and len(answer.rows) == 1
