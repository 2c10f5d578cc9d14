"""Makes docs/live.png: the live page, a few minutes into demo/drive.log.

Run after `make demo`, with Chromium installed (Debian's package chromium).
"""

import math
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

import oncenter as oc
from oncenter.live import session as live_session
from oncenter.live.learner import Learner, needed
from oncenter.live.replay import Replay
from oncenter.live.session import Notices, Session
from oncenter.live.web import Page
from oncenter.offset.inputs import params_of
from oncenter.read.frames import Frames
from oncenter.read.stream import Stream
from oncenter.report.browser import find_browser

ROOT = Path(__file__).parent.parent
WIDTH, HEIGHT = 1000, 1208  # px
SHOWN_S = 255.0  # of the log


class Beginning(Replay):
    """The beginning of a log at once, then nothing: by the clock, each picture would end at another frame."""

    def take(self, timeout_s: float) -> Frames:
        time.sleep(timeout_s)
        return self._until(self._log_time_s + SHOWN_S)


def main() -> None:
    truck = oc.vehicle("scania_r730_4x2")
    live_session.SILENT_S = math.inf
    replay = Beginning(ROOT / "demo" / "drive.log", 1.0)
    replay.name = "demo/drive.log"
    session = Session(replay, Learner(Stream(replay.name, needed(truck)), truck), truck.name, Notices())
    with Page(session, params_of(truck, None), "127.0.0.1", 0, print) as page, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=find_browser(), args=["--no-sandbox", "--disable-partial-raster"]
        )
        view = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        view.goto(page.url)
        view.wait_for_selector("#truck:not(:empty)")
        session.start()
        view.wait_for_selector("#offset:not(.none)")
        time.sleep(3.0)  # until the figures have followed
        view.screenshot(path=ROOT / "docs" / "live.png")
        browser.close()
        session.stop()
        session.join()


if __name__ == "__main__":
    main()
