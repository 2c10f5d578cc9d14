"""The content of an answer's JSON, for benches: its statements, whom it accuses, and which of its valid numbers are
wrong. It depends on the keys of the contract and on words, not on the codes of findings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from oncenter.signals import DEGREE
from oncenter.simulate.truth import Truth

Answer = Mapping[str, Any]

OFF_DEG = 0.5  # a valid offset that is off by more, and outside its interval, is wrong
# Of the other estimates, in the unit of files: a tenth of what a workshop acts on, or more.
OFF = {"yaw_rate_bias": 0.3, "understeer_gradient": 0.15, "backlash": 2.0}

SIGNAL_WORDS = {
    "steering_wheel_angle": re.compile(r"steering[ _]wheel[ _]angle|\bangle\b|offset changed", re.IGNORECASE),
    "yaw_rate": re.compile(r"yaw[ _]rate|gyro", re.IGNORECASE),
    "vehicle_speed": re.compile(r"vehicle[ _]speed|\bspeed\b|CCVS1|standstill", re.IGNORECASE),
    "lateral_acceleration": re.compile(r"lateral[ _]acceleration|accelerometer", re.IGNORECASE),
    "wheel_speed": re.compile(r"wheel[ _]speed|(?<!steering )\bwheels?\b|tyres?", re.IGNORECASE),
}
SIGNAL_OR_SENSOR = re.compile(r"signal or (the )?sensor|sensor or (the )?signal", re.IGNORECASE)
_REPAIR = re.compile(r"\b(repair|replace|remount)", re.IGNORECASE)
_NEGATED = re.compile(
    r"\b(no|not|never|without|before|nothing to)\b[^.;:]*\b(repair|replace|remount)\w*", re.IGNORECASE
)
_DECIDES_NOTHING = re.compile(r"^(no (verdict|offset|correction)|undecided|check|signal or sensor)", re.IGNORECASE)


@dataclass(frozen=True)
class Statement:
    """A text of the answer. `severity` is that of a finding, "verdict", "note" or "refusal"; `code` also the state of a
    verdict with what it is about."""

    severity: str
    code: str
    text: str

    @property
    def accuses(self) -> bool:
        """Whether it is more than information."""
        if self.severity == "verdict":
            return bool(re.search(r": (repair|check|no_verdict|signal|reversed)", self.code)) or self.is_repair
        return self.severity in ("warning", "error", "refusal")

    @property
    def is_repair(self) -> bool:
        """Whether it advises to repair, to replace or to remount, or says that something was remounted."""
        return bool(_REPAIR.search(_NEGATED.sub("", self.text)))

    def names(self, signal: str) -> bool:
        """Whether its first clause names the signal; the whole text where the first clause names no signal."""
        first = re.split(r"[:.] ", self.text, maxsplit=1)[0]
        named = [name for name, words in SIGNAL_WORDS.items() if words.search(first)]
        return signal in named if named else bool(SIGNAL_WORDS[signal].search(self.text))


def statements(answer: Answer) -> list[Statement]:
    """All texts of an answer, or of the object that an error gives."""
    if "message" in answer:
        return [Statement("refusal", answer["code"], answer["message"])]
    said = [Statement(f["severity"], f["code"], f["text"]) for f in answer["findings"]]
    said += [
        Statement("verdict", f"{v['about']}: {v['state']}", " ".join((v["headline"], v["action"], v["note"])))
        for v in answer["verdicts"]
    ]
    return said + [Statement("note", "note", note) for note in answer["notes"]]


def is_valid(answer: Answer) -> bool:
    return "offset" in answer and answer["offset"]["status"] == "valid"


def decides(answer: Answer) -> bool:
    """Whether the first verdict is more than a question."""
    return not _DECIDES_NOTHING.match(answer["verdicts"][0]["headline"])


def is_off(answer: Answer, offsets_deg: Sequence[float]) -> bool:
    """Whether a valid offset is wrong: off by more than `OFF_DEG` and outside the interval from the drive, half a turn
    or more to add, or a decision where no offset is right."""
    if not is_valid(answer):
        return False
    offset = answer["offset"]
    value, (low, high) = offset["value"], offset["ci95_drive"] or offset["ci95"]
    if not offsets_deg:
        return decides(answer)
    if abs(value) > 180.0:
        return bool(answer["verdicts"][0]["state"] == "recalibrate")
    return all(abs(value - true) > OFF_DEG and not low <= true <= high for true in offsets_deg)


def wrong(answer: Answer, offsets_deg: Sequence[float], truth: Truth, spoiled: Sequence[str] = ()) -> Iterator[str]:
    """Names of the estimates that are valid and wrong; those in `spoiled` have no true value."""
    if is_off(answer, offsets_deg):
        yield "offset"
    for name, (least, most) in true_ranges(truth).items():
        estimate = answer.get(name)
        if name in spoiled or estimate is None or estimate["status"] != "valid" or estimate["ci95"] is None:
            continue
        low, high = estimate["ci95"]
        off = max(least - estimate["value"], estimate["value"] - most)
        if off > OFF[name] and (low > most or high < least):
            yield name


def true_ranges(truth: Truth) -> dict[str, tuple[float, float]]:
    """By estimate the range of its true value, in the unit of files."""
    gradient, bias = truth.understeer_gradient / DEGREE, truth.yaw_rate_bias_rad_s / DEGREE
    play = (truth.backlash_rad + truth.windup_rad) / DEGREE
    return {
        "understeer_gradient": (gradient, gradient),
        "backlash": (play, play + truth.torsion_bar_rad / DEGREE),
        "yaw_rate_bias": (bias, bias),
    }
