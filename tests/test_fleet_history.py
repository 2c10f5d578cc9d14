"""A truck's drives over time: a change of two degrees is found, and what did not change is left alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from truck_rows import DAY_S, MONDAY_S, drive_row

from oncenter.fleet.history import Readings, drift
from oncenter.fleet.offset_now import Offset
from oncenter.fleet.ranking import OfTruck, histories, rank, within
from oncenter.fleet.undecided import would_decide
from oncenter.fleet.verdict import state_of
from oncenter.signals import DEGREE
from oncenter.truck.now import Change, truck_now, trucks_now
from oncenter.truck.priors import priors_of


def readings(values: np.ndarray, sd: float | np.ndarray = 0.5) -> Readings:
    count = len(values)
    return Readings(MONDAY_S + DAY_S * np.arange(count), values, np.full(count, sd, np.float64))


# -- a night


def changes_of(plays_deg: np.ndarray, sds_deg: np.ndarray) -> tuple[Change, ...]:
    """Of a truck with an unchanged offset and drives of these plays."""
    rows = [
        drive_row(day, 0.5, play_deg=play, sds=(0.1, sd, 0.02))
        for day, (play, sd) in enumerate(zip(plays_deg, sds_deg, strict=True))
    ]
    return truck_now(rows, (), priors_of()).changes


def test_a_single_outlying_drive_is_not_a_change() -> None:
    plays = np.full(12, 4.0)
    plays[6] = 10.0
    assert changes_of(plays, np.full(12, 0.3)) == ()


def test_a_change_that_hangs_on_one_drive_waits_for_another() -> None:
    sd = np.array([0.4] * 6 + [0.4, 2.5, 2.5])
    play = np.array([4.0] * 6 + [10.0, 4.5, 4.0])
    assert changes_of(play, sd) == ()
    assert [change.at for change in changes_of(np.append(play, 10.0), np.append(sd, 0.4))] in ([6], [9])


def test_play_that_differs_by_little_never_changed_and_one_that_differs_by_much_did() -> None:
    for step, found in ((0.7, []), (3.0, [6])):
        plays = np.repeat([4.0, 4.0 + step], 6)
        assert [change.at for change in changes_of(plays, np.full(12, 0.3))] == found


def test_an_interval_of_a_changes_size_covers_the_truth_as_often_as_it_says() -> None:
    random, priors = np.random.default_rng(6), priors_of()
    fleet = []
    for _ in range(300):
        sds = random.uniform(0.3, 0.9, 24)
        walk = np.cumsum(random.normal(0.0, priors.play_day_sd_rad / DEGREE, 24))
        own = np.hypot(sds, priors.play_noise_sd_rad / DEGREE) * random.normal(size=24)
        plays = 4.0 + walk + own + np.where(np.arange(24) < 12, 0.0, 5.0)
        fleet.append([drive_row(k, 0.5, play_deg=plays[k], sds=(0.1, sds[k], 0.02)) for k in range(24)])
    covered = []
    for truck, rows in zip(trucks_now(fleet, [priors] * 300), fleet, strict=True):
        assert len(rows) == 24 and len(truck.changes) == 1
        (change,) = truck.changes
        covered.append(abs(change.size - 5.0 * DEGREE) < 1.96 * change.sd)
    assert 0.9 <= np.mean(covered) <= 0.995


def test_a_drift_is_its_slope_with_an_interval_that_covers_it() -> None:
    random = np.random.default_rng(7)
    covered = []
    for _ in range(300):
        value = 0.02 * np.arange(20) + np.hypot(0.3, 0.5) * random.normal(0.0, 1.0, 20)
        found = drift(readings(value), 0)
        assert found is not None
        covered.append(abs(found[0] - 0.02) < 1.96 * found[1])
    assert 0.92 <= np.mean(covered) <= 0.99
    assert drift(readings(np.zeros(3)), 0) is None


def test_a_gyro_whose_bias_moved_with_the_offset_is_its_cause() -> None:
    """A replaced gyro is named where its bias moved by more than the drives scatter, and not where it did not."""
    random = np.random.default_rng(9)
    for moved, size in ((True, 0.3), (False, 0.0), (False, 0.08)):
        value = random.normal(0.0, 0.04, 12) + np.where(np.arange(12) < 6, 0.0, size)
        assert readings(value, 0.02).moved(MONDAY_S + 6 * DAY_S) is moved
    assert not readings(np.zeros(3)).moved(MONDAY_S)


def truck_row(name: str, value: float, sd: float, limit: float = 2.0) -> dict[str, object]:
    p_value = min(1.0, 2.0 * within(value, sd, limit))
    found = offset_with(value, sd, sd)
    state = state_of(None, found, "fixed", limit)
    offset = {"offset_deg": value, "offset_sd_deg": sd, "p_value": p_value, "limit_deg": limit}
    return {"truck": name, "state": state, "verdict": state, **offset}


def offset_with(
    value: float, sd: float, spread_sd: float, *, load_would_help: bool = True, is_valid: bool = True
) -> Offset:
    around = 1.96 * sd
    return Offset(
        truck=replace(ANY_TRUCK, load_would_help=load_would_help),
        value=value,
        own=(value - 1.96 * spread_sd, value + 1.96 * spread_sd),
        whole=(value - around, value + around),
        is_valid=is_valid,
        has_evidence=True,
        not_identifiable_sd=0.0,
        since=0.0,
    )


ANY_TRUCK = truck_now([drive_row(day, 0.0) for day in range(3)], (), priors_of())


def test_trucks_are_ranked_by_evidence_not_by_value() -> None:
    ranked = rank(
        [truck_row("wide", 4.0, 2.0), truck_row("sure", 2.8, 0.1), truck_row("fine", 0.5, 0.3), {"truck": "?"}]
    )
    assert [row["truck"] for row in ranked] == ["sure", "wide", "fine", "?"]
    assert [row["rank"] for row in ranked] == [1, 2, 3, 4]
    assert (ranked[0]["verdict"], ranked[0]["watch"]) == ("recalibrate", False)


def test_recalibrate_and_within_have_their_whole_interval_on_one_side_of_the_limit() -> None:
    """A probability of 0.53 to be beyond the limit is no green verdict; nor is one of 0.5 % to be within it."""
    trucks = {
        "recalibrate": (2.9, 0.3),
        "recalibrate too": (-2.9, 0.3),
        "undecided": (2.03, 0.4),
        "undecided too": (-1.5, 0.4),
        "undecided as well": (0.0, 1.1),
        "within": (1.2, 0.4),
        "within too": (-0.1, 0.9),
    }
    ranked = rank([truck_row(name, value, sd) for name, (value, sd) in trucks.items()])
    assert {row["truck"]: row["verdict"] for row in ranked} == {name: name.split()[0] for name in trucks}


def test_a_change_beyond_the_limit_makes_a_truck_one_to_watch_where_its_offset_is_within() -> None:
    moved = truck_row("moved", 1.4, 0.2) | {"p_value": 1e-6}
    (row,) = rank([moved])
    assert (row["verdict"], row["watch"]) == ("within", True)


def rows_of(codes: str) -> list[dict[str, Any]]:
    """Two drives without an offset, the newer one with these findings."""
    return [{"start": MONDAY_S + DAY_S * day, "findings": found} for day, found in ((0, ""), (1, codes))]


def test_a_fault_at_the_end_of_the_newest_drive_decides_about_its_truck() -> None:
    fault = "yaw_rate_bias steering_wheel_angle_sensor_at_fault"
    trucks: dict[str, list[dict[str, Any]]] = {
        "repair": [*rows_of(fault), {"start": MONDAY_S + 2 * DAY_S, "findings": fault, "verdict": "repair"}],
        "check_signal": [*rows_of(""), {"start": MONDAY_S + 2 * DAY_S, "findings": "scale", "verdict": "check_signal"}],
        "signal_or_sensor": rows_of(fault),  # of a former version, without the drive's verdict
        "no_offset": rows_of("yaw_rate_bias"),
        "no_offset, repaired since": [*rows_of(fault), {"start": MONDAY_S + 3 * DAY_S, "findings": ""}],
        "signal_or_sensor, and a log that cannot be read": [
            *rows_of(fault),
            {"start": MONDAY_S + 3 * DAY_S, "findings": None, "error_code": "unreadable_log"},
        ],
    }
    of_trucks = [OfTruck(name, rows, 2.0) for name, rows in trucks.items()]
    for name, history in zip(trucks, histories(of_trucks), strict=True):
        assert history.truck["state"] == name.split(",")[0]


def of_sd(sd: float, spread_sd: float, load_would_help: bool = True) -> Offset:
    return offset_with(2.0, sd, spread_sd, load_would_help=load_would_help, is_valid=False)


@pytest.mark.parametrize(
    ("offset", "loaded_s", "decides"),
    [
        (of_sd(0.4, 0.1), (40.0, 40.0), "a drive at another load"),
        (of_sd(0.4, 0.1, False), (40.0, 40.0), "drives on other roads, or a measured pull"),
        (of_sd(0.7, 0.6), (40.0, 0.5), "another drive with bends to the right"),
        (of_sd(0.7, 0.6), (0.0, 30.0), "another drive with bends to the left"),
        (of_sd(0.7, 0.6), (0.0, 0.0), "another drive with bends both ways"),
        (of_sd(0.7, 0.6), (30.0, 30.0), "another drive with bends both ways"),
    ],
)
def test_an_undecided_truck_gets_the_drive_that_narrows_the_larger_part_of_its_interval(
    offset: Offset, loaded_s: tuple[float, float], decides: str
) -> None:
    assert would_decide(offset, *loaded_s).startswith(decides)


def test_a_pull_does_not_decide_about_a_valid_offset_so_another_load_is_not_the_advice() -> None:
    valid = offset_with(2.0, 0.4, 0.1)
    assert would_decide(valid, 40.0, 40.0) == "another drive with bends both ways"


def test_drives_that_contradict_each_other_need_another_one() -> None:
    offset = offset_with(2.0, 0.4, 0.1, is_valid=False)
    ambiguous = replace(offset, truck=replace(offset.truck, is_ambiguous=True))
    assert would_decide(ambiguous, 40.0, 40.0) == "another drive, since the last ones contradict each other"


def is_named(row: dict[str, object]) -> bool:
    """Recalibrate, and hardly a false alarm."""
    return row["verdict"] == "recalibrate" and not row["watch"]


def test_ten_thousand_healthy_trucks_give_no_five_hundred_alarms() -> None:
    """An alarm at 5 % each would be 500 at the limit itself; and of a mix, few of those named are healthy."""
    random = np.random.default_rng(8)
    healthy = [truck_row(f"h{k}", x, 0.3) for k, x in enumerate(2.0 + 0.3 * random.normal(size=10_000))]
    assert sum(is_named(row) for row in rank(healthy)) <= 3
    ill = [truck_row(f"i{k}", x, 0.3) for k, x in enumerate(4.0 + 0.3 * random.normal(size=200))]
    named = [row["truck"] for row in rank(healthy + ill) if is_named(row)]
    assert sum(str(name).startswith("i") for name in named) >= 198
    assert sum(str(name).startswith("h") for name in named) <= 0.08 * len(named)


# -- page, query, words
