"""Writes the table of docs/formats.md from the table of formats: run it after a change of it.

Usage: .venv/bin/python docs/make_formats.py
"""

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

from oncenter.files.log_formats import FORMATS, Format

PAGE = Path(__file__).with_name("formats.md")
BEGIN, END = "<!-- formats: written by docs/make_formats.py -->", "<!-- formats: end -->"
SIGNALS = {  # by content: where a signal comes from
    "frames": "J1939, or `dbc`",
    "frames and channels": "J1939, `dbc`, or channels by name",
    "columns": "columns by name",
    "variables": "variables by name",
    "fields": "fields of topics by name",
}


def cells(row: Format) -> tuple[str, ...]:
    """All but the suffixes."""
    needs = f"`oncenter[{row.extra}]`" if row.extra else "–"
    return row.origin, needs, SIGNALS[row.content], row.limits or "–"


def table() -> Iterator[str]:
    """Neighbours that differ in nothing but the suffix share a row."""
    yield "| files | of | needs | signals by | limits |"
    yield "|---|---|---|---|---|"
    for shared, rows in groupby(FORMATS, cells):
        yield f"| {' '.join(f'`{suffix}`' for row in rows for suffix in row.suffixes)} | {' | '.join(shared)} |"
    own = "your own logger ([examples](../examples/README.md))"
    yield f"| any other, by a plug-in | {own} | the plug-in | columns by name | – |"


def made() -> dict[Path, str]:
    """The text of the page."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    return {PAGE: f"{before}{BEGIN}\n\n" + "\n".join(table()) + f"\n\n{END}{after}"}


if __name__ == "__main__":
    for path, text in made().items():
        path.write_text(text, encoding="utf-8", newline="\n")
