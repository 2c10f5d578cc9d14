"""Entries of a `[signals]` table, proposed from the names and units of a database's signals or a table's columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from oncenter.read.named import Named
from oncenter.read.parts import parts_of
from oncenter.read.units import factors, is_unit, unit_by_suffix, unit_key
from oncenter.signals import SignalName

_WHEEL = r"(?=.*(wheel|whl|rad))"
_ACCELERATION = r"(acc|beschl)"

# By signal: patterns of names, the most specific first, for words in lower case between blanks.
_PATTERNS: Mapping[str, tuple[str, ...]] = {
    "steering_wheel_angle": (
        r"\b(st\w*|lenk\w*) ?(wheel|whl|rad|w)\w* ?(ang|winkel)",
        r"\b(st|str|steer|steering|lenk|sas|eps) ?(ang|winkel)|\b(swa|lrw|lws)\b",
    ),
    "yaw_rate": (r"\b(yaw|gier) ?(rate|rt|vel|geschw)|\bpsi ?(p|dot)\b", r"\b(yaw|gier)", r"\bgyro( z)?\b"),
    "vehicle_speed": (
        r"\b(veh|vehicle|fzg|fahrzeug|ego|car|truck|wheel based vehicle) ?(spd|speed|vel|geschw|v)",
        r"\b(ground|tachograph|gps|gnss) ?(vehicle )?(spd|speed)",
        r"^(?!.*(wheel|whl|rad))(\w+ )?(spd|speed|velocity|geschwindigkeit|vx|v)( \w+)?$",
    ),
    "lateral_acceleration": (rf"\b(lat|quer|transv)\w* ?{_ACCELERATION}", rf"\bay\b|\b{_ACCELERATION}\w* y\b"),
    "longitudinal_acceleration": (
        rf"\b(long|lon|lng|längs|laengs)\w* ?{_ACCELERATION}",
        rf"\bax\b|\b{_ACCELERATION}\w* x\b",
    ),
    "wheel_speed_front_left": (rf"{_WHEEL}.*\b(fl|vl|lf|(f|front|frnt|vorn\w*) (l|le|left|li\w*))\b",),
    "wheel_speed_front_right": (rf"{_WHEEL}.*\b(fr|vr|rf|(f|front|frnt|vorn\w*) (r|ri|right|re|rechts))\b",),
    "wheel_speed_rear_left": (rf"{_WHEEL}.*\b(rl|hl|lr|(r|re|rear|hint\w*) (l|le|left|li\w*))\b",),
    "wheel_speed_rear_right": (rf"{_WHEEL}.*\b(rr|hr|(r|re|rear|hint\w*) (r|ri|right|re|rechts))\b",),
    "steering_wheel_torque": (r"\b(st|str|steer|steering|lenk|hand|driver)\w* ?(wheel )?(trq|tq|torque|moment)",),
}
_NAME_MAX = 100  # characters that are looked at
_OTHERS_MAX = 20  # further candidates of a signal
_BESIDE_MAX = 1000  # names of a message, or columns of a table
_USUAL_UNITS = ("deg", "deg_s", "km_h", "m_s2", "nm")  # of files whose unit is unclear
# Words of status, quality and calibration signals, and of signals beside the wanted one.
_NOT = re.compile(
    r"\b(sts|stat|status|valid|vld|qual|qlty|quality|flag|cnt|counter|crc|chk|checksum|err|fault|calib|offset|offs|offst"
    r"|std|dev|var|min|max|req|request|cmd|target|tgt|soll|setpoint|raw|range|mask|bias|sign|vz|bit|lockout|init|type|id|cruise|limit"
    r"|lim|road|eng|engine|motor|shaft|fraction|trailer)\b"
)
_SIGN_WORDS = frozenset(("sign", "vz"))  # VZ: Vorzeichen
_NOT_ANGLE = re.compile(r"\b(rate|speed|spd|vel|geschw\w*|turn|cntr)\b")


@dataclass(frozen=True)
class Proposal:
    """An entry of `[signals]`; `unit` is a key of the signal's units, None where unclear. `others` are the other
    candidates, the best first."""

    signal: str
    named: Named
    unit: str | None
    others: tuple[Proposal, ...] = ()
    sign_by: str | None = None
    plus: str | None = None

    @property
    def remark(self) -> str:
        """The comment in the file, and an assumed unit; empty where there is neither."""
        about = f'"{self.named.comment}". ' if self.named.comment else ""
        given = f"the unit {self.named.unit}" if self.named.unit else "no unit"
        assumed = (
            f"It has {given} there; {self.signal_name().unit} is assumed: check the unit." if not self.unit else ""
        )
        return f"{about}{assumed}".strip()

    def signal_name(self) -> SignalName:
        """The name as readers of logs take it."""
        known = factors(self.signal)
        unit = self.unit or next(unit for unit in _USUAL_UNITS if unit in known)
        return SignalName(self.named.name, unit, sign_by=self.sign_by, plus=self.plus)

    def entry(self) -> dict[str, object]:
        """The entry of a vehicle file."""
        name = self.signal_name()
        return {"name": name.name, "unit": name.unit, "sign": name.sign, **parts_of(name)}


def proposals(there: Sequence[Named]) -> list[Proposal]:
    """At most one proposal for each signal: the most specific name whose unit fits, of equal ones the first; the next
    names that fit are its `others`."""
    beside: dict[tuple[str, str], list[Named]] = {}  # by message and file
    for each in there:
        beside.setdefault(_place(each), []).append(each)
    words = [(each, _words_of(each.name.rpartition(".")[2])) for each in there]
    found = []
    for signal in _PATTERNS:
        ranked = [(rank, each) for each, its in words if (rank := _rank(signal, each, its)) is not None]
        if ranked:
            in_order = [each for _, each in sorted(ranked, key=lambda pair: pair[0])[: 1 + _OTHERS_MAX]]
            best, *others = (_proposal(signal, each, beside[_place(each)]) for each in in_order)
            found.append(replace(best, others=tuple(others)))
    return found


def _place(named: Named) -> tuple[str, str]:
    return named.name.rpartition(".")[0], named.file


def _proposal(signal: str, named: Named, beside: Sequence[Named]) -> Proposal:
    """With the sign of a magnitude and the fraction of a coarse value, where the same message has them."""
    words = set(_words_of(named.name.rpartition(".")[2]).split())
    sign_by = plus = None
    for other in beside[:_BESIDE_MAX]:
        its_words = set(_words_of(other.name.rpartition(".")[2]).split())
        if its_words & _SIGN_WORDS and its_words - _SIGN_WORDS == words:
            sign_by = other.name
        if "fraction" in its_words and its_words - {"fraction"} <= words:
            plus = other.name
    return Proposal(signal, named, _unit(signal, named), sign_by=sign_by, plus=plus)


def _rank(signal: str, named: Named, words: str) -> tuple[int, bool] | None:
    """The less the better; None where the name or the unit is of something else. `words` are those of its name."""
    if _NOT.search(words) or (signal == "steering_wheel_angle" and _NOT_ANGLE.search(words)):
        return None
    unit = _unit(signal, named)
    if unit is None and named.unit and is_unit(named.unit):
        return None
    patterns = _PATTERNS[signal]
    rank = next((k for k, pattern in enumerate(patterns) if re.search(pattern, words)), None)
    if rank is None and signal == "steering_wheel_angle":  # STEERING.WheelAngle
        whole = _words_of(named.name.replace(".", "_"))
        rank = len(patterns) if any(re.search(pattern, whole) for pattern in patterns) else None
    return None if rank is None else (rank, unit is None)


def _unit(signal: str, named: Named) -> str | None:
    """A key of the signal's units: of the file's unit, else of the end of the name."""
    known = factors(signal)
    if named.unit:
        return unit_key(named.unit, known)
    return unit_by_suffix(named.name, known) or unit_key(named.name.rpartition("_")[2], known)


def _words_of(name: str) -> str:
    """`SteeringWheelAngle_deg` as "steering wheel angle deg"."""
    apart = re.sub(r"([a-zäöü0-9])([A-ZÄÖÜ])", r"\1 \2", name[:_NAME_MAX])
    apart = re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1 \2", apart)
    return " ".join(re.findall(r"[a-zäöüß]+", apart.lower()))
