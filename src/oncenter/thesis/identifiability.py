"""(25) to (31), 4.2: identifiability by the single-track model without the steering wheel angle sensor, as ranks.

Each question is a matrix of the measured quantities, from simulated drives of (13). A parameter, or the angle, is
identifiable if its column is independent of the others. Columns are scaled to length one before the rank is taken;
singular values below 1e-9 of the largest count as zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from oncenter.signals import DEGREE
from oncenter.thesis.figure import INK, MUTED, OURS, THESIS, TRUTH, Claim, Exhibit, Figure, Misprint, Progress, Table
from oncenter.thesis.steady import SteadyTruck, steady_truck

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_NONE = 1e-9  # of the largest singular value
_STEP_S = 1e-3
_FRONT_SOFTER = (0.7, 1.0, 1.5)  # of the front tyres' true stiffness


@dataclass(frozen=True)
class Model:
    """(13) to (18), its C those of one of an axle's two wheels; slip angles as (16), (17)."""

    C_f: float
    C_r: float
    l_f: float
    l_r: float
    m: float
    I_z: float

    def states(self, v: float, delta: Array) -> tuple[Array, Array, Array, Array]:
        """x_1 to x_4 of (27) while delta is steered, one row every _STEP_S, by Heun's rule."""
        r, beta = 0.0, 0.0
        rows = np.empty((len(delta), 4))
        for k, angle in enumerate(delta):
            r_dot, beta_dot = self._slopes(v, angle, r, beta)
            rows[k] = beta + self.l_f * r / v, beta - self.l_r * r / v, v * (beta_dot + r), r_dot
            r_next, beta_next = self._slopes(v, angle, r + _STEP_S * r_dot, beta + _STEP_S * beta_dot)
            r, beta = r + 0.5 * _STEP_S * (r_dot + r_next), beta + 0.5 * _STEP_S * (beta_dot + beta_next)
        x_1, x_2, x_3, x_4 = rows.T
        return x_1, x_2, x_3, x_4

    def _slopes(self, v: float, delta: float, r: float, beta: float) -> tuple[float, float]:
        F_f = -self.C_f * (beta + self.l_f * r / v - delta)
        F_r = -self.C_r * (beta - self.l_r * r / v)
        return (2 * self.l_f * F_f - 2 * self.l_r * F_r) / self.I_z, (2 * F_f + 2 * F_r) / (self.m * v) - r

    def steady(self, v: float, delta: float) -> tuple[float, float, float]:
        """x_1, x_2 and v r at rest, (30)."""
        balance = np.array([[self.C_f, self.C_r, self.m / 2], [self.l_f * self.C_f, -self.l_r * self.C_r, 0.0]])
        # x_1 - x_2 = (l_f + l_r) r / v closes it
        closed = np.vstack([balance, [1.0, -1.0, -(self.l_f + self.l_r) / v**2]])
        x_1, x_2, vr = np.linalg.solve(closed, [self.C_f * delta, self.l_f * self.C_f * delta, 0.0])
        return float(x_1), float(x_2), float(vr)


def run(progress: Progress) -> list[Exhibit]:
    """The ranks, and two trucks with the same motion and different steering."""
    model = _of(steady_truck("4x2"))
    angle: Array = _steered()
    x = np.column_stack(model.states(15.0, angle))
    progress(0.4)
    others: dict[float, Array] = {factor: _angle_of_other_truck(model, factor, x) for factor in _FRONT_SOFTER}
    progress(0.6)
    rows, claims = _questions(model, angle, x)
    time: Array = np.linspace(0.0, len(angle) * _STEP_S, len(angle), endpoint=False)
    spread = float(np.max(np.abs(others[_FRONT_SOFTER[0]] - others[_FRONT_SOFTER[-1]]))) / DEGREE

    def draw(canvas: Canvas) -> None:
        _draw(canvas, time, angle, x, others)

    return [
        Table(
            "(25)-(31)",
            "Identifiable without the angle sensor",
            ("question", "measured", "unknown", "rank", "so"),
            rows,
            "Ranks of the matrices of (26) to (31) from a simulated drive of (13), all of it measured without "
            "error. "
            "A rank of one less than the unknowns leaves a common scale unidentified; where the angle is unknown, its "
            "column "
            "lies in the space of the others.",
            claims,
            (_misprint(model),),
        ),
        Figure(
            "(26)",
            "One motion, three trucks, three angles",
            draw,
            "Motion of the thesis's tractor at 15 m/s (above). A truck whose front tyres are softer or stiffer "
            "would have "
            "moved just so, with another front wheel angle (below): (26) holds for all three, so no measurement of "
            "the motion can separate them.",
            claims=(
                Claim(
                    "4.2, (26)",
                    "difference in front wheel angle between trucks with the same motion",
                    None,
                    spread,
                    "deg",
                    "front tyres of 0.7 and 1.5 times the stiffness; all of x_1 to x_4 the same to the last digit",
                ),
            ),
            size_in=(5.2, 4.4),
        ),
    ]


