"""One-line faults that a Python file can have, found in its syntax tree.

Left out: comments, docstrings, annotations, and all outside functions.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator

Found = tuple[str, str, int, int, str]  # kind, function, start, end, new text

_NOTE = re.compile(r"note|finding|warning|reason|missing|complain|problem|remark|hint|from_table", re.IGNORECASE)
_GIVES_NOTE = re.compile(r"(^|\.)_?(add_)?(note|warn|remark)\w*$|from_table$|Finding$")
_ESCAPE = re.compile(r"(?<![\w.])(?:\w+\.)?(?:\w*escape|\w*quoted?)\(")
_TEXT_AS_JSON = re.compile(r"(?<=\{)json\.dumps\(|json\.dumps\((?=str\(|printable\()")
_SAME_EITHER_WAY = {"max", "min", "hypot", "maximum", "minimum", "isclose", "allclose", "isinstance", "add", "fmax"}
_ORDERS = {ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">")}
_SIGNS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+")}
_FACTORS = {ast.Mult: ("*", "/"), ast.Div: ("/", "*")}
_TEXT = (ast.JoinedStr, ast.List, ast.Tuple, ast.ListComp, ast.Dict, ast.Set)


def functions(text: str) -> list[tuple[str, int, int]]:
    """Name with those of its class and outer function, begin and end of each."""
    source = _Source(text)
    return [(name, *source.span(node)) for name, node in _named(ast.parse(text), "")]


def faults(text: str) -> Iterator[Found]:
    source = _Source(text)
    for name, function in _named(ast.parse(text), ""):
        nodes = list(_own_nodes(function))
        for node in nodes:
            for kind, find in (
                ("sign", _sign),
                ("factor", _factor),
                ("off-by-one", _off_by_one),
                ("dropped note", _dropped_note(bool(_NOTE.search(function.name)))),
                ("swapped argument", _swapped_argument),
            ):
                for start, end, new in find(node, source):
                    if start <= end and "\n" not in text[start:end]:
                        yield kind, name, start, end, new
        for start, end, new in _unescaped(function, source):
            yield "unescaped string", name, start, end, new


class _Source:
    """Places in the text from lines and bytes, as the syntax tree gives them."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._lines = text.splitlines(keepends=True)
        self._begins = [0]
        for line in self._lines:
            self._begins.append(self._begins[-1] + len(line))

    def _place(self, line: int, byte: int) -> int:
        return self._begins[line - 1] + len(self._lines[line - 1].encode()[:byte].decode())

    def span(self, node: ast.expr | ast.stmt) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return self._place(node.lineno, node.col_offset), self._place(node.end_lineno, node.end_col_offset)

    def of(self, node: ast.expr) -> str:
        start, end = self.span(node)
        return self.text[start:end]

    def operator(self, left: ast.expr, right: ast.expr, sign: str) -> tuple[int, int]:
        """Where the operator stands between its operands, brackets left out."""
        begin = self.span(left)[1]
        at = self.text.index(sign, begin, self.span(right)[0])
        return at, at + len(sign)


def _named(node: ast.AST, outer: str) -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef):
            yield outer + child.name, child
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield from _named(child, f"{outer}{child.name}.")
        elif isinstance(child, ast.If | ast.Try | ast.With):
            yield from _named(child, outer)


def _own_nodes(function: ast.FunctionDef | ast.AsyncFunctionDef) -> Iterator[ast.AST]:
    """Without functions and classes inside, annotations, and f-strings, whose parts have no exact places in 3.11."""
    waiting: list[ast.AST] = list(reversed(function.body))
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.JoinedStr):
            continue
        yield node
        skipped = node.annotation if isinstance(node, ast.AnnAssign) else None
        waiting += reversed([child for child in ast.iter_child_nodes(node) if child is not skipped])


