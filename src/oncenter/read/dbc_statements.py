"""A DBC statement by statement. A statement that cannot be read leaves out only the part that it describes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from oncenter.read.database_parts import BITS_MAX, NotRead, Outline, Selection

_RANGES_MAX = 1 << 20  # multiplexer values of a whole file
_PAGES_MAX = 5_000_000  # multiplexer values times signals of a message: cantools looks at each pair
_NAME_MAX = 60  # characters that are quoted

_ = r"(?:\s|//[^\n]*+(?:\n|\Z))*+"  # blanks and comments
_TEXT = r'"(?:\\"|[^"])*+"'
_WORD = r'([^\s:;,"]++)'
_NUMBER = r"([-+]?(?:\d{1,400}(?:\.\d{0,400})?|\.\d{1,400})(?:[eE][-+]?\d{1,3})?)(?![\w.])"
_SIGNAL = rf'(?P<id>\d{{1,10}}){_}(?P<name>[^\s:;,"]++){_}'
_PAGES = r"\d{1,9}-\d{1,9}"
_OF_SIGNAL = rf'"(?:SPN|SystemSignalLongSymbol)"{_}SG_'
_OF_MESSAGE = rf'"SystemMessageLongSymbol"{_}BO_'
_REST = rf'(?:[^";\n]|{_TEXT})*+;?'

# By keyword, the form of a statement; statements that oncenter does not use have the last.
_FORMS = {
    "BO_": rf"(\d{{1,10}}){_}{_WORD}{_}:{_}(\d{{1,9}})(?!\w)",
    "SG_": rf"{_WORD}{_}(?:(M|m\d{{1,9}}M?){_})?:{_}(-?\d{{1,10}}){_}\|{_}(\d{{1,10}}){_}@{_}([01]){_}([-+]){_}"
    rf'\({_}{_NUMBER}{_},{_}{_NUMBER}{_}\)(?:{_}\[([^\]|\n]*)\|([^\]|\n]*)\])?(?:{_}("[^"\n]*"))?',
    "VAL_": rf"{_SIGNAL}(?:[-+]?\d{{1,20}}{_}{_TEXT}{_})*+;|(?!\d){_REST}",
    "SIG_VALTYPE_": rf"{_SIGNAL}:{_}[0-3]{_};",
    "SG_MUL_VAL_": rf"{_SIGNAL}\w++{_}{_PAGES}(?:{_},{_}{_PAGES})*+{_};",
    "CM_": rf"SG_{_}{_SIGNAL}{_TEXT}{_};|(?:(?:BO_|BU_|EV_){_}\w++{_})?{_TEXT}{_};",
    "BA_": rf"{_OF_SIGNAL}{_}{_SIGNAL}(?:\d{{1,6}}|{_TEXT}){_};|{_OF_MESSAGE}{_}(?P<of>\d{{1,10}}){_}{_TEXT}{_};"
    rf"|(?!{_OF_SIGNAL}|{_OF_MESSAGE}){_REST}",
    "NS_": r":(?:\s*[A-Z_]++[ \t]*(?=\n))*+",
    **dict.fromkeys(
        "VERSION BS_ BU_ VAL_TABLE_ EV_ ENVVAR_DATA_ BO_TX_BU_ SIG_GROUP_ SGTYPE_ SGTYPE_VAL_ SIG_TYPE_REF_ FILTER "
        "BA_DEF_ BA_DEF_DEF_ BA_DEF_REL_ BA_DEF_DEF_REL_ BA_REL_ BA_DEF_SGTYPE_ BA_SGTYPE_ SIGTYPE_VALTYPE_ CAT_ "
        "CAT_DEF_".split(),
        _REST,
    ),
}
_COMPILED = {keyword: re.compile(f"{_}(?:{form})") for keyword, form in _FORMS.items()}
_KEYWORD = rf'({"|".join(_FORMS)})(?=[\s:"])'
_NEXT = re.compile(rf"(?:^|(?<=[\s;])){_KEYWORD}", re.MULTILINE)
_NEXT_LINE = re.compile(rf"^[ \t]*{_KEYWORD}", re.MULTILINE)  # after a statement that cannot be read
_ABOUT_SIGNAL = re.compile(rf"{_}(?:{_TEXT}{_})?(?:SG_{_})?{_SIGNAL}")  # the beginning of a broken statement

_PLAIN_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_PLAIN_NUMBER = re.compile(r"[-+]?\d{1,15}(?:\.\d{0,15})?(?:[eE][-+]?\d{1,3})?", re.ASCII)
_HEAD = (
    'VERSION ""\nBA_DEF_ SG_ "SPN" INT 0 524287;\nBA_DEF_ SG_ "SystemSignalLongSymbol" STRING;\n'
    'BA_DEF_ BO_ "SystemMessageLongSymbol" STRING;\n'
)
_DECODED_BY = ("SIG_VALTYPE_", "SG_MUL_VAL_")  # without its own, a signal would be decoded to other values
_DIGITS_MAX = 1000
_NO_UNIT = '""'
_STANDARD_MAX, _EXTENDED_MAX, _IS_EXTENDED = 0x7FF, 0x1FFFFFFF, 1 << 31
_INDEPENDENT = "VECTOR__INDEPENDENT_SIG_MSG"  # signals of no message


class _Statement(NamedTuple):
    keyword: str
    start: int  # behind the keyword
    line: int
    match: re.Match[str] | None


@dataclass
class _Signal:
    name: str
    word: str  # its name for cantools
    line: str
    is_on_page: bool = False
    is_broken: bool = False
    about: list[str] = field(default_factory=list)  # statements


@dataclass
class _Message:
    identifier: int
    name: str
    line: str
    broken: str = ""  # why it cannot be read
    signals: list[_Signal] = field(default_factory=list)
    about: list[str] = field(default_factory=list)
    pages: int = 0  # of its multiplexers, at most


def outline_of_dbc(text: str) -> Outline:
    """The statements that oncenter uses, by message and signal."""
    not_read: list[NotRead] = []
    messages: list[_Message] = []
    about = []
    for each in _statements(text):
        if each.keyword == "BO_":
            messages.append(_message(text, each, len(messages)))
        elif each.keyword == "SG_":
            not_read += _add_signal(text, each, messages)
        elif each.keyword != "NS_":
            about.append(each)
    not_read += [_of_message(each, each.broken) for each in messages if each.broken]
    described = [each for each in messages if not each.broken and each.name != _INDEPENDENT]
    not_read += _add_statements(text, about, described)
    read = [each for each in described if each.pages * len(each.signals) <= _PAGES_MAX]
    not_read += [
        _of_message(each, "its multiplexers have too many values")
        for each in described
        if each.pages * len(each.signals) > _PAGES_MAX
    ]

    def written(selection: Selection) -> str:
        lines = [_HEAD]
        for place, signals in selection.items():
            lines += [read[place].line, *(read[place].signals[each].line for each in signals)]
        for place, signals in selection.items():
            lines += [*read[place].about, *(each for k in signals for each in read[place].signals[k].about)]
        return "\n".join(lines) + "\n"

    return Outline(
        [(each.name, [signal.name for signal in each.signals]) for each in read],
        written,
        not_read,
        frozenset(f"{each.name}.{signal.name}" for each in read for signal in each.signals if signal.is_on_page),
    )


def _statements(text: str) -> Iterator[_Statement]:
    position, search = 0, _NEXT_LINE
    line, counted = 1, 0
    while (begin := search.search(text, position)) is not None:
        keyword, start = begin[1], begin.end()
        line, counted = line + text.count("\n", counted, start), start
        match = _COMPILED[keyword].match(text, start)
        if _FORMS[keyword] is not _REST:
            yield _Statement(keyword, start, line, match)
        position, search = (start, _NEXT_LINE) if match is None else (match.end(), _NEXT)


def _message(text: str, given: _Statement, number: int) -> _Message:
    match = given.match
    if match is None or 8 * int(match[3]) > BITS_MAX:
        words = _line_from(text, given.start).partition(":")[0].split()
        why = f"line {given.line}" + ("" if match is None else f": it has more than {BITS_MAX} bits")
        return _Message(0, words[-1] if words else "a message", "", why)
    identifier, name, length = _identifier(match[1]), match[2], int(match[3])
    word = _word(name, number)
    named = [] if word == name else [f'BA_ "SystemMessageLongSymbol" BO_ {identifier} "{name}";']
    return _Message(identifier, name, f"BO_ {identifier} {word}: {length} X", about=named)


def _add_signal(text: str, given: _Statement, messages: list[_Message]) -> Iterator[NotRead]:
    message = messages[-1] if messages else _Message(0, "", "", "no message")
    match = given.match
    words = _line_from(text, given.start).partition(":")[0].split()
    name = match[1] if match is not None else words[0] if words else "a signal"
    read = None if match is None else _signal(match, len(message.signals))
    if isinstance(read, _Signal):
        if read.word != name:
            read.about.append(f'BA_ "SystemSignalLongSymbol" SG_ {message.identifier} {read.word} "{name}";')
        message.signals.append(read)
        message.pages += read.is_on_page
        return
    if message.broken:
        message.signals.append(_Signal(name, "", ""))
        return
    yield _of_signal(message, name, f"line {given.line}" + (f": {read}" if read else ""))


def _signal(match: re.Match[str], number: int) -> _Signal | str:
    """A signal as cantools takes it; the reason where it cannot."""
    name, page, start, length, order, sign, scale, offset, low, high, unit = match.groups()
    if max(abs(int(start)), int(length)) > BITS_MAX:
        return f"it has more than {BITS_MAX} bits"
    conversion = [_number(scale), _number(offset)]
    if None in conversion:
        return "its factor or offset is too large"
    limits = [_number(low), _number(high)]
    limits = ["0", "0"] if None in limits else limits  # a range without numbers is a placeholder
    word = _word(name, number)
    line = (
        f" SG_ {word} {page or ''} : {start}|{length}@{order}{sign} ({','.join(map(str, conversion))}) "
        f"[{'|'.join(map(str, limits))}] {unit or _NO_UNIT} X"
    )
    return _Signal(name, word, line, (page or "").startswith("m"))


def _word(name: str, number: int) -> str:
    """A name that cantools accepts: in a DBC a name does not begin with a digit, and is not a keyword."""
    return name if _PLAIN_WORD.fullmatch(name) and name not in _FORMS else f"oc_{number}_"


def _number(written: str | None) -> str | None:
    """A number of few digits; None where it is no finite number."""
    text = (written or "").strip()
    if _PLAIN_NUMBER.fullmatch(text):
        return text if math.isfinite(float(text)) else None
    try:
        value = float(text) if len(text) < _DIGITS_MAX else math.inf
    except ValueError:
        return None
    return repr(value) if math.isfinite(value) else None


def _line_from(text: str, start: int) -> str:
    return text[start : start + _NAME_MAX].partition("\n")[0]


def _of_signal(message: _Message, name: str, why: str) -> NotRead:
    whole = f"{message.name}.{name}" if message.name else name
    return NotRead(whole, why, (whole,))


def _of_message(message: _Message, why: str) -> NotRead:
    return NotRead(message.name, why, tuple(f"{message.name}.{signal.name}" for signal in message.signals))


def _add_statements(text: str, given: list[_Statement], messages: list[_Message]) -> Iterator[NotRead]:
    """Gives each statement to its signal or message. One about none of the file is left over, and has no effect."""
    by_identifier: dict[int, list[_Message]] = {}
    by_name: dict[tuple[int, str], list[tuple[_Message, _Signal]]] = {}
    for message in messages:
        by_identifier.setdefault(message.identifier, []).append(message)
        for signal in message.signals:
            by_name.setdefault((message.identifier, signal.name), []).append((message, signal))
    values = _RANGES_MAX
    for each in given:
        match = each.match
        if each.keyword == "SG_MUL_VAL_" and match is not None:
            own = sum(max(0, int(high) - int(low)) for low, high in re.findall(r"(\d+)-(\d+)", match[0]))
            values -= own
            for message in by_identifier.get(_identifier(match["id"]), ()):
                message.pages += own
            match = match if values >= 0 else None
        if match is None:
            yield NotRead(each.keyword, f"line {each.line}")
        beginning = match or _ABOUT_SIGNAL.match(text, each.start)
        about = {} if beginning is None else beginning.groupdict()
        if match is not None and about.get("of"):
            for message in by_identifier.get(_identifier(about["of"]), ()):
                before, after = text[each.start : match.start("of")], text[match.end("of") : match.end()]
                message.about.append(f"{each.keyword}{before}{message.identifier}{after}")
        if not about.get("id"):
            continue
        for message, signal in by_name.get((_identifier(about["id"]), about["name"]), ()):
            if match is not None:
                before, after = text[each.start : match.start("id")], text[match.end("name") : match.end()]
                signal.about.append(f"{each.keyword}{before}{message.identifier} {signal.word}{after}")
            elif each.keyword in _DECODED_BY and not signal.is_broken:
                signal.is_broken = True
                yield _of_signal(message, signal.name, f"{each.keyword} in line {each.line}")
    for message in messages:
        message.signals = [signal for signal in message.signals if not signal.is_broken]


def _identifier(written: str) -> int:
    """With bit 31, which marks 29 bits, where a number needs more than 11 and lacks it."""
    number = int(written)
    return number | _IS_EXTENDED if _STANDARD_MAX < number <= _EXTENDED_MAX else number
