"""The core on a bus: frames in, ticks through the code that judges logs, what is known now out. No thread, no clock.

Two cores run side by side, the one of `oncenter offset` and the one of `oncenter angle`, so that what is said live is
what both say of the log: a sensor at fault teaches the second nothing, and the first as it would there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.offset import inputs
from oncenter.offset.answer import Answer
from oncenter.offset.assemble import answer_so_far
from oncenter.offset.run import is_odd, offset_is_invalid
from oncenter.read.frames import Frames
from oncenter.read.stream import Stream, Ticks
from oncenter.read.whole_turns import TURN_RAD, WholeTurns
from oncenter.signals import Signals
from oncenter.vehicle import Vehicle

_MEASURED = "steering_wheel_angle_rad"
_SENSOR_TYPE = "steering_wheel_angle_sensor_type"
_HELD = ("stuck", "lost")  # faults after which what was learned before looks as good as ever

Cores = dict[str, _core.Core]


@dataclass(frozen=True)
class Stepped:
    """Ticks and what the cores gave of each: the offset's and the angle's oc_output rows."""

    ticks: Ticks
    offset: npt.NDArray[np.void]
    angle: npt.NDArray[np.void]

    def __len__(self) -> int:
        return len(self.offset)


@dataclass(frozen=True)
class Known:
    """What is known at one time. `answer` is None before the first usable second."""

    answer: Answer | None
    lacking_s: Mapping[str, float]  # of side force, by side, before the play's flank there has shown
    evidence_lacking_s: float
    flank_s: float = 1.0  # of side force, after which a flank has shown


class Learner:
    """One truck on one bus.

    Args:
        stream: its frames.
        vehicle: its `[params]` apply.
        resume: is given the cores, once the bus has told its rates and before the first tick.
    """

    def __init__(self, stream: Stream, vehicle: Vehicle, resume: Callable[[Cores], None] | None = None) -> None:
        self.stream = stream
        self.vehicle = vehicle
        self.cores: Cores = {}
        self.params = inputs.params_of(vehicle, None)
        self.last: Stepped | None = None
        self._resume = resume or (lambda cores: None)
        self._first_s = 0.0
        self._flank_s = 1.0
        self._turns: WholeTurns | None = None

    def take(self, frames: Frames) -> list[Stepped]:
        """Frames in the order in which they came."""
        set_back = not self.stream.listening and self.stream.clock_was_set_back(frames)
        stepped = self.finish() if set_back else []  # the cores see for themselves that it is another clock
        return [*stepped, *self._step(self.stream.add(frames))]

    def finish(self) -> list[Stepped]:
        """The ticks that still wait for frames which will not come."""
        return self._step(self.stream.finish())

    @property
    def turned_rad(self) -> float:
        """Whole turns that the sensor's angle is off, a relative one's; NaN while nobody knows."""
        if self._turns is None or not self._turns.relative:
            return 0.0
        return math.nan if self._turns.turns is None else self._turns.turns * TURN_RAD

    def known(self) -> Known:
        if self.last is None:
            return Known(None, {}, self.params["joint_evidence_min_s"])
        native = self.cores["offset"].answer()
        judged = self.cores["angle"].answer()
        if offset_is_invalid(judged) and (is_odd(native) or _core.FAULTS[judged["fault"]] in _HELD):
            native = judged  # as `offset` has it
        lacking_s = {"left": native["lacking_to_left"], "right": native["lacking_to_right"]}
        evidence_lacking_s = max(self.params["joint_evidence_min_s"] - native["used"], 0.0)
        answer: Answer | None
        try:
            answer = answer_so_far(native, self._seen(), self.vehicle, self.params)
        except OncenterError:
            answer = None
        return Known(answer, lacking_s, evidence_lacking_s, self._flank_s)

    def _step(self, ticks: Ticks) -> list[Stepped]:
        count = len(ticks["time_s"])
        if not count:
            return []
        if not self.cores:
            self._turns = WholeTurns(self.stream.rate_hz)
            self.cores = cores_of(self.vehicle, self.stream.rate_hz)
            self._flank_s = self.cores["offset"].answer()["lacking_to_left"]  # nothing has shown yet
            self._resume(self.cores)
        if self.last is None:
            self._first_s = float(ticks["time_s"][0])
        if _SENSOR_TYPE in ticks:
            ticks = {**ticks, _MEASURED: self._turned_back(ticks)}
        columns = {name: column for name, column in ticks.items() if name in _core.COLUMNS}
        outputs = {name: np.zeros(count, _core.OUTPUT_DTYPE) for name in self.cores}
        for name, core in self.cores.items():
            core.run(columns, outputs[name])
        self.last = Stepped(ticks, outputs["offset"], outputs["angle"])
        return [self.last]

    def _turned_back(self, ticks: Ticks) -> npt.NDArray[np.float64]:
        assert self._turns is not None
        before = len(self._turns.taken)
        angle = self._turns.taken_out(ticks)
        self.stream.notes += [
            f"{turns:+d} whole turns are taken from the relative steering wheel angle from here on"
            for _, turns in self._turns.taken[before:]
            if turns
        ]
        return angle

    def _seen(self) -> Signals:
        assert self.last is not None
        first_and_last = [self._first_s, float(self.last.ticks["time_s"][-1])]
        kind = [0.0 if self._turns is not None and self._turns.relative else 1.0] * 2
        table = pl.DataFrame({"time_s": first_and_last, _SENSOR_TYPE: kind})
        stream = self.stream
        return Signals(table, stream.sources, stream.rate_hz, stream.name, tuple(stream.notes))


def needed(vehicle: Vehicle) -> tuple[str, ...]:
    """The signals without which there is no answer."""
    return inputs.needed("joint", (), inputs.params_of(vehicle, None))


def cores_of(vehicle: Vehicle, rate_hz: float) -> Cores:
    """As `oncenter.offset` and as `oncenter.angle` set theirs up.

    Raises:
        OncenterError: "params", exit code 2.
    """
    polynomial = vehicle.steering_ratio if isinstance(vehicle.steering_ratio, tuple) else ()

    def core(**of_angle: Any) -> _core.Core:
        return _core.Core(
            vehicle.wheelbase_m,
            vehicle.ratio_near_centre,
            inputs.params_of(vehicle, None),
            rate_hz,
            method="joint",
            traffic_side=vehicle.traffic_sign,
            track_width_front_m=vehicle.track_width_front_m or 0.0,
            track_width_rear_m=vehicle.track_width_rear_m or 0.0,
            **of_angle,
        )

    try:
        return {"offset": core(), "angle": core(angle_method="observer", ratio_polynomial=polynomial)}
    except ValueError as error:
        raise OncenterError(str(error), code="params", exit_code=WRONG_USAGE) from None
