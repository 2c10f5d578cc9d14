"""A BLF log gives the frames that python-can finds in it; a damaged or hostile one is refused in one line, at once."""

from __future__ import annotations

import contextlib
import struct
import tempfile
import time
import tracemalloc
import zlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import can
import numpy as np
import pytest
from drive_frames import START_S, drive
from hypothesis import given, settings
from hypothesis import strategies as st

from oncenter.errors import OncenterError
from oncenter.live.replay import Replay
from oncenter.read import blf, read
from oncenter.read.frames import COLUMNS, Frames, bus_name, frames_of_rows, joined
from oncenter.read.identity_of_log import identity_of
from oncenter.read.other_lines import row
from oncenter.simulate import simulate_to_log

OBJECT = struct.Struct("<4sHHLL")
CAN_MESSAGE, CAN_ERROR, CAN_ERROR_EXT, CAN_MESSAGE_2, CAN_FD, CAN_FD_64 = 1, 2, 73, 86, 100, 101
CONTAINER, MARKER = 10, 96
STORED, DEFLATED = 0, 2
EXTENDED = 1 << 31


def blf_object(
    kind: int,
    body: bytes,
    *,
    ticks: int = 1_000_000,
    version: int = 1,
    unit: int = 2,
    size: int | None = None,
    header_size: int | None = None,
) -> bytes:
    """An object with a time stamp, not padded."""
    times = {1: struct.pack("<LHHQ", unit, 0, 0, ticks), 2: struct.pack("<LBxHQ8x", unit, 0, 0, ticks)}
    header = times.get(version, times[1])
    whole = OBJECT.size + len(header) + len(body)
    head = OBJECT.size + len(header) if header_size is None else header_size
    return OBJECT.pack(b"LOBJ", head, version, whole if size is None else size, kind) + header + body


def classic(identifier: int, data: bytes, *, channel: int = 1, flags: int = 0, length: int | None = None) -> bytes:
    count = len(data) if length is None else length
    return struct.pack("<HBBL8s", channel, flags, count, identifier, data)


def flexible(identifier: int, data: bytes, *, channel: int = 1, flags: int = 0, fd: int = 1) -> bytes:
    return struct.pack("<HBBLLBBB5x64s", channel, flags, len(data), identifier, 0, 0, fd, len(data), data)


def flexible_64(
    identifier: int,
    data: bytes,
    *,
    channel: int = 1,
    flags: int = 0x1000,
    length: int | None = None,
    extension_at: int = 0,
    extension: bytes = b"",
) -> bytes:
    count = len(data) if length is None else length
    head = struct.pack(
        "<BBBBLLLLLLLHBBL", channel, 8, count, 0, identifier, 0, flags, 0, 0, 0, 0, 0, 0, extension_at, 0
    )
    return head + data + extension


def container(
    contents: bytes,
    *,
    method: int = DEFLATED,
    unpacked: int | None = None,
    size: int | None = None,
    padding: bool = True,
) -> bytes:
    packed = zlib.compress(contents) if method == DEFLATED else contents
    whole = OBJECT.size + 16 + len(packed)
    head = OBJECT.pack(b"LOBJ", OBJECT.size, 1, whole if size is None else size, CONTAINER)
    declared = len(contents) if unpacked is None else unpacked
    return head + struct.pack("<H6xL4x", method, declared) + packed + bytes(whole % 4 if padding else 0)


def blf_file(
    *parts: bytes,
    written: int | None = None,
    start: Sequence[int] = (2023, 11, 2, 14, 22, 13, 20, 0),
    header: int = 144,
) -> bytes:
    """A whole file; `written` is its size as its header says it."""
    after = b"".join(parts)
    size = 144 + len(after) if written is None else written
    head = struct.pack("<4sL8BQQLL8H8H", b"LOGG", header, 5, 0, 0, 0, 2, 6, 8, 1, size, 0, 0, 0, *start, *start)
    return head.ljust(144, b"\0") + after


def padded(*objects: bytes) -> bytes:
    """Padding of Vector's and python-can's writers: size % 4 bytes, which does not align."""
    return b"".join(one + bytes(len(one) % 4) for one in objects)


