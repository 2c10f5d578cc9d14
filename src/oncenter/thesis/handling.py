"""Figure 5 and (7) to (13): the handling diagram, by payload and axle layout, and Winkler's equivalent wheelbase."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate.scenario import read_scenario
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
    Table,
)
from oncenter.thesis.steady import LAYOUTS, SATURATING, SteadyTruck, steady_truck

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]
Curve = tuple[Array, Array]  # across, deg; up, m/s^2

_COLOURS = (OURS, THESIS, TRUTH, OTHER)
_A_Y = np.linspace(0.05, 4.5, 30)  # m/s^2
_PAYLOADS_T = (0.0, 4.0, 8.0)
_RADII_M = (40.0, 80.0, 400.0)
_GENTLE_M_S2 = 1.5  # 5.1.3
_AT_M_S2 = 2.0  # lateral acceleration of the spreads over radius


def run(progress: Progress) -> list[Exhibit]:
    """Steady turns of six trucks."""
    tractor = steady_truck("4x2", **SATURATING)
    linear = steady_truck("4x2")
    wet = steady_truck("4x2", tyres=SATURATING["tyres"] | {"friction": 0.4})
    h_curves = {
        "linear tyres": _h_curve(linear, linear.wheelbase_m, 200.0),
        "saturating tyres, dry": _h_curve(tractor, tractor.wheelbase_m, 200.0),
        "saturating tyres, wet": _h_curve(wet, wet.wheelbase_m, 200.0),
    }
    progress(0.2)
    laden = {}
    for tonnes in _PAYLOADS_T:
        goods = {} if tonnes == 0.0 else {"payload": {"mass_kg": 1000.0 * tonnes, "distance_m": 3.1, "length_m": 4.0}}
        truck = steady_truck("4x2", **SATURATING, **goods, stiffness_load_exponent=0.8)
        laden[f"{tonnes:g} t on the coupling" if tonnes else "empty"] = _h_curve(truck, truck.wheelbase_m, 200.0)
    progress(0.4)
    trucks = {layout: steady_truck(layout, **SATURATING) for layout in LAYOUTS}
    by_layout = {name: _h_curve(truck, truck.equivalent_wheelbase_m, 200.0) for name, truck in trucks.items()}
    progress(0.6)
    tandem = trucks["6x4"]
    plain = {radius: _h_curve(tandem, tandem.wheelbase_m, radius) for radius in _RADII_M}
    winkler = {radius: _h_curve(tandem, tandem.equivalent_wheelbase_m, radius) for radius in _RADII_M}
    progress(0.8)

    def diagram(canvas: Canvas) -> None:
        _diagram(canvas, tractor.wheelbase_m, h_curves)

    def families(canvas: Canvas) -> None:
        _families(canvas, laden, by_layout)

    def collapse(canvas: Canvas) -> None:
        _collapse(canvas, plain, winkler)

    return [
        Figure(
            "5",
            "Handling diagram",
            diagram,
            "The thesis's tractor: V-lines L/R at three speeds, and H-curves α_r − α_f with linear tyres (4) and "
            "with tyres "
            "that saturate at 0.75 (dry) and 0.4 (wet) of their load. Their distance across is the front wheel "
            "angle; where the H-curve bends, (10) is no longer valid.",
            claims=_claims(linear, trucks),
            misprints=_misprints(linear),
            size_in=(5.2, 3.8),
        ),
        Figure(
            "5+",
            "H-curves by payload and by axle layout",
            families,
            "Above: the tractor with a load on its coupling. Below: four axle layouts, each with its equivalent "
            "wheelbase as L. To the left is understeer.",
            size_in=(5.2, 5.4),
        ),
        Figure(
            "5++",
            "Winkler's equivalent wheelbase",
            collapse,
            "A 6x4 truck in turns of three radii: (12)'s f_2 depends on 1/R with the wheelbase to the middle of the "
            "tandem (above), and hardly with the equivalent wheelbase (below).",
            size_in=(5.2, 5.0),
        ),
        _table(trucks),
    ]


def _h_curve(truck: SteadyTruck, wheelbase: float, radius_m: float) -> Curve:
    """L/R - delta_f, deg, at one radius."""
    deltas = [truck.front_wheel_angle(1.0 / radius_m, float(a_y)) for a_y in _A_Y]
    return (wheelbase / radius_m - np.array(deltas)) / DEGREE, _A_Y


def _needed(truck: SteadyTruck, wheelbase: float, radius_m: float, a_y: float) -> float:
    """f of (12), deg: the front wheel angle beyond L/R."""
    return (truck.front_wheel_angle(1.0 / radius_m, a_y) - wheelbase / radius_m) / DEGREE


def _table(trucks: dict[str, SteadyTruck]) -> Table:
    rows, claims = [], []
    for layout, truck in trucks.items():
        L, L_e = truck.wheelbase_m, truck.equivalent_wheelbase_m
        spread = [
            abs(_needed(truck, length, _RADII_M[0], _AT_M_S2) - _needed(truck, length, _RADII_M[-1], _AT_M_S2))
            for length in (L, L_e)
        ]
        gradient = truck.understeer_gradient / DEGREE
        rows.append((layout, f"{L:.2f}", f"{L_e:.2f}", f"{gradient:.2f}", f"{spread[0]:.3f}", f"{spread[1]:.3f}"))
        if layout != "4x2":
            claims.append(
                Claim(
                    "2.4.1, (12)",
                    f"{layout}: share of f_2's dependence on 1/R that is left with the equivalent wheelbase",
                    None,
                    100.0 * spread[1] / spread[0],
                    "%",
                    f"between {_RADII_M[0]:g} and {_RADII_M[-1]:g} m, {_AT_M_S2:g} m/s²; the thesis says it decreases",
                )
            )
    return Table(
        "(7)-(12)",
        "Equivalent wheelbases",
        ("layout", "L (m)", "L_e (m)", "K_us/g (deg/(m/s²))", "f_2 changes by, with L (deg)", "with L_e (deg)"),
        tuple(rows),
        "L reaches from the first axle to the middle of those that are not steered. How much f_2 of (12) changes "
        "from "
        f"{_RADII_M[0]:g} to {_RADII_M[-1]:g} m of radius at {_AT_M_S2:g} m/s² with tyres that saturate.",
        tuple(claims),
    )


def _claims(linear: SteadyTruck, trucks: dict[str, SteadyTruck]) -> tuple[Claim, ...]:
    v, radius = 5.0, 100.0
    whole = linear.front_wheel_angle(1.0 / radius, v * v / radius)
    curvature, a_y = 1.0 / 300.0, 1.2
    by_10 = linear.wheelbase_m * curvature + linear.understeer_gradient * a_y
    bends = [
        abs(_needed(t, t.equivalent_wheelbase_m, 400.0, _GENTLE_M_S2) - t.understeer_gradient * _GENTLE_M_S2 / DEGREE)
        for t in trucks.values()
    ]
    return (
        Claim(
            "2.4.1, (7)",
            "of the front wheel angle that (7) neglects at 5 m/s, its upper speed",
            None,
            100.0 * (1.0 - linear.wheelbase_m / radius / whole),
            "%",
            "the tractor of Table 2 in a steady turn; K_us v²/(g L) of (10)",
        ),
        *(
            Claim(
                "2.3",
                f"cornering stiffness of the {name} tyres, of their load per degree: 11 to 19 on radial tyres",
                None,
                100.0 * stiffness * DEGREE / load,
                "%",
                "the simulated tractor of Table 2, alone",
            )
            for name, stiffness, load in _tyres()
        ),
        Claim(
            "2.4.3, (13)",
            "steady state of (13) minus (10), of the front wheel angle",
            0.0,
            100.0 * (_of_13(linear, curvature, a_y) / by_10 - 1.0),
            "%",
            "(13) solved for no change, with the simulator's stiffnesses",
        ),
        Claim(
            "5.1.3",
            "largest deviation of an H-curve from (10)'s straight line below 1.5 m/s², over four axle layouts",
            None,
            max(bends),
            "deg",
            "at the front wheels, with tyres that saturate: why K_us is learned below 1.5 m/s² only",
        ),
    )


def _tyres() -> list[tuple[str, float, float]]:
    """Stiffness (N/rad) and load (N) of the tractor's axles."""
    truck = read_scenario("thesis_drive").truck
    rear = truck.mass_kg * STANDARD_GRAVITY * truck.front_axle_distance_m / truck.wheelbase_m
    return [
        ("front", truck.front_cornering_stiffness_n_rad, truck.mass_kg * STANDARD_GRAVITY - rear),
        ("rear", truck.rear_cornering_stiffness_n_rad, rear),
    ]


