"""The model description of the FMU, in FMI 2.0 and in FMI 3.0, from one table of variables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal
from xml.etree import ElementTree as ET

from oncenter import _core
from oncenter.export.variables import DISPLAY_UNITS, ENUMERATIONS, RADIANS_TO_DEGREES, UNITS, Variable

Fmi = Literal[2, 3]

MODEL_IDENTIFIER = "oncenter"
COMPILER_OPTIONS = ("-std=c99", "-O2", "-ffp-contract=off")  # as the package's own core: the same bits
_ANSWERS = ("output", "answer")
_FMI2_TYPES = {"real": "Real", "integer": "Integer", "boolean": "Boolean", "enumeration": "Enumeration"}
_FMI3_TYPES = {"real": "Float64", "integer": "Int32", "boolean": "Boolean", "enumeration": "Enumeration"}


def model_description(
    fmi: Fmi, vehicle_name: str, variables: Sequence[Variable], token: str, sources: Sequence[str]
) -> bytes:
    """modelDescription.xml; `sources` are the files to compile, which `build_description` lists for FMI 3.0."""
    given = {
        "fmiVersion": "2.0" if fmi == 2 else "3.0",
        "modelName": "oncenter",
        "guid" if fmi == 2 else "instantiationToken": token,
        "description": f"Steering wheel angle sensor offset of {vehicle_name}, estimated while driving",
        "author": "the oncenter developers",
        "version": _core.version(),
        "copyright": "Copyright (c) 2026 the oncenter developers",
        "license": "MIT",
        "generationTool": f"oncenter {_core.version()}",
        "variableNamingConvention": "structured",
    }
    root = ET.Element("fmiModelDescription", given)
    _co_simulation(root, fmi, sources)
    _units(root)
    _types(root, fmi)
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", name="logStatusError", description="The reason why a call was rejected")
    ET.SubElement(root, "DefaultExperiment", startTime="0", stepSize="0.01")
    described = ET.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        (_fmi2_variable if fmi == 2 else _fmi3_variable)(described, reference, variable)
    _structure(root, fmi, variables)
    return _as_bytes(root)


def build_description(sources: Sequence[str]) -> bytes:
    """sources/buildDescription.xml of FMI 3.0."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=MODEL_IDENTIFIER)
    options = " ".join(COMPILER_OPTIONS)
    files = ET.SubElement(build, "SourceFileSet", language="C99", compiler="gcc", compilerOptions=options)
    for name in sources:
        ET.SubElement(files, "SourceFile", name=name)
    return _as_bytes(root)


def _as_bytes(root: ET.Element) -> bytes:
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def _co_simulation(root: ET.Element, fmi: Fmi, sources: Sequence[str]) -> None:
    able = {"modelIdentifier": MODEL_IDENTIFIER, "canHandleVariableCommunicationStepSize": "true"}
    if fmi == 3:
        able |= {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
        ET.SubElement(root, "CoSimulation", able)
        return
    able |= {"canNotUseMemoryManagementFunctions": "true"}
    able |= {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
    files = ET.SubElement(ET.SubElement(root, "CoSimulation", able), "SourceFiles")
    for name in sources:
        ET.SubElement(files, "File", name=name)


def _units(root: ET.Element) -> None:
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name, powers in UNITS.items():
        unit = ET.SubElement(definitions, "Unit", name=name)
        ET.SubElement(unit, "BaseUnit", {base: str(power) for base, power in powers.items()})
        if name in DISPLAY_UNITS:
            ET.SubElement(unit, "DisplayUnit", name=DISPLAY_UNITS[name], factor=repr(RADIANS_TO_DEGREES))


def _types(root: ET.Element, fmi: Fmi) -> None:
    definitions = ET.SubElement(root, "TypeDefinitions")
    for name, values in ENUMERATIONS.items():
        if fmi == 2:
            kind = ET.SubElement(ET.SubElement(definitions, "SimpleType", name=name), "Enumeration")
        else:
            kind = ET.SubElement(definitions, "EnumerationType", name=name)
        for item, value in values.items():
            ET.SubElement(kind, "Item", name=item, value=str(value))


def _fmi2_variable(described: ET.Element, reference: int, variable: Variable) -> None:
    scalar = ET.SubElement(described, "ScalarVariable", _named(reference, variable))
    ET.SubElement(scalar, _FMI2_TYPES[variable.type], _typed(variable))


def _fmi3_variable(described: ET.Element, reference: int, variable: Variable) -> None:
    ET.SubElement(described, _FMI3_TYPES[variable.type], _named(reference, variable) | _typed(variable))


def _named(reference: int, variable: Variable) -> dict[str, str]:
    given = {"name": variable.name, "valueReference": str(reference), "description": variable.about}
    given["causality"] = "output" if variable.role in _ANSWERS else variable.role
    if variable.role == "parameter":
        return given | {"variability": "fixed", "initial": "exact"}
    if variable.role in _ANSWERS:
        return given | {"variability": "discrete", "initial": "calculated"}
    return given | {"variability": "continuous" if variable.type == "real" else "discrete"}


def _typed(variable: Variable) -> dict[str, str]:
    given = {"declaredType": variable.enumeration} if variable.enumeration else {}
    if variable.type == "real":
        given["unit"] = variable.unit
        if variable.unit in DISPLAY_UNITS:
            given["displayUnit"] = DISPLAY_UNITS[variable.unit]
    for name, bound in (("min", variable.low), ("max", variable.high), ("start", variable.start)):
        if bound is not None:
            given[name] = _literal(variable, bound)
    return given


def _literal(variable: Variable, value: float) -> str:
    if variable.type == "boolean":
        return "true" if value else "false"
    return repr(float(value)) if variable.type == "real" else str(int(value))


def _structure(root: ET.Element, fmi: Fmi, variables: Sequence[Variable]) -> None:
    """Lists no dependencies: every output depends on all earlier inputs."""
    structure = ET.SubElement(root, "ModelStructure")
    outputs = [reference for reference, variable in enumerate(variables) if variable.role in _ANSWERS]
    if fmi == 3:
        for element in ("Output", "InitialUnknown"):
            for reference in outputs:
                ET.SubElement(structure, element, valueReference=str(reference))
        return
    for element in ("Outputs", "InitialUnknowns"):
        unknowns = ET.SubElement(structure, element)
        for reference in outputs:
            ET.SubElement(unknowns, "Unknown", index=str(reference + 1))
