"""documentation/index.html of an FMU: inputs, outputs, parameters."""

from __future__ import annotations

import html
from collections.abc import Sequence

from oncenter import _core
from oncenter.export.variables import ENUMERATIONS, Variable

_SECTIONS = (
    ("Inputs", ("input",)),
    ("Outputs of all ticks so far", ("answer",)),
    ("Outputs of the last tick", ("independent", "output")),
    ("Parameters", ("parameter",)),
)


def page(vehicle_name: str, variables: Sequence[Variable]) -> str:
    """One page without assets; on narrow screens each row is a block."""
    title = f"oncenter {_core.version()}: {html.escape(vehicle_name)}"
    sections = "\n".join(
        f"<h2>{heading}</h2>\n<table>\n{_rows([v for v in variables if v.role in roles])}\n</table>"
        for heading, roles in _SECTIONS
    )
    enumerations = "\n".join(
        f"<tr><th>{name}</th><td></td><td>{', '.join(f'{value} {word}' for word, value in values.items())}</td></tr>"
        for name, values in ENUMERATIONS.items()
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark }}
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem }}
h1 {{ font-size: 1.6rem }}
h2 {{ font-size: 1.2rem; margin-top: 2rem }}
td, th {{ text-align: left; vertical-align: top; padding: .15rem 1.2rem .15rem 0; font-weight: normal }}
th {{ font-family: ui-monospace, monospace; font-size: .9rem; line-height: 1.7 }}
td:nth-child(2) {{ white-space: nowrap; opacity: .75 }}
@media (max-width: 50rem) {{
  tr, th, td {{ display: block; padding: 0; overflow-wrap: anywhere }}
  tr {{ padding: .4rem 0 }}
  td:empty {{ display: none }}
}}
</style>
</head>
<body>
<h1>{title}</h1>
<p>Estimates the straight-ahead offset of a truck's steering wheel angle sensor while it drives. ISO 8855: left turns
are positive for angle, yaw rate and lateral acceleration; the accelerometer reports specific force.</p>
<p>Each communication step runs its ticks at <code>rate_hz</code>. With steps of one tick, the FMU gives the numbers of
<code>oncenter offset</code> for the same log. If a signal is not measured at a tick, set its <code>_available</code>
input to false, or the signal to NaN. Parameters apply from the end of initialization on. Ignore a value while its
status is unobservable.</p>
{sections}
<p>A parameter's description ends with its default, in the usual unit, and its source. Sections, tables and equations
are those of P. Fejes, Estimation of Steering Wheel Angle in Heavy-Duty Trucks (2016).</p>
<h2>Enumerations</h2>
<table>
{enumerations}
</table>
</body>
</html>
"""


def _rows(variables: Sequence[Variable]) -> str:
    return "\n".join(f"<tr><th>{v.name}</th><td>{_kind(v)}</td><td>{html.escape(v.about)}</td></tr>" for v in variables)


def _kind(variable: Variable) -> str:
    """The unit; the type of a variable without unit."""
    if variable.type != "real":
        return variable.enumeration or variable.type
    return "" if variable.unit == "1" else variable.unit
