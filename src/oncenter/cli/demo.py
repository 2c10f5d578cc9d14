"""oncenter demo: a simulated drive, answered as a real one would be."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def demo(
    output: Annotated[Path, typer.Option(metavar="DIR", help="Where log, truth and report go.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Another seed, another drive.")] = 1,
) -> None:
    """Half an hour with the thesis's truck: simulate, write a candump log, read it back, answer, report."""
    import oncenter as oc
    from oncenter.cli.offset import as_table
    from oncenter.errors import WRONG_USAGE
    from oncenter.signals import DEGREE
    from oncenter.simulate import simulate_to_log

    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise oc.OncenterError(f"--output {output}: {error.strerror}", code="output", exit_code=WRONG_USAGE) from None
    log, page = output / "drive.log", output / "report.html"
    truth = simulate_to_log("thesis_drive", seed, log)
    truck = oc.vehicle("scania_r730_4x2")
    answer = oc.offset(oc.read(log), truck)
    oc.report(answer, page)
    typer.echo(as_table(answer))
    typer.echo(f"\n  the truth: offset {truth.offset_rad / DEGREE:.2f} deg, play {truth.backlash_rad / DEGREE:.1f} deg")
    typer.echo(f"  wrote {log} and {page}: open the page in a browser")
