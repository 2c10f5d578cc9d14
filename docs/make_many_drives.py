"""Makes the two pictures of docs/truck_over_time.md from simulated drives, and the numbers beside them.

Run as .venv/bin/python docs/make_many_drives.py: docs/one_drive.png and docs/many_drives.png, in some ten seconds.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import oncenter as oc
from oncenter.offset.answer import Answer
from oncenter.signals import DEGREE, Signals
from oncenter.simulate.truth import Truth
from oncenter.truck.loads import loads_of
from oncenter.truck.now import Truck, truck_now
from oncenter.truck.priors import Priors, priors_of
from oncenter.truck.row import Row

DOCS = Path(__file__).parent
PAGE = DOCS / "truck_over_time.md"
LEFT, RIGHT, OFFSET, TRUTH, INK, GRID = "#1a5fb4", "#e66100", "#16191d", "#26a269", "#16191d", "#dfe2e6"
STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#5b626b",
    "axes.labelsize": 12,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 12,
    "axes.titlelocation": "left",
    "font.size": 12,
    "grid.color": GRID,
    "legend.fontsize": 11,
    "legend.frameon": False,
}
WIDTH_IN, DPI = 6.4, 200  # 1280 px
G_M_S2 = 9.80665

# scenarios/thesis_drive.toml's truck
TRAIL_M, FRONT_KG, REAR_KG, RATIO = 0.06, 5900.0, 2200.0, 19.3
COMPLIANCE_DEG_KN_M, REAR_SLIP_DEG_M_S2 = 0.43, 0.537
MOMENT_N_M_PER_M_S2 = TRAIL_M * FRONT_KG
PLAY_DEG, COMPLIANCE_SHARE_1 = 6.0, 0.35
TRUCK = f"""name = "the truck of thesis_drive"
wheelbase_m = 3.7
steering_ratio = {RATIO}
track_width_front_m = 2.05
track_width_rear_m = 1.83
axle_layout = "4x2"
traffic_side = "right"
"""

CANNOT_SEED, EVERY = 3, 25  # ticks
PULL_OR_BIAS_M_S2 = 0.1
A_OFFSET_DEG = 2.0

LOADS_DEG_M_S2 = (0.3, 0.405, 0.54)  # K: bench/truck_drives.py's STIFFER
DRIVES, FIRST_SEED, DRAWS_SEED = 8, 1, 1
PULL_M_S2, BIAS_M_S2, SENSOR_DEG = 0.09, -0.05, 2.0


@dataclass(frozen=True)
class Driven:
    """One drive: what was true, what was recorded, what it answers; `target` is the straight-ahead offset, deg."""

    truth: Truth
    signals: Signals
    answer: Answer
    pull: float
    bias: float

    @property
    def target(self) -> float:
        return (self.truth.offset_rad + self.truth.straight_ahead_rad) / DEGREE

    @property
    def value(self) -> float:
        assert self.answer.offset.value is not None
        return self.answer.offset.value / DEGREE

    @property
    def ci95_drive(self) -> tuple[float, float]:
        assert self.answer.offset_ci95_drive is not None
        low, high = self.answer.offset_ci95_drive
        return low / DEGREE, high / DEGREE

    @property
    def ci95(self) -> tuple[float, float]:
        assert self.answer.offset.ci95 is not None
        low, high = self.answer.offset.ci95
        return low / DEGREE, high / DEGREE


def driven(
    folder: Path,
    seed: int,
    *,
    sensor_deg: float,
    pull: float,
    bias: float,
    crown_percent: float,
    gradient: float | None = None,
    stands: bool = True,
    gyro_bias: float = 0.05,
    base: str = "thesis_drive",
) -> Driven:
    """A drive of twenty minutes; with a load by which K is `gradient`, deg/(m/s^2)."""
    of_load = ""
    compliance = COMPLIANCE_DEG_KN_M
    if gradient is not None:
        compliance = 1000.0 * COMPLIANCE_SHARE_1 * gradient / MOMENT_N_M_PER_M_S2
        front = FRONT_KG / (((1.0 - COMPLIANCE_SHARE_1) * gradient + REAR_SLIP_DEG_M_S2) * DEGREE)
        rear = REAR_KG / (REAR_SLIP_DEG_M_S2 * DEGREE)
        of_load = f"[truck]\nfront_cornering_stiffness_n_rad = {front}\nrear_cornering_stiffness_n_rad = {rear}\n"
    scenario, vehicle = folder / "drive.toml", folder / "truck.toml"
    vehicle.write_text(TRUCK, encoding="utf-8")
    scenario.write_text(
        f'base = "{base}"\nabout = "docs/truck_over_time.md"\n'
        f"[drive]\nduration_s = 1200.0\nstanding_at_start_s = {10.0 if stands else 0.0}\nstanding_at_end_s = 0.0\n"
        f"{of_load}"
        f"[steering]\nsteering_ratio = {RATIO}\nbacklash_deg = {PLAY_DEG}\ncompliance_deg_kn_m = {compliance}\n"
        f"pull_n_m = {pull * MOMENT_N_M_PER_M_S2}\n"
        f"[road]\ncrown_percent = {crown_percent}\n"
        f"[sensors.steering_wheel_angle]\noffset_deg = {sensor_deg}\n"
        f"[sensors.yaw_rate]\nbias_deg_s = {gyro_bias}\n"
        f"[sensors.lateral_acceleration]\nbias_m_s2 = {bias}\n",
        encoding="utf-8",
    )
    signals, truth = oc.simulate(scenario, seed)
    return Driven(truth, signals, oc.offset(signals, oc.vehicle(vehicle)), pull, bias)


def two_trucks(folder: Path) -> tuple[Driven, Driven]:
    """A has an accelerometer bias, B as much pull, on a road whose crown makes up for it: the same signals."""
    a = driven(folder, CANNOT_SEED, sensor_deg=A_OFFSET_DEG, pull=0.0, bias=PULL_OR_BIAS_M_S2, crown_percent=2.0)
    moved = a.truth.steering_ratio * a.truth.understeer_gradient / DEGREE * PULL_OR_BIAS_M_S2
    moment_kn_m = 1e-3 * MOMENT_N_M_PER_M_S2 * PULL_OR_BIAS_M_S2
    by_alignment = RATIO * COMPLIANCE_DEG_KN_M * moment_kn_m  # the steering gives way under it
    b = driven(
        folder,
        CANNOT_SEED,
        sensor_deg=A_OFFSET_DEG - moved + by_alignment,
        pull=PULL_OR_BIAS_M_S2,
        bias=0.0,
        crown_percent=2.0 + 100.0 * PULL_OR_BIAS_M_S2 / G_M_S2,
    )
    return a, b


def eight_drives(folder: Path) -> list[Driven]:
    """Of one truck; each drive's crown, gyro bias and standstill are drawn as bench/truck_drives.py draws them."""
    random = np.random.default_rng(DRAWS_SEED)
    return [
        driven(
            folder,
            FIRST_SEED + k,
            sensor_deg=SENSOR_DEG,
            pull=PULL_M_S2,
            bias=BIAS_M_S2,
            crown_percent=float(random.normal(2.0, 1.0)),
            gradient=LOADS_DEG_M_S2[k % len(LOADS_DEG_M_S2)],
            stands=bool(random.random() < 0.6),
            gyro_bias=float(random.normal(0.0, 0.2)),
            base=str(random.choice(["thesis_drive", "country"])),
        )
        for k in range(DRIVES)
    ]


