"""Mutations of text files: of bytes, lines and values; one file per seed."""

from __future__ import annotations

import re
from random import Random

_VALUES = (
    *("nan", "inf", "-inf", "0", "-0.0", "-1", "1e308", "1e-308", "1e999", "1e9", "5e-324", "3.7"),
    *("9" * 400, "9" * 5000, "0x" + "f" * 5000, "0b" + "1" * 70, "-9223372036854775808", "18446744073709551616"),
    *('""', '"a"', '"\\u001b[31m"', '"\\u0000"', '"a\\nb"', "'" + "x" * 10_000 + "'", '"ä\\U0001F600"'),
    *("true", "false", "[]", "{}", "[1, 2]", "[[]]", "{ name = 1 }", '{ name = "a", unit = "b", sign = 2 }'),
    *("[" * 20_000, "{a=" * 5000, "2024-13-01", "1979-05-27T07:32:00+99:99", "07:32:00", "1_000", "+1", "0x1p3"),
)
_KEYS = (
    *("name", "params", "signals", "source", "sensors", '""', '"a\\nb"', "a.b", ".".join("a" * 40), "ü", '"ü"'),
    *("base", "road", "kind", "truck", "steering_ratio", "x" * 10_000, "time", "__class__", "model_config"),
)
_SIGNS = rb"-=[]{}\"'#.,:;|@()+ \n\r\t\0\x1b\xff"
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def mutated(text: bytes, seed: int) -> bytes:
    """One to four changes, the same for the same seed."""
    random = Random(seed)
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        text = random.choice((_bytes, _lines, _value, _number, _key))(text, random)
    return text


def _bytes(text: bytes, random: Random) -> bytes:
    at = random.randrange(len(text) + 1)
    length = random.choice((0, 0, 1, 1, 2, 8, 64))
    new = bytes(random.choice(_SIGNS) for _ in range(random.choice((0, 1, 1, 2, 8))))
    new = random.choice((new, random.randbytes(len(new)), text[at : at + length] * 2))
    return text[:at] + new + text[at + length :]


def _lines(text: bytes, random: Random) -> bytes:
    lines = text.split(b"\n")
    one, other = random.randrange(len(lines)), random.randrange(len(lines))
    match random.choice(("drop", "double", "swap", "move", "join")):
        case "drop":
            del lines[one]
        case "double":
            lines.insert(other, lines[one])
        case "swap":
            lines[one], lines[other] = lines[other], lines[one]
        case "move":
            lines.insert(other, lines.pop(one))
        case "join":
            lines[one : one + 2] = [b"".join(lines[one : one + 2])]
    return b"\n".join(lines)


def _value(text: bytes, random: Random) -> bytes:
    """Replaces the value after an equals sign."""
    lines = text.split(b"\n")
    with_value = [place for place, line in enumerate(lines) if b"=" in line]
    if not with_value:
        return text
    place = random.choice(with_value)
    key, _, _ = lines[place].partition(b"=")
    lines[place] = key + b"= " + random.choice(_VALUES).encode()
    return b"\n".join(lines)


def _number(text: bytes, random: Random) -> bytes:
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    number = random.choice(found)
    new = random.choice((*_VALUES[:18], "1", "7", "13", "63", "64", "65", "255", "4294967296", "1e99999")).encode()
    return text[: number.start()] + new + text[number.end() :]


def _key(text: bytes, random: Random) -> bytes:
    lines = text.split(b"\n")
    new = random.choice((f"{random.choice(_KEYS)} = {random.choice(_VALUES)}", f"[{random.choice(_KEYS)}]"))
    lines.insert(random.randrange(len(lines) + 1), new.encode())
    return b"\n".join(lines)
