"""Mutations of a good log: each format and seed give the same damaged log in every run.

Text logs are mutated by line and cell, binary logs by byte. BLF is also mutated inside its compressed containers, MF4
in the links, lengths and fields of its blocks, Parquet in the types and values of its columns. A table's mutant depends
on the versions of the libraries that write it; all others depend on the base log alone.
"""

from __future__ import annotations

import gzip
import io
import math
import random
import re
import struct
import zlib
from collections.abc import Callable, Iterator
from random import Random

import numpy as np
import numpy.typing as npt
import polars as pl

from oncenter.files.log_formats import SUFFIXES

FORMATS = tuple(suffix[1:] for suffix in SUFFIXES)
TEXT_FORMATS = ("log", "asc", "trc", "csv", "vbo")

# Counts and addresses at which a reader's arithmetic overflows, or its memory does.
_EDGES = (0, 1, 127, 128, 2**8 - 1, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**63 - 1, 2**63, 2**64 - 1)

# Cells written by some programs, or that a parser might wrongly accept as a number.
_BAD_CELLS = [
    *"nan NaN inf -inf 1e308 -1e308 1e18 -1e18 1e-310 1e999 0x1p3 1,5 \u0661\u0662 1_000 + --1 1e".split(),
    *("true", "null", "NA", "#N/A", "", "\0", "9" * 400, "9" * 5000, "- 3", "\t", '"', '"a', "3;4"),
]
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")

Lines = list[bytes]
Mutated = tuple[bytes, str]  # the log, and a description of its damage
ByteDamage = Callable[[bytearray, Random, str], None]  # in place
TextDamage = Callable[[Lines, str, Random], bytes]  # of a log's lines and format
BlockDamage = Callable[[bytearray, int, int, int, list[int], Random], None]  # block, its length and links, all blocks
ColumnDamage = Callable[[pl.DataFrame, str, Random], pl.DataFrame]  # of one column


def mutate(log_format: str, seed: int, base: bytes) -> Mutated:
    """One mutant of a log of one of `FORMATS`."""
    chance = random.Random(f"{log_format} {seed}")
    if log_format in TEXT_FORMATS:
        return _text(base, log_format, chance) if chance.random() < 0.65 else _binary(base, chance)
    if log_format == "csv.gz":
        return _packed_text(base, chance) if chance.random() < 0.5 else _binary(base, chance)
    if log_format == "blf":
        return _in_containers(base, chance) if chance.random() < 0.6 else _binary(base, chance)
    if log_format == "mf4":
        return _in_blocks(base, chance) if chance.random() < 0.6 else _binary(base, chance)
    if log_format == "parquet" and chance.random() < 0.35:
        return _column(base, chance)
    return _binary(base, chance)


# ---------------------------------------------------------------------------------------------------------------------
# Bytes
# ---------------------------------------------------------------------------------------------------------------------


def _binary(base: bytes, chance: Random) -> Mutated:
    """One to four damages of bytes; half of them in the first or last 4 KiB, where headers and footers are."""
    data, done = bytearray(base), []
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        if not data:
            break
        where, name = chance.choice(("head", "tail", "any", "any")), chance.choice(tuple(_BYTE_DAMAGES))
        _BYTE_DAMAGES[name](data, chance, where)
        done.append(f"{name}@{where}")
    return bytes(data), "+".join(done)


def _place(data: bytearray, chance: Random, where: str) -> int:
    count = len(data)
    if count <= 1:
        return 0
    if where == "head":
        return chance.randrange(min(count, 4096))
    if where == "tail":
        return count - 1 - chance.randrange(min(count, 4096))
    return chance.randrange(count)


def _flip_bits(count: int) -> ByteDamage:
    def flip(data: bytearray, chance: Random, where: str) -> None:
        for _ in range(count):
            data[_place(data, chance, where)] ^= 1 << chance.randrange(8)

    return flip


def _set_byte(data: bytearray, chance: Random, where: str) -> None:
    data[_place(data, chance, where)] = chance.choice((0, 0xFF, 0x7F, 0x80, 10, 13, 34, 44))