def draw_one_drive(trucks: tuple[Driven, Driven], file: Path) -> None:
    """Above, each truck's cloud with the flanks that its answer has; below, both answers and both truths."""
    figure = Figure(figsize=(WIDTH_IN, 6.0), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.5, 1.0))
    first = figure.add_subplot(grid[0, 0])
    _cloud(first, trucks[0], "Truck A: bias 0.1, no pull")
    first.set_ylabel("residual (deg)")
    second = figure.add_subplot(grid[0, 1], sharey=first)
    _cloud(second, trucks[1], "Truck B: pull 0.1, no bias")
    second.tick_params(labelleft=False)
    below = figure.add_subplot(grid[1, :])
    for y, truck in zip((1.0, 0.0), trucks, strict=True):
        low, high = truck.ci95
        below.plot([low, high], [y, y], color=LEFT, linewidth=2.5, label="ci95" if y else None)
        low, high = truck.ci95_drive
        below.plot(
            [low, high],
            [y, y],
            color=LEFT,
            linewidth=11,
            solid_capstyle="butt",
            alpha=0.65,
            label="ci95_drive" if y else None,
        )
        below.plot(truck.value, y, "o", color=OFFSET, markersize=6, label="estimate" if y else None, zorder=4)
        below.plot(
            truck.target,
            y,
            "D",
            color=TRUTH,
            markersize=9,
            markeredgecolor="white",
            label="truth" if y else None,
            zorder=3 if y else 5,
        )
    below.set_yticks([1.0, 0.0], ["A", "B"])
    below.set_ylim(-0.6, 1.6)
    below.set_xlabel("straight-ahead offset (deg)")
    below.grid(axis="x")
    below.spines["left"].set_visible(False)
    below.tick_params(left=False)
    below.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, handlelength=1.2, columnspacing=1.2)
    figure.savefig(file, dpi=DPI, metadata={"Software": None})


