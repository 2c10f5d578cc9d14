"""Vector's `.asc` and PEAK's `.trc`: the built-in readers give the frames of python-can, frame by frame."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from random import Random

import can
import numpy as np
import pytest
from drive_frames import START_S as LOG_S
from drive_frames import Frame, candump, drive
from mutate_logs import mutate
from python_can_reader import python_can_frames
from test_read_formats import WRITERS, written
from test_read_formats import asc as vector
from test_read_formats import trc as peak

from oncenter.errors import OncenterError
from oncenter.read import asc, read, text_blocks, trc
from oncenter.read.frames import COLUMNS, Frames, joined

START_S = 1_714_564_800.0
OURS = {".asc": asc, ".trc": trc}


def our_frames(path: Path, notes: list[str] | None = None) -> Frames:
    chunks = OURS[path.suffix].chunks(path, [] if notes is None else notes, lambda fraction: None)
    return joined(list(chunks))


def assert_same(ours: Frames, theirs: Frames) -> None:
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(ours, column), getattr(theirs, column), err_msg=column)
    assert ours.after_eight().tobytes() == theirs.after_eight().tobytes()


def assert_read_as_python_can_does(path: Path, notes: list[str] | None = None) -> Frames:
    ours = our_frames(path, notes)
    assert_same(ours, python_can_frames(path))
    return ours


def traffic(count: int = 2000, *, flexible: bool = True, buses: int = 12) -> list[can.Message]:
    """Standard and extended, of all lengths, on many buses, with error, remote and CAN FD frames between them."""
    random = np.random.default_rng(3)
    messages = []
    for k in range(count):
        about = {
            "timestamp": START_S + k * 0.137,
            "is_extended_id": bool(k % 3),
            "arbitration_id": int(random.integers(1 << 29 if k % 3 else 1 << 11)),
            "channel": k % buses,
            "is_rx": bool(k % 2),
        }
        data = random.bytes(int(random.integers(9)))
        special = [{"is_remote_frame": True, "dlc": 8}, {"is_error_frame": True}]
        special += [{"is_fd": True, "data": random.bytes(int(random.choice([8, 12, 64])))}] if flexible else []
        rare = special[k % len(special)] if k % 10 == 0 else {"data": data}
        messages.append(can.Message(**about, **rare))
    return messages


def write_trc(path: Path, messages: Iterable[can.Message], version: can.TRCFileVersion) -> None:
    with can.TRCWriter(path) as writer:
        writer.file_version = version
        for message in messages:
            if not message.is_error_frame:  # python-can would write one as a data frame
                writer.on_message_received(message)


def test_traffic_that_python_can_wrote_as_asc_is_read_as_python_can_does(tmp_path: Path) -> None:
    path = tmp_path / "drive.asc"
    with can.ASCWriter(path) as writer:
        for message in traffic():
            writer.on_message_received(message)
    ours = assert_read_as_python_can_does(path)
    assert len(ours) == 1866
    assert set(ours.length.tolist()) == {*range(9), 12, 64}
    assert {True, False} == set(ours.extended.tolist())
    assert len(set(ours.bus.tolist())) == 12


@pytest.mark.parametrize("version", [can.TRCFileVersion.V1_0, can.TRCFileVersion.V2_1])
def test_traffic_that_python_can_wrote_as_trc_is_read_as_python_can_does(
    version: can.TRCFileVersion, tmp_path: Path
) -> None:
    path = tmp_path / "drive.trc"
    write_trc(path, [m for m in traffic(flexible=False) if not m.is_remote_frame], version)
    ours = assert_read_as_python_can_does(path)
    assert len(ours) == 1800
    assert set(ours.length.tolist()) == set(range(9))


@pytest.mark.parametrize(
    "way", [{}, {"relative": True}, {"decimal": True}, {"decimal": True, "relative": True}, {"named": True}]
)
def test_asc_of_vector_tools_is_read_as_python_can_does(way: dict[str, bool], tmp_path: Path) -> None:
    path = tmp_path / "drive.asc"
    path.write_text(vector(**way))
    assert len(assert_read_as_python_can_does(path)) > 800


@pytest.mark.parametrize("version", ["1.1", "1.3", "2.0", "2.1"])
def test_trc_of_each_version_is_read_as_python_can_does(version: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.trc"
    path.write_text(peak(version))
    assert len(assert_read_as_python_can_does(path)) > 800


def test_trc_1_2_which_python_can_refuses_has_the_frames_of_1_3(tmp_path: Path) -> None:
    old, new = tmp_path / "old.trc", tmp_path / "new.trc"
    new.write_text(peak("1.3"))
    old.write_text(peak("1.3").replace("VERSION=1.3", "VERSION=1.2").replace(" -  ", "  "))
    with pytest.raises(ValueError, match="invalid literal"):
        python_can_frames(old)
    assert_same(our_frames(old), our_frames(new))


HEAD = "date Wed May 1 12:00:00.000 pm 2024\nbase hex  timestamps absolute\ninternal events logged\n"
ODD_ASC_LINES = [
    "   0.100000 1  ErrorFrame",
    "   0.100000 1  ErrorFrame  ECC: 10100010",
    "   0.100000 1  123  Rx   r",
    "   0.100000 1  18F0093Ex  Tx   r 8  Length = 0 BitCount = 64",
    "   0.100000 1  Statistic: D 12 R 0 XD 200 XR 0 E 0 O 0 B 12.30%",
    "   0.100000 CAN 1 Status:chip status error active",
    "   0.100000 1  J1939TP FEECp 6 0 0 - Rx d 23 48 41 4D",
    "   0.100000 CANFD   1 Rx 18F0093Ex   1 0 8  8 69 7D 7F 63 7D 57 7F 7D 130000 130 3000 0 0 0 0 0",
    "   0.100000 CANFD   1 Rx   ErrorFrame   Not Acknowledge error, dominant error flag",
    "   0.100000 SV: 2 0 1 ::Variable = 1",
    "   0.100000 log trigger event",
    "// 0.100000 previous log file: drive.asc",
    "no internal events logged",
    "End TriggerBlock",
    "Begin Triggerblock Wed May 1 12:10:00.250 pm 2024",
    "   0.000000 Start of measurement",
    "",
    "   ",
    "garbage",
    "\0\0\0",
    "9",
    "9.9.9 1 123 Rx d 1 00",
    "   0.100000 1  123  Rx",
    "   0.100000 1  123  Rx   d 0",
    "   0.100000 0  123  Rx   d 1 05",
    "   0.100000 1  123  Rx   d 1 5",
    "   0.100000 1  123  Rx   d 8 01 02 03",
    "   0.100000 1  123  Rx   d f 01 02 03 04 05 06 07 08",
    "   0.100000 1  123  rx   D 2 01 02",
    "   0.100000 1  123\tRx   d  2   0a  0B   ",
    "\t0.1 12 7FFx Rx d 2 01 02 Length = 0 BitCount = 0",
    "   0.123456789 150 7FFX Tx d 2 01 02",
    "   1234567890.123456 3 1FFFFFFFx Rx d 3 01 02 03",
    "   0.100000 1 000000000000123 Rx d 2 01 02",
    "   0.100000\x0b1  123  Rx   d 2 01 02",
    "   0.100000 1  123  Rx   d 2 01 02\x0c03",
    "   0.100000 1  123  Rx   d 2 01 02 \xff\xfe\xa0",
    "   00.100000 01  123  Rx   d 2 01 02",
]  # fmt: skip


@pytest.mark.parametrize("base", ["hex", "dec"])
@pytest.mark.parametrize("timestamps", ["absolute", "relative"])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_odd_lines_of_an_asc_log_are_read_as_python_can_does(
    base: str, timestamps: str, line_end: str, tmp_path: Path
) -> None:
    path = tmp_path / "drive.asc"
    usual = "{:11.6f} 1  {}x  Rx   d 8 {} 2 03 44 55 06 7 88 Length = 0" if base == "dec" else (
        "{:11.6f} 1  {:X}x  Rx   d 8 {:02X} 02 03 A4 B5 06 07 C8 Length = 0"
    )  # fmt: skip
    for odd_lines in [ODD_ASC_LINES, *([line] for line in ODD_ASC_LINES)]:
        head = HEAD.replace("hex", base).replace("absolute", timestamps)
        body = [line for k, odd in enumerate(odd_lines) for line in (odd, usual.format(0.2 + k, 0x18F0093E + k, k))]
        text = head + "\n".join([usual.format(0.0, 1, 2), *body * 3]) + "\n"
        path.write_bytes(text.replace("\n", line_end).encode("latin-1"))
        try:
            theirs = python_can_frames(path)
        except ValueError:  # one line is enough for python-can to refuse the log
            continue
        assert_same(our_frames(path), theirs)


ODD_TRC_LINES = {
    "1.1": [
        "     2)         0.5  Warng  FFFFFFFF  4  00 00 00 08  BUSHEAVY",
        "     2)         0.5  Rx         0123  8  RTR",
        "     2)         0.5  Error      0001  4  00 00 00 08",
        "     2)         0.5  Rx         0123  0",
        "     2)         0.5  Tx     18F0093E  2  0a 0B",
        "     2)           7  Rx         0123  2  0A 0B  0C",
        "     2)  123456789.125  Rx   123  1  0",
        ";  a comment",
        "",
    ],
    "2.1": [
        "      2         0.500 ST  1     -    Rx -  4    00 00 00 08",
        "      2         0.500 RR  1     0123 Rx -  8",
        "      2         0.500 ER  1     -    Rx -  5    04 00 00 00 00",
        "      2         0.500 FD  1     0123 Rx -  8    00 01 02 03 04 05 06 07",
        "      2         0.500 FB  1     0123 Rx -  9    00 01 02 03 04 05 06 07 08 09 0A 0B",
        "      2         0.500 DT  1     0123 Rx -  0",
        "      2         0.500 DT 12 18F0093E Tx -  2    0a 0B ",
        "      2         0.500 DT  1     0123 Rx -  2    0A0B",
        "      2         0.500 DT  1     0123 Rx -  2    0A 0B 0C",
        ";  a comment",
        "",
    ],
}


@pytest.mark.parametrize("version", ODD_TRC_LINES)
@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_odd_lines_of_a_trc_log_are_read_as_python_can_does(version: str, line_end: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.trc"
    lines = peak(version).splitlines()
    for odd in ODD_TRC_LINES[version]:
        text = "\n".join([*lines[:50], odd, *lines[50:]]) + "\n"
        path.write_bytes(text.replace("\n", line_end).encode())
        assert_read_as_python_can_does(path)


def test_trc_1_0_drops_information_about_the_bus(tmp_path: Path) -> None:
    path = tmp_path / "drive.trc"
    path.write_text(
        "     1)      10 0123 2 01 02\n     2)      11 FFFFFFFF 4 00 00 00 08\n     3)      12 18F0093E 0\n"
    )
    assert len(assert_read_as_python_can_does(path)) == 2


@pytest.mark.parametrize("columns", ["N,O,T,I,d,l,D", "N,O,T,B,I,d,R,l,D", "O,T,I,d,L,D", "N,T,O,B,I,d,L,D"])
def test_columns_of_trc_2_follow_its_header(columns: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.trc"
    cells = {"N": "7", "O": "12.345", "T": "DT", "B": "2", "I": "18F0093E", "d": "Rx", "R": "-", "L": "3", "l": "3"}
    line = " ".join({**cells, "D": "01 02 03"}[column] for column in columns.split(","))
    path.write_text(f";$FILEVERSION=2.1\n;$STARTTIME=45413.5\n;$COLUMNS={columns}\n{line}\n{line}\n")
    assert len(assert_read_as_python_can_does(path)) == 2


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda text: text.replace("VERSION=2.1", "VERSION=9.9"), "914 lines have an unknown layout"),
        (lambda text: text.replace(",D\n", "\n"), "its columns 'N,O,T,B,I,d,R,L' are in an unknown order"),
        (lambda text: text.replace("45413.5", "noon"), "its start time 'noon' is not a number of days"),
        (lambda text: text.replace(" Rx -  8 ", " Rx - 8h "), "lines have an unknown layout"),
    ],
    ids=["another version", "no data column", "a start that is no number", "data in an unknown form"],
)
def test_a_trc_log_of_an_unknown_kind_is_refused(damage: Callable[[str], str], reason: str, tmp_path: Path) -> None:
    (tmp_path / "drive.trc").write_text(damage(peak("2.1")))
    with pytest.raises(OncenterError, match=f"cannot read drive.trc: .*{reason}"):
        our_frames(tmp_path / "drive.trc")


def test_a_trc_log_of_an_unknown_version_with_lines_of_the_first_is_read(tmp_path: Path) -> None:
    path = tmp_path / "drive.trc"
    path.write_text(";$FILEVERSION=1.4\n" + "     1)      10 18F0093E 2 01 02\n" * 3)
    assert len(assert_read_as_python_can_does(path)) == 3


WAYS = ({}, {"relative": True}, {"decimal": True}, {"decimal": True, "relative": True})


@pytest.mark.parametrize("first", WAYS)
@pytest.mark.parametrize("second", WAYS)
def test_logs_behind_one_another_keep_their_number_bases_and_times(
    first: dict[str, bool], second: dict[str, bool], tmp_path: Path
) -> None:
    path = tmp_path / "drive.asc"
    path.write_text(vector(**first))
    parts = [our_frames(path)]
    path.write_text(vector(**second))
    parts.append(our_frames(path))
    path.write_text(vector(**first) + vector(**second))
    assert_same(our_frames(path), joined(parts))


@pytest.mark.parametrize("log_format", ["asc", "trc"])
def test_zeros_of_a_power_loss_hide_one_frame_at_most(log_format: str, tmp_path: Path) -> None:
    text = {"asc": vector(), "trc": peak("2.1")}[log_format].encode()
    path, half = tmp_path / f"drive.{log_format}", text.index(b"\n", len(text) // 2) + 1
    path.write_bytes(text[:half] + bytes(3_000_000) + text[half:] + bytes(3_000_000))
    notes = list[str]()
    ours = assert_read_as_python_can_does(path, notes)
    path.write_bytes(text)
    assert len(our_frames(path)) - len(ours) == 1
    assert notes[0] == f"the last line of {path.name} is cut off and was left out"


def test_backward_time_is_passed_on_unchanged(tmp_path: Path) -> None:
    path = tmp_path / "drive.asc"
    lines = vector().splitlines()
    path.write_text("\n".join([*lines[:6], *lines[:5:-1]]) + "\n")
    assert np.diff(assert_read_as_python_can_does(path).time).max() <= 0


def test_one_damaged_frame_is_left_out_though_python_can_refuses_the_log(tmp_path: Path) -> None:
    path = tmp_path / "drive.asc"
    lines = vector().splitlines()
    path.write_text("\n".join([*lines[:50], "   0.100000 1  18F0093Ex  Rx   d 8 zz 7D 7F 63 7D 57 7F 7D", *lines[50:]]))
    with pytest.raises(ValueError, match="invalid literal"):
        python_can_frames(path)
    notes: list[str] = []
    assert len(our_frames(path, notes)) == 840
    assert "left out 1 line of drive.asc that are not CAN frames, the first reads '0.100000 1  18F0093Ex" in notes[1]


def test_missing_data_of_a_line_are_not_taken_from_the_next_line(tmp_path: Path) -> None:
    path = tmp_path / "drive.asc"
    path.write_text(HEAD + "\n0.1 1 123 Rx d 3 01 02\n03 04 05\n0.2 1 123 Rx d 3 01 02 03\n")
    assert our_frames(path).length.tolist() == [2, 3]


def test_a_log_with_a_byte_order_mark_is_the_drive(tmp_path: Path) -> None:
    (tmp_path / "drive.asc").write_text(vector())
    (tmp_path / "marked.asc").write_text("\ufeff" + vector())
    notes: list[str] = []
    assert_same(our_frames(tmp_path / "marked.asc", notes), our_frames(tmp_path / "drive.asc"))
    assert notes == ["left out 44 error frames in marked.asc", "left out 44 remote frames in marked.asc"]


@pytest.mark.parametrize("block", [300, 1000, 4099])
@pytest.mark.parametrize(("suffix", "text"), [(".asc", vector(relative=True)), (".trc", peak("1.1"))])
def test_the_position_of_block_ends_changes_nothing(
    block: int, suffix: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"drive{suffix}"
    path.write_bytes(text.replace("\n", "\r\n").encode())
    whole = our_frames(path)
    monkeypatch.setattr(text_blocks, "BLOCK_BYTES", block)
    assert_same(our_frames(path), whole)


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.parametrize("log_format", ["asc", "trc"])
def test_a_damaged_log_gives_the_frames_of_python_can_or_is_refused(log_format: str, seed: int, tmp_path: Path) -> None:
    random = Random(seed)
    texts = [vector(), vector(decimal=True), vector(relative=True), vector(named=True)]
    if log_format == "trc":
        texts = [peak(version) for version in ("1.1", "1.3", "2.0", "2.1")]
    lines = random.choice(texts).encode().splitlines(keepends=True)
    content, _ = mutate(log_format, seed, b"".join(lines[3:]))
    path = tmp_path / f"drive.{log_format}"
    path.write_bytes(b"".join(lines[:3]) + content)  # after another head python-can loses the first line, or the start
    began = time.process_time()
    try:
        ours = our_frames(path)
    except OncenterError:
        return
    finally:
        assert time.process_time() - began < 5.0
    try:
        theirs = python_can_frames(path)
    except Exception:
        return  # it refuses a log for one mangled line
    assert_same(ours, theirs)


@pytest.mark.parametrize("suffix", WRITERS)
def test_the_vin_comes_with_the_signals_and_the_log_is_read_once(suffix: str, tmp_path: Path) -> None:
    path = written(tmp_path, suffix)
    assert read(path).vin is None
    vin = b"YS2R4X20005399401*"
    announced = bytes([0x20, len(vin), 0, 3, 0xFF, 0xEC, 0xFE, 0x00])
    packets = [bytes([k + 1]) + vin[7 * k : 7 * k + 7].ljust(7, b"\xff") for k in range(3)]
    sent = [Frame(LOG_S + 2.0, 0x1CECFF00, announced)]
    sent += [Frame(LOG_S + 2.1 + k / 10, 0x1CEBFF00, packet) for k, packet in enumerate(packets)]
    frames = sorted([*drive(), *sent], key=lambda frame: frame.time)
    assert read(written(tmp_path, suffix, frames)).vin == "YS2R4X20005399401"


@pytest.mark.parametrize("suffix", [".asc", ".trc"])
def test_a_long_file_without_frames_is_refused_soon(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"drive{suffix}"
    path.write_bytes(b"x\n" * 2_000_000)
    began = time.process_time()
    with pytest.raises(OncenterError, match="most of its lines are not frames"):
        our_frames(path)
    assert time.process_time() - began < 10.0


DATES = {
    "Wed May 1 12:00:00.000 pm 2024": True,
    "Wed May 1 12:00:00 2024": True,
    "Wed May 1 15:06:13 pm 2024": True,
    "Mit Mai 1 12:00:00.000 2024": True,
    "mer. mai 1 12:00:00.000 2024": True,
    "ons maj 1 12:00:00.000 2024": False,
    "śr. lis 27 02:13:20.000 2024": False,
    "周三 十一月 27 02:13:20.000 下午 2024": False,
    "2024-05-01 12:00:00": False,
    "Wed May 1 12:00:00.000 nachm. 2024": False,
    "Wed May 41 12:00:00.000 2024": False,
    "Wed 01.05.2024 12:00:00": False,
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_an_asc_log_with_a_date_in_any_language_and_encoding_has_its_time_differences(
    encoding: str, tmp_path: Path
) -> None:
    path = tmp_path / "drive.asc"
    frames = "".join(f"   {0.25 * k:.6f} 1  123  Rx   d 1 {k:02X}\n" for k in range(40))
    for date, is_known in DATES.items():
        path.write_bytes(f"date {date}\nbase hex\nBegin Triggerblock {date}\n{frames}".encode(encoding))
        notes: list[str] = []
        ours = our_frames(path, notes)
        assert (notes, len(ours)) == ([], 40), date
        assert ours.time - ours.time[0] == pytest.approx(0.25 * np.arange(40), abs=1e-5), date
        assert bool(ours.time[0] > 1e9) == is_known, date


def test_a_candump_log_in_utf_16_is_that_in_utf_8(tmp_path: Path) -> None:
    """PowerShell writes UTF-16 with `>`."""
    (tmp_path / "8.log").write_text(candump(drive()))
    (tmp_path / "16.log").write_bytes(candump(drive()).encode("utf-16"))
    assert read(tmp_path / "16.log").table.equals(read(tmp_path / "8.log").table)
