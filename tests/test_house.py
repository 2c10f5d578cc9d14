"""The project's pages against its files: named files exist, and statements in two places agree."""

import ast
import fnmatch
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from importlib.metadata import version
from pathlib import Path

import cffi
import pytest
from locked import pinned
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
HEADERS = sorted(ROOT.glob("core/*/*.h")) + sorted(ROOT.glob("src/oncenter/*/native/*.h"))
LOCKS = ("requirements.lock", "requirements.demo.lock", "wheels/requirements.txt")
MADE_BY_COMMANDS = {"demo/drive.log", "demo/report.html", ".venv/bin/oncenter", ".venv/bin/python"}


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def kept_files() -> Iterator[Path]:
    """All files of the project, without those in .gitignore and without git's own."""
    ignored = [line.strip("/") for line in text(".gitignore").split()]
    waiting = [ROOT]
    while waiting:
        for path in waiting.pop().iterdir():
            if path.name == ".git" or any(fnmatch.fnmatch(path.name, pattern) for pattern in ignored):
                continue
            if path.is_dir() and not path.is_symlink():
                waiting.append(path)
            elif path.is_file():
                yield path


def braces(name: str) -> list[str]:
    """mean.h and mean.c, from `mean.{h,c}`."""
    whole = re.fullmatch(r"(.*)\{(.+)\}(.*)", name)
    return [whole[1] + part + whole[3] for part in whole[2].split(",")] if whole else [name]


def named_in(page: str) -> set[str]:
    """Paths in a page's links and code; a path with NAME is a pattern and left out."""
    prose = re.sub(r"^```.*?^```", "", page, flags=re.MULTILINE | re.DOTALL)
    links = {target for target in re.findall(r"\]\(([^)#]+)\)", page) if "://" not in target}
    code = set(re.findall(r"`([\w./{},*-]+/[\w./{},*-]*)`", prose))
    return {name for given in links | code for name in braces(given) if "NAME" not in name} - MADE_BY_COMMANDS


def house_picture(page: str) -> set[str]:
    """Paths of the picture: a folder a line at the margin, its files indented below, names before two spaces."""
    picture = page.split("```house\n")[1].split("```")[0]
    found, folder = set(), ""
    for line in picture.splitlines():
        given = re.split(r"\s{2,}", line.strip())[0].split()
        if not line.startswith(" "):
            folder = given[0] if len(given) == 1 and given[0].endswith("/") else ""
            found |= {name for entry in given for name in braces(entry)}
        else:
            found |= {folder + name for entry in given for name in braces(entry)}
    return found


def declarations(header: Path, seen: set[Path]) -> str:
    """The included headers of oncenter, then this one, without directives."""
    if header in seen:
        return ""
    seen.add(header)
    source = header.read_text(encoding="utf-8")
    included = [
        next(p for p in (header.parent / name, *ROOT.glob(f"core/*/{name}")) if p.is_file())
        for name in re.findall(r'^#include "(.+)"', source, re.MULTILINE)
    ]
    return "".join(declarations(p, seen) for p in included) + re.sub(r"^#.*$", "", source, flags=re.MULTILINE)


def header_version() -> str:
    return ".".join(re.findall(r"OC_VERSION_(?:MAJOR|MINOR|PATCH) = (\d+)", text("core/monitor/monitor.h")))


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_a_page_names_only_files_that_exist(page: str) -> None:
    assert sorted(name for name in named_in(text(page)) if not any(ROOT.glob(name.rstrip("/")))) == []


def test_the_picture_of_the_house_shows_only_files_that_exist() -> None:
    picture = house_picture(text("CONTRIBUTING.md"))
    assert sorted(name for name in picture if not any(ROOT.glob(name.rstrip("/")))) == []


