"""Reads the messages of a database file with cantools: DBC, KCD, SYM or ARXML, by its suffix.

A hostile file is refused before cantools parses it. XML with a document type is refused: only a document type can
define entities that expand or that name other files.
"""

from __future__ import annotations

import codecs
import logging
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from xml.parsers import expat

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.files.file_name import printable
from oncenter.files.log_formats import imported
from oncenter.files.regular_file import read_regular_file, refuse_what_is_no_regular_file
from oncenter.read.database_parts import BITS_MAX, Loading, NotRead, Outline
from oncenter.read.wording import reason_of

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

    from cantools.database.can import Message

_XML = ("kcd", "arxml")
_BYTES_MAX = 16 << 20  # J1939's whole digital annex has five million
_LISTED_MAX = 4  # parts that cannot be read, in a note
_DEPTH_MAX = 200  # of nested elements; AUTOSAR's own are some 20 deep
_IDENTIFIERS_MAX = 1 << 12  # of one message of SYM

_QUOTED = re.compile(r': "[^"]*>>!<<.*', re.DOTALL)  # the place of cantools' syntax errors
_NOT_READ = re.compile(r'"(?:\\"|[^"])*"|//[^\n]*')  # strings and comments
_LONG_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\d{399}|\.?\d*[eE][-+]?\d{4})")
_SYM_PLACES = re.compile(r"^\s*(?:Sig|Var|Mux|Len|DLC)\s*=[^/\n]*", re.MULTILINE)
_SYM_NUMBER = re.compile(r"(?<![\w.])\d+(?![\w.])")
_SYM_IDENTIFIERS = re.compile(r"\bID\s*=\s*([0-9A-Fa-f]+)h\s*-\s*([0-9A-Fa-f]+)h")

_LINEAR = ("LINEAR", "SCALE_LINEAR_AND_TEXTTABLE", "TEXTTABLE", "IDENTICAL", "BITFIELD_TEXTTABLE")  # or no conversion
_XML_BITS = ("offset", "length", "LENGTH", "POSITION")  # attributes of KCD, and endings of ARXML element names


@dataclass(frozen=True)
class Database:
    """The messages of a database, at least one, and its parts that cannot be read."""

    messages: list[Message]
    not_read: list[NotRead]


def read_database(path: Path) -> Database:
    """All of a database that can be read.

    Raises:
        OncenterError: "bad_dbc", exit code 2: no message can be read, the file has another format, or is hostile;
            "missing_extra": cantools is not installed.
    """
    require_package("cantools", f"the database {path.name}")
    kind = _kind(path)
    text = _text(path)
    _REFUSALS[kind](text, path.name)
    logger = logging.getLogger("cantools")
    level = logger.level
    logger.setLevel(logging.CRITICAL + 1)  # else it logs its own lines, as for two messages of one name
    try:
        outline: Outline = imported(_OUTLINES[kind])(text)
        loading = Loading(outline, partial(_loaded, kind), _without_content)
        messages = loading.messages()
    except Exception as error:  # of an XML parser
        raise bad_database(f"cannot read the database {path.name}: {_without_content(reason_of(error))}") from error
    finally:
        logger.setLevel(level)
    not_read = [*loading.not_read, *outline.not_read]
    if not messages and not_read:
        raise bad_database(f"cannot read the database {path.name}: {not_read_note(not_read)}")
    if not messages:
        raise bad_database(f"the database {path.name} has no messages: give a file that describes CAN messages")
    if kind == "arxml":
        _mark_unread_conversions(text, messages)
    return Database(messages, not_read)


def not_read_note(not_read: Sequence[NotRead]) -> str:
    """The parts by name, those of messages and signals first."""
    in_order = sorted(not_read, key=lambda each: not each.inside)
    more = len(in_order) - _LISTED_MAX
    return printable(", ".join(map(str, in_order[:_LISTED_MAX])) + (f" and {more} more" if more > 0 else ""))


def _loaded(kind: str, text: str) -> list[Message]:
    from cantools.database import load_string
    from cantools.database.can import Database as OfCantools

    database = load_string(text, database_format=kind, strict=False)
    return list(database.messages) if isinstance(database, OfCantools) else []


def _without_content(reason: str) -> str:
    """cantools quotes the file: `dbc` of a vehicle file of somebody else may name any file."""
    return printable(_QUOTED.sub("", reason).replace('"', "")[:160])


def _mark_unread_conversions(text: str, messages: list[Message]) -> None:
    """Cantools ignores a conversion of an unknown category, so raw values would be used as physical ones. A signal with
    such a conversion gets the scale NaN, and is left out because of it."""
    from xml.etree import ElementTree

    from cantools.database.conversion import BaseConversion

    root = ElementTree.fromstring(text)
    methods = {
        inner["SHORT-NAME"]
        for inner in _elements(root, "COMPU-METHOD")
        if "COMPU-INTERNAL-TO-PHYS" in inner and inner.get("CATEGORY") not in _LINEAR
    }
    physical = {
        inner["SHORT-NAME"]
        for inner in _elements(root, "SYSTEM-SIGNAL")
        if _last(inner.get("COMPU-METHOD-REF")) in methods
    }
    unread = {
        inner["SHORT-NAME"]
        for inner in _elements(root, "I-SIGNAL")
        if _last(inner.get("SYSTEM-SIGNAL-REF")) in physical
    }
    for signal in (signal for message in messages for signal in message.signals):
        if signal.name in unread:
            signal.conversion = BaseConversion.factory(scale=math.nan)