def _set_number(width: int) -> ByteDamage:
    """An aligned number of so many bytes becomes one of `_EDGES`."""

    def put(data: bytearray, chance: Random, where: str) -> None:
        place = _place(data, chance, where) // width * width
        data[place : place + width] = _edge(chance, width)[: len(data) - place]

    return put


def _edge(chance: Random, width: int) -> bytes:
    return (chance.choice(_EDGES) & ((1 << 8 * width) - 1)).to_bytes(width, "little")


def _truncate(data: bytearray, chance: Random, where: str) -> None:
    del data[_place(data, chance, "any") :]


def _cut_tail(data: bytearray, chance: Random, where: str) -> None:
    del data[max(0, len(data) - chance.choice((1, 2, 3, 7, 8, 64, 511))) :]


def _delete(data: bytearray, chance: Random, where: str) -> None:
    place = _place(data, chance, where)
    del data[place : place + chance.choice((1, 2, 7, 64, 4096))]


def _repeat(data: bytearray, chance: Random, where: str) -> None:
    place = _place(data, chance, where)
    data[place:place] = data[place : place + chance.choice((1, 8, 64, 4096, 65536))]


def _insert(data: bytearray, chance: Random, where: str) -> None:
    place = _place(data, chance, where)
    data[place:place] = chance.randbytes(chance.choice((1, 3, 64, 4096)))


def _overwrite(data: bytearray, chance: Random, where: str) -> None:
    """Overwrites bytes with zeros, with noise, or with bytes from elsewhere in the log."""
    place, source = _place(data, chance, where), _place(data, chance, "any")
    count = min(chance.choice((8, 64, 4096, 65536)), len(data) - place, len(data) - source)
    data[place : place + count] = chance.choice(
        (bytes(count), chance.randbytes(count), bytes(data[source : source + count]))
    )


def _swap(data: bytearray, chance: Random, where: str) -> None:
    one, other = _place(data, chance, "any"), _place(data, chance, "any")
    count = min(4096, len(data) - one, len(data) - other)
    data[one : one + count], data[other : other + count] = data[other : other + count], data[one : one + count]


_BYTE_DAMAGES: dict[str, ByteDamage] = {
    "flip 1 bit": _flip_bits(1),
    "flip 8 bits": _flip_bits(8),
    "flip 64 bits": _flip_bits(64),
    "set byte": _set_byte,
    "set 4 bytes": _set_number(4),
    "set 8 bytes": _set_number(8),
    "truncate": _truncate,
    "cut tail": _cut_tail,
    "delete": _delete,
    "repeat": _repeat,
    "insert": _insert,
    "overwrite": _overwrite,
    "swap": _swap,
}


# ---------------------------------------------------------------------------------------------------------------------
# Lines and cells
# ---------------------------------------------------------------------------------------------------------------------


def _text(base: bytes, log_format: str, chance: Random) -> Mutated:
    name = chance.choice(tuple(_TEXT_DAMAGES))
    return _TEXT_DAMAGES[name](base.split(b"\n"), log_format, chance), name


def _packed_text(base: bytes, chance: Random) -> Mutated:
    """A damaged CSV text in an intact gzip file."""
    text = gzip.decompress(base)
    mutated, done = _text(text, "csv", chance) if chance.random() < 0.8 else _binary(text, chance)
    return gzip.compress(mutated, 1, mtime=0), f"in gzip: {done}"


def _bad_cells(counts: tuple[int, ...]) -> TextDamage:
    def put(lines: Lines, log_format: str, chance: Random) -> bytes:
        damaged = list(lines)
        for _ in range(chance.choice(counts)):
            number = chance.randrange(len(damaged))
            found = list(_NUMBER.finditer(damaged[number]))
            if found:
                damaged[number] = _replaced(damaged[number], chance.choice(found), chance.choice(_BAD_CELLS).encode())
        return b"\n".join(damaged)

    return put


def _replaced(line: bytes, found: re.Match[bytes], by: bytes) -> bytes:
    return line[: found.start()] + by + line[found.end() :]


_STAMPS = {
    "csv": re.compile(rb"^([^,]*)(?=,)"),
    "log": re.compile(rb"(?<=^\()(\d+\.\d+)(?=\))"),
    "trc": re.compile(rb"^\s*(?:\d+\)?\s+)?(\d+\.\d+)"),
    "asc": re.compile(rb"^\s*(\d+\.\d+)"),
    "vbo": re.compile(rb"^\d{3} (\d{6}\.\d+)"),
}


