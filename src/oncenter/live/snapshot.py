"""The state of a session at one time, for displays: made by one thread, read by many, never changed."""

from __future__ import annotations

from dataclasses import dataclass, field

from oncenter.live.history import Cloud, Course, Strip
from oncenter.live.learner import Known
from oncenter.verdict import Verdict


@dataclass(frozen=True)
class Notice:
    """A line for people; `number` counts all lines from 1."""

    number: int
    time_s: float  # s since 1970
    text: str


@dataclass(frozen=True)
class Angles:
    """The steering wheel now, rad, left positive; NaN where not available.

    `measured_rad` comes from the frame with the time stamp `frame_s`; `corrected_rad` is `measured_rad` minus the
    offset. `estimated_rad` and its standard deviation come from the truck's motion alone, 0.1 s ago.
    """

    frame_s: float = float("nan")
    measured_rad: float = float("nan")
    corrected_rad: float = float("nan")
    estimated_rad: float = float("nan")
    estimated_sd_rad: float = float("nan")
    vehicle_speed_m_s: float = float("nan")


@dataclass(frozen=True)
class Dropped:
    """Frames lost since the start, by the place of the loss."""

    interface: int = 0  # in the adapter or in the kernel's buffer
    queue: int = 0  # in the queue of received frames: the estimate was too slow for too long
    recording: int = 0  # used by the estimate, but not in the recorded file
    impossible: int = 0  # no CAN frame: an identifier above 29 bits, a time that is not a number

    @property
    def lost(self) -> int:
        return self.interface + self.queue + self.recording


@dataclass(frozen=True)
class Pictures:
    """The data of the page's figures; `number` grows with each."""

    number: int
    course: Course
    strip: Strip
    cloud: Cloud


@dataclass(frozen=True)
class Snapshot:
    """`phase` is "listening", "paused" (the estimate is paused, `missing` has the reason), "running", "silent" (no
    frame for 3 s) or "ended", at `ended_s`, s since 1970. `verdict` is the one to show; `is_changing`: another one is
    not shown so far."""

    number: int
    bus: str
    truck: str
    phase: str
    missing: str
    frames: int
    frames_per_s: float
    dropped: Dropped
    driven_s: float
    angles: Angles
    reasons: tuple[str, ...]
    fault: str
    known: Known
    pictures: Pictures
    notices: tuple[Notice, ...] = field(default=())
    ended_s: float | None = None
    verdict: Verdict | None = None
    is_changing: bool = False
