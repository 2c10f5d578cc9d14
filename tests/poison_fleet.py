"""A fleet of 60 logs of which 20 are poison, a kind each."""

from __future__ import annotations

import gzip
import os
import struct
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from asammdf import MDF, Signal
from base_logs import VEHICLE, write_base_logs
from test_estimate import steady_drive
from test_hostile_logs import (
    BIT_COUNT,
    BLOCK_LENGTH,
    CSV_HEADER,
    FIRST_LINK,
    blf_with_object_of_no_size,
    channel_block,
    parquet_of_one_run,
)
from two_trucks import DAY_S, MONDAY_S

from oncenter.files.log_formats import OF_BAGS

Base = Mapping[str, tuple[Path, ...]]  # good logs by format, see `write_base_logs`
Write = Callable[[Path, Base], None]

ANSWERED, NAMED = 39, 21

# Writes a file if a reader evaluates it; asammdf's own check drops what stands between quotation marks.
_RUNS_CODE = '"\'" and (lambda: __import__("pathlib").Path("CODE_RAN").touch())() and "\'" or X'
_ZEROS_AT_ONCE = 10_000_000
_UNITS = {"rad": "rad", "rad_s": "rad/s", "m_s": "m/s", "m_s2": "m/s²"}


@dataclass(frozen=True)
class Kind:
    """A kind of log.

    Attributes:
        about: for people.
        file: its name, which says its format.
        code: of its row's error; empty where it is answered.
    """

    about: str
    file: str
    code: str
    write: Write


def write_poison_fleet(root: Path) -> None:
    """`vehicles` and `logs`, in which every third log is poison as long as there is any."""
    for name in ("vehicles", "base", "logs"):
        (root / name).mkdir()
    (root / "vehicles" / "depot-7.toml").write_text("wheelbase_m = 3.7\nsteering_ratio = 19.3\n")
    (root / "vehicles" / "YS2R4X2.toml").write_text("wheelbase_m = 3.7\nsteering_ratio = 19.3\n")
    (root / "vehicles" / "scania.toml").write_text(VEHICLE.read_text(encoding="utf-8"))
    base = write_base_logs(root / "base")
    named = [path for paths in base.values() for path in paths if path.suffix not in OF_BAGS]  # those need a table
    good = [*STRANGE, *(Kind("good", path.name, "", _copy_of(path)) for path in named)]
    good += [_steady(day) for day in range(ANSWERED - len(good))]
    for place, poison in enumerate(POISON):
        good.insert(3 * place, poison)
    for place, kind in enumerate(good):
        folder = root / "logs" / ("no-truck" if kind is _LONG_VIN else "scania" if _is_simulated(kind) else "depot-7")
        folder.mkdir(exist_ok=True)
        kind.write(folder / f"{place:02}-{kind.file}", base)


def kind_of(log: str) -> Kind | None:
    """The kind of a poisonous log of the fleet."""
    file = Path(log).name.partition("-")[2]
    return next((kind for kind in POISON if kind.file == file), None)


def _is_simulated(kind: Kind) -> bool:
    return kind.about == "good" and not kind.file.startswith("day")


def _copy_of(good: Path) -> Write:
    return lambda path, _: path.write_bytes(good.read_bytes()) and None


def _steady(day: int) -> Kind:
    def write(path: Path, _: Base) -> None:
        table = steady_drive(offset_deg=0.5, start_s=MONDAY_S + day * DAY_S).table
        noise = np.random.default_rng(day).normal(0.0, 0.003, table.height)
        table = table.with_columns(pl.col("steering_wheel_angle_rad") + noise)
        if path.suffix == ".parquet":
            table.write_parquet(path)
        else:
            text = table.write_csv().encode()
            path.write_bytes(gzip.compress(text, 1) if path.suffix == ".gz" else text)

    return Kind("good", f"day{day}.{('parquet', 'csv', 'csv.gz')[day % 3]}", "", write)


# ---------------------------------------------------------------------------------------------------------------------
# What is done to a good log
# ---------------------------------------------------------------------------------------------------------------------


def _damaged(log_format: str, which: int, damage: Callable[[bytearray], None]) -> Write:
    def write(path: Path, base: Base) -> None:
        data = bytearray(base[log_format][which].read_bytes())
        damage(data)
        path.write_bytes(data)

    return write


def _put(number: int, place: int, layout: str, value: int | None) -> Callable[[bytearray], None]:
    """Into an MF4 file's channel block of that number; None is the block's own address."""

    def damage(data: bytearray) -> None:
        block = channel_block(bytes(data), number)
        struct.pack_into(layout, data, block + place, block if value is None else value)

    return damage


