"""`oncenter vehicle new --log --dbc` on simulated drives in the frames of each network of ../shared/data/opendbc.

    .venv/bin/python bench/by_database.py [--scenario country] [--seed 1]

For each database of `signals.csv`, one simulated drive is written twice: as J1939, and in the frames of that database.
`vehicle new` writes a vehicle file from the database and the log, and its answer is compared with that of the J1939 log
by the truck's own file. A yaw rate, speed or lateral acceleration that signals.csv does not name for the database comes
from a second database. Printed by database: proposals, both answers, and the truth.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import io
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

import oncenter as oc
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.read.database_file import read_database
from oncenter.signals import DEGREE, Signals
from oncenter.simulate import simulate_to_log

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

ROOT = Path(__file__).parents[1] / ".." / "shared" / "data" / "opendbc"
EXTRA = """VERSION ""

BO_ 2000 EXTRA: 8 X
 SG_ YawRate : 0|16@1- (0.01,0) [0|0] "deg/s" X
 SG_ VehicleSpeed : 16|16@1+ (0.01,0) [0|0] "km/h" X
 SG_ LateralAcceleration : 32|16@1- (0.002,0) [0|0] "m/s2" X
"""
IN_EXTRA = {
    "yaw_rate": ("YawRate", 1 / DEGREE),
    "vehicle_speed": ("VehicleSpeed", 3.6),
    "lateral_acceleration": ("LateralAcceleration", 1.0),
}
PERIOD_S = 0.02
Words = npt.NDArray[np.uint64]


def rows_of(folder: Path) -> dict[str, list[dict[str, str]]]:
    """The rows of signals.csv by file."""
    by_file: dict[str, list[dict[str, str]]] = {}
    with (folder / "signals.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            by_file.setdefault(row["file"], []).append(row)
    return by_file


def payloads(message: Message, values: dict[str, npt.NDArray[np.float64]]) -> list[str]:
    """Eight bytes of each frame as hex digits, from physical values; other signals are zero."""
    length = len(next(iter(values.values())))
    little, big = np.zeros(length, np.uint64), np.zeros(length, np.uint64)
    by_name: dict[str, Signal] = {signal.name: signal for signal in message.signals}
    for name, physical in values.items():
        layout = by_name[name]
        raw = np.rint((physical - float(layout.offset)) / float(layout.scale)).astype(np.int64)
        low = -(1 << (layout.length - 1)) if layout.is_signed else 0
        raw = np.clip(raw, low, low + (1 << layout.length) - 1).astype(np.uint64)
        bits = (raw & np.uint64((1 << layout.length) - 1)) << np.uint64(shift_of(layout))
        if layout.byte_order == "little_endian":
            little |= bits
        else:
            big |= bits
    whole = little.astype("<u8").view(np.uint8) | big.astype(">u8").view(np.uint8)
    digits = whole.tobytes().hex().upper()
    return [digits[16 * k : 16 * k + 16] for k in range(length)]


def shift_of(layout: Signal) -> int:
    """Of a signal in the first eight bytes, read in its byte order."""
    if layout.byte_order == "little_endian":
        return int(layout.start)
    first = 8 * (layout.start // 8) + 7 - layout.start % 8  # bits from the first of the frame
    return int(64 - first - layout.length)


def parts(
    row: dict[str, str], message: Message, physical: npt.NDArray[np.float64]
) -> dict[str, npt.NDArray[np.float64]]:
    """The values of a signal, and of its sign or its fraction."""
    if row["sign_signal"]:
        return {row["signal"]: np.abs(physical), row["sign_signal"]: (physical < 0).astype(np.float64)}
    if row["added_signal"]:
        step = abs(float(next(each.scale for each in message.signals if each.name == row["signal"])))
        coarse = np.rint(physical / step) * step
        return {row["signal"]: coarse, row["added_signal"]: physical - coarse}
    return {row["signal"]: physical}


def encoded(drive: Signals, database: Path, rows: Sequence[dict[str, str]], folder: Path) -> tuple[Path, list[Path]]:
    """The drive in frames of a database and of the second one; the log and the databases."""
    (folder / "extra.dbc").write_text(EXTRA)
    every = max(1, round(PERIOD_S * drive.rate_hz))
    time = drive.columns["time_s"][::every]
    columns = {name: np.nan_to_num(values[::every]) for name, values in drive.columns.items()}
    in_deg = {
        "steering_wheel_angle": columns["steering_wheel_angle_rad"] / DEGREE,
        "yaw_rate": columns["yaw_rate_rad_s"] / DEGREE,
    }
    by_name = {message.name: message for message in read_database(database).messages}
    values: dict[str, dict[str, npt.NDArray[np.float64]]] = {}
    for row in rows:
        of_message = values.setdefault(row["message"], {})
        of_message |= parts(row, by_name[row["message"]], in_deg[row["quantity"]])
    frames = [(by_name[name], of_message) for name, of_message in values.items()]
    missing = IN_EXTRA.keys() - {row["quantity"] for row in rows}
    (extra,) = read_database(folder / "extra.dbc").messages
    units = {"yaw_rate": "rad_s", "vehicle_speed": "m_s", "lateral_acceleration": "m_s2"}
    added = {IN_EXTRA[name][0]: columns[f"{name}_{units[name]}"] * IN_EXTRA[name][1] for name in missing}
    frames.append((extra, added))
    return written(time, frames, folder / "drive.log"), [database, folder / "extra.dbc"]


def written(
    time: npt.NDArray[np.float64],
    frames: Sequence[tuple[Message, dict[str, npt.NDArray[np.float64]]]],
    log: Path,
) -> Path:
    def lines() -> Iterator[tuple[float, str]]:
        for number, (message, values) in enumerate(frames):
            identifier = f"{message.frame_id:08X}" if message.is_extended_frame else f"{message.frame_id:03X}"
            for at, payload in zip((time + 1e-4 * number).tolist(), payloads(message, values), strict=True):
                yield at, f"({at:.6f}) can0 {identifier}#{payload}\n"

    log.write_text("".join(line for _, line in sorted(lines())))
    return log


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--scenario", default="thesis_drive")
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("--only", default="", help="part of a database's name")
    given = asked.parse_args()
    if not ROOT.exists():
        print(f"0 databases: {ROOT} does not exist")
        return
    with tempfile.TemporaryDirectory() as name:
        native = Path(name) / "native.log"
        truth = simulate_to_log(given.scenario, given.seed, native)
        truck = oc.Vehicle(
            name="truck",
            wheelbase_m=truth.equivalent_wheelbase_m,
            steering_ratio=truth.steering_ratio,
            traffic_side="right",
        )
        drive = oc.read(native)
        alone = oc.offset(drive, truck)
        print(f"true {truth.offset_rad / DEGREE:.2f} deg; native {alone.offset}")
        by_file = {file: rows for file, rows in rows_of(ROOT).items() if given.only in file}
        right = 0
        for number, (file, rows) in enumerate(by_file.items()):
            folder = Path(name) / str(number)
            folder.mkdir()
            log, databases = encoded(drive, ROOT / file, rows, folder)
            try:
                answer = answered(log, databases, truck, folder / "truck.toml")
            except OncenterError as error:
                print(f"WRONG {file:40} {error}")
                continue
            bounds = answer.offset.ci95
            holds = bounds is not None and bounds[0] <= truth.offset_rad <= bounds[1]
            is_right = holds and answer.offset.status == alone.offset.status
            right += is_right
            print(f"{'right' if is_right else 'WRONG'} {file:40} {answer.offset}")
        print(f"{right} of {len(by_file)}")


def answered(log: Path, databases: Sequence[Path], truck: oc.Vehicle, file: Path) -> oc.Answer:
    """The answer by the vehicle file that `vehicle new` writes, as it is."""
    dbc = [word for each in databases for word in ("--dbc", str(each))]
    known = ["--wheelbase-m", repr(truck.wheelbase_m), "--steering-ratio", repr(truck.ratio_near_centre)]
    with contextlib.redirect_stdout(io.StringIO()) as said:
        if run(["vehicle", "new", str(file), *known, "--traffic-side", "right", *dbc, "--log", str(log)]) != 0:
            raise OncenterError(said.getvalue(), code="bench")
    written_by_it = oc.vehicle(file)
    return oc.offset(oc.read(log, vehicle=written_by_it), written_by_it)


if __name__ == "__main__":
    main()
