"""The steering wheel angle of a steering machine, tick by tick."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.signals import DEGREE
from oncenter.simulate.road_sections import Manoeuvre, ProfileManoeuvre, RampManoeuvre, WeaveManoeuvre
from oncenter.simulate.scenario import Scenario

Array = npt.NDArray[np.float64]


def check_fits(scenario: Scenario, manoeuvre: Manoeuvre) -> None:
    """Refuses a manoeuvre that lasts into the standstill at the end.

    Raises:
        OncenterError: "scenario_file", exit code 2.
    """
    ends_s, stands_s = manoeuvre_ends_s(manoeuvre), scenario.drive.duration_s - scenario.drive.standing_at_end_s
    if ends_s > stands_s:
        raise OncenterError(
            f"scenario {scenario.name}: 'manoeuvre' ends at {ends_s:g} s, but the truck stands from {stands_s:g} s on; "
            "increase 'drive.duration_s'",
            code="scenario_file",
            exit_code=WRONG_USAGE,
        )


def machine_angles_rad(manoeuvre: Manoeuvre, time_s: Array) -> Array:
    """Steering wheel angles at given times; zero before the manoeuvre, its last angle after it."""
    if isinstance(manoeuvre, WeaveManoeuvre):
        return _weave(manoeuvre, time_s)
    knots_s, knots_deg = _ramp(manoeuvre) if isinstance(manoeuvre, RampManoeuvre) else _profile(manoeuvre)
    return np.interp(time_s, knots_s, knots_deg, left=0.0) * DEGREE


def manoeuvre_ends_s(manoeuvre: Manoeuvre) -> float:
    """Time of the last movement of the steering wheel."""
    if isinstance(manoeuvre, WeaveManoeuvre):
        return _weave_begins_s(manoeuvre)[-1] + manoeuvre.cycles / manoeuvre.frequency_hz[-1]
    return (_ramp(manoeuvre) if isinstance(manoeuvre, RampManoeuvre) else _profile(manoeuvre))[0][-1]


def _profile(manoeuvre: ProfileManoeuvre) -> tuple[list[float], list[float]]:
    return list(manoeuvre.time_s), list(manoeuvre.angle_deg)


def _ramp(manoeuvre: RampManoeuvre) -> tuple[list[float], list[float]]:
    rate_deg_s, first_deg, second_deg = manoeuvre.rate_deg_s, manoeuvre.from_deg, manoeuvre.to_deg
    there_s = manoeuvre.begin_s + abs(first_deg) / rate_deg_s
    leaves_s = there_s + manoeuvre.hold_s
    ends_s = leaves_s + abs(second_deg - first_deg) / rate_deg_s
    return [manoeuvre.begin_s, there_s, leaves_s, ends_s], [0.0, first_deg, first_deg, second_deg]


def _weave(manoeuvre: WeaveManoeuvre, time_s: Array) -> Array:
    angle = np.zeros_like(time_s)
    for begin_s, frequency_hz in zip(_weave_begins_s(manoeuvre), manoeuvre.frequency_hz, strict=True):
        turns = (time_s - begin_s) * frequency_hz
        during = (turns >= 0.0) & (turns <= manoeuvre.cycles)
        angle[during] = manoeuvre.amplitude_deg * DEGREE * np.sin(2.0 * np.pi * turns[during])
    return angle


def _weave_begins_s(manoeuvre: WeaveManoeuvre) -> list[float]:
    lasts_s = [manoeuvre.cycles / frequency_hz + manoeuvre.pause_s for frequency_hz in manoeuvre.frequency_hz]
    return [manoeuvre.begin_s + sum(lasts_s[:k]) for k in range(len(lasts_s))]
