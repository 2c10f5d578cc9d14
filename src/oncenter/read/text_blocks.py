"""Complete lines of a text log, about 1 MiB at a time, in UTF-8. All line ends become line feeds."""

from __future__ import annotations

from codecs import BOM_UTF8, getincrementaldecoder
from collections.abc import Iterator
from typing import BinaryIO, Protocol

from oncenter.files.log_formats import utf_16

BLOCK_BYTES = 1 << 20  # its columns fit into the cache
_LONGEST_LINE_BYTES = 1 << 20


class Text(Protocol):
    """A text file, read in order."""

    def read(self, size: int, /) -> bytes:
        """The next bytes; empty at the end."""


def utf_8(file: BinaryIO) -> Text:
    """The file's text from its begin on, without a byte order mark; UTF-16, as Windows tools write it, as UTF-8."""
    head = file.read(4)
    encoding = utf_16(head)
    file.seek(len(BOM_UTF8) if head.startswith(BOM_UTF8) else 0)
    return _FromUtf16(file, encoding) if encoding else file


class _FromUtf16:
    def __init__(self, file: BinaryIO, encoding: str) -> None:
        self._file, self._decoder = file, getincrementaldecoder(encoding)("replace")

    def read(self, size: int, /) -> bytes:
        while block := self._file.read(size):
            if text := self._decoder.decode(block):
                return text.encode("utf-8", "replace")
        return b""


class TextBlocks:
    """Iterates over blocks of lines. A last line without a line end is left out, and sets `cut_off`."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.cut_off = False

    def __iter__(self) -> Iterator[bytes]:
        rest, text = b"", utf_8(self._file)
        while block := text.read(BLOCK_BYTES):
            block = rest + block
            # a split CR LF pair gives an empty line, which is harmless
            end = max(block.rfind(b"\n"), block.rfind(b"\r")) + 1
            rest = block[end : end + _LONGEST_LINE_BYTES]  # a longer line is no frame: its middle is dropped
            if end:
                yield _with_line_feeds(block[:end])
        self.cut_off = bool(rest.strip())


def _with_line_feeds(block: bytes) -> bytes:
    return block.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in block else block
