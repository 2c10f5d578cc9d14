"""The truck of a log, and its vehicle file."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.file_name import printable_name
from oncenter.files.log_formats import SUFFIXES
from oncenter.files.regular_file import read_regular_file
from oncenter.files.toml_file import BYTES_MAX
from oncenter.vehicle import Vehicle, vehicle
from oncenter.vehicle_keys import OFFSET_LIMIT_DEG

VIN = re.compile(r"(?<![0-9A-Za-z])[A-HJ-NPR-Z0-9]{17}(?![0-9A-Za-z])")  # without I, O and Q: ISO 3779
_DBC_BYTES_MAX = 16 << 20  # the rest is not read
_SUFFIX = re.compile(rf"({'|'.join(map(re.escape, SUFFIXES))})$", re.IGNORECASE)


@dataclass(frozen=True)
class Truck:
    """`name` is the VIN, or the part of the path that names the truck; `vehicle_file` the stem of its vehicle file.
    Both are results of `printable_name`."""

    name: str
    vehicle_file: str


class Trucks:
    """The vehicle files of a folder. `NAME.toml` describes the truck NAME, and all trucks whose VIN begins with NAME.

    Args:
        folder: of `*.toml`.

    Raises:
        OncenterError: "vehicle_file", exit code 2: no such folder, or no vehicle file in it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._files = {printable_name(path.stem): path for path in folder.glob("*.toml")}
        self._read: dict[str, Vehicle] = {}
        if not self._files:
            raise OncenterError(
                f"no vehicle files in {folder}: --vehicles takes a folder with one NAME.toml per truck or model",
                code="vehicle_file",
                exit_code=WRONG_USAGE,
            )

    def by_path(self, uri: str) -> Truck | None:
        """The truck by the file's or else the nearest folder's name that equals a vehicle file's stem, begins with one
        followed by neither letter nor digit, or contains a VIN that a file describes."""
        for part in reversed(PurePosixPath(uri.replace("\\", "/")).parts):
            truck = self._by_part(printable_name(part))
            if truck is not None:
                return truck
        return None

    def _by_part(self, part: str) -> Truck | None:
        for name in (part, _SUFFIX.sub("", part)):
            if name in self._files:
                return Truck(name, name)
        for vin in VIN.findall(part):
            truck = self.by_vin(vin)
            if truck is not None:
                return truck
        ends = [match.start() for match in re.finditer(r"[^0-9A-Za-z]", part)]
        for end in reversed(ends):
            if part[:end] in self._files:
                return Truck(part[:end], part[:end])
        return None

    def by_vin(self, vin: str) -> Truck | None:
        """The truck of the longest stem with which the VIN begins."""
        for end in range(len(vin), 0, -1):
            if vin[:end] in self._files:
                return Truck(vin, vin[:end])
        return None

    def vehicle(self, stem: str) -> Vehicle:
        """
        Raises:
            OncenterError: "vehicle_file", exit code 2, as `oncenter.vehicle`.
        """
        if stem not in self._read:
            self._read[stem] = vehicle(self._files[stem])
        return self._read[stem]

    def offset_limit_deg(self, stem: str | None) -> float:
        """`offset_limit_deg` of a vehicle file; the default if the file is gone or unreadable."""
        try:
            return self.vehicle(stem).offset_limit_deg if stem in self._files else OFFSET_LIMIT_DEG
        except OncenterError:  # reported for each log
            return OFFSET_LIMIT_DEG

    def settings(self, stem: str | None) -> str:
        """A hash of all that an answer depends on beside its log: this version, and the vehicle file with its DBCs; for
        a log without a truck, the names of all vehicle files."""
        if stem is None or stem not in self._files:
            return self._without_vehicle
        try:
            described = read_regular_file(self._files[stem], BYTES_MAX)
        except OSError:
            return _hashed(_core.version().encode(), b"unreadable")
        return _hashed(_core.version().encode(), described, *map(_content, self._dbc(stem)))

    def dbc_size(self, uri: str) -> int:
        """Bytes of the DBCs with which a log is read; if its path names no truck, of the largest set of DBCs."""
        truck = self.by_path(uri)
        if truck is None:
            return self._largest_dbc
        return sum(map(_size, self._dbc(truck.vehicle_file)))

    @cached_property
    def _largest_dbc(self) -> int:
        return max(sum(map(_size, self._dbc(stem))) for stem in self._files)

    def _dbc(self, stem: str) -> tuple[Path, ...]:
        try:
            truck = self.vehicle(stem)
            return (*truck.dbc, truck.learned.path) if truck.learned else truck.dbc
        except OncenterError:  # reported for each log
            return ()

    @cached_property
    def _without_vehicle(self) -> str:
        return _hashed(_core.version().encode(), *sorted(name.encode() for name in self._files))


def _content(path: Path) -> bytes:
    try:
        return read_regular_file(path, _DBC_BYTES_MAX)
    except (OSError, ValueError):  # reported for each log
        return b"unreadable"


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except (OSError, ValueError):  # reported for each log
        return 0


def _hashed(*parts: bytes) -> str:
    return hashlib.blake2b(b"\0".join(parts), digest_size=8).hexdigest()
