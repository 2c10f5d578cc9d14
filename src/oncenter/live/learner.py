"""The core on a bus: takes frames, runs the code that also reads logs, gives the answer so far. No thread, no clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.estimates.by_priors import OffsetBy, by_priors
from oncenter.offset import inputs
from oncenter.offset.answer import Answer
from oncenter.offset.assemble import answer_so_far, offset_by
from oncenter.offset.bias_course import BiasCourse
from oncenter.offset.withheld import Gaps, absent_ticks
from oncenter.read.frames import Frames
from oncenter.read.stream import Stream, Ticks
from oncenter.read.whole_turns import TURN_RAD, WholeTurns
from oncenter.signals import Signals
from oncenter.vehicle import Vehicle, core_of

_MEASURED = "steering_wheel_angle_rad"
_SENSOR_TYPE = "steering_wheel_angle_sensor_type"


@dataclass(frozen=True)
class Stepped:
    """Ticks, and the core's output of each, an oc_output row."""

    ticks: Ticks
    outputs: npt.NDArray[np.void]

    def __len__(self) -> int:
        return len(self.outputs)


@dataclass(frozen=True)
class Known:
    """The result so far. `answer` is None before the first usable second."""

    answer: Answer | None
    lacking_s: Mapping[str, float]  # by side, lateral force that loads this flank of the play and is still missing
    evidence_lacking_s: float
    flank_s: float = 1.0  # of lateral force, after which a flank counts as loaded


class Learner:
    """One truck on one bus.

    Args:
        stream: its frames.
        vehicle: its `[params]` apply.
        resume: called with the core when the rates are identified, before the first tick.
    """

    def __init__(self, stream: Stream, vehicle: Vehicle, resume: Callable[[_core.Core], None] | None = None) -> None:
        self.stream = stream
        self.vehicle = vehicle
        self.core: _core.Core | None = None
        self.params = inputs.params_of(vehicle, None)
        self.last: Stepped | None = None
        self._resume = resume or (lambda core: None)
        self._first_s = 0.0
        self._flank_s = 1.0
        self._turns: WholeTurns | None = None
        self._bias = BiasCourse()
        self._absent_ticks = self._turning_ticks = 0

    def take(self, frames: Frames) -> list[Stepped]:
        """Frames in the order in which they came."""
        stepped = []
        for piece in self.stream.pieces(frames):
            set_back = not self.stream.listening and self.stream.clock_was_set_back(piece)
            stepped += self.finish() if set_back else []  # the core detects the other clock itself
            stepped += self._step(self.stream.add(piece))
        return stepped

    def finish(self) -> list[Stepped]:
        """The ticks that still wait for later frames."""
        return self._step(self.stream.finish())

    @property
    def turned_rad(self) -> float:
        """Whole turns in a relative sensor's angle, rad; NaN while not identified; 0 for an absolute sensor."""
        if self._turns is None or not self._turns.relative:
            return 0.0
        return math.nan if self._turns.turns is None else self._turns.turns * TURN_RAD

    def known(self) -> Known:
        if self.last is None or self.core is None:
            return Known(None, {}, self.params["joint_evidence_min_s"])
        native = self.core.answer()
        native["yaw_rate_bias_moved"] = self._bias.moved_rad_s
        lacking_s = {"left": native["lacking_to_left"], "right": native["lacking_to_right"]}
        evidence_lacking_s = max(self.params["joint_evidence_min_s"] - native["used"], 0.0)
        answer: Answer | None
        try:
            gaps = Gaps(self._absent_ticks / self.stream.rate_hz, self._turning_ticks / self.stream.rate_hz)
            answer = answer_so_far(native, self._signals(), self.vehicle, self.params, gaps)
            if answer.offset.value is not None:
                answer = replace(answer, by_priors=tuple(by_priors(self._offset_by, self.params)))
        except OncenterError:
            answer = None
        return Known(answer, lacking_s, evidence_lacking_s, self._flank_s)

    def _offset_by(self, params: Mapping[str, float]) -> OffsetBy | None:
        assert self.core is not None
        return offset_by(self.core.answer_by(core_of(self.vehicle, self.stream.rate_hz, params=params)))

    def _step(self, ticks: Ticks) -> list[Stepped]:
        count = len(ticks["time_s"])
        if not count:
            return []
        if self.core is None:
            self._turns = WholeTurns(self.stream.rate_hz)
            self.core = core_of(self.vehicle, self.stream.rate_hz)
            self._flank_s = self.core.answer()["lacking_to_left"]  # neither flank is loaded yet
            self._resume(self.core)
        if self.last is None:
            self._first_s = float(ticks["time_s"][0])
        self._absent_ticks += absent_ticks(ticks, needed(self.vehicle))
        if _SENSOR_TYPE in ticks:
            angle = self._turned_back(ticks)
            self._turning_ticks += int(np.count_nonzero(np.isnan(angle) & ~np.isnan(ticks[_MEASURED])))
            ticks = {**ticks, _MEASURED: angle}
        columns = {name: column for name, column in ticks.items() if name in _core.COLUMNS}
        outputs = np.zeros(count, _core.OUTPUT_DTYPE)
        self.core.run(columns, outputs)
        self._bias.take(outputs)
        self.last = Stepped(ticks, outputs)
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

    def _signals(self) -> Signals:
        assert self.last is not None
        first_and_last = [self._first_s, float(self.last.ticks["time_s"][-1])]
        kind = [0.0 if self._turns is not None and self._turns.relative else 1.0] * 2
        columns = {"time_s": np.array(first_and_last), _SENSOR_TYPE: np.array(kind)}
        stream = self.stream
        return Signals(columns, stream.sources, stream.rate_hz, stream.name, tuple(stream.notes))


def needed(vehicle: Vehicle) -> tuple[str, ...]:
    """The signals that an answer needs."""
    return inputs.needed("joint", (), inputs.params_of(vehicle, None))
