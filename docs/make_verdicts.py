"""Makes docs/verdicts/STATE.png: the top of a report in each state of the verdict, from simulated drives.

Run as .venv/bin/python docs/make_verdicts.py [FOLDER], with Chromium installed (Debian's package chromium).
"""

import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import polars as pl
from PIL import Image, ImageChops

import oncenter as oc
from oncenter.report.browser import require_browser
from oncenter.report.document import document
from oncenter.report.verdict_part import verdict_header
from oncenter.signals import DEGREE
from oncenter.verdict import verdicts_of

TRUCK = oc.vehicle("scania_r730_4x2")
STRICT = TRUCK.model_copy(update={"offset_limit_deg": 1.0})
WIDTH, HEIGHT = 1280, 700  # px; what the header leaves is cut away
COLOURS = 64  # of a picture: text and areas need no more, and stay below 60 KB


def simulated(scenario: str, until_s: float | None = None) -> oc.Signals:
    drive = oc.simulate(scenario, seed=1)[0]
    return drive if until_s is None else replace(drive, table=drive.table.filter(pl.col("time_s") < until_s))


def with_reversed_yaw_rate(drive: oc.Signals) -> oc.Signals:
    return replace(drive, table=drive.table.with_columns(-pl.col("yaw_rate_rad_s")))


def with_drift(drive: oc.Signals) -> oc.Signals:
    """The angle drifts by 0.1 deg/s from the 1200th second on."""
    late_s = (pl.col("time_s") - pl.col("time_s").first() - 1200.0).clip(lower_bound=0.0)
    return replace(drive, table=drive.table.with_columns(pl.col("steering_wheel_angle_rad") + 0.1 * DEGREE * late_s))


def with_biased_yaw_rate(drive: oc.Signals) -> oc.Signals:
    return replace(drive, table=drive.table.with_columns(pl.col("yaw_rate_rad_s") + 0.8 * DEGREE))


STATES: dict[str, Callable[[], oc.Answer]] = {
    "recalibrate": lambda: oc.offset(simulated("thesis_drive"), STRICT),
    "within": lambda: oc.offset(simulated("self_correction"), TRUCK),
    "undecided": lambda: oc.offset(simulated("bypass"), TRUCK),
    "over": lambda: oc.offset(simulated("country", until_s=120.0), STRICT),
    "repair": lambda: oc.offset(with_drift(simulated("thesis_drive")), TRUCK),
    "signal_or_sensor": lambda: oc.offset(simulated("sensor_failure"), TRUCK),
    "check_signal": lambda: oc.offset(with_reversed_yaw_rate(simulated("thesis_drive")), TRUCK),
    "no_correction": lambda: oc.offset(simulated("relative_angle"), TRUCK),
    "changed": lambda: oc.offset(simulated("remounted_sensor"), TRUCK),
    "check": lambda: oc.offset(with_biased_yaw_rate(simulated("self_correction")), TRUCK),
}


def picture(answer: oc.Answer, path: Path) -> None:
    """The header of the answer's page, as wide as a window and no higher than it is."""
    header = verdict_header(verdicts_of(answer), f"{answer.vehicle.name} · {answer.log}")
    page = document("verdict", header, "", style="main { max-width: none; }")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "page.html").write_text(page, encoding="utf-8")
        subprocess.run(
            [
                str(require_browser(path.name, "report.html")),
                *"--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split(),
                *f"--hide-scrollbars --window-size={WIDTH},{HEIGHT} --user-data-dir={folder}/profile".split(),
                f"--screenshot={folder}/whole.png",
                (folder / "page.html").as_uri(),
            ],
            check=True,
            timeout=60,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        cropped(Image.open(folder / "whole.png").convert("RGB")).quantize(COLOURS).save(path, optimize=True)


def cropped(whole: Image.Image) -> Image.Image:
    """Without the empty ground below the header."""
    ground = Image.new("RGB", whole.size, whole.getpixel((2, 2)))
    box = ImageChops.difference(whole, ground).getbbox()
    return whole.crop((0, 0, whole.width, min(box[3] + 24, whole.height))) if box else whole


def main(folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for state, answered in STATES.items():
        picture(answered(), folder / f"{state}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "verdicts")
