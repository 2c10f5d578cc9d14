"""Writes the tables of docs/simulink_carmaker.md from the FMU's model description: run it after a change of the FMU.

Usage: .venv/bin/python docs/make_fmu_table.py
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

import oncenter as oc
from oncenter.export.model_description import model_description
from oncenter.export.variables import variables_of

PAGE = Path(__file__).with_name("simulink_carmaker.md")
BEGIN, END = "<!-- variables: written by docs/make_fmu_table.py -->", "<!-- variables: end -->"
BESIDE = ("_sd", "_status", "_since", "_confidence", "_available")  # shown in the row of their variable
GROUPED = ("reason.", "rejected_time.", "vehicle.steering_ratio_term[", "params.")  # a row each
LEFT, FORWARD = "left", "forward"
POSITIVE = {  # what the sign means, of all that has one
    "steering_wheel_angle": LEFT,
    "yaw_rate": LEFT,
    "vehicle_speed": FORWARD,
    "lateral_acceleration": LEFT,
    "wheel_speed_front_left": FORWARD,
    "wheel_speed_front_right": FORWARD,
    "wheel_speed_rear_left": FORWARD,
    "wheel_speed_rear_right": FORWARD,
    "lateral_speed": LEFT,
    "steering_wheel_torque": LEFT,
    "rear_axle_angle": LEFT,
    "motion.curvature": LEFT,
    "motion.longitudinal_acceleration": FORWARD,
    "motion.bank": "road falls to the right",
    "motion.residual": LEFT,
    "play_place": "flank of left turns",
    "angle": LEFT,
    "angle_rate": LEFT,
    "angle_estimate": LEFT,
    "offset": "sensor reads too far left",
    "understeer_gradient": "understeer",
    "unloading_acceleration": LEFT,
    "yaw_rate_bias": "sensor reads too far left",
    "wheel_radius_mismatch_front": "left wheel larger",
    "wheel_radius_mismatch_rear": "left wheel larger",
}


def described() -> list[ET.Element]:
    """The variables of an FMI 2.0 model description, in its order."""
    truck = oc.vehicle("scania_r730_4x2")
    root = ET.fromstring(model_description(2, truck.name, variables_of(truck), "{}", ()))
    return list(root.iter("ScalarVariable"))


def tables(variables: Iterable[ET.Element]) -> Iterator[str]:
    by_name = {variable.attrib["name"]: variable for variable in variables}
    for title, causality in (("Inputs", "input"), ("Outputs", "output"), ("Parameters", "parameter")):
        yield f"**{title}**\n"
        yield "| name | unit | positive | what |\n|---|---|---|---|"
        names = [name for name, variable in by_name.items() if variable.attrib["causality"] == causality]
        yield from (_row(name, by_name) for name in names if not _is_shown_elsewhere(name, names))
        yield ""


def _is_shown_elsewhere(name: str, names: list[str]) -> bool:
    """Whether it stands in the row of another: as its standard deviation, say, or as one of many alike."""
    group = next((prefix for prefix in GROUPED if name.startswith(prefix)), None)
    if group is not None:
        return name != next(other for other in names if other.startswith(group))
    return any(name.endswith(ending) and name.removesuffix(ending) in names for ending in BESIDE)


def _row(name: str, by_name: dict[str, ET.Element]) -> str:
    variable = by_name[name]
    group = next((prefix for prefix in GROUPED if name.startswith(prefix)), None)
    if group is not None:
        return _row_of_group(group, [other for other in by_name if other.startswith(group)], variable)
    beside = [f"`{ending}`" for ending in BESIDE if name + ending in by_name]
    shown = f"`{name}`" + (f" ({', '.join(beside)})" if beside else "")
    return f"| {shown} | {_unit(variable)} | {POSITIVE.get(name, '')} | {variable.attrib['description']} |"


def _row_of_group(group: str, names: list[str], first: ET.Element) -> str:
    if group == "params.":
        return f"| `params.*`, {len(names)} of them | | | as in [Parameters](params.md), with range and unit |"
    if group.endswith("["):
        about = "Front wheel angle in rad per power of the steering wheel angle in rad, from 0 on"
        return f"| `{group}1]` to `[{len(names)}]` | | | {about} |"
    about = first.attrib["description"].split(" missing signal")[0].rstrip(":")
    members = ", ".join(f"`{name.removeprefix(group)}`" for name in names)
    return f"| `{group}*` | {_unit(first)} | | {about}: {members} |"


def _unit(variable: ET.Element) -> str:
    """The unit of a real variable, the type of any other."""
    (kind,) = variable
    if kind.tag == "Real":
        return "" if kind.attrib["unit"] == "1" else kind.attrib["unit"]
    return kind.attrib.get("declaredType", kind.tag.lower())


def made() -> dict[Path, str]:
    """The text of the page."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    return {PAGE: f"{before}{BEGIN}\n\n" + "\n".join(tables(described())) + f"\n{END}{after}"}


if __name__ == "__main__":
    for path, text in made().items():
        path.write_text(text, encoding="utf-8", newline="\n")