def test_the_picture_of_the_house_is_complete() -> None:
    picture = house_picture(text("CONTRIBUTING.md"))
    rooms = {p.relative_to(ROOT).as_posix() for p in ROOT.glob("core/*/*.[ch]")}
    rooms |= {p.relative_to(ROOT).as_posix() for p in kept_files() if p.match("src/oncenter/*.py")}
    rooms |= {p.parent.relative_to(ROOT).as_posix() + "/" for p in ROOT.glob("src/oncenter/*/__init__.py")}
    rooms |= {p.name + "/" for p in ROOT.iterdir() if p.is_dir() and any(f.is_relative_to(p) for f in kept_files())}
    assert sorted(rooms - picture - {"src/"}) == []


def test_the_version_is_the_same_everywhere() -> None:
    import oncenter

    ours = header_version()
    assert re.fullmatch(r"\d+\.\d+\.\d+", ours)
    assert version("oncenter") == ours
    assert oncenter.__version__ == ours
    assert re.search(r"^## \[(.+?)\]", text("CHANGELOG.md"), re.MULTILINE)[1] == ours
    assert re.search(r"^version: (.+)$", text("CITATION.cff"), re.MULTILINE)[1] == ours
    assert re.search(r"^  version = \{(.+)\},$", text("docs/cite.md"), re.MULTILINE)[1] == ours


def test_the_lock_pins_versions_and_contains_no_address() -> None:
    for name in LOCKS:
        lines = [line for line in text(name).splitlines() if not line.startswith("#")]
        pins = [line for line in lines if re.fullmatch(r"[\w.-]+==[\w.]+( ; [\w .<='!]+)? \\", line)]
        hashes = [line for line in lines if re.fullmatch(r"    --hash=sha256:[0-9a-f]{64}( \\)?", line)]
        assert pins and len(pins) + len(hashes) == len(lines)
        last = [line for line in hashes if not line.endswith("\\")]
        assert len(last) == len(pins), f"{name}: each pin has a hash"


def test_every_package_that_the_project_needs_is_locked_at_a_version_that_it_allows() -> None:
    """pip installs the lock without looking for what else is needed."""
    project = tomllib.loads(text("pyproject.toml"))
    extras = project["project"]["optional-dependencies"]
    for lock, names in (("requirements.lock", set(extras) - {"fmu"}), ("requirements.demo.lock", {"report"})):
        pins = pinned(lock)
        given = [line for name in names for line in extras[name]]
        for line in (*project["project"]["dependencies"], *given, *project["build-system"]["requires"]):
            requirement = Requirement(line)
            name = canonicalize_name(requirement.name)
            assert name == "oncenter" or pins[name] in requirement.specifier, f"{lock}: {line}"
    assert pinned("requirements.demo.lock").items() <= pinned("requirements.lock").items()


def test_the_lowest_versions_are_those_that_the_project_allows() -> None:
    project = tomllib.loads(text("pyproject.toml"))["project"]
    extras = {name: given for name, given in project["optional-dependencies"].items() if name not in ("dev", "docs")}
    allowed = [line for given in (project["dependencies"], *extras.values()) for line in given if ">=" in line]
    tried = [line for line in allowed if not line.startswith("ray")]  # it is 300 MB
    first = dict(reversed(re.findall(r"^([\w.-]+)==([\w.]+)", text("requirements.lowest"), re.MULTILINE)))
    assert first == dict(line.partition(";")[0].split(">=") for line in tried)


def test_every_locked_package_has_its_licence_listed() -> None:
    listed = dict(re.findall(r"^\| ([\w.-]+) \| (\d\S*) \| (?!not stated)", text("docs/licences.md"), re.MULTILINE))
    assert {canonicalize_name(name): version for name, version in listed.items()} == pinned("requirements.lock")


def test_no_kept_file_names_a_machine_or_a_package_registry() -> None:
    strange = re.compile("|".join(["/wo" + "rk/", "/ro" + "ot/", "/ho" + "me/", "py" + "pi", "python" + "hosted"]))
    found = {}
    for path in kept_files():
        try:
            hits = strange.findall(path.read_text(encoding="utf-8").lower())
        except UnicodeDecodeError:
            continue
        if hits:
            found[path.relative_to(ROOT).as_posix()] = hits
    assert not found