def _is_number(node: ast.AST) -> bool:
    """Whether it is one by its form."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, int | float) and not isinstance(node.value, bool)
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, ast.Sub | ast.Pow) or _is_number(node.left) or _is_number(node.right)
    if isinstance(node, ast.UnaryOp):
        return isinstance(node.op, ast.USub)
    return isinstance(node, ast.Call) and bool(
        re.match(r"(np|math)\.|(len|float|int|abs|sum)$", ast.unparse(node.func))
    )


def _is_text(node: ast.AST) -> bool:
    if isinstance(node, ast.BinOp):
        return _is_text(node.left) or _is_text(node.right)
    return isinstance(node, _TEXT) or (isinstance(node, ast.Constant) and isinstance(node.value, str | bytes))


def _arithmetic(node: ast.AST) -> bool:
    """Of numbers: a path has a division too, a list a sum."""
    if not isinstance(node, ast.BinOp) or _is_text(node):
        return False
    return isinstance(node.op, ast.Sub | ast.Mult) or _is_number(node.left) or _is_number(node.right)


def _sign(node: ast.AST, source: _Source) -> Iterator[tuple[int, int, str]]:
    if isinstance(node, ast.BinOp) and type(node.op) in _SIGNS and _arithmetic(node):
        sign, other = _SIGNS[type(node.op)]
        yield *source.operator(node.left, node.right, sign), other
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and not isinstance(node.operand, ast.Constant):
        start, _ = source.span(node)
        yield start, source.span(node.operand)[0], ""
    if isinstance(node, ast.AugAssign) and type(node.op) in _SIGNS and not isinstance(node.value, ast.Name):
        sign, other = _SIGNS[type(node.op)]
        if _is_number(node.value):
            yield *source.operator(node.target, node.value, f"{sign}="), f"{other}="


def _factor(node: ast.AST, source: _Source) -> Iterator[tuple[int, int, str]]:
    if isinstance(node, ast.BinOp) and type(node.op) in _FACTORS and _arithmetic(node):
        sign, other = _FACTORS[type(node.op)]
        yield *source.operator(node.left, node.right, sign), other


def _off_by_one(node: ast.AST, source: _Source) -> Iterator[tuple[int, int, str]]:
    """Of whole numbers: between two real numbers, `<` and `<=` seldom differ."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _ORDERS:
        (other,) = node.comparators
        if any(_is_count(each) for each in (node.left, other)):
            order, wrong = _ORDERS[type(node.ops[0])]
            yield *source.operator(node.left, other, order), wrong
    if isinstance(node, ast.Subscript):
        for part in [node.slice] if not isinstance(node.slice, ast.Slice) else [node.slice.lower, node.slice.upper]:
            yield from _one_more(part, source)
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "range":
        for part in node.args:
            yield from _one_more(part, source)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub) and _is_whole(node.right):
        yield from _one_more(node.right, source)


def _is_whole(node: ast.AST | None) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) is int


def _is_count(node: ast.AST) -> bool:
    return _is_whole(node) or (isinstance(node, ast.Call) and ast.unparse(node.func) == "len")


def _one_more(node: ast.expr | None, source: _Source) -> Iterator[tuple[int, int, str]]:
    if isinstance(node, ast.Constant) and type(node.value) is int:
        yield *source.span(node), str(node.value + 1)


def _dropped_note(of_notes: bool) -> Callable[[ast.AST, _Source], Iterator[tuple[int, int, str]]]:
    """A statement that gives a note is skipped; `of_notes`: all that the function yields are notes."""

    def find(node: ast.AST, source: _Source) -> Iterator[tuple[int, int, str]]:
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Yield | ast.YieldFrom) and of_notes:
            start, _ = source.span(node)
            yield start, start, "if 0: "
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and _gives_note(node.value):
            start, _ = source.span(node)
            yield start, start, "if 0: "
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Call) and _gives_note(node.value):
            start, _ = source.span(node.value)
            yield start, start, "None and "

    return find


def _gives_note(call: ast.Call) -> bool:
    """Whether it adds to a list of notes, adds a finding to any list, or is named after a note."""
    name = ast.unparse(call.func)
    if isinstance(call.func, ast.Attribute) and call.func.attr in ("append", "extend"):
        added = [ast.unparse(each.func) for each in call.args if isinstance(each, ast.Call)]
        return any(_NOTE.search(each) for each in [ast.unparse(call.func.value), *added])
    return bool(_GIVES_NOTE.search(name))


def _swapped_argument(node: ast.AST, source: _Source) -> Iterator[tuple[int, int, str]]:
    if not isinstance(node, ast.Call) or ast.unparse(node.func).split(".")[-1] in _SAME_EITHER_WAY:
        return
    for one, two in zip(node.args, node.args[1:], strict=False):
        if _are_alike(one, two) and source.of(one) != source.of(two):
            start, end = source.span(one)[0], source.span(two)[1]
            between = source.text[source.span(one)[1] : source.span(two)[0]]
            yield start, end, source.of(two) + between + source.of(one)


def _are_alike(one: ast.expr, two: ast.expr) -> bool:
    """By their form: a type checker finds most others."""
    names = (ast.Name, ast.Attribute)
    return (isinstance(one, names) and isinstance(two, names)) or (
        type(one) is type(two) and isinstance(one, ast.Subscript | ast.BinOp | ast.UnaryOp | ast.Call)
    )


def _unescaped(function: ast.FunctionDef | ast.AsyncFunctionDef, source: _Source) -> Iterator[tuple[int, int, str]]:
    """By text, for most escapes stand in f-strings; an escape is replaced by its argument."""
    body = function.body[1:] if ast.get_docstring(function) else function.body
    begin, end = source.span(body[0])[0] if body else source.span(function)[1], source.span(function)[1]
    for pattern in (_ESCAPE, _TEXT_AS_JSON):
        for hit in pattern.finditer(source.text, begin, end):
            line_end = source.text.index("\n", hit.end())
            for stop in range(hit.end(), line_end + 1):
                argument = _only_text(source.text[hit.start() : stop])
                if argument is not None:
                    yield hit.start(), stop, argument
                    break


def _only_text(call: str) -> str | None:
    try:
        tree = ast.parse(call, mode="eval").body
    except SyntaxError:
        return None
    return ast.get_source_segment(call, tree.args[0]) if isinstance(tree, ast.Call) and tree.args else None
