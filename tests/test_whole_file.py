"""A file is written whole or stays as it was, whatever stands at its path; tests/test_full_disk.py fills the disk."""

from __future__ import annotations

import os
import select
import socket
import stat
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import polars as pl
import pytest

from oncenter.errors import OncenterError
from oncenter.files.whole_file import check_place, remove_unfinished, whole_file, write_whole

pytestmark = pytest.mark.system

FULL = Path("/dev/full")


@contextmanager
def refused(path: Path, why: str) -> Iterator[None]:
    """The block must be refused in one line that names the path, as a wrong output."""
    with pytest.raises(OncenterError) as refusal:
        yield
    message = str(refusal.value)
    assert message.startswith(f"cannot write {path}: ") and why in message and "\n" not in message
    assert (refusal.value.code, refusal.value.exit_code) == ("output", 2)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """A file of before."""
    path = tmp_path / "page.html"
    path.write_text("old")
    return path


def test_the_old_file_stays_until_the_new_one_is_complete(page: Path) -> None:
    with whole_file(page) as unfinished:
        unfinished.write_text("new")
        assert page.read_text() == "old"
    assert page.read_text() == "new"
    assert os.listdir(page.parent) == [page.name]


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), ValueError("a bug"), KeyboardInterrupt()])
@pytest.mark.parametrize("is_there", [True, False])
def test_a_writer_that_fails_changes_nothing(failure: BaseException, is_there: bool, page: Path) -> None:
    if not is_there:
        page.unlink()
    before = sorted(os.listdir(page.parent))
    with pytest.raises((OncenterError, ValueError, KeyboardInterrupt)), whole_file(page) as unfinished:
        unfinished.write_text("ne")
        raise failure
    assert sorted(os.listdir(page.parent)) == before
    assert not is_there or page.read_text() == "old"


@pytest.mark.parametrize("failure", [OSError(28, "No space left\non it"), pl.exceptions.ComputeError("No space left")])
def test_a_failing_disk_is_one_line_and_an_internal_error_stays_one(failure: Exception, page: Path) -> None:
    with refused(page, "No space left"), whole_file(page):
        raise failure
    with pytest.raises(ValueError, match="a bug"), whole_file(page):
        raise ValueError("a bug")


