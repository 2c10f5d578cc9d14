"""Figures 1, 3 and 7: the steering system, what returns a wheel, and a banked road. (19)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Circle, Ellipse

from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.thesis.drives import simulated
from oncenter.thesis.figure import (
    FIFTH,
    GRID,
    INK,
    MUTED,
    OURS,
    THESIS,
    TRUTH,
    Claim,
    Exhibit,
    Figure,
    Misprint,
    Progress,
)
from oncenter.thesis.sketch import arc, arrow, at, blank, box, dashed, label, line, wheel

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


def run(progress: Progress) -> list[Exhibit]:
    """The sketches, and the effect of a banked road on an accelerometer."""
    return [
        Figure(
            "1",
            "A truck's steering system",
            _steering_system,
            "From the steering wheel to the front wheels, seen from above with the column folded out. The sensor sits "
            "below the steering wheel: the play and the wind-up of the column and of all later parts lie between its "
            "angle, δ, and the front wheels' angle δ_f.",
        ),
        Figure(
            "3",
            "Self-aligning torque of a wheel",
            _self_aligning,
            "A steered wheel from the side. Its lateral force F_y (towards the reader) acts behind the point where the "
            "king pin's axis meets the ground: by the king pin's own trail and by the tyre's. Force times both is the "
            "self-aligning torque M_SAT.",
            size_in=(5.2, 3.6),
        ),
        Figure(
            "7",
            "A road that falls to the right",
            _banked_road,
            "The truck from behind. Driving straight on a bank θ, the accelerometer across the truck reads "
            "g sin θ (19): positive, to the left, where the road falls to the right (ISO 8855).",
            claims=_bank_claims(),
            misprints=(_axis_misprint(),),
        ),
    ]


def _felt_m_s2(slope_percent: float) -> tuple[float, float]:
    """Specific force across and along the truck while it holds its lane on a straight that falls to the right."""
    road = {"sections": [{"length_m": 3000.0, "cross_slope_percent": slope_percent}], "repeat": False}
    even = {"speed_km_h": [60.0, 60.0], "lane_wander_sd_m": 0.0, "hand_motion_sd_deg": 0.0}
    drive = {"duration_s": 150.0, "standing_at_start_s": 1.0, "standing_at_end_s": 0.0}
    _, truth = simulated("both_ways", {"drive": drive, "road": road, "driver": even})
    late = truth.table[6000:11000]  # after speeding up, before braking
    across, along = late["felt_lateral_acceleration_m_s2"].mean(), late["longitudinal_acceleration_m_s2"].mean()
    assert isinstance(across, float) and isinstance(along, float)
    return across, along


def _bank_claims() -> tuple[Claim, ...]:
    claims = [
        Claim(
            "2.5, (19)",
            f"lateral acceleration read while driving straight on a cross slope of {percent:g} %",
            printed,
            _felt_m_s2(percent)[0],
            "m/s²",
            "the simulated truck holding its lane at 60 km/h, without sensor errors",
        )
        for percent, printed in ((2.0, 0.2), (7.0, 0.7))
    ]
    claims += [
        Claim(
            "2.5",
            f"a cross slope of {percent:g} % as an angle",
            printed,
            float(np.arctan(percent / 100.0)) / DEGREE,
            "deg",
        )
        for percent, printed in ((2.0, 1.1), (7.0, 4.0), (8.0, 4.6))
    ]
    return tuple(claims)


def _axis_misprint() -> Misprint:
    across, along = _felt_m_s2(7.0)
    of_19 = float(STANDARD_GRAVITY * np.sin(np.arctan(0.07)))
    return Misprint(
        "2.5, above (19)",
        "a sensor along the vehicle's longitudinal axis measures g sin θ_bank",
        "along its lateral axis",
        f"on 7 % of cross slope the simulated truck has {across:.2f} m/s² across and {abs(along):.2f} "
        f"along; (19) says {of_19:.2f}",
        abs(across - of_19) < 0.02 and abs(along) < 0.02,
    )


def _steering_system(canvas: Canvas) -> None:
    axes = blank(canvas, (0.0, 10.0), (0.0, 6.6))
    axes.add_patch(Ellipse((1.7, 5.5), 2.2, 0.8, fill=False, edgecolor=INK, lw=3.2))
    line(axes, [(0.75, 5.5), (2.65, 5.5)], lw=1.4)
    line(axes, [(1.7, 5.5), (1.7, 3.6)], lw=2.0)
    box(axes, (1.7, 4.75), 0.62, 0.3, "", facecolor=OURS, edgecolor=OURS)
    label(axes, (2.15, 4.75), "angle sensor (SAS): δ", OURS, ha="left")
    label(axes, (3.0, 5.6), "steering wheel", ha="left")
    label(axes, (2.0, 4.15), "column: compliant, winds up", MUTED, ha="left", fontsize=8)
    box(axes, (1.7, 3.25), 1.9, 0.75, "steering gear\n$i_{gear}$ ≈ 20 : 1")
    label(axes, (2.8, 3.25), "hydraulic assistance", MUTED, ha="left", fontsize=8)
    line(axes, [(1.7, 2.87), (1.7, 1.9)], lw=2.6)
    label(axes, (0.2, 2.35), "Pitman\narm", ha="left", fontsize=8)
    line(axes, [(1.7, 1.9), (4.2, 1.9)], lw=2.0)
    label(axes, (2.95, 2.12), "drag link", fontsize=8)
    left, right = (4.2, 1.25), (8.6, 1.25)
    line(axes, [left, right], color=GRID, lw=9, zorder=1)
    label(axes, (6.4, 1.25), "axle beam", MUTED, fontsize=8)
    turn = 12.0 * DEGREE
    for pin, side in ((left, -1.0), (right, 1.0)):
        hub = pin[0] + 0.55 * side, pin[1]
        line(axes, [pin, hub], lw=1.6, zorder=3)
        wheel(axes, hub, 90.0 * DEGREE + turn, 1.15, 0.34)
        axes.add_patch(Circle(pin, 0.1, facecolor=INK, edgecolor=INK, zorder=4))
        line(axes, [pin, (pin[0] - 0.25 * side, pin[1] - 0.8)], lw=1.8, zorder=3)
    line(axes, [(4.2, 1.9), left], lw=1.8, zorder=3)
    line(axes, [(left[0] + 0.25, 0.45), (right[0] - 0.25, 0.45)], lw=2.0)
    label(axes, (6.4, 0.2), "track rod", fontsize=8)
    label(axes, (4.75, 1.62), "king pin", fontsize=8, ha="left")
    hub = right[0] + 0.55, right[1]
    dashed(axes, [hub, at(hub, 2.0, 90.0 * DEGREE)])
    dashed(axes, [hub, at(hub, 2.0, 90.0 * DEGREE + turn)])
    arc(axes, hub, 1.6, 90.0 * DEGREE, 90.0 * DEGREE + turn, TRUTH)
    label(axes, (hub[0] - 0.2, hub[1] + 2.2), "$\\delta_f$", TRUTH)
    for place in ((1.7, 1.9), (4.2, 1.9), (left[0] + 0.25, 0.45), (right[0] - 0.25, 0.45)):
        axes.add_patch(Circle(place, 0.09, facecolor=FIFTH, edgecolor=FIFTH, zorder=5))
    label(axes, (5.3, 2.75), "● joints: each adds to the play", FIFTH, ha="left", fontsize=8)


def _self_aligning(canvas: Canvas) -> None:
    axes = blank(canvas, (-3.3, 3.3), (-0.95, 3.4))
    hub, caster, behind_m = (0.0, 1.25), 12.0 * DEGREE, 0.6  # more of both than trucks have, to be seen
    axes.add_patch(Circle(hub, 1.25, facecolor=GRID, edgecolor=INK, lw=1.4, zorder=1))
    axes.add_patch(Circle(hub, 0.1, facecolor=INK, zorder=3))
    line(axes, [(-3.2, 0.0), (3.2, 0.0)], lw=1.6)
    foot, top = (-1.25 * np.tan(caster), 0.0), (1.75 * np.tan(caster), 3.0)
    dashed(axes, [foot, top], color=INK, lw=1.1)
    label(axes, (top[0] + 0.65, 2.85), "king pin's axis", fontsize=8, ha="left")
    angles = np.linspace(30.0 * DEGREE, -215.0 * DEGREE, 40)  # clockwise from above
    ring = [(top[0] - 0.06 + 0.42 * np.cos(a), 2.78 + 0.16 * np.sin(a)) for a in angles]
    line(axes, ring[:-1], color=FIFTH)
    arrow(axes, ring[-4], ring[-1], FIFTH)
    label(axes, (top[0] - 0.85, 2.9), "$M_{SAT}$", FIFTH)
    arrow(axes, (-1.6, 2.0), (-3.0, 2.0), TRUTH)
    label(axes, (-2.3, 2.25), "rolls this way, $v$", TRUTH, fontsize=8)
    force = behind_m, 0.12
    axes.add_patch(Circle(force, 0.13, facecolor="none", edgecolor=THESIS, lw=1.5, zorder=4))
    axes.add_patch(Circle(force, 0.04, facecolor=THESIS, edgecolor=THESIS, zorder=4))
    label(axes, (behind_m + 0.5, 0.3), "$F_y$", THESIS)
    for x in (foot[0], 0.0, behind_m):
        line(axes, [(x, 0.0), (x, -0.5)], color=MUTED, lw=0.8)
    arrow(axes, (foot[0], -0.4), (0.0, -0.4), MUTED, "<|-|>")
    arrow(axes, (0.0, -0.4), (behind_m, -0.4), MUTED, "<|-|>")
    label(axes, (foot[0] - 0.1, -0.4), "king pin's trail", fontsize=8, ha="right")
    label(axes, (behind_m + 0.1, -0.4), "tyre's trail", fontsize=8, ha="left")
    dashed(axes, [(0.0, 0.0), hub])


def _banked_road(canvas: Canvas) -> None:
    axes = blank(canvas, (-4.2, 4.2), (-1.5, 4.3))
    bank = 12.0 * DEGREE  # more than roads have, to be seen
    down, out = -bank, 0.5 * np.pi - bank  # along the road to the right, and off it
    begin, end = at((0.0, 0.0), -3.9, down), at((0.0, 0.0), 3.7, down)
    line(axes, [begin, end], lw=2.0)
    dashed(axes, [begin, (end[0], begin[1])])
    arc(axes, begin, 1.9, 0.0, down, MUTED)
    label(axes, at(begin, 2.4, 0.5 * down), "$\\theta_{bank}$")

    def on_truck(across: float, up: float) -> tuple[float, float]:
        return at(at((0.0, 0.0), across, down), up, out)

    for side in (-1.0, 1.0):
        corners = [on_truck(side * 0.95 + a, u) for a, u in ((-0.2, 0.0), (0.2, 0.0), (0.2, 0.75), (-0.2, 0.75))]
        axes.fill(*zip(*corners, strict=True), facecolor=MUTED, edgecolor=INK, lw=1.0, zorder=2)
    body = [on_truck(a, u) for a, u in ((-1.2, 0.6), (1.2, 0.6), (1.2, 3.3), (-1.2, 3.3))]
    axes.fill(*zip(*body, strict=True), facecolor=GRID, edgecolor=INK, lw=1.2, zorder=1)
    centre = on_truck(0.0, 1.7)
    axes.add_patch(Circle(centre, 0.1, facecolor=INK, zorder=5))
    weight, along = 2.0, 2.0 * np.sin(bank)
    arrow(axes, centre, (centre[0], centre[1] - weight))
    label(axes, (centre[0] + 0.22, centre[1] - weight + 0.9), "$g$")
    foot = at(centre, -np.sqrt(weight**2 - along**2), out)
    dashed(axes, [centre, foot], color=INK)
    arrow(axes, foot, (centre[0], centre[1] - weight), THESIS)
    label(axes, (centre[0] + 0.85, centre[1] - weight - 0.25), "$g\\,\\sin\\theta_{bank}$", THESIS)
    arrow(axes, centre, at(centre, -2.4, down), OURS)
    label(axes, (-2.75, 2.75), "reading of the\naccelerometer, $a_{y,g} > 0$", OURS, fontsize=8)
