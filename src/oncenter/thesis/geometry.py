"""Figure 2: Ackermann's geometry, and the angles of (1), (2) and (3) from the front wheels' speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from matplotlib.patches import Circle

import oncenter as oc
from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.thesis.figure import (
    FIFTH,
    INK,
    MUTED,
    OTHER,
    OURS,
    THESIS,
    TRUTH,
    Claim,
    Exhibit,
    Figure,
    Misprint,
    Progress,
)
from oncenter.thesis.sketch import arc, arrow, at, blank, dashed, dimension, label, line, wheel

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_TRACKS_M = (1.8, 2.05, 2.3)
_RATIO_SHOWN_DEG = 500.0  # Figure 10's largest steering wheel angle


def run(progress: Progress) -> list[Exhibit]:
    """(2) and (3) on speeds from Ackermann's geometry."""
    truck = oc.vehicle("scania_r730_4x2")
    assert truck.track_width_front_m is not None
    wheelbase, track = truck.wheelbase_m, truck.track_width_front_m
    angles = np.linspace(0.05, 42.0, 840) * DEGREE
    errors = {T: _relative_error(wheelbase, T, angles) for T in _TRACKS_M}
    of_track = _relative_error(wheelbase, track, angles)
    at_the_wheels = _RATIO_SHOWN_DEG / truck.ratio_near_centre * DEGREE
    at_most = float(np.interp(at_the_wheels, angles, of_track))
    printed = _equation_2_error(wheelbase, track, angles, "left")
    corrected = _equation_2_error(wheelbase, track, angles, "right")
    exact = _core.front_wheel_angles(wheelbase, track, *left_turn(wheelbase, track, angles), exact=True) - angles

    def drawn_errors(canvas: Canvas) -> None:
        _errors(canvas, angles, errors, at_the_wheels, (printed, corrected, exact))

    return [
        Figure(
            "2",
            "Ackermann's geometry",
            _geometry,
            "All wheels roll about one point on the rear axle's line. Drawn to scale for a left turn of the truck of "
            "Table 2; both front wheels turn at one rate, which is (1). δ_f is the angle in the middle of the axle.",
            size_in=(5.2, 3.9),
        ),
        Figure(
            "2+",
            "What (2) and (3) lose",
            drawn_errors,
            "Above: (3) against the angle for which the wheel speeds were computed, wheelbase 3.7 m, by track width. "
            "Dotted: Figure 10's 500 deg at the steering wheel. Below: (2), with R_l as printed, with "
            "R_r, and "
            "this code's solution that needs no radius.",
            claims=(
                Claim(
                    "2.2, (3)",
                    "relative error of (3) at 500 deg of steering wheel, as far as Figure 10 goes",
                    None,
                    100.0 * at_most,
                    "%",
                    "the thesis only says that the neglected terms are small; computed from Ackermann's geometry",
                ),
                Claim(
                    "2.2, (2)",
                    "largest error of this code's (2), solved for R, below 42 deg",
                    None,
                    float(np.max(np.abs(exact))) / DEGREE,
                    "deg",
                    "the same speeds; the equation's own radius follows from them",
                ),
            ),
            misprints=_misprints(wheelbase, track, angles, printed, corrected),
            size_in=(5.2, 5.0),
        ),
    ]


def left_turn(wheelbase: float, track: float, angles: Array) -> tuple[Array, Array]:
    """Speeds of the left and right front wheels, (1), per speed of the rear axle's middle; the front axle's middle
    points along `angles`."""
    middle = wheelbase / np.tan(angles)
    return np.hypot(middle - track / 2, wheelbase) / middle, np.hypot(middle + track / 2, wheelbase) / middle


def _relative_error(wheelbase: float, track: float, angles: Array) -> Array:
    left, right = left_turn(wheelbase, track, angles)
    return _core.front_wheel_angles(wheelbase, track, left, right, exact=False) / angles - 1.0


def _equation_2(wheelbase: float, track: float, v_l: Array, v_r: Array, radius: Array) -> Array:
    """(2) as printed, except for the choice of the radius."""
    q = v_l**2 / v_r**2
    sine = 2 * wheelbase / track * (q - 1) / (q + 1 - track**2 / (2 * radius**2))
    return 0.5 * np.arcsin(np.clip(sine, -1.0, 1.0))


def _equation_2_error(wheelbase: float, track: float, angles: Array, side: str) -> Array:
    """rad, in right turns, in which (2) is positive."""
    right, left = left_turn(wheelbase, track, angles)  # mirrored
    middle = wheelbase / np.tan(angles)
    outer = track / 2 if side == "left" else -track / 2
    return _equation_2(wheelbase, track, left, right, np.hypot(middle + outer, wheelbase)) - angles


