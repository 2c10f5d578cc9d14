"""A result line of bench/angle.py, and lines as text or as tables of a page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

BEGIN, END = "<!-- bench/angle.py --page -->", "<!-- end -->"


@dataclass(frozen=True)
class Line:
    """`met` is None without a requirement."""

    what: str
    estimator: str
    found: str
    required: str = ""
    met: bool | None = None

    def __str__(self) -> str:
        verdict = "" if self.met is None else f"  [{self.required}: {'met' if self.met else 'MISSED'}]"
        return f"{self.what:24}{self.estimator:22}{self.found}{verdict}"


def write_tables(page: Path, sections: Mapping[str, Iterable[Line]]) -> None:
    """Writes the tables between the two marks of the page; tables of other sections stay unchanged."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    stood, after = rest.split(END)
    tables = {part.split("\n", 1)[0]: f"### {part.strip()}" for part in stood.split("### ")[1:]}
    tables |= {title: _table(title, list(lines)) for title, lines in sections.items()}
    text = "\n\n".join(tables.values())
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def _table(title: str, lines: list[Line]) -> str:
    by_estimator = any(line.estimator for line in lines)
    asks = any(line.required for line in lines)
    heads = ["", *(["Estimator"] if by_estimator else []), "Found", *(["Asked"] if asks else [])]
    rows = [
        [
            line.what,
            *([line.estimator] if by_estimator else []),
            line.found,
            *([f"{line.required}: {'met' if line.met else '**missed**'}" if line.required else ""] if asks else []),
        ]
        for line in lines
    ]
    text = "\n".join(f"| {' | '.join(row)} |" for row in [heads, ["---"] * len(heads), *rows])
    return f"### {title}\n\n{text}"
