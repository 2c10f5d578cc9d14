"""Entries of a `[signals]` table, proposed from names, units and ranges of a database's signals or a log's columns."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from oncenter.read.named import Named
from oncenter.read.parts import parts_of
from oncenter.read.units import TIME, factors, is_unit, unit_by_suffix, unit_key
from oncenter.signals import DEGREE, SignalName

_WHEEL = r"(?=.*(wheel|whl|rad))"
_SPEED = r"(?=.*(spd|speed|vel|geschw|\bw\b))"
_ACCELERATION = r"(acc|beschl)"
_NO_SIDE = r"(?! (l|le|left|li|links|r|ri|right|re|rechts)\b)"


class _Kind(NamedTuple):
    """A quantity: its names, the most specific first, for words in lower case between blanks; and its values."""

    patterns: tuple[str, ...]
    sensors: str  # words of messages of its sensor
    reach: float  # SI; the range of its signals reaches at least so far
    is_signed: bool
    without_unit: tuple[tuple[str, float], ...]  # the unit of a signal without one, by how far its range reaches


_KINDS: Mapping[str, _Kind] = {
    "steering_wheel_angle": _Kind(
        (
            r"\b(st|str|strg|steer\w*|lenk\w*|sas|eps|hand) ?(wheel|whl|rad|w|wh)? ?(ang\w*|winkel\w*)\b"
            r"|\blenk(rad)?winkel|\bste (whl|pin)\w*( \w+)? an\b|\bangle volant\b",
            r"\b(swa|lrw|lws|lw|sas)\b|\b(st|str|strg|steer\w*) ?(wheel|whl)? ?pos(ition)?\b",
        ),
        r"\b(sas|lws|lwi|sccm|lenkwinkel|steer\w*|stw|str) ?(wheel |whl )?(sens\w*|ang\w*)?\b",
        90 * DEGREE,
        True,
        (("rad", 40.0), ("deg", 1e9)),
    ),
    "yaw_rate": _Kind(
        (r"\b(yaw|gier) ?(rate|rt|vel|geschw\w*|w)\b|\bpsi ?(p|dot)\b", r"\b(yaw|gier)\b", r"\bgyro( z)?\b"),
        r"\b(esp|esc|imu|vdc|vsc|abs|yaw|kinematics|bremse|brake|dynamic\w*)",
        10 * DEGREE,
        True,
        (("rad_s", 10.0), ("deg_s", 1e9)),
    ),
    "vehicle_speed": _Kind(
        (
            r"\b(veh|vehicle|fzg|fahrzeug|ego|car|truck|wheel based vehicle) ?(spd|speed|vel|velocity|geschw\w*|v)\b",
            r"\b(ground|tachograph|gps|gnss) ?(vehicle )?(spd|speed)\b",
            r"\b(spd|speed|velocity|geschw\w*|vx|v)\b",
        ),
        r"\b(speed|spd|esp|esc|abs|bremse|brake|wheel|ccvs|tco)",
        15.0,
        False,
        (("km_h", 1e9),),
    ),
    "lateral_acceleration": _Kind(
        (rf"\b(lat|lateral|quer|transv)\w* ?{_ACCELERATION}|\blat( comp)? a\b", rf"\bay\b|\b{_ACCELERATION}\w* y\b"),
        r"\b(esp|esc|imu|vdc|vsc|kinematics|bremse|brake|dynamic\w*|accel\w*)",
        2.0,
        True,
        (("g", 3.0), ("m_s2", 1e9)),
    ),
    "longitudinal_acceleration": _Kind(
        (rf"\b(long|lon|lng|längs|laengs)\w* ?{_ACCELERATION}|\blong( comp)? a\b", rf"\bax\b|\b{_ACCELERATION}\w* x\b"),
        r"\b(esp|esc|imu|vdc|vsc|kinematics|bremse|brake|dynamic\w*|accel\w*)",
        2.0,
        True,
        (("g", 3.0), ("m_s2", 1e9)),
    ),
    **{
        f"wheel_speed_{place}": _Kind(
            (rf"^{_WHEEL}{_SPEED}.*\b({words})\b",), r"\b(wheel|whl|abs|esp|bremse|rad)", 15.0, False, (("km_h", 1e9),)
        )
        for place, words in {
            "front_left": rf"(fl|vl|lf){_NO_SIDE}|(f|fr|front|frnt|vorn\w*) (l|le|left|li\w*)",
            "front_right": rf"(fr|vr|rf){_NO_SIDE}|(f|fr|front|frnt|vorn\w*) (r|ri|right|re|rechts)",
            "rear_left": rf"(rl|hl|lr){_NO_SIDE}|(r|re|rear|hint\w*) (l|le|left|li\w*)",
            "rear_right": rf"(rr|hr){_NO_SIDE}|(r|re|rear|hint\w*) (r|ri|right|re|rechts)",
        }.items()
    },
    "steering_wheel_torque": _Kind(
        (r"\b(st|str|steer\w*|lenk\w*|hand|driver)\w* ?(wheel )?(trq|tq|torque|moment)|\blenkmoment\b",),
        r"\b(eps|mdps|pscm|lenkhilfe|steer\w*)",
        1.0,
        True,
        (("nm", 1e9),),
    ),
}  # fmt: skip
PROPOSED = tuple(_KINDS)  # the signals that have proposals

_NAME_MAX = 100  # characters that are looked at
_OTHERS_MAX = 20  # further candidates of a signal
_BESIDE_MAX = 1000  # names of a message, or columns of a table
_BITS_MIN = 8  # a shorter one is a flag, a counter or a coarse display
_CODES_MAX = 4  # values with names, of a byte that is no list of states


def _words(each: str) -> re.Pattern[str]:
    return re.compile(rf"\b({'|'.join(each.split())})\b")


# Words of status, quality and calibration signals, of requests, of signals beside the wanted one, of other vehicles.
_NOT = _words(
    r"""sts sta stat state status valid\w* vld qual\w* qlty qf flag cnt count\w* cntr crc chk chks\w* check\w* err error
    fault flt fail\w* fehler calib\w* kalib\w* cal offset offs offst std dev deviation var variance min max rq req
    reqd request\w* cmd command\w* target trgt tgt soll set setpoint desired wanted wunsch demand raw range mask
    bias sign vz vorzeichen bit lockout init\w* type id identifier cruise limit\w* lim lmt road eng engine motor shaft
    fraction trailer trlr trl tow towed anh anhaenger anhänger reserved reserve rsvd rsv unused frei dir direction
    pul\w* rotation obj\w* object trk track lead rel relative wiper\w* fan pump turbine idle gear input output units?
    diag\w* plsblity plausib\w* msalgn misalign\w* gradient group source quelle signalquelle avail\w* ub mode
    active enable\w* warn\w*
    wrn alert lamp led anzeige\w* ueberw timer\w* accuracy tolerance confidence redundan\w* reset version vert vertical
    lane line curv\w* path radius zoom interval lkas lka assist correction compensation gain overlay hold latch lock dac
    volt\w* temp\w* current alv rc cs no"""
)
_NOT_IN = _words(
    r"""request\w* req rq cmd command\w* target obj\w* object track trk trailer trlr calib\w* kalib\w* cal verbauliste
    init lkas lka lta lfa ipas"""
)  # of a message
# Words of signals and messages that are used only where there is no other.
_LESS = _words(
    r"""est estimated comp compensated servo model\w* calc calculated lowres lres low res dsply display\w* digital
    cluster hud avg average angezeigte park pa tpa unknown gps gnss left right pinion ritzel predicted pv"""
)
_LESS_IN = _words(
    r"""adas camera cam cmr radar park\w* hud cluster kombi clu nav\w* display audio secondary rate unknown related
    blink break imprecise lres control"""
)
_SIGN_WORDS = frozenset(("sign", "vz", "vorzeichen", "direction", "dir", "richtung", "sgn", "drctn"))
_QUANTITY = re.compile(r"ang|winkel|rate|geschw|acc|beschl|speed|spd|val|tor?q|trq|moment")  # not in the name of a sign
_FRACTION_WORDS = frozenset(("fraction", "frac", "fine", "hp", "precision", "lsb", "remainder", "nachkomma"))
_NOT_OF = {  # words of another quantity
    "steering_wheel_angle": re.compile(
        r"\b(rate|speed|spd|vel\w*|geschw\w*|turn|acc\w*|tr?q|torque|moment|yaw|slip|roll|pitch)\b"
    ),
    "yaw_rate": re.compile(r"\b(acc\w*|angle|ang|moment|torque)\b"),
}
_NOT_SPEED = re.compile(r"wheel|whl|rad|\b(acc|sas|steer\w*|lenk\w*|yaw|angle)\b")  # beside a general word for speed
_OTHER_UNIT = re.compile(
    r"m?v|m?a|rpm|1/min|min-1|u/min|%|percent|[°º]?[cf]|deg ?[cf]|k|bar|[km]?pa|psi|m?l|kg|t|k?n|k?w|k?hz|[cmk]?m|bits?"
    r"|counts?|pulses?|ohm|db|years?|months?|deg/s[2²]|deg/s\^2|1/m",
    re.IGNORECASE,
)
_BY_COMMENT = 3  # rank of a name that says nothing, with a comment that does
_IN_BRACKETS = re.compile(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*$")
_RIGHT_POSITIVE = re.compile(
    r"\b(right|clockwise|rechts)\b[^.;,]{0,20}\b(positi\w*|\+)"
    r"|\b(positi\w*|\+)[^.;,a-z]{0,4}(is |to the |to |= ?)?(right|clockwise|rechts)\b"
)


@dataclass(frozen=True)
class Proposal:
    """An entry of `[signals]`.

    Attributes:
        unit: a key of the signal's units, None where unclear.
        others: the other candidates, the best first.
        rank: 1 for the best candidate of its signal.
        reasons: why it is a candidate, as short phrases.
        assumed: the unit that is used where `unit` is None.
    """

    signal: str
    named: Named
    unit: str | None
    others: tuple[Proposal, ...] = ()
    sign_by: str | None = None
    plus: str | None = None
    sign: int = 1
    rank: int = 1
    reasons: tuple[str, ...] = ()
    assumed: str = ""

    @property
    def remark(self) -> str:
        """Its reasons, the comment in the file, and an assumed unit; empty where there is none."""
        why = f"{self.rank}. {', '.join(self.reasons)}. " if self.reasons else ""
        about = f'"{self.named.comment}". ' if self.named.comment else ""
        given = f"the unit {self.named.unit}" if self.named.unit else "no unit"
        assumed = (
            f"It has {given} there; {self.signal_name().unit} is assumed: check the unit." if not self.unit else ""
        )
        return f"{why}{about}{assumed}".strip()

    def signal_name(self) -> SignalName:
        """The name as readers of logs take it."""
        return SignalName(self.named.name, self.unit or self.assumed, self.sign, sign_by=self.sign_by, plus=self.plus)

    def entry(self) -> dict[str, object]:
        """The entry of a vehicle file."""
        name = self.signal_name()
        return {"name": name.name, "unit": name.unit, "sign": name.sign, **parts_of(name)}


@dataclass
class _Candidate:
    points: float  # the less the better
    proposal: Proposal


def proposals(there: Sequence[Named]) -> list[Proposal]:
    """At most one proposal for each signal, the best by name, unit, range and message; the next ones are its
    `others`."""
    beside: dict[tuple[str, str], list[Named]] = {}  # by message and file
    for each in there:
        beside.setdefault(_place(each), []).append(each)
    found = []
    words = [(each, _words_of(each.name.rpartition(".")[2])) for each in there]
    for signal, kind in _KINDS.items():
        ranked = [
            candidate
            for each, its in words
            if (candidate := _candidate(signal, kind, each, its, beside[_place(each)])) is not None
        ]
        in_order = sorted(ranked, key=lambda candidate: candidate.points)[: 1 + _OTHERS_MAX]
        if in_order:
            best, *others = (replace(each.proposal, rank=rank) for rank, each in enumerate(in_order, 1))
            found.append(replace(best, others=tuple(others)))
    return found


NAMELESS = 1000  # rank of a candidate whose name says nothing
_NAMELESS_BITS_MIN = 10
_TIME = re.compile(r"(time|timestamp|zeit|zeitstempel|t|temps|tiempo|tid|czas|uhrzeit)\b")
_RECOGNISED_TIME = tuple(f"time_{unit}" for unit in TIME.factors)


def nameless(signal: str, there: Sequence[Named]) -> list[Proposal]:
    """Signals of databases whose names do not contradict: only a log can show that one of them is this signal."""
    kind = _KINDS[signal]
    beside: dict[tuple[str, str], list[Named]] = {}
    for each in there:
        beside.setdefault(_place(each), []).append(each)
    found = []
    for each in there:
        words = _words_of(each.name.rpartition(".")[2])
        unit = _unit(signal, each)
        if each.bits < _NAMELESS_BITS_MIN or (each.unit and unit is None) or _NOT.search(words):
            continue
        proposal = Proposal(signal, each, unit, assumed=_assumed(kind, each), rank=NAMELESS)
        proposal = _with_parts(proposal, words, beside[_place(each)])
        low, high = _reach(proposal, each)
        if low < 0.0 < high and max(-low, high) * factors(signal)[unit or proposal.assumed] >= kind.reach:
            found.append(proposal)
    return found


def chosen(signal: str, named: Named, there: Sequence[Named]) -> Proposal:
    """A signal that a person chose for one of `PROPOSED`, with its other parts in the same message."""
    beside = [each for each in there if _place(each) == _place(named)]
    proposal = Proposal(signal, named, _unit(signal, named), assumed=_assumed(_KINDS[signal], named))
    proposal = replace(proposal, sign=-1 if _is_right_positive(named) else 1)
    return _with_parts(proposal, _words_of(named.name.rpartition(".")[2]), beside)


def time_proposal(columns: Sequence[Named]) -> Proposal | None:
    """The first column of a table that is named like a time, unless one needs no entry."""
    if any(each.name in _RECOGNISED_TIME for each in columns):
        return None
    named = [each for each in columns if _TIME.match(_words_of(each.name))]
    if not named:
        return None
    units = [_unit_of(TIME.factors, each) for each in named]
    best = min(range(len(named)), key=lambda place: units[place] is None)
    return Proposal("time", named[best], units[best], assumed="s", reasons=("by its name",))


def _place(named: Named) -> tuple[str, str]:
    return named.name.rpartition(".")[0], named.file


def _candidate(signal: str, kind: _Kind, named: Named, words: str, beside: Sequence[Named]) -> _Candidate | None:
    """None where the name, the unit or the range is of something else. `words` are those of its name."""
    message = _words_of(named.name.rpartition(".")[0])
    name_rank = _name_rank(signal, kind, named, words)
    if name_rank is None or _is_state(named) or _NOT_IN.search(message):
        return None
    unit = _unit(signal, named)
    if unit is None and named.unit and (is_unit(named.unit) or _OTHER_UNIT.fullmatch(named.unit.strip())):
        return None
    if (
        signal == "vehicle_speed"
        and name_rank >= _GENERAL_SPEED
        and unit is None
        and not re.search(kind.sensors, _words_of(_place(named)[0]))
    ):
        return None
    known = factors(signal)
    proposal = _with_parts(Proposal(signal, named, unit, assumed=_assumed(kind, named)), words, beside)
    low, high = _reach(proposal, named)
    factor = known[unit or proposal.assumed]
    if max(abs(low), abs(high)) * factor < kind.reach:
        return None
    points, reasons = float(name_rank), ["by its name" if name_rank < _BY_COMMENT else "by its comment"]
    if unit is None:
        points += 1.0
    else:
        reasons.append(f"unit {named.unit or unit}")
    if named.bits and kind.is_signed:
        if low < 0.0 < high:
            reasons.append(f"range {low:.4g} to {high:.4g}")
        else:
            points += 4.0
            reasons.append("but its range has one side only")
    if proposal.sign_by is not None:
        reasons.append("with its sign")
        points -= 0.5
    if proposal.plus is not None:
        reasons.append("with its fraction")
        points -= 0.25
    if message and re.search(kind.sensors, message):
        points -= 1.0
        reasons.append(f"message {_place(named)[0]}")
    points += (
        3.0 * bool(_NOT_IN.search(message)) + 2.0 * bool(_LESS_IN.search(message)) + 1.5 * bool(_LESS.search(words))
    )
    if _is_right_positive(named):
        proposal = replace(proposal, sign=-1)
        reasons.append("right is positive by its comment")
    return _Candidate(points, replace(proposal, reasons=tuple(reasons)))


def _name_rank(signal: str, kind: _Kind, named: Named, words: str) -> int | None:
    """The place of the pattern; None where the name is of something else."""
    not_of = _NOT_OF.get(signal)
    if _NOT.search(words) or (not_of is not None and not_of.search(words)):
        return None
    rank = next((k for k, pattern in enumerate(kind.patterns) if re.search(pattern, words)), None)
    if signal == "vehicle_speed" and rank == _GENERAL_SPEED and (_NOT_SPEED.search(words) or words.count(" ") > 2):
        return None
    if signal == "steering_wheel_angle" and rank == 1 and _unit(signal, named) is None:  # as SAS, of more than an angle
        return None
    if rank is None and signal == "steering_wheel_angle" and re.search(r"\b(ang|angle|winkel)\b", words):
        message = _words_of(named.name.rpartition(".")[0])  # STEERING.WheelAngle
        rank = len(kind.patterns) if re.search(r"\b(steer\w*|stw|sas|lws|lenk\w*|volant)\b", message) else None
    if rank is None and named.bits and _unit(signal, named) is not None:
        comment = _words_of(named.comment)
        says = re.search(kind.patterns[0], comment) and not _NOT.search(comment)
        rank = _BY_COMMENT if says and not (not_of is not None and not_of.search(comment)) else None
    return rank


_GENERAL_SPEED = 2  # the pattern of speed that any speed fits


def _is_state(named: Named) -> bool:
    """Whether it is a flag, a counter or a list of states."""
    return 0 < named.bits < _BITS_MIN or (named.bits == _BITS_MIN and named.codes > _CODES_MAX)


def _is_right_positive(named: Named) -> bool:
    """By its comment."""
    return _RIGHT_POSITIVE.search(named.comment.lower()) is not None


def _reach(proposal: Proposal, named: Named) -> tuple[float, float]:
    """The least and the greatest value that the bits can have."""
    if not named.bits:
        return -math.inf, math.inf
    return (-named.high, named.high) if proposal.sign_by is not None else (named.low, named.high)


def _assumed(kind: _Kind, named: Named) -> str:
    """The unit of a signal whose unit is unclear."""
    reach = max(abs(named.low), abs(named.high)) if named.bits else math.inf
    return next((unit for unit, most in kind.without_unit if reach <= most), kind.without_unit[-1][0])


def _with_parts(proposal: Proposal, words: str, beside: Sequence[Named]) -> Proposal:
    """With the sign of a magnitude and the fraction of a coarse value, where the same message has them."""
    named, own = proposal.named, _plain(words)
    for other in beside[:_BESIDE_MAX]:
        if other is named:
            continue
        its_words = _plain(_words_of(other.name.rpartition(".")[2]))
        is_magnitude = not named.bits or named.low >= 0.0
        rest = its_words - _SIGN_WORDS
        is_its_sign = its_words != rest and rest <= own and all(_QUANTITY.search(word) for word in own - rest)
        if is_magnitude and other.bits <= 1 and is_its_sign:
            proposal = replace(proposal, sign_by=other.name)
        is_fine = not named.bits or (other.step < named.step and max(abs(other.low), abs(other.high)) <= named.step)
        if is_fine and its_words & _FRACTION_WORDS and set() < its_words - _FRACTION_WORDS <= own:
            proposal = replace(proposal, plus=other.name)
    return proposal


def _plain(words: str) -> set[str]:
    """The words of a name, "steering" as "steer"."""
    return {re.sub(r"^st(r|rg|eering)$", "steer", word) for word in words.split()}


def _unit(signal: str, named: Named) -> str | None:
    """A key of the signal's units: of the file's unit, else of brackets at the end of the name, else of its end."""
    return _unit_of(factors(signal), named)


def _unit_of(known: Mapping[str, float], named: Named) -> str | None:
    if named.unit:
        return unit_key(named.unit, dict(known))
    brackets = _IN_BRACKETS.search(named.name)
    if brackets is not None:
        return unit_key(brackets[1], dict(known))
    return unit_by_suffix(named.name, dict(known)) or unit_key(named.name.rpartition("_")[2], dict(known))


def _words_of(name: str) -> str:
    """`SteeringWheelAngle_deg` as "steering wheel angle deg"; without a unit in brackets."""
    apart = re.sub(r"([a-zäöü0-9])([A-ZÄÖÜ])", r"\1 \2", _IN_BRACKETS.sub("", name[:_NAME_MAX]))
    apart = re.sub(r"([A-Z]+)([A-Z][a-z])", r"\1 \2", apart)
    return " ".join(re.findall(r"[a-zäöüß]+", apart.lower()))
