"""Draws the five pictures of docs/how_it_works.md from one simulated drive, and writes the numbers beside them.

Run as .venv/bin/python docs/make_how_it_works.py; it takes some ten seconds. The drive is `heavy_play`: an offset of
2.04 deg, 15 deg of free play, a crown of 2 % to the right, 30 minutes.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import oncenter as oc
from oncenter.offset.answer import Answer
from oncenter.signals import DEGREE

DOCS = Path(__file__).parent
PAGE = DOCS / "how_it_works.md"
BEGIN, END = "<!-- numbers: written by docs/make_how_it_works.py -->", "<!-- numbers: end -->"
SCENARIO, TRUCK = "heavy_play", "scania_r730_4x2"
MEASURED, ESTIMATE, TRUTH, LEFT, RIGHT, INK = "#5b626b", "#1a5fb4", "#1b7d4f", "#1a5fb4", "#c64600", "#16191d"
STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#5b626b",
    "axes.grid": True,
    "axes.labelsize": 13,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "font.size": 13,
    "grid.color": "#dfe2e6",
    "legend.fontsize": 12,
    "legend.frameon": False,
}
SIZE_IN, DPI = (6.4, 4.0), 200  # 1280 px wide, still legible at 400
WINDOW_S = (84.0, 124.0)  # both flanks for as long
SPEED_MIN_M_S, EVERY = 10.0, 60  # ticks between two points of the cloud


@dataclass(frozen=True)
class Drive:
    """The drive's columns, in deg where angles, and both answers."""

    time: np.ndarray
    angle: np.ndarray  # measured
    needed: np.ndarray  # by yaw rate and speed, i*L*r/v
    acceleration: np.ndarray
    speed: np.ndarray
    place: np.ndarray  # of the wheels in the play, -1 to 1
    offset_deg: float
    play_deg: float
    bias: float  # of the accelerometer
    joint: Answer
    thesis: Answer


def drive() -> Drive:
    truck = oc.vehicle(TRUCK)
    signals, truth = oc.simulate(SCENARIO)
    column = {name: signals.table[name].to_numpy() for name in signals.table.columns}
    speed = np.maximum(column["vehicle_speed_m_s"], 1.0)
    yaw_rate = column["yaw_rate_rad_s"] - truth.yaw_rate_bias_rad_s
    needed = truth.steering_ratio * truth.equivalent_wheelbase_m * yaw_rate / speed
    return Drive(
        time=column["time_s"],
        angle=column["steering_wheel_angle_rad"] / DEGREE,
        needed=needed / DEGREE,
        acceleration=column["lateral_acceleration_m_s2"],
        speed=speed,
        place=truth.table["place_in_play"].to_numpy(),
        offset_deg=truth.offset_rad / DEGREE,
        play_deg=truth.backlash_rad / DEGREE,
        bias=truth.lateral_acceleration_bias_m_s2,
        joint=oc.offset(signals, truck),
        thesis=oc.offset(signals, truck, method="thesis"),
    )


def smoothed(values: np.ndarray, ticks: int = 50) -> np.ndarray:
    """A moving mean, for pictures."""
    return np.convolve(values, np.ones(ticks) / ticks, mode="same")


def window(drive: Drive) -> slice:
    return slice(*(round(at * 100.0) for at in WINDOW_S))


def above(axes: Axes) -> None:
    """The legend, where it hides no curve."""
    axes.legend(
        loc="lower left", bbox_to_anchor=(0, 1), ncols=3, columnspacing=0.9, handlelength=1.3, borderaxespad=0.1
    )


def draw_residual(axes: Axes, drive: Drive) -> None:
    part = window(drive)
    axes.plot(drive.time[part], drive.angle[part], color=MEASURED, lw=2, label="measured")
    axes.plot(drive.time[part], smoothed(drive.needed)[part], color=ESTIMATE, lw=2, label="needed for the motion")
    axes.fill_between(
        drive.time[part], smoothed(drive.needed)[part], drive.angle[part], color=RIGHT, alpha=0.15, label="residual"
    )
    axes.set_xlabel("time (s)")
    axes.set_ylabel("steering wheel (deg)")
    above(axes)


def draw_play(axes: Axes, drive: Drive) -> None:
    part = window(drive)
    angle = drive.angle[part] - drive.offset_deg
    axes.fill_between(
        drive.time[part],
        angle - drive.play_deg / 2,
        angle + drive.play_deg / 2,
        color="#f6d5bb",
        lw=0,
        label="play",
    )
    wheels = angle - drive.play_deg / 2 * drive.place[part]
    axes.plot(drive.time[part], wheels, color=INK, lw=2, label="front wheels × ratio")
    axes.set_xlabel("time (s)")
    axes.set_ylabel("steering wheel (deg)")
    above(axes)


