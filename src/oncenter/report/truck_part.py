"""The truck and the drive: vehicle, VIN, date, distance, logs, and who made the page."""

from __future__ import annotations

from datetime import datetime
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

import numpy as np

from oncenter.report.document import LINE, SIGNATURES, duration, table, unbroken
from oncenter.report.origin import Origin

if TYPE_CHECKING:
    from oncenter.offset.answer import Answer
    from oncenter.signals import Signals
    from oncenter.vehicle import Vehicle

PLATE = "Plate, if other"  # than the name of the truck
_BY_HAND = ("VIN", PLATE, "Mileage", "Start")
_SPEED = "vehicle_speed_m_s"


def of_truck(vehicle: Vehicle) -> dict[str, str]:
    """The truck as its file has it, as far as it is given, and the signals whose sign is reversed there."""
    given = {
        "wheelbase_m": ("Wheelbase", f"{vehicle.wheelbase_m:g} m"),
        "steering_ratio": ("Steering ratio near the centre", f"{vehicle.ratio_near_centre:.4g}"),
    }
    rows = {title: "not given" if key in vehicle.assumed else value for key, (title, value) in given.items()}
    rows["Axles"] = vehicle.axle_layout or "not given"
    rows |= {"Steered rear axle": vehicle.rear_axle_steers} if vehicle.rear_axle_steers else {}
    rows |= {"Driven on": _driven_on(vehicle)} if vehicle.traffic_side else {}
    reversed_ = [signal.replace("_", " ") for signal, entry in vehicle.signals.items() if entry.sign == -1]
    return rows | ({"Corrected the reversed sign of": ", ".join(reversed_)} if reversed_ else {})


def _driven_on(vehicle: Vehicle) -> str:
    by = vehicle.traffic_side_by
    return f"the {vehicle.traffic_side}" + ("" if by == "vehicle file" else f" (by {by})")


def _in_words(vehicle: Vehicle) -> str:
    parts = [f"{title[:1].lower()}{title[1:]} {value}" for title, value in of_truck(vehicle).items()]
    return ", ".join([*parts, f"limit {vehicle.offset_limit_deg:g} deg"])


def truck_section(answer: Answer, origin: Origin) -> str:
    """One table; a row without a value is left out, or in print a line to write on."""
    vehicle = answer.vehicle
    rows = {
        "Vehicle": escape(vehicle.name),
        "Truck data": escape(_in_words(vehicle)),
        "VIN": escape(origin.vin or ""),
        "Vehicle file": escape(unquote(Path(vehicle.origin).name)),  # of the page, a name that may be quoted
        "Start": "" if origin.start is None else _time(origin.start),
        "Driven": unbroken(f"{_distance_km(answer.drives):.1f} km in {duration(answer.duration_s)}"),
        "Logs" if len(answer.drives) > 1 else "Log": "<br>".join(escape(Path(d.log).name) for d in answer.drives),
        "Report": _made(answer, origin),
    }
    return f"""<section class="truck">
<h2>Truck and drive</h2>
{table({name: value for name, value in rows.items() if value})}
<div class="print-only">
{table({name: LINE for name in _BY_HAND if not rows.get(name)})}
{SIGNATURES}
</div>
</section>"""


def _made(answer: Answer, origin: Origin) -> str:
    by = f" by {escape(origin.user)}" if origin.user else ""
    when = "" if origin.written is None else f", {_time(origin.written)}"
    return f"oncenter {escape(answer.version)}{by}{when}"


def _time(at: datetime) -> str:
    return f"<time>{at:%Y-%m-%d %H:%M} UTC</time>"


def _distance_km(drives: tuple[Signals, ...]) -> float:
    return sum(_distance_m(drive) for drive in drives) / 1000.0


def _distance_m(drive: Signals) -> float:
    """The distance without the time in which no speed is available."""
    if _SPEED not in drive.columns:
        return 0.0
    speed = drive.columns[_SPEED]
    return float(np.abs(speed[np.isfinite(speed)]).sum()) / drive.rate_hz
