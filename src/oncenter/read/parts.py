"""A signal that its values do not give by themselves: a magnitude whose sign is another signal, a coarse value and its
fraction, a status by its codes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.nearest_name import did_you_mean
from oncenter.read.frames import Column
from oncenter.read.units import unit_key
from oncenter.signals import STATUSES, SignalName


def parts_of(entry: SignalName) -> dict[str, str]:
    """The further names of a `[signals]` entry by their keys, `sign_by` and `plus`."""
    return {key: name for key, name in (("sign_by", entry.sign_by), ("plus", entry.plus)) if name is not None}


def combined(values: Column, plus: Column | None, sign: Column | None) -> Column:
    """The whole signal: where `sign` is not zero it is negative, where a part is NaN it is NaN."""
    whole = values if plus is None else values + plus
    if sign is None:
        return whole
    signed = np.where(sign != 0.0, -whole, whole)
    signed[np.isnan(sign)] = np.nan
    return signed


def as_status(signal: str, values: Column, true_when: Iterable[float] | None) -> Column:
    """A status as 1 and 0: true where the value is one of `true_when`, else false. Without them 1 is true, 0 is false,
    and other values are not available. Other signals are as they are."""
    if signal not in STATUSES:
        return values
    if true_when is None:
        return np.where((values == 0.0) | (values == 1.0), values, np.nan)
    is_true = np.zeros(len(values), bool)
    for value in true_when:
        is_true |= np.isclose(values, value, rtol=1e-6, atol=1e-9)  # 3 times a factor of 0.1 is not the number 0.3
    return np.where(np.isnan(values), np.nan, is_true)


def true_numbers(signal: str, entry: SignalName | None, by_name: Mapping[str, float], where: str) -> list[float] | None:
    """The values of a true status as numbers; None where `[signals]` does not give them.

    Args:
        by_name: the values of the names that the database gives.
        where: the signal and its file, for messages.

    Raises:
        OncenterError: "missing_part", exit code 2: the database has no such name.
    """
    if entry is None or entry.true_when is None:
        return None
    for value in entry.true_when:
        if isinstance(value, str) and value not in by_name:
            named = f"; its names are {', '.join(map(repr, by_name))[:200]}" if by_name else ": give its number"
            raise OncenterError(
                f"[signals] {signal}: true_when = {value!r} is not the name of a value of {where}"
                f"{did_you_mean(value, by_name) or named}",
                code="missing_part",
                exit_code=WRONG_USAGE,
                needs=(signal,),
            )
    return [by_name[value] if isinstance(value, str) else value for value in entry.true_when]


def unit_of_plus(signal: str, entry: SignalName, unit: str, written: str, of_main: str, known: dict[str, float]) -> str:
    """The unit of the `plus` part: its own in the file; without one, or with the same text, that of the main part.

    Args:
        unit: of the main part, a key of `known`.
        written: in the file, of the `plus` part.
        of_main: in the file, of the main part.

    Raises:
        OncenterError: "unknown_unit", exit code 2: another text that is not a unit of the signal.
    """
    own = unit_key(written, known) if written else unit
    if own is None and written == of_main:
        return unit
    if own is None:
        raise OncenterError(
            f"[signals] {signal}: plus = {entry.plus!r} has unit {written!r}, expected {' or '.join(known)}",
            code="unknown_unit",
            exit_code=WRONG_USAGE,
            needs=(signal,),
        )
    return own


def missing_part(signal: str, key: str, name: str, where: str, there: Iterable[str]) -> OncenterError:
    """The error for a part that is not there: without it the values would be wrong."""
    return OncenterError(
        f"[signals] {signal}: {key} = {name!r} does not exist in {where}{did_you_mean(name, there)}",
        code="missing_part",
        exit_code=WRONG_USAGE,
        needs=(signal,),
    )
