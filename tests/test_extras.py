"""A base install: each command works, or names in one line the `pip install` it needs."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from base_install import PROJECT, Interpreter, Result, not_of_the_base
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from oncenter.files import extra
from oncenter.files.log_formats import FORMATS
from oncenter.simulate import simulate_to_log

TRUCK = ("--vehicle", "scania_r730_4x2")
SHORT = """base = "thesis_drive"
about = "three minutes"
[drive]
duration_s = 180.0
"""
READ_BY_ALL = [f"drive{row.suffixes[0]}" for row in FORMATS if row.writer and not row.extra]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One drive in all formats that a base install reads; only names of the others."""
    folder = tmp_path_factory.mktemp("drives")
    (folder / "short.toml").write_text(SHORT)
    for log in READ_BY_ALL:
        simulate_to_log(folder / "short.toml", 1, folder / log)
    for log in ("drive.mf4", "drive.mat", "drive.bag", "truck.dbc"):
        (folder / log).write_text("never looked at")
    (folder / "others.toml").write_text('wheelbase_m = 3.71\nsteering_ratio = 21.0\nname = "o"\ndbc = "truck.dbc"\n')
    (folder / "fleet").mkdir()
    (folder / "fleet" / "drive.toml").write_text('wheelbase_m = 3.71\nsteering_ratio = 21.0\nname = "drive"\n')
    return folder


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Interpreter]:
    interpreter = Interpreter(tmp_path_factory.mktemp("base"), not_of_the_base())
    yield interpreter
    interpreter.close()


def line_of(said: Result) -> str:
    """The one-line error for a missing extra."""
    assert (said.exit_code, said.out) == (1, "")
    assert said.err.count("\n") == 1
    return said.err.strip().removeprefix("oncenter: ")


def test_packages_of_extras_are_hidden_from_it(base: Interpreter, folder: Path) -> None:
    assert {"asammdf", "bokeh", "can", "cantools", "pandas", "pyarrow", "matplotlib"} <= not_of_the_base()
    assert base.python("import bokeh", folder).err == "ModuleNotFoundError: No module named 'bokeh'\n"
    in_a_child = "import subprocess, sys; print(subprocess.run([sys.executable, '-P', '-c', 'import can']).returncode)"
    assert base.python(in_a_child, folder).out == "1\n"


@pytest.mark.parametrize("log", READ_BY_ALL)
@pytest.mark.parametrize("verb", ["signals", "offset"])
def test_it_reads_all_logs_but_mf4(base: Interpreter, folder: Path, verb: str, log: str) -> None:
    said = base.oncenter(verb, log, *TRUCK, folder=folder)
    assert (said.exit_code, said.err) == (0, "")
    assert "deg" in said.out


@pytest.mark.parametrize(
    "arguments",
    [
        ("angle", "drive.log", *TRUCK, "--output", "angle.parquet"),
        ("budget", *TRUCK),
        ("simulate", "short.toml", "--output", "again.log"),
        ("simulate", "short.toml", "--output", "again.csv.gz"),
        ("live", "--replay", "drive.log", "--speed", "100", *TRUCK),
        ("export", "c", "--output", "core"),
        ("export", "fmu", *TRUCK, "--output", "truck.fmu"),
        ("offset", "--each", "drive.log", "drive.csv", *TRUCK),
        ("offset", "drive.log", *TRUCK, "--memory", "memory.toml"),
        ("--help",),
        *((verb, "--help") for verb in ("offset", "live", "thesis", "fleet")),
    ],
    ids=" ".join,
)
def test_it_runs_all_commands_that_need_no_extra(base: Interpreter, folder: Path, arguments: tuple[str, ...]) -> None:
    said = base.oncenter(*arguments, folder=folder)
    assert said.exit_code == 0, said.err
    assert said.out


