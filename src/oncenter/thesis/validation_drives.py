"""Figures 8 and 9, chapter 3: the drive round a track, and the straight driven both ways."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

import oncenter as oc
from oncenter.signals import DEGREE, Signals
from oncenter.thesis.drives import simulated
from oncenter.thesis.figure import INK, OTHER, OURS, THESIS, Claim, Exhibit, Figure, Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_UPPER_DEG, _LOWER_DEG, _MIDDLE_DEG, _SD_DEG = 3.60, 0.48, 2.04, 1.19  # chapter 3, to compare with


def run(progress: Progress) -> list[Exhibit]:
    """The shipped scenarios of both drives."""
    lap = _lap()
    progress(0.5)
    return [lap, _both_ways()]


def _lap() -> Figure:
    _, truth = simulated("test_track")
    table = truth.table
    east, north, speed, curvature = (
        table[name].to_numpy() for name in ("east_m", "north_m", "vehicle_speed_m_s", "road_curvature_1_m")
    )
    moving = speed > 1.0
    km_h = 3.6 * speed[moving]
    station = table["station_m"].to_numpy()
    straight = np.abs(curvature) < 1.0 / 10_000.0

    def draw(canvas: Canvas) -> None:
        axes = canvas.subplots()
        every = slice(None, None, 50)
        points = axes.scatter(east[every], north[every], c=3.6 * speed[every], s=3, cmap="viridis", vmin=0, vmax=90)
        axes.set(xlabel="east (m)", ylabel="north (m)", aspect="equal")
        canvas.colorbar(points, ax=axes, label="speed (km/h)", shrink=0.8)

    return Figure(
        "8",
        "The path driven",
        draw,
        "Half an hour of the simulated tractor on a track of the thesis's kind: a diagonal of 1.5 km, driven at the "
        "highest speed, and the way back. The true position.",
        claims=(
            Claim("3, Fig. 8", "length of the drive", 30.0, float(table["time_s"][-1]) / 60.0, "min", "as configured"),
            Claim(
                "3, Fig. 8", "mean speed", 50.0, float(np.mean(km_h)), "km/h", "while moving; the scenario's own choice"
            ),
            Claim("3, Fig. 8", "highest speed", 90.0, float(np.max(km_h)), "km/h", "the scenario's own choice"),
            Claim(
                "5.4",
                "length of the diagonal path",
                1.5,
                _longest(straight, station) / 1000.0,
                "km",
                "it bends by 2 deg (5.5.1): its arc counts as straight",
            ),
        ),
        size_in=(5.2, 4.2),
    )


def _longest(straight: npt.NDArray[np.bool_], station: Array) -> float:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], straight.astype(int), [0]))))
    begins, ends = edges[::2], edges[1::2] - 1
    return float(np.max(station[ends] - station[begins]))


def _both_ways() -> Figure:
    signals, truth = simulated("both_ways")
    found = oc.reference(signals)
    lower, upper = sorted(way.mean_rad / DEGREE for way in found.ways)
    middle = found.offset.value
    assert middle is not None
    accelerations = _by_place(signals, found)

    def draw(canvas: Canvas) -> None:
        _three(canvas, found, accelerations)

    printed_middle = 0.5 * (_UPPER_DEG + _LOWER_DEG)
    note = "simulated with an offset of 2.04 deg; play and crown chosen so that the two ways differ as in Figure 9"
    speeds = [3.6 * way.passes[0].mean_speed_m_s for way in found.ways]
    return Figure(
        "9",
        "One straight, both ways",
        draw,
        "By oncenter reference in the simulated drive: the truck's distance from the line fitted to its "
        "positions, the steering wheel angle and the lateral acceleration, there and back. Dashed: the thesis's two "
        "means "
        "and their midpoint. The crown's acceleration is mirrored, so that the midpoint is free of it.",
        claims=(
            Claim("3, Fig. 9", "mean steering wheel angle one way", _UPPER_DEG, upper, "deg", note),
            Claim("3, Fig. 9", "mean steering wheel angle the other way", _LOWER_DEG, lower, "deg", note),
            Claim(
                "3, Fig. 9",
                "their midpoint, the offset",
                _MIDDLE_DEG,
                middle / DEGREE,
                "deg",
                f"oncenter reference; the truth is {truth.offset_rad / DEGREE:.2f}; the printed two means give "
                f"{printed_middle:.2f}",
            ),
            Claim(
                "3",
                "standard deviation that goes with it",
                _SD_DEG,
                found.place_standard_deviation_rad / DEGREE,
                "deg",
                "of both ways' half sums from place to place; not of all samples, for which the two means alone make "
                f"{0.5 * (_UPPER_DEG - _LOWER_DEG):.2f} deg",
            ),
            Claim(
                "3",
                "standard deviation of the midpoint itself",
                None,
                found.standard_deviation_rad / DEGREE,
                "deg",
                "from the scatter of eight parts of the straight",
            ),
            Claim("3", "slowest mean speed of a pass", 10.0, min(speeds), "km/h", "the scenario's"),
            Claim("3", "fastest mean speed of a pass", 10.5, max(speeds), "km/h", "the scenario's"),
            Claim(
                "3",
                "standard deviation of positions across the fitted line",
                0.5,
                found.residual_sd_m,
                "m",
                "the receiver's 0.5 m and the driver's wander about the line",
            ),
        ),
        size_in=(5.2, 5.6),
    )


def _by_place(signals: Signals, found: oc.Reference) -> list[Array]:
    """Mean lateral acceleration of each way over the places of its profile, in the order of `along_m`, m/s^2."""
    count = len(found.profiles["along_m"])
    measured = signals.columns["lateral_acceleration_m_s2"]
    means = []
    for way in found.ways:
        first, last = way.passes[0].rows
        share = np.linspace(0.0, count, last - first + 1, endpoint=False).astype(int)  # at an even speed
        profile = np.bincount(share, measured[first : last + 1]) / np.bincount(share)
        means.append(profile if way.passes[0].forward else profile[::-1])
    return means


def _three(canvas: Canvas, found: oc.Reference, accelerations: list[Array]) -> None:
    across, angle, acceleration = canvas.subplots(3, 1, sharex=True)
    along, profiles = found.profiles["along_m"], found.profiles
    for k, (key, colour) in enumerate((("there", OURS), ("back", OTHER))):
        name = f"to the {found.ways[k].compass}"
        across.plot(along, profiles[f"{key}_m"], color=colour, label=name)
        angle.plot(along, profiles[f"{key}_rad"] / DEGREE, color=colour)
        angle.axhline(found.ways[k].mean_rad / DEGREE, color=colour, lw=0.8)
        acceleration.plot(along, accelerations[k], color=colour)
    for value in (_UPPER_DEG, _MIDDLE_DEG, _LOWER_DEG):
        angle.axhline(value, color=THESIS, ls="--", lw=1.0)
        place = {"xycoords": ("axes fraction", "data"), "fontsize": 8, "va": "center"}
        angle.annotate(f"{value:.2f}", (1.01, value), color=THESIS, **place)
    across.set(ylabel="off the line (m)")
    across.legend(ncols=2, loc="upper right")
    angle.set(ylabel="angle measured (deg)")
    acceleration.axhline(0.0, color=INK, lw=0.8)
    acceleration.set(xlabel="along the straight (m)", ylabel="$a_y$ measured (m/s²)")