def _of_13(truck: SteadyTruck, curvature: float, a_y: float) -> float:
    """The front wheel angle at the steady state of (13) as printed; its C are those of one of an axle's two wheels."""
    m, l_f, l_r = truck.mass_kg, truck.ahead_m[0], -truck.ahead_m[1]
    C_f, C_r = truck.stiffness_n_rad / 2.0
    v = float(np.sqrt(a_y / curvature))
    inertia = 1.0  # has no effect at the steady state
    motion = np.array(
        [
            [-2.0 * (C_f * l_f**2 + C_r * l_r**2) / inertia / v, -2.0 * (C_f * l_f - C_r * l_r) / inertia],
            [-1.0 - 2.0 * (C_f * l_f - C_r * l_r) / m / v**2, -2.0 * (C_f + C_r) / m / v],
        ]
    )
    steered = np.array([2.0 * C_f * l_f / inertia, 2.0 * C_f / m / v])
    yaw_rate_per_angle = -np.linalg.solve(motion, steered)[0]
    return float(v * curvature / yaw_rate_per_angle)


def _misprints(truck: SteadyTruck) -> tuple[Misprint, ...]:
    curvature, a_y = 1.0 / 150.0, 1.5
    beta, delta = truck.side_slip(curvature, a_y)
    L = truck.wheelbase_m
    front = beta + truck.ahead_m[0] * curvature - delta  # (16)
    rear = beta + truck.ahead_m[1] * curvature  # (17)
    printed, other = L * curvature + front - rear, L * curvature - front + rear
    per_rad = a_y / STANDARD_GRAVITY / 0.13 / DEGREE
    as_angle = 19.3 * 0.4 / STANDARD_GRAVITY * 2.0
    units = {"r": (0, -1), "v": (1, -1), "a_y in the nomenclature": (1, -1)}
    of_product = tuple(a + b for a, b in zip(units["r"], units["v"], strict=True))
    return (
        Misprint(
            "2.4.1, (8); 4.1, (22) against 2.4.3, (16)-(18); 4.2, (23)",
            "δ_f = L/R + α_f − α_r",
            "with the slip angles of (16), (17) and (23): δ_f = L/R − α_f + α_r",
            f"in a steady left turn that takes {delta / DEGREE:.2f} deg, (8) gives {printed / DEGREE:.2f} with the "
            "signs "
            f"of (16) and (17), and {other / DEGREE:.2f} with both turned round",
            abs(printed - delta) > 0.01 > 1e-9 > abs(other - delta),
        ),
        Misprint(
            "Nomenclature",
            "a_y in m/s",
            "m/s²",
            f"(33) takes r v_x from it, which has dimension length^{of_product[0]} time^{of_product[1]}",
            of_product != units["a_y in the nomenclature"],
        ),
        Misprint(
            "4.2",
            "K_us of 0.4 or 5 deg/(m/s²)",
            "K_us/g; K_us of (10) is an angle",
            f"taken for K_us, 0.4 deg gives {as_angle:.1f} deg of error at 2 m/s² and ratio 19.3, and not 15 to 20; "
            "as "
            f"K_us/g it gives {as_angle * STANDARD_GRAVITY:.1f}",
            as_angle < 15.0 <= as_angle * STANDARD_GRAVITY <= 20.0,
        ),
        Misprint(
            "2.3",
            "cornering stiffness is 8 to 19 % of the vertical force",
            "per degree",
            f"13 % of the load per rad would take {per_rad:.0f} deg of slip at {a_y:g} m/s²; per deg it takes "
            f"{per_rad * DEGREE:.1f}",
            per_rad > 45.0,
        ),
    )