def _cloud(axes: Axes, truck: Driven, title: str) -> None:
    rows = oc.trace(truck.answer)
    used = (rows["reasons"] == "") & (rows["offset_status"] != "unobservable")
    used &= np.abs(rows["lateral_acceleration_m_s2"]) < 1.0
    some = np.nonzero(used)[0][::EVERY]
    a_y, residual = rows["lateral_acceleration_m_s2"][some], rows["residual_rad"][some] / DEGREE
    assert truck.answer.unloading_acceleration.value is not None
    assert truck.answer.backlash.value is not None and truck.answer.understeer_gradient.value is not None
    a_0 = truck.answer.unloading_acceleration.value
    half_play = 0.5 * truck.answer.backlash.value / DEGREE
    slope = RATIO * truck.answer.understeer_gradient.value / DEGREE
    axes.scatter(a_y, residual, s=5, color="#9a9996", alpha=0.5, linewidth=0)
    x = np.array([-1.0, 1.0])
    for side, colour in ((1.0, LEFT), (-1.0, RIGHT)):
        axes.plot(x, truck.value + slope * (x - a_0) + side * half_play, color=colour, linewidth=2.5)
    axes.plot(x, truck.value + slope * (x - a_0), color=INK, linewidth=1.0, linestyle=":")
    axes.axvline(a_0, color=INK, linestyle="--", linewidth=1.2)
    axes.text(a_0 + 0.04, -10.3, "$a_0$")
    axes.text(-0.94, 5.0, "left flank", color=LEFT)
    axes.text(0.28, -3.2, "right flank", color=RIGHT)
    axes.plot(a_0, truck.value, "o", color=OFFSET, markersize=8, zorder=4)
    axes.plot(truck.bias, truck.target, "D", color=TRUTH, markersize=8, markeredgecolor="white", zorder=5)
    axes.set_title(title)
    axes.set_xlim(-1.0, 1.0)
    axes.set_xticks([-1.0, -0.5, 0.0, 0.5])
    axes.set_ylim(-11.0, 14.0)
    axes.set_xlabel("measured lateral acc. (m/s²)")
    axes.grid()


def draw_many_drives(drives: list[Driven], truck: Truck, i_k: list[float], file: Path) -> None:
    """Reading over i K with the truck's line; beside it the eight answers and the one on all drives."""
    figure = Figure(figsize=(WIDTH_IN, 5.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.35, 1.0))
    (offset, half_width), pull = offset_of(truck), truck.pull
    target = float(np.mean([drive.target for drive in drives]))
    line = np.array([0.0, 1.08 * max(i_k)])
    left.plot(line, target + PULL_M_S2 * line, color=TRUTH, linestyle="--", linewidth=1.5)
    left.plot(line, offset + pull * line, color=LEFT, linewidth=2.2)
    for x, drive in zip(i_k, drives, strict=True):
        left.plot([x, x], drive.ci95_drive, color=INK, linewidth=1.5)
        left.plot(x, drive.value, "o", color=INK, markersize=6)
    left.plot([0.0, 0.0], [offset - half_width, offset + half_width], color=LEFT, linewidth=3.5)
    left.plot(0.0, offset, "o", color=LEFT, markersize=9)
    left.plot(0.0, target, "D", color=TRUTH, markersize=8, markeredgecolor="white", zorder=5)
    left.set_xlim(-0.7, line[1])
    left.set_xlabel("i K (deg per m/s²)")
    left.text(0.06 * line[1], offset + 0.25 * pull * line[1] + 0.14, "slope: pull", color=LEFT)
    left.text(0.3, offset - half_width - 0.22, "offset at i K = 0", color=LEFT)
    left.set_ylabel("deg")
    left.set_title("reading at $a_0$")
    left.grid()
    for k, drive in enumerate(drives):
        _answer(right, k + 1, drive.value, drive.ci95_drive, drive.ci95, INK)
    own, whole = ((low / DEGREE, high / DEGREE) for low, high in (truck.own, truck.whole))
    _answer(right, len(drives) + 1.5, truck.offset / DEGREE, own, whole, LEFT)
    right.axhline(target, color=TRUTH, linestyle="--", linewidth=1.5)
    right.set_xticks([*range(1, len(drives) + 1, 2), len(drives) + 1.5], ["1", "3", "5", "7", "all"])
    right.set_xlim(0.3, len(drives) + 2.3)
    right.set_xlabel("drive")
    right.set_title("straight-ahead offset")
    right.grid(axis="y")
    figure.savefig(file, dpi=DPI, metadata={"Software": None})