def _with_stamps(lines: Lines, log_format: str, changed: Callable[[float], float], begin: int = 0) -> bytes:
    """The log with other time stamps from a line on."""
    stamp = _STAMPS[log_format]
    damaged = list(lines)
    for number in range(begin, len(lines)):
        found = stamp.search(lines[number])
        try:
            time = float(found[1]) if found else math.nan
        except ValueError:  # a header
            continue
        if found is None or math.isnan(time):
            continue
        text = repr(changed(time)) if log_format == "csv" else f"{changed(time):.6f}"
        damaged[number] = lines[number][: found.start(1)] + text.encode() + lines[number][found.end(1) :]
    return b"\n".join(damaged)


def _somewhere(lines: Lines, chance: Random) -> int:
    return chance.randrange(1, max(2, len(lines)))


def _jump(lines: Lines, log_format: str, chance: Random) -> bytes:
    by_s = chance.choice((1e18, 1e12, 1e11 - 1e9, 1e10, 1e9, 1e6, 86400.0, 4.9, 1e300, 3600.0))
    return _with_stamps(lines, log_format, lambda time: time + by_s, _somewhere(lines, chance))


def _jump_back(lines: Lines, log_format: str, chance: Random) -> bytes:
    by_s, begin = chance.choice((1e18, 1e9, 100.0, 86400.0, 1e10)), chance.choice((0, _somewhere(lines, chance)))
    return _with_stamps(lines, log_format, lambda time: time - by_s, begin)


def _scale_time(lines: Lines, log_format: str, chance: Random) -> bytes:
    by = chance.choice((1e-3, 1e3, 1e-9, 1e9, 0.5, 2.0, 0.0, -1.0, 1e-300, 49.0))
    return _with_stamps(lines, log_format, lambda time: time * by, chance.choice((0, _somewhere(lines, chance))))


def _stop_time(lines: Lines, log_format: str, chance: Random) -> bytes:
    stopped: list[float] = []

    def first(time: float) -> float:
        stopped.append(time)
        return stopped[0]

    return _with_stamps(lines, log_format, first, _somewhere(lines, chance))


def _smallest_time(lines: Lines, log_format: str, chance: Random) -> bytes:
    return _with_stamps(lines, log_format, lambda time: 5e-324 * (1 + int(time)))


def _of_body(change: Callable[[Lines, Random], Lines]) -> TextDamage:
    """All lines but the first are changed."""

    def changed(lines: Lines, log_format: str, chance: Random) -> bytes:
        return b"\n".join(lines[:1] + change(lines[1:], chance))

    return changed


def _shuffled(body: Lines, chance: Random) -> Lines:
    return chance.sample(body, len(body))


def _thinned(body: Lines, chance: Random) -> Lines:
    share = chance.choice((0.01, 0.5, 0.99))
    return [line for line in body if chance.random() > share]


def _doubled(body: Lines, chance: Random) -> Lines:
    return [line for line in body for _ in range(chance.choice((1, 1, 2)))]


def _with_blank_lines(body: Lines, chance: Random) -> Lines:
    return [part for line in body for part in ((line, b"") if chance.random() < 0.3 else (line,))]


