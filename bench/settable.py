"""What sensitivity.py sets while the package runs: constants and params of the core, passes of the package."""

from __future__ import annotations

import ctypes
import importlib
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "build" / "sensitivity" / "src"))  # before the installed package

import liboncenter

ROOT = Path(__file__).parents[1]
WORK = ROOT / "build" / "sensitivity"
TERMS = list(tomllib.loads((ROOT / "core" / "terms.toml").read_text(encoding="utf-8")))
PARAMS = [
    name
    for section in tomllib.loads((ROOT / "core" / "params.toml").read_text(encoding="utf-8")).values()
    for name, row in section.items()
    if isinstance(row, dict)
]
KNOWN = 1e-3  # times its standard deviation: of a term without which the equations cannot be solved
# Steps of the answer beside the first run of the core, and what each gives where it does nothing.
PASSES: Mapping[str, Callable[..., Any]] = {
    "run.with_coarse_yaw_rate": lambda params, given, step: dict(params),
    "run.widened": lambda native, coarse, method, params: native,
    "run.without_contradicted_statuses": lambda drives: (drives, ()),
    "run.without_inverted_assistance": lambda native, logs, run: (logs, None),
    "run.without_contradicted": lambda native, params, vehicle, run: (params, ()),
    "run.fitted_vehicle": lambda first, drives, vehicle, params, run: None,
    "run.size_of_angle": lambda fitted, given: None,
    "run.lacks_axles": lambda vehicle, params: False,
    "run.with_fitting_bends": lambda answer, drives: answer,
    "run.without_faulty_estimates": lambda answer, contradicts: answer,
    "run.is_implausible": lambda native: False,
    "run.without_whole_turns": lambda drives: drives,
    "run.without_unfit_wheels": lambda drives, vehicle: (drives, ()),
    "vehicle_file._shown_m": lambda drives, vehicle: None,
    "signals_at_fault._leaves_nothing": lambda fault, answer: True,
    "stated.set_up_contradicted": lambda native, params, vehicle, without: None,
    "coarse_recording._noise_decides": lambda native, params: False,
}


_BLOCK = re.compile(r"/\* Tuned, in tuned\.toml.*?/\* end \*/", re.DOTALL)
_CONSTANT = re.compile(r"static const (\w+) (\w+)(\[.*?\])? =")
_PRIORS, _DEFAULTS = "oc_term_prior priors[OC_TERMS] =", "oc_params defaults ="


def build() -> dict[str, tuple[str, str]]:
    """Compiles the library with variables in place of the constants, beside a copy of the package that loads it.

    Returns: C type and size, "" for one number, by `file.name`.
    """
    found: dict[str, tuple[str, str]] = {}

    def of_block(stem: str) -> Callable[[re.Match[str]], str]:
        def variable(constant: re.Match[str]) -> str:
            kind, name, size = constant[1], constant[2], constant[3] or ""
            found[f"{stem}.{name}"] = (kind, size)
            return f"{kind} {name}{size} ="

        return lambda block: _CONSTANT.sub(variable, block[0])

    shutil.rmtree(WORK, ignore_errors=True)
    for folder in liboncenter.FOLDERS:
        (WORK / "c" / folder).mkdir(parents=True)
        for file in sorted((ROOT / folder).glob("*.[ch]")):
            text = _BLOCK.sub(of_block(file.stem), file.read_text(encoding="utf-8"))
            for constant in (_PRIORS, _DEFAULTS):
                text = text.replace(f"static const {constant}", constant)
            (WORK / "c" / folder / file.name).write_text(text, encoding="utf-8")
    shutil.copytree(ROOT / "src", WORK / "src", ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    for beside in ("core", "dbc", "docs", "scenarios", "vehicles"):
        (WORK / beside).symlink_to(ROOT / beside)
    core, *beside_core = liboncenter.write_sources(WORK / "c")
    include = [f"-I{WORK / 'c' / folder}" for folder in liboncenter.FOLDERS]
    arguments = [*liboncenter.COMPILE_ARGS, *liboncenter.FASTER_GCC, "-fPIC", "-shared", *include]
    library = str(WORK / "src" / "oncenter" / "liboncenter.so")
    subprocess.run(["gcc", *arguments, core, *beside_core, "-lm", "-o", library], cwd=WORK / "c", check=True)
    return found


class _Prior(ctypes.Structure):
    _fields_ = (("mean", ctypes.c_float), ("sd", ctypes.c_float))


class Settable:
    """Constants of the loaded library by `file.name`, `param.NAME` a default, `pass.MODULE.FUNCTION` one of PASSES, and
    `term.NAME` the standard deviation of a term's prior, which without it is known to be its mean."""

    def __init__(self, types: Mapping[str, tuple[str, str]], values: Mapping[str, Any]) -> None:
        library = ctypes.CDLL(str(WORK / "src" / "oncenter" / "liboncenter.so"))
        kinds = {"float": ctypes.c_float, "double": ctypes.c_double, "int32_t": ctypes.c_int32}
        self._of = {}
        for name, (kind, size) in types.items():
            file, constant = name.split(".")
            given = values[file][constant]["value"]
            count = len(given) if size else 1
            self._of[name] = (kinds[kind] * count).in_dll(library, constant)
        self._usual = {name: list(numbers) for name, numbers in self._of.items()}
        self._priors = (_Prior * len(TERMS)).in_dll(library, "priors")
        self._sds = [prior.sd for prior in self._priors]
        self._defaults = self._of_params(library)
        self._default_values = {name: number.value for name, number in self._defaults.items()}
        self._steps = {name: self._step(name) for name in PASSES}

    @staticmethod
    def _of_params(library: ctypes.CDLL) -> dict[str, ctypes.c_double]:
        from oncenter._declarations import ffi

        of_all = (ctypes.c_char * ffi.sizeof("oc_params")).in_dll(library, "defaults")
        return {name: ctypes.c_double.from_buffer(of_all, ffi.offsetof("oc_params", name)) for name in PARAMS}

    @staticmethod
    def _step(name: str) -> tuple[Any, str, Callable[..., Any]]:
        """Module, name within it, and the function."""
        module = importlib.import_module(f"oncenter.offset.{name.split('.')[0]}")
        function = name.split(".")[1]
        return module, function, getattr(module, function)

    def set(self, names: str, factor: float) -> None:
        for name in names.split("+"):
            self._set(name, factor)

    def _set(self, name: str, factor: float) -> None:
        if name.startswith("term."):
            k = TERMS.index(name.removeprefix("term."))
            self._priors[k].sd = self._sds[k] * max(factor, KNOWN)
            return
        if name.startswith("param."):
            name = name.removeprefix("param.")
            self._defaults[name].value = self._default_values[name] * factor
            return
        if name.startswith("pass."):
            module, function, usual = self._steps[name.removeprefix("pass.")]
            setattr(module, function, PASSES[name.removeprefix("pass.")] if factor == 0.0 else usual)
            return
        numbers = self._of[name]
        for k, value in enumerate(self._usual[name]):
            numbers[k] = type(numbers[k])(value * factor)
