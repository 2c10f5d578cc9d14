"""Mutated logs against `oncenter offset`: no crash, no hang, no excessive memory, and no wrong valid answer.

Each mutant is read as by a user, in a separate process. If the answer is valid, an independent reader decodes the same
mutant and the offset is computed from its table here: the two offsets must agree.

`make fuzz` runs this as a script. One mutant alone: `python tests/fuzz_logs.py --format mf4 --seed 17`.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import statistics
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from base_logs import VEHICLE, write_base_logs
from mutate_logs import FORMATS, mutate
from signal_logs import TOPICS
from watched import KILL_MIB, KILL_S, LARGE_MIB, SLOW_S, Ended, oncenter, watch

from oncenter import offset, read, vehicle
from oncenter.errors import OncenterError
from oncenter.files.child import ChildDied, ChildFailed, Limits, borrowed
from oncenter.files.log_formats import OF_BAGS

AGREE_DEG = 0.5
_INDEPENDENT = Limits(cpu_s=KILL_S, resident_bytes=2 * KILL_MIB << 20)
_TRUCK = vehicle(VEHICLE)
# So that child processes find the independent readers.
os.environ["PYTHONPATH"] = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])

BaseLogs = Mapping[str, Sequence[Path]]


@dataclass(frozen=True)
class Tried:
    """The result of one mutant.

    Attributes:
        code: the JSON error's code of a refusal, else empty.
        difference_deg: between the valid offset and the one from the independent reader's table; None where there is
            none.
        wrong: the reason for a failure; empty without one.
    """

    log_format: str
    seed: int
    mutation: str
    ended: Ended
    status: str = ""
    code: str = ""
    difference_deg: float | None = None
    wrong: str = ""

    @property
    def line(self) -> str:
        return f"{self.log_format} {self.seed} ({self.mutation}): {self.wrong}"


def mutant(base_logs: BaseLogs, log_format: str, seed: int, folder: Path) -> tuple[Path, str]:
    """Writes a mutant and returns a description of its damage. The base logs of a format take turns."""
    bases = base_logs[log_format]
    content, mutation = mutate(log_format, seed, bases[seed % len(bases)].read_bytes())
    path = folder / f"mutant-{seed}.{log_format}"
    path.write_bytes(content)
    return path, mutation


def tried(base_logs: BaseLogs, log_format: str, seed: int) -> Tried:
    """Reads one mutant and judges the result."""
    with tempfile.TemporaryDirectory(prefix="mutant") as folder:
        log, mutation = mutant(base_logs, log_format, seed, Path(folder))
        ended = watch(answer_command(log))
        if ended.waited:  # a hang waits twice, a busy machine rarely
            ended = watch(answer_command(log))
        try:
            return _judged(Tried(log_format, seed, mutation, ended), log)
        finally:
            log.unlink()


def answer_command(log: Path) -> list[str]:
    return oncenter("offset", log, "--vehicle", _vehicle_of(log), "--json")


def _vehicle_of(log: Path) -> Path:
    """The vehicle file, written beside the log where its signals must be named."""
    if log.suffix not in OF_BAGS:
        return VEHICLE
    file = log.with_name("truck.toml")
    units = {signal: f', unit = "{entry.unit}"' if entry.unit else "" for signal, entry in TOPICS.items()}
    entries = (f'{signal} = {{ name = "{entry.name}"{units[signal]} }}' for signal, entry in TOPICS.items())
    file.write_text("\n".join([VEHICLE.read_text(encoding="utf-8"), "[signals]", *entries]), encoding="utf-8")
    return file


def _judged(mutant: Tried, log: Path) -> Tried:
    given, wrong = _spoken(mutant.ended)
    code, status = str(given.get("code", "")), str(given.get("offset", {}).get("status", ""))
    difference = None
    if not wrong and status == "valid":
        difference, wrong = difference_of(given["offset"]["value"], log)
    return Tried(mutant.log_format, mutant.seed, mutant.mutation, mutant.ended, status, code, difference, wrong)


def _spoken(ended: Ended) -> tuple[dict[str, Any], str]:
    """The JSON object of standard output, and the fault of the command's end, if any."""
    if ended.harm:
        return {}, ended.harm
    if ended.code not in (0, 1):
        return {}, f"exit {ended.code}: {ended.err.strip()[-300:]}"
    try:
        given = json.loads(ended.out, parse_constant=_no_number)
    except ValueError as error:
        return {}, f"exit {ended.code} without a JSON object: {error}"
    lines = ended.err.splitlines()
    if ended.code == 0 and lines:
        return given, f"standard error of an answer: {ended.err[:300]}"
    if ended.code == 1 and (len(lines) != 1 or not lines[0].startswith("oncenter: ")):
        return given, f"{len(lines)} lines of standard error: {ended.err[:300]}"
    return given, ""


def _no_number(constant: str) -> float:
    raise ValueError(f"{constant} in the answer")


