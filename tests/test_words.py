"""Words of the field in all text that a user reads: no private vocabulary, no old-fashioned phrases.

A red test names file, line and phrase, and what to write instead. Checked are the strings, docstrings and comments of
the Python package, its pages, the documentation, and the names of tests. Keys, columns and commands are no prose: a
string or an inline code without blanks is left out.
"""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]


class Phrase(NamedTuple):
    """A regular expression, matched without case, and its replacement in words."""

    pattern: str
    instead: str


PHRASES = [
    Phrase(r"\b(re)?told\b", "reported, given, estimated, identified, distinguished from"),
    Phrase(r"\b(tell|tells|telling)\b", "show, give, identify, report, distinguish"),
    Phrase(r"\bfore(tell|tells|told|see|sees|seen)\b", "predict, predicted"),
    Phrase(r"\bpass(es|ed|ing)? for\b", "looks like, is taken as"),
    Phrase(r"\bwhat no (single )?drive\b", "not identifiable from one drive"),
    Phrase(r"\bspoken (for|of)\b", "mentioned, reported"),
    Phrase(r"\b(un)?heard\b", "received, available"),
    Phrase(r"\bbelie(f|fs|ve|ves|ved|ving)\b", "prior, assumes, uses, trusts"),
    Phrase(r"\bknows\b", "has, uses, is configured with"),
    Phrase(r"\b(is|are|was|were|be|been|not|nothing|known) known\b|\bknown are\b", "identified, given, configured"),
    Phrase(r"(?<!one )(?<!to be )\b(sees|seen|unseen)\b(?! (from|by)\b)", "observed, measured, recorded, available"),
    Phrase(r"\bside[- ](force|acceleration)s?\b", "lateral force, lateral acceleration"),
    Phrase(r"\bunloads\b", "carries no load (neutral lateral acceleration)"),
    Phrase(r"\bunloading point\b", "neutral lateral acceleration"),
    Phrase(r"\bgravest\b", "most severe"),
    Phrase(r"\blest\b", "so that ... not"),
    Phrase(r"\blikewise\b", "also, in the same way"),
    Phrase(r"\bin like measure\b", "equally"),
    Phrase(r"\bwhence\b|\bhitherto\b|\bthereof\b|\bwherein\b", "from where, until now, of it, in which"),
    Phrase(
        r"(?<!ignition )(?<!engine )(?<!power )\b(is|are|be) ((so|far|surely|more and more) )*off\b(?! all night)",
        "has an offset (bias, error) of",
    ),
    Phrase(r"(?<!switched )(?<!turned )(?<!taken )\boff by\b", "wrong by, with an error of"),
    Phrase(r"\btakes left for right\b", "the sign is reversed"),
    Phrase(r"\b(may|could) hide\b", "cannot be separated from, can add"),
    Phrase(r"\bof ours\b|\bbugs? of our\b", "of oncenter; internal error"),
    Phrase(r"\bnewborns?\b", "on probation"),
    Phrase(
        r"(?<!column )(?<!column's )\bwind-ups?\b(?! of the column)", "free play; or name it: the wind-up of the column"
    ),
    Phrase(r"\bworth (telling|a word)\b", "relevant, reported"),
    Phrase(r"\b(bank of (the )?hypotheses|hypothesis bank|hypotheses' bank)\b", "hypothesis set"),
    Phrase(r"\bwhich of (the |them |these |those |its )*\w+ it is\b", "which one"),
    Phrase(r"\bso that it may\b", "so that it can"),
    Phrase(r"\bbut for\b", "except for, without"),
    Phrase(r"\byet(?=[.;:,)\"'!?]|$)", "so far, still not"),
    Phrase(r"\basks for\b", "needs, requires"),
    Phrase(r"\bas it was driven\b", "as recorded"),
    Phrase(r"\bsends no value any more\b|\bno value any more\b", "signal lost, no signal since"),
    Phrase(r"\bset right\b", "corrected"),
    Phrase(r"\bscatter of the drive\b", "measurement scatter"),
    Phrase(r"\bfinds its way\b", "converges"),
    Phrase(r"\bnobody (knows|tells|says)\b|\bwhoever\b", "name the person or the condition"),
    Phrase(r"(?<!there )\bis no (number|file|log|table|truck|image|message)\b", "is not a ..."),
]
EVERY = [re.compile(phrase.pattern, re.IGNORECASE | re.MULTILINE) for phrase in PHRASES]
CLAUSE = re.compile(r"^(What|Who|Whose|Whatever|Whoever) (?!to |it means)", re.MULTILINE)  # begins a docstring
TOKEN = re.compile(r"\S*")  # a key, a column, a name: no prose
INLINE_CODE = re.compile(r"`[^`\s]+`")
NOT_YET = re.compile(r"(\b(?:no|not|nothing|neither|never)\b[^.;:]{0,60}?)\byet\b", re.IGNORECASE)  # usual English
SQL = re.compile(r"\s*(SELECT|INSERT|CREATE|DELETE|UPDATE) ")


