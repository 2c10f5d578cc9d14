"""The table of equations says the truth: every file, function and test it names exists."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
ROW = re.compile(r"\| (.+?) \| (.+?) \| (\S+) \| `(\w+)` \| (\S+) `(\w+)` \|")
ROWS = [ROW.fullmatch(line) for line in PAGE.splitlines() if line.startswith("| ")][1:]  # less the heading
CENTRAL = {7, 10, *range(31, 44), 45, 48, 49, 50, 51}


def functions(path: Path) -> set[str]:
    """Those that the file defines, not those it only calls."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return {node.name for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)}
    return set(re.findall(r"^\w[\w *]*?\b(\w+)\([^;{]*\)\s*\{", text, re.MULTILINE))


def equations(cell: str) -> set[int]:
    """`(5), (15)-(18)` as 5, 15, 16, 17, 18."""
    found: set[int] = set()
    for first, last in re.findall(r"(?<!\w)\((\d+)\)(?:-\((\d+)\))?", cell):
        found |= set(range(int(first), int(last or first) + 1))
    return found


def test_every_line_of_the_table_is_read() -> None:
    assert len(ROWS) > 20
    others = [line for line in PAGE.splitlines() if line.startswith("| ") and not ROW.fullmatch(line)][1:]
    assert others == [], "docs/equations.md: a row is `| equation | what | file | `function` | test file `test` |`"


@pytest.mark.parametrize("row", [row for row in ROWS if row], ids=lambda row: f"{row[1]} {row[4]}")
def test_file_function_and_test_of_an_equation_exist(row: re.Match[str]) -> None:
    _, _, file, function, test_file, test = row.groups()
    assert function in functions(ROOT / file), f"{file} defines no {function}"
    assert test in functions(ROOT / test_file), f"{test_file} has no {test}"


def test_the_thesiss_central_equations_are_all_there() -> None:
    listed = set().union(*(equations(row[1]) for row in ROWS if row))
    assert CENTRAL - listed == set(), "docs/equations.md lacks a central equation of the thesis"


def test_every_thesis_equation_that_the_core_cites_is_in_the_table() -> None:
    listed = set().union(*(equations(row[1]) for row in ROWS if row))
    cited = {
        number
        for source in ROOT.glob("core/*/*.[ch]")
        for comment in re.findall(r"/\*.*?\*/", source.read_text(encoding="utf-8"), re.DOTALL)
        for number in equations(comment)
    }
    assert cited - listed == set(), "docs/equations.md lacks an equation that a comment in core/ cites"


def test_each_term_of_the_joint_model_is_in_the_table_and_no_term_that_was_removed() -> None:
    terms = tomllib.loads((ROOT / "core" / "terms.toml").read_text(encoding="utf-8"))
    cells = filter(None, (re.fullmatch(r"joint: (\w+(?:, \w+)*)", row[1]) for row in ROWS if row))
    listed = {symbol for cell in cells for symbol in cell[1].split(", ")}
    besides = {"o", "a_h", "priors"}  # the constant, the load by h, and the priors of all terms
    about = "the rows `joint: SYMBOL` of docs/equations.md, against the symbols of core/terms.toml"
    assert listed - besides == {row["symbol"] for row in terms.values()}, about