def test_it_measures_the_offset_on_a_straight(base: Interpreter, tmp_path: Path) -> None:
    said = base.oncenter("simulate", "both_ways", "--output", "both_ways.log", folder=tmp_path)
    assert said.exit_code == 0, said.err
    said = base.oncenter("reference", "both_ways.log", *TRUCK, folder=tmp_path)
    assert (said.exit_code, said.err) == (0, "")


def test_its_demo_gives_an_answer_and_the_command_for_the_page(base: Interpreter, tmp_path: Path) -> None:
    said = base.oncenter("demo", folder=tmp_path)
    assert said.exit_code == 0, said.err
    assert said.out.startswith("Recalibrate: straight-ahead offset +2.0 deg")
    assert said.out.splitlines()[-2].endswith(
        "demo/report.html needs bokeh, which is not installed: pip install 'oncenter[report]'"
    )


@pytest.mark.parametrize(
    ("arguments", "needs"),
    [
        (("offset", "drive.mf4", *TRUCK), "drive.mf4 needs asammdf [mf4]"),
        (("signals", "drive.mf4"), "drive.mf4 needs asammdf [mf4]"),
        (("signals", "drive.mat"), "drive.mat needs scipy [mat]"),
        (("signals", "drive.bag"), "drive.bag needs rosbags [ros]"),
        (("angle", "drive.mf4", *TRUCK), "drive.mf4 needs asammdf [mf4]"),
        (("signals", "drive.log", "--dbc", "truck.dbc"), "the database truck.dbc needs cantools [can]"),
        (("offset", "drive.log", "--vehicle", "others.toml"), "the database truck.dbc needs cantools [can]"),
        (("simulate", "thesis_drive", "--output", "new.mf4"), "new.mf4 needs asammdf [mf4]"),
        (("simulate", "thesis_drive", "--output", "new.asc"), "new.asc needs python-can [can]"),
        (("simulate", "thesis_drive", "--output", "new.blf"), "new.blf needs python-can [can]"),
        (("simulate", "thesis_drive", "--output", "new.trc"), "new.trc needs python-can [can]"),
        (("offset", "drive.log", *TRUCK, "--report", "new.html"), "new.html needs bokeh [report]"),
        (("angle", "drive.log", *TRUCK, "--report", "new.html"), "new.html needs bokeh [report]"),
        (("live", "can0", *TRUCK), "the bus can0 needs python-can [can]"),
        (("live", "--replay", "drive.log", "--web", *TRUCK), "--web needs bokeh [live]"),
        (("live", "--replay", "drive.mf4", *TRUCK), "drive.mf4 needs asammdf [mf4]"),
        (("live", "--replay", "drive.log", "--trace", "new.mf4", *TRUCK), "new.mf4 needs asammdf [mf4]"),
        (
            ("live", "--replay", "drive.log", "--dbc", "truck.dbc", *TRUCK),
            "the database truck.dbc needs cantools [can]",
        ),
        (("thesis", "--output", "new"), "oncenter thesis needs matplotlib [thesis]"),
        (
            ("fleet", "run", "drive.log", "--vehicles", "fleet", "--output", "new"),
            "oncenter fleet run needs blake3 [fleet]",
        ),
    ],
    ids=lambda given: " ".join(given) if isinstance(given, tuple) else "",
)
def test_for_other_commands_it_names_the_extra_in_one_line(
    base: Interpreter, folder: Path, arguments: tuple[str, ...], needs: str
) -> None:
    what, _, name = needs.removesuffix("]").partition(" [")
    expected = f"{what}, which is not installed: pip install 'oncenter[{name}]'"
    assert line_of(base.oncenter(*arguments, folder=folder)) == expected
    assert not list(folder.glob("new*")), "it is said before anything is written"


def test_programs_get_a_code(base: Interpreter, folder: Path) -> None:
    said = base.oncenter("offset", "drive.mf4", *TRUCK, "--json", folder=folder)
    assert (said.exit_code, json.loads(said.out)["code"]) == (1, "missing_extra")


