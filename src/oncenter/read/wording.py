"""Errors and counts as all readers word them."""

from __future__ import annotations

from pathlib import Path

from oncenter.errors import OncenterError

# What a message says about a log whose signals have other names; it follows a list of the names.
ASSIGN_THEM = "assign them in the [signals] table of a vehicle file"
FOUND = "found: "  # before the signals that a log has, where others are missing


def cannot_read(path: Path, error: Exception) -> OncenterError:
    reason = getattr(error, "strerror", None) or str(error)
    return OncenterError(f"cannot read {path}: {reason}", code="unreadable_log")


def damaged(name: str, reason: str, remedy: str = "copy or export it again") -> OncenterError:
    """The error of a file whose content contradicts its format."""
    return OncenterError(
        f"cannot read {name}: the file is damaged or has another format ({reason[:160]}); {remedy}",
        code="unreadable_log",
    )


def counted(number: int, noun: str) -> str:
    """The number with its noun: "1 line" or "3 lines"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def reason_of(error: BaseException) -> str:
    """The first line of an exception's text, or its type if it has none."""
    return (str(error).strip().splitlines() or [""])[0] or type(error).__name__
