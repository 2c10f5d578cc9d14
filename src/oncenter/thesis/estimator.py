"""5.2 and 5.5.4: the samples of (36) and its variance, and the estimator from wheel speeds alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

import oncenter as oc
from oncenter.estimates.estimates import METHODS
from oncenter.signals import DEGREE
from oncenter.thesis.drives import SEED, simulated
from oncenter.thesis.figure import MUTED, OURS, THESIS, Claim, Exhibit, Figure, Misprint, Progress, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_SEEDS = range(SEED, SEED + 8)
_LARGE_DEG = 10.0  # 5.2: rarely exceeded
_LAGS_S = np.linspace(0.0, 20.0, 81)


def run(progress: Progress) -> list[Exhibit]:
    """Eight half hours with the thesis's truck, which has 3 deg of play, evaluated by three methods."""
    truck = oc.vehicle("scania_r730_4x2")
    errors: dict[str, list[float]] = {method: [] for method in METHODS}
    residuals, by_43, by_batches = [], [], []
    gated_wrongly_s = 0.0
    for k, seed in enumerate(_SEEDS):
        signals, truth = simulated("thesis_drive", seed=seed)
        for method in METHODS:
            answer = oc.offset(signals, truck, method=method)
            assert answer.offset.value is not None
            errors[method].append((answer.offset.value - truth.offset_rad) / DEGREE)
            if method == "thesis":
                residuals.append(_residual_deg(answer))
                assert answer.variance_if_independent_rad2 is not None and answer.offset.ci95 is not None
                by_43.append(1.96 * answer.variance_if_independent_rad2**0.5 / DEGREE)
                by_batches.append(0.5 * (answer.offset.ci95[1] - answer.offset.ci95[0]) / DEGREE)
        speed = signals.columns["vehicle_speed_m_s"]
        gated_wrongly_s += float(np.sum((np.abs(speed) < 0.3) & (speed > 10.0))) / signals.rate_hz
        progress((k + 1) / len(_SEEDS))
    together = np.concatenate(residuals)
    memory = np.mean([_autocorrelation(residual) for residual in residuals], axis=0)

    def draw(canvas: Canvas) -> None:
        _draw(canvas, together, memory)

    figure = Figure(
        "(42)",
        "What the estimator averages, and its memory",
        draw,
        "Above: measured less modelled angle δ − δ̂ at every clean tick of eight simulated half hours; dashed, the "
        "10 deg "
        "which the thesis calls rarely exceeded. Below: its autocorrelation, which (43) takes for zero beyond the "
        "first "
        "point, and which lasts for tens of seconds.",
        claims=_claims(together, errors, by_43, by_batches, memory),
        misprints=(
            Misprint(
                "5.1.2, (34)",
                "|v̂_x| < v̇_x,max",
                "the longitudinal acceleration, with its dot",
                f"as printed, {gated_wrongly_s:g} s of {len(_SEEDS)} half hours pass it and condition 2, 10 m/s, "
                "together; "
                f"with the dot {len(together) / 100.0:.0f} s pass the whole gate",
                gated_wrongly_s == 0.0,
            ),
        ),
        size_in=(5.2, 4.6),
    )
    return [figure, _from_wheel_speeds(errors["wheel-speed"])]


def _residual_deg(answer: oc.Answer) -> Array:
    """delta - delta_hat of (37) at the clean ticks, in order, minus its mean."""
    rows = oc.trace(answer)
    clean = rows[rows["reasons"] == ""]
    ratio = answer.vehicle.ratio_near_centre
    gradient = answer.understeer_gradient.value or 0.0
    modelled_rest = ratio * gradient * clean["lateral_acceleration_m_s2"]
    residual = (clean["residual_rad"] - modelled_rest) / DEGREE
    return np.asarray(residual - residual.mean())