@pytest.mark.posix
def test_content_is_flushed_before_the_rename_and_the_folder_after_it(
    page: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A power cut in between leaves the old file or the new one."""
    done: list[str] = []
    sync, replace = os.fsync, os.replace

    def synced(file: int) -> None:
        given = os.fstat(file)
        done.append("folder synced" if stat.S_ISDIR(given.st_mode) else f"{given.st_size} bytes synced")
        sync(file)

    def replaced(one: Path, other: Path) -> None:
        done.append("renamed")
        replace(one, other)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", replaced)
    write_whole(page, "new")
    assert done == ["3 bytes synced", "renamed", "folder synced"]


@pytest.mark.parametrize("is_there", [True, False])
def test_a_link_is_not_followed_and_its_target_is_named(is_there: bool, page: Path, tmp_path: Path) -> None:
    """In a shared folder it may be another user's, and lead to any file of this one."""
    if not is_there:
        page.unlink()
    link = tmp_path / "links" / "link.html"
    link.parent.mkdir()
    link.symlink_to("../page.html")
    for write in (check_place, lambda path: write_whole(path, "new")):
        with refused(link, f"it is a link; name the file to which it leads: {page}"):
            write(link)
    assert link.is_symlink() and page.exists() == is_there
    assert not is_there or page.read_text() == "old"


def test_a_link_that_takes_the_place_of_the_file_meanwhile_is_not_followed(page: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.html"
    with refused(out, "it is a link"), whole_file(out) as unfinished:
        unfinished.write_text("new")
        out.symlink_to(page)
    assert page.read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == ["out.html", "page.html"]


@pytest.mark.posix
def test_a_link_of_another_user_to_a_device_is_not_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    link = tmp_path / "null.html"
    link.symlink_to(os.devnull)
    write_whole(link, "new")
    if os.geteuid() == 0:
        os.chown(link, 12345, 12345, follow_symlinks=False)
    monkeypatch.setattr(os, "geteuid", lambda: 54321)
    with refused(link, "it is a link"):
        write_whole(link, "new")


@pytest.mark.posix
def test_an_existing_file_keeps_mode_and_owner_and_a_new_one_follows_the_umask(page: Path) -> None:
    page.chmod(0o604)
    if os.geteuid() == 0:  # who alone may give a file away
        os.chown(page, 12345, 12346)
    before = page.stat()
    write_whole(page, "new")
    after = page.stat()
    assert (after.st_mode, after.st_uid, after.st_gid) == (before.st_mode, before.st_uid, before.st_gid)
    umask = os.umask(0o027)
    try:
        write_whole(page.with_name("other.html"), "new")
    finally:
        os.umask(umask)
    assert stat.S_IMODE(page.with_name("other.html").stat().st_mode) == 0o640


@pytest.mark.posix
def test_a_writer_that_makes_the_file_anew_changes_no_mode(page: Path) -> None:
    page.chmod(0o640)
    with whole_file(page) as unfinished:
        unfinished.unlink()
        unfinished.write_text("new")
    assert stat.S_IMODE(page.stat().st_mode) == 0o640


@pytest.mark.parametrize("name", ["drive.csv.gz", "drive.mf4", "a" * 250 + ".html", "ü" * 125 + ".mf4", ".csv"])
def test_the_file_beside_is_hidden_and_new_and_ends_in_the_same_suffix(name: str, tmp_path: Path) -> None:
    with whole_file(tmp_path / name) as one, whole_file(tmp_path / name) as other:
        assert one != other
        for path in (one, other):
            assert path.parent == tmp_path and path.name.startswith(".")
            assert path.name.endswith("".join(Path(name).suffixes) or name)
    assert os.listdir(tmp_path) == [name]


def test_a_half_written_text_has_no_suffix_by_which_a_program_would_read_it(
    page: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside: list[str] = []
    sync = os.fsync

    def synced(file: int) -> None:
        beside.extend(name for name in os.listdir(page.parent) if name != page.name)
        sync(file)

    monkeypatch.setattr(os, "fsync", synced)
    write_whole(page, "new")
    assert len(beside) == 1 and not beside[0].endswith(page.suffix)


def test_impossible_paths_are_refused_before_anything_is_written(page: Path, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "to_nowhere").symlink_to("nowhere/page.html")
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "s"))
    for name, why in (
        (".", "it is a folder"),
        ("nowhere/page.html", "there is no folder"),
        ("to_nowhere", "it is a link"),
        ("page.html/page.html", "Not a directory"),
        ("loop", "symbolic links"),
        ("s", "it is not a file"),
        ("a" * 256, "File name too long"),
    ):
        path = tmp_path / name
        for write in (check_place, lambda path: write_whole(path, "new")):
            with refused(path, why):
                write(path)
    assert page.read_text() == "old"


def test_a_write_protected_file_or_folder_is_left_alone(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root, who often runs tests, may write anywhere: the operating system is made to refuse."""
    may, locked = os.access, {page}
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) not in locked and may(path, mode))
    with refused(page, "write-protected"):
        write_whole(page, "new")
    locked = {page.parent}
    with refused(page, f"{page.parent} is write-protected"):
        write_whole(page, "new")
    assert page.read_text() == "old"


def test_a_file_without_room_for_one_beside_it_stays(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "open", full)
    with refused(page, "No space left"):
        write_whole(page, "new")
    assert page.read_text() == "old"


def test_an_invalid_name_is_escaped(tmp_path: Path) -> None:
    write_whole(tmp_path / "page.html", os.fsdecode(b"\xc3\xbc bad\xff.csv"))
    assert (tmp_path / "page.html").read_bytes() == b"\xc3\xbc bad\\udcff.csv"


@pytest.mark.posix
def test_a_pipe_without_a_reader_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.html"
    os.mkfifo(pipe)
    said: list[str] = []

    def write() -> None:
        with refused(pipe, "has no reader"):
            write_whole(pipe, "new")
        said.append("refused")

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    writer.join(20.0)
    assert said == ["refused"] and pipe.is_fifo()


@pytest.mark.posix
def test_a_pipe_that_is_read_gets_all_of_it(tmp_path: Path) -> None:
    pipe, content, read = tmp_path / "pipe.html", os.urandom(1_000_000), []
    os.mkfifo(pipe)
    file = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(file, True)

    def read_all() -> None:
        select.select([file], [], [], 20.0)  # without a writer its end would be read
        with os.fdopen(file, "rb") as reading:
            read.append(reading.read())

    reader = threading.Thread(target=read_all)
    reader.start()
    write_whole(pipe, content)
    reader.join(20.0)
    assert read == [content] and pipe.is_fifo()
    assert os.listdir(tmp_path) == [pipe.name]


@pytest.mark.posix
def test_a_pipe_closed_by_its_reader_is_one_line(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.html"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    with refused(pipe, "Broken pipe"), whole_file(pipe) as unfinished:
        unfinished.write_text("new")
        os.close(reader)


def test_devices_are_written_directly(tmp_path: Path) -> None:
    write_whole("/dev/null", "new")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    (tmp_path / "full.html").symlink_to(FULL)
    with refused(tmp_path / "full.html", "No space left"):
        write_whole(tmp_path / "full.html", "new")
    assert (tmp_path / "full.html").is_symlink() and stat.S_ISCHR(FULL.stat().st_mode)


@pytest.mark.parametrize("redirection", ["| cat", "> out.txt; cat out.txt"])
def test_standard_output_can_be_the_target_and_keeps_earlier_output(redirection: str, tmp_path: Path) -> None:
    program = (
        "from oncenter.files.whole_file import write_whole; print('before', flush=True); "
        "write_whole('/dev/stdout', 'page\\n'); print('after')"
    )
    words = f'"{sys.executable}" -c "{program}" {redirection}'
    done = subprocess.run(["sh", "-c", words], capture_output=True, text=True, cwd=tmp_path, timeout=60)
    assert (done.stdout, done.stderr) == ("before\npage\nafter\n", "")


def test_only_remains_of_killed_writers_are_removed(tmp_path: Path) -> None:
    with whole_file(tmp_path / "page.html") as unfinished:
        left = unfinished.name
    (tmp_path / left).write_text("ne")
    (tmp_path / ".mine").write_text("mine")
    remove_unfinished(tmp_path)
    remove_unfinished(tmp_path / "nowhere")
    assert sorted(os.listdir(tmp_path)) == [".mine", "page.html"]