def our_frames(path: Path, notes: list[str] | None = None) -> Frames:
    return joined(list(blf.chunks(path, [] if notes is None else notes, lambda fraction: None)))


def python_can_frames(path: Path) -> Frames:
    """Data frames, of CAN and CAN FD."""
    with can.BLFReader(path) as reader:
        messages = [m for m in reader if not (m.is_error_frame or m.is_remote_frame)]
    return frames_of_rows([row(m.timestamp, m.arbitration_id, m.is_extended_id, m.data, m.channel) for m in messages])


def assert_same(ours: Frames, theirs: Frames) -> None:
    """Equal times up to the last bit: a damaged stamp above 2^53 ns is not exact as a double."""
    np.testing.assert_array_max_ulp(ours.time, theirs.time, maxulp=1)
    for column in {*COLUMNS} - {"time"}:
        np.testing.assert_array_equal(getattr(ours, column), getattr(theirs, column), err_msg=column)
    assert ours.after_eight().tobytes() == theirs.after_eight().tobytes()


def frames_of_file(folder: Path, content: bytes, notes: list[str] | None = None) -> Frames:
    """The frames of this reader, checked against python-can's."""
    path = folder / "drive.blf"
    path.write_bytes(content)
    ours = our_frames(path, notes)
    assert_same(ours, python_can_frames(path))
    return ours


def refusal_of(folder: Path, content: bytes) -> str:
    path = folder / "bad.blf"
    path.write_bytes(content)
    with pytest.raises(OncenterError) as refused:
        our_frames(path)
    assert refused.value.code == "unreadable_log"
    assert "bad.blf" in str(refused.value)
    assert "\n" not in str(refused.value)
    return str(refused.value)


def write(path: Path, messages: Iterable[can.Message], **options: int) -> Path:
    with can.BLFWriter(path, **options) as writer:
        for message in messages:
            writer.on_message_received(message)
    return path


def mixed_traffic(count: int = 3000, seed: int = 1) -> list[can.Message]:
    """Standard and extended, of all lengths, on many channels; CAN FD, error and remote frames between them."""
    random = np.random.default_rng(seed)
    messages = []
    for k in range(count):
        about = {
            "timestamp": START_S + k * 0.00137,
            "is_extended_id": bool(k % 3),
            "arbitration_id": int(random.integers(1 << 29 if k % 3 else 1 << 11)),
            "channel": int(random.integers(0, 300)) if k % 50 == 0 else k % 4,
            "is_rx": bool(k % 2),
        }
        short = random.bytes(int(random.integers(9)))
        kinds = [
            {"data": short},
            {"data": short},
            {"data": short},
            {"data": short, "is_fd": True, "bitrate_switch": True},
            {"data": random.bytes(int(random.choice([12, 20, 64]))), "is_fd": True},
            {"is_remote_frame": True, "dlc": 8},
            {"is_error_frame": True},
        ]
        messages.append(can.Message(**about, **kinds[int(random.integers(len(kinds)))]))
    return messages


@pytest.mark.parametrize("scenario", ["weave", "hard_turn"])
def test_a_simulated_drive_has_the_frames_that_python_can_finds(tmp_path: Path, scenario: str) -> None:
    simulate_to_log(scenario, 1, tmp_path / "drive.blf")
    ours = our_frames(tmp_path / "drive.blf")
    assert len(ours) > 1000
    assert_same(ours, python_can_frames(tmp_path / "drive.blf"))


@pytest.mark.parametrize("compression", [0, 1, -1, 9])
@pytest.mark.parametrize("container_size", [128 * 1024, 1000, 333])
def test_mixed_traffic_has_the_frames_that_python_can_finds(
    tmp_path: Path, compression: int, container_size: int
) -> None:
    path = write(
        tmp_path / "mixed.blf", mixed_traffic(), compression_level=compression, max_container_size=container_size
    )
    ours = our_frames(path)
    assert 1000 < len(ours) < 3000
    assert {bus_name(int(code)) for code in ours.bus} > {"0", "1", "2", "3"}
    assert_same(ours, python_can_frames(path))


