"""All that displays need to know at one time: made by one thread, read by many, never changed."""

from __future__ import annotations

from dataclasses import dataclass, field

from oncenter.live.history import Cloud, Course, Strip
from oncenter.live.learner import Known


@dataclass(frozen=True)
class Said:
    """A line for people: the number counts all that were said."""

    number: int
    time_s: float  # s since 1970
    text: str


@dataclass(frozen=True)
class Angles:
    """The steering wheel now, rad, left positive; NaN where it is not known.

    `measured_rad` is of the frame stamped `frame_s`; `corrected_rad` is it less the offset; `estimated_rad` and its
    standard deviation are what the truck's motion alone says, a tenth of a second old.
    """

    frame_s: float = float("nan")
    measured_rad: float = float("nan")
    corrected_rad: float = float("nan")
    estimated_rad: float = float("nan")
    estimated_sd_rad: float = float("nan")
    vehicle_speed_m_s: float = float("nan")


@dataclass(frozen=True)
class Dropped:
    """Frames that were lost since the beginning, by the place where they were lost."""

    interface: int = 0  # in the adapter or in the kernel's buffer: oncenter never got them
    queue: int = 0  # in our queue of received frames: the estimate was too slow for too long
    recording: int = 0  # used by the estimate, but not in the recorded file
    impossible: int = 0  # no CAN frame: an identifier above 29 bits, a time that is no number

    @property
    def lost(self) -> int:
        return self.interface + self.queue + self.recording


@dataclass(frozen=True)
class Pictures:
    """What changes slowly; `number` grows with each."""

    number: int
    course: Course
    strip: Strip
    cloud: Cloud


@dataclass(frozen=True)
class Snapshot:
    """`phase` is "listening", "paused" (of the estimate: `missing` says why), "running", "silent" (no frame for long)
    or "ended"."""

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
    said: tuple[Said, ...] = field(default=())