CORE_FOLDERS = ("numbers", "truck", "signals", "thesis", "joint", "angle", "monitor", "ecu")
BESIDE = {"thesis", "joint", "angle"}  # none of the three needs another


def test_a_folder_of_the_core_includes_only_folders_below_it() -> None:
    folder_of = {file.name: file.parent.name for file in ROOT.glob("core/*/*.[ch]")}
    assert set(folder_of.values()) == set(CORE_FOLDERS)
    upward = []
    for file in sorted(ROOT.glob("core/*/*.[ch]")):
        own = file.parent.name
        below = set(CORE_FOLDERS[: CORE_FOLDERS.index(own)]) - (BESIDE if own in BESIDE else set()) | {own}
        named = re.findall(r'^#include "(.+)"', file.read_text(encoding="utf-8"), re.MULTILINE)
        upward += [f"{own}/{file.name} includes {name}" for name in named if folder_of[name] not in below]
    assert upward == []


def test_no_two_files_of_the_core_have_the_same_name_since_an_export_is_one_folder() -> None:
    names = [file.name for file in ROOT.glob("core/*/*.[ch]")]
    assert len(names) == len(set(names))


GROUP = re.compile(r"/\* (Derived\.|Numerical\.|Tuned, in tuned\.toml: \w+) \*/")
TUNED_BLOCK = re.compile(r"^/\* Tuned, in tuned\.toml: \w+ \*/$.*?^/\* end \*/\n\n", re.DOTALL | re.MULTILINE)


CORE_C_FILES = sorted((ROOT / "core").rglob("*.c"))
C_FILES = CORE_C_FILES + sorted(ROOT.glob("src/oncenter/*/native/*.c"))