def _diagram(canvas: Canvas, wheelbase: float, h_curves: dict[str, Curve]) -> None:
    axes = canvas.subplots()
    for km_h, colour in zip((40.0, 60.0, 80.0), (OTHER, FIFTH, MUTED), strict=True):
        axes.plot(wheelbase * _A_Y / (km_h / 3.6) ** 2 / DEGREE, _A_Y, color=colour, label=f"V-line, {km_h:g} km/h")
    for (name, curve), colour, style in zip(h_curves.items(), (INK, OURS, THESIS), ("--", "-", "-"), strict=True):
        axes.plot(*curve, color=colour, ls=style, label=f"H-curve, {name}")
    axes.axvline(0.0, color=INK, lw=0.8)
    axes.axhline(_GENTLE_M_S2, color=MUTED, lw=0.8, ls=":")
    axes.text(6.2, _GENTLE_M_S2 + 0.06, "1.5 m/s² (5.1.3)", fontsize=8, color=MUTED, ha="right")
    level = 3.0
    left = float(np.interp(level, _A_Y, h_curves["saturating tyres, dry"][0]))
    right = wheelbase * level / (60.0 / 3.6) ** 2 / DEGREE
    arrow = {"arrowstyle": "<|-|>", "color": INK, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (left, level), (right, level), arrowprops=arrow)
    axes.text(0.5 * (left + right), level + 0.08, "$\\delta_f$", ha="center")
    axes.set(
        xlabel="$L/R$ and $\\alpha_r-\\alpha_f$ (deg)",
        ylabel="lateral acceleration $a_y$ (m/s²)",
        xlim=(-6.2, 6.3),
        ylim=(0.0, 4.5),
    )
    axes.legend(loc="lower left", fontsize=7)


