"""A drive as a row of evidence: what it says of its truck, and when it was driven."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.truck.evidence import Numbers, modes_of
from oncenter.tuned import TUNED
from oncenter.vehicle import Vehicle

GRADIENT_MIN = 0.1 * DEGREE  # rad/(m/s^2)


@dataclass(frozen=True)
class Row:
    """The evidence of one drive on its truck, without what was estimated before. SI and rad; NaN where not identified.

    `modes` are its evidence of offset, play and neutral lateral acceleration. `gradient` is of this drive's load.
    `bank` is the mean of lateral acceleration less r*v while driving, `bank_variance` of a short drive's mean;
    `standing` is the mean lateral acceleration at standstill. `measured`: an accelerometer measures the bank. `side` is
    1 where traffic keeps right, -1 left, 0 not configured, or contradicted by the drive. `start_s` since 1970; NaN
    where unknown. `moved` is the change of the offset that the core found within the drive, after which the evidence
    holds; 0: none. `length_s` is from begin to end. `image` is the core after the drive, which a further log may
    continue; empty: none.
    """

    modes: Numbers  # (modes, 10), as evidence.modes_of
    status: str  # of the offset, by this drive alone
    gradient: float  # rad/(m/s^2)
    gradient_sd: float
    wheelbase: float  # share by which the equivalent wheelbase is longer than the vehicle file's
    wheelbase_sd: float
    friction: float  # m/s^2, of the king pins, by the most probable hypothesis
    creep: float  # rad/s per m/s^2, of the wheels in their play; 0: the king pins hold them
    bank: float  # m/s^2
    bank_variance: float
    standing: float  # m/s^2
    measured: bool
    ratio: float
    side: float
    start_s: float
    length_s: float
    used_s: float
    left_s: float  # of lateral force clearly to the left
    right_s: float
    moved: float = 0.0  # rad
    moved_sd: float = 0.0
    logs: tuple[str, ...] = ()  # their names
    image: bytes = b""

    @property
    def is_usable(self) -> bool:
        """Whether a truck's model can use the drive."""
        return self.status in ("valid", "converging") and len(self.modes) > 0

    @property
    def has_gradient(self) -> bool:
        """Whether its gradient is that of a truck; below, play may look like a gradient (finding no_understeer)."""
        return self.gradient >= GRADIENT_MIN


def row_of(
    core: _core.Core,
    native: _core.OcAnswer,
    vehicle: Vehicle,
    params: Mapping[str, float],
    *,
    start_s: float,
    length_s: float,
    moved: tuple[float, float] = (0.0, 0.0),
    logs: tuple[str, ...] = (),
) -> Row:
    """The row of a drive that the core has run over by the joint method; `native` is its oc_answer."""
    measured = bool(params["use_accelerometer"])
    gradient, standing = native["understeer_gradient"], native["standstill_lateral_acceleration"]
    status = _core.status_of(native["offset"])
    state = core.state()
    joint, wheelbase = state["evidence"]["joint"], native["equivalent_wheelbase"]
    samples = float(joint["bank_samples"])
    play = joint["hypotheses"][joint["best"]]["play"]
    friction = float(play["friction"])
    banked = measured and native["bank_time"] > 0.0 and samples > 0.0
    usable = status in ("valid", "converging")
    more = _variance_beside(state, core, native, params) if usable else 0.0
    modes = modes_of(state, core.coefficients(), more, measured=measured) if usable else np.zeros((0, 10))
    return Row(
        modes=modes,
        status=status,
        gradient=gradient["value"],
        gradient_sd=gradient["standard_deviation"],
        wheelbase=wheelbase["value"] / vehicle.wheelbase_m - 1.0,
        wheelbase_sd=wheelbase["standard_deviation"] / vehicle.wheelbase_m,
        friction=max(friction, 0.0),
        creep=float(play["creep"]) if friction >= 0.0 else 0.0,
        bank=native["bank_mean"] if banked else math.nan,
        bank_variance=params["crown_sd_m_s2"] ** 2 * TUNED["joint_method.bank_samples"] / samples
        if banked
        else math.nan,
        standing=standing["value"] if measured and _core.status_of(standing) == "valid" else math.nan,
        measured=measured,
        ratio=vehicle.ratio_near_centre,
        side=native["traffic_side"],
        start_s=start_s,
        length_s=length_s,
        used_s=native["used"],
        left_s=native["loaded_left_s"],
        right_s=native["loaded_right_s"],
        moved=moved[0],
        moved_sd=moved[1],
        logs=logs,
        image=core.save(0),
    )


def _variance_beside(state: Any, core: _core.Core, native: _core.OcAnswer, params: Mapping[str, float]) -> float:
    """rad^2: what the answer's part from this drive contains beside the hypotheses (core/monitor/joint_verdict.c), and
    by the recording's coarseness."""
    c, joint = core.coefficients(), state["evidence"]["joint"]
    by_recording = native["offset_parts"]["drive_sd"] ** 2 - core.answer()["offset_parts"]["drive_sd"] ** 2
    by_flank = TUNED["joint_verdict.steered_sd_share"] * native["steered_by"]
    leaks = state["evidence"]["gyro_bias"]["leaking"] != 0
    by_leak = c["ratio_times_wheelbase"] / joint["speed_mean"] * TUNED["joint_verdict.leak_bias"] if leaks else 0.0
    by_rear = c["ratio_times_rear_weight"] * params["known_rear_axle_zero_sd_rad"]
    return float(max(by_recording, 0.0) + by_flank**2 + by_leak**2 + by_rear**2)
