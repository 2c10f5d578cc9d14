"""A vehicle file in words: the values it has, unusual ones, values that would help, and its signals in a log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from oncenter.signals import Signals
from oncenter.vehicle import Vehicle
from oncenter.vehicle_keys import KEYS

_HELPFUL = (
    "wheelbase_m",
    "steering_ratio",
    "axle_layout",
    "track_width_front_m",
    "track_width_rear_m",
    "traffic_side",
    "pull_m_s2",
    "accelerometer_bias_m_s2",
    "play_deg",
)
NEEDED = ("steering_wheel_angle", "yaw_rate", "vehicle_speed", "lateral_acceleration")  # of the joint method
_SHOWN = ("wheelbase_m", "steering_ratio", "axle_layout")  # in the first line


@dataclass(frozen=True)
class Checked:
    """`lines` are for people; `is_complete` is False where the log lacks a signal that the file names or the joint
    method needs."""

    lines: tuple[str, ...]
    is_complete: bool


def checked(truck: Vehicle, drive: Signals | None) -> Checked:
    """A vehicle in words, with a drive also which of its signals the drive has."""
    lines = [f"{truck.name}: {', '.join(_first_words(truck)) or 'wheelbase and steering ratio not given'}"]
    lines += [f"  {name} = {value}" for name, value in _given(truck)]
    lines += [f"  unusual: {text}" for text in unusual(truck)]
    missing = [name for name in _HELPFUL if name in truck.assumed or getattr(truck, name) is None]
    if missing:
        lines += ["Not given, and would help:"]
        lines += [f"  {name:24}without it: {KEYS[name].without}" for name in missing]
    lost: list[str] = []
    if drive is not None:
        of_log = list(_in_log(truck, drive))
        lines += [f"Signals in {Path(drive.log).name}:", *(f"  {text}" for _, text in of_log)]
        lost = [name for name, _ in of_log if name not in drive.sources]
    return Checked(tuple(lines), not lost)


def _first_words(truck: Vehicle) -> Iterator[str]:
    if truck.axle_layout is not None:
        yield truck.axle_layout
    if "wheelbase_m" not in truck.assumed:
        yield f"wheelbase {truck.wheelbase_m:g} m"
    if "steering_ratio" in truck.assumed:
        return
    kind = "polynomial, " if isinstance(truck.steering_ratio, tuple) else ""
    yield f"steering ratio {kind}{truck.ratio_near_centre:.4g}"


def _given(truck: Vehicle) -> Iterator[tuple[str, str]]:
    for name in truck.model_fields_set - {"name", *_SHOWN, "params", "signals", "source", "sensors", "dbc", "priors"}:
        value = getattr(truck, name)
        unit = f" {KEYS[name].unit}" if KEYS[name].unit else ""
        yield name, f"{value:g}{unit}" if isinstance(value, float) else str(value)
    for path in truck.dbc:
        yield "dbc", str(path)
    if truck.learned is not None:
        yield "priors", f"learned {truck.learned.source}"
    for signal, entry in truck.signals.items():
        yield (
            f"signals.{signal}",
            f"{entry.name}{f' plus {entry.plus}' if entry.plus else ''}{f' in {entry.unit}' if entry.unit else ''}"
            + (f", sign by {entry.sign_by}" if entry.sign_by else "")
            + (", right is positive" if entry.sign == -1 else "")
            + (", the angle of the road wheels" if entry.road_wheel else "")
            + (f", true when {_listed(entry.true_when)}" if entry.true_when else ""),
        )


def _listed(values: Sequence[float | str]) -> str:
    return " or ".join(value if isinstance(value, str) else f"{value:g}" for value in values)


def unusual(truck: Vehicle) -> Iterator[str]:
    """Each value that trucks hardly have, with the usual ones."""
    for name, key in KEYS.items():
        value = truck.ratio_near_centre if name == "steering_ratio" else getattr(truck, name, None)
        if isinstance(value, float) and key.is_unusual(value):
            yield f"{name} is {key.about_unusual(value)}"


def _in_log(truck: Vehicle, drive: Signals) -> Iterator[tuple[str, str]]:
    """Each signal with its source in the log or a note about why there is none."""
    for name in dict.fromkeys((*NEEDED, *truck.signals)):
        if name == "time":
            continue
        source = drive.sources.get(name)
        if source is not None:
            yield name, f"{name}: {source.description}, {source.rate_hz:.0f} Hz"
            continue
        why = [note.partition(": ")[2] for note in drive.notes if note.partition(":")[0] == name]
        if name not in truck.signals and (truck.dbc or truck.signals):
            yield name, ": ".join([name, "not assigned", *why, "add it to [signals]"])
            continue
        if name in truck.signals and not why:
            why = [f"[signals] names {truck.signals[name].name}, which it lacks"]
        yield name, ": ".join([name, "not in the log", *(["; ".join(why)] if why else [])])
