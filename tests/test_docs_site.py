"""The docs site: it builds without a warning, opens from a file, loads nothing from elsewhere and shows all pages."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from browser import faults_of

import oncenter

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site as `make docs` builds it, elsewhere."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    built = subprocess.run(
        command, cwd=ROOT, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True
    )
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


@pytest.mark.browser  # needs none, but the site, which is built once for all these tests
def test_a_page_loads_no_file_from_another_machine(site: Path) -> None:
    loads = re.compile(
        r'<(?:script|img|iframe|source)\b[^>]*\bsrc="([^"]+)"|<link\b[^>]*\bhref="([^"]+)"|url\(([^)]+)\)'
    )
    for page in [*site.rglob("*.html"), *site.rglob("*.css")]:
        for found in loads.finditer(page.read_text(encoding="utf-8")):
            target = (found[1] or found[2] or found[3]).strip("'\"")
            if 'rel="canonical"' not in found[0]:
                assert "//" not in target.removeprefix("data:").split(";")[0], f"{page.name} loads {target}"


def test_the_reference_has_every_public_name_of_the_package() -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    assert set(re.findall(r"heading: oncenter\.(\w+)", page)) == set(oncenter.__all__) - {"__version__"}


def test_every_page_of_docs_is_in_the_navigation() -> None:
    settings = yaml.load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"), yaml.SafeLoader)
    shown = set(_pages(settings["nav"]))
    kept = {path.relative_to(ROOT / "docs").as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert kept - shown == set()


def _pages(entry: Any) -> Iterator[str]:
    if isinstance(entry, str):
        yield entry
    else:
        for each in entry.values() if isinstance(entry, dict) else entry:
            yield from _pages(each)


@pytest.mark.browser
def test_each_page_with_a_picture_draws_it_and_fits_a_telephone(site: Path, browser: Any) -> None:
    pages = [page for page in sorted(site.rglob("*.html")) if "<img" in page.read_text(encoding="utf-8")]
    assert site / "index.html" in pages
    assert {page.name: found for page in pages if (found := faults_of(browser, page.as_uri()))} == {}


@pytest.mark.browser
def test_the_search_works_without_a_server_and_finds_what_a_reader_types(site: Path, browser: Any) -> None:
    page, requested = browser.new_page(), []
    page.on("request", lambda request: requested.append(request.url))
    page.goto((site / "index.html").as_uri())
    for words, address in (
        ("straight-ahead offset", "glossary.html"),
        ("notebook", "howto/pandas.html"),
        ("cron", "fleet.html"),
        ("zip", "formats.html"),
    ):
        page.locator("input[name=query]").fill("")
        page.locator("input[name=query]").press_sequentially(words)  # the search listens to keys
        page.wait_for_selector(f".md-search-result__item a[href*='{address}']", timeout=20_000, state="attached")
    assert [url for url in requested if not url.startswith(("file:", "data:", "about:", "blob:"))] == []
    page.close()
