"""An ASAP2 description of the core in an ECU, for calibration and measurement tools: the variables of c/oncenter_ecu.h.

Addresses are by symbol: 0 until a tool takes them from the ELF file. Angles are shown in degrees.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from oncenter import _core
from oncenter.export.variables import (
    DISPLAY_UNITS,
    ENUMERATIONS,
    OFFSET_PARTS,
    RADIANS_TO_DEGREES,
    UNITS,
    Variable,
)

_ANY = 1e30  # no limit: measurements have none
_YES_NO = {"no": 0, "yes": 1}

# Variables of the FMU's table with another name in an ECU, which has no mirror of enums.
_OTHER_MEMBERS = {
    "method": "params.method",
    "angle_method": "params.angle_method",
    "angle_status": "output.angle.status",
    "fault": "output.fault",
    "signal_fault": "output.signal_fault",
    "signals_at_fault": "output.signals_at_fault",
    **{f"offset_parts[{k}]": f"answer.offset_parts.{member}" for k, (_, member, _, _) in enumerate(OFFSET_PARTS)},
}
_STRUCTS = ("vehicle", "params", "tick", "output", "answer")

# Parts of the answer that each tick gives, because an ECU cannot compute the whole answer at every tick.
_EACH_TICK = (
    Variable("time", "tick.time", "input", "Time of the tick, s", unit="s"),
    Variable("valid", "tick.valid", "input", "Bits of oc_signal_bit: signals with a number at this tick", "integer"),
    Variable("offset", "output.offset", "output", "Offset from final evidence", unit="rad"),
    Variable("offset_sd", "output.offset_sd", "output", "Standard deviation of offset", unit="rad"),
    *(
        Variable(name, f"output.offset_parts.{member}", "output", about, unit=unit)
        for name, member, unit, about in OFFSET_PARTS
    ),
    Variable("status", "output.offset_status", "output", "Status of offset", "enumeration", enumeration="Status"),
    Variable(
        "understeer_gradient",
        "output.understeer_gradient",
        "output",
        "Understeer gradient over g, 0 until it is identified",
        unit="rad/(m/s2)",
    ),
    Variable("backlash", "output.backlash", "output", "Free play, full width, 0 until it is identified", unit="rad"),
    Variable("yaw_rate_bias", "output.yaw_rate_bias", "output", "Bias of the yaw rate", unit="rad/s"),
    Variable("yaw_rate_bias_sd", "output.yaw_rate_bias_sd", "output", "Its standard deviation", unit="rad/s"),
)


def a2l(variables: Sequence[Variable]) -> str:
    """The description of the FMU's variables that an ECU has too, and of those that only an ECU has."""
    items = [item for variable in (*variables, *_EACH_TICK) for item in _items(variable)]
    blocks = "\n".join(text for _, _, text in items)
    groups = "\n".join(
        _group(name, about, kind, [symbol for k, symbol, _ in items if k == kind])
        for name, about, kind in (
            ("Parameters", "Tuning parameters and vehicle data", "CHARACTERISTIC"),
            ("Measurements", "The last tick, its outputs, and the answer of all ticks", "MEASUREMENT"),
        )
    )
    return f"""ASAP2_VERSION 1 61
/* Written by oncenter {_core.version()}. Addresses are to be filled in from the ELF file by SYMBOL_LINK. */
/begin PROJECT oncenter "Steering wheel angle sensor offset"
/begin MODULE oncenter "The core {_core.version()} as ecu/oncenter_ecu.c holds it"
/begin MOD_PAR "oncenter"
  VERSION "{_core.version()}"
/end MOD_PAR
/begin MOD_COMMON "Little-endian, 32-bit enums"
  BYTE_ORDER MSB_LAST
  ALIGNMENT_BYTE 1
  ALIGNMENT_WORD 2
  ALIGNMENT_LONG 4
  ALIGNMENT_INT64 8
  ALIGNMENT_FLOAT32_IEEE 4
  ALIGNMENT_FLOAT64_IEEE 8
/end MOD_COMMON
{_record_layouts()}
{_conversions()}
{blocks}
{groups}
/end MODULE
/end PROJECT
"""


def _items(variable: Variable) -> Iterator[tuple[str, str, str]]:
    """Kind, name and block; nothing for a variable that an ECU does not have."""
    reason = re.fullmatch(r"reasons\[(\d+)\]", variable.member)
    member = _OTHER_MEMBERS.get(variable.member, variable.member)
    if reason is not None:
        name = f"oncenter_output.{variable.name}"
        yield "MEASUREMENT", name, _reason(name, variable.about, 1 << int(reason[1]))
    elif member.split(".")[0] in _STRUCTS:
        name = f"oncenter_{member}"
        kind = "CHARACTERISTIC" if variable.role == "parameter" else "MEASUREMENT"
        yield kind, name, (_characteristic if variable.role == "parameter" else _measurement)(name, variable)


