"""Several logs of one truck: whether the offset changed between them, and what they say together.

Each log is answered alone, and the truck's model (oncenter.truck) is asked about their summaries. With fewer than four
of them it cannot tell a step from one drive that is off, and valid ones are compared two by two.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from oncenter import _core
from oncenter.signals import DEGREE
from oncenter.truck.drives import Summary, summary_of, together
from oncenter.truck.model import Trucks, learn
from oncenter.truck.priors import Priors, priors_of
from oncenter.vehicle import Vehicle

_MODEL_FROM = 4  # logs: two on either side of a step
_STEP_SDS = 6.0  # of two valid logs: 2 of 2,064 neighbours of bench/trucks.py's months scatter by more
_STEP_MIN_RAD = 1.0 * DEGREE


@dataclass(frozen=True)
class LogStep:
    """The offset changed before log `at`, by `size` with standard deviation `sd`, rad."""

    at: int
    size: float
    sd: float


@dataclass(frozen=True)
class Together:
    """What the logs say together: all steps in order of time, and the truck's model of those that tell something; None
    where there are too few."""

    steps: tuple[LogStep, ...]
    model: Trucks | None

    @property
    def since(self) -> int:
        """The first log of the present offset."""
        return self.steps[-1].at if self.steps else 0


def across(natives: Sequence[Mapping[str, Any]], vehicle: Vehicle, params: Mapping[str, float]) -> Together:
    """From each log's oc_answer of the joint method, in order of time."""
    priors = priors_of(params)
    told = [(k, summary_of(native, vehicle)) for k, native in enumerate(natives) if _tells(native)]
    if len(told) < _MODEL_FROM:
        return Together(_by_pairs(natives, told, priors), None)
    model = learn(together([[summary for _, summary in told]]), priors)
    steps = tuple(LogStep(told[step.at][0], step.size, step.sd) for step in model.steps)
    return Together(steps, model)


def _tells(native: Mapping[str, Any]) -> bool:
    """Whether its truck's model can use it: fleet/summaries.py has the same."""
    status = _core.STATUSES[native["offset"]["status"]]
    return status in ("valid", "converging") and native["understeer_gradient"]["value"] >= 0.1 * DEGREE


def _by_pairs(
    natives: Sequence[Mapping[str, Any]], told: Sequence[tuple[int, Summary]], priors: Priors
) -> tuple[LogStep, ...]:
    valid = [(k, one) for k, one in told if _core.STATUSES[natives[k]["offset"]["status"]] == "valid"]
    steps = []
    for (_, before), (k, after) in zip(valid, valid[1:], strict=False):
        size = after.offset - before.offset
        by_load = after.ratio * (after.gradient - before.gradient) * priors.pull_sd_m_s2
        noise = math.sqrt(2.0) * priors.offset_noise_sd_rad
        sd = math.hypot(before.offset_sd, after.offset_sd, by_load, noise)
        if abs(size) > max(_STEP_MIN_RAD, _STEP_SDS * sd):
            steps.append(LogStep(k, size, sd))
    return tuple(steps)