def cloud(drive: Drive) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Measured lateral acceleration, residual and place in the play, one point each 0.6 s of driving."""
    residual = smoothed(drive.angle - drive.needed)
    moving = np.flatnonzero(drive.speed > SPEED_MIN_M_S)[::EVERY]
    return smoothed(drive.acceleration)[moving], residual[moving], drive.place[moving]


def draw_flanks(axes: Axes, drive: Drive) -> None:
    acceleration, residual, place = cloud(drive)
    for chosen, color, name in ((place > 0.9, LEFT, "left flank"), (place < -0.9, RIGHT, "right flank")):
        axes.scatter(acceleration[chosen], residual[chosen], s=7, color=color, alpha=0.6, lw=0, label=name)
    between = np.abs(place) <= 0.9
    axes.scatter(acceleration[between], residual[between], s=7, color="#9aa1aa", lw=0, label="crossing the play")
    answer = drive.joint
    offset, slope, play = (each.value or 0.0 for each in (answer.offset, answer.understeer_gradient, answer.backlash))
    line = np.array([-1.5, 1.5])
    middle = (offset + 19.3 * slope * line) / DEGREE
    axes.plot(line, middle, color=INK, lw=2)
    for side in (-1, 1):
        axes.plot(line, middle + side * play / DEGREE / 2, color=INK, lw=1.2, ls="--")
    axes.plot([0], [offset / DEGREE], "o", color=TRUTH, ms=9, zorder=5, label="straight-ahead offset")
    axes.set_xlabel("measured lateral acceleration (m/s²)")
    axes.set_ylabel("residual (deg)")
    axes.set_xlim(-1.6, 1.6)
    axes.set_ylim(-24, 26)
    axes.legend(loc="lower right", handletextpad=0.2, ncols=2, columnspacing=0.8)


def course(answer: Answer) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Minutes, offset and its two standard deviations in deg, where there is an estimate, once a second."""
    rows = oc.trace(answer)[::100]
    shown = rows[rows["evidence_s"] > 0.0]
    drive_sd = shown["offset_drive_sd_rad"]
    return shown["time_s"] / 60.0, shown["offset_rad"] / DEGREE, shown["offset_sd_rad"] / DEGREE, drive_sd / DEGREE


def draw_mean(axes: Axes, drive: Drive) -> None:
    minutes, offset, _, _ = course(drive.thesis)
    axes.plot(minutes, offset, color=RIGHT, lw=2, label="mean of the residual (thesis)")
    minutes, offset, _, _ = course(drive.joint)
    axes.plot(minutes, offset, color=ESTIMATE, lw=2, label="play estimated as well (joint)")
    axes.axhline(drive.offset_deg, color=TRUTH, lw=2, ls="--", label="true offset")
    axes.set_xlabel("time (min)")
    axes.set_ylabel("offset (deg)")
    axes.set_ylim(-3, 13)
    axes.legend(loc="upper right")


def draw_interval(axes: Axes, drive: Drive) -> None:
    minutes, offset, both, own = course(drive.joint)
    axes.fill_between(minutes, offset - 1.96 * both, offset + 1.96 * both, color="#c9dcf3", lw=0, label="95 % interval")
    axes.fill_between(
        minutes, offset - 1.96 * own, offset + 1.96 * own, color="#78a9df", lw=0, label="its part from this drive"
    )
    axes.plot(minutes, offset, color=INK, lw=1.5, label="estimate")
    axes.axhline(drive.offset_deg, color=TRUTH, lw=2, ls="--", label="true offset")
    axes.set_xlabel("time (min)")
    axes.set_ylabel("offset (deg)")
    axes.set_ylim(-3, 9)
    axes.legend(loc="upper right", ncols=2, columnspacing=0.8)


PICTURES = {
    "1_residual": draw_residual,
    "2_play": draw_play,
    "3_flanks": draw_flanks,
    "4_mean": draw_mean,
    "5_interval": draw_interval,
}


def numbers(drive: Drive) -> str:
    thesis, joint = drive.thesis.offset.value, drive.joint.offset.value
    play, own = drive.joint.backlash.value, drive.joint.offset_ci95_drive
    assert thesis is not None and joint is not None and play is not None and own is not None
    return (
        f"The true offset is {drive.offset_deg:.1f} deg and the true play {drive.play_deg:.0f} deg. "
        f"The mean of the residual gives {thesis / DEGREE:.1f} deg. "
        f"The joint estimate gives {joint / DEGREE:.1f} ± {(own[1] - own[0]) / 2 / DEGREE:.1f} deg from this drive, "
        f"and {play / DEGREE:.1f} deg of play."
    )


def draw_all(driven: Drive, folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    with matplotlib.rc_context(STYLE):
        for name, draw in PICTURES.items():
            figure = Figure(figsize=SIZE_IN, layout="constrained")
            draw(figure.subplots(), driven)
            figure.savefig(folder / f"{name}.png", dpi=DPI, metadata={"Software": None})


def main() -> None:
    driven = drive()
    draw_all(driven, DOCS / "how_it_works")
    text = PAGE.read_text(encoding="utf-8")
    before, after = text.partition(BEGIN)[0], text.partition(END)[2]
    PAGE.write_text(f"{before}{BEGIN}\n{numbers(driven)}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
