"""Makes docs/live.png: the live page, a few minutes into demo/drive.log played forty times as fast.

Run after `make demo`, with Chromium installed (Debian's package chromium).
"""

import time
from pathlib import Path

from playwright.sync_api import sync_playwright

import oncenter as oc
from oncenter.live.learner import Learner, needed
from oncenter.live.replay import Replay
from oncenter.live.session import Sayings, Session
from oncenter.live.web import Page
from oncenter.offset.inputs import params_of
from oncenter.read.stream import Stream
from oncenter.report.browser import find_browser

ROOT = Path(__file__).parent.parent
WIDTH, HEIGHT = 1000, 1208  # px
DRIVEN_S = 240.0


def main() -> None:
    truck = oc.vehicle("scania_r730_4x2")
    replay = Replay(ROOT / "demo" / "drive.log", 40.0)
    replay.name = "demo/drive.log"
    session = Session(replay, Learner(Stream(replay.name, needed(truck)), truck), truck.name, Sayings())
    with Page(session, params_of(truck, None), "127.0.0.1", 0, print) as page, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=["--no-sandbox"])
        view = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        view.goto(page.url)
        view.wait_for_selector("#truck:not(:empty)")
        session.start()
        while session.snapshot.driven_s < DRIVEN_S and session.is_alive():
            time.sleep(0.05)
        time.sleep(0.5)
        view.screenshot(path=ROOT / "docs" / "live.png")
        browser.close()
        session.stop()
        session.join()


if __name__ == "__main__":
    main()
