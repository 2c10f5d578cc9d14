"""What a figure group gives: figures and tables, each with the thesis's numbers beside ours.

Colours are few. Those of ink and paper become the page's own where a figure stands in the page, so that it reads in
light and dark; so axes, text and reference lines use INK, MUTED and GRID, and never black or white.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Progress = Callable[[float], None]  # takes the fraction done, 0 to 1

INK = "#16191d"  # axes, text, outlines
MUTED = "#5b626b"  # what is measured, or only for comparison
GRID = "#dfe2e6"
PAPER = "#ffffff"
OURS = "#3987e5"  # what this code finds
THESIS = "#dd7a2f"  # what the thesis prints or its method finds
TRUTH = "#2a9d6f"  # what is true in a simulation
OTHER = "#a06cd5"  # a fourth curve
FIFTH = "#c8527a"


@dataclass(frozen=True)
class Claim:
    """One number of the thesis, and what this code gets for it.

    Attributes:
        where: section, figure, table or equation, as "4.1, Fig. 12".
        text: what is claimed, in one line without its number.
        thesis: as printed; None where the thesis gives no number.
        ours: from a run, in the same unit; None where there is nothing to compute, which `note` then explains.
        unit: "deg", "deg/(m/s^2)", ...; "" for none.
        note: why the two differ, or what ours was made from.
    """

    where: str
    text: str
    thesis: float | None
    ours: float | None
    unit: str
    note: str = ""


@dataclass(frozen=True)
class Misprint:
    """What the thesis prints wrongly, with the check that says so.

    Attributes:
        where: as of a claim.
        printed: what stands there.
        right: what it must be.
        check: what was computed, with its numbers: "off by 0.51 rad as printed, 3e-16 as corrected".
        shown: whether the check bore it out.
    """

    where: str
    printed: str
    right: str
    check: str
    shown: bool


@dataclass(frozen=True)
class Figure:
    """A figure by its number in the thesis.

    Attributes:
        number: "2", "16a"; our own further views of it "2+".
        title: a few words.
        draw: fills an empty matplotlib figure (`canvas.subplots()` ...), with axis labels and units; computes nothing.
        caption: what is seen, in whole sentences: what was run, and where the thesis's values are drawn in.
        size_in: width and height in inches. 5.2 is half of a wide page and all of a telephone's, where text of 9 points
            can just be read: panels stand one below the other.
    """

    number: str
    title: str
    draw: Callable[[Canvas], None]
    caption: str
    claims: tuple[Claim, ...] = ()
    misprints: tuple[Misprint, ...] = ()
    size_in: tuple[float, float] = (5.2, 3.4)


@dataclass(frozen=True)
class Table:
    """A table by its number in the thesis, or an equation's as "(25)-(31)", a section's as "§5.5.4"; cells are "
    "text, headed by `columns`."""

    number: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str
    claims: tuple[Claim, ...] = ()
    misprints: tuple[Misprint, ...] = ()


Exhibit = Figure | Table
