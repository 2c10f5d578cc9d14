"""Many drives of a truck: they separate pull from accelerometer bias where loads differ, and find what changed."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from itertools import permutations

import numpy as np
import pytest
from truck_rows import drive_row

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.truck.events import Event
from oncenter.truck.now import Truck, truck_now, trucks_now, usable
from oncenter.truck.priors import Priors, priors_of
from oncenter.truck.row import Row

RATIO, CROWN_M_S2 = 20.0, 0.2
GRADIENTS = (0.3, 0.42, 0.56)  # deg/(m/s^2), of three loads
LITTLE = replace(priors_of(), load_steer_sds_rad=(0.003 * DEGREE, 0.003 * DEGREE))


def truck(
    random: np.random.Generator,
    *,
    drives: int = 8,
    gradients: tuple[float, ...] = GRADIENTS,
    offset: float = 2.0,
    pull: float = 0.0,
    bias: float = 0.0,
    play: float = 6.0,
    sd: float = 0.1,
    stands: bool = True,
    first_day: int = 0,
) -> list[Row]:
    """Rows of a truck, a day each, by the model's equations written out, not by its code: i K p in the offset, b + p in
    the neutral acceleration, bank and standing ground by b and the roads' crown. Without compliance. deg, m/s^2."""
    found, region = [], random.normal(0.0, 0.07)
    for k in range(drives):
        gradient = gradients[k % len(gradients)]
        crown, wind = random.normal(CROWN_M_S2 + region, 0.07), random.normal(0.0, 0.02)
        found.append(
            drive_row(
                first_day + k,
                offset + RATIO * gradient * pull + random.normal(0.0, math.hypot(sd, 0.1)),
                play_deg=play + random.normal(0.0, math.hypot(0.2, 0.3)),
                neutral=bias + pull + wind + random.normal(0.0, 0.01),
                sds=(sd, 0.2, 0.01),
                gradient=(gradient + random.normal(0.0, 0.01)) * DEGREE,
                gradient_sd=0.01 * DEGREE,
                bank=bias + crown,
                standing=bias + 0.5 * CROWN_M_S2 + random.normal(0.0, 0.2) if stands else math.nan,
                ratio=RATIO,
            )
        )
    return found


def shifted(row: Row, by_deg: float) -> Row:
    """The row as if the sensor had read so much more: the densities with another mean."""
    modes = row.modes.copy()
    by = by_deg * DEGREE
    for mode in modes:
        information = np.zeros((3, 3))
        information[np.tril_indices(3)] = mode[1:7]
        information = information + np.tril(information, -1).T
        mode[0] -= mode[7] * by + 0.5 * information[0, 0] * by**2
        mode[7:] += information[:, 0] * by
    return replace(row, modes=modes)


def learned(trucks: list[list[Row]], priors: Priors = LITTLE) -> list[Truck]:
    return trucks_now(trucks, [replace(priors, compliance_share_1=0.0)] * len(trucks))


def of(trucks: list[Truck], name: str) -> np.ndarray:
    return np.array([getattr(each, name) for each in trucks])


def steps(one: Truck) -> list[int]:
    return [change.at for change in one.changes if change.kind != "play"]


def test_loads_separate_a_pull_from_the_accelerometers_bias() -> None:
    """The same pull and bias once at three loads, once at the middle one: no road here says where level is."""
    random = np.random.default_rng(1)
    lost = replace(LITTLE, crown_sd_m_s2=1.4, standing_slope_sd_m_s2=1.0, pull_sd_m_s2=0.2)
    three = [truck(random, pull=0.15, bias=-0.1) for _ in range(100)]
    one = [truck(random, pull=0.15, bias=-0.1, gradients=GRADIENTS[1:2]) for _ in range(100)]
    by_three, by_one = learned(three, lost), learned(one, lost)
    assert abs(np.mean(of(by_three, "pull")) - 0.15) < 0.02
    assert abs(np.mean(of(by_three, "accelerometer_bias")) + 0.1) < 0.02
    assert np.median(np.abs(of(by_three, "offset") - 2.0 * DEGREE)) < 0.25 * DEGREE
    assert np.median(of(by_three, "whole_sd")) < 0.4 * np.median(of(by_one, "whole_sd"))
    assert not of(by_three, "load_would_help").any() and of(by_one, "load_would_help").mean() > 0.9


