"""A snapshot in words and degrees, for the terminal and the page alike."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from oncenter.live.snapshot import Dropped, Snapshot
from oncenter.offset.answer import NOT_YET_OR_NO_MORE, Estimate
from oncenter.offset.cause import in_words
from oncenter.offset.findings import capitalised
from oncenter.signals import DEGREE

REASONS = {
    "missing_signal": "a signal is not available",
    "time": "time stood still or ran backward",
    "gap": "first tick after a hole",
    "settling": "filters settling",
    "speed": "too slow",
    "curvature": "bend too tight",
    "longitudinal_acceleration": "braking or speeding up",
    "bank": "kerb or sudden bank",
    "lateral_acceleration": "too fast in the bend",
    "yaw_rate_bias": "gyro bias moves",
    "window": "not clean for long enough",
}
_QUANTITIES = {
    "play": "backlash",
    "gyro bias": "yaw_rate_bias",
    "understeer gradient": "understeer_gradient",
    "steering unloads at": "unloading_acceleration",
}
_PHASES = {
    "listening": "listening to the bus",
    "paused": "the estimate is paused",
    "silent": "no frames",
    "ended": "ended",
}


def number(value_rad: float | None, digits: int = 1) -> str:
    """Degrees with a sign; a dash for what there is not."""
    if value_rad is None or math.isnan(value_rad):
        return "—"
    return f"{value_rad / DEGREE:+.{digits}f}".replace("-", "−")


@dataclass(frozen=True)
class Offset:
    """Of the straight-ahead offset, degrees in words; the intervals are empty while there is none.

    `of_drive` is the part of the 95 % interval that this drive leaves open, `whole` the ends of all of it, and `beside`
    what of it no single drive identifies. `but` stands beside a value that is not to be set.
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


def gate(now: Snapshot) -> tuple[bool, str]:
    """Whether what is driven now counts, and why not."""
    if now.phase != "running":
        return False, _PHASES[now.phase]
    if now.reasons:
        return False, "not used: " + ", ".join(REASONS[name] for name in now.reasons)
    return True, "this counts" if now.known.answer is not None else "clean so far"


def quantities(now: Snapshot) -> dict[str, str]:
    """What else is known, by name; a dash for what is not."""
    answer = now.known.answer
    if answer is None:
        return dict.fromkeys(_QUANTITIES, "—")
    return {name: _quantity(getattr(answer, member)) for name, member in _QUANTITIES.items()}


def _quantity(estimate: Estimate) -> str:
    return "not known yet" if estimate.status == "unobservable" else _signed(str(estimate))


def still_missing(now: Snapshot, params: Mapping[str, float]) -> list[str]:
    """What driving would still help, one line each; empty when the workshop may stop."""
    if now.phase in ("listening", "paused"):
        return [now.missing or "listening: which senders there are, and how often they send"]
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
        yield "bends to both sides: the offset is not identified closely enough yet"
    elif offset.status == "unobservable":
        yield "bends to both sides, at a steady speed"
    elif offset.status == "invalid":
        yield "a signal that is not at fault: see the findings"


def seen_share(now: Snapshot, side: str) -> float:
    """How much of the flank on that side has shown, 0 to 1."""
    known = now.known
    return 1.0 - min(known.lacking_s.get(side, known.flank_s) / known.flank_s, 1.0)


def bus(now: Snapshot) -> str:
    lost = losses(now.dropped)
    return f"{now.frames_per_s:.0f} frames/s, {now.frames} in all{', ' if lost else ''}{lost}"


def losses(dropped: Dropped) -> str:
    """How many frames were lost or left out, and where; empty when none was."""
    lost = {
        "before oncenter got them": dropped.interface,
        "in oncenter's queue": dropped.queue,
        "not recorded": dropped.recording,
    }
    told = [f"lost: {', '.join(f'{count} {where}' for where, count in lost.items() if count)}"] if dropped.lost else []
    if dropped.impossible:
        told.append(f"left out: {dropped.impossible} that are no CAN frames")
    return "; ".join(told)


def duration(seconds: float) -> str:
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min {rest} s"


def _long(seconds: float) -> str:
    return f"{math.ceil(seconds)} s" if seconds < 120 else f"{math.ceil(seconds / 60)} min"


def sentence(text: str) -> str:
    """As a page shows it: a capital, a full stop, a true minus."""
    signed = _signed(text)
    return capitalised(signed) + ("" if signed.endswith((".", "!", "?")) else ".")


def _signed(text: str) -> str:
    return re.sub(r"(?<![\w.])-(?=\d)", "−", text.replace("^2", "²").replace("+-", "±"))