def _of(truck: SteadyTruck) -> Model:
    C_f, C_r = truck.stiffness_n_rad / 2.0
    return Model(C_f, C_r, truck.ahead_m[0], -truck.ahead_m[1], truck.mass_kg, 24_000.0)


def _steered() -> Array:
    """Front wheel angle of 12 s of lane changes, rad: three swings of different speed."""
    t = np.arange(0.0, 12.0, _STEP_S)
    return 0.6 * DEGREE * (np.sin(2.0 * np.pi * 0.15 * t) + 0.6 * np.sin(2.0 * np.pi * 0.4 * t + 1.0))


def _angle_of_other_truck(model: Model, factor: float, x: Array) -> Array:
    """delta_f of (26)'s first line for a truck with other front tyres and the motion x."""
    forces = model.C_r * x[:, 1] + model.m / 2.0 * x[:, 2]
    return np.asarray(x[:, 0] + forces / (factor * model.C_f))


def rank(columns: Array) -> int:
    """The rank of the columns, scaled to length one."""
    scaled = columns / np.linalg.norm(columns, axis=0)
    return int(np.linalg.matrix_rank(scaled, tol=_NONE * np.linalg.norm(scaled, 2)))


def _questions(model: Model, angle: Array, x: Array) -> tuple[tuple[tuple[str, ...], ...], tuple[Claim, ...]]:
    every = slice(0, None, 20)
    x_1, x_2, x_3, x_4 = x[every].T
    delta = angle[every]
    both_lines = rank(np.column_stack([delta - x_1, x_2, x_3])), rank(np.column_stack([delta - x_1, x_2, x_4]))
    rear_only = rank(np.column_stack([x_2, x_3, x_4]))
    samples = 40
    moving = _both_lines_without_angle(x[:: len(x) // samples][:samples])
    speeds = np.linspace(4.0, 25.0, 40)
    steady = np.array([(2.0 * DEGREE, *model.steady(float(v), 2.0 * DEGREE)) for v in speeds])
    unknown_angles = np.array(
        [(*model.steady(float(v), float(a)),) for v, a in zip(speeds, np.sin(speeds), strict=True)]
    )
    with_gradient = np.column_stack([unknown_angles[:, 2] / speeds**2, unknown_angles[:, 2]])
    # (31), an angle at each sample and K_us: each sample brings its own unknown
    of_31 = np.hstack([np.eye(samples), -with_gradient[:, 1:]])
    rows = (
        (
            "(26), its first line, with δ_f measured",
            "δ_f − x_1, x_2, x_3",
            "C_f, C_r, m",
            f"{both_lines[0]} of 3",
            _ratios(both_lines[0], 3),
        ),
        (
            "(26), its second line, with δ_f measured",
            "δ_f − x_1, x_2, x_4",
            "C_f, C_r, I_z",
            f"{both_lines[1]} of 3",
            _ratios(both_lines[1], 3),
        ),
        ("(29) at λ = −1, without δ_f", "x_2, x_3, x_4", "C_r, m, I_z", f"{rear_only} of 3", _ratios(rear_only, 3)),
        (
            f"(26), both lines, δ_f unknown at {samples} instants",
            "x_1 to x_4",
            f"{samples} C_f δ_f; C_f, C_r, m, (l_r/l_f) C_r, I_z/l_f",
            f"{rank(moving)} of {samples + 5}",
            "neither the angle nor C_f",
        ),
        (
            "(30), one constant δ_f, 40 speeds",
            "δ_f, x_1, x_2, v r",
            "the four factors of (30)",
            f"{rank(steady)} of 4",
            "four independent sets do not exist",
        ),
        (
            f"(31), δ_f unknown at {samples} instants",
            "r/v, v r",
            f"{samples} δ_f; K_us",
            f"{rank(of_31)} of {samples + 1}",
            "no K_us without the angle",
        ),
        ("(31), δ_f measured", "r/v, v r", "L, K_us", f"{rank(with_gradient)} of 2", "both, which (38) uses"),
    )
    claims = (
        Claim(
            "4.2, (26)",
            "unknowns that remain free with a time-varying angle unknown",
            None,
            float(samples + 5 - rank(moving)),
            "",
            "the thesis: more unknowns than equations; ours: columns less rank",
        ),
        Claim(
            "4.2, (30)",
            "independent sets of steady measurements that one front wheel angle has",
            4.0,
            float(rank(steady)),
            "",
            "theory needs four; all steady states of one truck and one angle lie in a plane, at any number of speeds",
        ),
        Claim(
            "4.2, (29)",
            "rank with λ = −1, which leaves out the front axle",
            None,
            float(rear_only),
            "",
            "2 of 3: C_r, m and I_z up to a scale; C_f is gone, as the thesis says",
        ),
        Claim(
            "4.2, (31)",
            "unknowns that remain free in (31) without the angle sensor",
            None,
            float(samples + 1 - rank(of_31)),
            "",
            "K_us; with the sensor none remain",
        ),
    )
    return rows, claims


def _both_lines_without_angle(x: Array) -> Array:
    """(28) as a matrix for C_f delta_f at each sample and, for all, C_f, C_r, m/2, (l_r/l_f) C_r and I_z/(2 l_f)."""
    x_1, x_2, x_3, x_4 = x.T
    none, angles = np.zeros_like(x_1), np.eye(len(x))
    first = np.column_stack([-x_1, -x_2, -x_3, none, none])
    second = np.column_stack([-x_1, none, none, x_2, -x_4])
    return np.vstack([np.hstack([angles, first]), np.hstack([angles, second])])


def _ratios(found: int, unknowns: int) -> str:
    return "all but their scale" if found == unknowns - 1 else "all" if found == unknowns else "not even their ratios"


def _misprint(model: Model) -> Misprint:
    speeds = np.linspace(4.0, 25.0, 400)
    sets = np.array([(2.0 * DEGREE, *model.steady(float(v), 2.0 * DEGREE)) for v in speeds])
    values = np.linalg.svd(sets / np.linalg.norm(sets, axis=0), compute_uv=False)
    return Misprint(
        "4.2, below (30)",
        "at least four independent sets of x_1, x_2 and v_x r at one front wheel angle are enough",
        "such sets do not exist: there are two, and the scale stays unknown in any case",
        f"singular values of {len(speeds)} steady states from 4 to 25 m/s: {values[0]:.2g}, {values[1]:.2g}, "
        f"{values[2]:.0e}, "
        f"{values[3]:.0e}",
        bool(values[2] < _NONE * values[0] < values[1]),
    )


def _draw(canvas: Canvas, time: Array, angle: Array, x: Array, others: dict[float, Array]) -> None:
    above, below = canvas.subplots(2, 1, sharex=True)
    above.plot(time, x[:, 2], color=INK)
    above.set(ylabel="$x_3=v_x(\\dot\\beta+r)$ (m/s²)")
    for (factor, delta), colour in zip(others.items(), (THESIS, OURS, TRUTH), strict=True):
        below.plot(time, delta / DEGREE, color=colour, label=f"$C_f$ times {factor:g}")
    below.plot(time, angle / DEGREE, color=MUTED, ls=":", lw=1.6, label="steered")
    below.set(xlabel="time (s)", ylabel="front wheel angle (deg)", ylim=(-1.4, 1.9))
    below.legend(ncols=4, fontsize=7, loc="upper center")