def test_a_trucks_interval_contains_its_offset_at_the_stated_rate() -> None:
    random = np.random.default_rng(2)
    given = [
        truck(random, pull=random.normal(0.0, 0.05) * wide, bias=random.normal(0.0, 0.1), stands=k % 2 == 0)
        for k, wide in enumerate(random.choice([1.0, LITTLE.wide_pull], 600, p=[0.9, 0.1]))
    ]
    whole = of(learned(given), "whole")
    middle, half_width = whole.mean(axis=1), 0.5 * (whole[:, 1] - whole[:, 0])
    z = 1.96 * (middle - 2.0 * DEGREE) / half_width
    assert 0.92 <= np.mean(np.abs(z) < 1.96) <= 0.995
    assert 0.7 <= np.std(z) <= 1.15


def test_a_step_of_a_degree_is_found_within_three_drives_and_none_where_none_is() -> None:
    random = np.random.default_rng(3)
    steady = [truck(random, drives=20, pull=random.normal(0.0, 0.05)) for _ in range(300)]
    assert not any(one.changes for one in learned(steady))
    at = random.integers(4, 17, len(steady))
    moved = [[shifted(row, 1.0 * (k >= at[n])) for k, row in enumerate(drives)] for n, drives in enumerate(steady)]
    soon = learned([drives[: at[n] + 3] for n, drives in enumerate(moved)])
    in_time = [n for n, one in enumerate(soon) if any(abs(step - at[n]) <= 1 for step in steps(one))]
    assert len(in_time) >= 0.95 * len(steady)
    found = [one for one in learned(moved) if steps(one)]
    assert sum(len(steps(one)) for one in found) <= 1.02 * len(steady)
    sizes = [change.size for one in found for change in one.changes]
    assert np.median(sizes) == pytest.approx(1.0 * DEGREE, abs=0.05 * DEGREE)


def test_a_single_wrong_drive_makes_no_step() -> None:
    """A first one that differs may have been before a calibration, and a last one after it: the offset is right, or not
    valid."""
    random = np.random.default_rng(4)
    for place in range(1, 8):
        drives = truck(random)
        drives[place] = shifted(drives[place], 8.0)
        (answer,) = learned([drives])
        if place < 7:
            assert steps(answer) == [], place
            assert abs(answer.offset - 2.0 * DEGREE) < 1.0 * DEGREE, place
        else:
            assert not answer.is_valid(_core.default_params())


def test_a_drive_with_a_wrong_play_has_less_weight_for_the_offset() -> None:
    drives = truck(np.random.default_rng(5), drives=12)
    last = drives[-1]
    wrong = [
        *drives[:5],
        drive_row(5, 2.0 - 4.0, play_deg=14.0, gradient=last.gradient, ratio=RATIO),
        *drives[6:],
    ]
    without, answer = learned([[*drives[:5], *drives[6:]], wrong])
    assert abs(answer.offset - without.offset) < 0.05 * DEGREE


def test_a_drive_on_one_flank_gets_the_play_from_the_others() -> None:
    """It measures the sum of offset and half the play; alone it identifies neither."""
    random = np.random.default_rng(6)
    drives = truck(random, drives=4, sd=0.6)
    missed = 3.0  # deg, of the play's width
    blind = drive_row(
        4,
        2.0 - 0.5 * missed,
        play_deg=6.0 + missed,
        sds=(1.55, 3.0, 0.01),
        with_play_deg2=-0.5 * 3.0**2,
        gradient=drives[0].gradient,
        ratio=RATIO,
    )
    known, with_blind = learned([drives, [*drives, blind]])
    assert with_blind.own_sd < known.own_sd
    assert abs(with_blind.offset - known.offset) < 0.4 * DEGREE


