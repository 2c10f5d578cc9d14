"""File names are untrusted bytes: they are displayed safely, and names derived from them are short and unique."""

from __future__ import annotations

import os
from itertools import product

import pytest

from oncenter.files.file_name import STEM_BYTES_MAX, file_stem, printable, printable_name

pytestmark = pytest.mark.system


def test_each_text_has_its_own_file_name() -> None:
    keys = ["A B", "a b", "A_B", "A  B", "A%20B", "A/B", "a.b-c_1", "..", "x" * 300]
    keys += ["\N{LATIN SMALL LETTER U WITH DIAERESIS}", "x" * 301, "\udcff", "~", "A~B"]
    stems = [file_stem(key) for key in keys]
    assert len(set(stems)) == len(keys)
    assert all("/" not in stem and len(os.fsencode(stem)) <= STEM_BYTES_MAX for stem in stems)
    for plain in ("a_b", "a.b-c_1", "scania_r730_4x2"):
        assert file_stem(plain) == plain


def test_a_name_is_shown_without_terminal_control_characters() -> None:
    assert printable_name(os.fsdecode(b"bad\xff.csv")) == r"bad\xff.csv"
    assert printable_name("a\x1b[2J\n.csv") == r"a\x1b[2J\x0a.csv"
    assert printable_name("gpj\N{RIGHT-TO-LEFT OVERRIDE}.csv") == r"gpj\xe2\x80\xae.csv"
    for plain in ("/logs/depot-7/M\xfcnchen 2.csv", "C:/logs/a.csv"):
        assert printable_name(plain) == plain


@pytest.mark.posix
def test_a_backslash_in_a_name_is_shown_as_it_is() -> None:
    assert printable_name(r"C:\logs\a.csv") == r"C:\logs\a.csv"


@pytest.mark.posix
def test_no_two_names_look_the_same() -> None:
    pieces = (b"\xff", b"\\xff", b"\\", b"x", b"\\x5c", b"\x1b", b"\\x1b", b"\xc2\x85")
    names = {b"".join(some) for some in product(pieces, repeat=3)}
    shown = {printable_name(os.fsdecode(name)) for name in names}
    assert len(shown) == len(names)
    assert all(printable(name) == name for name in shown)
