"""A snapshot in words and degrees, for both the terminal and the page."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from oncenter.estimates.cause import in_words
from oncenter.estimates.estimate import Estimate
from oncenter.findings import capitalised
from oncenter.live.snapshot import Dropped, Snapshot
from oncenter.offset.answer import NOT_YET_OR_NO_MORE
from oncenter.signals import DEGREE

REASONS = {
    "missing_signal": "a signal is not available",
    "time": "time does not increase",
    "gap": "first sample after a gap",
    "settling": "filters are settling",
    "speed": "too slow",
    "curvature": "bend too tight",
    "longitudinal_acceleration": "braking or accelerating",
    "bank": "kerb or sudden road bank",
    "lateral_acceleration": "lateral acceleration too high",
    "yaw_rate_bias": "yaw rate bias is changing",
    "window": "usable driving too short so far",
}
_QUANTITIES = {
    "free play": "backlash",
    "yaw rate bias": "yaw_rate_bias",
    "understeer gradient": "understeer_gradient",
    "neutral lateral acceleration": "unloading_acceleration",
}
_PHASES = {
    "listening": "listening to the bus",
    "paused": "the estimate is paused",
    "silent": "no frames on the bus",
    "ended": "finished",
}


def number(value_rad: float | None, digits: int = 1) -> str:
    """Degrees with a sign; a dash for None and NaN."""
    if value_rad is None or math.isnan(value_rad):
        return "—"
    return f"{value_rad / DEGREE:+.{digits}f}".replace("-", "−")


@dataclass(frozen=True)
class Offset:
    """The straight-ahead offset, degrees in words; the intervals are empty while there is none.

    `of_drive` is this drive's part of the 95 % interval, `whole` the ends of the whole interval, and `beside` names the
    causes that are not identifiable from one drive. `but` qualifies a value that must not be set.
    """

    value: str
    of_drive: str
    whole: str
    beside: str
    status: str
    but: str


def offset(now: Snapshot) -> Offset:
    answer = now.known.answer
    if answer is None or answer.offset.value is None or answer.offset.ci95 is None:
        return Offset("—", "", "", "", "unobservable" if answer is None else answer.offset.status, "")
    low, high = answer.offset.ci95
    half_width = answer.offset_half_width_rad or 0.0
    digits = 2 if half_width < 1.0 * DEGREE else 1
    return Offset(
        value=number(answer.offset.value, digits),
        of_drive=f"± {half_width / DEGREE:.{digits}f}",
        whole=f"{number(low, digits)} to {number(high, digits)}",
        beside=in_words(answer.not_identifiable),
        status=answer.offset.status,
        but=NOT_YET_OR_NO_MORE.get(answer.offset.status, ""),
    )


def finished(now: Snapshot) -> str:
    """When the session ended, and its result; empty before."""
    if now.ended_s is None:
        return ""
    at = f"finished at {time.strftime('%H:%M:%S', time.localtime(now.ended_s))}"
    return f"{at} after {duration(now.driven_s)} of driving: {'no result' if now.verdict is None else 'final result'}."


def gate(now: Snapshot) -> tuple[bool, str]:
    """Whether the driving at this time is used, and the reason if not."""
    if now.phase != "running":
        return False, _PHASES[now.phase]
    if now.reasons:
        return False, "not used: " + ", ".join(REASONS[name] for name in now.reasons)
    return True, "this driving is used"


def quantities(now: Snapshot) -> dict[str, str]:
    """The other quantities, by name; a dash before there is an answer."""
    answer = now.known.answer
    if answer is None:
        return dict.fromkeys(_QUANTITIES, "—")
    shown = {name: _quantity(getattr(answer, member)) for name, member in _QUANTITIES.items()}
    if "steering_ratio" in answer.vehicle.assumed:
        shown["understeer gradient"] = f"{_quantity(answer.understeer_at_steering_wheel)} at the steering wheel"
    return shown


def _quantity(estimate: Estimate) -> str:
    return "not identified yet" if estimate.status == "unobservable" else signed(str(estimate))


def still_missing(now: Snapshot, params: Mapping[str, float]) -> list[str]:
    """The driving that is still needed, one line each; empty when none is."""
    if now.phase in ("listening", "paused"):
        return [now.missing or "listening for 5 s: senders and their rates"]
    return list(_lacking(now, params))


def _lacking(now: Snapshot, params: Mapping[str, float]) -> Iterator[str]:
    known = now.known
    if known.evidence_lacking_s > 0:
        speed_km_h = 3.6 * params["joint_speed_min_m_s"]
        yield f"{_long(known.evidence_lacking_s)} more above {speed_km_h:.0f} km/h"
    for side, lacking_s in known.lacking_s.items():
        if lacking_s > 0:
            yield f"{math.ceil(lacking_s)} s of bends to the {side}"
    if known.answer is None or known.evidence_lacking_s > 0:
        return
    offset = known.answer.offset
    if offset.status == "converging" and offset.ci95 is not None:
        yield "bends to both sides: the interval of the offset is still too wide"
    elif offset.status == "unobservable":
        yield "bends to both sides, at a steady speed"
    elif offset.status == "invalid":
        yield "signals without a fault: see the findings"
    elif now.is_changing:
        yield "more driving: the verdict is changing"
    elif now.verdict is not None and now.verdict.state == "undecided":
        yield "bends to both sides: the limit is inside the interval of the offset"


def loaded_share(now: Snapshot, side: str) -> float:
    """The share of the loading that the flank on that side needs, 0 to 1."""
    known = now.known
    return 1.0 - min(known.lacking_s.get(side, known.flank_s) / known.flank_s, 1.0)


def bus(now: Snapshot) -> str:
    lost = losses(now.dropped)
    return f"{now.frames_per_s:.0f} frames/s, {now.frames} in all{', ' if lost else ''}{lost}"


def losses(dropped: Dropped) -> str:
    """How many frames were lost or discarded, and where; empty if none."""
    lost = {
        "before oncenter received them": dropped.interface,
        "in oncenter's queue": dropped.queue,
        "not recorded": dropped.recording,
    }
    words = [f"lost: {', '.join(f'{count} {where}' for where, count in lost.items() if count)}"] if dropped.lost else []
    if dropped.impossible:
        words.append(f"discarded: {dropped.impossible} that are no CAN frames")
    return "; ".join(words)


def duration(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min {rest} s"


def _long(seconds: float) -> str:
    return f"{math.ceil(seconds)} s" if seconds < 120 else f"{math.ceil(seconds / 60)} min"


def sentence(text: str) -> str:
    """The text as a sentence of a page: a capital, a full stop, a minus sign."""
    typeset = signed(text)
    return capitalised(typeset) + ("" if typeset.endswith((".", "!", "?")) else ".")


def signed(text: str) -> str:
    return re.sub(r"(?<![\w.])-(?=\d)", "−", text.replace("^2", "²").replace("+-", "±"))
