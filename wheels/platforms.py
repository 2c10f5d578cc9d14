"""The platforms with a wheel, and their names in zig."""

from __future__ import annotations

from typing import NamedTuple


class Platform(NamedTuple):
    """One wheel."""

    tag: str  # as pip names it
    target: str  # as zig names it; with the oldest glibc or macOS version that the tag allows
    library: str  # file name


PLATFORMS = (
    Platform("manylinux2014_x86_64", "x86_64-linux-gnu.2.17", "liboncenter.so"),
    Platform("manylinux2014_aarch64", "aarch64-linux-gnu.2.17", "liboncenter.so"),
    Platform("musllinux_1_1_x86_64", "x86_64-linux-musl", "liboncenter.so"),
    Platform("musllinux_1_1_aarch64", "aarch64-linux-musl", "liboncenter.so"),
    Platform("macosx_11_0_x86_64", "x86_64-macos.11.0", "liboncenter.dylib"),
    Platform("macosx_11_0_arm64", "aarch64-macos.11.0", "liboncenter.dylib"),
    Platform("win_amd64", "x86_64-windows-gnu", "liboncenter.dll"),
    Platform("win_arm64", "aarch64-windows-gnu", "liboncenter.dll"),
)
