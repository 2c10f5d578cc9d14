"""MATLAB 7.3, which is HDF5: a dataset is a transposed matrix, a group is a struct, the rest are references.

Nothing outside the file is read: external links, virtual datasets and external storage are left out.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from oncenter.files.extra import require_package
from oncenter.read.mat_values import Budget, Opaque, Value
from oncenter.read.wording import damaged, reason_of


def variables(path: Path) -> dict[str, Value]:
    """
    Raises:
        OncenterError: it cannot be read; "missing_extra".
    """
    require_package("h5py", path.name)
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return _fields(file, file, Budget())
    except Exception as error:  # h5py raises key, value, type, OS and runtime errors for broken files
        raise damaged(path.name, reason_of(error)) from None


def _fields(file: Any, group: Any, budget: Budget) -> dict[str, Value]:
    """Values by name, without MATLAB's internal ones, whose names begin with #."""
    import h5py

    with budget.deeper():
        return {
            name: _value(file, group[name], budget)
            for name in group
            if not name.startswith("#") and isinstance(group.get(name, getlink=True), h5py.HardLink)
        }


def _value(file: Any, found: Any, budget: Budget) -> Value:
    import h5py

    kind = _text(found.attrs.get("MATLAB_class", b""))
    if "MATLAB_object_decode" in found.attrs:
        return Opaque(kind)
    if isinstance(found, h5py.Group):
        return _struct(file, found, budget)
    if not isinstance(found, h5py.Dataset) or "MATLAB_empty" in found.attrs or not _is_inside(found):
        return None
    if kind == "char":
        return "".join(map(chr, np.ravel(found[()]).tolist()))
    if kind == "cell" or found.dtype.kind not in "biuf":
        return None
    return np.asarray(found[()]).T


def _is_inside(dataset: Any) -> bool:
    """Whether the values of a dataset are in this file: reading others opens the files that it names."""
    return not (dataset.is_virtual or dataset.external)


def _struct(file: Any, group: Any, budget: Budget) -> Value:
    """A struct, or an array of structs, whose fields are references."""
    import h5py

    members = [group[name] for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink)]
    are_references = [
        isinstance(member, h5py.Dataset)
        and _is_inside(member)
        and h5py.check_ref_dtype(member.dtype) is h5py.Reference
        and "MATLAB_class" not in member.attrs
        for member in members
    ]
    if not members or not all(are_references):
        return _fields(file, group, budget)
    references = {member.name.rpartition("/")[2]: np.ravel(member[()]) for member in members}
    count = min(map(len, references.values()))
    with budget.deeper(count):
        return [
            {name: _value(file, file[each[place]], budget) for name, each in references.items()}
            for place in range(count)
        ]


def _text(attribute: object) -> str:
    return attribute.decode("utf-8", "replace") if isinstance(attribute, bytes) else str(attribute)
