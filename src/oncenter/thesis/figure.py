"""The results of a figure group: figures and tables, each with the numbers of the thesis and of this code.

There are few colours. In a page, the page's own colours replace those of ink and paper, for light and dark screens.
Therefore axes, text and reference lines use INK, MUTED and GRID, and never black or white.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Progress = Callable[[float], None]  # takes the fraction done, 0 to 1

INK = "#16191d"  # axes, text, outlines
MUTED = "#5b626b"  # measured values, or values for comparison
GRID = "#dfe2e6"
PAPER = "#ffffff"
OURS = "#3987e5"  # results of this code
THESIS = "#dd7a2f"  # numbers of the thesis, or results of its method
TRUTH = "#2a9d6f"  # true values of a simulation
OTHER = "#a06cd5"  # a fourth curve
FIFTH = "#c8527a"


@dataclass(frozen=True)
class Claim:
    """One number of the thesis, and the result of this code for it.

    Attributes:
        where: section, figure, table or equation, as "4.1, Fig. 12".
        text: the claim in one line, without its number.
        thesis: as printed; None if the thesis gives no number.
        ours: from a run, in the same unit; None if there is nothing to compute, for the reason in `note`.
        unit: "deg", "deg/(m/s^2)", ...; "" for none.
        note: the reason why the two differ, or the source of `ours`.
    """

    where: str
    text: str
    thesis: float | None
    ours: float | None
    unit: str
    note: str = ""


@dataclass(frozen=True)
class Misprint:
    """A misprint of the thesis, with the check that shows it.

    Attributes:
        where: as in a claim.
        printed: the printed text.
        right: the correct text.
        check: the computation, with its numbers: "error 0.51 rad as printed, 3e-16 as corrected".
        shown: True if the check confirms the misprint.
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
        number: "2", "16a"; further views by this code "2+".
        title: a few words.
        draw: fills an empty matplotlib figure (`canvas.subplots()` ...), with axis labels and units; computes nothing.
        caption: the content in whole sentences: the drives or equations used, and the thesis's values in the figure.
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
