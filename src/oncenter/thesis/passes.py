"""Figure 19: the offset from single passes over one straight, the estimator restarted at each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

import oncenter as oc
from oncenter.offset.budget import Truck, as_corrected_rad
from oncenter.offset.run import outputs_of
from oncenter.signals import DEGREE, Signals
from oncenter.thesis.drives import simulated
from oncenter.thesis.figure import MUTED, OURS, THESIS, TRUTH, Claim, Exhibit, Figure, Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_DIRECTIONS_DEG = {"north-west": 315.0, "south-east": 135.0}
_ALONG_DEG = 6.0  # of the direction: more is the way round at the ends
_PASS_MIN_S = 60.0
_ENOUGH_S = 20.0  # of estimation, 5.5.1


@dataclass(frozen=True)
class _Pass:
    """One pass: the estimate over the time since its start, and its seconds of evidence."""

    direction: str
    time_s: Array
    offset_deg: Array
    evidence_s: Array

    @property
    def final_deg(self) -> float:
        return float(self.offset_deg[-1])

    @property
    def enough_deg(self) -> float:
        """The offset after 20 s of estimation."""
        return float(self.offset_deg[np.searchsorted(self.evidence_s, _ENOUGH_S)])


@dataclass(frozen=True)
class _Known:
    """The result of the drive of chapter 3, and the truth; deg."""

    midpoint_deg: float
    place_sd_deg: float
    true_deg: float
    joint_deg: float  # by this code's own method from the whole drive
    bias_deg_s: float  # of the yaw rate
    bias_cost_deg: float  # its effect on the thesis's offset, (48) as corrected

    @property
    def band_deg(self) -> tuple[float, float]:
        """The band that the thesis draws: 95 % of the places of the reference drive."""
        return self.midpoint_deg - 1.96 * self.place_sd_deg, self.midpoint_deg + 1.96 * self.place_sd_deg


def run(progress: Progress) -> list[Exhibit]:
    """Half an hour to and fro over the straight at 15 m/s, and chapter 3's slow drive over the same one."""
    slow, _ = simulated("both_ways")
    progress(0.3)
    measured = oc.reference(slow)
    assert measured.offset.value is not None
    signals, truth = simulated("straight_runs")
    progress(0.6)
    truck = oc.vehicle("scania_r730_4x2")
    joint = oc.offset(signals, truck).offset.value
    assert joint is not None
    passes = _passes(signals)
    progress(0.9)
    speed_m_s = signals.columns["vehicle_speed_m_s"]
    fast_m_s = float(speed_m_s[speed_m_s > 10.0].mean())
    moving = Truck(truck.ratio_near_centre, truck.wheelbase_m, 0.0, fast_m_s, 0.0)
    known = _Known(
        midpoint_deg=measured.offset.value / DEGREE,
        place_sd_deg=measured.place_standard_deviation_rad / DEGREE,
        true_deg=truth.offset_rad / DEGREE,
        joint_deg=joint / DEGREE,
        bias_deg_s=truth.yaw_rate_bias_rad_s / DEGREE,
        bias_cost_deg=as_corrected_rad(moving, truth.yaw_rate_bias_rad_s, 0.0) / DEGREE,
    )
    return [_figure(passes, known)]


def _passes(signals: Signals) -> list[_Pass]:
    """Each whole one, by the thesis's method with Table 4's parameters."""
    truck = oc.vehicle("scania_r730_4x2")
    heading_deg = signals.columns["heading_deg"]
    passes = []
    for direction, along_deg in _DIRECTIONS_DEG.items():
        on_it = np.abs((heading_deg - along_deg + 180.0) % 360.0 - 180.0) < _ALONG_DEG
        edges = np.flatnonzero(np.diff(np.concatenate(([False], on_it, [False])).astype(np.int8)))
        for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if (end - first) / signals.rate_hz < _PASS_MIN_S:
                continue
            answer = oc.offset(replace(signals, table=signals.table[first:end]), truck, method="thesis")
            outputs = outputs_of(answer)
            begun = outputs["evidence"] > 0.0
            if not (outputs["evidence"] > _ENOUGH_S).any():
                continue
            passes.append(
                _Pass(
                    direction,
                    (outputs["time"] - outputs["time"][0])[begun],
                    outputs["offset"][begun] / DEGREE,
                    outputs["evidence"][begun],
                )
            )
    return passes


