"""Renews the section on play in docs/method.md: the thesis's mean on a crowned road, and its picture.

Run as .venv/bin/python docs/make_play.py; the picture, docs/play.png, needs Chromium (Debian's package chromium).
"""

import subprocess
import tempfile
from pathlib import Path

import numpy as np

import oncenter as oc
from oncenter.report.browser import require_browser
from oncenter.signals import DEGREE

ROOT = Path(__file__).parent.parent
METHOD = ROOT / "docs" / "method.md"
BEGIN, END = "<!-- play: written by docs/make_play.py -->", "<!-- play: end -->"
PLAY_DEG = (0.0, 3.0, 8.0, 15.0)
SEEDS = range(101, 121)


def error_deg(folder: Path, play_deg: float, seed: int) -> float:
    """Error of the thesis's mean after the thesis drive with this play."""
    scenario = folder / f"play_{play_deg:g}.toml"
    scenario.write_text(f'base = "thesis_drive"\nabout = "more play"\n[steering]\nbacklash_deg = {play_deg}\n')
    signals, truth = oc.simulate(scenario, seed)
    value = oc.offset(signals, oc.vehicle("scania_r730_4x2"), method="thesis").offset.value
    assert value is not None
    return (value - truth.offset_rad) / DEGREE


def table(errors: dict[float, list[float]]) -> str:
    lines = [
        "| play, deg | error of the offset, deg: median | lowest to highest | bound by (51) |",
        "|--:|--:|--:|--:|",
    ]
    for play_deg, values in errors.items():
        spread = f"{min(values):+.2f} to {max(values):+.2f}"
        lines.append(f"| {play_deg:g} | {np.median(values):+.2f} | {spread} | ±{play_deg / 2:g} |")
    return "\n".join(lines)


def draw(errors: dict[float, list[float]], folder: Path) -> None:
    """Each drive a point over its play, between the bounds of (51)."""
    from bokeh.embed import file_html
    from bokeh.plotting import figure
    from bokeh.resources import INLINE

    plot = figure(
        width=760,
        height=420,
        toolbar_location=None,
        x_axis_label="play in the steering (deg)",
        y_axis_label="error of the offset (deg)",
    )
    widest = max(errors)
    plot.varea([0, widest], [0, -widest / 2], [0, widest / 2], color="#3584e4", alpha=0.15, legend_label="bound (51)")
    for play_deg, values in errors.items():
        spread = np.linspace(-0.15, 0.15, len(values))
        plot.scatter(play_deg + spread, values, size=5, color="#26a269", alpha=0.7, legend_label="one drive")
    plot.line([0, widest], [0, 0], color="#5e5c64", line_dash="dashed", legend_label="truth")
    plot.legend.location = "top_left"
    page = folder / "play.html"
    page.write_text(file_html(plot, INLINE, title="play"), encoding="utf-8")
    subprocess.run(
        [
            str(require_browser("play.png", "play.html")),
            *"--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split(),
            *"--hide-scrollbars --virtual-time-budget=5000 --window-size=776,436".split(),
            f"--user-data-dir={folder}/profile",
            f"--screenshot={ROOT / 'docs' / 'play.png'}",
            page.as_uri(),
        ],
        check=True,
        stderr=subprocess.DEVNULL,
    )


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        errors = {play_deg: [error_deg(folder, play_deg, seed) for seed in SEEDS] for play_deg in PLAY_DEG}
        draw(errors, folder)
    text = METHOD.read_text(encoding="utf-8")
    before, after = text.partition(BEGIN)[0], text.partition(END)[2]
    METHOD.write_text(f"{before}{BEGIN}\n{table(errors)}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