def _autocorrelation(residual: Array) -> Array:
    lags = np.round(_LAGS_S * 100.0).astype(int)
    whole = float(np.mean(residual**2))
    return np.array([np.mean(residual[: len(residual) - lag] * residual[lag:]) / whole for lag in lags])


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _claims(
    together: Array, errors: dict[str, list[float]], by_43: list[float], by_batches: list[float], memory: Array
) -> tuple[Claim, ...]:
    drives = f"{len(_SEEDS)} half hours with 3 deg of play and 2 % of crown"
    return (
        Claim(
            "5.2",
            "of clean ticks with δ − δ̂ beyond 10 deg, which is rare",
            None,
            100.0 * float(np.mean(np.abs(together) > _LARGE_DEG)),
            "%",
            drives,
        ),
        Claim(
            "5.2, (43)",
            "95 % half-width of the offset if the variance of (43) were its variance",
            None,
            float(np.median(by_43)),
            "deg",
            "median; the thesis calls it very low",
        ),
        Claim(
            "5.2",
            "95 % half-width of the offset from means of 5 s batches",
            None,
            float(np.median(by_batches)),
            "deg",
            "the core's, median",
        ),
        Claim(
            "5.2",
            "actual error of the thesis's offset",
            None,
            _rms(errors["thesis"]),
            "deg",
            f"RMS over {drives}: play on a crowned road biases the mean (5.3.3)",
        ),
        Claim(
            "5.2",
            "autocorrelation of δ − δ̂ after one second, assumed zero",
            0.0,
            float(np.interp(1.0, _LAGS_S, memory)),
            "",
            "mean of the drives; why (42) is no best estimator, as the thesis says",
        ),
        Claim(
            "5.6",
            "the estimation error was less than",
            2.0,
            float(np.max(np.abs(errors["thesis"]))),
            "deg",
            f"largest of {drives}, the thesis's method over the whole drive",
        ),
        Claim(
            "5.6",
            "with further improvements it is expected to be under",
            1.0,
            float(np.max(np.abs(errors["joint"]))),
            "deg",
            f"largest of {drives}, the joint method",
        ),
    )


def _from_wheel_speeds(errors: list[float]) -> Table:
    truck = oc.vehicle("scania_r730_4x2")
    front, rear, L = truck.track_width_front_m, truck.track_width_rear_m, truck.wheelbase_m
    assert front is not None and rear is not None
    rows = []
    for at_wheel_deg in (20.0, 100.0, 400.0):
        steer, v = at_wheel_deg / truck.ratio_near_centre * DEGREE, 15.0
        left, right = _front_wheels(L, front, steer, v)
        printed, with_arcsin = _third_bullet(L, front, left, right, truck.ratio_near_centre)
        yaw_rate = v * np.tan(steer) / L
        rows.append(
            (
                f"{at_wheel_deg:g} deg",
                f"{printed / DEGREE:.1f} deg",
                f"{with_arcsin / DEGREE:.1f} deg",
                f"{_second_bullet(front, left, right, steer):.4f}",
                f"{yaw_rate:.4f} rad/s, {yaw_rate / v:.5f} 1/m",
            )
        )
    return Table(
        "§5.5.4",
        "The substitutions for wheel speeds alone",
        ("angle", "δ̂ as printed", "with arcsin", "1/R as printed", "r and 1/R"),
        tuple(rows),
        "5.5.4's bullets on speeds that Ackermann's geometry gives at 15 m/s, front track 2.05 m.",
        (
            Claim(
                "5.5.4",
                "largest error of the offset from wheel speeds and the angle alone",
                None,
                float(np.max(np.abs(errors))),
                "deg",
                f"{len(errors)} half hours; radii follow only from the drive's net turning, and without an "
                "accelerometer the crown is not measured",
            ),
        ),
        _wheel_speed_misprints(L, front, rear, truck.ratio_near_centre),
    )


def _front_wheels(L: float, track: float, steer: float, v: float) -> tuple[float, float]:
    """m/s, left and right, for the speed v of the rear axle's middle and front wheels at Ackermann angles."""
    middle = L / np.tan(steer)
    left, right = (float(v / middle * np.hypot(middle + side * track / 2, L)) for side in (-1.0, 1.0))
    return left, right


