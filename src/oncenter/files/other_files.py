"""Files that are no logs, named by their content for the message that refuses them."""

from __future__ import annotations

import re

from oncenter.files.log_formats import as_utf_8

_SHOWN = 40  # characters of a first line
_BEGINS = {
    b"PK\x03\x04": "a ZIP archive or an Office document",
    b"\xd0\xcf\x11\xe0": "an Office document",
    b"%PDF": "a PDF",
    b"7z\xbc\xaf": "a 7z archive",
    b"Rar!": "a RAR archive",
    b"\x7fELF": "a program",
    b"MZ": "a program",
    b"\x0a\x0d\x0d\x0a": "a pcapng capture",
    b"\xd4\xc3\xb2\xa1": "a pcap capture",
    b"\xa1\xb2\xc3\xd4": "a pcap capture",
    b"\xff\xd8\xff": "a picture",
    b"\x89PNG": "a picture",
}
_DATABASE = re.compile(rb'\s*VERSION\s+"|.*^BO_ \d+ ', re.DOTALL | re.MULTILINE)
_MARKUP = re.compile(rb"\s*<(?:\?xml|!doctype|html|\w+[^>]*>)", re.IGNORECASE)


def other_kind(head: bytes) -> str:
    """The kind of a file by its first bytes, "a PDF"; empty for one that may be a log."""
    found = next((kind for begin, kind in _BEGINS.items() if head.startswith(begin)), "")
    if found:
        return found
    if head[257:262] == b"ustar":
        return "a tar archive"
    text = as_utf_8(head)
    if _DATABASE.match(text):
        return "a DBC database, which follows --dbc"
    return "XML or HTML" if _MARKUP.match(text) else ""


def described(head: bytes) -> str:
    """A file of an unknown kind."""
    text = as_utf_8(head)
    if b"\0" in text or sum(byte < 9 for byte in text) > len(text) // 50:
        return f"binary data that begin with 0x{head[:4].hex()}"
    line = next((line for line in text.split(b"\n") if line.strip()), b"").decode("utf-8", "replace").strip()
    return f"text whose first line reads {line[:_SHOWN]!r}"
