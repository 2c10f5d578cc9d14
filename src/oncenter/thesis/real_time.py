"""Figures 10, 11, 12 and 14, chapter 4: the steering wheel angle from motion alone, by the methods of the thesis "
"and of this code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import oncenter as oc
from oncenter.angle.run import Method
from oncenter.signals import DEGREE, Signals
from oncenter.simulate.truth import Truth
from oncenter.thesis.drives import SEED, simulated
from oncenter.thesis.figure import INK, MUTED, OTHER, OURS, THESIS, Claim, Exhibit, Figure, Misprint, Progress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_SEEDS = range(SEED, SEED + 5)  # figures show the first, claims are medians over all
_LEARNING_S = 600.0
_LARGE_DEG = 200.0  # 4.1
_WSS: Method = "wheel-speed"
_YRS: Method = "yaw-rate"
_OBSERVER: Method = "observer"
_TURN_S, _FROM_DEG, _TO_DEG, _PRINTED_DEG = 70.23, 60.0, -50.0, -29.0  # Figure 12; when the scenario's turn begins
_PRINTED_S = 0.85


_SEMITRAILER = {
    "hitch_m": 3.1,
    "mass_kg": 6500.0,
    "yaw_inertia_kg_m2": 110000.0,
    "gravity_centre_m": 5.5,
    "axle_count": 3,
    "axles_m": 7.7,
    "cornering_stiffness_n_rad": 390000.0,
    "payload": {"mass_kg": 25000.0, "distance_m": 5.3, "length_m": 13.0},
}
_OTHER_TRUCKS: dict[str, dict[str, dict[str, Any]]] = {
    "with 15 deg of play": {"steering": {"backlash_deg": 15.0}},
    "with a laden semitrailer": {"truck": {"trailer": _SEMITRAILER}},
}


@dataclass(frozen=True)
class Manoeuvre:
    """A simulated manoeuvre, its true angle and the estimates of it, deg, from `begin_s` on, with the observer's
    half-width of 95 %."""

    truth: Truth
    begin_s: float
    time_s: Array  # from begin_s
    true_deg: Array
    estimates_deg: dict[Method, Array]
    half_width_deg: Array


def run(progress: Progress) -> list[Exhibit]:
    """Three manoeuvres, five times each, with a sensor before them and without it during them."""
    found: dict[str, list[Manoeuvre]] = {"low_speed": [], "mid_speed": [], "hard_turn": []}
    for k, seed in enumerate(_SEEDS):
        signals, _ = simulated("thesis_drive", seed=seed)
        teacher = replace(signals, table=signals.table.head(round(_LEARNING_S * signals.rate_hz)))
        found["low_speed"].append(_estimated("low_speed_manoeuvre", seed, 24.0, 72.0, teacher))
        found["mid_speed"].append(_estimated("mid_speed_manoeuvre", seed, 34.0, 68.0, teacher))
        found["hard_turn"].append(_estimated("hard_turn", seed, _TURN_S - 1.0, _TURN_S + 4.0, teacher))
        progress((k + 1) / len(_SEEDS))
    others = {
        name: _estimated("hard_turn", SEED, _TURN_S - 1.0, _TURN_S + 4.0, teacher, changes)
        for name, changes in _OTHER_TRUCKS.items()
    }
    return [
        _slow(found["low_speed"]),
        _faster(found["mid_speed"]),
        _hard(found["hard_turn"], others),
        _by_gyro(found["mid_speed"]),
    ]


def _estimated(
    scenario: str,
    seed: int,
    begin_s: float,
    end_s: float,
    teacher: Signals,
    changes: Mapping[str, Mapping[str, Any]] | None = None,
) -> Manoeuvre:
    signals, truth = simulated(scenario, changes, seed)
    truck = oc.vehicle("scania_r730_4x2")
    time = signals.columns["time_s"]
    during = (time >= begin_s) & (time <= end_s)
    true = truth.table["steering_wheel_angle_rad"].to_numpy() - truth.straight_ahead_rad
    tables = {
        method: oc.angle(signals, truck, method=method, taught_by=(teacher,), sensor_lost_at=0.0).filter(during)
        for method in (_WSS, _YRS, _OBSERVER)
    }
    estimates = {method: table["steering_wheel_angle_rad"].to_numpy() / DEGREE for method, table in tables.items()}
    half_width = 1.96 * tables[_OBSERVER]["standard_deviation_rad"].to_numpy() / DEGREE
    rows = replace(truth, table=truth.table.filter(during))
    return Manoeuvre(rows, begin_s, time[during] - begin_s, true[during] / DEGREE, estimates, half_width)


def _median(values: list[float]) -> float:
    return float(np.median(values))


def _relative_percent(drive: Manoeuvre, method: Method, large: bool) -> float:
    """RMS of the error relative to the steered angle, above 200 deg; or from 20 to 200 deg."""
    size = np.abs(drive.true_deg)
    held = size > _LARGE_DEG if large else (size > 20.0) & (size <= _LARGE_DEG)
    error = (drive.estimates_deg[method] - drive.true_deg)[held] / drive.true_deg[held]
    return 100.0 * float(np.sqrt(np.mean(error**2)))


def _lacking_deg(drive: Manoeuvre, method: Method, left: bool) -> float:
    """Underestimation of the angle while the largest angle to that side is held."""
    side = 1.0 if left else -1.0
    held = side * drive.true_deg > 0.98 * np.max(side * drive.true_deg)
    return float(np.mean(side * (drive.true_deg - drive.estimates_deg[method])[held]))


def _covered(drive: Manoeuvre) -> float:
    return float(np.mean(np.abs(drive.estimates_deg[_OBSERVER] - drive.true_deg) < drive.half_width_deg))


def _slow(drives: list[Manoeuvre]) -> Figure:
    shown = drives[0]
    wheels = 500.0 * DEGREE / shown.truth.steering_ratio
    small = 100.0 * (1.0 - float(np.arctan(wheels)) / wheels)
    linear = f"the simulated truck turns by δ_f/L and not by tan δ_f/L, which alone causes {small:.0f} % at 500 deg"
    noise = "the play (3 deg) and the wheel speeds' noise; the thesis's truck also had a ratio that varies"
    claims = [
        Claim(
            "4.1, Fig. 10",
            "relative error above 200 deg at 17 km/h stays below, from wheel speeds (21)",
            10.0,
            _median([_relative_percent(drive, _WSS, True) for drive in drives]),
            "%",
            f"RMS, median of five simulated manoeuvres; {linear}",
        ),
        Claim(
            "4.1, Fig. 10",
            "relative error above 200 deg by our observer",
            None,
            _median([_relative_percent(drive, _OBSERVER, True) for drive in drives]),
            "%",
            "RMS, median of five",
        ),
        Claim(
            "4.1, Fig. 10",
            "relative error between 20 and 200 deg oscillates around, from wheel speeds",
            20.0,
            _median([_relative_percent(drive, _WSS, False) for drive in drives]),
            "%",
            f"RMS, median of five; {noise}",
        ),
        Claim(
            "4.1, Fig. 10",
            "mean error from -500 to 500 deg, where the estimate appears unbiased",
            0.0,
            _median([float(np.mean((d.estimates_deg[_WSS] - d.true_deg) * np.sign(d.true_deg))) for d in drives]),
            "deg",
            f"toward more angle, median of five; {linear}",
        ),
    ]
    return Figure(
        "10",
        "At 17 km/h, up to 500 deg",
        lambda canvas: _with_error(canvas, shown, (_WSS, _OBSERVER), "10 %", 0.1 * np.abs(shown.true_deg)),
        "The true angle, (21) from the wheel speeds, and our observer, which identified the truck from ten minutes "
        "with its "
        "sensor. Below, their errors.",
        claims=tuple(claims),
        size_in=(5.2, 4.4),
    )


def _faster(drives: list[Manoeuvre]) -> Figure:
    shown = drives[0]
    fifteen = np.full_like(shown.time_s, 15.0)
    left, right = (_median([_lacking_deg(drive, _WSS, side) for drive in drives]) for side in (True, False))
    ours = _median([max(abs(_lacking_deg(drive, _OBSERVER, side)) for side in (True, False)) for drive in drives])
    note = "where the largest angle to that side is held; median of five; the truck has the thesis's 0.4 deg/(m/s²)"
    return Figure(
        "11",
        "At 46 km/h",
        lambda canvas: _with_error(canvas, shown, (_WSS, _OBSERVER), "15 and 20 deg", fifteen, fifteen + 5.0),
        "Bends up to 2 m/s². (21) neglects tyre slip, as in the thesis; the observer has K_us from before.",
        claims=(
            Claim(
                "4.1, Fig. 11",
                "relative error at 46 km/h, from wheel speeds",
                20.0,
                _median([_relative_percent(drive, _WSS, False) for drive in drives]),
                "%",
                "RMS between 20 and 200 deg, median of five",
            ),
            Claim("4.1, Fig. 11", "underestimated at the largest amplitude", 20.0, left, "deg", note),
            Claim("4.1, Fig. 11", "underestimated at the other side's", 15.0, right, "deg", note),
            Claim(
                "4.1, Fig. 11",
                "of the manoeuvre's time with the truth in the observer's 95 % interval",
                None,
                _median([100.0 * _covered(drive) for drive in drives]),
                "%",
                "median of five",
            ),
            Claim(
                "4.1, Fig. 11", "underestimated at either side, the larger, by our observer", None, ours, "deg", note
            ),
        ),
        size_in=(5.2, 4.4),
    )


def _hard(drives: list[Manoeuvre], others: dict[str, Manoeuvre]) -> Figure:
    shown = drives[0]
    ninety = _FROM_DEG + 0.9 * (_TO_DEG - _FROM_DEG)
    rate = np.max(np.abs(np.diff(shown.true_deg))) * 100.0

    def seconds(method: Method) -> float:
        return _median([_ninety_percent_s(drive, method) for drive in drives])

    def draw(canvas: Canvas) -> None:
        axes, below = _above_and_below(canvas, shown, (_WSS, _OBSERVER))
        for level, name in ((ninety, f"90 %: {ninety:g} deg"), (_PRINTED_DEG, f"printed: {_PRINTED_DEG:g} deg")):
            axes.axhline(level, color=MUTED, lw=0.8, ls=":")
            axes.text(0.0, level + 1.5, name, fontsize=8, color=MUTED)
        there_s = _TURN_S - shown.begin_s + _PRINTED_S
        axes.axvline(there_s, color=MUTED, lw=1.0, ls="--")
        below.axvline(there_s, color=MUTED, lw=1.0, ls="--", label=f"thesis: 90 % after {_PRINTED_S:g} s")
        below.legend(loc="lower right", fontsize=7, ncols=2)

    note = (
        "from the start of the turn, of the estimate's own change, means over 0.11 s, median of five; the simulated "
        "tractor "
        "is alone and light, and its steering does not lag"
    )
    share = 100.0 * (_FROM_DEG - _PRINTED_DEG) / (_FROM_DEG - _TO_DEG)
    return Figure(
        "12",
        "A hard turn at 72 km/h",
        draw,
        "A machine turns the wheel from 60 to -50 deg at 260 deg/s. The wheel speeds give the motion of the truck, "
        "so they lag behind the hands; the observer inverts (13).",
        claims=(
            Claim("4.1, Fig. 12", "rate of the steering wheel", 260.0, rate, "deg/s", "the scenario's"),
            Claim(
                "4.1, Fig. 12", "seconds to 90 % of its change, from wheel speeds", _PRINTED_S, seconds(_WSS), "s", note
            ),
            *(
                Claim(
                    "4.1, Fig. 12",
                    f"seconds to 90 % of its change, from wheel speeds, {name}",
                    _PRINTED_S,
                    _ninety_percent_s(other, _WSS),
                    "s",
                    "one drive; so the difference comes from effects that are not simulated here: a compliant "
                    "steering that swings, and the sensors' own filters",
                )
                for name, other in others.items()
            ),
            Claim("4.1, Fig. 12", "seconds to 90 % of its change, our observer", None, seconds(_OBSERVER), "s", note),
        ),
        misprints=(
            Misprint(
                "4.1, Fig. 12",
                "90 % of the change is from 60° to −29°",
                f"to {ninety:g}°",
                f"60 to −29 is {share:.0f} % of 60 to −50 (and 90 % of 60 to "
                f"{_FROM_DEG + (_PRINTED_DEG - _FROM_DEG) / 0.9:.0f})",
                abs(share - 90.0) > 5.0,
            ),
        ),
        size_in=(5.2, 4.4),
    )


def _ninety_percent_s(drive: Manoeuvre, method: Method) -> float:
    """Time from the start of the turn until the estimate has reached 90 % of its final change."""
    begin_s = _TURN_S - drive.begin_s
    estimate = drive.estimates_deg[method]
    before, rest = np.mean(estimate[drive.time_s < begin_s]), np.mean(estimate[drive.time_s > begin_s + 2.0])
    calm = np.convolve(estimate, np.full(11, 1.0 / 11.0), mode="same")
    there = (calm <= before + 0.9 * (rest - before)) & (drive.time_s > begin_s)
    return float(drive.time_s[np.argmax(there)]) - begin_s


def _by_gyro(drives: list[Manoeuvre]) -> Figure:
    shown = drives[0]
    fifteen = np.full_like(shown.time_s, 15.0)
    sway = [float(np.max(np.abs(drive.truth.table["lateral_acceleration_m_s2"].to_numpy()))) for drive in drives]
    gradient = shown.truth.understeer_gradient / DEGREE
    at_2 = [2.0 * _lacking_deg(drive, _YRS, True) / float(np.mean(_held_acceleration(drive))) for drive in drives]
    apart = [float(np.mean(drive.estimates_deg[_WSS] - drive.estimates_deg[_YRS])) for drive in drives]
    return Figure(
        "14",
        "Wheel speeds and gyro agree, and neglect the same",
        lambda canvas: _with_error(canvas, shown, (_WSS, _YRS), "15 to 20 deg at 2 m/s²", fifteen, fifteen + 5.0),
        "The manoeuvre of Figure 11: (21) from wheel speeds (WSS) and L r/v from the yaw rate sensor (YRS) both "
        "give the Ackermann angle.",
        claims=(
            Claim(
                "4.2, Fig. 14", "understeer gradient K_us/g of the truck", 0.4, gradient, "deg/(m/s²)", "the scenario's"
            ),
            Claim("4.2, Fig. 14", "largest lateral acceleration", 2.0, _median(sway), "m/s²", "the scenario's"),
            Claim(
                "4.2, Fig. 14",
                "error at 2 m/s² without it: 15 to 20",
                15.0,
                _median(at_2),
                "deg",
                "underestimation by the gyro while the wheel is held, scaled to 2 m/s²; 0.4 times 19.3 times 2 is "
                f"{0.4 * 19.3 * 2.0:.1f}",
            ),
            Claim(
                "4.1, Fig. 14",
                "mean of WSS minus YRS, which agree according to the thesis",
                0.0,
                _median(apart),
                "deg",
                "median of five",
            ),
            Claim(
                "4.2",
                "error per m/s² of a truck with 5 deg/(m/s²) at a ratio of 20, by the Ackermann angle alone",
                100.0,
                _error_per_m_s2(5.0, 20.0),
                "deg",
                "(31) with and without K_us",
            ),
        ),
        size_in=(5.2, 4.4),
    )


def _held_acceleration(drive: Manoeuvre) -> Array:
    held = drive.true_deg > 0.98 * np.max(drive.true_deg)
    return drive.truth.table["lateral_acceleration_m_s2"].to_numpy()[held]


def _error_per_m_s2(gradient_deg: float, ratio: float) -> float:
    """(31) minus L r/v at 1 m/s^2, deg at the steering wheel."""
    speed, yaw_rate, wheelbase = 10.0, 0.1, 3.7
    ackermann = wheelbase * yaw_rate / speed
    whole = ackermann + gradient_deg * DEGREE * speed * yaw_rate
    return ratio * (whole - ackermann) / DEGREE


_NAMES = {_WSS: "wheel speeds (21)", _YRS: "yaw rate, $L\\,r/v$", _OBSERVER: "our observer"}
_COLOURS = {_WSS: THESIS, _YRS: OTHER, _OBSERVER: OURS}


def _with_error(canvas: Canvas, drive: Manoeuvre, methods: tuple[Method, ...], said: str, *errors_deg: Array) -> None:
    """Draws the drive with the errors that the thesis states, by those words, to both sides."""
    _, below = _above_and_below(canvas, drive, methods)
    for error in errors_deg:
        for side in (-1.0, 1.0):
            below.plot(drive.time_s, side * error, color=MUTED, lw=1.0, ls="--")
    below.plot([], [], color=MUTED, lw=1.0, ls="--", label=f"thesis: {said}")
    low, high = below.get_ylim()
    below.set_ylim(low - 0.25 * (high - low), high)  # room for the legend
    below.legend(loc="lower right", fontsize=7, ncols=2)


def _above_and_below(canvas: Canvas, drive: Manoeuvre, methods: tuple[Method, ...]) -> tuple[Axes, Axes]:
    """The angles above, their errors below, the observer's with its interval."""
    above: Axes
    below: Axes
    above, below = canvas.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    above.plot(drive.time_s, drive.true_deg, color=INK, lw=1.6, label="true")
    for method in methods:
        estimate = drive.estimates_deg[method]
        above.plot(drive.time_s, estimate, color=_COLOURS[method], lw=1.0, label=_NAMES[method])
        error = estimate - drive.true_deg
        below.plot(drive.time_s, error, color=_COLOURS[method], lw=0.9)
        if method == _OBSERVER:
            sides = error - drive.half_width_deg, error + drive.half_width_deg
            below.fill_between(drive.time_s, *sides, color=OURS, alpha=0.25, lw=0.0, label="its 95 % interval")
    above.set(ylabel="steering wheel angle (deg)")
    above.legend()
    below.axhline(0.0, color=INK, lw=0.8)
    below.set(xlabel="time (s)", ylabel="error (deg)")
    return above, below
