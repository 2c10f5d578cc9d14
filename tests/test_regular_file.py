"""Only regular files are read: a pipe would block for ever, a device would never end."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from oncenter.errors import OncenterError
from oncenter.files.regular_file import open_regular_file, read_regular_file, refuse_what_is_no_regular_file

pytestmark = pytest.mark.system


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    return path


def test_a_pipe_a_device_and_a_folder_are_not_opened(pipe: Path, tmp_path: Path) -> None:
    link = tmp_path / "zeros"
    link.symlink_to("/dev/zero")
    for path, why in ((pipe, "device or a pipe"), (link, "device or a pipe"), (tmp_path, "is a directory")):
        with pytest.raises(OSError, match=why):
            open_regular_file(path)
        with pytest.raises(OncenterError, match=why) as refusal:
            refuse_what_is_no_regular_file(path, "DBC", code="bad_dbc", exit_code=2)
        assert (refusal.value.code, refusal.value.exit_code) == ("bad_dbc", 2)


@pytest.mark.posix
def test_a_pipe_that_takes_the_place_of_a_file_does_not_block(pipe: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    of_this_file = os.stat(__file__)
    monkeypatch.setattr(os, "stat", lambda path: of_this_file)
    with pytest.raises(OSError, match="device or a pipe"):
        open_regular_file(pipe)


def test_a_missing_path_is_named(tmp_path: Path) -> None:
    for path in (str(tmp_path / "none"), "with\0zero"):
        with pytest.raises(OncenterError, match="cannot read") as refusal:
            refuse_what_is_no_regular_file(path)
        assert path in str(refusal.value)


def test_a_file_is_read_whole_up_to_its_limit_and_refused_above(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"12345678")
    assert read_regular_file(file, 8) == b"12345678"
    with pytest.raises(OSError, match="larger than 7 bytes"):
        read_regular_file(file, 7)