def _cut(data: bytearray) -> None:
    del data[len(data) // 2 :]


def _packed_zeros(count: int) -> bytes:
    """Deflated: a part that repeats, each packed without a look at the one before."""
    packer = zlib.compressobj(9, wbits=-15)
    once = packer.compress(bytes(_ZEROS_AT_ONCE)) + packer.flush(zlib.Z_FULL_FLUSH)
    return once * (count // _ZEROS_AT_ONCE) + packer.flush(zlib.Z_FINISH)


def _grow(data: bytearray) -> None:
    """The data of an MF4 file's first group become 6 GB of zeros, packed in a block at the file's end."""
    size = 600 * _ZEROS_AT_ONCE
    packed = b"\x78\xda" + _packed_zeros(size) + struct.pack(">HH", size % 65521, 1)  # Adler-32 of zeros
    data += bytes(-len(data) % 8)
    group = next(place for place in range(0, len(data), 8) if data[place : place + 8] == b"##DG\0\0\0\0")
    struct.pack_into("<Q", data, group + 40, len(data))  # its link to its data
    data += struct.pack("<4s4xQQ2sBxIQQ", b"##DZ", 48 + len(packed), 0, b"DT", 0, 0, size, len(packed)) + packed


# ---------------------------------------------------------------------------------------------------------------------
# What is made
# ---------------------------------------------------------------------------------------------------------------------


def _with_formula(formula: str) -> Write:
    """Writes a log with the formula as the conversion of the yaw rate."""

    def write(path: Path, _: Base) -> None:
        _write_channels(path, steady_drive().table, {"yaw_rate_rad_s": {"formula": formula}})

    return write


def _write_channels(path: Path, table: pl.DataFrame, conversions: Mapping[str, dict[str, str]]) -> None:
    time = table["time_s"].to_numpy()
    with MDF(version="4.10") as mdf:
        for name in table.columns[1:]:
            unit = next((_UNITS[end] for end in sorted(_UNITS, key=len) if name.endswith(f"_{end}")), "")
            mdf.append([Signal(table[name].to_numpy(), time, name=name, unit=unit, conversion=conversions.get(name))])
        mdf.save(path)


def _endless(path: Path, _: Base) -> None:
    """Small, since the time that its reader gets follows from its size."""
    _write_channels(path, steady_drive().table.head(100), {})
    data = bytearray(path.read_bytes())
    _put(1, FIRST_LINK, "<Q", None)(data)
    path.write_bytes(data)


def _that_begins(start: str) -> Write:
    def write(path: Path, _: Base) -> None:
        steady_drive().table.write_parquet(path, metadata={"start_time": start})

    return write


def _times_that_jump(path: Path, _: Base) -> None:
    late = pl.int_range(pl.len()) > pl.len() // 2
    steady_drive().table.with_columns(pl.col("time_s") + 9e10 * late.cast(pl.Float64)).write_csv(path)


def _of_many_columns(path: Path, _: Base) -> None:
    rows = "".join(f"{k / 100},{k % 7},{k % 5},60\n" for k in range(2000))
    path.write_bytes(gzip.compress(f"{CSV_HEADER}{',x' * 100_000}\n{rows}".encode()))


def _of(content: bytes) -> Write:
    return lambda path, _: path.write_bytes(content) and None


_HUGE_RUN = parquet_of_one_run(CSV_HEADER.split(","), 2**31 - 1)
_GZIP_HEADER = b"\x1f\x8b\x08\0\0\0\0\0\0\xff"
_LONG_VIN = Kind(
    "VIN of 307 characters, which is none",
    "vin.parquet",
    "unknown_truck",
    lambda path, _: steady_drive().table.write_parquet(path, metadata={"vin": "YS2R4X2" + 300 * "A"}),
)
POISON = [
    Kind("MF4 channel that follows itself", "endless.mf4", "reader_time", _endless),
    Kind(
        "MF4 whose reader crashes", "crash.mf4", "reader_crashed", _damaged("mf4", 0, _put(3, BLOCK_LENGTH, "<B", 0xA8))
    ),
    Kind("MF4 of 6 GB in 7 MB", "large.mf4", "reader_memory", _damaged("mf4", 1, _grow)),
    Kind("MF4 channel of 255 bits", "bits.mf4", "unreadable_log", _damaged("mf4", 1, _put(0, BIT_COUNT, "<B", 255))),
    Kind("MF4 frames of 255 bits", "frames.mf4", "unreadable_log", _damaged("mf4", 0, _put(1, BIT_COUNT, "<B", 255))),
    Kind(
        "MF4 time of wrong length", "length.mf4", "rate_too_low", _damaged("mf4", 1, _put(0, BLOCK_LENGTH, "<B", 0xA8))
    ),
    Kind("MF4 cut in the middle", "cut.mf4", "unreadable_log", _damaged("mf4", 1, _cut)),
    Kind("MDF3 cut in the middle", "cut.mdf", "unreadable_log", _damaged("mdf", 0, _cut)),
    Kind("MF4 conversion that runs code", "code.mf4", "unknown_conversion", _with_formula(_RUNS_CODE)),
    Kind("MF4 formula not understood", "formula.mf4", "unknown_conversion", _with_formula("X > 0 ? X : 0")),
    Kind("BLF object of no size", "size.blf", "unreadable_log", _of(blf_with_object_of_no_size(1) + bytes(16))),
    Kind("BLF at which memory grew", "grows.blf", "unreadable_log", _of(blf_with_object_of_no_size(9) + bytes(16))),
    Kind("Parquet of one huge run", "run.parquet", "reader_memory", _of(_HUGE_RUN)),
    Kind("Parquet cut in the middle", "cut.parquet", "unreadable_log", _damaged("parquet", 0, _cut)),
    Kind("csv.gz of 100,000 columns", "columns.csv.gz", "reader_memory", _of_many_columns),
    Kind("csv.gz of 10 GB of zeros", "zeros.csv.gz", "reader_memory", _of(_GZIP_HEADER + _packed_zeros(10**10))),
    Kind("csv.gz cut in the middle", "cut.csv.gz", "unreadable_log", _damaged("csv.gz", 0, _cut)),
    Kind("empty file", "empty.csv", "empty_log", _of(b"")),
    Kind("named pipe", "a.log", "not_a_file", lambda path, _: os.mkfifo(path)),
    Kind("link to /dev/zero", "zero.log", "not_a_file", lambda path, _: path.symlink_to("/dev/zero")),
    _LONG_VIN,
]
STRANGE = [  # logs that once ended the night, and are answered now
    *(
        Kind(f"start_time {start}", f"{start}.parquet", "", _that_begins(start))
        for start in ("nan", "inf", "1e300", "1e14", "-1e14")
    ),
    Kind("times that jump by 9e10 s", "jump.csv", "", _times_that_jump),
]
