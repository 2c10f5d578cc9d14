"""Parts of a page that several commands write: sections of docs/accuracy.md, and what stands between two marks."""

from __future__ import annotations

from collections.abc import Sequence

EFFECTS = "## Real-truck effects"  # bench/effects.py
TWO_PARTS = "## Both parts of the interval"  # bench/two_parts.py
COMPARE = "## Before and after a repair"  # bench/compare.py


def section_of(page: str, heading: str) -> str:
    """A section from its heading to the next one of the same level or the end; "" if missing."""
    lines = page.splitlines()
    if heading not in lines:
        return ""
    begin = lines.index(heading)
    return "\n".join(lines[begin : _end(lines, begin)]).strip()


def with_section(page: str, section: str) -> str:
    """The page with this section in place of the old one, else at the end; "" leaves the page unchanged."""
    if not section:
        return page
    lines, heading = page.splitlines(), section.splitlines()[0]
    begin = lines.index(heading) if heading in lines else len(lines)
    parts = ("\n".join(lines[:begin]), section, "\n".join(lines[_end(lines, begin) :]))
    return "\n\n".join(part.strip() for part in parts if part.strip()) + "\n"


def between(page: str, begin: str, end: str, written: str) -> str:
    """The page with this text between its two marks, of which a missing one is a `ValueError`."""
    above = page.index(begin) + len(begin)
    return f"{page[:above]}\n{written}\n{page[page.index(end, above) :]}"


def _end(lines: Sequence[str], begin: int) -> int:
    later = range(begin + 1, len(lines))
    return next((k for k in later if lines[k].startswith("## ")), len(lines))
