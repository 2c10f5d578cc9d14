"""Packed logs of every format, within bounds. A ZIP archive with one log is it, with several it is those logs."""

from __future__ import annotations

import bz2
import gzip
import io
import json
import lzma
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from drive_frames import candump, drive
from test_read_formats import asc, trc, written
from test_read_frame_table import canedge

from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.live.replay import Replay
from oncenter.read import packed, read


def zstd(content: bytes) -> bytes:
    from backports import zstd

    return zstd.compress(content)


def archive(content: bytes, name: str = "folder/drive.log") -> bytes:
    return archive_of({name: content, "folder/": b"", "__MACOSX/._drive.log": b"x", "readme.txt": b"Dear Sir,\n"})


def archive_of(files: dict[str, bytes]) -> bytes:
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as archive_:
        for name, content in files.items():
            archive_.writestr(name, content)
    return whole.getvalue()


PACK: dict[str, Callable[[bytes], bytes]] = {
    ".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress, ".zst": zstd, ".zip": archive,
}  # fmt: skip


def log(folder: Path, suffix: str) -> bytes:
    text = {".log": candump(drive()), ".asc": asc(), ".trc": trc("2.1"), ".csv": canedge(list(drive()))}
    return text[suffix].encode() if suffix in text else written(folder, suffix).read_bytes()


@pytest.mark.parametrize("packing", PACK)
@pytest.mark.parametrize("suffix", [".log", ".asc", ".trc", ".csv", ".blf", ".mf4"])
def test_a_packed_log_is_the_log(suffix: str, packing: str, tmp_path: Path) -> None:
    content = log(tmp_path, suffix)
    plain, path = tmp_path / f"plain{suffix}", tmp_path / f"drive{suffix}{packing}"
    plain.write_bytes(content)
    path.write_bytes(archive(content, f"drive{suffix}") if packing == ".zip" else PACK[packing](content))
    ours, usual = read(path), read(plain)
    assert ours.table.equals(usual.table)
    assert (ours.log, ours.sources, len(ours.notes)) == (str(path), usual.sources, len(usual.notes))


@pytest.mark.parametrize("packing", PACK)
def test_a_name_does_not_matter(packing: str, tmp_path: Path) -> None:
    for name in ("drive", "drive.log", "drive.dat"):
        (tmp_path / name).write_bytes(PACK[packing](candump(drive()).encode()))
        assert read(tmp_path / name).ticks > 300


def test_a_table_in_any_packing_is_the_table(tmp_path: Path) -> None:
    text = "time_s,yaw_rate_deg_s,vehicle_speed_km_h\n" + "".join(f"{0.01 * k:.2f},{k % 7},50\n" for k in range(300))
    (tmp_path / "drive.csv").write_text(text)
    for packing, pack in PACK.items():
        (tmp_path / f"drive.csv{packing}").write_bytes(pack(text.encode()))
        table = read(tmp_path / f"drive.csv{packing}").table
        assert table.equals(read(tmp_path / "drive.csv").table), packing


def test_an_archive_with_several_logs_is_those_logs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = candump(drive()).encode()
    later = text.replace(b"(17000000", b"(17000010")
    path = tmp_path / "drives.zip"
    path.write_bytes(
        archive_of({"a/drive10.log": later, "a/drive2.log.gz": gzip.compress(text), "truck.toml": b"x = 1"})
    )
    assert run(["offset", str(path), "--vehicle", "scania_r730_4x2", "--each", "--json"]) in (0, 1)
    answers = json.loads(capsys.readouterr().out)["answers"]
    assert [each["log"] for each in answers] == [f"{path}/a/drive2.log.gz", f"{path}/a/drive10.log"]
    with pytest.raises(
        OncenterError, match=r"holds 2 logs: a/drive10.log, .* name one of them as drives.zip/a/dr"
    ) as why:
        read(path)
    assert why.value.code == "several_logs"
    assert read(path / "a" / "drive2.log.gz").ticks > 300


