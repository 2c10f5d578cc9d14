"""The monitor of the steering wheel angle sensor: faults, their names, and cases without a fault."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest

from oncenter import _core
from oncenter._native import ffi, lib
from oncenter.signals import DEGREE

RATE_HZ = 100.0
Array = npt.NDArray[np.float64]


def judged(
    measured: Array,
    estimate: Array,
    sd: float = 1.0 * DEGREE,
    offset: float = 0.0,
    offset_sd: Array | None = None,
    flank_deficit: float = 0.0,
    speed: Array | None = None,
    holes: Sequence[int] = (),
    before: str = "none",
    assisted: bool = False,
) -> list[str]:
    """The sensor's fault at each tick. The total sd is of `offset_sd` and `sd`.

    At 15 m/s where no speed is given; a hole before each tick of `holes`; `before` is the fault before this ignition.
    """
    offset_sds = np.zeros(len(estimate)) if offset_sd is None else offset_sd
    speed = np.full(len(estimate), 15.0) if speed is None else speed
    watch, kept = ffi.new("oc_fault_watch *"), ffi.new("oc_fault_evidence *", {"fault": _core.FAULTS.index(before)})
    names = []
    for k in range(len(estimate)):
        tick = ffi.new(
            "oc_fault_tick *",
            {
                "time": k / RATE_HZ,
                "tick_s": 1.0 / RATE_HZ,
                "judged_s": 1.0 / RATE_HZ,
                "measured": 0.0 if np.isnan(measured[k]) else measured[k],
                "offset": offset,
                "offset_sd": offset_sds[k],
                "estimate": estimate[k],
                "sd": np.hypot(sd, offset_sds[k]),
                "flank_deficit": flank_deficit,
                "speed": speed[k],
                "has_measured": not np.isnan(measured[k]),
                "after_hole": k in holes,
                "can_judge": True,
                "is_accurate": speed[k] > 8.0,
                "assisted": assisted,
            },
        )
        names.append(ffi.string(lib.oc_fault_name(lib.oc_fault_update(watch, kept, tick))).decode())
    return names


def weaving() -> Array:
    t = np.arange(12_000) / RATE_HZ
    return 25.0 * DEGREE * np.sin(2.0 * np.pi * t / 11.0)


def test_a_healthy_sensor_has_no_fault_whatever_its_offset() -> None:
    true = weaving()
    noisy = true + np.random.default_rng(1).normal(0.0, 1.5 * DEGREE, len(true))
    assert set(judged(true + 7.0 * DEGREE, noisy, offset=7.0 * DEGREE)) == {"none"}


@pytest.mark.parametrize(
    ("name", "within_s"),
    [("lost", 5.1), ("stuck", 6.0), ("jumped", 3.0), ("drifting", 60.0), ("wrong_sign", 12.0), ("remounted", 8.0)],
)
def test_a_fault_is_detected_with_its_name(name: str, within_s: float) -> None:
    true, at = weaving(), 4000
    after = np.arange(len(true)) >= at
    spoiled = {
        "lost": np.where(after, np.nan, true),
        "stuck": np.where(after, true[at], true),
        "jumped": true + np.where(after, 30.0 * DEGREE, 0.0),
        "drifting": true + np.maximum(np.arange(len(true)) - at, 0) / RATE_HZ * 0.4 * DEGREE,
        "wrong_sign": np.where(after, -true, true),
        "remounted": np.where(
            after & (np.arange(len(true)) < at + 300), np.nan, true + np.where(after, -25.0 * DEGREE, 0.0)
        ),
    }[name]
    names = judged(spoiled, true)
    assert set(names[:at]) == {"none"}
    found = names[at + round(within_s * RATE_HZ)]
    assert found == name
    assert names[-1] == name


def test_a_drift_masked_by_play_is_detected_by_its_mean() -> None:
    """Never beyond the limit of 10 deg, and half of the time far below it. The same to both sides gives no fault."""
    true = weaving()
    off = np.where(np.arange(len(true)) // 100 % 2, 9.5 * DEGREE, 4.5 * DEGREE)
    names = judged(true + off, true)
    assert set(names[:2000]) == {"none"} and names[5000] == "drifting"
    assert set(judged(true + off - 7.0 * DEGREE, true)) == {"none"}


def test_a_drift_is_detected_although_learning_follows_it_with_a_growing_sd() -> None:
    true, at = weaving(), 2000
    drift = 0.2 * DEGREE * np.maximum(np.arange(len(true)) - at, 0) / RATE_HZ
    names = judged(true + drift, true, offset_sd=0.5 * DEGREE + 0.3 * drift)
    assert set(names[: at + 4000]) == {"none"} and names[at + 6000] == "drifting"
    # with a larger sd before, the same drift is below the limit
    assert set(judged(true + drift, true, offset_sd=np.full(len(true), 7.0 * DEGREE))) == {"none"}


def test_a_rarely_loaded_flank_widens_the_limit() -> None:
    true = weaving()
    off = np.where(np.arange(len(true)) % 4000 > 3000, 11.0 * DEGREE, 0.0)
    assert set(judged(true + off, true, flank_deficit=1.0)) == {"none"}
    assert "none" not in judged(true + off, true)[3600:4000]


def test_a_fault_ends_late() -> None:
    true = weaving()
    spoiled = true.copy()
    spoiled[2000:3000] += 30.0 * DEGREE
    names = judged(spoiled, true)
    assert names[2900] == "jumped" and names[3500] == "jumped" and names[-1] == "none"


def test_bends_of_a_few_degrees_reveal_a_reversed_sign() -> None:
    """The difference is always below 10 deg."""
    true = 0.16 * weaving()
    after = np.arange(len(true)) >= 4000
    names = judged(np.where(after, -true, true), true + np.random.default_rng(2).normal(0.0, 1.0 * DEGREE, len(true)))
    assert set(names[:4000]) == {"none"}
    assert names[-1] == "wrong_sign"


def test_a_reversed_sign_does_not_end_on_a_straight() -> None:
    true = weaving()
    true[6000:] = np.random.default_rng(3).normal(0.0, 0.3 * DEGREE, 6000)  # small motions of the hands
    names = judged(np.where(np.arange(len(true)) >= 2000, -true, true), true)
    assert set(names[5900:]) == {"wrong_sign"}


@pytest.mark.parametrize("parked_deg", [-600.0, -100.0, 100.0])
def test_a_wheel_parked_at_an_angle_gives_no_reversed_sign(parked_deg: float) -> None:
    true = weaving()
    true[:500] = parked_deg * DEGREE
    estimate, speed = np.where(np.arange(len(true)) < 500, 0.0, true), np.where(np.arange(len(true)) < 500, 0.0, 15.0)
    assert set(judged(true, estimate, speed=speed)) == {"none"}


def test_a_restart_of_the_estimate_after_a_hole_gives_no_reversed_sign() -> None:
    true, holes = weaving(), range(500, 12_000, 500)
    estimate = true.copy()
    for k in holes:
        estimate[k : k + 30] *= np.linspace(-0.5, 1.0, 30)
    assert set(judged(true, estimate, holes=holes)) == {"none"}


@pytest.mark.parametrize("frozen", ["motion", "all"])
def test_a_lag_after_frozen_signals_gives_no_reversed_sign(frozen: str) -> None:
    """Either motion was missing for some seconds, or a busy bus held all signals at the end of a bend."""
    true = 0.3 * np.tile(weaving(), 3)
    begins, length = range(500, len(true) - 500, 1137), 300 if frozen == "motion" else 90
    for begin in begins:
        true[begin - 300 : begin + 45] += 60.0 * DEGREE * np.sin(np.linspace(0.0, 0.9 * np.pi, 345))
    measured, estimate, speed = true.copy(), true.copy(), np.full(len(true), 15.0)
    for begin in begins:
        still, late = slice(begin, begin + length), slice(begin + length, begin + length + 30)
        estimate[still] = true[begin]
        estimate[late] = np.linspace(true[begin], true[late.stop], 30)
        if frozen == "motion":
            speed[still] = 0.0
        else:
            measured[still] = true[begin]
    assert set(judged(measured, estimate, speed=speed)) == {"none"}


@pytest.mark.parametrize("missing", ["motion", "angle"])
def test_single_missing_ticks_do_not_mask_a_reversed_sign(missing: str) -> None:
    """One missing tick of speed or angle in 0.9 s costs itself, not the following second."""
    true = 0.3 * weaving()
    measured, speed = np.where(np.arange(len(true)) >= 4000, -true, true), np.full(len(true), 15.0)
    (speed if missing == "motion" else measured)[::90] = 0.0 if missing == "motion" else np.nan
    names = judged(measured, true + np.random.default_rng(2).normal(0.0, 1.0 * DEGREE, len(true)), speed=speed)
    assert set(names[:4000]) == {"none"}
    assert names[-1] == "wrong_sign"


def test_kerbs_and_stability_control_give_no_reversed_sign() -> None:
    """Each kicks the wheel by up to 40 deg and the truck's motion by up to 30 deg, with independent signs."""
    random = np.random.default_rng(5)
    true = 0.3 * np.tile(weaving(), 5)
    measured, estimate = true.copy(), true + random.normal(0.0, 1.0 * DEGREE, len(true))
    for begin in range(500, len(true) - 200, 1000):
        kick = np.sin(np.linspace(0.0, np.pi, int(random.integers(20, 150)))) * DEGREE
        measured[begin : begin + len(kick)] += random.uniform(-40.0, 40.0) * kick
        estimate[begin : begin + len(kick)] += random.uniform(-30.0, 30.0) * kick
    assert set(judged(measured, estimate)) == {"none"}


