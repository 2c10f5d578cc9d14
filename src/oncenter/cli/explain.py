"""oncenter explain: the section of a code in docs/reference/findings.md, as plain text."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from typing import Annotated

import typer

from oncenter.cli.completion import explained_codes

PAGE = "docs/reference/findings.md"
_WIDTH = 100  # columns of text
_LIST_WIDTH = 120
_MEANING = "What it means: "
_CHAPTERS = {"finding": "Findings", "error": "Errors", "word of an answer": "Words of an answer"}  # by the page's order


@dataclass(frozen=True)
class Section:
    """The section of a code: `kind` is one of `_CHAPTERS`; `paragraphs` without markdown, the example indented."""

    code: str
    kind: str
    paragraphs: tuple[str, ...]

    def __str__(self) -> str:
        indents = ("  " if paragraph.startswith("  ") else "" for paragraph in self.paragraphs)
        wrapped = (
            textwrap.fill(paragraph.strip(), _WIDTH, initial_indent=indent, subsequent_indent=indent)
            for paragraph, indent in zip(self.paragraphs, indents, strict=True)
        )
        return "\n\n".join([f"{self.code} ({self.kind})", *wrapped])

    @property
    def summary(self) -> str:
        """The first sentence of its meaning."""
        meaning = next(paragraph for paragraph in self.paragraphs if paragraph.startswith(_MEANING))
        return re.split(r"(?<=\.) (?=[A-Z])", meaning.removeprefix(_MEANING))[0]


def explain(
    code: Annotated[
        str | None,
        typer.Argument(
            metavar="CODE",
            help="The code in brackets after a finding, the code of an error, or a word as converging. Without it, all "
            "codes are listed.",
            autocompletion=explained_codes,
        ),
    ] = None,
) -> None:
    """Explain a finding, an error, a status, a verdict or a reason: its meaning, its causes and the action for it."""
    from oncenter.errors import WRONG_USAGE, OncenterError
    from oncenter.nearest_name import did_you_mean

    sections = read_sections()
    if code is None:
        typer.echo(_listed(sections))
        return
    found = [section for section in sections if section.code == code]
    if not found:
        like = did_you_mean(code, dict.fromkeys(section.code for section in sections))
        advice = like or "; oncenter explain lists all codes"
        raise OncenterError(
            f"no finding, error or word of an answer has the code '{code}'{advice}",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    typer.echo("\n\n".join(map(str, found)))


def read_sections() -> list[Section]:
    """All sections of the page, in its order."""
    from oncenter.files.shipped import shipped

    page = shipped(PAGE).read_text(encoding="utf-8")
    chapters = re.split(r"\n# [^\n]+\n", f"\n{page}")[1:]
    return [
        _section(text, kind)
        for chapter, kind in zip(chapters, _CHAPTERS, strict=True)
        for text in chapter.split("\n## ")[1:]
    ]


def _section(text: str, kind: str) -> Section:
    code, *paragraphs = text.strip().split("\n\n")
    return Section(code, kind, tuple(map(_plain, paragraphs)))


def _plain(paragraph: str) -> str:
    """One line without markdown; a quotation is indented."""
    lines = paragraph.splitlines()
    indent = "  " if lines[0].startswith("> ") else ""
    return indent + re.sub(r"[`*]", "", " ".join(line.removeprefix("> ") for line in lines))


def _listed(sections: list[Section]) -> str:
    """A line per code, findings first."""
    width = max(len(section.code) for section in sections)
    lines = ["oncenter explain CODE prints all about one of them.", ""]
    for kind, title in _CHAPTERS.items():
        lines.append(title)
        for section in sections:
            if section.kind == kind:
                summary = textwrap.shorten(section.summary, _LIST_WIDTH - width - 4, placeholder=" …")
                lines.append(f"  {section.code:{width}}  {summary}")
        lines.append("")
    return "\n".join(lines).rstrip()