def test_the_result_of_a_truck_does_not_depend_on_other_trucks() -> None:
    random = np.random.default_rng(7)
    trucks = [truck(random, drives=int(random.integers(1, 60)), pull=random.normal(0.0, 0.05)) for _ in range(40)]
    all_together = learned(trucks)
    for n in range(0, 40, 4):
        (alone,) = learned([trucks[n]])
        for name in (field.name for field in fields(Truck)):
            assert np.array_equal(getattr(alone, name), getattr(all_together[n], name)), name


def test_ride_height_that_steers_with_the_load_is_in_the_interval() -> None:
    random = np.random.default_rng(8)
    given = []
    for _ in range(300):
        by_load = RATIO * 0.03 * random.normal(size=3)
        by_load -= by_load.mean()
        drives = truck(random, drives=9, pull=random.normal(0.0, 0.05), bias=random.normal(0.0, 0.1))
        given.append([shifted(row, by_load[k % 3]) for k, row in enumerate(drives)])
    whole = of(learned(given, priors_of()), "whole")
    assert np.mean((whole[:, 0] < 2.0 * DEGREE) & (whole[:, 1] > 2.0 * DEGREE)) >= 0.88


def test_one_drive_alone_keeps_its_uncertainty_and_has_no_nan() -> None:
    (drive,) = truck(np.random.default_rng(9), drives=1)
    (answer,) = learned([[drive]])
    assert answer.own_sd >= 0.1 * DEGREE
    assert abs(answer.offset - 2.0 * DEGREE) < 1.96 * answer.whole_sd
    for field in fields(answer):
        if field.name not in ("changes", "zero"):
            assert np.isfinite(getattr(answer, field.name)).all(), field.name


def test_a_wheel_alignment_moves_the_pull_with_the_offset() -> None:
    random = np.random.default_rng(11)
    error, blind = [], []
    for _ in range(30):
        before = truck(random, drives=10, bias=0.1)
        after = truck(random, drives=10, bias=0.1, pull=0.15, offset=5.0, first_day=10)
        (answer,) = learned([before + after])
        (change,) = answer.changes
        assert abs(change.at - 10) <= 1 and change.kind == "alignment"
        error.append(answer.pull - 0.15)
        blind.append(0.5 * sum(answer.whole) - 5.0 * DEGREE)
    assert abs(np.mean(error)) < 0.04
    assert np.median(np.abs(blind)) < 0.35 * DEGREE


def row_of(day: float, offset: float, play: float = 5.0, **more: float) -> Row:
    return drive_row(day, offset, play_deg=play, sds=(0.07, 0.3, 0.02), neutral=0.1, bank=0.3, **more)


def test_a_calibration_before_the_last_drives_is_found_wherever_it_is() -> None:
    """One drive at -0.15 deg, three or six at -3.4: nothing between is right."""
    for before, after in ((1, 3), (1, 6), (3, 1), (3, 2), (2, 2)):
        rows = [row_of(day, -0.15 if day < before else -3.4) for day in range(before + after)]
        answer = truck_now(rows, (), priors_of())
        assert steps(answer) == [before] and answer.since == before, (before, after)
        assert answer.offset == pytest.approx(-3.4 * DEGREE, abs=0.15 * DEGREE)
        assert answer.is_valid(_core.default_params()) == (after > 1)  # the last one alone may be wrong


def test_two_drives_that_contradict_each_other_are_not_valid_until_a_calibration_is_stated() -> None:
    rows = [row_of(0.0, 3.5), row_of(1.0, 0.1)]
    answer = truck_now(rows, (), priors_of())
    assert answer.is_ambiguous and not answer.is_valid(_core.default_params())
    for by in (None, -3.4 * DEGREE):
        event = Event(rows[1].start_s - 3600.0, "calibrated", by)
        stated = truck_now(rows, (event,), priors_of())
        assert not stated.is_ambiguous and stated.is_valid(_core.default_params()), by
        assert stated.offset == pytest.approx(0.1 * DEGREE, abs=0.15 * DEGREE)
        assert stated.since == 1