def test_frames_of_all_objects_keep_their_order(tmp_path: Path) -> None:
    objects = [
        blf_object(CAN_MESSAGE, classic(0x123, b"\1\2\3"), ticks=1),
        blf_object(CAN_FD_64, flexible_64(0x18F0093E | EXTENDED, b"12345678"), ticks=2),
        blf_object(CAN_MESSAGE_2, classic(0x18FEF100 | EXTENDED, b"abcdefgh", channel=2) + bytes(8), ticks=3),
        blf_object(CAN_FD, flexible(0x7FF, b"12345", channel=3), ticks=4),
        blf_object(CAN_FD, flexible(0x1, b"", fd=0, channel=3), ticks=5),
        blf_object(CAN_FD_64, flexible_64(0x2, b"zz", flags=0), ticks=6),
        blf_object(CAN_MESSAGE, classic(0x5, b"12345678", length=15), ticks=7),
        blf_object(CAN_MESSAGE, classic(0x6, b"", channel=0), ticks=8),
    ]
    ours = frames_of_file(tmp_path, blf_file(container(padded(*objects))))
    assert ours.time.tolist() == [START_S + k * 1e-9 for k in range(1, 9)]
    assert ours.identifier.tolist() == [0x123, 0x18F0093E, 0x18FEF100, 0x7FF, 1, 2, 5, 6]
    assert ours.extended.tolist() == [False, True, True, *[False] * 5]
    assert ours.length.tolist() == [3, 8, 8, 5, 0, 2, 8, 0]
    assert int(ours.data[0]) == 0xFFFFFFFFFF030201
    assert [bus_name(int(code)) for code in ours.bus] == ["0", "0", "1", "2", "2", "0", "0", "-1"]


@pytest.mark.parametrize(
    "unit, version, seconds", [(1, 1, 12_345.67890), (2, 1, 1.234567890), (1, 2, 12_345.67890), (2, 2, 1.234567890)]
)
def test_time_stamps_count_ten_microseconds_or_nanoseconds_from_the_start(
    tmp_path: Path, unit: int, version: int, seconds: float
) -> None:
    one = blf_object(CAN_MESSAGE, classic(1, b"\1"), unit=unit, version=version, ticks=1_234_567_890)
    assert frames_of_file(tmp_path, blf_file(container(one))).time.tolist() == [START_S + seconds]


def test_an_invalid_start_date_is_zero(tmp_path: Path) -> None:
    one = blf_object(CAN_MESSAGE, classic(1, b"\1"), ticks=5_000_000_000)
    for start in ([0] * 8, [2023, 13, 1, 1, 1, 1, 1, 1], [2023, 1, 1, 1, 1, 1, 1, 65535]):
        assert frames_of_file(tmp_path, blf_file(container(one), start=start)).time.tolist() == [5.0]


@pytest.mark.parametrize("method", [STORED, DEFLATED])
@pytest.mark.parametrize("piece", [1, 7, 16, 48, 50, 1000])
def test_an_object_may_begin_in_one_container_and_end_in_another(tmp_path: Path, method: int, piece: int) -> None:
    contents = padded(
        *(blf_object(CAN_MESSAGE, classic(k, bytes([k] * (k % 9))), ticks=k) for k in range(40)),
        *(blf_object(CAN_FD_64, flexible_64(k, bytes(k % 9)), ticks=k) for k in range(40)),
    )
    parts = [contents[k : k + piece] for k in range(0, len(contents), piece)]
    assert len(frames_of_file(tmp_path, blf_file(*(container(part, method=method) for part in parts)))) == 80


def test_objects_are_padded_by_any_number_of_bytes_up_to_four(tmp_path: Path) -> None:
    odd = [blf_object(MARKER, bytes(k)) for k in range(9)]
    frame = blf_object(CAN_MESSAGE, classic(1, b"\1"))
    for padding in range(5):
        contents = b"".join(one + bytes(padding) for one in [*odd, frame, *odd, frame])
        assert len(frames_of_file(tmp_path, blf_file(container(contents)))) == 2
    assert "outside any object" in refusal_of(tmp_path, blf_file(container(frame + bytes(5) + frame)))


