"""Large losses of values in the log: they explain a missing signal and a wide interval before the truck does."""

from __future__ import annotations

from oncenter.account import FIRST_FROM, WORDS
from oncenter.estimates.estimates import Estimates
from oncenter.findings import capitalised, large_losses

_NOT_THE_FILE = ("not_available", "error_code", "time_not_later")  # the sender itself says so; a frame recorded twice


def first_loss(answer: Estimates) -> str:
    """The largest one as a sentence; empty without one. A log that has each frame twice lacks nothing."""
    twice = WORDS["time_not_later"][0]
    losses = [loss for loss in large_losses(answer.findings) if twice not in loss]
    return f"{capitalised(losses[0])}." if losses else ""


def is_angle_lost_in_file(answer: Estimates) -> bool:
    """Whether the log has angles that were left out for a reason that is not the sender's."""
    accounts = [drive.account.signals.get("steering_wheel_angle") for drive in answer.drives if drive.account]
    shares = [(reason, share) for account in accounts if account for reason, share in account.shares().items()]
    return any(share > FIRST_FROM and reason not in _NOT_THE_FILE for reason, share in shares)
