"""The table of formats: what a row names exists, and no row hides another."""

from __future__ import annotations

import tomllib
from itertools import permutations
from pathlib import Path

import pytest
from drive_frames import candump, drive

from oncenter.errors import OncenterError
from oncenter.files.log_formats import FORMATS, Format, format_of_content, imported
from oncenter.read import read

EXTRAS = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"][
    "optional-dependencies"
]


@pytest.mark.parametrize("row", FORMATS, ids=lambda row: row.suffixes[0])
def test_reader_writer_and_extra_of_each_format_exist(row: Format) -> None:
    assert callable(imported(row.reader))
    assert not row.writer or callable(imported(row.writer))
    assert not row.extra or row.extra in EXTRAS


def test_no_two_formats_share_their_first_bytes() -> None:
    for one, other in permutations(FORMATS, 2):
        assert not [begin for begin in one.begins if begin.startswith(other.begins)]


# By format, the begin of a file of it; its name shall not matter.
BEGINS = {
    ".log": [
        b"(1700000000.000000) can0 18F0093E#697D7F637D577F7D\n",
        b" (1700000000.000000)  can0  18F0093E   [8]  69 7D 7F 63 7D 57 7F 7D\r\n",
        b" (2023-11-14 22:13:20.000000)  can0  RX - -  123   [2]  69 7D\n",
        b"(1700000000.000000) can0 123##1697D\n",
    ],
    ".asc": [
        b"date Wed May 1 12:00:00.000 pm 2024\nbase hex  timestamps absolute\n",
        b"// version 9.0.0\n   0.100000 1  18F0093Ex  Rx   d 8 69 7D 7F 63 7D 57 7F 7D\n",
        "date śr. maj 1 2024\r\nbase dec  timestamps relative\r\n".encode("utf-16"),
    ],
    ".trc": [
        b";$FILEVERSION=2.1\n;$STARTTIME=45413.5\n",
        b";  PCAN trace\n     1)      1059.9  Rx         0300  7  00 00 00 00 04 00 00\n",
        b"     1)      1059.9 1  Rx    18F0093E -  8    00 00 00 00 04 00 00 00\n",
        b"     1)      1059     0300  7  00 00 00 00 04 00 00\n",
    ],
    ".blf": [b"LOGG\x90\0\0\0"],
    ".mf4": [b"MDF     4.10    ", b"UnFinMF 4.10    "],
    ".parquet": [b"PAR1\x15\x04"],
    ".vbo": [b"File created on 05/11/2009 @ 10:32:41\r\n\r\n[header]\r\n", b"[header]\ntime\n\n[column names]\ntime\n"],
    ".mat": [b"MATLAB 5.0 MAT-file"],
    ".bag": [b"#ROSBAG V2.0\n"],
    ".mcap": [b"\x89MCAP0\r\n"],
    ".db3": [b"SQLite format 3\0"],
    ".csv": [b"# a comment\ntime_s;speed_km_h\n0,0;50,1\n0,1;50,2\n"],
}


@pytest.mark.parametrize("suffix", BEGINS)
def test_the_content_decides_whatever_the_name(suffix: str) -> None:
    for head in BEGINS[suffix]:
        for name in ("drive", "drive.txt", *(f"drive{each}" for each in BEGINS if suffix != ".csv" or each == suffix)):
            found = format_of_content(head, name)
            assert found is not None and found.suffixes[0] == suffix, (head, name)


def test_formats_that_share_a_suffix_are_distinguished() -> None:
    heads = {
        "busmaster": (b"***BUSMASTER Ver 3.2.2***\n", b"11:49:12:9420 Rx 1 0x460 s 8 03 E0 00 00 C0 00 00 00\n"),
        "canhacker": (
            b"Time   ID     DLC Data                    Comment\n",
            b"00,000 18EA0003 8 BE FE 00 00 FF FF FF FF \n",
        ),
        "frame_table": (
            b"Time Stamp,ID,Extended,Bus,LEN,D1,D2\n",
            b"# Logger type: CL2000\nTimestamp;Type;ID;Data\n",
        ),
    }
    for reader, begins in heads.items():
        for head in begins:
            for name in ("drive.log", "drive.trc", "drive.csv", "drive.txt", "drive"):
                found = format_of_content(head, name)
                assert found is not None and found.reader == f"oncenter.read.{reader}:chunks", (head, name)


@pytest.mark.parametrize("suffix", BEGINS)
def test_the_name_decides_where_the_content_is_of_no_format(suffix: str) -> None:
    found = format_of_content(b"Nothing that a logger writes\n", f"drive{suffix}")
    assert found is not None and suffix in found.suffixes


def test_text_of_no_format_is_none() -> None:
    text = b"date,note\nMonday\n", b"Dear Sir,\n\nthe base hex was low.\n", b"(see 1.2) and 123#4\n", b"", bytes(100)
    assert {format_of_content(each, name) for each in text for name in ("drive.txt", "drive")} == {None}


OTHERS = {
    "an Excel": (b"PK\x03\x04" + bytes(26) + b"[Content_Types].xml", "drive.xlsx", "Office document"),
    "a database": (b'VERSION ""\nNS_ :\n', "truck.log", "a DBC database, which follows --dbc"),
    "a capture": (b"\n\r\r\n\x1c\0\0\0", "drive.pcapng", "a pcapng capture"),
    "a page": (b"<!DOCTYPE html>\n<html>\n", "drive.csv", "XML or HTML"),
    "a letter": (b"Dear Sir,\n\nsee above.\n", "drive.txt", "text whose first line reads 'Dear Sir,'"),
    "bytes": (bytes(range(64)), "drive.bin", "binary data that begin with 0x00010203"),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_a_file_that_is_not_a_log_is_named_by_its_content(kind: str, tmp_path: Path) -> None:
    content, name, seems = OTHERS[kind]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(OncenterError) as refused:
        read(tmp_path / name)
    assert refused.value.code == "unknown_format"
    said = str(refused.value)
    assert seems in said and "Vector" in said and "export the log as one of .log, .asc" in said and "\n" not in said


def test_a_log_under_a_name_of_another_format_is_read(tmp_path: Path) -> None:
    (tmp_path / "drive.log").write_text(candump(drive()))
    usual = read(tmp_path / "drive.log")
    for name in ("drive.csv", "drive.asc", "drive.mf4", "drive.txt", "drive"):
        (tmp_path / name).write_bytes((tmp_path / "drive.log").read_bytes())
        assert read(tmp_path / name).table.equals(usual.table), name
