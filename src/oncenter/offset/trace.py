"""The output of the core at each tick as a flat table, of which each name has its unit, and each code is a word."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.offset.answer import Answer
from oncenter.offset.run import outputs_of

# By column: the member of oc_output. `Now` of a monitor has the same names.
_NUMBERS = {
    "time_s": "time",
    "vehicle_speed_m_s": "vehicle_speed",
    "curvature_1_m": "motion.curvature",
    "longitudinal_acceleration_m_s2": "motion.longitudinal_acceleration",
    "bank_m_s2": "motion.bank",
    "lateral_acceleration_m_s2": "motion.lateral_acceleration",
    "rear_part_rad": "motion.rear_part",
    "residual_rad": "motion.residual",
    "offset_rad": "offset",
    "offset_sd_rad": "offset_sd",
    "offset_lean_rad": "offset_lean",
    "offset_drive_sd_rad": "offset_parts.drive_sd",
    "offset_pull_sd_rad": "offset_parts.pull_sd",
    "offset_wind_sd_rad": "offset_parts.wind_sd",
    "offset_set_up_sd_rad": "offset_parts.set_up_sd",
    "offset_per_acceleration_rad_m_s2": "offset_parts.per_acceleration",
    "understeer_gradient_rad_m_s2": "understeer_gradient",
    "backlash_rad": "backlash",
    "place_in_play": "place",
    "unloading_acceleration_m_s2": "unloading_acceleration",
    "evidence_s": "evidence",
    "yaw_rate_bias_rad_s": "yaw_rate_bias",
    "yaw_rate_bias_sd_rad_s": "yaw_rate_bias_sd",
    "angle_rad": "angle.angle",
    "angle_rate_rad_s": "angle.rate",
    "angle_sd_rad": "angle.standard_deviation",
    "angle_delay_s": "angle.delay",
    "angle_estimate_rad": "angle.estimate",
    "angle_estimate_sd_rad": "angle.estimate_sd",
    "sensor_fault_since_s": "fault_since",
    "sensor_fault_confidence": "fault_confidence",
}
# By column: the member, and the text of its code.
_WORDS: dict[str, tuple[str, Callable[[int], str]]] = {
    "offset_status": ("offset_status", _core.STATUSES.__getitem__),
    "angle_status": ("angle.status", _core.STATUSES.__getitem__),
    "angle_source": ("angle.by_sensor", ("estimated", "compensated").__getitem__),
    "sensor_fault": ("fault", _core.FAULTS.__getitem__),
    "signal_fault": ("signal_fault", _core.SIGNAL_FAULTS.__getitem__),
    "signals_at_fault": ("signals_at_fault", lambda bits: ", ".join(_core.signals_of(bits))),
    "reasons": ("reasons", lambda bits: ", ".join(_core.reasons_of(bits))),
}
_DTYPE = np.dtype([*((name, np.float64) for name in _NUMBERS), *((name, object) for name in _WORDS)])


def trace(answer: Answer) -> npt.NDArray[np.void]:
    """The output of the core at each tick of an answer, one row per row of all its drives, in order.

    A flat structured array, which `polars.DataFrame` and `pandas.DataFrame` take as it is: numbers in SI and rad, with
    the unit in the name, and text. The names are those of `oncenter.Now`. The numbers are the core's, also while their
    status is "unobservable". `reasons` and `signals_at_fault` hold several words separated by ", ", or none.

    Args:
        answer: as `oncenter.offset` gives it; its drives run again.
    """
    outputs = outputs_of(answer)
    table = np.zeros(len(outputs), _DTYPE)
    for name, member in _NUMBERS.items():
        table[name] = _values(outputs, member)
    for name, (member, text) in _WORDS.items():
        table[name] = _core.texts_of(_values(outputs, member), text)
    return table


def _values(outputs: npt.NDArray[np.void], member: str) -> npt.NDArray[Any]:
    values: Any = reduce(lambda struct, part: struct[part], member.split("."), outputs)
    return np.asarray(values)
