"""The truck of an exported ECU program as C: the values of the vehicle file that the core uses."""

from __future__ import annotations

from collections.abc import Iterator

from oncenter import _core
from oncenter.files.file_name import printable
from oncenter.signals import DEGREE
from oncenter.vehicle import Vehicle, core_params
from oncenter.vehicle_keys import OFFSET_LIMIT_DEG


def vehicle_source(vehicle: Vehicle | None) -> str:
    """oncenter_vehicle.c; without a vehicle its function changes nothing."""
    limit_deg = vehicle.offset_limit_deg if vehicle else OFFSET_LIMIT_DEG
    about = _in_comment(vehicle.name) if vehicle else "no truck"
    body = [f"    {line}" for line in _assignments(vehicle)] if vehicle else ["    (void)vehicle, (void)params;"]
    return "\n".join(
        [
            f"/* Written by oncenter {_core.version()}: {about}. */",
            "",
            '#include "oncenter_vehicle.h"',
            "",
            '#include "oncenter_ecu.h"',
            "",
            f"const double oncenter_offset_limit = {limit_deg * DEGREE!r}; /* {limit_deg:g} deg */",
            "",
            "void oncenter_vehicle_set(oc_vehicle *vehicle, oc_params *params) {",
            *body,
            "}",
            "",
        ]
    )


def _assignments(vehicle: Vehicle) -> Iterator[str]:
    ratio = vehicle.steering_ratio if isinstance(vehicle.steering_ratio, tuple) else ()
    members = {
        "wheelbase": vehicle.wheelbase_m,
        "steering_ratio": vehicle.ratio_near_centre,
        "traffic_side": vehicle.traffic_sign,
        "track_width_front": vehicle.track_width_front_m or 0.0,
        "track_width_rear": vehicle.track_width_rear_m or 0.0,
        "ratio.ratio": vehicle.ratio_near_centre,
        **{f"ratio.coefficients[{k}]": term for k, term in enumerate(ratio)},
    }
    yield from (f"vehicle->{name} = {float(value)!r};" for name, value in members.items())
    yield f"vehicle->ratio.terms = {len(ratio)};"
    defaults = _core.default_params()
    changed = {name: value for name, value in core_params(vehicle.params).items() if value != defaults[name]}
    yield from (f"params->{name} = {_number(name, value)};" for name, value in changed.items())
    if not changed:
        yield "(void)params; /* all are defaults */"


def _number(name: str, value: float) -> str:
    return str(int(value)) if name == "use_accelerometer" else repr(float(value))


def _in_comment(name: str) -> str:
    """A name that cannot end the comment in which it stands: a space forms no new mark, as a cut could."""
    return printable(name).replace("*/", "* /").replace("/*", "/ *")