def test_containers_need_no_padding_and_allow_other_objects_between_them(tmp_path: Path) -> None:
    frame = padded(blf_object(CAN_MESSAGE, classic(1, b"\1")))
    odd = next(k for k in range(100) if len(container(frame + blf_object(MARKER, bytes(k)), padding=False)) % 4)
    last = container(frame + blf_object(MARKER, bytes(odd)), padding=False)
    top_level = blf_object(115, bytes(64)) + blf_object(CAN_MESSAGE, classic(2, b"\1"))
    assert len(frames_of_file(tmp_path, blf_file(container(frame), top_level, container(frame), last))) == 3
    (tmp_path / "unpadded.blf").write_bytes(blf_file(last, last))
    assert len(our_frames(tmp_path / "unpadded.blf")) == 2


def test_data_equal_to_the_signature_are_data(tmp_path: Path) -> None:
    frames = padded(*(blf_object(CAN_MESSAGE, classic(k, b"LOBJLOBJ"[k % 3 :])) for k in range(200)))
    parts = [frames[k : k + 1001] for k in range(0, len(frames), 1001)]
    assert len(frames_of_file(tmp_path, blf_file(*map(container, parts)))) == 200


def test_error_frames_remote_frames_and_other_objects_are_skipped(tmp_path: Path) -> None:
    contents = padded(
        blf_object(CAN_ERROR, struct.pack("<HHL", 1, 0, 0)),
        blf_object(CAN_ERROR_EXT, bytes(32)),
        blf_object(CAN_MESSAGE, classic(1, bytes(8), flags=0x80)),
        blf_object(CAN_FD, flexible(1, bytes(8), flags=0x80)),
        blf_object(CAN_FD_64, flexible_64(1, bytes(8), flags=0x1010)),
        blf_object(MARKER, bytes(77)),
        blf_object(CAN_MESSAGE, classic(7, bytes(8), flags=1)),
        blf_object(92, b""),
    )
    notes: list[str] = []
    assert frames_of_file(tmp_path, blf_file(container(contents)), notes).identifier.tolist() == [7]
    assert notes == ["left out 2 error frames in drive.blf", "left out 3 remote frames in drive.blf"]


def test_trailing_zeros_left_out_by_the_logger_are_restored(tmp_path: Path) -> None:
    """An extension of the object, or its end, may come before the last bytes of data."""
    extended = flexible_64(3, b"\1\2", length=8, extension_at=32 + 40 + 2, extension=b"\x55" * 30)
    later = flexible_64(4, b"\1\2\3\4", length=4, extension_at=32 + 40 + 4, extension=b"\x55" * 12)
    contents = padded(blf_object(CAN_FD_64, flexible_64(2, b"\1\2", length=4)), blf_object(CAN_FD_64, extended))
    contents += padded(blf_object(CAN_FD_64, later), blf_object(CAN_FD_64, flexible_64(5, b"", length=8), version=2))
    ours = frames_of_file(tmp_path, blf_file(container(contents)))
    assert [int(d) for d in ours.data] == [0xFFFFFFFF00000201, 0x0201, 0xFFFFFFFF04030201, 0]


def test_long_can_fd_frames_are_read(tmp_path: Path) -> None:
    contents = padded(
        blf_object(CAN_FD, flexible(1, bytes(8))),
        blf_object(CAN_FD, flexible(1, bytes(range(12)))),
        blf_object(CAN_FD_64, flexible_64(1, bytes(range(64)))),
        blf_object(CAN_FD_64, flexible_64(1, b"\1", length=64)),
    )
    frames = frames_of_file(tmp_path, blf_file(container(contents)))
    assert frames.length.tolist() == [8, 12, 64, 64]
    assert frames.more is not None
    begins = [bytes(each)[:5] for each in frames.more]
    assert begins == [b"\xff" * 5, b"\x08\t\n\x0b\xff", bytes(range(8, 13)), bytes(5)]