def _misprints(wheelbase: float, track: float, angles: Array, printed: Array, corrected: Array) -> tuple[Misprint, ...]:
    left, right = left_turn(wheelbase, track, angles)
    ten = int(np.argmin(np.abs(angles - 10.0 * DEGREE)))
    of_3 = 0.5 * np.arcsin(4 * wheelbase / track * (left[ten] - right[ten]) / (left[ten] + right[ten]))
    of_2 = _equation_2(wheelbase, track, left, right, np.hypot(wheelbase / np.tan(angles) + track / 2, wheelbase))[ten]
    worst, best = (float(np.max(np.abs(errors))) / DEGREE for errors in (printed, corrected))
    return (
        Misprint(
            "2.2, (2)",
            "1 − L_tw²/(2 R_l²) in the denominator",
            "R_r in place of R_l",
            f"right turns up to 42 deg: the error of (2) is up to {worst:.2f} deg as printed, {best:.0e} deg with R_r",
            worst > 0.1 > 1e-6 > best,
        ),
        Misprint(
            "2.2, (2) and (3); 4.1, (21)",
            "v_l ahead of v_r: right turns are positive",
            "left is positive everywhere else; exchange v_l and v_r, r_l and r_r",
            f"a left turn of 10 deg gives {of_2 / DEGREE:.2f} by (2) and {of_3 / DEGREE:.2f} by (3)",
            bool(of_2 < 0.0 and of_3 < 0.0),
        ),
    )


def _errors(
    canvas: Canvas, angles: Array, errors: dict[float, Array], marked: float, of_2: tuple[Array, Array, Array]
) -> None:
    above, below = canvas.subplots(2, 1, sharex=True)
    for (track, error), colour in zip(errors.items(), (OURS, THESIS, OTHER), strict=True):
        above.plot(angles / DEGREE, 100.0 * error, color=colour, label=f"track width {track:g} m")
    above.axvline(marked / DEGREE, color=MUTED, ls=":", lw=1.0)
    above.set(ylabel="error of (3) (%)")
    above.legend()
    for error, colour, style, name in zip(
        of_2, (THESIS, TRUTH, OURS), ("-", "-", "--"), ("(2) as printed", "(2) with R_r", "this code's"), strict=True
    ):
        below.plot(angles / DEGREE, error / DEGREE, color=colour, ls=style, label=name.replace("R_r", "$R_r$"))
    below.set(xlabel="front wheel angle $\\delta_f$ (deg)", ylabel="error (deg)", xlim=(0.0, 45.0))
    below.legend()


def _geometry(canvas: Canvas) -> None:
    axes = blank(canvas, (-8.6, 3.1), (-1.6, 6.0))
    L, T, X = 3.7, 2.05, 6.6  # m; Table 2's truck
    centre, half = (-X, 0.0), T / 2
    line(axes, [(0.0, 0.0), (0.0, L)], lw=2.4)
    line(axes, [(-half, L), (half, L)], lw=2.4)
    line(axes, [(-half, 0.0), (half, 0.0)], lw=2.4)
    for x in (-half, half):
        wheel(axes, (x, 0.0), np.pi / 2, 1.05, 0.32)
        towards = float(np.arctan2(L, X + x))
        wheel(axes, (x, L), np.pi / 2 + towards, 1.05, 0.32)
        dashed(axes, [centre, (x, L)])
        colour = OURS if x < 0 else THESIS
        side = "l" if x < 0 else "r"
        arrow(axes, (x, L), at((x, L), 0.2 * float(np.hypot(X + x, L)), np.pi / 2 + towards), colour)
        tip = at((x, L), 0.2 * float(np.hypot(X + x, L)) + 0.35, np.pi / 2 + towards)
        label(axes, tip, f"$v_{side}$", colour)
        along = 0.4 if x < 0 else 0.52
        label(axes, (centre[0] + along * (X + x), along * L), f"$R_{side}$", colour, ground=True)
    dashed(axes, [centre, (-half, 0.0)])
    axes.add_patch(Circle(centre, 0.11, facecolor=INK, edgecolor=INK))
    label(axes, (centre[0], -0.45), "turning centre", fontsize=8)
    middle = float(np.arctan2(L, X))
    dashed(axes, [centre, (0.0, L)], color=FIFTH)
    arc(axes, centre, 2.1, 0.0, middle, FIFTH)
    label(axes, at(centre, 2.5, 0.32 * middle), "$\\delta_f$", FIFTH)
    dimension(axes, (2.0, 0.0), (2.0, L), "$L$")
    dimension(axes, (-half, -0.9), (half, -0.9), "$L_{tw}$", (0.0, -0.4))