@pytest.mark.parametrize(
    "path", CORE_C_FILES + sorted(ROOT.glob("src/oncenter/truck/native/*.c")), ids=lambda path: path.name
)
def test_the_constants_of_a_file_say_whether_they_are_derived_numerical_or_tuned(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    groups = [line for line in lines if line.startswith(("/* Derived", "/* Numerical", "/* Tuned"))]
    assert all(GROUP.fullmatch(line) for line in groups)
    assert len({line.split()[1].rstrip(".;") for line in groups}) == len(groups), "each group once"
    constants = [k for k, line in enumerate(lines) if re.match(r"static const (float|double|u?int\d+_t) \w+ ?=", line)]
    begin = min((k for k, line in enumerate(lines) if GROUP.fullmatch(line)), default=len(lines))
    assert [lines[k] for k in constants if k < begin] == []
    functions = [k for k, line in enumerate(lines) if re.match(r"(static )?\w[\w *]*\(.*\{$", line) and k > begin]
    assert [lines[k] for k in constants if functions and k > functions[0]] == []


@pytest.mark.parametrize("path", C_FILES, ids=lambda path: path.name)
def test_c_types_no_tuned_constant_by_hand(path: Path) -> None:
    by_hand = TUNED_BLOCK.sub("", path.read_text(encoding="utf-8"))
    assert not re.search("tuned", by_hand, re.IGNORECASE), "a row of core/tuned.toml, then make written"


def test_each_tuned_constant_has_its_effects_and_its_evidence() -> None:
    rows = {
        f"{stem}.{name}": row
        for stem, group in tomllib.loads(text("core/tuned.toml")).items()
        for name, row in group.items()
    }
    assert [
        name for name, row in rows.items() for key in ("unit", "meaning", "small", "large", "source") if not row[key]
    ] == []
    like = {name: re.match(r"as (\w+(?:\.\w+)?)", row["source"]) for name, row in rows.items()}
    others = {name: found[1] for name, found in like.items() if found}
    assert [name for name, other in others.items() if not {other, f"{name.split('.')[0]}.{other}"} & set(rows)] == []


def test_a_line_of_c_has_at_most_120_characters_as_one_of_python() -> None:
    published = "src/oncenter/export/fmi/fmi[23]*.h"  # by those who make the standard
    long = [
        f"{path.relative_to(ROOT).as_posix()}:{number}"
        for path in kept_files()
        if path.suffix in {".c", ".h"} and not path.match(published)
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if len(line) > 120
    ]
    assert long == []


def test_no_file_is_a_symbolic_link_since_windows_cannot_check_it_out() -> None:
    assert [path for path in kept_files() if path.is_symlink()] == []


@pytest.mark.parametrize("header", HEADERS, ids=lambda path: path.name)
def test_a_header_holds_guard_includes_types_and_prototypes_only(header: Path) -> None:
    source = header.read_text(encoding="utf-8")
    directives = re.findall(r"^[ \t]*#.*$", source, re.MULTILINE)
    guard = directives[0].removeprefix("#ifndef ")
    assert directives[1] == f"#define {guard}"
    assert directives[-1] == "#endif"
    assert not [line for line in directives[2:-1] if not re.fullmatch(r'#include (<\w+\.h>|"\w+\.h")', line)]
    assert not re.search(r"\b(static|inline|extern|__attribute__)\b", re.sub(r"/\*.*?\*/", "", source, flags=re.DOTALL))
    cffi.FFI().cdef(declarations(header, set()))  # rejects bodies and other definitions


def modules() -> dict[str, Path]:
    """All modules of oncenter by name; a folder is that of its __init__.py."""
    source = ROOT / "src"
    paths = [path for path in kept_files() if path.is_relative_to(source) and path.suffix == ".py"]
    return {".".join(path.relative_to(source).with_suffix("").parts).removesuffix(".__init__"): path for path in paths}


def imports() -> dict[str, set[str]]:
    """The modules that any import statement of each module names, also one in a function or for types only."""
    paths = modules()
    found: dict[str, set[str]] = {name: set() for name in paths}
    for name, path in paths.items():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found[name] |= {each.name for each in node.names} & paths.keys()
            elif isinstance(node, ast.ImportFrom):
                named = (f"{node.module}.{each.name}" for each in node.names)
                found[name] |= {whole if whole in paths else f"{node.module}" for whole in named} & paths.keys()
    return found


def circle(graph: Mapping[str, set[str]]) -> list[str]:
    """The first one that is found; empty where there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_the_imports_of_no_module_lead_back_to_it() -> None:
    assert circle(imports()) == []


def test_the_imports_of_no_room_lead_back_to_it() -> None:
    """A room is a folder or a module directly in src/oncenter."""

    def room(name: str) -> str:
        return ".".join(name.split(".")[:2])

    rooms: dict[str, set[str]] = {}
    for name, named in imports().items():
        rooms.setdefault(room(name), set()).update(map(room, named - {name}))
    assert circle({name: named - {name} for name, named in rooms.items()}) == []


HELP = "import sys; from oncenter.cli import main; sys.argv = ['oncenter', '--help']; main()"


@pytest.mark.parametrize("program", ["import oncenter", HELP], ids=["import", "help"])
def test_nothing_heavy_is_loaded_before_it_is_needed(program: str) -> None:
    command = [sys.executable, "-X", "importtime", "-c", program]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    loaded = {line.split("|")[-1].strip().split(".")[0] for line in run.stderr.splitlines() if "|" in line}
    assert "oncenter" in loaded
    assert not loaded & {"can", "cantools", "asammdf", "pandas", "bokeh", "matplotlib", "pyarrow", "ray"}


@pytest.mark.parametrize("first", ["import oncenter.{0}.run", "from oncenter.{0} import run"])
@pytest.mark.parametrize("verb", ["angle", "offset", "reference"])
def test_a_verb_stays_a_function_when_the_folder_of_its_name_was_imported_before(verb: str, first: str) -> None:
    program = f"{first.format(verb)}; import oncenter; assert callable(oncenter.{verb}), oncenter.{verb}"
    subprocess.run([sys.executable, "-c", program], check=True)