def _elements(root: Element, kind: str) -> Iterator[dict[str, str]]:
    """Each named element of a kind: texts by tag, its own before those of nested elements."""
    for element in root.iter():
        if _tag(element) != kind:
            continue
        inner: dict[str, str] = {}
        for each in element.iter():
            inner.setdefault(_tag(each), (each.text or "").strip())
        if "SHORT-NAME" in inner:
            yield inner


def _tag(element: Element) -> str:
    return element.tag.rpartition("}")[2]


def _last(path: str | None) -> str | None:
    """The name at which a reference ends."""
    return None if path is None else path.rpartition("/")[2]


def _kind(path: Path) -> str:
    """The format as cantools names it; any other suffix means DBC."""
    suffix = path.suffix.lower().removeprefix(".")
    return suffix if suffix in (*_XML, "sym") else "dbc"


def _text(path: Path) -> str:
    refuse_what_is_no_regular_file(path, "database", code="bad_dbc", exit_code=WRONG_USAGE)
    try:
        content = read_regular_file(path, _BYTES_MAX)
    except OSError as error:
        raise bad_database(f"cannot read the database {path.name}: {error.strerror}") from None
    if not content:
        raise bad_database(f"{path.name} is empty: give a DBC, KCD, SYM or ARXML file")
    return _decoded(content).replace("\r\n", "\n").replace("\r", "\n")


def _decoded(content: bytes) -> str:
    """DBC and SYM do not state their encoding. UTF-8 is tried first: other text is almost never valid UTF-8."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", "replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def _refuse_absurd_sym(text: str, name: str) -> None:
    """Cantools allocates lists as long as a first bit, integers of any exponent, and a message for each identifier of a
    range."""
    bare = _NOT_READ.sub(" ", text)
    if _LONG_NUMBER.search(bare):
        raise bad_database(f"the database {name} has a number with too many digits")
    _refuse_bits(name, [int(number) for line in _SYM_PLACES.findall(bare) for number in _SYM_NUMBER.findall(line)])
    if any(int(high, 16) - int(low, 16) > _IDENTIFIERS_MAX for low, high in _SYM_IDENTIFIERS.findall(bare)):
        raise bad_database(f"the database {name} has a message of more than {_IDENTIFIERS_MAX} identifiers")


def _refuse_absurd_xml(text: str, name: str) -> None:
    """Refuses a document type, endless nesting, and impossible bit positions."""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    open_elements: list[str] = []
    bits: list[int] = []

    def refuse_document_type(*given: object) -> None:
        raise bad_database(
            f"the database {name} has a document type (<!DOCTYPE>), which is not allowed: delete that line"
        )

    def begin(element: str, attributes: Mapping[str, str]) -> None:
        open_elements.append(element.rpartition(":")[2])
        if len(open_elements) > _DEPTH_MAX:
            raise bad_database(f"the database {name} nests elements deeper than {_DEPTH_MAX} levels")
        bits.extend(_whole(attributes[key]) for key in attributes if key in _XML_BITS)

    def text_in(given: str) -> None:
        if open_elements and open_elements[-1].endswith(_XML_BITS):
            bits.append(_whole(given))

    parser.StartDoctypeDeclHandler = refuse_document_type
    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda element: open_elements.pop()
    parser.CharacterDataHandler = text_in
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise bad_database(f"cannot read the database {name}: {error}") from None
    _refuse_bits(name, bits)


def _whole(text: str) -> int:
    """The number in a text, also 0x10 and 1e3 as in ARXML; 0 where there is none: cantools reports it."""
    written = text.strip()
    try:
        return int(written, 16) if written.lower().startswith("0x") else min(int(float(written)), BITS_MAX + 1)
    except (ValueError, OverflowError):
        return 0 if "inf" not in written.lower() else BITS_MAX + 1


def _refuse_bits(name: str, places: Iterable[int]) -> None:
    if any(abs(number) > BITS_MAX for number in places):
        raise bad_database(f"the database {name} has a signal or a message of more than {BITS_MAX} bits")


_OUTLINES = {  # imported late: most logs have no database
    "dbc": "oncenter.read.dbc_statements:outline_of_dbc",
    "sym": "oncenter.read.database_outlines:outline_of_sym",
    "kcd": "oncenter.read.database_outlines:outline_of_kcd",
    "arxml": "oncenter.read.database_outlines:outline_of_arxml",
}
_REFUSALS: dict[str, Callable[[str, str], None]] = {
    "dbc": lambda text, name: None,  # by statement
    "sym": _refuse_absurd_sym,
    "kcd": _refuse_absurd_xml,
    "arxml": _refuse_absurd_xml,
}


def bad_database(message: str) -> OncenterError:
    return OncenterError(message, code="bad_dbc", exit_code=WRONG_USAGE)
