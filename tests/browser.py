"""The browser of all tests that open a page, and the faults of a page that it shows.

The marker `browser` skips a test where no browser is installed; the fixture `browser` is for tests that drive one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from oncenter.report.browser import find_browser

_WIDTHS = (1280, 400)  # px: a desk, a telephone
_OWN = ("file:", "data:", "blob:", "about:")  # addresses for which a browser asks no network
_LOOKS = 50  # 0.1 s apart: a slow machine takes seconds to draw
# Lists the pictures that show nothing: SVGs without extent, and figures of bokeh without a pixel in colour, since axes
# and labels are grey.
_BLANK = """() => {
  const canvases = (node) => [...node.querySelectorAll("*")].flatMap((part) =>
    part.tagName === "CANVAS" ? [part] : part.shadowRoot ? canvases(part.shadowRoot) : []);
  const isColoured = (canvas) => {
    if (!canvas.width || !canvas.height) return false;
    const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    for (let k = 0; k < data.length; k += 4) {
      const [red, green, blue, alpha] = data.subarray(k, k + 4);
      if (alpha > 20 && Math.max(red, green, blue) - Math.min(red, green, blue) > 40) return true;
    }
    return false;
  };
  const isShown = (part) => part.checkVisibility();
  const figures = [...document.querySelectorAll("[data-root-id]")].filter(isShown);
  const svgs = [...document.querySelectorAll("svg")].filter(isShown);
  return [
    ...figures.filter((figure) => !canvases(figure).some(isColoured)).map((figure) => `figure ${figure.id} is blank`),
    ...svgs.filter((svg) => !svg.getBBox().width).map((svg) => `SVG ${svg.ariaLabel ?? svg.id} is blank`),
  ];
}"""
_MISSING = """() => [...document.images].filter((image) => !(image.complete && image.naturalWidth))
  .map((image) => `image ${image.src} is missing`)"""
# Lists the first parts that make the page wider than its window, so that a telephone scrolls it sideways.
_TOO_WIDE = """() => {
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth <= width) return [];
  const fits = (part) => part.getBoundingClientRect().right <= width;
  const wide = [...document.body.querySelectorAll("*")].filter((part) => !fits(part) && [...part.children].every(fits));
  return wide.slice(0, 3).map((part) => `wider than the window: ${part.outerHTML.slice(0, 120)}`);
}"""


def skip_without_browser() -> None:
    if find_browser() is None:
        pytest.skip("no Chromium, Chrome or Edge on this machine: make browser, or apt-get install chromium")


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("browser") is not None:
        skip_without_browser()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A browser for one file: while playwright runs, asyncio begins no loop of its own."""
    from playwright.sync_api import sync_playwright

    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("LD_PRELOAD", raising=False)  # the sanitizers of the tests are not the browser's
        running = sync_playwright().start()
        opened = running.chromium.launch(executable_path=find_browser(), args=["--no-sandbox"])
    yield opened
    opened.close()
    running.stop()


def note_errors(page: Any, faults: list[str]) -> None:
    """Adds each error of the page's scripts, and each that the browser's console shows, to the faults."""
    page.on("pageerror", lambda error: faults.append(f"page error: {error}"))
    page.on("console", lambda said: faults.append(f"console: {said.text}") if said.type == "error" else None)


def faults_of(browser: Any, address: str, prepare: Callable[[Any], None] = lambda page: None) -> list[str]:
    """The faults of a page in a file, at a desk and on a telephone, light and dark; empty for a good one.

    Args:
        browser: of the fixture.
        address: of the file.
        prepare: opens what a reader opens by hand.
    """
    faults: list[str] = []

    def only_own(route: Any) -> None:
        if route.request.url.startswith(_OWN):
            route.continue_()
        else:
            faults.append(f"request to the network: {route.request.url}")
            route.abort()

    with browser.new_page(viewport={"width": _WIDTHS[0], "height": 900}) as page:
        note_errors(page, faults)
        page.route("**/*", only_own)
        page.goto(address)
        page.evaluate('for (const part of document.querySelectorAll("details")) part.open = true')
        page.evaluate('for (const image of document.images) image.loading = "eager"')
        prepare(page)
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            for width in _WIDTHS:
                page.set_viewport_size({"width": width, "height": 900})
                faults += [f"{width} px, {scheme}: {fault}" for fault in _once_drawn(page)]
    return faults


def _once_drawn(page: Any) -> list[str]:
    found: list[str] = []
    for _ in range(_LOOKS):
        page.wait_for_timeout(100)
        found = [fault for look in (_BLANK, _MISSING, _TOO_WIDE) for fault in page.evaluate(look)]
        if not found:
            break
    return found