def test_frames_with_an_unknown_object_header_are_left_out_and_counted(tmp_path: Path) -> None:
    contents = padded(
        blf_object(CAN_MESSAGE, classic(1, bytes(8)), version=9),
        blf_object(CAN_MESSAGE, classic(2, bytes(8))),
        blf_object(MARKER, bytes(9), version=3),
    )
    notes: list[str] = []
    assert frames_of_file(tmp_path, blf_file(container(contents)), notes).identifier.tolist() == [2]
    assert notes == ["left out 1 frame of drive.blf with an unknown object header"]


def test_a_drive_on_can_fd_reads_like_one_on_can(tmp_path: Path) -> None:
    def drive_on(fd: bool) -> Path:
        about = [
            {"timestamp": f.time, "arbitration_id": f.identifier, "is_extended_id": f.extended, "data": f.data}
            for f in drive()
        ]
        return write(tmp_path / f"fd{fd}.blf", (can.Message(**a, channel=1, is_fd=fd) for a in about))

    on_fd, on_classic = read(drive_on(fd=True)), read(drive_on(fd=False))
    assert on_fd.table.equals(on_classic.table)
    assert on_fd.notes == on_classic.notes


def test_vin_and_replay_read_blf_too(tmp_path: Path) -> None:
    vin = 1 << 31 | 6 << 26 | 65260 << 8
    frames = [blf_object(CAN_MESSAGE, classic(vin, b"TRUCK7*"), ticks=k * 10_000_000) for k in range(3)]
    path = tmp_path / "drive.BLF"
    path.write_bytes(blf_file(container(padded(*frames))))
    assert identity_of(path).vin == "TRUCK7"
    played = Replay(path, 100.0)
    assert len(joined([played.take(0.01) for _ in range(5)])) == 3
    played.close()


def test_a_log_is_read_some_containers_at_a_time(tmp_path: Path) -> None:
    frames = padded(*(blf_object(CAN_MESSAGE, classic(k % 2048, bytes(8)), ticks=k) for k in range(2000)))
    (tmp_path / "long.blf").write_bytes(blf_file(*[container(frames)] * 100))
    shares: list[float] = []
    chunks = list(blf.chunks(tmp_path / "long.blf", [], shares.append))
    assert sum(map(len, chunks)) == 200_000
    assert max(map(len, chunks)) <= blf.BLOCK_BYTES // 48 + 2000
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_a_log_without_objects_has_no_frames(tmp_path: Path) -> None:
    assert len(frames_of_file(tmp_path, blf_file())) == 0
    assert len(frames_of_file(tmp_path, blf_file(container(b"")))) == 0
    assert len(frames_of_file(tmp_path, blf_file(container(b"", method=STORED)))) == 0


THREE = padded(*(blf_object(CAN_MESSAGE, classic(k, bytes([k] * 8)), ticks=k) for k in range(3)))


@pytest.mark.parametrize("written", [0, 144])
@pytest.mark.parametrize("method", [STORED, DEFLATED])
def test_an_unclosed_log_is_read_up_to_its_cut(tmp_path: Path, written: int, method: int) -> None:
    """A killed writer of python-can leaves 144 as the size of the file."""
    whole = blf_file(container(THREE, method=method), container(THREE, method=method), written=written)
    first = len(blf_file(container(THREE, method=method)))
    counts = []
    for cut in range(first, len(whole) + 1):
        path, notes = tmp_path / "open.blf", list[str]()
        path.write_bytes(whole[:cut])
        ours = our_frames(path, notes)
        assert notes == ["the logger did not close open.blf: it was read up to its last complete part"]
        with contextlib.suppress(struct.error):  # python-can wants whole headers
            assert_same(ours, python_can_frames(path))
        counts.append(len(ours))
    assert (counts[0], counts[-1]) == (3, 6)
    assert counts == sorted(counts)


def test_a_log_shorter_than_its_header_says_is_refused_as_cut_off(tmp_path: Path) -> None:
    whole = blf_file(container(THREE))
    error = refusal_of(tmp_path, whole[:-10])
    assert f"bad.blf is cut off: its header says {len(whole)} bytes, the file has {len(whole) - 10};" in error