def _families(canvas: Canvas, laden: dict[str, Curve], layouts: dict[str, Curve]) -> None:
    for axes, curves, side in zip(canvas.subplots(2, 1), (laden, layouts), ("L", "L_e"), strict=True):
        for (name, curve), colour in zip(curves.items(), _COLOURS, strict=False):
            axes.plot(*curve, color=colour, label=name)
        axes.axvline(0.0, color=INK, lw=0.8)
        axes.set(xlabel=f"${side}/R-\\delta_f$ (deg)", ylabel="$a_y$ (m/s²)", ylim=(0.0, 4.5), xlim=(-2.4, 0.1))
        axes.legend(loc="lower left")


def _collapse(canvas: Canvas, plain: dict[float, Curve], winkler: dict[float, Curve]) -> None:
    for axes, curves, side in zip(canvas.subplots(2, 1, sharex=True), (plain, winkler), ("L", "L_e"), strict=True):
        for (radius, curve), colour in zip(curves.items(), _COLOURS, strict=False):
            axes.plot(*curve, color=colour, label=f"R = {radius:g} m")
        axes.axvline(0.0, color=INK, lw=0.8)
        axes.set(xlabel=f"${side}/R-\\delta_f$ (deg)", ylabel="$a_y$ (m/s²)", ylim=(0.0, 4.5))
        axes.legend(loc="lower left")
