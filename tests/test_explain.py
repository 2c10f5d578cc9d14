"""`oncenter explain` and its page: each code of a finding or an error has a section, and each section has a code."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from oncenter import _core
from oncenter.bus import monitor
from oncenter.cli import run
from oncenter.cli.explain import PAGE, Section, read_sections
from oncenter.errors import WRONG_USAGE
from oncenter.files.child import READER_DEATHS
from oncenter.verdict.states import STATES

ROOT = Path(__file__).parents[1]
SOURCES = [path for path in ROOT.glob("src/oncenter/**/*.py") if path.name != "_declarations.py"]
SEVERITIES = {"error", "warning", "info"}
WORDS_MAX = 25  # of a sentence
NEVER_STARTED = "stopped"  # files/child.py: a reader that was ended from outside
WORD = "word of an answer"
SECTIONS = {kind: {s.code: s for s in read_sections() if s.kind == kind} for kind in ("finding", "error", WORD)}
FINDING_HEAD = re.compile(r"Severity: (\w+)(?: or (\w+))?\. Value: (none|.+)\.")
ERROR_HEAD = re.compile(r"Error\. Exit code: \d+(?: or \d+)?\.")


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def calls(tree: ast.Module, *names: str) -> Iterator[ast.Call]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) in names:
            yield node


def texts(node: ast.AST | None) -> set[str]:
    """All string constants of an expression."""
    every = ast.walk(node) if node is not None else ()
    return {each.value for each in every if isinstance(each, ast.Constant) and isinstance(each.value, str)}


@cache
def findings_in_source() -> dict[str, tuple[set[str], set[str]]]:
    """The severities and the units of the functions that are registered for each code."""
    found: dict[str, tuple[set[str], set[str]]] = {}
    for path in SOURCES:
        for function in ast.walk(parsed(path)):
            for mark in calls(ast.Module(getattr(function, "decorator_list", []), []), "finding"):
                code, _, *unit = (ast.literal_eval(each) for each in mark.args)
                severities, units = found.setdefault(code, (set(), set()))
                severities |= texts(function) & SEVERITIES
                units |= set(unit)
    return found


def constants(tree: ast.Module) -> dict[str, str]:
    """Names of a module that are bound to a string."""
    found = {}
    for node in tree.body:
        if isinstance(node, ast.Assign):
            target, value = node.targets[0], node.value
            several = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
            for name, bound in zip(target.elts, value.elts, strict=True) if several else [(target, value)]:
                if isinstance(name, ast.Name) and isinstance(bound, ast.Constant) and isinstance(bound.value, str):
                    found[name.id] = bound.value
    return found


def errors_in_source() -> set[str]:
    """All `code=` of exceptions, and the codes that are made elsewhere."""
    found = {*READER_DEATHS, NEVER_STARTED, *(f"image_{fault}" for fault in monitor._REFUSALS)}
    for path in SOURCES:
        tree = parsed(path)
        bound = constants(tree)
        for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
            for given in (keyword.value for keyword in call.keywords if keyword.arg == "code"):
                if isinstance(given, ast.Constant) and re.fullmatch(r"[a-z][a-z0-9_]*", str(given.value)):
                    found.add(given.value)
                elif isinstance(given, ast.Name) and given.id in bound:
                    found.add(bound[given.id])
        found |= {call.args[1].value for call in calls(tree, "_fail") if isinstance(call.args[1], ast.Constant)}
    return found


def test_each_finding_has_a_section_and_each_section_a_finding() -> None:
    about = f"{PAGE} needs a section `## CODE` for each code of @finding(CODE, …) in src/oncenter, and no other"
    assert set(SECTIONS["finding"]) == set(findings_in_source()), about


def test_each_error_has_a_section_and_each_section_an_error() -> None:
    about = f"{PAGE} needs a section `## CODE` for each code=… of an OncenterError in src/oncenter, and no other"
    assert set(SECTIONS["error"]) == errors_in_source(), about


def test_each_status_verdict_and_reason_has_a_section() -> None:
    assert set(SECTIONS[WORD]) == {*_core.STATUSES, *STATES, *_core.REASONS}


def test_no_code_has_two_sections_of_one_kind() -> None:
    assert len(read_sections()) == sum(map(len, SECTIONS.values()))


@pytest.mark.parametrize("code", sorted(SECTIONS["finding"]))
def test_the_page_gives_the_severity_and_the_unit_of_a_finding(code: str) -> None:
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    head = FINDING_HEAD.fullmatch(page.split(f"\n## {code}\n\n")[1].split("\n\n")[0])
    place = f"{PAGE}, section {code}"
    assert head is not None, f"{place}: its first line must be like `Severity: warning. Value: `deg`, free play.`"
    severities = {head[1], *({head[2]} if head[2] else set())}
    assert severities <= SEVERITIES, place
    in_source, units = findings_in_source()[code]
    assert in_source <= severities, f"{place}: gives {severities}, the functions of the finding give {in_source}"
    assert not [unit for unit in units if unit not in head[3]], f"{place}: the value has the unit {units}"
    assert bool(units) or "`" not in head[3], f"{place}: the finding has no unit"


@pytest.mark.parametrize("section", read_sections(), ids=lambda section: f"{section.kind}-{section.code}")
def test_a_section_has_its_parts_in_order_and_short_sentences(section: Section) -> None:
    place = f"{PAGE}, section {section.code}"
    head, *rest = section.paragraphs
    heads = {"finding": FINDING_HEAD, "error": ERROR_HEAD, WORD: re.compile(r"Status\.|Verdict\.|Reason\.")}
    assert heads[section.kind].fullmatch(head), f"{place}: its first line"
    if section.kind != WORD:
        example, *rest = rest
        assert example.startswith("  "), f"{place}: its second paragraph quotes the printed text, each line after `> `"
    labels = [paragraph.split(": ")[0] for paragraph in rest]
    assert labels in (
        ["What it means", "What to do"],
        ["What it means", "Likely causes", "What to do"],
    ), f"{place}: its paragraphs after the quoted text"
    checked = section.paragraphs[1:] if section.kind == "finding" else rest  # messages of errors name files
    for sentence in (each for paragraph in checked for each in re.split(r"[.;:?]\s", paragraph)):
        assert len(sentence.split()) <= WORDS_MAX, f"{place}: more than {WORDS_MAX} words: {sentence}"


@pytest.mark.parametrize("code", sorted(SECTIONS["finding"]))
def test_a_finding_says_what_happens_to_the_offset(code: str) -> None:
    example = SECTIONS["finding"][code].paragraphs[1]
    about = f"the text of {code} must give its effect on the offset or on its uncertainty:"
    assert re.search(r"\boffset\b|\buncertainty\b", example), f"{about} {example}"


def test_explain_prints_the_section_as_plain_text(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", "steering_play"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("steering_play (finding)\n\nSeverity: warning. Value: deg, free play")
    assert "What to do: Check the joints" in out
    assert not re.search(r"[`*>#]", out) and max(map(len, out.splitlines())) <= 100


def test_a_code_of_a_finding_and_of_an_error_prints_both(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain", "missing_signal"]) == 0
    out = capsys.readouterr().out
    assert "missing_signal (finding)" in out and "missing_signal (error)" in out


def test_explain_without_a_code_lists_all_codes_in_a_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["explain"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for section in read_sections():
        assert [line for line in lines if line.startswith(f"  {section.code} ")], section.code
    assert max(map(len, lines)) <= 120


@pytest.mark.parametrize(
    ("written", "says"),
    [
        ("steering_pla", "did you mean steering_play"),
        ("Steering-Play", "did you mean steering_play"),
        ("zzz", "oncenter explain lists all codes"),
    ],
)
def test_a_code_that_does_not_exist_is_refused_with_the_nearest_one(
    written: str, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["explain", written]) == WRONG_USAGE
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.count("\n") == 1
    assert f"'{written}'" in printed.err and says in printed.err
