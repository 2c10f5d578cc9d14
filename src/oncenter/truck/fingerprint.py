"""The fingerprint of a drive's signals: alike for a copy under another name or in another format, and for a part of it.

It has the smallest hashes of all short sequences of turns to the left and right, with the angle at them (Broder, On the
resemblance and containment of documents, Compression and Complexity of Sequences, 1997). A part of a drive has a share
of the same sequences.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oncenter.signals import Signals

Numbers = npt.NDArray[np.float64]
Hashes = npt.NDArray[np.uint64]

_YAW_RATE, _ANGLE = "yaw_rate_rad_s", "steering_wheel_angle_rad"
_SMOOTH_S = 0.5  # against noise, and against the place of a reader's grid
_TURNS_RAD_S = 0.003  # beyond it the truck turns to a side
_STEP_S = 0.05  # of the time from one turn to the next
_STEP_RAD = 0.01  # of the angle at a turn
_ROUNDED_RAD = 1e-6  # of a sample
_LENGTH = 4  # of these times after each other: no two drives share three of them with an angle, except by a copy
_HASHES, _HASHES_MIN = 32, 8
_DIGITS = 6  # hexadecimal, of each hash
_SHARED_MIN = 3  # by chance less than once in 10**10 pairs
_PRIMES = (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB)  # splitmix64


def fingerprint_of(drive: Signals) -> str:
    """Hexadecimal digits, the same number for each hash; empty without yaw rate or steering wheel angle. A drive with
    few turns has one hash, of its samples."""
    if not {_YAW_RATE, _ANGLE} <= drive.columns.keys():
        return ""
    width = max(round(_SMOOTH_S * drive.rate_hz), 1)
    yaw_rate, angle = (_smoothed(drive.columns[name], width) for name in (_YAW_RATE, _ANGLE))
    turns = _turns(yaw_rate)
    times = _rounded(np.diff(turns) / drive.rate_hz, _STEP_S)
    angles = _rounded(np.interp(turns, np.arange(len(angle)), angle), _STEP_RAD)
    hashes = np.unique(_mixed(_sequences(times, angles)))[:_HASHES]
    if len(hashes) < _HASHES_MIN:
        samples = _rounded(np.concatenate((yaw_rate, angle)), _ROUNDED_RAD)
        samples = samples + np.arange(len(samples), dtype=np.uint64) * np.uint64(_PRIMES[1])  # equal ones do not cancel
        hashes = np.array([np.bitwise_xor.reduce(_mixed(samples), initial=0)], np.uint64)
    return "".join(f"{int(each) % 16**_DIGITS:0{_DIGITS}x}" for each in _mixed(hashes))


def _smoothed(values: Numbers, width: int) -> Numbers:
    """Means of as many samples; what is not available counts as 0."""
    sums = np.cumsum(np.nan_to_num(values, posinf=0.0, neginf=0.0))
    return np.asarray((sums[width:] - sums[:-width]) / width)


def _turns(yaw_rate: Numbers) -> Numbers:
    """The places where the truck begins to turn to the other side, between two samples by interpolation."""
    turning = np.flatnonzero(np.abs(yaw_rate[1:]) > _TURNS_RAD_S) + 1
    sides = np.sign(yaw_rate[turning])
    begins = turning[1:][sides[1:] != sides[:-1]]
    after = np.abs(yaw_rate[begins])
    before = np.minimum(np.sign(yaw_rate[begins]) * yaw_rate[begins - 1], _TURNS_RAD_S)
    return np.asarray(begins - (after - _TURNS_RAD_S) / (after - before))


def _rounded(values: Numbers, step: float) -> Hashes:
    return np.asarray(np.round(values / step).astype(np.int64).astype(np.uint64))


def are_same(one: str, other: str) -> bool:
    """Whether both fingerprints are of one drive, or of a drive and a part of it."""
    return len(_hashes(one) & _hashes(other)) >= min(_SHARED_MIN, len(_hashes(one)) or 1)


def _hashes(fingerprint: str) -> set[str]:
    return {fingerprint[at : at + _DIGITS] for at in range(0, len(fingerprint), _DIGITS)}


@dataclass(frozen=True)
class Print:
    """A drive's fingerprint, its length, s, and its begin by its own clock, s; NaN where that is not comparable."""

    fingerprint: str
    length_s: float
    start_s: float

    def is_in(self, other: Print) -> bool:
        """Whether this drive is the other one or a part of it. Drives at different times are not."""
        begin = max(self.start_s, other.start_s)
        end = min(self.start_s + self.length_s, other.start_s + other.length_s)
        return are_same(self.fingerprint, other.fingerprint) and not begin >= end


def copies(drives: Sequence[Print]) -> dict[int, int]:
    """The drives that are copies or parts of another: place of each, and of the longer one; of equal ones the first
    stays."""
    found: dict[int, int] = {}
    with_hash: dict[str, list[int]] = {}
    for place in sorted(range(len(drives)), key=lambda k: (-drives[k].length_s, k)):
        hashes = _hashes(drives[place].fingerprint)
        others = sorted({other for each in hashes for other in with_hash.get(each, ())})
        whole = next((k for k in others if drives[place].is_in(drives[k])), None)
        if whole is not None:
            found[place] = whole
            continue
        for each in hashes:
            with_hash.setdefault(each, []).append(place)
    return found


def _sequences(times: Hashes, angles: Hashes) -> Hashes:
    """A polynomial hash of each `_LENGTH` successive times, and of the angle before them."""
    count = max(len(times) - _LENGTH + 1, 0)
    total = _mixed(angles[:count])
    for k in range(_LENGTH):
        total = total * np.uint64(_PRIMES[0]) + _mixed(times[k : k + count])
    return total


def _mixed(values: Hashes) -> Hashes:
    """Splitmix64 (Steele, Lea and Flood, Fast splittable pseudorandom number generators, OOPSLA 2014)."""
    mixed = values + np.uint64(_PRIMES[0])
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(_PRIMES[1])
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(_PRIMES[2])
    return mixed ^ (mixed >> np.uint64(31))
