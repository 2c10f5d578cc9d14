"""Logs with one fault of the file each: whether the answer suspects the file before the truck.

    python bench/file_faults.py [--kinds a,b] [--drives N] [--seeds tuning|reported] [--jobs N] [--smoke]

The maker is tests/faulty_logs.py: a row of it is a kind, made of N drives on three roads in turn. `oncenter offset`
answers each log. Asked: no estimate that is valid and wrong, no advice to repair or to replace, and the right kind (or
"signal or sensor" where a sensor gives the same data) in 85 % of the logs. The row "none" is a log without a fault.
All records go to build/accuracy/file_faults.json.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from accuracy import BUILD, REPORTED_FROM, TUNING_FROM, names_of
from said import SIGNAL_OR_SENSOR, SIGNAL_WORDS, Statement, is_off, is_valid, statements, wrong

import oncenter as oc
from oncenter.errors import OncenterError

sys.path.append(str(Path(__file__).parents[1] / "tests"))

from faulty_logs import FAULTS, FileFault, Given, Kind
from healthy_drive import TRUCK, HealthyDrive, healthy_drive, written

Record = dict[str, Any]
RIGHT_KIND_MIN = 0.85
NONE = "none"

# What a text has to say for each kind; the signal has to be named beside it. Codes count by their words.
KIND_WORDS: Mapping[Kind, str] = {
    "value in gaps": r"\bzeros?\b.*(gap|between|missing|sample|row)|missing (sample|value)s? .*(as|by|with) |sentinel"
    r"|filler|in gaps",
    "magnitude": r"magnitude|without (its |a |the )?sign\b|absolute value|never negative|unsigned",
    "byte order": r"byte order|endian|intel|motorola",
    "wrong bits": r"(wrong|other) bits|bit field|start bit|byte order|signed|\bnois[ey]",
    "wrong signal": r"assign|(another|wrong|other) signal|not follow|no relation|\bnois[ey]",
    "other unit": r"\bunits?\b|too (large|small) by a factor|factor of",
    "scale": r"\bscales?\b|factor|\bunits?\b|steering ratio|\bgain\b",
    "sign": r"\bsign\b.*revers|revers.*\bsign\b|positive to the (left|right)|opposite sign",
    "stuck": r"stuck|frozen|freeze|stays at|stands still|does not change|held|repeat",
    "lag": r"\blags?\b|\bdelay|\blate\b|\bbehind\b|later than",
    "time stamps": r"time (column|stamp)|column time|unit of the time|clock|stamps?\b|time_s",
    "clock set back": r"clock|backward|set back|wrap",
    "speed at standstill": r"dead zone|creep|coarse|steps? of|resolution|crawl|not (really )?stand",
    "database range": r"\brange\b",
    "wrapped": r"wrap|whole turn|turns?\b.*(360|wrap)|360",
    "end of the range": r"saturat|end of (its|the) (field|range)|clip|limit of (its|the) (field|range)|largest value",
    "whole turn": r"whole turn|360 deg|a turn\b|turns\b",
    "two trucks": r"\bVINs?\b|two trucks|different trucks|vehicle identification",
    "truth": r"\btruth\b|true values|written by oncenter|no log",
    "two senders": r"(disagree|differ)[^.]*(0x|sender|source)|(0x|sender|source)[^.]*(disagree|differ)",
    "CAN FD": r"CAN[- ]?FD",
}
_FILE_NAMES = re.compile(r"\S*drive\S*")  # which contain words, as "truth"
_ACROSS_SIGNALS: Sequence[Kind] = ("time stamps", "clock set back", "two trucks", "truth", "two senders", "CAN FD")
_BIAS = "yaw_rate_bias"


def answered(given: Given) -> Record:
    """The object of `oncenter offset --json`. One log is answered in this process, as the command line does."""
    *logs, _, truck = given.arguments
    if len(logs) > 1:
        command = [sys.executable, "-m", "oncenter", "offset", *given.arguments, "--json"]
        done: Record = json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)
        return done
    try:
        vehicle = oc.vehicle(truck)
        return oc.offset(oc.read(logs[0], vehicle=vehicle), vehicle).to_dict()
    except OncenterError as error:
        return {"code": error.code, "message": str(error)}


def says_kind(fault: FileFault, said: Statement) -> bool:
    """Whether the statement says what is wrong with the file, and with which signal."""
    signal = next((name for name in SIGNAL_WORDS if fault.column.startswith(name)), "")
    if signal and fault.kind not in _ACROSS_SIGNALS and not said.names(signal):
        return False
    if fault.is_ambiguous and SIGNAL_OR_SENSOR.search(said.text):
        return True
    text = _FILE_NAMES.sub("", f"{said.text} ({said.code.replace('_', ' ')})")
    return bool(re.search(KIND_WORDS[fault.kind], text, re.IGNORECASE))


def record(name: str, drive: HealthyDrive, folder: Path) -> Record:
    """One log."""
    if name == NONE:
        log = written(drive.columns, folder / "drive.parquet")
        given = Given((str(log), "--vehicle", TRUCK), (drive.offset_deg,))
    else:
        given = FAULTS[name].given(drive, folder)
    return judged(name, drive, given, answered(given))


def judged(name: str, drive: HealthyDrive, given: Given, answer: Record) -> Record:
    said = statements(answer)
    fault = FAULTS.get(name)
    spoiled = [_BIAS] if fault and (fault.column == "yaw_rate_rad_s" or not given.offsets_deg) else []
    off = list(wrong(answer, given.offsets_deg, drive.truth, spoiled))
    repairs = [each.text for each in said if each.is_repair]
    answers_right = is_valid(answer) and not is_off(answer, given.offsets_deg)
    names = fault is not None and any(says_kind(fault, each) for each in said)
    undone = fault is not None and fault.can_be_undone and answers_right
    return {
        "kind": name,
        "seed": drive.seed,
        "road": drive.road,
        "true": drive.offset_deg,
        "offset": answer.get("offset"),
        "wrong": off,
        "repairs": repairs,
        "named": names,
        "answered": answers_right,
        "right": (names or undone) and not off and not repairs,
        "said": [f"{each.severity} {each.code}: {each.text}" for each in said],
    }


def records(seed: int, kinds: Sequence[str], minutes: float) -> list[Record]:
    """All kinds of one drive."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        drive = healthy_drive(seed, folder, minutes=minutes)
        found = []
        for kind in kinds:
            with tempfile.TemporaryDirectory(dir=folder) as own:
                found.append(record(kind, drive, Path(own)))
        return found