def test_a_log_that_becomes_shorter_during_reading_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "shrinks.blf"
    path.write_bytes(blf_file(*[container(THREE * 8000)] * 4))
    chunks = blf.chunks(path, [], lambda fraction: None)
    next(chunks)
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size // 3)
    with pytest.raises(OncenterError, match="damaged"):
        list(chunks)


HUGE = (blf.MAX_CONTAINER_BYTES + 1, (1 << 31) - 1, (1 << 32) - 1)
FRAME = blf_object(CAN_MESSAGE, classic(1, bytes(8)))


@pytest.mark.parametrize("version", [1, 9])
def test_an_object_of_size_zero_is_refused_at_once(tmp_path: Path, version: int) -> None:
    """python-can reads both for ever; with the second, its memory also grows."""
    began = time.monotonic()
    hostile = blf_file(container(blf_object(CAN_MESSAGE, classic(1, bytes(8)), version=version, size=0)))
    assert len(hostile) < 250
    error = refusal_of(tmp_path, hostile)
    assert "the container at byte 144 contains an object of 0 bytes" in error
    assert time.monotonic() - began < 1.0


@pytest.mark.parametrize(
    "content, what",
    [
        (b"", "no BLF header"),
        (blf_file()[:71], "no BLF header"),
        (b"LOGH" + blf_file()[4:], "no BLF header"),
        (blf_file(header=71), "its header has 71 bytes"),
        (blf_file(header=145), "its header has 145 bytes"),
        (blf_file(b"x" * 40), "no object begins at byte 144"),
        (blf_file(b"x" * 3, container(FRAME)), "no object begins at byte 144"),
        (blf_file(container(FRAME), b"x" * 40), "no object begins at byte"),
        (blf_file(OBJECT.pack(b"LOBJ", 16, 1, 0, CONTAINER)), "the object at byte 144 has 0 bytes"),
        (blf_file(OBJECT.pack(b"LOBJ", 16, 1, 15, 7)), "the object at byte 144 has 15 bytes"),
        (blf_file(OBJECT.pack(b"LOBJ", 16, 1, 500, 7)), "the object at byte 144 has 500 bytes, the file ends before"),
        (blf_file(OBJECT.pack(b"LOBJ", 16, 1, 20, CONTAINER) + bytes(4)), "the container at byte 144 has 20 bytes"),
        (blf_file(b"LOBJ" + bytes(8)), "the object at byte 144 is cut off"),
        (blf_file(container(FRAME, size=900)), "the object at byte 144 has 900 bytes, the file ends before"),
        (blf_file(container(FRAME, method=1)), "the unknown compression 1"),
        (blf_file(container(FRAME, unpacked=47)), "does not unpack to its 47 bytes"),
        (blf_file(container(FRAME, unpacked=49)), "does not unpack to its 49 bytes"),
        (blf_file(container(FRAME, unpacked=0)), "does not unpack to its 0 bytes"),
        (blf_file(container(FRAME, size=60)), "does not unpack"),
        (blf_file(container(FRAME).replace(b"\x78\x9c", b"\x78\x9d")), "does not unpack: Error"),
        (blf_file(container(FRAME + b"x" * 60)), "the container at byte 144 contains bytes outside any object"),
        (blf_file(container(FRAME[:40])), "the last object, in the container at byte 144, is cut off"),
        *((blf_file(container(FRAME, unpacked=n)), f"would unpack to {n} bytes") for n in HUGE),
        *((blf_file(container(FRAME, size=n)), f"has {n} bytes, the file ends before") for n in HUGE),
        *((blf_file(container(FRAME, size=n), written=0), f"144 has {n} bytes") for n in HUGE),
        *(
            (blf_file(container(FRAME), container(blf_object(MARKER, b"", size=n))), f"contains an object of {n} bytes")
            for n in (15, *HUGE)
        ),
        (blf_file(container(blf_object(MARKER, b"", size=20)[:20])), "an object of type 96 with 20 bytes, 32 of them"),
        (blf_file(container(blf_object(CAN_MESSAGE, bytes(15)))), "an object of type 1 with 47 bytes, 32 of them"),
        (blf_file(container(blf_object(CAN_MESSAGE_2, bytes(15), version=2))), "an object of type 86 with 55 bytes"),
        (blf_file(container(blf_object(CAN_FD, bytes(83)))), "an object of type 100 with 115 bytes"),
        (blf_file(container(blf_object(CAN_FD_64, bytes(39)))), "an object of type 101 with 71 bytes"),
        (blf_file(container(blf_object(CAN_FD_64, flexible_64(1, b"1", extension_at=74)))), "type 101 with 73 bytes"),
        (blf_file(container(blf_object(CAN_FD_64, flexible_64(1, b"1", extension_at=71)))), "type 101 with 73 bytes"),
        (blf_file(container(blf_object(CAN_MESSAGE, bytes(16), header_size=40))), "40 of them for header version 1"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_damaged_log_is_refused_in_one_line_with_the_position(tmp_path: Path, content: bytes, what: str) -> None:
    error = refusal_of(tmp_path, content)
    assert error.startswith("cannot read bad.blf: the file is damaged or has another format (")
    assert what in error


def test_damage_is_located_by_its_container(tmp_path: Path) -> None:
    good = container(THREE)
    objects = THREE + blf_object(CAN_MESSAGE, classic(1, bytes(8)), size=5)
    third = 144 + 2 * len(good)
    assert f"at byte {third} contains an object of 5" in refusal_of(
        tmp_path, blf_file(good, good, container(objects), good)
    )
    begins, goes_on = FRAME[:20], FRAME[20:]
    split = [container(begins), container(goes_on + FRAME[:8] + b"\1\0\0\0" + FRAME[12:]), good]
    second = 144 + len(split[0])
    assert f"at byte {second} contains an object of 1 bytes" in refusal_of(tmp_path, blf_file(*split))


def memory_and_time(path: Path) -> tuple[int, float, OncenterError | None]:
    """Peak memory in bytes and time in seconds of reading."""
    error = None
    began = time.monotonic()
    tracemalloc.start()
    try:
        for _ in blf.chunks(path, [], lambda fraction: None):
            pass
    except OncenterError as refused:
        error = refused
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return peak, time.monotonic() - began, error


SMALLEST = blf_object(MARKER, b"", size=16, header_size=16)[:16]
FULL = blf.MAX_CONTAINER_BYTES


@pytest.mark.slow
@pytest.mark.parametrize(
    "content",
    [
        pytest.param(lambda: [container(bytes(2 * FULL), unpacked=48)], id="zeros that say they are a frame"),
        pytest.param(lambda: [container(bytes(FULL))], id="zeros"),
        pytest.param(lambda: [container(b"LOBJ" * (FULL // 4))], id="signatures"),
        pytest.param(lambda: [container(SMALLEST * (FULL // 16))], id="smallest objects"),
        pytest.param(lambda: [container(FRAME * (FULL // 48))], id="frames"),
        pytest.param(
            lambda: [container(FRAME * (FULL // 480) + (FRAME[:-4] + b"LOBJ") * 1000)] * 9, id="signatures in data"
        ),
        pytest.param(lambda: [container(SMALLEST * 60_000)] * 1500, id="gigabytes of objects"),
        pytest.param(lambda: [container(b"")] * 50_000, id="empty containers"),
        pytest.param(
            lambda: [container(blf_object(MARKER, b"", size=FULL)), *[container(b"1", method=STORED)] * 50_000],
            id="an object that does not end",
        ),
        pytest.param(
            lambda: [container(blf_object(MARKER, b"", size=FULL)), *[container(bytes(100_000))] * 335] * 2,
            id="objects that go on for megabytes",
        ),
    ],
)
def test_a_hostile_log_takes_bounded_memory_and_time(tmp_path: Path, content: Callable[[], list[bytes]]) -> None:
    path = tmp_path / "hostile.blf"
    path.write_bytes(blf_file(*content()))
    peak, seconds, _ = memory_and_time(path)
    assert peak < 6 * blf.MAX_CONTAINER_BYTES
    assert seconds < 20.0


def test_a_log_that_unpacks_to_an_implausible_size_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.blf"
    path.write_bytes(blf_file(*[container(FRAME * 20_000)] * 200))
    assert path.stat().st_size < 2_000_000
    _, _, error = memory_and_time(path)
    assert error is not None
    assert "bytes or more" in str(error)


MIXED_OBJECTS = [
    blf_object(CAN_MESSAGE, classic(0x18FEF100 | EXTENDED, b"abcdefgh"), ticks=10),
    blf_object(CAN_MESSAGE, classic(0x18FEF100 | EXTENDED, b"bcdefghi"), ticks=20),
    blf_object(CAN_MESSAGE_2, classic(0x123, b"abc", channel=2) + bytes(8), ticks=30, version=2),
    blf_object(MARKER, bytes(13)),
    blf_object(CAN_FD, flexible(0x77, b"12345"), ticks=40),
    blf_object(CAN_ERROR_EXT, bytes(32), ticks=45),
    blf_object(CAN_FD_64, flexible_64(0x78 | EXTENDED, b"12345678"), ticks=50),
    blf_object(CAN_FD_64, flexible_64(0x79, b"12", length=8, extension_at=74, extension=bytes(8)), ticks=60),
    blf_object(CAN_FD, flexible(0x77, bytes(32)), ticks=70),
    blf_object(CAN_MESSAGE, classic(0x124, bytes(8), flags=0x80), ticks=80),
    blf_object(CAN_MESSAGE, classic(0x125, bytes(1)), ticks=90, unit=1),
]
MIXED = padded(*MIXED_OBJECTS, *MIXED_OBJECTS)
MUTATION = st.tuples(
    st.sampled_from(["flip", "byte", "number", "cut", "remove", "repeat"]),
    st.floats(0, 1, exclude_max=True),
    st.sampled_from(
        [0, 1, 2, 7, 8, 9, 15, 16, 31, 32, 40, 48, 86, 96, 100, 101, 127, 128, 255, 1 << 16, 1 << 31, 2**32 - 1]
    ),
)


def mutated(content: bytes, mutations: list[tuple[str, float, int]]) -> bytes:
    for way, share, value in mutations:
        at = int(share * len(content))
        if way == "flip":
            content = content[:at] + bytes([content[at] ^ 1 << value % 8] if content else []) + content[at + 1 :]
        elif way == "byte":
            content = content[:at] + bytes([value & 0xFF]) + content[at + 1 :]
        elif way == "number":
            at &= ~3
            content = content[:at] + value.to_bytes(4, "little") + content[at + 4 :]
        elif way == "cut":
            content = content[: max(at, 1)]
        elif way == "remove":
            content = content[:at] + content[at + value % 64 + 1 :]
        else:
            content = content[: at + value % 64] + content[at:]
    return content


@settings(max_examples=400)
@given(
    inside=st.lists(MUTATION, max_size=3),
    outside=st.lists(MUTATION, max_size=2),
    method=st.sampled_from([STORED, DEFLATED]),
    piece=st.sampled_from([100, 333, 4000]),
    closed=st.booleans(),
)
def test_a_mutated_log_is_refused_or_gives_the_frames_that_python_can_finds(
    inside: list[tuple[str, float, int]], outside: list[tuple[str, float, int]], method: int, piece: int, closed: bool
) -> None:
    contents = mutated(MIXED, inside)
    parts = [container(contents[k : k + piece], method=method) for k in range(0, len(contents), piece)]
    content = mutated(blf_file(*parts, written=None if closed else 0), outside)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mutant.blf"
        path.write_bytes(content)
        peak, seconds, error = memory_and_time(path)
        assert peak < 1 << 22
        assert seconds < 5.0
        if error is not None:
            assert "\n" not in str(error)
            assert "mutant.blf" in str(error)
            return
        try:
            theirs = python_can_frames(path)  # which ends: sizes that it does not check are refused above
        except Exception:
            return  # it refuses more headers than we do
        assert_same(our_frames(path), theirs)
