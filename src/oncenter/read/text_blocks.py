"""Complete lines of a text log, about 1 MiB at a time. All line ends become line feeds."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterator
from typing import BinaryIO

BLOCK_BYTES = 1 << 20  # its columns fit into the cache
_LONGEST_LINE_BYTES = 1 << 20


class TextBlocks:
    """Iterates over blocks of lines. A last line without a line end is left out, and sets `cut_off`."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.cut_off = False

    def __iter__(self) -> Iterator[bytes]:
        rest = self._file.read(len(BOM_UTF8))
        rest = b"" if rest == BOM_UTF8 else rest
        while block := self._file.read(BLOCK_BYTES):
            block = rest + block
            # a split CR LF pair gives an empty line, which is harmless
            end = max(block.rfind(b"\n"), block.rfind(b"\r")) + 1
            rest = block[end : end + _LONGEST_LINE_BYTES]  # a longer line is no frame: its middle is dropped
            if end:
                yield _with_line_feeds(block[:end])
        self.cut_off = bool(rest.strip())


def _with_line_feeds(block: bytes) -> bytes:
    return block.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in block else block
