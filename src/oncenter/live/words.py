"""A snapshot in words and degrees, for both the terminal and the page."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from oncenter.app.texts import LIVE
from oncenter.estimates.cause import in_words
from oncenter.estimates.estimate import Estimate
from oncenter.findings import capitalised
from oncenter.live.snapshot import Dropped, Snapshot
from oncenter.offset.answer import NOT_YET_OR_NO_MORE
from oncenter.signals import DEGREE

_QUANTITIES = {  # texts of the estimates
    "backlash": "backlash",
    "gyro_bias": "yaw_rate_bias",
    "understeer_gradient": "understeer_gradient",
    "unloading_acceleration": "unloading_acceleration",
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
    at = time.strftime("%H:%M:%S", time.localtime(now.ended_s))
    has_result = now.verdict is not None and now.verdict.state != "no_offset"
    result = LIVE["final_result" if has_result else "no_result"]
    return LIVE["finished"].format(at, duration(now.driven_s), result)


def gate(now: Snapshot) -> tuple[bool, str]:
    """Whether the driving at this time is used, and the reason if not."""
    if now.phase != "running":
        return False, LIVE[now.phase]
    if now.reasons:
        return False, LIVE["not_used"].format(", ".join(LIVE[name] for name in now.reasons))
    return True, LIVE["used_now"]


def quantities(now: Snapshot) -> dict[str, str]:
    """The other quantities, by name; a dash before there is an answer."""
    answer = now.known.answer
    if answer is None:
        return {LIVE[text]: "—" for text in _QUANTITIES}
    shown = {LIVE[text]: _quantity(getattr(answer, member)) for text, member in _QUANTITIES.items()}
    if "steering_ratio" in answer.vehicle.assumed:
        at_wheel = LIVE["at_wheel"].format(_quantity(answer.understeer_at_steering_wheel))
        shown[LIVE["understeer_gradient"]] = at_wheel
    return shown


def _quantity(estimate: Estimate) -> str:
    return LIVE["not_identified"] if estimate.status == "unobservable" else signed(str(estimate))


def still_missing(now: Snapshot, params: Mapping[str, float]) -> list[str]:
    """The driving that is still needed, one line each; empty when none is."""
    if now.phase in ("listening", "paused"):
        return [now.missing or LIVE["senders"]]
    return list(_lacking(now, params))


def _lacking(now: Snapshot, params: Mapping[str, float]) -> Iterator[str]:
    known = now.known
    if known.evidence_lacking_s > 0:
        speed_km_h = 3.6 * params["joint_speed_min_m_s"]
        yield LIVE["more_above"].format(_long(known.evidence_lacking_s), speed_km_h)
    for side, lacking_s in known.lacking_s.items():
        if lacking_s > 0:
            yield LIVE[f"bends_to_{side}"].format(math.ceil(lacking_s))
    if known.answer is None or known.evidence_lacking_s > 0:
        return
    offset = known.answer.offset
    if offset.status == "converging" and offset.ci95 is not None:
        yield LIVE["wide"]
    elif offset.status == "unobservable" and known.answer.combined_offset is None:
        yield LIVE["steady_speed"]
    elif offset.status == "invalid":
        yield LIVE["without_fault"]
    elif now.is_changing:
        yield LIVE["changing"]
    elif now.verdict is not None and now.verdict.state == "undecided":
        yield LIVE["limit_inside"]


def loaded_share(now: Snapshot, side: str) -> float:
    """The share of the loading that the flank on that side needs, 0 to 1."""
    known = now.known
    return 1.0 - min(known.lacking_s.get(side, known.flank_s) / known.flank_s, 1.0)


def bus(now: Snapshot) -> str:
    rate = LIVE["rate"].format(now.frames_per_s) if now.ended_s is None else ""
    lost = losses(now.dropped)
    return f"{rate}{LIVE['frames'].format(now.frames)}{', ' if lost else ''}{lost}"


def losses(dropped: Dropped) -> str:
    """How many frames were lost or discarded, and where; empty if none."""
    lost = {"at_interface": dropped.interface, "in_queue": dropped.queue, "in_recording": dropped.recording}
    where = ", ".join(LIVE[text].format(count) for text, count in lost.items() if count)
    words = [LIVE["lost_frames"].format(where)] if where else []
    if dropped.impossible:
        words.append(LIVE["discarded"].format(dropped.impossible))
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