def test_a_sensor_is_remounted_after_the_end_of_a_drift() -> None:
    t = np.arange(72_000) / RATE_HZ
    true = 25.0 * DEGREE * np.sin(2.0 * np.pi * t / 11.0) + np.random.default_rng(6).normal(0.0, 0.3 * DEGREE, len(t))
    for rate, end in [(0.4, "remounted"), (0.025, "drifting")]:  # deg/s; the second one never ends
        drift = np.minimum(rate * t, 24.0) * DEGREE
        names = judged(true + drift, true)
        assert names[-1] == end
        first = names.index("drifting")
        assert set(names[first : first + 29_000]) == {"drifting"}


def test_kerbs_and_bends_do_not_reset_the_steady_time() -> None:
    """One second in twenty has 8 deg more, to either side. With every other second the sensor is not steady."""
    t = np.arange(66_000) / RATE_HZ
    true = 25.0 * DEGREE * np.sin(2.0 * np.pi * t / 11.0) + np.random.default_rng(8).normal(0.0, 0.3 * DEGREE, len(t))
    drift = np.minimum(0.4 * t, 24.0) * DEGREE
    for period_s, end in [(20.0, "remounted"), (2.0, "drifting")]:
        kick = np.sin(np.pi * np.minimum(t % period_s, 1.0)) * np.where(t // period_s % 2.0 < 1.0, 1.0, -1.0)
        off = 8.0 * DEGREE * kick
        assert judged(true + drift + off, true)[-1] == end


def test_the_steady_time_of_a_fault_does_not_count_for_the_next_one() -> None:
    t = np.arange(56_000) / RATE_HZ
    true = 25.0 * DEGREE * np.sin(2.0 * np.pi * t / 11.0) + np.random.default_rng(7).normal(0.0, 0.3 * DEGREE, len(t))
    drift = np.interp(t, [0.0, 60.0, 340.0, 345.0, 370.0, 500.0], [0.0, 8.0, 8.0, 4.5, 4.5, 26.0]) * DEGREE
    names = judged(true + drift, true)
    assert names[33_000] == "drifting" and names[37_000] == "none"
    assert "drifting" in names[40_000:] and "remounted" not in names


@pytest.mark.long
@pytest.mark.parametrize("before", ["stuck", "drifting", "wrong_sign"])
def test_a_replaced_sensor_is_remounted(before: str) -> None:
    true = np.tile(weaving(), 3)
    true += np.random.default_rng(4).normal(0.0, 0.3 * DEGREE, len(true))
    names = judged(true + 8.0 * DEGREE, true, before=before)
    assert names[0] == before and set(names[:29_000]) == {before} and names[-1] == "remounted"
    still_wrong = {"stuck": np.full(len(true), 0.3), "wrong_sign": -true}.get(before)
    if still_wrong is not None:
        assert "remounted" not in judged(still_wrong, true, before=before)


def test_a_value_constant_for_half_a_minute_at_speed_is_stuck() -> None:
    names = judged(np.full(4000, 0.02), np.zeros(4000))
    assert names[2900] == "none" and names[3100] == "stuck"


def test_an_angle_beyond_the_limit_is_excluded_before_the_fault() -> None:
    watch, kept = ffi.new("oc_fault_watch *"), ffi.new("oc_fault_evidence *")
    states = []
    for k in range(3000):
        off = 12.0 * DEGREE if k >= 2000 else 0.0
        tick = {
            "time": k / RATE_HZ,
            "tick_s": 1.0 / RATE_HZ,
            "judged_s": 1.0 / RATE_HZ,
            "measured": off + 0.01 * (k % 7),
            "sd": DEGREE,
            "speed": 15.0,
        }
        fault = lib.oc_fault_update(
            watch,
            kept,
            ffi.new("oc_fault_tick *", tick | {"has_measured": True, "can_judge": True, "is_accurate": True}),
        )
        states.append((fault, lib.oc_fault_excludes_angle(watch), lib.oc_fault_suspected(watch)))
    assert states[1990] == (lib.OC_FAULT_NONE, False, False)
    assert states[2010] == (lib.OC_FAULT_NONE, True, True)
    assert states[2400][:2] == (lib.OC_FAULT_JUMPED, True)