def test_a_change_is_found_at_another_road_bank_as_well() -> None:
    """A crown on the other side, and an accelerometer that was replaced with the sensor, hide no change."""
    for bank in (0.2, -0.2, 0.6):
        rows = [row_of(day, 0.0) for day in range(4)] + [replace(row_of(4.0 + k, 5.0), bank=bank) for k in range(2)]
        first, second = (truck_now(rows[:count], (), priors_of()) for count in (5, 6))
        assert not first.is_valid(_core.default_params()), bank
        assert second.is_valid(_core.default_params()) and steps(second) == [4], bank
        assert second.offset == pytest.approx(5.0 * DEGREE, abs=0.2 * DEGREE)


@pytest.mark.parametrize("status", ["valid", "converging"])
def test_a_drive_without_a_gradient_contradicts_as_any_other(status: str) -> None:
    """Its offset is measured, though play may look like its gradient: a truck of former drives alone is not valid."""
    slight = {"gradient": 0.05 * DEGREE, "status": status}
    rows = [row_of(day, 0.0) for day in range(4)] + [replace(row_of(4.0 + k, -5.0), **slight) for k in range(2)]
    for count in (5, 6):
        answer = truck_now(usable(rows[:count], ()), (), priors_of())
        assert not answer.is_valid(_core.default_params()) or answer.offset < -4.0 * DEGREE, count
    alike = truck_now(usable([*rows[:4], replace(row_of(4.0, 0.0), **slight)], ()), (), priors_of())
    assert alike.is_valid(_core.default_params()) and alike.load_would_help


def test_a_truck_is_the_same_in_whatever_order_its_drives_were_answered() -> None:
    rows = [row_of(day, *((0.0, 12.0) if day < 3 else (5.0, 3.0))) for day in range(6)]
    assert usable(rows[::-1], ()) == rows
    undated = [replace(rows[k], start_s=math.nan) for k in (2, 0)]
    assert usable(undated, ()) == undated


def test_events_between_the_same_two_drives_count_together() -> None:
    """A calibration and a repair change offset and play; two calibrations are one by the sum of what they add."""
    rows = [row_of(day, *((0.0, 12.0) if day < 4 else (5.0, 3.0))) for day in range(5)]
    at = rows[4].start_s - 3600.0
    calibrated, repaired = Event(at, "calibrated", 5.0 * DEGREE), Event(at + 60.0, "repaired")
    answers = [truck_now(rows, events, priors_of()) for events in permutations((calibrated, repaired))]
    for answer in answers:
        assert answer.is_valid(_core.default_params())
        assert answer.offset == pytest.approx(5.0 * DEGREE, abs=0.2 * DEGREE)
        assert answer.play == pytest.approx(3.0 * DEGREE, abs=0.5 * DEGREE)
    assert answers[0].own == answers[1].own
    unsure = [*rows[:4], replace(row_of(4.0, 5.0, 12.0), modes=drive_row(4.0, 5.0, sds=(3.0, 3.0, 0.02)).modes)]
    twice = (Event(at, "calibrated", 3.0 * DEGREE), Event(at + 60.0, "calibrated", 2.0 * DEGREE))
    assert truck_now(unsure, twice, priors_of()).offset == pytest.approx(5.0 * DEGREE, abs=0.5 * DEGREE)


