"""The trucks of the page: vehicle files in a folder of this user, and the shipped ones."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from oncenter.app.drives import Drives
from oncenter.app.fields import number, wrong
from oncenter.app.texts import ENGLISH
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.file_name import file_stem
from oncenter.files.log_formats import DATABASES
from oncenter.files.toml_file import read_toml
from oncenter.files.whole_file import write_whole
from oncenter.report.truck_part import of_truck
from oncenter.vehicle import Vehicle, vehicle
from oncenter.vehicle_file.new import new_vehicle_file
from oncenter.vehicle_file.shipped_files import shipped_names

OWN = "yours"  # group of the user's trucks
_DATABASES_MAX = 50  # of a truck
UNKNOWN = "unknown"  # group and name of a truck that nobody describes
_NUMBERS = ("wheelbase_m", "steering_ratio")
_WORDS = ("axle_layout", "traffic_side")


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

    def sign_of(self, group: str, name: str) -> int:
        """As `Vehicle.angle_sign` of an own truck."""
        return vehicle(self.file_of(OWN, name)).angle_sign if group == OWN else 1

    def drives(self, name: str) -> Drives:
        """Of one of the user's own trucks.

        Raises:
            OncenterError: "page": there is no such truck.
        """
        if name not in self.names()[OWN]:
            raise OncenterError(ENGLISH["needs_truck"], code="page")
        return Drives(self._folder / "drives" / name, vehicle(self.file_of(OWN, name)))

    def about(self, name: str) -> dict[str, Any]:
        """One of the user's own trucks, with its drives.

        Raises:
            OncenterError: "page": there is no such truck.
        """
        drives = self.drives(name).listed()
        truck = vehicle(self.file_of(OWN, name))
        fields = {key: "" if key in truck.assumed else f"{getattr(truck, key)}" for key in _NUMBERS}
        fields |= {key: getattr(truck, key) or "" for key in _WORDS}
        return {"facts": _facts(truck), "fields": {"name": truck.name, **fields}, **drives}

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

    def described(self, form: Mapping[str, Any]) -> dict[str, Any]:
        """The values of a vehicle file: of the truck whose file `form` names as "truck", else what a person typed.

        Raises:
            OncenterError: "vehicle_file": a field is not a number or out of its range; "page": a truck has this name,
                or there is no such truck.
        """
        if form.get("truck"):
            values = self._of_file(str(form["truck"]))
            if "name" in form:  # with what is typed in place of its numbers; a ratio of an engineer stays
                typed = [key for key in (*_NUMBERS, *_WORDS) if not isinstance(values.get(key), list)]
                values = {key: value for key, value in values.items() if key not in typed}
                values |= {key: value for key, value in _typed(form).items() if key in typed}
            return values
        name = str(form.get("name", "")).strip()
        if not name:
            raise wrong("name", "give the truck a name")
        path = self._path(name)
        if path.exists():
            raise OncenterError(
                f"there is a truck named {unquote(path.stem)}: choose it, or take another name",
                code="page",
                exit_code=WRONG_USAGE,
                needs=("name",),
            )
        values = {"name": name, **_typed(form)}
        new_vehicle_file(path, values, [])  # what is typed is checked before files are read
        return values

    def _of_file(self, stem: str) -> dict[str, Any]:
        """With absolute paths of its databases."""
        if stem not in self.names()[OWN]:
            raise OncenterError(ENGLISH["needs_truck"], code="page")
        path = self._folder / f"{stem}.toml"
        values = dict(read_toml(path, f"vehicle file {path.name}", code="vehicle_file"))
        truck = vehicle(path)
        return values | ({"dbc": list(map(str, truck.databases()))} if truck.dbc else {})

    def keep(
        self, form: Mapping[str, Any], values: Mapping[str, Any], databases: Sequence[Path], signals: Mapping[str, Any]
    ) -> str:
        """Writes a vehicle file, with copies of the databases beside it. Returns the name of the file.

        Args:
            form: as of `described`; a truck that it names is replaced.
            values: as `described` gives them.
            databases: of a network that is not J1939, besides those of the values.
            signals: the `[signals]` table.
        """
        path = self._folder / f"{form['truck']}.toml" if form.get("truck") else self._path(values["name"])
        if form.get("truck") and {**values, "signals": signals} != {"signals": {}, **self._of_file(path.stem)}:
            shutil.rmtree(self._folder / "drives" / path.stem, ignore_errors=True)  # answered with the former data
        self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)  # for no other user
        of_truck = list(values.get("dbc", ()))
        for place, given in enumerate(databases, len(of_truck) + 1):
            copy = path.with_name(f"{path.stem}-{place}{given.suffix}")
            write_whole(copy, given.read_bytes())
            of_truck.append(str(copy))
        given_tables = {"dbc": of_truck, "signals": signals}
        written = {**values, **{key: value for key, value in given_tables.items() if value}}
        write_whole(path, new_vehicle_file(path, written, []))
        return path.stem

    def _path(self, name: str) -> Path:
        return self._folder / f"{file_stem(name)[:60]}.toml"


def _typed(form: Mapping[str, Any]) -> dict[str, Any]:
    values: dict[str, Any] = {field: number(field, form) for field in _NUMBERS if form.get(field)}
    return values | {field: form[field] for field in _WORDS if form.get(field)}


def _facts(truck: Vehicle) -> list[str]:
    """The truck as it is kept, in the words of its report: they show a mistake in typing."""
    return [f"{title}: {value}" for title, value in of_truck(truck).items()]


def _layout(file: str) -> str:
    try:
        return vehicle(file).axle_layout or ""
    except OncenterError:
        return ""
