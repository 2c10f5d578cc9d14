"""Hostile logs: each ends in one line, soon, and with little memory."""

from __future__ import annotations

import gzip
import json
import os
import struct
import tomllib
import zlib
from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np
import pytest
from asammdf import MDF, Signal
from base_logs import VEHICLE
from watched import LARGE_MIB, Ended, oncenter, watch

from oncenter.simulate import simulate_to_log

pytestmark = pytest.mark.slow

CSV_HEADER = "time_s,steering_wheel_angle_deg,yaw_rate_deg_s,vehicle_speed_km_h"


def answered(log: Path) -> Ended:
    ended = watch(oncenter("offset", log, "--vehicle", VEHICLE, "--json"))
    assert ended.harm == ""
    return ended


def refused(ended: Ended, exit_code: int = 1) -> str:
    """The error's code, once it is one line and one JSON object."""
    assert ended.harm == ""
    assert ended.code == exit_code
    assert ended.err.startswith("oncenter: ")
    assert len(ended.err.splitlines()) == 1
    error = json.loads(ended.out)
    assert error["schema"] == "oncenter/error-1"
    assert isinstance(error["code"], str)
    return error["code"]


# ---------------------------------------------------------------------------------------------------------------------
# MF4
# ---------------------------------------------------------------------------------------------------------------------

BLOCK_LENGTH, FIRST_LINK, BIT_COUNT = 8, 24, 96  # where a channel block has them; eight links come first

# Blocks to damage: time and a channel of whole numbers; time, the frame as a whole, its identifier, its data.
CHANNEL_BLOCKS = [("channels", 0), ("channels", 1), ("frames", 0), ("frames", 1), ("frames", 3), ("frames", 7)]


