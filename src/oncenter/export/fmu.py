"""An FMU from a vehicle: model description, sources and binaries, packed with fixed dates."""

from __future__ import annotations

import hashlib
import io
import os
import uuid
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.export.binaries import binaries, licences
from oncenter.export.core_source import LICENCE, core_files
from oncenter.export.model_description import Fmi, build_description, model_description
from oncenter.export.page import page
from oncenter.export.variables import Variable, c_table, variables_of
from oncenter.files.whole_file import check_place, write_whole
from oncenter.vehicle import Vehicle

_FMI = Path(__file__).with_name("fmi")
_CORE = "core.c"  # includes the core's files, so that the compiler can inline across them
_VARIABLES = "variables.c"
_SOURCES: dict[Fmi, tuple[str, ...]] = {2: ("instance.c", "fmi2.c"), 3: ("instance.c", "fmi3.c", "fmi3_unused.c")}
_HEADERS: dict[Fmi, tuple[str, ...]] = {
    2: ("instance.h", "fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("instance.h", "fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}
_LICENCES = "documentation/licenses/"
_LONG_AGO = (1980, 1, 1, 0, 0, 0)  # the same vehicle gives the same bytes


def write_fmu(vehicle: Vehicle, output: str | os.PathLike[str], *, fmi: Fmi = 2) -> Path:
    """Writes the monitor of one truck as a co-simulation FMU, with sources and binaries.

    With the package ziglang (`pip install 'oncenter[fmu]'`) the binaries are for Windows, Linux and macOS; otherwise
    there is one, for this machine, by its own C compiler.

    Args:
        vehicle: as from `oncenter.vehicle`; its values and `[params]` become the start values of the FMU's
            parameters, which an importer may change before the simulation.
        output: the file to write, ending in .fmu.
        fmi: 2 or 3, for FMI 2.0 or 3.0.

    Returns:
        The path written.

    Raises:
        OncenterError: "output", "compiler" (none, or it reports an error), "vehicle_file" (exit 2).
    """
    path = Path(output)
    if path.suffix != ".fmu":
        raise OncenterError(f"--output takes a .fmu file, got {path.name}", code="output", exit_code=WRONG_USAGE)
    check_place(path)  # before the compilers run, which takes seconds
    files = _contents(vehicle, fmi)
    sources = {Path(name).name: data for name, data in files.items() if name.startswith("sources/")}
    files |= binaries(fmi, sources, _compiled(fmi))
    files |= {f"{_LICENCES}{name}": text for name, text in licences().items()}
    write_whole(path, _packed(files))
    return path


def _packed(files: Mapping[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, _LONG_AGO)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data)
    return packed.getvalue()


def _contents(vehicle: Vehicle, fmi: Fmi) -> dict[str, bytes]:
    """All files of the FMU except its binaries, by path."""
    variables = variables_of(vehicle)
    sources = {file.name: file.read_bytes() for file in core_files()}
    sources[_CORE] = _core_in_one(sources).encode()
    sources |= {name: (_FMI / name).read_bytes() for name in (*_SOURCES[fmi], *_HEADERS[fmi])}
    token = _token(fmi, vehicle.name, variables, sources)
    sources[_VARIABLES] = c_table(variables, token).encode()
    if fmi == 3:
        sources["buildDescription.xml"] = build_description(_compiled(fmi))
    return {
        "modelDescription.xml": model_description(fmi, vehicle.name, variables, token, _compiled(fmi)),
        "documentation/index.html": page(vehicle.name, variables).encode(),
        f"{_LICENCES}license.txt": LICENCE.read_bytes(),
        f"{_LICENCES}fmi_headers.txt": (_FMI / "LICENSE.txt").read_bytes(),
        **{f"sources/{name}": data for name, data in sorted(sources.items())},
    }


def _token(fmi: Fmi, name: str, variables: Sequence[Variable], sources: Mapping[str, bytes]) -> str:
    """A token that changes with each change of variables or sources."""
    digest = hashlib.sha256(f"{fmi} {name} {_core.version()} {variables!r}".encode())
    for file in sorted(sources):
        digest.update(file.encode() + b"\0" + sources[file])
    return f"{{{uuid.UUID(bytes=digest.digest()[:16], version=4)}}}"


def _compiled(fmi: Fmi) -> tuple[str, ...]:
    """The files to compile."""
    return (_CORE, _VARIABLES, *_SOURCES[fmi])


def _core_in_one(sources: Iterable[str]) -> str:
    """The pragmas have the effect of -ffp-contract=off in COMPILER_OPTIONS, for compilers other than gcc."""
    included = [f'#include "{name}"' for name in sorted(sources) if name.endswith(".c")]
    pragmas = ["#if defined(_MSC_VER)", "#pragma fp_contract(off)", "#elif defined(__clang__)"]
    pragmas += ["#pragma STDC FP_CONTRACT OFF", "#endif"]
    return "\n".join(["/* The core as one translation unit. */", *pragmas, *included, ""])