def test_a_packed_log_is_replayed(tmp_path: Path) -> None:
    (tmp_path / "drive.log.bz2").write_bytes(bz2.compress(candump(drive()).encode()))
    replay = Replay(tmp_path / "drive.log.bz2", 100.0)
    assert len(replay.take(0.01)) > 0
    replay.close()


def test_a_folder_has_its_packed_logs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for packing, pack in PACK.items():
        (tmp_path / f"drive{packing[1:]}.log{packing}").write_bytes(pack(candump(drive()).encode()))
    assert run(["offset", str(tmp_path), "--vehicle", "scania_r730_4x2", "--each", "--json"]) in (0, 1)
    assert len(json.loads(capsys.readouterr().out)["answers"]) == len(PACK)


def refusal(path: Path, content: bytes) -> OncenterError:
    path.write_bytes(content)
    with pytest.raises(OncenterError) as refused:
        read(path)
    assert path.name in str(refused.value) and "\n" not in str(refused.value)
    return refused.value


@pytest.mark.parametrize("packing", PACK)
def test_a_packed_log_that_is_cut_off_is_refused_in_one_line(packing: str, tmp_path: Path) -> None:
    whole = PACK[packing](candump(drive()).encode())
    for share in (0.2, 0.9):
        error = refusal(tmp_path / f"drive.log{packing}", whole[: int(share * len(whole))])
        assert error.code == "unreadable_log", share


@pytest.mark.parametrize("packing", PACK)
def test_a_file_that_unpacks_to_far_more_than_a_log_is_refused(
    packing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packed, "ALWAYS_UNPACKED_BYTES", 1 << 20)
    path = tmp_path / f"drive.log{packing}"
    path.write_bytes(PACK[packing](bytes(40 << 20)))
    with pytest.raises(OncenterError, match="far more than a log"):
        packed.unpack(path, "", tmp_path)


def test_an_archive_without_a_log_says_what_it_holds(tmp_path: Path) -> None:
    error = refusal(tmp_path / "drive.zip", archive_of({"readme.txt": b"Dear Sir,\n", "a.pdf": b"%PDF-1.4"}))
    assert error.code == "empty_log"
    assert "readme.txt, a.pdf" in str(error)


def test_an_archive_with_a_password_is_refused(tmp_path: Path) -> None:
    content = bytearray(archive_of({"drive.log": candump(drive()).encode()}))
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(mark) + place] |= 1
    assert "needs a password" in str(refusal(tmp_path / "drive.zip", bytes(content)))


def test_a_log_that_is_packed_again_and_again_is_refused(tmp_path: Path) -> None:
    content = candump(drive()).encode()
    (tmp_path / "drive.log.gz").write_bytes(gzip.compress(gzip.compress(content)))
    assert read(tmp_path / "drive.log.gz").ticks > 300
    content = gzip.compress(gzip.compress(gzip.compress(content)))
    assert "more than twice" in str(refusal(tmp_path / "drive.log.gz", content))


def test_a_name_in_an_archive_does_not_lead_out_of_the_folder(tmp_path: Path) -> None:
    text = candump(drive()).encode()
    inside = tmp_path / "in"
    inside.mkdir()
    content = archive_of({"../../up.log": text, "/abs.log": text, "C:\\windows.log": text})
    path = tmp_path / "drives.zip"
    path.write_bytes(content)
    packed.unpack(path, "../../up.log", inside)
    assert [each.relative_to(tmp_path).as_posix() for each in tmp_path.rglob("*.log")] == ["in/0/up.log"]


def test_an_office_document_is_no_archive(tmp_path: Path) -> None:
    content = archive_of({"[Content_Types].xml": b"<xml/>", "xl/drive.log": b"x"})
    assert "Office document" in str(refusal(tmp_path / "drive.xlsx", content))


def test_damage_in_a_deflated_log_is_refused(tmp_path: Path) -> None:
    whole = bytearray(gzip.compress(candump(drive()).encode()))
    whole[len(whole) // 2] ^= 0xFF
    assert refusal(tmp_path / "drive.log.gz", bytes(whole)).code == "unreadable_log"
    assert zlib.crc32(whole)
