"""Entries of a `[signals]` table, proposed from the names and units of a database's signals or a table's columns."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from oncenter.read.units import factors, unit_by_suffix, unit_key
from oncenter.signals import SIGNALS, SignalName

_PROPOSED = (
    "steering_wheel_angle",
    "yaw_rate",
    "vehicle_speed",
    "lateral_acceleration",
    "longitudinal_acceleration",
    "wheel_speed_front_left",
    "wheel_speed_front_right",
    "wheel_speed_rear_left",
    "wheel_speed_rear_right",
    "steering_wheel_torque",
)
_SCORE_MIN = 2.0  # a name of two words that fit, or one word that is enough by itself

_LATERAL = r"lat|lateral|quer|transv|transverse"
_ALONG = r"long|longitudinal|laengs|längs|lng|lgt"
_ACCELERATION = r"acc|accel|acceleration|beschl|beschleunigung"
_STEERING = r"str|steer|steering|st|lenk|lenkrad|swa|sas|lrw|lws|stwhl|steeringwheel"
_WHEEL = r"whl|wheel|rad|ws|wheelspeed"
_SPEED = r"spd|speed|vel|velocity|geschw|geschwindigkeit|v"
_FRONT, _REAR, _LEFT, _RIGHT = r"front|frnt|fr|f|v|vorn", r"rear|re|r|h|hint|hinten", r"left|le|l|lh|li", r"right|ri|r|rh|re"

# By signal: groups of words. A name scores 1 for each group of which it has a word, 2 for a word of the last group.
_WORDS: Mapping[str, tuple[tuple[str, ...], str]] = {
    "steering_wheel_angle": ((_STEERING, r"ang|angle|winkel|whlang"), r"swa|lrw|lws|lenkradwinkel|steeringwheelangle|steerang|steerangle"),
    "yaw_rate": ((r"yaw|gier|yawr", r"rate|rt|vel|velocity|geschw|v"), r"yawrate|yawrt|yaw_rate|gierrate|psip|psidot|gieren"),
    "vehicle_speed": ((r"veh|vehicle|fzg|fahrzeug|car|truck|ego", _SPEED), r"vehspd|vehspeed|vehiclespeed|vehv|vx|vego|tachograph|wheelbasedvehiclespeed|groundspeed"),
    "lateral_acceleration": ((_LATERAL, _ACCELERATION), r"ay|latacc|lataccel|querbeschl|querbeschleunigung|lateralacceleration"),
    "longitudinal_acceleration": ((_ALONG, _ACCELERATION), r"ax|longacc|lonacc|laengsbeschl|longitudinalacceleration"),
    "wheel_speed_front_left": ((_WHEEL, _SPEED, _FRONT, _LEFT), r"fl|vl|frontleft|lf"),
    "wheel_speed_front_right": ((_WHEEL, _SPEED, _FRONT, _RIGHT), r"frontright|vr|rf"),
    "wheel_speed_rear_left": ((_WHEEL, _SPEED, _REAR, _LEFT), r"rl|hl|rearleft|lr"),
    "wheel_speed_rear_right": ((_WHEEL, _SPEED, _REAR, _RIGHT), r"rr|hr|rearright"),
    "steering_wheel_torque": ((_STEERING, r"trq|torque|tq|moment"), r"steeringtorque|steertorque|lenkmoment|handmoment"),
}
# Words of status, quality and calibration signals, and of signals beside the wanted one.
_NOT = re.compile(
    r"(?<![a-z])(sts|stat|status|valid|vld|qual|qlty|quality|flag|cnt|counter|crc|chk|checksum|err|fault|calib|offset|offs"
    r"|offst|std|dev|var|min|max|req|request|cmd|target|tgt|soll|raw|range|mask|bias|sign|vz|init|type|id|cruise|limit|lim"
    r"|road|engine|motor|shaft)(?![a-z])"
)
_NOT_FOR = {"steering_wheel_angle": re.compile(r"(?<![a-z])(rate|speed|spd|vel|geschw|turn|cntr)(?![a-z])")}


@dataclass(frozen=True)
class Named:
    """A signal of a database, or a column of a table, as its file names it."""

    name: str  # "ESP.YawRate", or the column
    unit: str  # as written in the file; empty where it has none
    comment: str = ""


@dataclass(frozen=True)
class Proposal:
    """An entry of `[signals]` and the reason for it; `unit` is a key of the signal's units, None where unclear."""

    signal: str
    named: Named
    unit: str | None

    @property
    def reason(self) -> str:
        """For people: the source of the proposal, and the checks that are left to them."""
        unit = f"its unit there is {self.named.unit}" if self.named.unit else "it has no unit there"
        about = f' ("{self.named.comment}")' if self.named.comment else ""
        check = "check that left is positive" if self.signal not in _WITHOUT_SIDE else "check the unit"
        return f"Proposed, {unit}{about}: {check}, then delete the #."

    def entry(self) -> dict[str, object]:
        """As a vehicle file holds it."""
        unit = self.unit or next(iter(factors(self.signal)))
        return {"name": self.named.name, "unit": unit, "sign": 1}

    def signal_name(self) -> SignalName:
        """As readers of logs take it."""
        return SignalName(self.named.name, self.unit or next(iter(factors(self.signal))))


