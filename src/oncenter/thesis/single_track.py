"""Figures 4 and 6: the single-track model's quantities, drawn from one steady left turn so that all angles fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Circle

from oncenter.signals import DEGREE
from oncenter.thesis.figure import FIFTH, INK, MUTED, OTHER, OURS, THESIS, TRUTH, Exhibit, Figure, Progress
from oncenter.thesis.sketch import arc, arrow, at, blank, dashed, dimension, label, line, wheel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_WHEELBASE_M, _REAR_M = 3.7, 1.75  # l_r is more than a tractor has, for room
# of one steady turn, larger than on roads, to be seen: rear tyres' motion 12 deg to the right of where they point
_STEER, _SLIP_FRONT, _SLIP_REAR = 45.0 * DEGREE, 13.0 * DEGREE, 12.0 * DEGREE


def run(progress: Progress) -> list[Exhibit]:
    """Both sketches."""
    return [
        Figure(
            "4",
            "The single-track model",
            _steady,
            "A steady left turn, forward is to the right. Wheels do not move where they point: the slip angles are "
            "α_f and α_r (here as in (8): positive where the wheel points further into the turn than it moves), so the "
            "turning centre lies ahead of the rear axle and δ_f = L/R + α_f − α_r.",
            size_in=(5.2, 4.3),
        ),
        Figure(
            "6",
            "The single-track model with its forces",
            _dynamic,
            "The quantities of (13) to (18): lateral forces F_f and F_r, yaw rate r, side slip β at the centre of "
            "gravity, which lies l_f behind the front and l_r ahead of the rear axle.",
            size_in=(5.2, 3.2),
        ),
    ]


def _turning_centre() -> tuple[float, float]:
    """The point where the perpendiculars to both axles' motion meet; the rear axle is at the origin."""
    front, rear = _STEER - _SLIP_FRONT, -_SLIP_REAR
    distance = _WHEELBASE_M / (np.tan(front) - np.tan(rear))  # across, from the truck's middle
    return float(-np.tan(rear) * distance), float(distance)


def _body(axes: Axes) -> tuple[tuple[float, float], tuple[float, float]]:
    rear, front = (0.0, 0.0), (_WHEELBASE_M, 0.0)
    dashed(axes, [(-0.9, 0.0), (_WHEELBASE_M + 1.9, 0.0)])
    line(axes, [rear, front], lw=2.2)
    wheel(axes, rear, 0.0, 0.95, 0.3)
    wheel(axes, front, _STEER, 0.95, 0.3)
    return rear, front


def _steady(canvas: Canvas) -> None:
    axes = blank(canvas, (-1.4, 6.3), (-1.9, 5.2))
    rear, front = _body(axes)
    centre = _turning_centre()
    gravity = (_REAR_M, 0.0)
    for place in (rear, front):
        dashed(axes, [centre, place])
    dashed(axes, [centre, (centre[0], 0.0)])
    axes.add_patch(Circle(centre, 0.1, facecolor=INK, edgecolor=INK))
    label(axes, (centre[0], centre[1] + 0.35), "turning centre", fontsize=8)
    line(axes, [centre, gravity], color=MUTED)
    label(axes, (0.5 * (centre[0] + gravity[0]) + 0.05, 0.55 * centre[1]), "$R$", ground=True)
    motions = ((rear, -_SLIP_REAR, 0.0, "r"), (front, _STEER - _SLIP_FRONT, _STEER, "f"))
    for place, motion, points, name in motions:
        arrow(axes, place, at(place, 1.9, motion), TRUTH)
        dashed(axes, [place, at(place, 2.1, points)])
        begin, end = sorted((motion, points))
        arc(axes, place, 1.5, begin, end, THESIS)
        label(axes, at(place, 2.2 if name == "r" else 2.35, 0.5 * (begin + end)), f"$\\alpha_{name}$", THESIS)
    arc(axes, front, 1.05, 0.0, _STEER, FIFTH)
    label(axes, at(front, 1.3, 0.25 * _STEER), "$\\delta_f$", FIFTH)
    arrow(axes, gravity, (gravity[0] + 1.1, 0.0), OURS)
    label(axes, (gravity[0] + 0.95, -0.3), "$v_x$", OURS)
    arrow(axes, gravity, (gravity[0], 0.75), OURS)
    label(axes, (gravity[0] + 0.32, 0.75), "$v_y$", OURS)
    axes.add_patch(Circle(gravity, 0.1, facecolor=INK, edgecolor=INK, zorder=5))
    arc(axes, gravity, 0.55, 200.0 * DEGREE, 320.0 * DEGREE, OTHER)
    label(axes, (gravity[0] - 0.65, -0.55), "$r$", OTHER)
    dimension(axes, (0.0, -1.35), (_WHEELBASE_M, -1.35), "$L$")


def _dynamic(canvas: Canvas) -> None:
    axes = blank(canvas, (-1.3, 6.2), (-1.9, 2.6))
    rear, front = _body(axes)
    gravity = (_REAR_M, 0.0)
    centre = _turning_centre()
    slip = float(np.arctan2(centre[0] - gravity[0], centre[1]))  # of the centre of gravity's motion, clockwise
    arrow(axes, rear, at(rear, 1.3, 90.0 * DEGREE), THESIS)
    label(axes, (-0.35, 1.2), "$F_r$", THESIS)
    arrow(axes, front, at(front, 1.5, 90.0 * DEGREE + _STEER), THESIS)
    label(axes, (front[0] - 1.25, 1.3), "$F_f$", THESIS)
    arrow(axes, gravity, at(gravity, 1.45, -slip), TRUTH)
    label(axes, at(gravity, 1.3, -slip + 0.22), "$v$", TRUTH)
    arc(axes, gravity, 1.15, 0.0, -slip, TRUTH)
    label(axes, (gravity[0] + 0.8, -0.3), "$\\beta$", TRUTH)
    arrow(axes, front, at(front, 1.9, _STEER - _SLIP_FRONT), TRUTH)
    dashed(axes, [front, at(front, 2.3, _STEER)])
    arc(axes, front, 1.2, 0.0, _STEER, FIFTH)
    label(axes, at(front, 1.5, 0.3 * _STEER), "$\\delta_f$", FIFTH)
    label(axes, at(front, 2.25, _STEER - _SLIP_FRONT - 0.05), "$\\beta_f$", TRUTH)
    axes.add_patch(Circle(gravity, 0.12, facecolor=INK, edgecolor=INK, zorder=5))
    arc(axes, gravity, 0.6, 110.0 * DEGREE, 240.0 * DEGREE, OTHER)
    label(axes, (gravity[0] - 0.35, 0.95), "$r,\\ I_z,\\ m$", OTHER)
    dimension(axes, (0.0, -1.35), (_REAR_M, -1.35), "$l_r$")
    dimension(axes, (_REAR_M, -1.35), (_WHEELBASE_M, -1.35), "$l_f$")
    for x in (0.0, _REAR_M, _WHEELBASE_M):
        dashed(axes, [(x, -0.25), (x, -1.5)])
