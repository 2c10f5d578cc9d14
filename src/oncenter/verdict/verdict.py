"""A verdict: what it is about, its state, and the words for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

About = Literal["straight-ahead offset", "steering wheel angle sensor", "free play", "yaw rate sensor", "accelerometer"]
State = Literal[
    # of the offset
    "recalibrate",  # valid, and the limit or more
    "within",  # valid, and less than the limit
    "over",  # the limit or more, but it must not be set to zero with this number
    "undecided",  # more driving is needed; of free play and sensors: not measured
    "no_correction",  # a relative sensor: no stored correction can hold
    "no_verdict",  # signals contradict each other
    # of free play and sensors
    "ok",
    "check",
    "repair",  # of the offset: the angle sensor is at fault
]


@dataclass(frozen=True)
class Verdict:
    """A verdict in plain English, one or two sentences each.

    Attributes:
        headline: the verdict with its numbers.
        action: the next step for the reader.
        note: how sure that is, and influences that the number does not include; empty where there is nothing to add.
    """

    about: About
    state: State
    headline: str
    action: str
    note: str = ""

    def words(self) -> str:
        """All of it in one line."""
        return " ".join(filter(None, (self.headline, self.action, self.note)))

    def to_dict(self) -> dict[str, str]:
        return {
            "about": self.about,
            "state": self.state,
            "headline": self.headline,
            "action": self.action,
            "note": self.note,
        }
