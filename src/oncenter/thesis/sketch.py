"""Elements of schematic figures: lines, arrows, wheels, arcs of angles and dimensions, on axes to scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import FancyBboxPatch, Polygon

from oncenter.thesis.figure import GRID, INK, MUTED, PAPER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

Point = tuple[float, float]


def blank(canvas: Canvas, across: Point, up: Point) -> Axes:
    """Axes without frame, with the given width and height, one unit the same length both ways."""
    axes = canvas.subplots()
    axes.set(xlim=across, ylim=up, aspect="equal")
    axes.set_axis_off()
    return axes


def at(origin: Point, length: float, angle: float) -> Point:
    """The point that far away in that direction, rad counter-clockwise from right."""
    return origin[0] + length * float(np.cos(angle)), origin[1] + length * float(np.sin(angle))


def line(axes: Axes, points: Sequence[Point], **style: Any) -> None:
    axes.plot(*zip(*points, strict=True), **{"color": INK, "lw": 1.2, "solid_capstyle": "round", **style})


def dashed(axes: Axes, points: Sequence[Point], **style: Any) -> None:
    line(axes, points, **{"color": MUTED, "lw": 0.8, "ls": (0, (4, 3)), **style})


def arrow(axes: Axes, tail: Point, head: Point, color: str = INK, style: str = "-|>", bend: float = 0.0) -> None:
    axes.annotate(
        "",
        head,
        tail,
        arrowprops={
            "arrowstyle": style,
            "color": color,
            "lw": 1.3,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 9,
            "connectionstyle": f"arc3,rad={bend}",
        },
    )


def dimension(axes: Axes, first: Point, second: Point, text: str, aside: Point = (0.0, 0.0)) -> None:
    """A distance between two points, its name at the middle and `aside`."""
    arrow(axes, first, second, MUTED, "<|-|>")
    middle = 0.5 * (first[0] + second[0]) + aside[0], 0.5 * (first[1] + second[1]) + aside[1]
    label(axes, middle, text, ground=True)


def arc(axes: Axes, centre: Point, radius: float, begin: float, end: float, color: str = INK) -> None:
    """An angle from one direction to another, rad, with an arrow at its end."""
    angles = np.linspace(begin, end, 40)
    points = [at(centre, radius, float(angle)) for angle in angles]
    line(axes, points[:-1], color=color)
    arrow(axes, points[-3], points[-1], color)


def label(axes: Axes, place: Point, text: str, color: str = INK, ground: bool = False, **style: Any) -> None:
    box = {"facecolor": PAPER, "edgecolor": "none", "pad": 1.0} if ground else None
    axes.text(*place, text, **{"color": color, "ha": "center", "va": "center", "fontsize": 9, "bbox": box, **style})


def wheel(axes: Axes, centre: Point, angle: float, length: float, width: float) -> None:
    """Draws a wheel from above, rolling in the direction of `angle`, rad."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [length / 2, width / 2]
    axes.add_patch(Polygon(corners @ turn.T + centre, closed=True, facecolor=GRID, edgecolor=INK, lw=1.1, zorder=2))


def box(axes: Axes, centre: Point, width: float, height: float, text: str, **style: Any) -> None:
    corner = centre[0] - width / 2, centre[1] - height / 2
    shape = FancyBboxPatch(
        corner,
        width,
        height,
        boxstyle=f"round,pad=0,rounding_size={min(width, height) * 0.15}",
        **{"facecolor": PAPER, "edgecolor": INK, "lw": 1.1, "zorder": 3, **style},
    )
    axes.add_patch(shape)
    axes.text(*centre, text, color=INK, ha="center", va="center", fontsize=8.5, zorder=4)
