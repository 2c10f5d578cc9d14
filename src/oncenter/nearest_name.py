"""The existing names most similar to a name that does not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_SIMILARITY_MIN = 0.6  # of 1, by difflib's ratio


def nearest(written: str, known: Iterable[str], count: int = 3) -> list[str]:
    """The most similar names, the best first; case, _ and blanks do not count."""
    by_plain: dict[str, list[str]] = {}
    for name in known:
        by_plain.setdefault(_plain(name), []).append(name)
    alike = difflib.get_close_matches(_plain(written), by_plain, count, _SIMILARITY_MIN)
    return [name for plain in alike for name in by_plain[plain]][:count]


def did_you_mean(written: str, known: Iterable[str]) -> str:
    """The end of an error message, "; did you mean YawRt?"; empty if no name is similar."""
    names = nearest(written, known)
    return f"; did you mean {' or '.join(names)}?" if names else ""


def in_order_of_likeness(known: Iterable[str], wanted: Iterable[str]) -> list[str]:
    """All names, those most similar to a wanted one first."""
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
