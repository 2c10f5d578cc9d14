"""Figure 18: the position in the free play while the offset is estimated, and the effect of its mean, (49) to (51)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import oncenter as oc
from oncenter.findings import PLAY_STANDARD_DEG
from oncenter.offset.run import outputs_of
from oncenter.signals import DEGREE, Signals
from oncenter.simulate.truth import Truth
from oncenter.thesis.drives import simulated
from oncenter.thesis.figure import MUTED, OURS, THESIS, TRUTH, Claim, Exhibit, Figure, Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_BINS_DEG = np.linspace(-PLAY_STANDARD_DEG / 2.0, PLAY_STANDARD_DEG / 2.0, 26)
_TURNING_RAD_S = 0.2 * DEGREE
_OPEN_GATE = {"bank_max_m_s2": 1.0}  # the third road would shut Table 4's


@dataclass(frozen=True)
class _Driven:
    """Positions in the play at the samples used, and the offset's errors, deg.

    `mean_deg` is (49); `error_deg` that of (36) and (37) with the true K_us; `learned_error_deg` with the K_us that
    the thesis's method learned, or without K_us if it learned none.
    """

    title: str
    places_deg: Array
    turning_left: npt.NDArray[np.bool_]
    mean_deg: float
    error_deg: float
    learned_error_deg: float


def run(progress: Progress) -> list[Exhibit]:
    """Three roads of wide bends with 15 deg of play."""
    roads = (
        ("left and right bends alike, no crown", (13.0, -13.0), 0.0),
        ("two bends to the left for one to the right", (13.0, -6.0, 13.0), 0.0),
        ("a road that falls to the right by 5 %", (6.0, -6.0), 5.0),
    )
    driven = []
    for number, (title, turns_deg, crown_percent) in enumerate(roads, start=1):
        driven.append(_driven(title, *simulated("thesis_drive", _changes(turns_deg, crown_percent))))
        progress(number / len(roads))
    return [_figure(driven)]


def _changes(turns_deg: tuple[float, ...], crown_percent: float) -> dict[str, dict[str, Any]]:
    """Straights of 200 m and bends of 400 m in turn; free play is the only error."""
    sections = [
        part for turn_deg in turns_deg for part in ({"length_m": 200.0}, {"length_m": 400.0, "turn_deg": turn_deg})
    ]
    return {
        "drive": {"duration_s": 900.0},
        "road": {"kind": "sections", "clothoid_length_m": 80.0, "repeat": True, "crown_percent": crown_percent}
        | {"sections": sections},
        "driver": {"speed_km_h": [60.0, 80.0]},
        "steering": {"backlash_deg": PLAY_STANDARD_DEG},
        "sensors": {"yaw_rate": {"bias_deg_s": 0.0}, "lateral_acceleration": {"bias_m_s2": 0.0}},
    }


def _driven(title: str, signals: Signals, truth: Truth) -> _Driven:
    vehicle = oc.vehicle("scania_r730_4x2")
    answer = oc.offset(signals, vehicle, method="thesis", params=_OPEN_GATE)
    assert answer.offset.value is not None
    used = outputs_of(answer)["reasons"] == 0
    angle, r, v, a_y = (
        signals.columns[name][used]
        for name in (
            "steering_wheel_angle_rad",
            "yaw_rate_rad_s",
            "vehicle_speed_m_s",
            "lateral_acceleration_m_s2",
        )
    )
    modelled = vehicle.ratio_near_centre * (vehicle.wheelbase_m * r / v + truth.understeer_gradient * a_y)
    places_deg = truth.table["place_in_play"].to_numpy()[used] * PLAY_STANDARD_DEG / 2.0
    return _Driven(
        title=title,
        places_deg=places_deg,
        turning_left=truth.table["yaw_rate_rad_s"].to_numpy()[used] > _TURNING_RAD_S,
        mean_deg=float(places_deg.mean()),
        error_deg=(float(np.mean(angle - modelled)) - truth.offset_rad) / DEGREE,
        learned_error_deg=(answer.offset.value - truth.offset_rad) / DEGREE,
    )


def _figure(driven: list[_Driven]) -> Figure:
    even, skewed, one_sided = driven
    bound_deg = PLAY_STANDARD_DEG / 2.0
    apart_deg = max(abs(d.mean_deg - d.error_deg) for d in driven)

    def draw(canvas: Canvas) -> None:
        panels = canvas.subplots(len(driven), 1, sharex=True)
        for axes, d in zip(panels, driven, strict=True):
            share = np.histogram(d.places_deg, _BINS_DEG)[0] / len(d.places_deg) * 100.0
            axes.bar(_BINS_DEG[:-1], share, np.diff(_BINS_DEG), align="edge", color=TRUTH, alpha=0.55, linewidth=0.0)
            axes.axvline(d.mean_deg, color=OURS, label=f"(49): {d.mean_deg:+.2f} deg")
            axes.axvline(d.error_deg, color=THESIS, linestyle="--", label=f"the offset's error: {d.error_deg:+.2f} deg")
            axes.axvline(0.0, color=MUTED, linestyle=":", linewidth=0.9)
            axes.set_title(d.title)
            axes.set_ylabel("samples (%)")
            axes.legend(loc="center", bbox_to_anchor=(0.28, 0.72))  # left of the lines, right of the bar
        panels[-1].set_xlabel("place in the play B[k] (deg)")
        panels[-1].set_xlim(-bound_deg - 0.4, bound_deg + 0.4)

    return Figure(
        "18",
        "Position in the free play",
        draw,
        f"{PLAY_STANDARD_DEG:g} deg of play, the samples that pass the gate. The bars are true; the blue line is "
        "their mean, (49), and the dashed one the error of (36) and (37) with the true K_us. The "
        "thesis draws the first two by hand.",
        claims=(
            Claim(
                "5.3.3, (49)",
                "error of the offset less the play's mean place, largest of three roads",
                0.0,
                apart_deg,
                "deg",
                "with the true K_us; the rest is sensor noise and motion between steady states",
            ),
            Claim(
                "5.3.3, Fig. 18",
                "error where both flanks are used alike",
                0.0,
                even.error_deg,
                "deg",
                "bends left and right by turns",
            ),
            Claim(
                "5.3.3, (51)",
                "error where the torque hardly ever changes its sign, at most",
                bound_deg,
                one_sided.error_deg,
                "deg",
                "a road that falls by 5 % for the whole drive, its slip removed with the true K_us",
            ),
            Claim(
                "5.3.3",
                "error while the truck yaws to the left, 0 to 7.5 deg",
                None,
                float(even.places_deg[even.turning_left].mean()),
                "deg",
                "mean place of the play in the left bends of the first road",
            ),
            Claim(
                "5.3.3, (51)",
                "error there by the unchanged thesis method, which cannot learn K_us on such a drive",
                bound_deg,
                one_sided.learned_error_deg,
                "deg",
                "(51) bounds the play's share alone; a bank adds the effect of tyre slip",
            ),
            Claim(
                "5.5.1",
                "error on a road with two bends to the left for one to the right",
                None,
                skewed.error_deg,
                "deg",
                "the skewed distribution of Figure 18",
            ),
        ),
        size_in=(5.2, 5.2),
    )