def test_a_repair_with_an_alignment_renews_play_and_pull() -> None:
    """The pull that twelve drives at three loads identify holds after a repair, and not after an alignment with it."""
    random = np.random.default_rng(13)
    rows = truck(random, drives=12, pull=0.12, play=12.0) + truck(random, drives=1, offset=5.0, play=3.0, first_day=12)
    at = rows[12].start_s - 3600.0
    before = truck_now(rows[:12], (), LITTLE).pull
    repaired, both = (
        truck_now(rows, [Event(at, kind) for kind in kinds], LITTLE)
        for kinds in (("repaired",), ("repaired", "changed"))
    )
    assert [one.play for one in (repaired, both)] == pytest.approx([3.0 * DEGREE] * 2, abs=1.0 * DEGREE)
    assert repaired.pull == pytest.approx(before, abs=0.02) and both.pull < 0.5 * before


def test_a_pull_that_is_configured_as_none_gives_no_nan() -> None:
    for rows in ([row_of(0.0, 2.0)], [row_of(0.0, 2.0), row_of(1.0, 2.1)]):
        answer = truck_now(rows, (), replace(priors_of(), pull_sd_m_s2=0.0))
        assert answer.offset == pytest.approx(2.0 * DEGREE, abs=0.3 * DEGREE)
        assert math.isfinite(answer.own_sd + answer.whole_sd + answer.pull_sd + answer.play)


def test_a_repaired_play_is_a_change_of_the_play_and_not_of_the_offset() -> None:
    rows = [row_of(day, 0.0, 10.0 if day < 3 else 3.0) for day in range(6)]
    answer = truck_now(rows, (), priors_of())
    (change,) = answer.changes
    assert (change.at, change.kind, answer.since, answer.play_since) == (3, "play", 0, 3)
    assert change.before == pytest.approx(10.0 * DEGREE, abs=0.5 * DEGREE)
    assert change.after == pytest.approx(3.0 * DEGREE, abs=0.5 * DEGREE)
    assert answer.play == pytest.approx(change.after, rel=1e-4)
    assert answer.offset == pytest.approx(0.0, abs=0.1 * DEGREE)


def test_a_repair_of_both_is_a_change_of_the_offset_and_one_of_the_play() -> None:
    rows = [row_of(day, *((0.0, 10.0) if day < 4 else (4.0, 3.0))) for day in range(8)]
    answer = truck_now(rows, (), priors_of())
    assert sorted((change.at, change.kind) for change in answer.changes) == [(4, "both"), (4, "play")]
    sizes = {change.kind: change.size / DEGREE for change in answer.changes}
    assert sizes == {"both": pytest.approx(4.0, abs=0.3), "play": pytest.approx(-7.0, abs=0.5)}


def test_dates_that_are_cut_into_more_drives_change_nothing() -> None:
    """Rates of change are per day, so two drives of half an hour on a day are one of an hour: their evidence adds up,
    but for the noise that each drive has by itself."""
    quiet = replace(
        priors_of(),
        offset_noise_sd_rad=0.0,
        play_noise_sd_rad=0.0,
        wind_sd_m_s2=0.0,
        wrong_valid=0.0,
        bias_wander_sd_m_s2=0.0,
    )
    random, wide = np.random.default_rng(12), math.sqrt(2.0)
    whole, parts = [], []
    for day in range(6):
        offset = 1.0 + random.normal(0.0, 0.1)
        common = {"gradient_sd": 1e-4 * DEGREE, "neutral": 0.1}
        whole.append(drive_row(day, offset, sds=(0.1, 0.3, 0.02), bank=math.nan, bank_variance=math.nan, **common))
        parts += [
            drive_row(
                day, offset, sds=(0.1 * wide, 0.3 * wide, 0.02 * wide), bank=math.nan, bank_variance=math.nan, **common
            )
        ] * 2
    one, cut = truck_now(whole, (), quiet), truck_now(parts, (), quiet)
    assert cut.offset == pytest.approx(one.offset, abs=0.02 * DEGREE)
    assert cut.whole == pytest.approx(one.whole, abs=0.02 * DEGREE)
    assert cut.play == pytest.approx(one.play, abs=0.01 * DEGREE)
