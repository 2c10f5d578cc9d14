"""A drive on a network that is not J1939, with its DBC, and the mistakes of a DBC that describes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from healthy_drive import ANGLE, LATERAL, SPEED, STEERING_RATIO, WHEELBASE_M, WHEELS, YAW_RATE, Array

from oncenter.signals import DEGREE

START_S = 1_700_000_000
KM_H = 1.0 / 3.6
# Column: name in the DBC, bits, sign, factor and unit there, and the SI value of a bit.
FIELDS: Mapping[str, tuple[str, str, str, float]] = {
    ANGLE: ("Angle", "0|16@1- (0.1,0)", "deg", 0.1 * DEGREE),
    YAW_RATE: ("YawRate", "16|16@1- (0.01,0)", "deg/s", 0.01 * DEGREE),
    SPEED: ("Speed", "32|16@1+ (0.01,0)", "km/h", 0.01 * KM_H),
    LATERAL: ("Lateral", "48|16@1- (0.001,0)", "m/s^2", 0.001),
}
CHASSIS, WHEEL = 0x123, 0x124
_WHEEL_FIELDS = [(f"Wheel{place}", f"{16 * place}|16@1+ (0.01,0)") for place in range(4)]


def dbc(bits: Mapping[str, str] | None = None, ranges: Mapping[str, str] | None = None) -> str:
    """The database; `bits` replaces a column's bits, sign and factor, `ranges` its range."""
    lines = ['VERSION ""', "BU_: Vector__XXX", f"BO_ {CHASSIS} CHASSIS: 8 Vector__XXX"]
    for column, (name, usual, unit, _) in FIELDS.items():
        layout, span = (bits or {}).get(column, usual), (ranges or {}).get(column, "0|0")
        lines.append(f' SG_ {name} : {layout} [{span}] "{unit}" Vector__XXX')
    lines.append(f"BO_ {WHEEL} WHEELS: 8 Vector__XXX")
    lines += [f' SG_ {name} : {layout} [0|0] "km/h" Vector__XXX' for name, layout in _WHEEL_FIELDS]
    return "\n".join(lines) + "\n"


def truck_file(folder: Path, database: str, *, has_wheels: bool) -> Path:
    """The vehicle file with its database beside it."""
    (folder / "network.dbc").write_text(database, encoding="utf-8")
    names = {column.rpartition("_rad")[0] or column: f"CHASSIS.{field[0]}" for column, field in FIELDS.items()}
    signals = {_signal(column): name for column, name in names.items()}
    if has_wheels:
        signals |= {_signal(column): f"WHEELS.Wheel{place}" for place, column in enumerate(WHEELS)}
    entries = "\n".join(f'{signal} = {{ name = "{name}" }}' for signal, name in signals.items())
    file = folder / "truck.toml"
    file.write_text(
        f'name = "own"\nwheelbase_m = {WHEELBASE_M}\nsteering_ratio = {STEERING_RATIO}\n'
        'track_width_front_m = 2.05\ntrack_width_rear_m = 1.83\naxle_layout = "4x2"\n'
        f'dbc = "network.dbc"\n[signals]\n{entries}\n',
        encoding="utf-8",
    )
    return file


def _signal(column: str) -> str:
    return column.removesuffix("_rad_s").removesuffix("_rad").removesuffix("_m_s2").removesuffix("_m_s")


def candump(columns: Mapping[str, Array], log: Path) -> Path:
    """CHASSIS at the rate of the columns, and WHEELS at half of it where the columns have wheel speeds."""
    time = columns["time_s"]
    lines = _lines(time, CHASSIS, _payloads([columns[name] for name in FIELDS], [f[3] for f in FIELDS.values()]))
    if WHEELS[0] in columns:
        wheels = _payloads([columns[name][::2] for name in WHEELS], [0.01 * KM_H] * 4)
        lines += _lines(time[::2] + 0.0005, WHEEL, wheels)
    lines.sort()
    log.write_text("".join(lines), encoding="ascii")
    return log


def _payloads(values: Sequence[Array], bit: Sequence[float]) -> list[str]:
    raw = [np.round(one / size).astype("<i4").astype("<i2") for one, size in zip(values, bit, strict=True)]
    octets: npt.NDArray[np.uint8] = np.stack(raw, axis=1).view(np.uint8)
    text = octets.tobytes().hex().upper()
    return [text[begin : begin + 16] for begin in range(0, len(text), 16)]


def _lines(time: Array, identifier: int, payloads: Sequence[str]) -> list[str]:
    stamps = zip((START_S + time).tolist(), payloads, strict=True)
    return [f"({stamp:.6f}) can0 {identifier:03X}#{payload}\n" for stamp, payload in stamps]
