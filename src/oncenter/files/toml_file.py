"""Reads a TOML file with limits on size, nesting and numbers, so that a message can quote any value in it."""

from __future__ import annotations

import os
import re
import tomllib
from typing import Any

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.regular_file import read_regular_file

BYTES_MAX = 1 << 20
_DEPTH_MAX = 16  # of nested tables and arrays; oncenter's files have four
_INTEGER_BITS_MAX = 63  # what TOML guarantees
_MESSAGE_MAX = 1000  # characters
_KEY_PARTS_MAX = 16
# tomllib's memory grows with the square of a dotted key's parts: 200 kB of "a.a.a" need more than 4 GiB
_PART = r"""(?:[\w-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_LONG_KEY = re.compile(rf"""(?<![\w"'-])(?:{_PART}){{{_KEY_PARTS_MAX}}}""", re.ASCII)
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")  # control characters of terminals


def read_toml(file: str | os.PathLike[str], what: str, *, code: str) -> dict[str, Any]:
    """The tables of a TOML file.

    Args:
        file: a regular file of at most 1 MiB.
        what: the file's name in messages, as "vehicle file truck.toml".
        code: of the error.

    Raises:
        OncenterError: exit code 2: unreadable, not TOML, or beyond a limit; the message names it.
    """
    try:
        text = read_regular_file(file, BYTES_MAX).decode("utf-8-sig")
    except OSError as error:
        raise refusal(f"{what} cannot be read: {error.strerror}", code) from None
    except UnicodeDecodeError as error:
        raise refusal(f"{what} is not TOML: {error}", code) from None
    except ValueError as error:  # a zero byte in the path
        raise refusal(f"{what} cannot be read: {error}", code) from None
    return parsed_toml(text, what, code=code)


def parsed_toml(text: str, what: str, *, code: str) -> dict[str, Any]:
    """The tables of a TOML text; as `read_toml`."""
    if _LONG_KEY.search(text):
        raise refusal(f"{what} has a key of more than {_KEY_PARTS_MAX} parts", code)
    try:
        values = tomllib.loads(text)
    except RecursionError:
        raise refusal(f"{what} nests tables or arrays deeper than {_DEPTH_MAX} levels", code) from None
    except ValueError as error:  # also those of numbers and times
        raise refusal(f"{what} is not TOML: {error}", code) from None
    why = _beyond_bounds(values)
    if why is not None:
        raise refusal(f"{what} {why}", code)
    return values


def refusal(message: str, code: str) -> OncenterError:
    """An error with one line of limited length, because the message may quote the file."""
    line = " ".join(message.split())
    if len(line) > _MESSAGE_MAX:
        line = f"{line[:_MESSAGE_MAX]} …"
    return OncenterError(line, code=code, exit_code=WRONG_USAGE)


def _beyond_bounds(values: dict[str, Any]) -> str | None:
    """The first violation of a limit, in words."""
    level: list[Any] = [values]
    for _ in range(_DEPTH_MAX):
        below: list[Any] = []
        for each in level:
            inside = [*each, *each.values()] if isinstance(each, dict) else each
            below += [inner for inner in inside if isinstance(inner, dict | list)]
            for leaf in inside:
                if isinstance(leaf, str) and _CONTROL.search(leaf):
                    return f"contains a control character: {leaf[:80]!r}"
                if isinstance(leaf, int) and leaf.bit_length() > _INTEGER_BITS_MAX:
                    return f"contains an integer of more than {_INTEGER_BITS_MAX} bits"
        if not below:
            return None
        level = below
    return f"nests tables or arrays deeper than {_DEPTH_MAX} levels"
