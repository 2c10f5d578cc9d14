"""The trucks of the page: vehicle files in a folder of this user, and the shipped ones."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from oncenter.app.texts import ENGLISH
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.file_name import file_stem
from oncenter.files.toml_file import read_toml
from oncenter.files.whole_file import write_whole
from oncenter.vehicle import vehicle
from oncenter.vehicle_file.new import new_vehicle_file
from oncenter.vehicle_file.shipped_files import shipped_names

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
        return {"yours": {stem: unquote(stem) for stem in own}, "shipped": {name: name for name in shipped_names()}}

    def options(self, group: str, name: str) -> list[str]:
        """The options of `oncenter offset` for a name of `names`, or for the truck of group `UNKNOWN`.

        Raises:
            OncenterError: "page": any other.
        """
        if group == UNKNOWN:
            return []
        if name not in self.names().get(group, {}):
            raise OncenterError(ENGLISH["needs_truck"], code="page")
        return ["--vehicle", name if group == "shipped" else str(self._folder / f"{name}.toml")]

    def described(self, form: Mapping[str, Any]) -> dict[str, Any]:
        """The values of a vehicle file: of the truck whose file `form` names as "truck", else what a person typed.

        Raises:
            OncenterError: "vehicle_file": a field is not a number or out of its range; "page": a truck has this name,
                or there is no such truck.
        """
        if form.get("truck"):
            return self._of_file(str(form["truck"]))
        name = str(form.get("name", "")).strip()
        if not name:
            raise _wrong("give the truck a name")
        path = self._path(name)
        if path.exists():
            raise OncenterError(
                f"there is a truck named {unquote(path.stem)}: choose it, or take another name",
                code="page",
                exit_code=WRONG_USAGE,
            )
        values = {"name": name, **{field: number(field, form) for field in _NUMBERS if form.get(field)}}
        values |= {field: form[field] for field in _WORDS if form.get(field)}
        new_vehicle_file(path, values, [])  # what is typed is checked before files are read
        return values

    def _of_file(self, stem: str) -> dict[str, Any]:
        """With absolute paths of its databases."""
        if stem not in self.names()["yours"]:
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
        self._folder.mkdir(parents=True, exist_ok=True)
        of_truck = list(values.get("dbc", ()))
        for number, given in enumerate(databases, len(of_truck) + 1):
            copy = path.with_name(f"{path.stem}-{number}{given.suffix}")
            write_whole(copy, given.read_bytes())
            of_truck.append(str(copy))
        given_tables = {"dbc": of_truck, "signals": signals}
        written = {**values, **{key: value for key, value in given_tables.items() if value}}
        write_whole(path, new_vehicle_file(path, written, []))
        return path.stem

    def _path(self, name: str) -> Path:
        return self._folder / f"{file_stem(name)[:60]}.toml"


def number(field: str, form: Mapping[str, Any]) -> float:
    """As people write it: 3,7 or 3.7 m.

    Raises:
        OncenterError: "vehicle_file": it is not a number.
    """
    written = str(form[field]).strip()
    try:
        return float(re.sub(r"\s*(m|deg|°)$", "", written).replace(",", "."))
    except ValueError:
        about = (field.rpartition("_m")[0] or field).replace("_", " ")
        raise _wrong(f"{about} is not a number: {written}") from None


def _wrong(message: str) -> OncenterError:
    return OncenterError(message, code="vehicle_file", exit_code=WRONG_USAGE)
