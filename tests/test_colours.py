"""Colours of series that stand in one picture, as people see them to whom one of the eye's three cones is lacking."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pytest

from oncenter.report.canvas import COLOURS
from oncenter.verdict import states

Vector = npt.NDArray[np.float64]

# Machado, Oliveira and Fernandes, "A Physiologically-based Model for Simulation of Color Vision Deficiency", IEEE
# Transactions on Visualization and Computer Graphics 15 (2009), severity 1.0; for linear RGB.
SEEN_BY = {
    "all cones": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
GROUNDS = {"light": "#ffffff", "dark": "#1a1d21"}  # --card of page.css
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])  # IEC 61966-2-1
DOT_DEG = 0.1  # of visual angle: 4 px of a screen with 96 dpi, from 0.6 m
STRETCH_DEG = 1.0 / 3.0  # 12 px: a bar of the fleet


def linear(colour: str) -> Vector:
    """IEC 61966-2-1."""
    srgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def lab(rgb: Vector) -> Vector:
    """CIELAB (1976), of linear RGB."""
    x = XYZ @ rgb.clip(0.0, 1.0) / XYZ.sum(axis=1)
    root = np.where(x > (6 / 29) ** 3, np.cbrt(x), x / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * root[1] - 16, 500 * (root[0] - root[1]), 200 * (root[1] - root[2])])


def noticed(size_deg: float) -> Vector:
    """The differences of L*, a* and b* that 70 % of the people notice. Stone, Szafir and Setlur, "An Engineering Model
    for Color Difference as a Function of Size", Color and Imaging Conference (2014), for 1/3 to 6 deg."""
    return 0.7 * (np.array([10.16, 10.68, 10.70]) + np.array([1.50, 3.08, 5.74]) / size_deg)


def luminance(colour: str) -> float:
    return float(XYZ[1] @ linear(colour))


FIGURES = {name: colour.figure for name, colour in states.COLOURS.items()}
SERIES = {name: colour for name, colour in COLOURS.items() if name != "line"}


@pytest.mark.parametrize(("colours", "size_deg"), [(SERIES, DOT_DEG), (FIGURES, STRETCH_DEG)])
@pytest.mark.parametrize("eye", SEEN_BY)
def test_any_two_series_of_a_picture_differ_for_most_people_also_without_one_cone(
    eye: str, colours: Mapping[str, str], size_deg: float
) -> None:
    seen = {name: lab(SEEN_BY[eye] @ linear(colour)) / noticed(size_deg) for name, colour in colours.items()}
    apart = {(a, b): float(np.linalg.norm(seen[a] - seen[b])) for a, b in combinations(seen, 2)}
    assert {pair: distance for pair, distance in apart.items() if distance < 1.0} == {}


@pytest.mark.parametrize("ground", GROUNDS)
def test_each_series_has_the_contrast_of_a_graphic_on_light_and_on_dark(ground: str) -> None:
    for name, colour in {**COLOURS, **FIGURES}.items():
        low, high = sorted([luminance(colour), luminance(GROUNDS[ground])])
        assert (high + 0.05) / (low + 0.05) >= 3.0, name  # WCAG 2.2, 1.4.11


@pytest.mark.parametrize("theme", GROUNDS)
def test_each_state_has_the_contrast_of_text_on_light_and_on_dark(theme: str) -> None:
    for name, shades in states.COLOURS.items():
        low, high = sorted([luminance(getattr(shades, theme)), luminance(GROUNDS[theme])])
        assert (high + 0.05) / (low + 0.05) >= 4.5, name  # WCAG 2.2, 1.4.3