@pytest.mark.parametrize(
    ("call", "extra"),
    [
        ("oc.read('drive.mf4')", "mf4"),
        ("oc.read('drive.log', dbc=['truck.dbc'])", "can"),
        ("oc.report(oc.offset(oc.read('drive.log'), oc.vehicle('scania_r730_4x2')), 'new.html')", "report"),
        ("from oncenter.fleet import run", "fleet"),
    ],
)
def test_python_gets_the_same_line(base: Interpreter, folder: Path, call: str, extra: str) -> None:
    said = base.python(f"import oncenter as oc; {call}", folder)
    assert re.fullmatch(rf"OncenterError: .* needs .*: pip install 'oncenter\[{extra}\]'\n", said.err)


def test_a_log_left_out_among_others_is_named_with_its_extra(base: Interpreter, folder: Path) -> None:
    said = base.oncenter("offset", "drive.log", "drive.mf4", *TRUCK, folder=folder)
    assert said.exit_code == 0
    assert "pip install 'oncenter[mf4]'" in " ".join(said.out.split())


def test_a_partly_installed_extra_is_detected(folder: Path, tmp_path: Path) -> None:
    few = Interpreter(tmp_path, ["msgpack", "pyarrow", "ray"])
    said = few.oncenter("live", "239.74.163.2", "--interface", "udp_multicast", *TRUCK, folder=folder)
    assert line_of(said).startswith("--interface udp_multicast needs msgpack, ")
    command = ("fleet", "run", "drive.log", "--vehicles", "fleet", "--output", "other", "--engine", "ray")
    assert line_of(few.oncenter(*command, folder=folder)).startswith("--engine ray needs Ray, ")
    bucket = ("fleet", "run", "s3://bucket/logs", "--vehicles", "fleet", "--output", "another")
    assert line_of(few.oncenter(*bucket, folder=folder)).startswith("s3:// needs pyarrow, ")
    few.close()


@pytest.mark.slow
def test_a_fleet_rereads_logs_after_an_extra_is_installed(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "without").mkdir()
    (tmp_path / "with").mkdir()
    (tmp_path / "logs" / "drive").mkdir(parents=True)
    simulate_to_log(folder / "short.toml", 1, tmp_path / "logs" / "drive" / "drive.mf4")
    (tmp_path / "logs" / "drive" / "drive.truth.parquet").unlink()  # a row of its own
    command = ("fleet", "run", "logs", "--vehicles", folder / "fleet", "--output", "out", "--json")
    numbers = []
    for name, modules in (("without", ["asammdf"]), ("with", [])):
        interpreter = Interpreter(tmp_path / name, modules)
        said = interpreter.oncenter(*command, folder=tmp_path)
        interpreter.close()
        summary = json.loads(said.out)
        numbers.append((summary["refused"], summary["logs_answered"]))
    assert numbers == [({"missing_extra": 1}, 0), ({}, 1)]


def names(requirements: list[str]) -> set[str]:
    """Packages, and those of our own extras that are named."""
    given = [Requirement(text) for text in requirements]
    own = [name for requirement in given if requirement.name == "oncenter" for name in requirement.extras]
    extras = PROJECT["optional-dependencies"]
    direct = {canonicalize_name(requirement.name) for requirement in given} - {"oncenter"}
    return direct.union(*(names(extras[name]) for name in own))


def test_the_named_extra_installs_the_package() -> None:
    extras = PROJECT["optional-dependencies"]
    for package, name in extra._BROUGHT_BY.values():
        assert canonicalize_name(package) in names(extras[name])


def test_the_all_extra_includes_every_extra_for_users() -> None:
    extras = PROJECT["optional-dependencies"]
    of_users = set(extras) - {
        "all",
        "dev",
        "docs",
        "fmu",
        "ray",
    }  # a compiler of 400 MB, a cluster of 200 MB and a site generator are not for all users
    assert names(extras["all"]) == set().union(*(names(extras[name]) for name in of_users))