def run_all(kinds: Sequence[str], seeds: Sequence[int], minutes: float, jobs: int) -> list[Record]:
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        waiting = [pool.submit(records, seed, kinds, minutes) for seed in seeds]
        return [record for future in waiting for record in future.result()]


def lines(found: Sequence[Record]) -> Iterator[str]:
    yield "| log | logs | wrong and valid | repair advised | kind named | answered right | right |"
    yield "|---|--:|--:|--:|--:|--:|--:|"
    for name in dict.fromkeys(record["kind"] for record in found):
        yield _line(name, [record for record in found if record["kind"] == name])
    faulty = [record for record in found if record["kind"] != NONE]
    if not faulty:
        return
    yield _line("all with a fault", faulty)
    right = sum(record["right"] for record in faulty) / len(faulty)
    checks = (
        ("wrong and valid", f"{sum(bool(record['wrong']) for record in faulty)}", "0"),
        ("repair advised", f"{sum(bool(record['repairs']) for record in faulty)}", "0"),
        ("right", f"{right:.0%}", f"at least {RIGHT_KIND_MIN:.0%}"),
    )
    yield ""
    yield from (f"{what}: {is_now} (asked: {asked})" for what, is_now, asked in checks)


def _line(name: str, some: Sequence[Record]) -> str:
    estimates = sorted({estimate for record in some for estimate in record["wrong"]})
    of = f" ({', '.join(estimates)})" if estimates else ""
    counts = [sum(bool(record[key]) for record in some) for key in ("wrong", "repairs", "named", "answered", "right")]
    cells = [f"{counts[0]}{of}", *map(str, counts[1:])]
    return f"| {name} | {len(some)} | {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", default="", help="names separated by commas; default: all")
    parser.add_argument("--drives", type=int, default=6, help="of each kind (6)")
    parser.add_argument(
        "--seeds", choices=("tuning", "reported"), default="reported", help="from 1 on, or from 1001 on"
    )
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--smoke", action="store_true", help="one drive of 3 minutes: whether the bench runs")
    given = parser.parse_args()
    first = TUNING_FROM if given.seeds == "tuning" else REPORTED_FROM
    seeds = range(first, first + (1 if given.smoke else given.drives))
    kinds = names_of(given.kinds, [NONE, *FAULTS], "kind")
    found = run_all(kinds, seeds, 3.0 if given.smoke else 20.0, given.jobs)
    BUILD.mkdir(parents=True, exist_ok=True)
    (BUILD / "file_faults.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    print("\n".join(lines(found)))


if __name__ == "__main__":
    main()
