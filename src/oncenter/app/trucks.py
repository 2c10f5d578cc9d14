"""The trucks of the page: vehicle files in a folder of this user, and the shipped ones."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

from oncenter.app.drives import Drives
from oncenter.app.fields import number, wrong
from oncenter.app.texts import ENGLISH
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.file_name import file_stem
from oncenter.files.log_formats import DATABASES
from oncenter.files.whole_file import write_whole
from oncenter.vehicle import vehicle
from oncenter.vehicle_file.new import new_vehicle_file, proposals_for
from oncenter.vehicle_file.proposals import Proposal
from oncenter.vehicle_file.shipped_files import shipped_names

OWN = "yours"  # group of the user's trucks
_DATABASES_MAX = 50  # of a truck
UNKNOWN = "unknown"  # group and name of a truck that nobody describes
_NUMBERS = ("wheelbase_m", "steering_ratio")
_WORDS = ("axle_layout", "traffic_side")


class Kept(NamedTuple):
    """The name of a truck's file, and what was found in its database or log, a line each."""

    name: str
    signals: list[str]
    notes: list[str]


class Trucks:
    """Args: folder: made when the first truck is kept."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def names(self) -> dict[str, dict[str, str]]:
        """The name of each truck for people, by that of its file."""
        own = sorted(path.stem for path in self._folder.glob("*.toml")) if self._folder.is_dir() else []
        return {OWN: {stem: unquote(stem) for stem in own}, "shipped": {name: name for name in shipped_names()}}

    def layouts(self) -> dict[str, dict[str, str]]:
        """The axle layout of each, empty where it is not given or the file cannot be read."""
        return {
            group: {name: _layout(self.file_of(group, name)) for name in names} for group, names in self.names().items()
        }

    def file_of(self, group: str, name: str) -> str:
        """As `oncenter offset --vehicle` takes it."""
        return name if group == "shipped" else str(self._folder / f"{name}.toml")

    def options(self, group: str, name: str) -> list[str]:
        """The options of `oncenter offset` for a name of `names`, or for the truck of group `UNKNOWN`.

        Raises:
            OncenterError: "page": any other.
        """
        if group == UNKNOWN:
            return []
        if name not in self.names().get(group, {}):
            raise OncenterError(ENGLISH["needs_truck"], code="page")
        memory = ["--memory", str(self.drives(name).memory)] if group == OWN else []
        return ["--vehicle", self.file_of(group, name), *memory]

    def drives(self, name: str) -> Drives:
        """Of one of the user's own trucks.

        Raises:
            OncenterError: "page": there is no such truck.
        """
        if name not in self.names()[OWN]:
            raise OncenterError(ENGLISH["needs_truck"], code="page")
        return Drives(self._folder / "drives" / name, vehicle(self.file_of(OWN, name)))

    def forget(self, name: str) -> None:
        """With its drives and the copies of its databases.

        Raises:
            OncenterError: "page": there is no such truck.
        """
        if name not in self.names()[OWN]:
            raise OncenterError(ENGLISH["needs_truck"], code="page")
        shutil.rmtree(self._folder / "drives" / name, ignore_errors=True)
        (self._folder / f"{name}.toml").unlink()
        for place, suffix in product(range(1, _DATABASES_MAX + 1), DATABASES):
            (self._folder / f"{name}-{place}{suffix}").unlink(missing_ok=True)

    def keep(self, form: Mapping[str, Any], databases: Sequence[Path], log: Path | None) -> Kept:
        """Writes a vehicle file from what a person typed, with copies of the databases beside it.

        Args:
            form: its fields, as text.
            databases: of a network that is not J1939.
            log: a drive of this truck, which decides between signals of similar names.

        Raises:
            OncenterError: "vehicle_file": a field is not a number or out of its range; "page": a truck has this name.
        """
        name = str(form.get("name", "")).strip()
        if not name:
            raise wrong("name", "give the truck a name")
        path = self._folder / f"{file_stem(name)[:60]}.toml"
        if path.exists():
            raise OncenterError(
                f"there is a truck named {unquote(path.stem)}: choose it, or take another name",
                code="page",
                exit_code=WRONG_USAGE,
                needs=("name",),
            )
        values = {"name": name, **{field: number(field, form) for field in _NUMBERS if form.get(field)}}
        values |= {field: form[field] for field in _WORDS if form.get(field)}
        new_vehicle_file(path, values, [])  # what is typed is checked before files are read
        proposed, notes = proposals_for(databases, log) if databases or log is not None else ([], [])
        self._folder.mkdir(parents=True, exist_ok=True)
        copies = [path.with_name(f"{path.stem}-{number}{each.suffix}") for number, each in enumerate(databases, 1)]
        for copy, given in zip(copies, databases, strict=True):
            write_whole(copy, given.read_bytes())
        write_whole(
            path, new_vehicle_file(path, values | ({"dbc": list(map(str, copies))} if copies else {}), proposed)
        )
        return Kept(path.stem, [_line(each) for each in proposed], notes)


def _layout(file: str) -> str:
    try:
        return vehicle(file).axle_layout or ""
    except OncenterError:
        return ""


def _line(proposed: Proposal) -> str:
    """The name of a signal in the log, beside what it is."""
    sign = ", reversed" if proposed.sign < 0 else ""
    more = "".join(
        f", {what} {name}" for what, name in (("plus", proposed.plus), ("sign by", proposed.sign_by)) if name
    )
    name = proposed.signal_name()
    unit = (name.unit or "").replace("_", "/").replace("s2", "s²")
    return f"{proposed.signal.replace('_', ' ')}: {proposed.named.name} ({unit}{sign}{more})"
