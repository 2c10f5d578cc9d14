"""oncenter demo: a simulated drive, answered like a real one."""

from __future__ import annotations

import shlex
import shutil
import sys
from pathlib import Path
from typing import Annotated

import typer

from oncenter.errors import WRONG_USAGE, OncenterError

_SCENARIO = "thesis_drive"
_TRUCK = "scania_r730_4x2"
_LIMIT_DEG = 1.5  # the truth of 2.04 deg is too near to the default of 2 deg to be decided by one drive


def demo(
    output: Annotated[Path, typer.Option(metavar="DIR", help="The folder for log, truth and report.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Seed of the random numbers; another seed gives another drive.")] = 1,
) -> None:
    """Simulate a drive, estimate its offset, write a report.

    The drive takes half an hour with the truck of the thesis, as a candump log. The true offset is printed below the
    estimated one.
    """
    import oncenter as oc
    from oncenter.cli.offset import as_table, with_limit
    from oncenter.files.extra import is_installed, missing_extra
    from oncenter.signals import DEGREE
    from oncenter.simulate import simulate_to_log

    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise oc.OncenterError(f"--output {output}: {error.strerror}", code="output", exit_code=WRONG_USAGE) from None
    log, page = output / "drive.log", output / "report.html"
    _refuse_other_files(log, page)
    _begin("simulating half an hour of driving")
    truth = simulate_to_log(_SCENARIO, seed, log)
    truck = with_limit(oc.vehicle(_TRUCK), _LIMIT_DEG)
    _begin(f"reading {log}, estimating the offset")
    answer = oc.offset(oc.read(log), truck)
    typer.echo(as_table(answer))
    offset_deg, play_deg = truth.offset_rad / DEGREE, truth.backlash_rad / DEGREE
    typer.echo(f"\n  the truth: straight-ahead offset {offset_deg:.2f} deg, play {play_deg:.1f} deg")
    if is_installed("bokeh"):
        oc.report(answer, page)
        typer.echo(f"  wrote {log} and {page}: open the page in a browser")
    else:
        typer.echo(f"  wrote {log}; {missing_extra('report', f'{page} needs bokeh')}")
    typer.echo(
        f"  the same from the log: {_as_typed()} offset {shlex.quote(log.as_posix())} --vehicle {_TRUCK} "
        f"--limit {_LIMIT_DEG:g}"
    )


def _as_typed() -> str:
    """This program by name if the shell finds it by name, otherwise by path: `make demo` calls .venv/bin/oncenter."""
    is_module = Path(sys.argv[0]).name == "__main__.py"
    path = Path(sys.executable if is_module else sys.argv[0])
    name = path.name.removesuffix(".exe")
    found = shutil.which(name)
    is_found = found is not None and Path(found).absolute().with_suffix("") == path.absolute().with_suffix("")
    return (name if is_found else shlex.quote(str(path))) + (" -m oncenter" if is_module else "")


def _begin(step: str) -> None:
    """Writes the step to standard error: it is not part of the answer."""
    typer.echo(step, err=True)


def _refuse_other_files(log: Path, page: Path) -> None:
    """A demo overwrites the files of an earlier demo, and no others.

    Raises:
        OncenterError: "output", exit code 2.
    """
    from oncenter.simulate import truth_files

    table, truth = truth_files(log)
    there = [path for path in (log, page, table, truth) if path.exists()]
    if there and not _wrote(log, truth):
        raise OncenterError(
            f"--output {log.parent}: {there[0].name} in it is not from a demo and would be overwritten: "
            "name another folder, or remove the file",
            code="output",
            exit_code=WRONG_USAGE,
        )


def _wrote(log: Path, truth: Path) -> bool:
    """Whether a demo wrote the files: the truth names the scenario, and the log begins at the simulator's start time.

    Both are needed: logs of other scenarios begin at the same time, and a user may have replaced the log alone.
    """
    import tomllib

    from oncenter.simulate.can import START_S

    begin = f"({START_S}.".encode()
    try:
        scenario = tomllib.loads(truth.read_text(encoding="utf-8")).get("scenario")
        with log.open("rb") as file:
            return scenario == _SCENARIO and file.read(len(begin)) == begin
    except (OSError, ValueError):  # not there, or no TOML
        return False