def offset_of(truck: Truck) -> tuple[float, float]:
    """The middle and half the width of the whole interval, deg: of the offset without the effect of a pull."""
    low, high = truck.whole
    return 0.5 * (low + high) / DEGREE, 0.5 * (high - low) / DEGREE


def moved_by_pull(rows: list[Row], priors: Priors) -> list[float]:
    """Change of each reading by a pull, deg per m/s^2: i K as in truck/now.py."""
    loads = loads_of(rows, priors)
    gradients = loads.mean + (1.0 - priors.compliance_share_1) * (loads.gradient - loads.mean)
    return [float(x) for x in RATIO * gradients / DEGREE]


def _answer(
    axes: Axes, x: float, value: float, own: tuple[float, float], whole: tuple[float, float], colour: str
) -> None:
    """A value with `ci95_drive`, thick, and `ci95`, thin."""
    axes.plot([x, x], whole, color=colour, linewidth=1.5)
    axes.plot([x, x], own, color=colour, linewidth=7, alpha=0.45, solid_capstyle="butt")
    axes.plot(x, value, "o", color=colour, markersize=6)


def table(trucks: tuple[Driven, Driven]) -> str:
    lines = [
        "| truck | bias b | pull p | true offset | estimate | `ci95_drive` | `ci95` |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for name, truck in zip("AB", trucks, strict=True):
        drive, both = (f"{low:.1f} to {high:.1f}" for low, high in (truck.ci95_drive, truck.ci95))
        lines.append(
            f"| {name} | {truck.bias:g} | {truck.pull:g} | {truck.target:.2f} | {truck.value:.2f} | {drive} | {both} |"
        )
    return "\n".join(lines)


def sentence(drives: list[Driven], truck: Truck) -> str:
    errors = [abs(drive.value - drive.target) for drive in drives]
    halves = [0.5 * (drive.ci95[1] - drive.ci95[0]) for drive in drives]
    target = float(np.mean([drive.target for drive in drives]))
    offset, half = offset_of(truck)
    return (
        f"The pull is {PULL_M_S2:g} m/s^2, the model finds {truck.pull:.2f} ± {1.96 * truck.pull_sd:.2f};"
        f" the bias is {BIAS_M_S2:g}, it finds {truck.accelerometer_bias:.2f} ±"
        f" {1.96 * truck.accelerometer_bias_sd:.2f}.\n"
        f"The single drives have errors of {min(errors):.1f} to {max(errors):.1f} deg, at half-widths of"
        f" {min(halves):.1f} to {max(halves):.1f} deg.\n"
        f"Together they give {truck.offset / DEGREE:.2f} deg, and {offset:.2f} ± {half:.2f} deg without a pull; the"
        f" truth is {target:.2f} deg."
    )


def written(page: str, name: str, text: str) -> str:
    """The page with what stands between the two marks of that name renewed."""
    begin, end = f"<!-- {name}: written by docs/make_many_drives.py -->", f"<!-- {name}: end -->"
    assert begin in page and end in page, name
    return f"{page.partition(begin)[0]}{begin}\n{text}\n{end}{page.partition(end)[2]}"


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        trucks = two_trucks(Path(name))
        drives = eight_drives(Path(name))
    priors = priors_of()
    kept = [row for drive in drives for row in drive.answer.rows if row.is_usable]
    truck = truck_now(kept, (), priors)
    with matplotlib.rc_context(STYLE):
        draw_one_drive(trucks, DOCS / "one_drive.png")
        draw_many_drives(drives, truck, moved_by_pull(kept, priors), DOCS / "many_drives.png")
    page = PAGE.read_text(encoding="utf-8")
    page = written(page, "one drive", table(trucks))
    PAGE.write_text(written(page, "many drives", sentence(drives, truck)), encoding="utf-8")


if __name__ == "__main__":
    main()