class Hit(NamedTuple):
    """`place` is file:line."""

    place: str
    phrase: str
    instead: str

    def __str__(self) -> str:
        return f"{self.place}: '{self.phrase}': write {self.instead}"


class Text(NamedTuple):
    """A piece of prose of a file, from this line on."""

    line: int
    prose: str
    is_docstring: bool = False


def hits_in(path: Path, texts: Iterator[Text]) -> list[Hit]:
    name = path.relative_to(ROOT).as_posix()
    found = []
    for text in texts:
        prose = NOT_YET.sub(r"\1", INLINE_CODE.sub("`", text.prose))
        for phrase, pattern in zip(PHRASES, EVERY, strict=True):
            for match in pattern.finditer(prose):
                line = text.line + prose.count("\n", 0, match.start())
                found.append(Hit(f"{name}:{line}", " ".join(match[0].split()), phrase.instead))
        if text.is_docstring and (match := CLAUSE.match(prose)):
            found.append(Hit(f"{name}:{text.line}", match[0].strip(), "a noun: no clause as subject or title"))
    return found


def is_prose(text: str) -> bool:
    return not (TOKEN.fullmatch(text) or SQL.match(text))


def python_texts(path: Path) -> Iterator[Text]:
    """Strings with blanks, docstrings and comments."""
    source = path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and is_prose(node.value):
            yield Text(node.lineno, node.value, id(node) in docstrings)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield Text(token.start[0], token.string)


def page_texts(path: Path) -> Iterator[Text]:
    """The whole of a page, script or document."""
    yield Text(1, path.read_text(encoding="utf-8"))


def test_name_texts(path: Path) -> Iterator[Text]:
    """A sentence on each line that begins a test, and nothing on the others."""
    names = (re.match(r"def (test_\w+)", line) for line in path.read_text(encoding="utf-8").splitlines())
    yield Text(1, "\n".join(f"{name[1].replace('_', ' ')}." if name else "" for name in names))


test_name_texts.__test__ = False  # type: ignore[attr-defined]

READERS = {".py": python_texts, ".js": page_texts, ".html": page_texts, ".css": page_texts, ".md": page_texts}
ROOMS = sorted({path.relative_to(ROOT).parts[2] for path in ROOT.glob("src/oncenter/**/*.py")})


@cache
def hits_of(pattern: str) -> tuple[Hit, ...]:
    """The hits of all files of a glob pattern, in order."""
    files = sorted(path for path in ROOT.glob(pattern) if path.name != "_declarations.py" and path.suffix in READERS)
    return tuple(hit for path in files for hit in hits_in(path, READERS[path.suffix](path)))


@pytest.mark.parametrize("room", ROOMS)
def test_the_package_uses_the_words_of_the_field(room: str) -> None:
    pattern = f"src/oncenter/{room}" if room.endswith(".py") else f"src/oncenter/{room}/**/*"
    assert [str(hit) for hit in hits_of(pattern)] == []


@pytest.mark.parametrize("pattern", ["README.md", "*/README.md", "docs/*.md", "docs/*/**/*.md", "docs/*.py"])
def test_the_documentation_uses_the_words_of_the_field(pattern: str) -> None:
    assert [str(hit) for hit in hits_of(pattern)] == []


def test_the_names_of_tests_use_the_words_of_the_field() -> None:
    hits = [str(hit) for path in sorted(ROOT.glob("tests/test_*.py")) for hit in hits_in(path, test_name_texts(path))]
    assert hits == []


@pytest.mark.parametrize(
    ("prose", "phrase"),
    [
        ("the offset is told modulo 360 deg", "told"),
        ("so that\nnot, lest the tyre", "lest"),
        ("it is not known again yet.", "not known"),
        ("the sensor is so far off", "is so far off"),
        ("play may hide in the offset", "may hide"),
    ],
)
def test_a_banned_phrase_is_found_with_its_line(prose: str, phrase: str) -> None:
    found = hits_in(ROOT / "README.md", iter([Text(3, prose)]))
    assert phrase in [hit.phrase for hit in found]
    assert found[0].place in ("README.md:3", "README.md:4")


@pytest.mark.parametrize(
    "prose",
    ["the ignition is off", "`told`, a column", "an unknown truck", "switched off by the driver", "no offset yet."],
)
def test_a_usual_phrase_is_no_alarm(prose: str) -> None:
    assert hits_in(ROOT / "README.md", iter([Text(1, prose)])) == []