_WITHOUT_SIDE = ("vehicle_speed", *(name for name in _PROPOSED if name.startswith("wheel_speed_")))


def proposals(there: Iterable[Named]) -> list[Proposal]:
    """At most one proposal for each signal: the best name whose unit fits. Of equal names the first one wins."""
    candidates = list(there)
    found = []
    for signal in _PROPOSED:
        scored = [(_score(signal, each), each) for each in candidates]
        best = max(scored, key=lambda pair: pair[0], default=None)
        if best is not None and best[0] >= _SCORE_MIN:
            known = factors(signal)
            written = best[1].unit
            unit = unit_key(written, known) if written else unit_by_suffix(best[1].name, known)
            found.append(Proposal(signal, best[1], unit))
    return found


def signals_of_database(path: Path) -> Iterator[Named]:
    """All signals of a CAN database.

    Raises:
        OncenterError: as `oncenter.read.database_file.messages_of`.
    """
    from oncenter.read.database_file import messages_of

    for message in messages_of(path):
        for layout in message.signals:
            comment = " ".join((layout.comment or "").split())[:80]
            yield Named(f"{message.name}.{layout.name}", layout.unit or "", comment)


def _score(signal: str, named: Named) -> float:
    """0 where the name or the unit is of something else."""
    known = factors(signal)
    words = _words_of(named.name.rpartition(".")[2])
    plain = " ".join(words)
    if _NOT.search(plain) or (signal in _NOT_FOR and _NOT_FOR[signal].search(plain)):
        return 0.0
    unit = unit_key(named.unit, known) if named.unit else unit_by_suffix(named.name, known)
    if named.unit and unit is None:
        return 0.0
    groups, enough = _WORDS[signal]
    whole = [*words, "".join(words)]
    score = sum(any(re.fullmatch(group, word) for word in words) for group in groups)
    is_enough = any(re.fullmatch(enough, word) for word in whole) or _starts_with(enough, "".join(words))
    if len(groups) > 2:  # a wheel: its corner is needed, and that it is a speed of a wheel
        corner = is_enough or score >= len(groups)
        return 2.0 + 0.1 * score if corner and unit is not None and score >= 1 else 0.0
    if not is_enough and score < len(groups):
        return 0.0
    return (2.0 if is_enough else 0.0) + score + (0.5 if unit is not None else 0.0)


def _starts_with(enough: str, joined: str) -> bool:
    return any(len(word) > 3 and joined.startswith(word) for word in enough.split("|"))


def _words_of(name: str) -> list[str]:
    """`SteeringWheelAngle_deg` as steering, wheel, angle, deg."""
    apart = re.sub(r"([a-zäöü0-9])([A-ZÄÖÜ])", r"\1 \2", name)
    apart = re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1 \2", apart)
    return re.findall(r"[a-zäöüß]+", apart.lower())


assert set(_WORDS) == set(_PROPOSED) <= set(SIGNALS)
