"""Reads the exports and dependencies of a shared library from its bytes: 64-bit ELF, PE and Mach-O."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass
class SharedLibrary:
    """A library of one processor.

    Attributes:
        exports: the names that others may call, without the underscore that macOS puts before each.
        needs: the libraries that the loader must find.
        facts: of Mach-O, the load commands by number.
    """

    machine: str
    exports: set[str] = field(default_factory=set)
    needs: set[str] = field(default_factory=set)
    facts: dict[int, bytes] = field(default_factory=dict)


def libraries_in(data: bytes) -> list[SharedLibrary]:
    """One, but of a universal binary one for each processor."""
    if data[:4] == b"\x7fELF":
        return [_elf(data)]
    if data[:2] == b"MZ":
        return [_pe(data)]
    if struct.unpack_from(">I", data) == (0xCAFEBABE,):
        (count,) = struct.unpack_from(">I", data, 4)
        places = [struct.unpack_from(">5I", data, 8 + 20 * k) for k in range(count)]
        assert all(at % (1 << bits) == 0 for _, _, at, _, bits in places)
        return [_mach_o(data[at : at + size], processor) for processor, _, at, size, _ in places]
    return [_mach_o(data, None)]


def _text(data: bytes, at: int) -> str:
    return data[at : data.index(b"\0", at)].decode()


def _elf(data: bytes) -> SharedLibrary:
    machine = {62: "x86_64", 183: "aarch64"}[struct.unpack_from("<H", data, 18)[0]]
    library = SharedLibrary(machine)
    (table,) = struct.unpack_from("<Q", data, 40)
    size, count, _ = struct.unpack_from("<3H", data, 58)
    sections = [struct.unpack_from("<2I4Q2I2Q", data, table + size * k) for k in range(count)]
    for _, kind, _, _, at, length, link, _, _, entry in sections:
        names = sections[link][4] if link < count else 0
        if kind == 11:  # SHT_DYNSYM
            for place in range(at, at + length, entry):
                name, info, _, section, _, _ = struct.unpack_from("<I2BH2Q", data, place)
                if section != 0 and info >> 4 in (1, 2):  # defined, global or weak
                    library.exports.add(_text(data, names + name))
        if kind == 6:  # SHT_DYNAMIC
            tags = [struct.unpack_from("<2Q", data, place) for place in range(at, at + length, 16)]
            library.needs |= {_text(data, names + value) for tag, value in tags if tag == 1}
    return library


def _pe(data: bytes) -> SharedLibrary:
    (head,) = struct.unpack_from("<I", data, 60)
    machine, count, _, _, _, optional = struct.unpack_from("<2H3IH", data, head + 4)
    library = SharedLibrary({0x8664: "x86_64"}[machine])
    first = head + 24 + optional
    sections = [struct.unpack_from("<4I", data, first + 40 * k + 8) for k in range(count)]

    def place(address: int) -> int:
        return next(raw + address - at for size, at, _, raw in sections if at <= address < at + size)

    exports, _, imports, _ = struct.unpack_from("<4I", data, head + 24 + 112)
    at = place(exports)
    (named,) = struct.unpack_from("<I", data, at + 24)
    (names,) = struct.unpack_from("<I", data, at + 32)
    addresses = struct.unpack_from(f"<{named}I", data, place(names))
    library.exports = {_text(data, place(address)) for address in addresses}
    at = place(imports)
    while (name := struct.unpack_from("<5I", data, at)[3]) != 0:
        library.needs.add(_text(data, place(name)))
        at += 20
    return library


def _mach_o(data: bytes, listed: int | None) -> SharedLibrary:
    magic, processor, _, kind, count, _, _, _ = struct.unpack_from("<8I", data)
    assert (magic, kind) == (0xFEEDFACF, 6)  # MH_DYLIB
    assert listed in (None, processor)
    library = SharedLibrary({0x01000007: "x86_64", 0x0100000C: "aarch64"}[processor])
    at = 32
    for _ in range(count):
        command, size = struct.unpack_from("<2I", data, at)
        if command == 0x0C:  # LC_LOAD_DYLIB
            library.needs.add(_text(data, at + struct.unpack_from("<I", data, at + 8)[0]))
        else:
            library.facts[command] = data[at : at + size]
        at += size
    if 0x80000022 in library.facts:  # LC_DYLD_INFO_ONLY
        begin, length = struct.unpack_from("<2I", library.facts[0x80000022], 40)
    else:  # LC_DYLD_EXPORTS_TRIE
        begin, length = struct.unpack_from("<2I", library.facts[0x80000033], 8)
    library.exports = {name.removeprefix("_") for name in _leaves(data[begin : begin + length], 0, "")}
    return library


def _leaves(trie: bytes, node: int, name: str) -> Iterator[str]:
    """The names of an export trie: a node holds data of its own name, then its children by their next letters."""
    own, at = _uleb128(trie, node)
    if own > 0:
        yield name
    at += own
    children, at = trie[at], at + 1
    for _ in range(children):
        letters = _text(trie, at)
        child, at = _uleb128(trie, at + len(letters) + 1)
        yield from _leaves(trie, child, name + letters)


def _uleb128(data: bytes, at: int) -> tuple[int, int]:
    """A number of seven bits a byte, and the place behind it."""
    value = shift = 0
    while True:
        value |= (data[at] & 0x7F) << shift
        shift += 7
        at += 1
        if data[at - 1] < 0x80:
            return value, at
