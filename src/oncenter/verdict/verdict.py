"""A verdict: what it is about, its state, and the words for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from oncenter.verdict.states import STATES, Code

About = Literal["straight-ahead offset", "steering wheel angle sensor", "free play", "yaw rate sensor", "accelerometer"]


@dataclass(frozen=True)
class Verdict:
    """A verdict in plain English, one or two sentences each.

    Attributes:
        state: its code, see `states`.
        said: the numbers and the reason; a sentence after the word of the state.
        action: the next step for the reader.
        note: how sure that is, and influences that the number does not include; empty where there is nothing to add.
    """

    about: About
    state: Code
    said: str
    action: str
    note: str = ""

    @property
    def word(self) -> str:
        return STATES[self.state].word

    @property
    def headline(self) -> str:
        """The word and the sentence after it."""
        return f"{self.word}: {self.said}"

    def words(self) -> str:
        """All of it in one line."""
        return " ".join(filter(None, (self.headline, self.action, self.note)))

    def to_dict(self) -> dict[str, str]:
        return {
            "about": self.about,
            "state": self.state,
            "word": self.word,
            "headline": self.headline,
            "action": self.action,
            "note": self.note,
        }
