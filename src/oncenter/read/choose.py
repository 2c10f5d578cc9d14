"""Selects the source of a signal when several have it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from oncenter.account import WORDS
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.read.samples import Samples
from oncenter.signals import ACCELERATION, ANGLE, ANGULAR_RATE, DEGREE, SIGNALS, TORQUE, Source, in_words, shown_unit

DISAGREE = "sources_disagree"  # code of the error

# Above these differences in SI two sources of the same rank contradict each other: of the medians, which a constant
# difference moves, and of the single values, which a reversed sign moves. 0.3 deg of the angle is three times the
# measurement scatter of a drive (docs/accuracy.md). A yaw rate of 0.1 deg/s is 0.36 deg of the angle at 20 m/s, by
# i L r / v with i 19.3 and L 3.71 m; VDC2 has steps of 0.028 deg/s. An acceleration of 0.04 m/s^2 is 0.3 deg, by
# i K_us of 7.7 deg/(m/s^2), but the roll of the frame under two sensors differs by as much: 0.1 m/s^2. A speed of
# 0.5 m/s is half of the worst scale error of Table 1 at 20 m/s.
_CONSTANT = {
    ANGLE.unit: 0.3 * DEGREE,
    ANGULAR_RATE.unit: 0.1 * DEGREE,
    "m_s": 0.5,
    ACCELERATION.unit: 0.1,
    TORQUE.unit: 0.5,
    "1": 0.5,
}
_SINGLE = {
    ANGLE.unit: 1.0 * DEGREE,
    ANGULAR_RATE.unit: 0.5 * DEGREE,
    "m_s": 0.5,
    ACCELERATION.unit: 0.5,
    TORQUE.unit: 0.5,
    "1": 0.5,
}


# Signals that decide the result: if their sources disagree, the user must choose one. Other signals are left out then.
_NEEDED = (
    "steering_wheel_angle",
    "steering_wheel_angle_sensor_type",  # decides whether whole turns are removed
    "yaw_rate",
    "vehicle_speed",
    "lateral_acceleration",
)

_AS_MANY = 0.9  # of the best source's valid samples count as equal, so that a single frame does not decide


def choose(
    candidates: Sequence[Samples], take: Mapping[str, str], log: str, notes: list[str]
) -> tuple[list[Samples], dict[str, Source]]:
    """One source per signal: the one in `take`, else by rank, then the lowest address among those with about as many
    valid samples as the best. A signal that is not needed is left out if its sources disagree.

    Raises:
        OncenterError: "sources_disagree": two sources of the same rank disagree about a needed signal and `take` gives
            none; "unknown_source": a source in `take` does not exist.
    """
    _refuse_unknown(candidates, take, log)
    chosen, sources = [], {}
    for signal in SIGNALS:
        having = [samples for samples in candidates if samples.signal == signal]
        if not having:
            continue
        numbered = [samples for samples in having if samples.not_available < len(samples.values)]
        if not numbered:
            notes.append(f"{signal}: no valid sample in {', '.join(map(_without_number, having))}")
            continue
        try:
            best = _named(numbered, signal, take, log) or _first(numbered, signal, log, candidates)
        except OncenterError as disagreement:
            if disagreement.code != DISAGREE or signal in _NEEDED:
                raise
            notes.append(f"{signal}: left out, {disagreement}")
            continue
        chosen.append(best)
        sources[signal] = _source(best, having)
    return chosen, sources


def _without_number(samples: Samples) -> str:
    """The source with the reasons, "VDC2 from 0x3E (all 3600 samples: the sender marks them as not available)"."""
    if not samples.lost:
        return samples.description
    by_count = sorted(samples.lost.items(), key=lambda lost: -lost[1])
    which = "all " if len(by_count) == 1 else ""
    reasons = "; ".join(f"{which}{count} samples: {WORDS[reason][0]}" for reason, count in by_count)
    return f"{samples.description} ({reasons})"


def without_number(candidates: Sequence[Samples]) -> list[tuple[Samples, Source]]:
    """The source that would be used of each signal without any valid sample so far."""
    given = []
    for signal in SIGNALS:
        having = [samples for samples in candidates if samples.signal == signal]
        if having and all(samples.not_available == len(samples.values) for samples in having):
            best = min(having, key=_order)
            given.append((best, _source(best, having)))
    return given


def _source(best: Samples, having: Sequence[Samples]) -> Source:
    others = sorted((samples for samples in having if samples is not best), key=_order)
    return Source(
        best.description,
        best.rate_hz,
        len(best.values),
        best.not_available,
        tuple(samples.description for samples in others),
        best.place,
    )


def _order(samples: Samples) -> tuple[int, int, int]:
    address = 256 if samples.address is None else samples.address
    return samples.rank, -(len(samples.values) - samples.not_available), address


def _matches(samples: Samples, named: str) -> bool:
    """Whether `named` is the description, an address, a message, or both of these."""
    wanted = named.lower().split()
    if named.lower() == samples.description.lower():
        return True
    words = {*samples.labels, *([str(samples.address)] if samples.address is not None else [])}
    return bool(wanted) and all(_as_address(word) in words for word in wanted if word not in ("from", "on"))


def _as_address(word: str) -> str:
    """0x3e for 0x3E and 0x003e; other words unchanged."""
    try:
        return f"0x{int(word, 16):02x}" if word.startswith("0x") else word
    except ValueError:
        return word


def refuse_unknown_signals(take: Mapping[str, str]) -> None:
    """
    Raises:
        OncenterError: "unknown_source": a source is given for a signal that does not exist.
    """
    for signal, named in take.items():
        if signal != "all" and signal not in SIGNALS:
            raise OncenterError(
                f"--source {signal}={named}: no such signal, available are {', '.join(SIGNALS)}",
                code="unknown_source",
                exit_code=WRONG_USAGE,
            )


def _refuse_unknown(candidates: Sequence[Samples], take: Mapping[str, str], log: str) -> None:
    refuse_unknown_signals(take)
    for signal, named in take.items():
        having = [samples for samples in candidates if signal in ("all", samples.signal)]
        if not any(_matches(samples, named) for samples in having):
            there = ", ".join(dict.fromkeys(samples.description for samples in having)) or "none"
            raise OncenterError(
                f"--source {signal}={named}: no such source in {log}, available are: {there}",
                code="unknown_source",
                exit_code=WRONG_USAGE,
                needs=() if signal == "all" else (signal,),
            )


def _named(having: Sequence[Samples], signal: str, take: Mapping[str, str], log: str) -> Samples | None:
    named = take.get(signal) or take.get("all")
    if named is None:
        return None
    matching = [samples for samples in having if _matches(samples, named)]
    if not matching and signal in take:
        raise OncenterError(
            f"--source {signal}={named}: that source has no valid sample in {log}",
            code="missing_signal",
            needs=(signal,),
        )
    return _first(matching, signal, log, having) if matching else None


def _first(having: Sequence[Samples], signal: str, log: str, every: Sequence[Samples]) -> Samples:
    """
    Args:
        every: sources of the signal, among which the one that the message proposes has to be unique.
    """
    best = _best(having)
    for other in sorted(having, key=_order):
        difference = _difference(best, other) if other is not best and other.rank == best.rank else None
        if difference is not None:
            choices = " or ".join(_quoted(f"{signal}={_unique(each, every)}") for each in (best, other))
            raise OncenterError(
                f"{best.description} and {other.description} disagree about {signal} in {log}, {difference}: "
                f"choose one with --source {choices}",
                code=DISAGREE,
                needs=(signal,),
            )
    return best


def _best(having: Sequence[Samples]) -> Samples:
    first = min(having, key=_order)
    numbers = len(first.values) - first.not_available
    near = [s for s in having if s.rank == first.rank and len(s.values) - s.not_available >= _AS_MANY * numbers]
    return min(near, key=lambda samples: (_order(samples)[-1], *_order(samples)))


def _unique(samples: Samples, every: Sequence[Samples]) -> str:
    """The shortest name in `take` that no other source has."""
    address = [] if samples.address is None else [f"0x{samples.address:02X}"]
    of = [one for one in every if one.signal == samples.signal]
    return next((name for name in address if sum(_matches(one, name) for one in of) == 1), samples.description)


def _quoted(pair: str) -> str:
    """Quoted for a shell if it has a blank."""
    return f'"{pair}"' if " " in pair else pair


def _difference(one: Samples, other: Samples) -> str | None:
    """The difference at common times in words, if it is larger than noise and zero errors; else None."""
    quantity = SIGNALS[one.signal].quantity
    number = ~np.isnan(other.values)
    own = ~np.isnan(one.values)
    if quantity.unit not in _CONSTANT or number.sum() < 2 or own.sum() < 2:
        return None
    time, values = other.time[number], other.values[number]
    both = own & (one.time >= time[0]) & (one.time <= time[-1])
    if not both.any():
        return None
    order = np.argsort(time, kind="stable")
    at = np.interp(one.time[both], time[order], values[order])
    constant = float(np.median(one.values[both] - at))
    single = float(np.median(np.abs(one.values[both] - at)))
    if abs(constant) <= _CONSTANT[quantity.unit] and single <= _SINGLE[quantity.unit]:
        return None
    unit = shown_unit(quantity)
    values_of = [float(np.median(given)) / quantity.factors[unit] for given in (one.values[both], at)]
    by = (constant if abs(constant) > _CONSTANT[quantity.unit] else single) / quantity.factors[unit]
    words = f" {in_words(unit)}".rstrip()
    return f"by {abs(by):.2f}{words} (medians {values_of[0]:.2f} and {values_of[1]:.2f}{words})"