def difference_of(offset_deg: float, log: Path) -> tuple[float | None, str]:
    """The difference to the offset from the independent reader's table, and why it is a failure."""
    table = log.with_name("independent.parquet")
    try:
        with borrowed("independent_readers") as child:
            list(child.ask({"log": str(log), "table": str(table)}, _INDEPENDENT))
    except (ChildDied, ChildFailed) as failure:
        return None, f"valid, but the independent reader cannot read it: {str(failure).splitlines()[-1][:200]}"
    try:
        value = offset(read(table), _TRUCK).offset.to_dict()["value"]
    except OncenterError as error:
        return None, f"valid, but not from the independent reader's table: {error}"
    finally:
        table.unlink()
    if value is None:
        return None, "valid, but not from the independent reader's table"
    difference = abs(offset_deg - value)
    wrong = f"{offset_deg:.3f} deg, valid; {value:.3f} deg as an independent reader decodes it"
    return difference, wrong if difference > AGREE_DEG else ""


def trials(base_logs: BaseLogs, wanted: Sequence[tuple[str, int]], jobs: int) -> Iterator[Tried]:
    """Runs formats and seeds in order."""
    with ThreadPoolExecutor(jobs) as pool:
        yield from pool.map(lambda one: tried(base_logs, *one), wanted)


# ---------------------------------------------------------------------------------------------------------------------
# The script
# ---------------------------------------------------------------------------------------------------------------------

_HEADER = (
    "| format | mutants | answered | valid | refused | "
    f"over {SLOW_S:.0f} s | signals | exit 70 | over {LARGE_MIB} MiB | median s | peak MiB | compared | worst deg |"
)


def table_row(name: str, of_format: Sequence[Tried]) -> str:
    ended = [one.ended for one in of_format]
    differences = [one.difference_deg for one in of_format if one.difference_deg is not None]
    cells = (
        name,
        len(of_format),
        sum(one.code == 0 for one in ended),
        sum(one.status == "valid" for one in of_format),
        sum(one.code == 1 for one in ended),
        sum(one.seconds > SLOW_S for one in ended),
        sum(one.code is not None and one.code < 0 for one in ended),
        sum(one.code == 70 for one in ended),
        sum(one.peak_mib > LARGE_MIB for one in ended),
        f"{statistics.median(one.seconds for one in ended):.1f}",
        f"{max(one.peak_mib for one in ended):.0f}",
        len(differences),
        f"{max(differences):.3f}" if differences else "-",
    )
    return "| " + " | ".join(map(str, cells)) + " |"


def report(all_tried: Sequence[Tried]) -> str:
    """A table by format, refusals by code, and each failure on a line."""
    by_format = {name: [one for one in all_tried if one.log_format == name] for name in FORMATS}
    rows = [table_row(name, some) for name, some in by_format.items() if some]
    codes = {name: Counter(one.code for one in some if one.code) for name, some in by_format.items() if some}
    failures = [one.line for one in all_tried if one.wrong]
    return "\n".join(
        [
            _HEADER,
            "|---|" + "--:|" * (_HEADER.count("|") - 2),
            *rows,
            table_row("all", all_tried),
            "",
            "Refusals by code:",
            *(f"{name}: {', '.join(f'{code} {n}' for code, n in of.most_common())}" for name, of in codes.items()),
            "",
            f"{len(failures)} failures:",
            *failures,
        ]
    )


def _one(base_logs: BaseLogs, log_format: str, seed: int, folder: Path) -> Tried:
    """Runs a mutant again and keeps its log for inspection."""
    log, mutation = mutant(base_logs, log_format, seed, folder)
    print(f"{mutation}\n{shlex.join(answer_command(log))}")
    one = tried(base_logs, log_format, seed)
    print(f"exit {one.ended.code}, {one.ended.seconds:.1f} s, {one.ended.peak_mib:.0f} MiB")
    print(one.ended.out + one.ended.err)
    print(one.wrong or f"no failure; difference: {one.difference_deg}")
    return one


def main() -> int:
    options = argparse.ArgumentParser(description="Mutated logs against oncenter offset.")
    options.add_argument("--mutations", type=int, default=500, help="of each format")
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--format", choices=FORMATS, action="append", help="only this one; may be given again")
    options.add_argument("--seed", type=int, help="this mutant alone")
    options.add_argument("--folder", type=Path, default=Path("build/fuzz/logs"), help="of base logs and of one mutant")
    given = options.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    folder = given.folder.resolve()
    base_logs, formats = write_base_logs(folder), given.format or FORMATS
    if given.seed is not None:
        return int(any(_one(base_logs, name, given.seed, folder).wrong for name in formats))
    wanted = [(name, seed) for name in formats for seed in range(given.mutations)]
    all_tried = []
    for one in trials(base_logs, wanted, given.jobs):
        all_tried.append(one)
        if one.wrong:
            print(one.line, file=sys.stderr, flush=True)
    print(report(all_tried))
    return int(any(one.wrong for one in all_tried))


if __name__ == "__main__":
    sys.exit(main())
