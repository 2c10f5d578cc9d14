"""Which of the names that there are was meant by one that is not among them."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_ALIKE = 0.6  # of 1, as difflib has it; below it the names have little in common


def nearest(written: str, known: Iterable[str], count: int = 3) -> list[str]:
    """The names that are most like the one written, the best first; upper case, _ and blanks make no difference."""
    by_plain: dict[str, list[str]] = {}
    for name in known:
        by_plain.setdefault(_plain(name), []).append(name)
    alike = difflib.get_close_matches(_plain(written), by_plain, count, _ALIKE)
    return [name for plain in alike for name in by_plain[plain]][:count]


def did_you_mean(written: str, known: Iterable[str]) -> str:
    """As the end of an error message, "; did you mean YawRt?"; empty where nothing is alike."""
    names = nearest(written, known)
    return f"; did you mean {' or '.join(names)}?" if names else ""


def in_order_of_likeness(known: Iterable[str], wanted: Iterable[str]) -> list[str]:
    """All names, those first that are most like one of the wanted ones."""
    plain_wanted = [_plain(name) for name in wanted]
    matchers = [difflib.SequenceMatcher(b=plain) for plain in plain_wanted]

    def unlikeness(name: str) -> float:
        plain, most = _plain(name), 0.0
        for matcher in matchers:
            matcher.set_seq1(plain)
            most = max(most, matcher.ratio())
        return -most

    return sorted(known, key=unlikeness)


def _plain(name: str) -> str:
    return name.lower().replace("_", "").replace(" ", "")
