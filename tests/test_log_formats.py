"""The table of formats: what a row names exists, and no row hides another."""

from __future__ import annotations

import tomllib
from itertools import permutations
from pathlib import Path

import pytest

from oncenter.files.log_formats import FORMATS, Format, imported

EXTRAS = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"][
    "optional-dependencies"
]


@pytest.mark.parametrize("row", FORMATS, ids=lambda row: row.suffixes[0])
def test_reader_writer_and_extra_of_each_format_exist(row: Format) -> None:
    assert callable(imported(row.reader))
    assert not row.writer or callable(imported(row.writer))
    assert not row.extra or row.extra in EXTRAS


def test_no_two_formats_share_a_suffix_or_first_bytes() -> None:
    for one, other in permutations(FORMATS, 2):
        assert not [suffix for suffix in one.suffixes if suffix.endswith(other.suffixes)]
        assert not [begin for begin in one.begins if begin.startswith(other.begins)]