def _finals_deg(passes: Sequence[_Pass], direction: str) -> Array:
    return np.array([p.final_deg for p in passes if p.direction == direction])


def _figure(passes: list[_Pass], known: _Known) -> Figure:
    north_west, south_east = (_finals_deg(passes, direction) for direction in _DIRECTIONS_DEG)
    finals = np.concatenate((north_west, south_east))
    low, high = known.band_deg
    binned_deg = float(north_west.mean() + south_east.mean()) / 2.0
    settled_deg = float(np.sqrt(np.mean([(p.enough_deg - p.final_deg) ** 2 for p in passes])))

    def draw(canvas: Canvas) -> None:
        axes = canvas.subplots()
        for direction, color in zip(_DIRECTIONS_DEG, (THESIS, OURS), strict=True):
            of_it = [p for p in passes if p.direction == direction]
            for p in of_it:
                axes.plot(p.time_s, p.offset_deg, color=color, linewidth=0.8, alpha=0.8)
                axes.plot(p.time_s[-1], p.final_deg, "o", color=color, markersize=4)
            axes.plot([], [], "o-", color=color, markersize=4, label=f"to the {direction}, {len(of_it)} passes")
        axes.axhline(known.midpoint_deg, color=MUTED, label="measured as in chapter 3")
        for bound in known.band_deg:
            axes.axhline(bound, color=MUTED, linestyle="--", linewidth=1.0)
        axes.plot([], [], color=MUTED, linestyle="--", linewidth=1.0, label="95 % of its places")
        axes.axhline(known.true_deg, color=TRUTH, linestyle=":", label="true")
        axes.set_xlim(0.0)
        axes.set_ylim(min(low, float(finals.min())) - 0.3, max(high, float(finals.max())) + 2.6)
        axes.set_xlabel("time since the begin of the pass (s)")
        axes.set_ylabel("offset (deg)")
        axes.legend(loc="upper left", ncols=2)

    return Figure(
        "19",
        "Single passes over one straight",
        draw,
        "A straight of 1.5 km that bends by 3 deg to the left on the way north-west, at 15 m/s, by the thesis's "
        "method "
        "with Table 4, restarted at each pass; K_us is not learned on it. 3 deg of play and the crown, which falls "
        "to the other side on the way back, separate the directions. Grey: chapter 3's slow drive over the straight.",
        claims=(
            Claim(
                "5.4, Fig. 19",
                "passes to the north-west that end above the measured mean: in general",
                None,
                100.0 * float((north_west > known.midpoint_deg).mean()),
                "%",
                f"{len(north_west)} passes",
            ),
            Claim(
                "5.4, Fig. 19",
                "passes to the south-east that end below it: in general",
                None,
                100.0 * float((south_east < known.midpoint_deg).mean()),
                "%",
                f"{len(south_east)} passes",
            ),
            Claim("5.5.1, Fig. 19", "lowest final estimate", 0.0, float(finals.min()), "deg"),
            Claim("5.5.1, Fig. 19", "highest final estimate", 4.0, float(finals.max()), "deg"),
            Claim(
                "5.4, Fig. 19",
                "final estimates within the 95 % band",
                100.0,
                100.0 * float(((finals > low) & (finals < high)).mean()),
                "%",
                "the band is 1.96 standard deviations of the reference drive's places, as in the thesis; it is not "
                "the "
                "interval of their mean, which is ten times narrower",
            ),
            Claim(
                "5.5.1",
                "change of a pass's estimate after 20 s, 300 m",
                None,
                settled_deg,
                "deg",
                "root mean square over all passes; 20 s are enough for one pass, but not for the play",
            ),
            Claim(
                "5.5.1",
                "offset as the mean of both directions' means",
                2.04,
                binned_deg,
                "deg",
                f"the truth is {known.true_deg:.2f} deg; a yaw rate bias of {known.bias_deg_s:.2f} deg/s "
                f"reduces it by {known.bias_cost_deg:.2f} deg",
            ),
            Claim(
                "5.5.1",
                "offset by this code's own method from the whole drive",
                2.04,
                known.joint_deg,
                "deg",
                f"the truth is {known.true_deg:.2f} deg; it corrects the yaw rate and models the play",
            ),
        ),
        size_in=(5.2, 4.0),
    )