def _characteristic(name: str, variable: Variable) -> str:
    low, high = _limits(variable)
    layout = f"RL_{_data_type(variable)}"
    return _block(
        "CHARACTERISTIC",
        name,
        f"{_quoted(variable.about)} VALUE 0x0 {layout} 0 {_conversion(variable)} {low!r} {high!r}",
        name,
    )


def _measurement(name: str, variable: Variable) -> str:
    low, high = _limits(variable)
    given = f"{_quoted(variable.about)} {_data_type(variable)} {_conversion(variable)} 0 0 {low!r} {high!r}"
    return _block("MEASUREMENT", name, f"{given}\n  ECU_ADDRESS 0x0", name)


def _reason(name: str, about: str, mask: int) -> str:
    given = f"{_quoted(about)} ULONG CM_yes_no 0 0 0 1\n  BIT_MASK {mask:#x}\n  ECU_ADDRESS 0x0"
    return _block("MEASUREMENT", name, given, "oncenter_output.reasons")


def _block(kind: str, name: str, given: str, symbol: str) -> str:
    return f'/begin {kind} {name} {given}\n  SYMBOL_LINK "{symbol}" 0\n/end {kind}'


def _group(name: str, about: str, kind: str, members: Sequence[str]) -> str:
    reference = f"REF_{kind}"
    listed = "\n".join(f"  {member}" for member in members)
    return f"/begin GROUP {name} {_quoted(about)}\nROOT\n/begin {reference}\n{listed}\n/end {reference}\n/end GROUP"


def _data_type(variable: Variable) -> str:
    if variable.type == "real":
        return "FLOAT32_IEEE" if "offset_parts" in variable.member else "FLOAT64_IEEE"
    return "ULONG" if variable.type == "enumeration" or variable.member == "tick.valid" else "SLONG"


def _limits(variable: Variable) -> tuple[float, float]:
    """Physical limits, in the displayed unit."""
    if variable.enumeration:
        values = ENUMERATIONS[variable.enumeration].values()
        return min(values), max(values)
    if variable.type == "boolean":
        return 0, 1
    if variable.type == "integer":
        return variable.low or 0, 2**31 - 1 if variable.high is None else variable.high
    factor = RADIANS_TO_DEGREES if variable.unit in DISPLAY_UNITS else 1.0
    return (
        -_ANY if variable.low is None else variable.low * factor,
        _ANY if variable.high is None else variable.high * factor,
    )


def _conversion(variable: Variable) -> str:
    if variable.type == "real":
        return _conversion_name(variable.unit)
    if variable.type == "boolean":
        return "CM_yes_no"
    return f"CM_{variable.enumeration}" if variable.enumeration else "CM_count"


def _conversion_name(unit: str) -> str:
    return "CM_" + re.sub(r"\W+", "_", DISPLAY_UNITS.get(unit, unit)).strip("_")


def _conversions() -> str:
    blocks = []
    for unit in UNITS:
        shown = DISPLAY_UNITS.get(unit)
        head = f'/begin COMPU_METHOD {_conversion_name(unit)} "{shown or unit}"'
        if shown is None:
            blocks.append(f'{head} IDENTICAL "%14.8" "{unit}"\n/end COMPU_METHOD')
        else:
            coefficients = f"  COEFFS_LINEAR {RADIANS_TO_DEGREES!r} 0"
            blocks.append(f'{head} LINEAR "%14.8" "{shown}"\n{coefficients}\n/end COMPU_METHOD')
    blocks.append('/begin COMPU_METHOD CM_count "a number" IDENTICAL "%10.0" ""\n/end COMPU_METHOD')
    tables = {**ENUMERATIONS, "yes_no": _YES_NO}
    del tables["TrafficSide"]  # a double in the core
    for name, values in tables.items():
        rows = "\n".join(f'  {value} "{word}"' for word, value in values.items())
        blocks.append(
            f'/begin COMPU_METHOD CM_{name} "{name}" TAB_VERB "%4.0" ""\n  COMPU_TAB_REF VT_{name}\n/end COMPU_METHOD\n'
            f'/begin COMPU_VTAB VT_{name} "{name}" TAB_VERB {len(values)}\n{rows}\n/end COMPU_VTAB'
        )
    return "\n".join(blocks)


def _record_layouts() -> str:
    return "\n".join(
        f"/begin RECORD_LAYOUT RL_{kind}\n  FNC_VALUES 1 {kind} COLUMN_DIR DIRECT\n/end RECORD_LAYOUT"
        for kind in ("FLOAT64_IEEE", "SLONG", "ULONG")
    )


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
