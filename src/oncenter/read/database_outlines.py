"""The messages and signals of KCD, ARXML and SYM as text of any selection of them."""

from __future__ import annotations

import re
from copy import deepcopy
from dataclasses import dataclass
from typing import TYPE_CHECKING

from oncenter.read.database_parts import NotRead, Outline, Selection

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_SYM_SYMBOL = re.compile(r'\s*\[(?:"([^"\n]*)"|([^\]\n]*))\]')
_SYM_GROUP = re.compile(r"\s*\{(\w+)\}")
_SYM_SIGNAL = re.compile(r'\s*(?:Sig|Var)\s*=\s*(?:"([^"\n]*)"|(\S+))')
_SYM_NUMBER = r"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?"
_SYM_FORM = re.compile(  # of a line of {SIGNALS}
    r'\s*Sig\s*=\s*(?:"[^"\n]*"|[^\s=(\]"-]+)\s+\w+(?:\s+\d+)?(?:\s+-[hbm])*'
    rf'(?:\s+/(?:u:(?:"[^"\n]*"|\S+)|(?:f|o|min|max|spn|p):\s*{_SYM_NUMBER}|d:\S+|ln:\s*"[^"\n]*"|e:\s*\w+))*\s*(?://.*)?'
)


def outline_of_kcd(text: str) -> Outline:
    """Messages, with signals and whole multiplexers."""
    return _outline_of_xml(text, "Message", ("Signal", "Multiplex"))


def outline_of_arxml(text: str) -> Outline:
    """Frames; the signals of a frame stand elsewhere, and are not apart."""
    return _outline_of_xml(text, "CAN-FRAME-TRIGGERING", ())


def _outline_of_xml(text: str, message: str, signals: tuple[str, ...]) -> Outline:
    from xml.etree import ElementTree

    root = ElementTree.fromstring(text)

    def written(selection: Selection) -> str:
        part = deepcopy(root)
        for place, (parent, element) in enumerate(_elements(part, (message,))):
            if place not in selection:
                parent.remove(element)
                continue
            for number, (owner, signal) in enumerate(_elements(element, signals)):
                if number not in selection[place]:
                    owner.remove(signal)
        return ElementTree.tostring(part, encoding="unicode")

    return Outline(
        [
            (_name(each), [_name(signal) for _, signal in _elements(each, signals)])
            for _, each in _elements(root, (message,))
        ],
        written,
    )


def _elements(root: Element, tags: tuple[str, ...]) -> list[tuple[Element, Element]]:
    """Parent and element of each element of these tags, without those inside another."""
    found = []
    parents = [root]
    while parents:
        parent = parents.pop()
        for child in parent:
            if child.tag.rpartition("}")[2] in tags:
                found.append((parent, child))
            else:
                parents.append(child)
    return found


def _name(element: Element) -> str:
    named = (each.text for each in element if each.tag.rpartition("}")[2] == "SHORT-NAME")
    return element.get("name") or next(named, None) or element.tag.rpartition("}")[2]


@dataclass(frozen=True)
class _Line:
    """A line of SYM; `place` is that of its symbol, `signal` its own in the symbol, both None elsewhere."""

    text: str
    place: int | None = None
    signal: int | None = None


def outline_of_sym(text: str) -> Outline:
    """Symbols with their variables; a line of {SIGNALS} that cannot be read is left out beforehand."""
    lines: list[_Line] = []
    symbols: dict[str, list[str]] = {}
    places: dict[str, int] = {}
    not_read: list[NotRead] = []
    group, symbol = "", None
    for number, line in enumerate(text.split("\n"), 1):
        if (begins := _SYM_GROUP.match(line)) is not None:
            group, symbol = begins[1], None
        elif group not in ("ENUMS", "SIGNALS") and (begins := _SYM_SYMBOL.match(line)) is not None:
            symbol = begins[1] or begins[2]
            places.setdefault(symbol, len(places))
            symbols.setdefault(symbol, [])
        of_signal = _SYM_SIGNAL.match(line)
        name = "" if of_signal is None else of_signal[1] or of_signal[2]
        if group == "SIGNALS" and of_signal is not None and _SYM_FORM.fullmatch(line) is None:
            not_read.append(NotRead(name, f"line {number}", (name,)))
            continue
        signal = None
        if symbol is not None and of_signal is not None:
            signal = len(symbols[symbol])
            symbols[symbol].append(name)
        lines.append(_Line(line, None if symbol is None else places[symbol], signal))

    def written(selection: Selection) -> str:
        return "\n".join(
            line.text
            for line in lines
            if line.place is None
            or (line.place in selection and (line.signal is None or line.signal in selection[line.place]))
        )

    return Outline(list(symbols.items()), written, not_read)
