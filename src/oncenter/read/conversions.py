"""From stored to physical values: the conversion blocks of MDF 3 and 4, with numpy.

A block's fields come from the file. asammdf parses the blocks; nothing in a block is run as code.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter.read import formula
from oncenter.read.frames import Column

MAX_NESTED = 8  # levels of tables that refer to other conversions
_Index = npt.NDArray[np.intp]


class UnknownConversion(ValueError):
    """An unsupported conversion; the text says which."""


class NoNumbers(Exception):
    """The channel contains text, a structure or an array."""


def physical(block: Any, raw: npt.NDArray[Any]) -> Column:
    """Physical values, NaN where the conversion gives no finite number, e.g. text.

    Args:
        block: a `ChannelConversion` of asammdf, of MDF 4 or 3, or None for raw values as they are.
        raw: as stored.

    Raises:
        NoNumbers: raw values are not one number each, or the conversion gives text only.
        UnknownConversion: of an unsupported kind, formula or table.
    """
    if raw.ndim != 1 or raw.dtype.kind not in "iufb":
        raise NoNumbers
    with np.errstate(all="ignore"):
        values = _converted(block, raw.astype(np.float64), raw.dtype.kind != "f", 0)
        values[~np.isfinite(values)] = np.nan
    return values


def _converted(block: Any, x: Column, whole: bool, nested: int) -> Column:
    """Converts raw values x. `whole`: they are integers, whose ranges include the upper end."""
    if block is None:
        return x
    if nested > MAX_NESTED:
        raise UnknownConversion(f"conversions nested deeper than {MAX_NESTED}")
    mdf4 = block.id == b"##CC"
    kind = int(block.conversion_type)
    convert = (_MDF_4 if mdf4 else _MDF_3).get(kind)
    if convert is not None:
        return convert(block, x)
    if mdf4 and kind in (7, 8):
        return _referred(block, x, whole, nested)
    if mdf4 and kind == 6:
        return _value_of_range(block, x, whole)
    if not mdf4 and kind == 12:
        return _text_of_range(block, x, whole)
    if kind in ((9, 10, 11) if mdf4 else (11, 132, 133)):  # from or to text, bit fields; date and time
        raise NoNumbers
    raise UnknownConversion(f"kind {kind} of conversion")


def _same(block: Any, x: Column) -> Column:
    return x


def _linear(block: Any, x: Column) -> Column:
    a, b = np.float64(block.a), np.float64(block.b)
    return x * a + b


def _rational(block: Any, x: Column) -> Column:
    p1, p2, p3, p4, p5, p6 = _parameters(block, 6)
    return (p1 * x**2 + p2 * x + p3) / (p4 * x**2 + p5 * x + p6)


def _polynomial(block: Any, x: Column) -> Column:
    p1, p2, p3, p4, p5, p6 = _parameters(block, 6)
    shifted = x - p5 - p6
    return (p2 - p4 * shifted) / (p3 * shifted - p1)


def _exponential(block: Any, x: Column) -> Column:
    """Kind 7: its parameters describe physical to raw, so raw to physical is the logarithm.

    The readers of openATFX, mdfr and asammdf up to 7.2 agree; later asammdf uses the exponential here.
    """
    return _by_inverse(np.log, block, x)


def _logarithmic(block: Any, x: Column) -> Column:
    return _by_inverse(np.exp, block, x)


def _by_inverse(function: np.ufunc, block: Any, x: Column) -> Column:
    p1, p2, p3, p4, p5, p6, p7 = _parameters(block, 7)
    if p4 == 0:
        return np.asarray(function(((x - p7) * p6 - p3) / p1) / p2)
    if p1 == 0:
        return np.asarray(function((p3 / (x - p7) - p6) / p4) / p5)
    return np.full(len(x), np.nan)


def _algebraic_4(block: Any, x: Column) -> Column:
    return _by_formula(block.formula, x)


def _algebraic_3(block: Any, x: Column) -> Column:
    # asammdf's `formula` replaces each x by X1, even the x of `exp`.
    return _by_formula(block.formula_field.split(b"\0")[0].decode("latin-1"), x)


def _by_formula(text: str, x: Column) -> Column:
    try:
        return formula.parse(text)(x)
    except formula.FormulaError as error:
        raise UnknownConversion(f"formula {shown(text)} {error}; allowed are {formula.SYNTAX}") from None


def _interpolated(block: Any, x: Column) -> Column:
    keys, values = _pairs(block)
    return np.interp(x, keys, values)


def _nearest(block: Any, x: Column) -> Column:
    """The value of the nearest key; midway between two, of the lower one."""
    keys, values = _pairs(block)
    upper = np.minimum(np.searchsorted(keys, x), len(keys) - 1)
    lower = np.maximum(upper - 1, 0)
    nearest = np.where(np.abs(x - keys[upper]) >= np.abs(x - keys[lower]), values[lower], values[upper])
    return np.where(np.isnan(x), np.nan, nearest)


def _pairs(block: Any) -> tuple[Column, Column]:
    """Keys and values, ascending; an unordered or empty table is invalid."""
    count = block.val_param_nr // 2 if block.id == b"##CC" else block.ref_param_nr
    keys, values = _fields(block, "raw", count), _fields(block, "phys", count)
    if not count or not (np.diff(keys) >= 0).all() or np.isnan(keys).any():
        raise UnknownConversion("a table without keys in ascending order")
    return keys, values


def _value_of_range(block: Any, x: Column, whole: bool) -> Column:
    count = (block.val_param_nr - 1) // 3
    index = _range_of(block, count, x, whole)
    return np.append(_fields(block, "phys", count), block.default)[index]  # -1 is the last


def _text_of_range(block: Any, x: Column, whole: bool) -> Column:
    """MDF 3: texts for values within the ranges; outside, CANape writes a formula as `"0.5*{X}+1"`."""
    default = block.referenced_blocks.get("default_addr") or b""
    if b"{X}" not in default or default.count(b'"') < 2:
        raise NoNumbers
    outside = _range_of(block, block.ref_param_nr - 1, x, whole) < 0
    values = _by_formula(default.decode("latin-1").split('"')[1].replace("{X}", "X"), x)
    return np.where(outside, values, np.nan)


def _range_of(block: Any, count: int, x: Column, whole: bool) -> _Index:
    """Index of the range that contains each value, or -1. A range of integers includes its upper end."""
    lower, upper = _fields(block, "lower", count), _fields(block, "upper", count)
    in_order = np.lexsort((upper, lower))
    lower, upper = lower[in_order], upper[in_order]
    if not ((lower <= upper).all() and (lower[1:] >= upper[:-1]).all()):
        raise UnknownConversion("a table of ranges that overlap")
    at = np.searchsorted(upper, x, side="left" if whole else "right")
    inside = at < count
    inside[inside] = lower[at[inside]] <= x[inside]
    return np.append(in_order, -1)[np.where(inside, at, -1)]


def _referred(block: Any, x: Column, whole: bool, nested: int) -> Column:
    """MDF 4: by value (kind 7) or range (8) a text, which gives NaN, or another conversion."""
    count = block.links_nr - 5  # less name, unit, comment, inverse and default
    index = _range_of(block, count, x, whole) if block.conversion_type == 8 else _key_of(block, count, x)
    targets = [block.referenced_blocks.get(f"text_{i}") for i in range(count)]
    targets.append(block.referenced_blocks.get("default_addr"))
    if not any(_is_block(target) for target in targets):
        raise NoNumbers
    values = np.full(len(x), np.nan)
    order = np.argsort(index, kind="stable")
    starts = np.flatnonzero(np.diff(index[order], prepend=-2))
    for rows in np.split(order, starts[1:]):
        target = targets[index[rows[0]]] if len(rows) else None
        if _is_block(target):
            try:
                values[rows] = _converted(target, x[rows], whole, nested + 1)
            except NoNumbers:
                continue
    return values


def _key_of(block: Any, count: int, x: Column) -> _Index:
    keys = _fields(block, "val", count)
    in_order = np.argsort(keys, kind="stable")
    at = np.searchsorted(keys[in_order], x)
    found = at < count
    found[found] = keys[in_order][at[found]] == x[found]
    return np.append(in_order, -1)[np.where(found, at, -1)]


def _is_block(target: Any) -> bool:
    return target is not None and not isinstance(target, bytes)


def _parameters(block: Any, count: int) -> list[np.float64]:
    """P1 and so on as numpy numbers: their division by zero raises no exception."""
    return [np.float64(getattr(block, f"P{i}")) for i in range(1, count + 1)]


def _fields(block: Any, name: str, count: int) -> Column:
    try:
        return np.array([getattr(block, f"{name}_{i}") for i in range(count)], np.float64)
    except AttributeError:
        raise UnknownConversion("a table shorter than its declared length") from None


_MDF_4: dict[int, Callable[[Any, Column], Column]] = {
    0: _same,
    1: _linear,
    2: _rational,
    3: _algebraic_4,
    4: _interpolated,
    5: _nearest,
}
_MDF_3: dict[int, Callable[[Any, Column], Column]] = {
    0: _linear,
    1: _interpolated,
    2: _nearest,
    6: _polynomial,
    7: _exponential,
    8: _logarithmic,
    9: _rational,
    10: _algebraic_3,
    65535: _same,
}


def shown(text: str) -> str:
    """Text from a file, short and printable."""
    return repr(text if len(text) <= 80 else f"{text[:77]}...")
