"""Makes docs/report.png from demo/report.html: the verdict, the offset over time, the two flanks of the play.

Run after `make demo`, with Chromium installed (Debian's package chromium).
"""

import subprocess
import tempfile
from pathlib import Path

from oncenter.report.browser import require_browser

ROOT = Path(__file__).parent.parent
SHOWN = ("Straight-ahead offset over time", "Free play: residual against lateral acceleration")
WIDTH, HEIGHT = 1000, 1455  # px


def shortened(page: str) -> str:
    """The page with all sections hidden but those that have one of the headings."""
    head, *sections = page.split("<section")
    shown = (any(heading in section for heading in SHOWN) for section in sections)
    return head + "".join(
        f"<section {'' if is_shown else 'hidden'}{section}" for section, is_shown in zip(sections, shown, strict=True)
    )


def main() -> None:
    page = (ROOT / "demo" / "report.html").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        short = Path(folder) / "short.html"
        short.write_text(shortened(page), encoding="utf-8")
        subprocess.run(
            [
                str(require_browser("report.png", "demo/report.html")),
                *"--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking".split(),
                *f"--hide-scrollbars --virtual-time-budget=8000 --window-size={WIDTH},{HEIGHT}".split(),
                f"--user-data-dir={folder}/profile",
                f"--screenshot={ROOT / 'docs' / 'report.png'}",
                short.as_uri(),
            ],
            check=True,
            stderr=subprocess.DEVNULL,
        )


if __name__ == "__main__":
    main()
