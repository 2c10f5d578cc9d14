"""Figure 13 and 2.3's slip angles: the turning centre of a simulated truck whose tyres slip."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.signals import DEGREE
from oncenter.simulate.scenario import read_scenario
from oncenter.simulate.truck import first_axle_distance_m
from oncenter.thesis.drives import simulated
from oncenter.thesis.figure import FIFTH, INK, MUTED, OURS, THESIS, TRUTH, Claim, Exhibit, Figure, Progress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_RARE_DEG = 2.0  # 2.3, 4.1
_TURNING_RAD_S = 0.03  # below this the centre is too far away to be computed


def run(progress: Progress) -> list[Exhibit]:
    """The moment of Figure 11's largest angle, and a whole ordinary drive."""
    scenario = read_scenario("thesis_drive")
    wheelbase = scenario.truck.wheelbase_m
    to_rear = wheelbase - first_axle_distance_m(scenario.truck)
    bend = simulated("mid_speed_manoeuvre")[1].table.filter(pl.col("time_s").is_between(34.0, 68.0))
    drive = simulated("thesis_drive")[1].table.filter(pl.col("vehicle_speed_m_s") > 3.0)
    progress(0.8)
    at = int(np.argmax(bend["steering_wheel_angle_rad"].to_numpy())) + 400  # held for 4 s
    moment = {name: float(bend[name][at]) for name in bend.columns}
    ahead = to_rear - moment["lateral_speed_m_s"] / moment["yaw_rate_rad_s"]
    radius = moment["vehicle_speed_m_s"] / moment["yaw_rate_rad_s"]
    speed, distance = _distances(drive, to_rear)
    per_speed_squared = (scenario.truck.mass_kg * (wheelbase - to_rear) / wheelbase) / (
        scenario.truck.rear_cornering_stiffness_n_rad
    )  # s^2/m: slip angle times radius
    of_front, of_rear = _slips_deg(drive, wheelbase, to_rear)
    in_bend = _slips_deg(bend, wheelbase, to_rear)[1]

    def draw(canvas: Canvas) -> None:
        above, below = canvas.subplots(2, 1, height_ratios=(3, 2))
        _moment(above, wheelbase, moment["front_wheel_angle_rad"], ahead, radius)
        below.plot(3.6 * speed[::20], distance[::20], ".", ms=2, color=OURS, label="simulated, bends of half an hour")
        even = np.linspace(0.0, 25.0, 50)
        below.plot(3.6 * even, per_speed_squared * even**2, color=TRUTH, label="by (4) and (17), on a level road")
        below.axhline(0.0, color=MUTED, lw=0.8, ls=":")
        below.set(xlabel="speed (km/h)", ylabel="centre ahead of rear axle (m)", ylim=(-1.5, 6.0))
        below.legend(loc="upper left", fontsize=7)

    return [
        Figure(
            "13",
            "The turning centre of the truck",
            draw,
            "Above, from Figure 11's simulated manoeuvre at its largest angle (not to scale across): the centre of "
            "rotation lies ahead of the rear axle and farther away than Ackermann's, so the wheel speeds give too "
            "small an angle. Below: its distance ahead over speed in bends of an ordinary drive, scattered by crown "
            "and transients; at walking pace it is on the rear axle.",
            claims=(
                Claim(
                    "4.1, Fig. 13",
                    "centre of rotation ahead of the rear axle at 46 km/h and its largest angle",
                    None,
                    ahead,
                    "m",
                    "the thesis shows it without a number",
                ),
                Claim(
                    "4.1, (22)",
                    "largest slip angle of the rear tyres in Figure 11, required to be below",
                    _RARE_DEG,
                    float(np.max(np.abs(in_bend))),
                    "deg",
                    "simulated; the condition under which (21) gives the Ackermann angle",
                ),
                Claim(
                    "2.3",
                    "of an ordinary drive's time with front tyres slipping more than 2 deg, which is rare",
                    None,
                    100.0 * float(np.mean(np.abs(of_front) > _RARE_DEG)),
                    "%",
                    "half an hour of the thesis drive, faster than 3 m/s; the tyres alone, without the steering's "
                    "compliance",
                ),
                Claim(
                    "2.3",
                    "of an ordinary drive's time with rear tyres slipping more than 2 deg",
                    None,
                    100.0 * float(np.mean(np.abs(of_rear) > _RARE_DEG)),
                    "%",
                    "the same drive",
                ),
                Claim(
                    "2.3",
                    "largest slip angle of all, against the 5 deg of the linear range",
                    5.0,
                    float(max(np.max(np.abs(of_front)), np.max(np.abs(of_rear)))),
                    "deg",
                    "the same drive: (4) holds throughout",
                ),
            ),
            size_in=(5.2, 5.6),
        )
    ]


def _distances(table: pl.DataFrame, to_rear: float) -> tuple[Array, Array]:
    """Speed, and the distance of the centre of rotation ahead of the rear axle, m, in steady turns."""
    yaw_rate = table["yaw_rate_rad_s"].to_numpy()
    change = np.gradient(yaw_rate) * 100.0
    steady = (np.abs(yaw_rate) > _TURNING_RAD_S) & (np.abs(change) < 0.01)
    distance = to_rear - table["lateral_speed_m_s"].to_numpy()[steady] / yaw_rate[steady]
    return table["vehicle_speed_m_s"].to_numpy()[steady], distance


def _slips_deg(table: pl.DataFrame, wheelbase: float, to_rear: float) -> tuple[Array, Array]:
    """Front from its force by (4), rear by (17)."""
    truck = read_scenario("thesis_drive").truck
    front = table["front_side_force_n"].to_numpy() / truck.front_cornering_stiffness_n_rad
    speed, yaw_rate = table["vehicle_speed_m_s"].to_numpy(), table["yaw_rate_rad_s"].to_numpy()
    rear = (table["lateral_speed_m_s"].to_numpy() - to_rear * yaw_rate) / speed
    return front / DEGREE, rear / DEGREE


def _moment(axes: Axes, wheelbase: float, steer: float, ahead: float, radius: float) -> None:
    ackermann = wheelbase / np.tan(steer)
    axes.plot([0.0, 0.0], [0.0, wheelbase], color=INK, lw=4)
    for across, along, colour, name, lift in (
        (-radius, ahead, TRUTH, "centre of rotation", 14),
        (-ackermann, 0.0, THESIS, "by Ackermann", -14),
    ):
        axes.plot([across], [along], "o", color=colour, ms=6)
        for axle in (0.0, wheelbase):
            axes.plot([across, 0.0], [along, axle], color=colour, lw=0.9, ls="--")
        axes.annotate(name, (across, along), (-12, lift), textcoords="offset points", color=colour, fontsize=8.5)
    axes.annotate("", (-3.0, ahead), (-3.0, 0.0), arrowprops={"arrowstyle": "<|-|>", "color": FIFTH})
    axes.text(-4.0, 0.5 * ahead, f"{ahead:.2f} m", color=FIFTH, ha="right", va="center", fontsize=8.5)
    axes.text(1.0, wheelbase, "front axle", fontsize=8, va="center")
    axes.text(1.0, 0.0, "rear axle", fontsize=8, va="center")
    axes.set(
        xlabel="to the right of the truck (m)",
        ylabel="ahead of rear axle (m)",
        xlim=(-1.15 * radius, 16.0),
        ylim=(-0.6, 4.4),
    )