def _third_bullet(L: float, track: float, left: float, right: float, ratio: float) -> tuple[float, float]:
    """rad: as printed, and with its arcsin."""
    inside = 4 * L / track * (right - left) / (right + left)
    return ratio * 0.5 * float(np.sin(inside)), ratio * 0.5 * float(np.arcsin(inside))


def _second_bullet(track: float, left: float, right: float, steer: float) -> float:
    q = right / left
    return float((left + right) / 2 * 2 / (track * np.cos(steer)) * (q - 1) / (q + 1))


def _wheel_speed_misprints(L: float, front: float, rear: float, ratio: float) -> tuple[Misprint, ...]:
    steer = 200.0 / ratio * DEGREE
    left, right = _front_wheels(L, front, steer, 15.0)
    printed, right_one = _third_bullet(L, front, left, right, ratio)
    r = 15.0 * float(np.tan(steer)) / L
    of_front, of_rear = (_second_bullet(track, left, right, steer) for track in (front, rear))
    slow = _second_bullet(front, *_front_wheels(L, front, steer, 5.0), steer)
    offset = 5.0 * DEGREE  # of a sensor, which (delta - delta_a) must subtract
    without = _second_bullet(front, left, right, steer + offset / ratio)
    return (
        Misprint(
            "5.5.4, third bullet",
            "δ̂ = i ½ sin(…)",
            "i ½ arcsin(…), as (3)",
            f"at 200 deg it gives {printed / DEGREE:.1f} deg, with arcsin {right_one / DEGREE:.1f}",
            abs(right_one - 200.0 * DEGREE) < 0.005 * 200.0 * DEGREE < abs(printed - 200.0 * DEGREE),
        ),
        Misprint(
            "5.5.4, second bullet",
            "R̂⁻¹ = (v_fl + v_fr)/2 …",
            "that is the yaw rate r; without the leading mean speed it is 1/R, of the front axle",
            f"at 200 deg and 15 m/s it gives {of_front:.4f}, and r is {r:.4f} rad/s; at 5 m/s {slow:.4f}, and 1/R "
            "is the same",
            abs(of_front / r - 1.0) < 0.01 and abs(slow / of_front - 1.0 / 3.0) < 1e-9,
        ),
        Misprint(
            "5.5.4",
            "L_tw is the rear axle's track width",
            "the front axle's, whose wheels it takes",
            f"the second bullet is {100.0 * abs(of_front / r - 1.0):.1f} % off with the front track and "
            f"{100.0 * abs(of_rear / r - 1.0):.1f} % with the rear one's",
            abs(of_front / r - 1.0) < 0.01 < abs(of_rear / r - 1.0),
        ),
        Misprint(
            "5.5.4, second bullet",
            "cos((δ − δ_a)/i)",
            "δ_o: the sensor's offset has to be subtracted; δ_a is not defined",
            "no symbol list has δ_a; an offset of 5 deg left in changes r by "
            f"{1e2 * abs(without / of_front - 1.0):.2f} %",
            abs(without / of_front - 1.0) < 0.01,
        ),
    )


def _draw(canvas: Canvas, together: Array, memory: Array) -> None:
    above, below = canvas.subplots(2, 1)
    above.hist(together, bins=np.arange(-15.0, 15.1, 0.5).tolist(), color=OURS, density=True)
    for side in (-1.0, 1.0):
        above.axvline(side * _LARGE_DEG, color=THESIS, ls="--", lw=1.0)
    above.set(
        xlabel="$\\delta-\\hat\\delta$ minus its mean (deg)", ylabel="density (1/deg)", yscale="log", xlim=(-15.0, 15.0)
    )
    below.plot(_LAGS_S, memory, color=OURS)
    below.plot([0.0, 0.0, _LAGS_S[-1]], [1.0, 0.0, 0.0], color=THESIS, ls="--", lw=1.0, label="assumed by (43)")
    below.axhline(0.0, color=MUTED, lw=0.6)
    below.set(xlabel="lag (s of clean driving)", ylabel="autocorrelation", ylim=(-0.3, 1.05))
    below.legend()
