"""Every code block of the docs runs, and prints what its page shows (docs/run_code.py says how)."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).parents[1] / "docs"
CODE = runpy.run_path(str(DOCS / "run_code.py"))
NOTEBOOKS = runpy.run_path(str(DOCS / "run_notebook.py"))
WITH_CODE = [page for page in CODE["pages"]() if CODE["blocks"](page)]


@pytest.fixture(scope="session")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Simulated drives, each made once."""
    return tmp_path_factory.mktemp("drives")


@pytest.mark.slow
@pytest.mark.parametrize("page", WITH_CODE)
def test_the_code_of_a_page_runs_and_prints_what_the_page_shows(page: str, drives: Path) -> None:
    CODE["run_page"](page, drives)


def page_of(text: str, folder: Path) -> str:
    """A page outside the checkout, as run_page takes it."""
    file = folder / "page.md"
    file.write_text(text, encoding="utf-8")
    return str(file)


@pytest.mark.parametrize(
    "text",
    [
        "```sh\noncenter no-such-verb\n```\n",
        "```sh\nmake nothing\n```\n",
        "```sh\npip install '.[nothing]'\n```\n",
        "```python\nimport no_such_package\n```\n",
        "```sh\necho the offset is 2.0 deg\n```\n\n```text\nthe offset is 3.0 deg\n```\n",
        "```sh\necho the offset is 2.0 deg\n```\n\n```text\nthe play is 2.0 deg\n```\n",
        "```toml\nwheel_base_m = 3.7\n```\n",
        '```json\n{"schema": }\n```\n',
        "```c\nint main(void) { return nothing; }\n```\n",
        "```matlab\nplot(1)\n```\n",
    ],
)
def test_a_block_that_is_wrong_is_an_error(text: str, drives: Path, tmp_path: Path) -> None:
    with pytest.raises(CODE["DocsError"], match=r"page\.md:\d+: "):
        CODE["run_page"](page_of(text, tmp_path), drives)


def test_a_block_that_cannot_run_says_why(drives: Path, tmp_path: Path) -> None:
    CODE["run_page"](page_of("<!-- not run: needs MATLAB -->\n```matlab\nplot(1)\n```\n", tmp_path), drives)


def test_a_block_of_python_with_a_name_is_a_file_for_the_blocks_after_it(drives: Path, tmp_path: Path) -> None:
    text = "```python\n# mine.py: an example\nvalue = 3\n```\n```sh\npython -c 'import mine; print(mine.value)'\n```\n"
    CODE["run_page"](page_of(f"{text}```text\n3\n```\n", tmp_path), drives)


def test_outputs_are_renewed_and_the_rest_of_the_page_is_left(drives: Path, tmp_path: Path) -> None:
    text = "```sh\necho one; echo two; echo three\n```\n\n```text\nnone\n```\n\n    after\n"
    page = page_of(text, tmp_path)
    CODE["run_page"](page, drives, write=True)
    assert Path(page).read_text(encoding="utf-8") == text.replace("none", "one\ntwo\nthree")


NOTEBOOK_FILES = sorted((DOCS / "notebooks").glob("*.ipynb"))


@pytest.mark.slow
@pytest.mark.parametrize("notebook", NOTEBOOK_FILES, ids=lambda path: path.stem)
def test_a_notebook_runs_from_its_first_cell_to_its_last(notebook: Path) -> None:
    assert "notebook-output" in NOTEBOOKS["as_page"](notebook)


@pytest.mark.parametrize("notebook", NOTEBOOK_FILES, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(notebook: Path) -> None:
    given: dict[str, Any] = json.loads(notebook.read_text(encoding="utf-8"))
    code = [cell for cell in given["cells"] if cell["cell_type"] == "code"]
    assert code and not any(cell["outputs"] or cell["execution_count"] for cell in code)
    assert not any(line.startswith(("%", "!")) for cell in code for line in cell["source"]), "plain Python"


@pytest.mark.slow
def test_the_five_pictures_are_drawn_and_their_numbers_are_those_of_the_page(tmp_path: Path) -> None:
    made = runpy.run_path(str(DOCS / "make_how_it_works.py"))
    driven = made["drive"]()
    made["draw_all"](driven, tmp_path)
    shown = {path.name for path in (DOCS / "how_it_works").iterdir()}
    assert {path.name for path in tmp_path.iterdir()} == shown and len(shown) == 5
    page = (DOCS / "how_it_works.md").read_text(encoding="utf-8")
    assert CODE["is_alike"](page.split(made["BEGIN"])[1].split(made["END"])[0], made["numbers"](driven))
    assert all(f"how_it_works/{name}" in page for name in shown)
