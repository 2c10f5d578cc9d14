"""Evaluates the formula of an algebraic conversion, text from a log, without running it as code.

    sum      = product {("+" | "-") product}
    product  = signed {("*" | "/") signed}
    signed   = ("+" | "-") signed | power
    power    = atom [("^" | "**") signed]
    atom     = number | "X" | "X1" | "(" sum ")" | function "(" sum {"," sum} ")"

Case is ignored: asammdf replaces each x of a formula by X, even the x of `exp`.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

from oncenter.read.frames import Column

MAX_LENGTH = 1000  # characters; a bit field's formula of 32 terms has some 400
MAX_DEPTH = 32  # of nested parentheses, signs and powers: limits the columns held in memory
SYNTAX = "numbers, X, + - * / ^, parentheses, sin, cos, tan, exp, log, log10, sqrt, abs, pow"
# The functions of an ASAM MCD-2 MC formula, which MDF refers to, and their other names in numexpr and asammdf.
# `log` is the natural logarithm.
FUNCTIONS: dict[str, np.ufunc] = {
    "abs": np.fabs,
    "fabs": np.fabs,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "ln": np.log,
    "log": np.log,
    "log10": np.log10,
    "pow": np.power,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "arcsin": np.arcsin,
    "arccos": np.arccos,
    "arctan": np.arctan,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
}
_OPERATORS: dict[str, np.ufunc] = {
    "+": np.add,
    "-": np.subtract,
    "*": np.multiply,
    "/": np.divide,
    "^": np.power,
    "**": np.power,
}
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)|(?P<name>[a-z_]\w*)|(?P<sign>\*\*|[-+*/^(),]))",
    re.ASCII | re.IGNORECASE,
)
_Value = np.float64 | Column
_Step = Callable[[list[_Value], Column], None]


class FormulaError(ValueError):
    """A formula outside the grammar; the text continues a sentence "the formula ..."."""


def parse(text: str) -> Callable[[Column], Column]:
    """The formula as a function of the raw values: float64, NaN or inf where it is undefined.

    Raises:
        FormulaError: longer or deeper than the bounds above, or outside the grammar.
    """
    steps = _Parser(text).steps

    def values(x: Column) -> Column:
        stack: list[_Value] = []
        with np.errstate(all="ignore"):
            for step in steps:
                step(stack, x)
        return np.array(np.broadcast_to(stack.pop(), x.shape), np.float64)

    return values


class _Parser:
    """Recursive descent that emits steps for a stack machine, so that evaluation does not recurse."""

    def __init__(self, text: str) -> None:
        if len(text) > MAX_LENGTH:
            raise FormulaError(f"is longer than {MAX_LENGTH} characters")
        self.steps: list[_Step] = []
        self._tokens = _tokens(text)
        self._depth = 0
        self._sum()
        if self._tokens[0] != "":
            raise self._unexpected()

    def _sum(self) -> None:
        self._product()
        while (sign := self._taken("+", "-")) is not None:
            self._product()
            self._apply(_OPERATORS[sign])

    def _product(self) -> None:
        self._signed()
        while (sign := self._taken("*", "/")) is not None:
            self._signed()
            self._apply(_OPERATORS[sign])

    def _signed(self) -> None:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise FormulaError(f"is nested deeper than {MAX_DEPTH}")
        sign = self._taken("+", "-")
        if sign is None:
            self._power()
        else:
            self._signed()
        if sign == "-":
            self._apply(np.negative)
        self._depth -= 1

    def _power(self) -> None:
        self._atom()
        if (sign := self._taken("^", "**")) is not None:
            self._signed()
            self._apply(_OPERATORS[sign])

    def _atom(self) -> None:
        if self._taken("(") is not None:
            self._sum()
            self._expect(")")
            return
        token = self._tokens[0]
        if token in ("x", "x1"):
            self.steps.append(lambda stack, x: stack.append(x))
        elif token in FUNCTIONS:
            self._function(FUNCTIONS[token])
            return
        elif token[:1].isdigit() or token[:1] == ".":
            number = np.float64(token)
            self.steps.append(lambda stack, x: stack.append(number))
        else:
            raise self._unexpected()
        self._tokens.pop(0)

    def _function(self, function: np.ufunc) -> None:
        self._tokens.pop(0)
        self._expect("(")
        self._sum()
        for _ in range(function.nin - 1):
            self._expect(",")
            self._sum()
        self._expect(")")
        self._apply(function)

    def _apply(self, function: np.ufunc) -> None:
        count = function.nin

        def step(stack: list[_Value], x: Column) -> None:
            arguments = stack[-count:]
            del stack[-count:]
            stack.append(function(*arguments))

        self.steps.append(step)

    def _taken(self, *wanted: str) -> str | None:
        return self._tokens.pop(0) if self._tokens[0] in wanted else None

    def _expect(self, sign: str) -> None:
        if self._taken(sign) is None:
            raise self._unexpected(f", expected {sign!r}")

    def _unexpected(self, instead: str = "") -> FormulaError:
        token = self._tokens[0]
        return FormulaError(f"{f'has an error at {token[:20]!r}' if token else 'ends too early'}{instead}")


def _tokens(text: str) -> list[str]:
    """Tokens in lower case; an empty one marks the end."""
    tokens, at = [], 0
    text = text.rstrip()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise FormulaError(f"has an error at {text[at:].lstrip()[:1]!r}")
        tokens.append(match[match.lastgroup or 0].lower())
        at = match.end()
    return [*tokens, ""]
