"""The account of a log: each frame, row and sample of the file was used, superseded, or left out for a reason.

Reasons are codes, which JSON and the fleet's tables have; `WORDS` has them for people.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

# By reason, the end of the sentence "12 % of the samples are left out: ...", then the action for the user.
WORDS: Mapping[str, tuple[str, str]] = {
    "not_available": ("the sender marks them as not available", "Check the sensor and its sender"),
    "error_code": ("the sender sends an error code", "Read the trouble codes of the sender, and check the sensor"),
    "reserved_code": (
        "they have a code that J1939 reserves",
        "Check the byte order and the position of the signal in the database",
    ),
    "frame_too_short": ("their frames are too short for the signal", "Check the message length and the database"),
    "other_multiplexer_page": ("their frames have another multiplexer page", ""),
    "outside_range": (
        "they jump to a value outside the range of the database",
        "Check the range and the error codes of the signal in the database",
    ),
    "invalid_bit": ("the logger marks them as invalid", "Check the logger and the sender"),
    "no_number": ("the conversion in the file gives no number", "Check the conversion of the channel"),
    "infinite": ("they are infinite", "Check the export of the log"),
    "without_time": ("their rows have no time", "Check the export of the log"),
    "short_row": ("their rows have too few cells", "Copy or export the log again"),
    "cut_off": ("their line is cut off", "Copy the log again"),
    "time_not_later": (
        "their time is that of the sample before, or earlier",
        "Check whether the log has the bus twice, and the clock of the logger",
    ),
    "no_neighbour": ("the samples next to them are too far away in time", "Check the logger for lost frames"),
    "can_fd": ("they are CAN FD frames of more than 8 bytes, which no database describes", ""),
    "error_frame": ("they are error frames", ""),
    "remote_frame": ("they are remote frames", ""),
    "unreadable": ("they cannot be read", ""),
    "no_signal": ("they have no signal that oncenter uses", ""),
    "other_source": ("another source of the signal is used", ""),
}
BY_DESIGN = frozenset(("other_multiplexer_page", "no_signal", "other_source"))  # no value is lost by these
NAMED_FROM, FIRST_FROM = 0.001, 0.05  # of a signal's samples: a reason is named, and an answer begins with it


class AccountError(RuntimeError):
    """The sums of an account do not agree: an internal error."""


@dataclass(frozen=True)
class FileAccount:
    """in_file = used + left_out.

    Attributes:
        unit: "frames", "rows", or "samples" where a file has channels, variables or fields.
        left_out: counts by reason.

    Raises:
        AccountError: the sum does not agree.
    """

    unit: str
    in_file: int
    used: int
    left_out: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check("file", self.in_file, self.used, *self.left_out.values())

    def to_dict(self) -> dict[str, Any]:
        return {"unit": self.unit, "in_file": self.in_file, "used": self.used, "left_out": dict(self.left_out)}


@dataclass(frozen=True)
class SignalAccount:
    """in_file = used + superseded + left_out; ticks = fresh + held + missing.

    Attributes:
        in_file: samples of the signal's source; of a table the cells with a number.
        used: samples that decide at least one tick.
        superseded: samples with a newer one before the next tick.
        left_out: counts by reason.
        fresh: ticks whose nearest sample is not that of the tick before.
        held: ticks with a value, whose nearest sample is that of the tick before.
        missing: ticks without a value.
        outside_range: samples beyond the range of the database that are used, since they continue the signal.

    Raises:
        AccountError: a sum does not agree.
    """

    in_file: int
    used: int
    superseded: int
    left_out: Mapping[str, int]
    ticks: int = 0
    fresh: int = 0
    held: int = 0
    missing: int = 0
    outside_range: int = 0

    def __post_init__(self) -> None:
        _check("samples", self.in_file, self.used, self.superseded, *self.left_out.values())
        _check("ticks", self.ticks, self.fresh, self.held, self.missing)

    def shares(self) -> dict[str, float]:
        """By reason, the share of the samples that it took; without reasons by which no value is lost."""
        whole = self.in_file - sum(count for reason, count in self.left_out.items() if reason in BY_DESIGN)
        return {reason: count / whole for reason, count in self.left_out.items() if count and reason not in BY_DESIGN}

    def to_dict(self) -> dict[str, Any]:
        return {**vars(self), "left_out": dict(self.left_out)}


@dataclass(frozen=True)
class Account:
    """`signals` by name: those of the table, and those of which no sample could be used."""

    file: FileAccount
    signals: Mapping[str, SignalAccount]

    def largest(self, names: Collection[str]) -> tuple[str, str, float] | None:
        """Signal, reason and share of the largest loss among these signals; None without one."""
        accounts = [(name, of) for name, of in self.signals.items() if name in names]
        losses = [(share, name, reason) for name, of in accounts for reason, share in of.shares().items()]
        if not losses:
            return None
        share, name, reason = max(losses)
        return name, reason, share

    def to_dict(self) -> dict[str, Any]:
        return {**self.file.to_dict(), "signals": {name: of.to_dict() for name, of in self.signals.items()}}

    @staticmethod
    def of_dict(given: Mapping[str, Any]) -> Account:
        """From `to_dict`."""
        of_file = {name: value for name, value in given.items() if name != "signals"}
        return Account(FileAccount(**of_file), {name: SignalAccount(**of) for name, of in given["signals"].items()})


def _check(what: str, whole: int, *parts: int) -> None:
    if whole != sum(parts) or min(whole, *parts) < 0:
        raise AccountError(f"the account of the {what} does not add up: {whole} is not {' + '.join(map(str, parts))}")
