"""A machine with nothing but make and git: the Makefile names or installs what a target needs, and the pins and the
README's lines fit it. `make fresh` types the same lines on real ones."""

import re
import runpy
import shutil
import subprocess
import tomllib
from importlib.metadata import distributions
from pathlib import Path

import pytest
from locked import pinned
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
AT_ROOT = ("pyproject.toml", "requirements.demo.lock", "requirements.lock", "setup.py", "liboncenter.py")
FOR_DEMO = {"python3", "python3-venv", "gcc", "libc6-dev"}
FOR_TEST = FOR_DEMO | {"cppcheck", "g++"}
# Installs by making programs that do nothing.
APT_GET = """#!/bin/sh
echo "$*" >>"$(dirname "$0")/../apt-get was called"
for program in python3 cc g++ cppcheck; do ln -sf /bin/true "$(dirname "$0")/$program"; done
"""


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """A folder with the Makefile and what it looks for, and no program on its path but those in `bin`."""
    for name in ("Makefile", *AT_ROOT):
        shutil.copy(ROOT / name, tmp_path)
    programs = tmp_path / "bin"
    programs.mkdir()
    for name in ("dirname", "ln"):
        (programs / name).symlink_to(str(shutil.which(name)))
    write_program(programs / "id", "#!/bin/sh\necho 1000\n")
    return tmp_path


def write_program(file: Path, text: str) -> None:
    file.write_text(text, encoding="utf-8")
    file.chmod(0o755)


def make(machine: Path, *targets: str) -> subprocess.CompletedProcess[str]:
    command = [str(shutil.which("make")), "--no-print-directory", *targets]
    environment = {"PATH": str(machine / "bin"), "HOME": str(machine)}
    return subprocess.run(command, cwd=machine, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("targets", "packages"),
    [
        ("demo", FOR_DEMO),
        ("lint", FOR_DEMO),
        ("test", FOR_TEST),
        ("demo test", FOR_TEST),
        ("-j4 test fuzz", FOR_TEST | {"clang", "libclang-rt-dev"}),
    ],
)
def test_a_user_reads_one_line_with_all_missing_packages_before_anything_is_made(
    machine: Path, targets: str, packages: set[str]
) -> None:
    done = make(machine, *targets.split())
    first, *rest = done.stderr.splitlines()
    install = re.fullmatch(r".*: sudo apt-get update && sudo apt-get install -y --no-install-recommends (.+)", first)
    assert install and set(install[1].split()) == packages
    assert done.returncode == 2 and all("***" in line for line in rest), "after it, only make's own line"
    assert done.stdout == "" and {path.name for path in machine.iterdir()} == {"Makefile", "bin", *AT_ROOT}


def test_root_on_debian_gets_them_installed(machine: Path) -> None:
    write_program(machine / "bin" / "id", "#!/bin/sh\necho 0\n")
    write_program(machine / "bin" / "apt-get", APT_GET)
    done = make(machine, "packages", "DEBIAN_packages=$(DEBIAN_test)")
    assert done.returncode == 0, done.stderr
    update, install = (machine / "apt-get was called").read_text(encoding="utf-8").splitlines()
    assert update.split()[0] == "update"
    assert set(install.split()) >= {"install", "-y", *FOR_TEST}
    again = make(machine, "packages", "DEBIAN_packages=$(DEBIAN_test)")
    assert (again.returncode, again.stdout) == (0, "")


def test_a_python_that_is_too_old_is_named_after_the_packages(machine: Path) -> None:
    (machine / "bin" / "cc").symlink_to("/bin/true")
    write_program(machine / "bin" / "python3", '#!/bin/sh\ncase "$*" in *version_info*) exit 1; esac\n')
    done = make(machine, "demo")
    assert done.stderr.splitlines()[0] == "needs Python 3.11 or later: make PYTHON=python3.11"


def test_each_list_of_packages_is_of_a_target_and_each_package_can_be_looked_for() -> None:
    lists = dict(re.findall(r"^DEBIAN_(\w+) = (.*)$", MAKEFILE, re.MULTILINE))
    base = lists.pop("BASE")
    targets = {name for names in re.findall(r"^([\w -]+):(?!=)", MAKEFILE, re.MULTILINE) for name in names.split()}
    assert set(lists) - targets == set()
    packages = {name for given in (base, *lists.values()) for name in given.split() if not name.startswith("$")}
    assert packages == set(re.findall(r"^has_(\S+) =", MAKEFILE, re.MULTILINE))


def test_every_pin_accepts_the_lowest_python_that_the_project_allows() -> None:
    allowed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["requires-python"]
    lowest = f"{allowed.removeprefix('>=')}.0"
    pins = pinned("requirements.lock")
    there = [package for package in distributions() if pins.get(canonicalize_name(package.name)) == package.version]
    assert there, "none of the pinned versions is installed"
    needed = {package.name: package.metadata["Requires-Python"] for package in there}
    assert {name: needs for name, needs in needed.items() if needs and lowest not in SpecifierSet(needs)} == {}


def test_the_readme_has_both_commands_with_their_time_in_a_block_of_its_first_30_lines() -> None:
    head = "\n".join((ROOT / "README.md").read_text(encoding="utf-8").splitlines()[:30])
    block = re.findall(r"^```sh\n(.*?)^```", head, re.MULTILINE | re.DOTALL)[0]
    assert re.findall(r"^(.+?) +# \d+ minutes: ", block, re.MULTILINE) == ["make demo", "make test"]
    assert len(block.splitlines()) == 2


@pytest.mark.parametrize("page", ["README.md", "docs/tutorial.md"])
def test_the_pages_name_the_packages_for_a_build_as_the_makefile_does(page: str) -> None:
    base = re.search(r"^DEBIAN_BASE = python3 (.*)$", MAKEFILE, re.MULTILINE)
    assert base and base[1] in (ROOT / page).read_text(encoding="utf-8")


def test_the_table_of_bare_systems_has_a_row_for_each_and_only_that_row_is_renewed(tmp_path: Path) -> None:
    fresh = runpy.run_path(str(ROOT / ".ci" / "fresh.py"))
    page = tmp_path / "platforms.md"
    shutil.copy(fresh["PAGE"], page)
    fresh["write_row"].__globals__["PAGE"] = page
    systems = [f"| {debian} | {user} |" for debian in fresh["DEBIANS"] for user in fresh["ACCOUNTS"]]
    for begin in systems:
        before = page.read_text(encoding="utf-8").splitlines()
        fresh["write_row"](begin, ["2026-01-01, abc", *("passed" for _ in fresh["commands"]())])
        after = page.read_text(encoding="utf-8").splitlines()
        changed = [(old, new) for old, new in zip(before, after, strict=True) if old != new]
        assert [new for _, new in changed] == [f"{begin} 2026-01-01, abc | passed | passed |"]
        assert changed[0][0].startswith(begin)
