"""A signal that is not what its name says, as the core finds it, before anything is said of the truck."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

from oncenter import _core
from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility.check_result import NO_OFFSET, SIGNALS_TABLE
from oncenter.read.whole_turns import without_whole_turns
from oncenter.signals import DEGREE, SIGNALS, STANDARD_GRAVITY, Signals
from oncenter.vehicle import Vehicle, core_of

_UNITS = {"rad": (DEGREE, "deg"), "rad_s": (DEGREE, "deg/s"), "m_s": (1.0 / 3.6, "km/h"), "m_s2": (1.0, "m/s^2")}
_BOTH = "Signal or sensor: check both, first"
_BITS = "the start bit, length, byte order and sign that the database gives it"
_WHOLE_TURN_DEG, _NEAR_DEG = 360.0, 20.0
_ANY = Vehicle(name="any", wheelbase_m=3.0, steering_ratio=20.0)  # between cars and heavy trucks
_FACTOR_MAX = 3.0  # of a signal whose scale alone is wrong; a larger one that is of no unit is another signal's
_WRONG_BITS_FROM = 100.0  # factor beyond all wrong units
_RELATIVE_NEAR = 1.35  # factor within which a size is that of a wrong unit: usual ratios are as uncertain
_USUAL_BY_UNDERSTEER = 1.35  # size of the angle's motion over that of the others, at low speed
_SLIPS: Mapping[str, tuple[tuple[float, str], ...]] = {
    "steering_wheel_angle": ((1.0 / DEGREE, "deg read as rad"), (DEGREE, "rad read as deg")),
    "yaw_rate": ((1.0 / DEGREE, "deg/s read as rad/s"), (DEGREE, "rad/s read as deg/s")),
    "vehicle_speed": ((3.6, "km/h read as m/s"), (1.0 / 3.6, "m/s read as km/h")),
    "lateral_acceleration": ((STANDARD_GRAVITY, "m/s^2 read as g"), (1.0 / STANDARD_GRAVITY, "g read as m/s^2")),
}


class SignalFault(NamedTuple):
    """`kind`: one of the core's names; `signals` by oncenter's names; `value` in SI, s, or a factor; `places` of the
    signals in a database; `effect` on the offset, a sentence without its full stop."""

    kind: str
    signals: tuple[str, ...]
    value: float
    sources: Mapping[str, str]
    vehicle: Vehicle
    places: Mapping[str, str] = MappingProxyType({})
    effect: str = NO_OFFSET

    def subject(self) -> str:
        """ "steering wheel angle (VDC2 from 0x3E) or the yaw rate (...)"."""
        return " or the ".join(_spoken(name, self.sources) for name in self.signals)

    def bits(self) -> str:
        """Those of a decoded signal: "the start bit, ... that the database gives it: VDC2.Yaw 24|16@1+ of a.dbc"."""
        places = [place for name in self.signals if (place := self.places.get(name))]
        return f"{_BITS}: {' and '.join(places)}" if places else _BITS

    def in_unit(self, value: float) -> str:
        factor, unit = _UNITS[SIGNALS[self.signals[0]].quantity.unit]
        return f"{value / factor + 0.0:.4g} {unit}"


def _spoken(name: str, sources: Mapping[str, str]) -> str:
    source = sources.get(name)
    return name.replace("_", " ") + (f" ({source})" if source else "")


def has_signal_fault(native: _core.OcAnswer) -> bool:
    return native["signals_at_fault"] != 0


def signal_fault(native: _core.OcAnswer, drives: Sequence[Signals], vehicle: Vehicle) -> SignalFault:
    """Of an oc_answer that has one."""
    by_name = {name: source for drive in drives for name, source in drive.sources.items()}
    sources = {name: source.description for name, source in by_name.items()}
    places = {name: source.place for name, source in by_name.items()}
    signals = _core.signals_of(native["signals_at_fault"])
    kind, value = _core.SIGNAL_FAULTS[native["signal_fault"]], native["signal_fault_value"]
    if kind == "scale" and "steering_wheel_angle" in signals:
        value /= _USUAL_BY_UNDERSTEER
    return SignalFault(kind, signals, value, sources, vehicle, places)


def found_in(signals: Signals, vehicle: Vehicle | None) -> Finding | None:
    """By a run of the core over one drive; without a vehicle the size of the angle is not judged."""
    truck = _ANY if vehicle is None else vehicle
    core = core_of(truck, signals.rate_hz)
    (decoded,) = without_whole_turns((signals,))
    core.run({name: decoded.columns[name] for name in _core.COLUMNS if name in decoded.columns})
    native = core.answer()
    fault = signal_fault(native, [signals], truck) if has_signal_fault(native) else None
    if fault is None or (vehicle is None and fault.kind == "scale" and "steering_wheel_angle" in fault.signals):
        return None
    return finding_of(fault)


def finding_of(fault: SignalFault) -> Finding:
    found: Finding = _FINDINGS[fault.kind](fault)
    return replace(found, signals=fault.signals)


@finding("signal_filled", "error")
def _filled(found: Kind, fault: SignalFault) -> Finding:
    """The core's watch of each signal: jumps that land on one value again and again."""
    bits = ", or it is decoded from wrong bits" if fault.value != 0.0 else ""
    return found(
        f"the {fault.subject()} jumps to {fault.in_unit(fault.value)} and back again and again: missing samples are "
        f"filled with this number{bits}. {fault.effect}. Leave these samples empty where the file is written, or name "
        "a signal without them"
    )


@finding("signal_stuck", "error", "s")
def _stuck(found: Kind, fault: SignalFault) -> Finding:
    """At one value while the other signals show a change."""
    return found(
        f"the {fault.subject()} stays at one value for {fault.value:.0f} s while the truck moves otherwise: it is "
        f"stuck, or the file repeats the last value. {fault.effect}. {_BOTH} the recording",
        fault.value,
    )