@pytest.fixture(scope="module")
def small_mf4(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Half a minute of decoded channels, and of frames."""
    folder = tmp_path_factory.mktemp("mf4")
    time = np.arange(3000) / 100.0
    weave = np.sin(time)
    values = {"steering_wheel_angle_deg": 3.0 * weave, "yaw_rate_deg_s": weave, "vehicle_speed_km_h": time}
    with MDF(version="4.10") as log:
        log.append(
            [
                Signal(np.rint(some * 100).astype(np.int16), time, name=name, conversion={"a": 0.01, "b": 0.0})
                for name, some in values.items()
            ]
        )
        log.save(folder / "channels.mf4", overwrite=True)
    scenario = folder / "scenario.toml"
    scenario.write_text('about = "Half a minute."\nbase = "thesis_drive"\n[drive]\nduration_s = 30.0\n')
    simulate_to_log(scenario, 1, folder / "frames.mf4")
    return {name: (folder / f"{name}.mf4").read_bytes() for name in ("channels", "frames")}


def channel_block(mf4: bytes, number: int) -> int:
    """The place where the block begins."""
    return [place for place in range(0, len(mf4), 8) if mf4[place : place + 8] == b"##CN\0\0\0\0"][number]


def answered_as_if_whole_or_refused(damaged: bytes, whole: bytes, folder: Path) -> None:
    """A reader that does not need the damaged field may continue, with the result of the intact file."""
    log = folder / "log.mf4"
    log.write_bytes(damaged)
    ended = answered(log)
    if ended.code != 0:
        refused(ended)
        return
    log.write_bytes(whole)
    assert json.loads(ended.out)["offset"] == json.loads(answered(log).out)["offset"]


@pytest.mark.parametrize(("kind", "number"), CHANNEL_BLOCKS)
def test_an_mf4_channel_of_255_bits_is_no_crash(
    small_mf4: dict[str, bytes], kind: str, number: int, tmp_path: Path
) -> None:
    damaged = bytearray(small_mf4[kind])
    damaged[channel_block(damaged, number) + BIT_COUNT] = 255
    answered_as_if_whole_or_refused(bytes(damaged), small_mf4[kind], tmp_path)


@pytest.mark.parametrize(("kind", "number"), CHANNEL_BLOCKS)
def test_an_mf4_channel_block_with_a_wrong_length_is_no_crash(
    small_mf4: dict[str, bytes], kind: str, number: int, tmp_path: Path
) -> None:
    damaged = bytearray(small_mf4[kind])
    damaged[channel_block(damaged, number) + BLOCK_LENGTH] = 0xA8
    answered_as_if_whole_or_refused(bytes(damaged), small_mf4[kind], tmp_path)


def test_an_mf4_channel_that_links_to_itself_ends(small_mf4: dict[str, bytes], tmp_path: Path) -> None:
    damaged, log = bytearray(small_mf4["channels"]), tmp_path / "log.mf4"
    block = channel_block(damaged, 1)
    struct.pack_into("<Q", damaged, block + FIRST_LINK, block)
    log.write_bytes(damaged)
    refused(answered(log))


# ---------------------------------------------------------------------------------------------------------------------
# BLF
# ---------------------------------------------------------------------------------------------------------------------


def blf_with_object_of_no_size(header_version: int) -> bytes:
    """200 bytes: a file header of 144, an unpacked container, an object that says that it has no bytes."""
    inner = struct.pack("<4sHHIIII", b"LOBJ", 16, header_version, 0, 115, 0, 0)
    container = struct.pack("<4sHHIIHxxxxxxIxxxx", b"LOBJ", 16, 1, 32 + len(inner), 10, 0, len(inner))
    size = 144 + len(container) + len(inner)
    header = struct.pack("<4sI8xQQI", b"LOGG", 144, size, size, 1).ljust(144, b"\0")
    return header + container + inner


@pytest.mark.parametrize("header_version", [1, 2, 9])
def test_a_blf_object_of_size_zero_ends(header_version: int, tmp_path: Path) -> None:
    log = tmp_path / "log.blf"
    log.write_bytes(blf_with_object_of_no_size(header_version) + bytes(16))
    refused(answered(log))


# ---------------------------------------------------------------------------------------------------------------------
# CSV
# ---------------------------------------------------------------------------------------------------------------------


def test_a_small_csv_gz_of_100_000_columns_takes_little_memory(tmp_path: Path) -> None:
    log = tmp_path / "log.csv.gz"
    rows = "".join(f"{k / 100},{k % 7},{k % 5},60\n" for k in range(2000))
    log.write_bytes(gzip.compress(f"{CSV_HEADER}{',x' * 100_000}\n{rows}".encode()))
    assert log.stat().st_size < 73_000
    ended = answered(log)
    assert ended.code == 0 or refused(ended)


def test_a_csv_gz_of_gigabytes_of_zeros_takes_little_memory(tmp_path: Path) -> None:
    """Members of a gzip file follow each other as one text: 10 MB hold 10 GB."""
    log = tmp_path / "log.csv.gz"
    member = gzip.compress(bytes(10_000_000), 9)
    log.write_bytes(member * 1000)
    assert log.stat().st_size < 11_000_000
    refused(answered(log))


def test_a_csv_gz_of_gigabytes_of_zeros_in_one_stream_takes_little_memory(tmp_path: Path) -> None:
    """Behind a header that promises a table, cut off before its end."""
    packer = zlib.compressobj(9, wbits=31)
    start = packer.compress(f"{CSV_HEADER}\n".encode()) + packer.flush(zlib.Z_FULL_FLUSH)
    zeros = packer.compress(bytes(10_000_000)) + packer.flush(zlib.Z_FULL_FLUSH)
    log = tmp_path / "log.csv.gz"
    log.write_bytes(start + zeros * 1000)
    refused(answered(log))


# ---------------------------------------------------------------------------------------------------------------------
# Parquet
# ---------------------------------------------------------------------------------------------------------------------

I32, I64, BINARY, LIST, STRUCT = 5, 6, 8, 9, 12  # types of Thrift's compact protocol
DOUBLE, REQUIRED, UNCOMPRESSED, PLAIN, RLE, RLE_DICTIONARY, DATA_PAGE, DICTIONARY_PAGE = 5, 0, 0, 0, 3, 8, 0, 2

Field = tuple[int, int, bytes]  # number, type, content


def varint(value: int) -> bytes:
    octets = bytearray()
    while value > 0x7F:
        octets.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*octets, value])


def number(field: int, value: int, kind: int = I32) -> Field:
    return field, kind, varint(value << 1)  # zigzag of a number that is not negative


def text(field: int, value: str) -> Field:
    return field, BINARY, varint(len(value)) + value.encode()


def listed(field: int, kind: int, items: Sequence[bytes]) -> Field:
    assert len(items) < 15
    return field, LIST, bytes([len(items) << 4 | kind]) + b"".join(items)


def struct_of(*fields: Field) -> bytes:
    written, before = b"", 0
    for field, kind, content in fields:
        written += bytes([field - before << 4 | kind]) + content
        before = field
    return written + b"\0"


def page(kind: int, content: bytes, header_field: int, header: bytes) -> bytes:
    size = len(content)
    return struct_of(number(1, kind), number(2, size), number(3, size), (header_field, STRUCT, header)) + content


def parquet_of_one_run(columns: Sequence[str], rows: int) -> bytes:
    """Each column is one value of a dictionary, so many times: some hundred bytes for any number of rows."""
    in_page = min(rows, 2**31 - 1)
    dictionary = page(DICTIONARY_PAGE, struct.pack("<d", 1.0), 7, struct_of(number(1, 1), number(2, PLAIN)))
    run = b"\x01" + varint(in_page << 1) + b"\0"  # indices of one bit, a run, index 0
    of_data = struct_of(number(1, in_page), number(2, RLE_DICTIONARY), number(3, RLE), number(4, RLE))
    pages = dictionary + page(DATA_PAGE, run, 5, of_data)
    schema = [struct_of(text(4, "schema"), number(5, len(columns)))]
    schema += [struct_of(number(1, DOUBLE), number(3, REQUIRED), text(4, name)) for name in columns]
    chunks = []
    for name in columns:
        about = struct_of(
            number(1, DOUBLE),
            listed(2, I32, [varint(PLAIN << 1), varint(RLE_DICTIONARY << 1)]),
            listed(3, BINARY, [text(0, name)[2]]),
            number(4, UNCOMPRESSED),
            number(5, rows, I64),
            number(6, len(pages), I64),
            number(7, len(pages), I64),
            number(9, 4 + len(dictionary), I64),
            number(11, 4, I64),
        )
        chunks.append(struct_of(number(2, 4, I64), (3, STRUCT, about)))
    group = struct_of(listed(1, STRUCT, chunks), number(2, len(pages), I64), number(3, rows, I64))
    footer = struct_of(number(1, 2), listed(2, STRUCT, schema), number(3, rows, I64), listed(4, STRUCT, [group]))
    return b"PAR1" + pages + footer + struct.pack("<I", len(footer)) + b"PAR1"


def test_a_hand_made_parquet_file_is_one(tmp_path: Path) -> None:
    """Otherwise the files below would be refused for another reason than their runs."""
    import pyarrow.parquet as pq

    log = tmp_path / "log.parquet"
    log.write_bytes(parquet_of_one_run(CSV_HEADER.split(","), 1000))
    table = pq.read_table(log)
    assert table.column_names == CSV_HEADER.split(",")
    assert table["time_s"].to_pylist() == [1.0] * 1000
    assert refused(answered(log)) == "time_backward"


@pytest.mark.parametrize("rows", [2**28, 2**31 - 1, 2**40, 2**62])
def test_a_parquet_file_of_one_huge_run_takes_little_memory(rows: int, tmp_path: Path) -> None:
    log = tmp_path / "log.parquet"
    log.write_bytes(parquet_of_one_run(CSV_HEADER.split(","), rows))
    assert log.stat().st_size < 1000
    refused(answered(log))


# ---------------------------------------------------------------------------------------------------------------------
# Not regular files
# ---------------------------------------------------------------------------------------------------------------------

SUFFIXES = (".log", ".mf4", ".csv.gz", ".parquet")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_named_pipe_without_a_writer_does_not_block(suffix: str, tmp_path: Path) -> None:
    pipe = tmp_path / f"a{suffix}"
    os.mkfifo(pipe)
    refused(answered(pipe))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_link_to_an_endless_device_is_not_read(suffix: str, tmp_path: Path) -> None:
    link = tmp_path / f"a{suffix}"
    link.symlink_to("/dev/zero")
    refused(answered(link))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_file_of_nothing_but_a_hole_is_refused_at_once(suffix: str, tmp_path: Path) -> None:
    log = tmp_path / f"a{suffix}"
    with log.open("wb") as file:
        file.truncate(1 << 40)
    ended = answered(log)
    assert refused(ended) == "unreadable_log" and "hole" in ended.err


def test_a_link_to_itself_is_refused(tmp_path: Path) -> None:
    link = tmp_path / "a.log"
    link.symlink_to(link)
    refused(answered(link))


@pytest.fixture
def good_log(tmp_path: Path) -> Path:
    log = tmp_path / "good.csv"
    log.write_text(f"{CSV_HEADER}\n" + "".join(f"{k / 100},{k % 7},{k % 5},60\n" for k in range(2000)))
    return log


def test_a_named_pipe_as_vehicle_file_does_not_block(good_log: Path, tmp_path: Path) -> None:
    pipe = tmp_path / "truck.toml"
    os.mkfifo(pipe)
    refused(watch(oncenter("offset", good_log, "--vehicle", pipe, "--json")), exit_code=2)


def test_a_named_pipe_as_dbc_does_not_block(tmp_path: Path) -> None:
    pipe, log = tmp_path / "bus.dbc", tmp_path / "bus.log"
    os.mkfifo(pipe)
    log.write_text("(1700000000.123456) can0 18F0093E#697D7F637D577F7D\n" * 10)
    refused(watch(oncenter("offset", log, "--vehicle", VEHICLE, "--dbc", pipe, "--json")), exit_code=2)


# ---------------------------------------------------------------------------------------------------------------------
# Other verbs that read a log
# ---------------------------------------------------------------------------------------------------------------------


def written(folder: Path, *arguments: str | Path) -> Ended:
    """A new vehicle file in the folder."""
    values = ("--wheelbase-m", "3.7", "--steering-ratio", "19")
    return watch(oncenter("vehicle", "new", folder / "new.toml", *values, *arguments))


@pytest.mark.parametrize("kind", ["pipe", "device", "bomb"])
def test_a_new_vehicle_file_is_written_from_no_hostile_log(kind: str, tmp_path: Path) -> None:
    log = tmp_path / "log.csv.gz"
    if kind == "pipe":
        os.mkfifo(log)
    elif kind == "device":
        log.symlink_to("/dev/zero")
    else:
        log.write_bytes(gzip.compress(f"{CSV_HEADER}\n".encode()) + gzip.compress(bytes(10_000_000), 9) * 400)
    ended = written(tmp_path, "--log", log)
    assert (ended.code, ended.err.count("\n")) == (1, 1) and ended.peak_mib < LARGE_MIB
    assert not (tmp_path / "new.toml").exists()


def test_names_that_no_vehicle_file_can_hold_are_not_proposed(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    odd = ("yaw_rate\x7f_deg_s", "\x1b[31mlateral acceleration [m/s2]", "vehicle speed" + "_" * 300)
    log.write_text(f"time_s,steering_wheel_angle_deg,{','.join(odd)}\n" + "0,0,0,0,0\n" * 3)
    ended = written(tmp_path, "--log", log)
    assert (ended.harm, ended.code) == ("", 0)
    proposed = tomllib.loads((tmp_path / "new.toml").read_text())["signals"]
    assert list(proposed) == ["steering_wheel_angle"]


def test_a_vehicle_file_that_could_not_be_read_again_is_not_written(tmp_path: Path) -> None:
    ended = written(tmp_path, "--signal", "yaw_rate=a\x7fb,deg_s")
    assert (ended.harm, ended.code) == ("", 2)
    assert "contains a control character" in ended.err and not (tmp_path / "new.toml").exists()


def test_a_database_of_20_000_similar_names_is_proposed_from_in_time(tmp_path: Path) -> None:
    names = [f"YawRate_{k}" for k in range(8)]
    signals = "\n".join(f' SG_ {name} : {8 * k}|8@1+ (0.1,0) [0|25] "deg/s" A' for k, name in enumerate(names))
    messages = "\n\n".join(f"BO_ {(1 << 31) + 256 * k} M{k}: 8 A\n{signals}" for k in range(2500))
    (tmp_path / "bus.dbc").write_text(f'VERSION ""\n\nBU_: A\n\n{messages}\n')
    ended = written(tmp_path, "--dbc", tmp_path / "bus.dbc")
    assert (ended.code, ended.out.splitlines()[-1][:5]) == (0, "wrote") and ended.cpu_s < 20.0


# ---------------------------------------------------------------------------------------------------------------------
# Logs that name other files
# ---------------------------------------------------------------------------------------------------------------------


def test_a_pipe_among_the_parts_of_a_bag_does_not_block(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").touch()
    os.mkfifo(tmp_path / "part_0.mcap")
    refused(answered(tmp_path))


def test_a_part_of_a_bag_is_no_link_to_another_folder(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").touch()
    (tmp_path / "away.mcap").write_bytes(b"\x89MCAP0\r\n")
    (tmp_path / "bag" / "part_0.mcap").symlink_to("../away.mcap")
    assert refused(answered(tmp_path / "bag")) == "unreadable_log"
    assert "leads out of the bag" in answered(tmp_path / "bag").err


@pytest.mark.parametrize("target", ["pipe", "secret"])
def test_the_references_of_a_mat_file_are_read_from_no_other_file(target: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "secret").write_bytes(bytes(80))
    log = tmp_path / "log.mat"
    with h5py.File(log, "w", userblock_size=512) as file:
        struct = file.create_group("s")
        struct.attrs["MATLAB_class"] = np.bytes_("struct")
        elsewhere = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        elsewhere.set_external(os.fsencode(tmp_path / target), 0, 80)
        space = h5py.h5s.create_simple((10, 1))
        h5py.h5d.create(struct.id, b"x", h5py.h5t.STD_REF_OBJ, space, elsewhere)
    ended = answered(log)
    assert refused(ended) != "reader_time" and "reference" not in ended.err


@pytest.mark.parametrize("is_packed", [False, True])
@pytest.mark.parametrize(
    "damage", ["type beyond the table", "type of a matrix", "no dimensions", "no numbers", "no text"]
)
def test_an_element_that_would_crash_the_reader_of_mat_files_is_refused(
    damage: str, is_packed: bool, tmp_path: Path
) -> None:
    """scipy takes the type as an index of a table, and writes through the pointer that it finds behind the table."""
    numbers = struct.pack("<II", 9, 80) + np.arange(10.0).tobytes()
    dimensions, class_ = struct.pack("<IIii", 5, 8, 1, 10), 6
    if damage == "type beyond the table":
        numbers = struct.pack("<I", 0xFF00) + numbers[4:]
    elif damage == "type of a matrix":
        numbers = struct.pack("<I", 14) + numbers[4:]
    elif damage == "no dimensions":
        dimensions, class_, numbers = struct.pack("<II", 5, 0), 4, struct.pack("<II4s4x", 16, 4, b"text")
    else:
        numbers, class_ = b"", 4 if damage == "no text" else 6
    inner = struct.pack("<IIII", 6, 8, class_, 0) + dimensions + struct.pack("<II4s4x", 1, 4, b"time") + numbers
    matrix = struct.pack("<II", 14, len(inner)) + inner
    packed = zlib.compress(matrix)
    element = struct.pack("<II", 15, len(packed)) + packed if is_packed else matrix
    log = tmp_path / "log.mat"
    log.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + element)
    assert refused(answered(log)) == "unreadable_log"
