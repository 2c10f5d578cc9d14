"""The pictures of the verdicts: each is made, small, and shown by the page about them."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"


@pytest.mark.browser
def test_each_state_has_a_small_picture_that_the_page_shows(tmp_path: Path) -> None:
    made = runpy.run_path(str(DOCS / "make_verdicts.py"))
    state = "undecided"
    made["picture"](made["STATES"][state](), tmp_path / f"{state}.png")
    assert 0 < (tmp_path / f"{state}.png").stat().st_size <= 60_000
    page = (DOCS / "verdicts.md").read_text(encoding="utf-8")
    for name in made["STATES"]:
        assert f"(verdicts/{name}.png)" in page
        assert (DOCS / "verdicts" / f"{name}.png").stat().st_size <= 60_000