def _interleaved(body: Lines, chance: Random) -> Lines:
    return [line for pair in zip(body, body[len(body) // 2 :], strict=False) for line in pair]


def _with_cut_lines(body: Lines, chance: Random) -> Lines:
    return [line[: chance.randrange(len(line) + 1)] if chance.random() < 0.01 else line for line in body]


def _with_constant_cell(body: Lines, chance: Random) -> Lines:
    place, value = chance.randrange(1, 6), chance.choice((b"nan", b"1e30", b"0", b"inf", b"1e-320", b""))
    rows = [line.split(b",") for line in body]
    return [b",".join((*row[:place], value, *row[place + 1 :]) if place < len(row) else row) for row in rows]


def _with_line_ends(ends: tuple[bytes, ...]) -> TextDamage:
    def ended(lines: Lines, log_format: str, chance: Random) -> bytes:
        return b"".join(line + chance.choice(ends) for line in lines)

    return ended


def _with_mark(lines: Lines, log_format: str, chance: Random) -> bytes:
    utf_8 = b"\xef\xbb\xbf"
    return chance.choice((utf_8, b"\xff\xfe", b"\xfe\xff", utf_8 + utf_8, b"\0\0\xfe\xff")) + b"\n".join(lines)


def _encoded(lines: Lines, log_format: str, chance: Random) -> bytes:
    return b"\n".join(lines).decode("latin-1").encode(chance.choice(("utf-16", "utf-16-le", "utf-32")))


def _with_bytes(given: bytes) -> TextDamage:
    def sprinkled(lines: Lines, log_format: str, chance: Random) -> bytes:
        data = bytearray(b"\n".join(lines))
        for _ in range(chance.choice((1, 100, 10_000))):
            data[chance.randrange(len(data))] = chance.choice(given)
        return bytes(data)

    return sprinkled


def _long_line(lines: Lines, log_format: str, chance: Random) -> bytes:
    number = _somewhere(lines, chance) - 1
    longer = lines[number] + b"9," * chance.choice((1000, 5_000_000))
    return b"\n".join([*lines[:number], longer, *lines[number + 1 :]])


def _decimal_comma(lines: Lines, log_format: str, chance: Random) -> bytes:
    swapped = b"\n".join(lines).replace(b",", b"\x01").replace(b".", b",")
    return swapped.replace(b"\x01", chance.choice((b";", b"\t", b",")))


def _damaged_header(lines: Lines, log_format: str, chance: Random) -> bytes:
    header = bytearray(lines[0])
    for _ in range(chance.choice((1, 3, 10)) if header else 0):
        header[chance.randrange(len(header))] = chance.choice(b'abc,;"\t_ .')
    return b"\n".join([bytes(header), *lines[1:]])


def _repeated_column(lines: Lines, log_format: str, chance: Random) -> bytes:
    place = chance.randrange(1, 4)

    def longer(line: bytes) -> bytes:
        cells = line.split(b",")
        return b",".join((*cells, cells[min(place, len(cells) - 1)]))

    return b"\n".join(map(longer, lines))


def _many_columns(lines: Lines, log_format: str, chance: Random) -> bytes:
    count = chance.choice((1000, 100_000))
    return b"\n".join([lines[0] + b",x" * count, *(line + b",1" * count for line in lines[1:2]), *lines[2:2000]])


def _stray_quote(lines: Lines, log_format: str, chance: Random) -> bytes:
    number = _somewhere(lines, chance) - 1
    return b"\n".join([*lines[:number], b'"' + lines[number], *lines[number + 1 :]])


def _with_top_row(lines: Lines, log_format: str, chance: Random) -> bytes:
    rows = b"# c", b"sep=;", b"\n\n", b"x", b"[s],[rad],[deg/s]", b"\x1a", b"date Thu Jan 99 99:99:99 2026"
    return b"\n".join([chance.choice(rows), *lines])


def _other_digits(lines: Lines, log_format: str, chance: Random) -> bytes:
    digit, other, count = chance.choice((b"1", b"0", b"3")), chance.choice((b"7", b"e", b".")), (1, 100, 10**9)
    return b"\n".join(lines).replace(digit, other, chance.choice(count))


def _columns_reversed(lines: Lines, log_format: str, chance: Random) -> bytes:
    return b"\n".join(b",".join(line.split(b",")[::-1]) for line in lines)


def _twice(lines: Lines, log_format: str, chance: Random) -> bytes:
    text = b"\n".join(lines)
    return text + chance.choice((text, b"\n" + text, text[len(text) // 2 :]))


_TEXT_DAMAGES: dict[str, TextDamage] = {
    "bad cell": _bad_cells((1,)),
    "bad cells": _bad_cells((10, 1000, 20_000)),
    "time jumps": _jump,
    "time jumps back": _jump_back,
    "time scaled": _scale_time,
    "time stops": _stop_time,
    "time is tiny": _smallest_time,
    "lines reversed": _of_body(lambda body, chance: body[::-1]),
    "lines shuffled": _of_body(_shuffled),
    "lines dropped": _of_body(_thinned),
    "lines doubled": _of_body(_doubled),
    "lines interleaved": _of_body(_interleaved),
    "lines cut": _of_body(_with_cut_lines),
    "blank lines": _of_body(_with_blank_lines),
    "constant cell": _of_body(_with_constant_cell),
    "CR LF": _with_line_ends((b"\r\n",)),
    "CR": _with_line_ends((b"\r",)),
    "mixed line ends": _with_line_ends((b"\n", b"\r\n", b"\r", b"\n\n")),
    "byte order mark": _with_mark,
    "UTF-16 or 32": _encoded,
    "zero bytes": _with_bytes(b"\0"),
    "bytes above 127": _with_bytes(b"\xe9\xff\xc3\x80"),
    "long line": _long_line,
    "decimal comma": _decimal_comma,
    "damaged header": _damaged_header,
    "repeated column": _repeated_column,
    "many columns": _many_columns,
    "columns reversed": _columns_reversed,
    "stray quote": _stray_quote,
    "top row": _with_top_row,
    "other digits": _other_digits,
    "twice": _twice,
}


# ---------------------------------------------------------------------------------------------------------------------
# BLF: objects in compressed containers
# ---------------------------------------------------------------------------------------------------------------------

_CONTAINER = struct.Struct("<HxxxxxxIxxxx")  # after the 16 bytes of every object's header: method, unpacked size
_DEFLATED = 2


def _in_containers(base: bytes, chance: Random) -> Mutated:
    """The bytes within one, two or all containers are damaged and packed again, some with a wrong unpacked size."""
    header_size = struct.unpack_from("<I", base, 4)[0]
    containers = list(_objects(base, header_size))
    chosen = set(chance.sample(range(len(containers)), min(len(containers), chance.choice((1, 2, len(containers))))))
    out, done = bytearray(base[:header_size]), ""
    for number, container in enumerate(containers):
        if number in chosen and _CONTAINER.unpack_from(container, 16)[0] == _DEFLATED:
            container, done = _repacked(container, chance)
        out += container + bytes(len(container) % 4)
    if chance.random() < 0.8:
        struct.pack_into("<Q", out, 16, len(out))
    return bytes(out), f"in container: {done}"


def _objects(base: bytes, place: int) -> Iterator[bytes]:
    while base[place : place + 4] == b"LOBJ":
        size = struct.unpack_from("<I", base, place + 8)[0]
        yield base[place : place + size]
        place += size + size % 4


def _repacked(container: bytes, chance: Random) -> Mutated:
    content = zlib.decompress(container[32:])
    content, done = _binary(content, chance) if chance.random() < 0.5 else _in_objects(content, chance)
    size = len(content) if chance.random() < 0.7 else chance.choice(_EDGES) & 0xFFFFFFFF
    packed = zlib.compress(content)
    header = container[:8] + struct.pack("<I", 32 + len(packed)) + container[12:16]
    return header + _CONTAINER.pack(_DEFLATED, size) + packed, done


_OBJECT_FIELDS = {  # place and width in a CAN message's object
    "header size": (4, 2),
    "header version": (6, 2),
    "size": (8, 4),
    "type": (12, 4),
    "flags": (16, 4),
    "time": (24, 8),
    "channel": (32, 2),
    "length of data": (35, 1),
    "identifier": (36, 4),
}
_OBJECT_NUMBERS = (*range(25), 32, 48, 64, 86, 100, 101, 115)  # sizes, versions and types that occur, and their like


def _in_objects(content: bytes, chance: Random) -> Mutated:
    """One field of one object, or of a fifth of them, gets one of `_EDGES` or `_OBJECT_NUMBERS`."""
    data = bytearray(content)
    objects = [found.start() for found in re.finditer(b"LOBJ", content)][1:-1]
    name, number = chance.choice(tuple(_OBJECT_FIELDS)), chance.choice((*_EDGES, *_OBJECT_NUMBERS))
    place, width = _OBJECT_FIELDS[name]
    for begin in chance.sample(objects, chance.choice((1, 1, len(objects) // 5)) if objects else 0):
        data[begin + place : begin + place + width] = (number & ((1 << 8 * width) - 1)).to_bytes(width, "little")
    return bytes(data), f"{name} {number} of object"


# ---------------------------------------------------------------------------------------------------------------------
# MF4: blocks with a length, a count of links, links and fields
# ---------------------------------------------------------------------------------------------------------------------

_BLOCK = re.compile(rb"##[A-Z]{2}\0\0\0\0")
_BLOCK_HEADER = 24


def _in_blocks(base: bytes, chance: Random) -> Mutated:
    data, done = bytearray(base), []
    blocks = [found.start() for found in _BLOCK.finditer(base)]
    types = sorted({base[block : block + 4] for block in blocks})  # most are texts, so the type is drawn first
    for _ in range(chance.choice((1, 1, 2, 3))):
        drawn, name = chance.choice(types), chance.choice(tuple(_BLOCK_DAMAGES))
        block = chance.choice([block for block in blocks if base[block : block + 4] == drawn])
        length, links = struct.unpack_from("<QQ", base, block + 8)
        if links < 1000 and _BLOCK_HEADER + 8 * links <= length < 10_000_000:
            _BLOCK_DAMAGES[name](data, block, length, links, blocks, chance)
        done.append(f"{name} of {drawn.decode()} at {block}")
    return bytes(data), "+".join(done)


def _block_length(data: bytearray, block: int, length: int, links: int, blocks: list[int], chance: Random) -> None:
    wrong = chance.choice((*_EDGES, length + 8, length - 8, _BLOCK_HEADER))
    data[block + 8 : block + 16] = struct.pack("<Q", wrong)


def _link_count(data: bytearray, block: int, length: int, links: int, blocks: list[int], chance: Random) -> None:
    data[block + 16 : block + 24] = struct.pack("<Q", chance.choice((*_EDGES, links + 1)))


def _link(data: bytearray, block: int, length: int, links: int, blocks: list[int], chance: Random) -> None:
    if links:
        place = block + _BLOCK_HEADER + 8 * chance.randrange(links)
        data[place : place + 8] = struct.pack("<Q", chance.choice((*blocks, *_EDGES)))


def _link_to_itself(data: bytearray, block: int, length: int, links: int, blocks: list[int], chance: Random) -> None:
    if links:
        place = block + _BLOCK_HEADER + 8 * chance.randrange(links)
        data[place : place + 8] = struct.pack("<Q", block)


def _block_field(data: bytearray, block: int, length: int, links: int, blocks: list[int], chance: Random) -> None:
    begin = _BLOCK_HEADER + 8 * links
    if begin < length:
        place, width = block + begin + chance.randrange(length - begin), chance.choice((1, 2, 4, 8))
        data[place : place + width] = _edge(chance, width)


def _block_type(data: bytearray, block: int, length: int, links: int, blocks: list[int], chance: Random) -> None:
    data[block : block + 4] = chance.choice((b"##DT", b"##DZ", b"##HL", b"##CG", b"##CC", b"##TX"))


_BLOCK_DAMAGES: dict[str, BlockDamage] = {
    "length": _block_length,
    "link count": _link_count,
    "link": _link,
    "link to itself": _link_to_itself,
    "field": _block_field,
    "type": _block_type,
}


# ---------------------------------------------------------------------------------------------------------------------
# Parquet: types and values of columns
# ---------------------------------------------------------------------------------------------------------------------


def _column(base: bytes, chance: Random) -> Mutated:
    """A readable Parquet file with one column of another type, or with unexpected values."""
    table = pl.read_parquet(base)
    name, kind = chance.choice(table.columns[:6]), chance.choice(tuple(_COLUMN_DAMAGES))
    written = io.BytesIO()
    damaged = _COLUMN_DAMAGES[kind](table, name, chance)
    damaged.write_parquet(written, compression=chance.choice(("zstd", "snappy", "uncompressed", "gzip", "lz4")))
    return written.getvalue(), f"{kind}: {name}"


def _cells_set(values: tuple[float, ...], counts: tuple[int, ...]) -> ColumnDamage:
    """So many cells from a row on; 0 is all of them."""

    def put(table: pl.DataFrame, name: str, chance: Random) -> pl.DataFrame:
        column, begin, count = table[name].to_numpy().copy(), chance.randrange(table.height), chance.choice(counts)
        column[begin if count else 0 : begin + count if count else None] = chance.choice(values)
        return table.with_columns(pl.Series(name, column))

    return put


def _cast(to: Callable[[pl.Expr], pl.Expr]) -> ColumnDamage:
    return lambda table, name, chance: table.with_columns(to(pl.col(name).fill_nan(0)).alias(name))


def _nulls(table: pl.DataFrame, name: str, chance: Random) -> pl.DataFrame:
    empty = pl.int_range(pl.len()) % chance.choice((1, 2, 3, 50)) == 0
    return table.with_columns(pl.when(empty).then(None).otherwise(pl.col(name)).alias(name))


def _dates(table: pl.DataFrame, name: str, chance: Random) -> pl.DataFrame:
    stamps = (pl.col("time_s") * 1e6).cast(pl.Int64).cast(pl.Datetime(chance.choice(("us", "ns", "ms"))))
    return table.with_columns(stamps.alias(name))


def _small_integers(table: pl.DataFrame, name: str, chance: Random) -> pl.DataFrame:
    values: npt.NDArray[np.int16] = np.nan_to_num(table[name].to_numpy() * 100).astype(np.int64).astype(np.int16)
    return table.with_columns(pl.Series(name, values))


def _jump_in_table(table: pl.DataFrame, name: str, chance: Random) -> pl.DataFrame:
    time = table["time_s"].to_numpy().copy()
    time[chance.randrange(table.height) :] += chance.choice((1e18, 1e10, 9e10, 1e300, 4.9, 86400, -50, -1e9))
    return table.with_columns(pl.Series("time_s", time))


def _whole_time(table: pl.DataFrame, name: str, chance: Random) -> pl.DataFrame:
    return table.with_columns((pl.col("time_s") * chance.choice((1, 100, 1e9))).cast(pl.Int64))


def _renamed(table: pl.DataFrame, name: str, chance: Random) -> pl.DataFrame:
    names = "time_ms yaw_rate_deg_s2 steering_wheel_angle_deg vehicle_speed_mph vehicle_speed_km_h".split()
    return table.rename({name: chance.choice(names)})


def _wide(table: pl.DataFrame, name: str, chance: Random) -> pl.DataFrame:
    return table.head(2000).with_columns(pl.lit(1.0).alias(f"x{k}") for k in range(5000))


_COLUMN_DAMAGES: dict[str, ColumnDamage] = {
    "NaN": _cells_set((math.nan,), (1, 100, 0)),
    "infinite cell": _cells_set((math.inf, -math.inf), (1,)),
    "huge cells": _cells_set((1e300, -1e300, 1e18, 1e30), (1, 1000)),
    "tiny cells": _cells_set((5e-324,), (0,)),
    "all float32": lambda table, name, chance: table.cast(pl.Float32),
    "int16": _small_integers,
    "int64": _cast(lambda column: column.cast(pl.Int64)),
    "largest uint64": lambda table, name, chance: table.with_columns(pl.lit(2**64 - 1, pl.UInt64).alias(name)),
    "text": _cast(lambda column: column.cast(pl.String)),
    "bytes": _cast(lambda column: column.cast(pl.String).cast(pl.Binary)),
    "categories": _cast(lambda column: column.cast(pl.String).cast(pl.Categorical)),
    "list": _cast(pl.concat_list),
    "struct": lambda table, name, chance: table.with_columns(pl.struct(name).alias(name)),
    "decimal": _cast(lambda column: column.cast(pl.Decimal(20, 6))),
    "boolean": _cast(lambda column: column > 0),
    "nulls": _nulls,
    "dates": _dates,
    "time jumps": _jump_in_table,
    "time is negative": lambda table, name, chance: table.with_columns(pl.col("time_s") - 1e9),
    "time is whole": _whole_time,
    "renamed": _renamed,
    "no row": lambda table, name, chance: table.head(0),
    "one row": lambda table, name, chance: table.head(1),
    "many columns": _wide,
    "twice": lambda table, name, chance: pl.concat((table, table)),
}
