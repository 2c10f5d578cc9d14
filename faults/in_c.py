"""One-line faults that a C file can have, found in the bodies of its functions.

Left out: comments, strings, directives, prototypes and constants outside functions.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

Found = tuple[str, str, int, int, str]  # kind, function, start, end, new text

_NO_CODE = re.compile(
    r"/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'|^[ \t]*#[^\n]*", re.DOTALL | re.MULTILINE
)
_FUNCTION = re.compile(
    r"^(?:static |inline |const )*\w[\w ]*[ *]+(\w+)\([^;{}]*\)\s*\{.*?^\}", re.DOTALL | re.MULTILINE
)
_SIGN = re.compile(
    r"(?<=[\w)\]]) ([+-]) (?=[\w(])|(?<=\w |\] )([+-])(?== )|(?<=[=(,?:] )(-)(?=[a-z(])|(?<=\()(-)(?=[a-z(])"
)
_FACTOR = re.compile(r"(?<=[\w)\]]) ([*/]) (?=[\w(-])|(?<=\w |\] )([*/])(?== )")
# Of whole numbers: between two real numbers, `<` and `<=` seldom differ.
_ORDER = re.compile(r"(?<= )([<>]=?)(?= (?:\d+u?\b(?!\.)|[A-Z_]{3,}|\w*count|\w*size|\w+->\w*count)\b)")
_ONE = re.compile(r"(?<=[\w)\]] [+-] )1u?\b(?!\.)|(?<=\w\[)\d\b|(?<== )0\b(?=; \w+ <)")
_NOTE = re.compile(
    r"^[ \t]*(?:(?!\.)[\w>.\[\]-]*(?:reason|flag|fault|status|lost|reject|mask|trouble|changed|implausible)[\w>.\[\]-]*"
    r" \|?= [^;{}]*;|\w[\w>.\[\]-]* \|= [^;{}]*;)",
    re.MULTILINE,
)
_CALL = re.compile(r"\b(?!if\b|for\b|while\b|switch\b|return\b|sizeof\b|offsetof\b)(\w+)\(")
_SAME_EITHER_WAY = re.compile(r"min|max|hypot|equal")


def code_only(text: str) -> str:
    """Comments, strings and directives as blanks, everything else at its place."""
    return _NO_CODE.sub(lambda hit: re.sub(r"[^\n]", " ", hit[0]), text)


def functions(text: str) -> list[tuple[str, int, int]]:
    """Name, begin and end of each."""
    return [(hit[1], hit.start(), hit.end()) for hit in _FUNCTION.finditer(code_only(text))]


def faults(text: str) -> Iterator[Found]:
    code = code_only(text)
    for name, begin, end in functions(text):
        body = code.index("{", begin)
        for hit in _SIGN.finditer(code, body, end):
            group = hit.lastindex or 0
            yield "sign", name, *hit.span(group), {"+": "-", "-": "" if group > 2 else "+"}[hit[group]]
        for hit in _FACTOR.finditer(code, body, end):
            group = hit.lastindex or 0
            yield "factor", name, *hit.span(group), {"*": "/", "/": "*"}[hit[group]]
        for hit in _ORDER.finditer(code, body, end):
            yield "off-by-one", name, *hit.span(), hit[0].removesuffix("=") if "=" in hit[0] else hit[0] + "="
        for hit in _ONE.finditer(code, body, end):
            yield "off-by-one", name, *hit.span(), re.sub(r"\d", lambda digit: str(int(digit[0]) + 1), hit[0])
        for hit in _NOTE.finditer(code, body, end):
            start = hit.end() - len(hit[0].lstrip())
            yield "dropped note", name, start, start, "if (0) "
        for hit in _CALL.finditer(code, body, end):
            if not _SAME_EITHER_WAY.search(hit[1]):
                for start, stop, new in _swapped(text, code, hit.end()):
                    yield "swapped argument", name, start, stop, new


def _swapped(text: str, code: str, begin: int) -> Iterator[tuple[int, int, str]]:
    """Each two neighbours of the arguments that begin there, as far as they stand in one line."""
    parts, start, depth = [], begin, 0
    for at in range(begin, code.index("\n", begin)):
        if code[at] in ",)" and depth == 0:
            parts.append((start + len(code[start:at]) - len(code[start:at].lstrip()), at))
            start = at + 1
        depth += {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}.get(code[at], 0)
        if depth < 0:
            break
    for (a, b), (c, d) in pairwise(parts):
        if text[a:b] != text[c:d] and (text[a] == "&") == (text[c] == "&"):  # the compiler finds the others
            yield a, d, text[c:d] + text[b:c] + text[a:b]