@finding("signal_clipped", "error")
def _clipped(found: Kind, fault: SignalFault) -> Finding:
    """At one value again and again, while the other signals show more."""
    return found(
        f"the {fault.subject()} never exceeds {fault.in_unit(abs(fault.value))} and stays there while the truck turns "
        f"more: that is the end of its range, so it is clipped. {fault.effect}. Record it with a wider range"
    )


@finding("signal_noise", "error")
def _noise(found: Kind, fault: SignalFault) -> Finding:
    """Its means over 0.5 s differ as much as all its values."""
    return found(f"the {fault.subject()} is no more than noise. {fault.effect}. {_BOTH} {fault.bits()}")


@finding("signal_jumps", "error")
def _jumps(found: Kind, fault: SignalFault) -> Finding:
    """Jumps that no truck makes, or values that no truck has."""
    jump_deg = abs(fault.value) / DEGREE
    if fault.signals == ("steering_wheel_angle",) and abs(jump_deg - _WHOLE_TURN_DEG) < _NEAR_DEG:
        return found(
            f"the {fault.subject()} jumps by a whole turn, 360 deg: it is wrapped to one turn. {fault.effect}. Unwrap "
            "it where the file is written, or name the signal that counts turns as plus in the [signals] table"
        )
    return _decoded_wrongly(fault)


@finding("signal_jumps", "error")
def _decoded_wrongly(found: Kind, fault: SignalFault) -> Finding:
    """Values, jumps or sizes that no truck has."""
    jumps = fault.kind == "jumps" and fault.value != 0.0
    size = f"jumps by {fault.in_unit(abs(fault.value))}, as" if jumps else "has values that"
    return found(
        f"the {fault.subject()} {size} no truck does: it was decoded from wrong bits, with a wrong byte order or sign, "
        f"or it is another signal. {fault.effect}. Check {fault.bits()}"
    )


@finding("signal_magnitude", "error")
def _magnitude(found: Kind, fault: SignalFault) -> Finding:
    """Its two sides contradict each other, and it has one sign only."""
    return found(
        f"the {fault.subject()} has the same sign in left and right turns: it is a magnitude, and its sign is another "
        f"signal. {fault.effect}. Name that signal as sign_by in {SIGNALS_TABLE}"
    )


@finding("sign_reversed", "error")
def _reversed(found: Kind, fault: SignalFault) -> Finding:
    """The core's comparison of the signals of a turn."""
    entries = fault.vehicle.signals
    turned = any((entry := entries.get(name)) is not None and entry.sign == -1 for name in fault.signals)
    remedy = "Remove sign = -1 for it in" if turned else "Set sign = -1 for it in"
    which = "either the" if len(fault.signals) > 1 else "the"
    return found(
        f"the sign of {which} {fault.subject()} is reversed: left turns must be positive in all signals. "
        f"{fault.effect}. {_BOTH} the sign of the signal. {remedy} {SIGNALS_TABLE}"
    )


@finding("scale", "error", "1")
def _scale(found: Kind, fault: SignalFault) -> Finding:
    """The size of its motion is far from that of the others."""
    name = fault.signals[0]
    factor = fault.value
    if not 1.0 / _WRONG_BITS_FROM < factor < _WRONG_BITS_FROM:
        return _decoded_wrongly(fault)
    unit = next((words for slip, words in _SLIPS[name] if 1.0 / _RELATIVE_NEAR < factor / slip < _RELATIVE_NEAR), None)
    ratio = fault.vehicle.ratio_near_centre
    if unit is None and name == "steering_wheel_angle" and 0.7 < factor * ratio < 1.5:
        unit = "the angle of the road wheels, not of the steering wheel"
    size = f"too large by a factor of {factor:.3g}" if factor > 1.0 else f"too small by a factor of {1.0 / factor:.3g}"
    also = ", and the wheelbase and the steering ratio of the vehicle file" if name == "steering_wheel_angle" else ""
    another = "" if unit or 1.0 / _FACTOR_MAX < factor < _FACTOR_MAX else ", and that it is not another signal"
    what = f" ({unit})" if unit else ""
    first, *others = (_spoken(each, fault.sources) for each in fault.signals)
    of_others = f"the {others[0]}, or that is wrong by this factor" if others else "the other signals"
    return found(
        f"the {first} is {size} for the turns of {of_others}{what}. {fault.effect}. Check its unit and its scale in "
        f"{SIGNALS_TABLE}{also}{another}",
        factor,
    )


@finding("signal_late", "error", "s")
def _late(found: Kind, fault: SignalFault) -> Finding:
    """Its lag is outside the usual range, in each pair of signals that it is in."""
    return found(
        f"the {fault.subject()} lags behind the other signals by about {fault.value:.1f} s. {fault.effect}. Check its "
        "time stamps, and the delay of its sender and of its filter",
        fault.value,
    )


@finding("signal_unrelated", "error")
def _unrelated(found: Kind, fault: SignalFault) -> Finding:
    """It does not move with the turns that two other signals show."""
    return found(
        f"the {fault.subject()} does not follow the turns of the truck: it is another signal, or was decoded from "
        f"wrong bits. {fault.effect}. Check its assignment in {SIGNALS_TABLE}, and {fault.bits()}"
    )


_FINDINGS = {
    "filled": _filled,
    "stuck": _stuck,
    "clipped": _clipped,
    "noise": _noise,
    "jumps": _jumps,
    "magnitude": _magnitude,
    "reversed": _reversed,
    "scale": _scale,
    "late": _late,
    "unrelated": _unrelated,
}
