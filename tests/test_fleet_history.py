"""A truck's drives over time: a change of two degrees is found, and what did not change is left alone."""

from __future__ import annotations

import numpy as np

from oncenter.fleet.history import NOISE, Told, breaks, drift
from oncenter.fleet.ranking import rank, within

DAY_S = 86400.0
MONDAY_S = 1_772_434_800.0  # 2026-03-02, 7:00 UTC


def told(values: np.ndarray, sd: float | np.ndarray = 0.5) -> Told:
    count = len(values)
    return Told(MONDAY_S + DAY_S * np.arange(count), values, np.broadcast_to(np.asarray(sd, float), (count,)).copy())


# -- a night


def test_one_drive_that_is_off_alone_is_no_change() -> None:
    value = np.zeros(12)
    value[6] = 6.0
    assert breaks(told(value), NOISE["backlash"]) == []


def test_a_change_that_hangs_on_one_drive_waits_for_another() -> None:
    sd = np.array([0.4] * 6 + [0.4, 2.5, 2.5])
    value = np.array([0.0] * 6 + [6.0, 0.5, 0.0])
    assert breaks(told(value, sd), NOISE["backlash"]) == []
    assert [broken.at for broken in breaks(told(np.append(value, 6.0), np.append(sd, 0.4)), NOISE["backlash"])] == [6]


def test_play_of_which_no_two_drives_differ_by_the_least_change_never_changed_and_one_a_little_larger_did() -> None:
    least = NOISE["backlash"].smallest
    for step, found in ((0.95 * least, []), (1.05 * least, [6])):
        value = np.repeat([3.0, 3.0 + step], 6)
        assert [broken.at for broken in breaks(told(value, 0.01), NOISE["backlash"])] == found


def test_an_interval_of_a_changes_size_covers_the_truth_as_often_as_it_says() -> None:
    random = np.random.default_rng(6)
    covered = []
    for _ in range(300):
        sd = random.uniform(0.3, 0.9, 24)
        value = NOISE["backlash"].scatter(sd) * random.normal(0.0, 1.0, 24) + np.where(np.arange(24) < 12, 0.0, 4.0)
        (broken,) = breaks(told(value, sd), NOISE["backlash"])
        covered.append(abs(broken.size - 4.0) < 1.96 * broken.sd)
    assert 0.92 <= np.mean(covered) <= 0.99


def test_a_drift_is_its_slope_with_an_interval_that_covers_it() -> None:
    random = np.random.default_rng(7)
    covered = []
    for _ in range(300):
        value = 0.02 * np.arange(20) + NOISE["backlash"].scatter(np.full(20, 0.5)) * random.normal(0.0, 1.0, 20)
        found = drift(told(value), 0)
        assert found is not None
        covered.append(abs(found[0] - 0.02) < 1.96 * found[1])
    assert 0.92 <= np.mean(covered) <= 0.99
    assert drift(told(np.zeros(3)), 0) is None


def truck_row(name: str, value: float, sd: float, limit: float = 2.0) -> dict[str, object]:
    return {"truck": name, "offset_deg": value, "offset_sd_deg": sd, "p_value": within(value, sd, limit)}


def test_trucks_are_ranked_by_evidence_not_by_value() -> None:
    ranked = rank(
        [truck_row("wide", 4.0, 2.0), truck_row("sure", 2.8, 0.1), truck_row("fine", 0.5, 0.3), {"truck": "?"}]
    )
    assert [row["truck"] for row in ranked] == ["sure", "wide", "fine", "?"]
    assert [row["rank"] for row in ranked] == [1, 2, 3, 4]
    assert ranked[0]["verdict"] == "calibrate"


def test_ten_thousand_healthy_trucks_give_no_five_hundred_alarms() -> None:
    """At the limit itself, where an alarm at 5 % each would be 500; and of a mix, few of those named are healthy."""
    random = np.random.default_rng(8)
    healthy = [truck_row(f"h{k}", x, 0.3) for k, x in enumerate(2.0 + 0.3 * random.normal(size=10_000))]
    assert sum(row["verdict"] == "calibrate" for row in rank(healthy)) <= 3
    ill = [truck_row(f"i{k}", x, 0.3) for k, x in enumerate(4.0 + 0.3 * random.normal(size=200))]
    named = [row["truck"] for row in rank(healthy + ill) if row["verdict"] == "calibrate"]
    assert sum(str(name).startswith("i") for name in named) >= 198
    assert sum(str(name).startswith("h") for name in named) <= 0.08 * len(named)


# -- page, query, words
