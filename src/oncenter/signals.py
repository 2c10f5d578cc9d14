"""The signals of a drive: one table of names, units, signs and thesis symbols, and the table type itself.

ISO 8855: left turn positive for angle, yaw rate and lateral acceleration; the accelerometer reports specific force.
All values are SI and rad; `time_s` is in seconds. Not available is NaN, never null.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.utc import EPOCH_S, LAST_S

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    import polars as pl

    from oncenter.account import Account

    Columns = Mapping[str, npt.NDArray[np.float64]]

DEGREE = math.pi / 180.0
STANDARD_GRAVITY = 9.80665  # m/s^2, exact by convention
CLOCK_STEP_S = 86400.0  # a longer step between two ticks is of the clock, or of two logs behind one another


@dataclass(frozen=True)
class Quantity:
    """The SI unit, and the units in files, each with its factor to SI."""

    unit: str
    factors: Mapping[str, float]


ANGLE = Quantity("rad", {"rad": 1.0, "deg": DEGREE})
ANGULAR_RATE = Quantity("rad_s", {"rad_s": 1.0, "deg_s": DEGREE})
MILE_PER_HOUR = 0.44704  # m/s, exact
SPEED = Quantity("m_s", {"m_s": 1.0, "km_h": 1 / 3.6, "mph": MILE_PER_HOUR})
WHEEL_SPEED = Quantity("m_s", {"m_s": 1.0, "km_h": 1 / 3.6, "mph": MILE_PER_HOUR})
ACCELERATION = Quantity("m_s2", {"m_s2": 1.0, "g": STANDARD_GRAVITY})
TORQUE = Quantity("nm", {"nm": 1.0})
PURE_NUMBER = Quantity("1", {"1": 1.0})
_SHOWN_AS = {"rad": "deg", "rad_s": "deg_s", "m_s": "km_h"}  # by SI unit: the unit for people


def shown_unit(quantity: Quantity) -> str:
    """The unit for people, a key of its factors."""
    return _SHOWN_AS.get(quantity.unit, quantity.unit)


def in_words(unit: str) -> str:
    """A unit of files as people write it, "deg/s" for "deg_s"; empty for a pure number."""
    return {"deg_s": "deg/s", "km_h": "km/h", "m_s2": "m/s^2", "nm": "N m", "1": ""}.get(unit, unit)


@dataclass(frozen=True)
class Signal:
    """A signal by its name without unit; `column` is its name in tables."""

    name: str
    quantity: Quantity
    symbol: str  # the thesis's
    about: str

    @property
    def column(self) -> str:
        return self.name if self.quantity is PURE_NUMBER else f"{self.name}_{self.quantity.unit}"


SIGNALS: dict[str, Signal] = {
    s.name: s
    for s in (
        Signal("steering_wheel_angle", ANGLE, "delta_m", "as measured, offset included, left positive"),
        Signal("yaw_rate", ANGULAR_RATE, "r", "left positive"),
        Signal("vehicle_speed", SPEED, "v_x", "forward positive"),
        Signal("lateral_acceleration", ACCELERATION, "a_y", "specific force, left positive"),
        Signal("longitudinal_acceleration", ACCELERATION, "a_x", "specific force, forward positive"),
        Signal("wheel_speed_front_left", WHEEL_SPEED, "v_fl", "at the tread"),
        Signal("wheel_speed_front_right", WHEEL_SPEED, "v_fr", "at the tread"),
        Signal("wheel_speed_rear_left", WHEEL_SPEED, "v_rl", "at the tread"),
        Signal("wheel_speed_rear_right", WHEEL_SPEED, "v_rr", "at the tread"),
        Signal("steering_wheel_torque", TORQUE, "", "applied by the driver, left positive"),
        Signal("stability_control_active", PURE_NUMBER, "", "1 while yaw or roll-over control acts, else 0"),
        Signal("anti_lock_active", PURE_NUMBER, "", "1 while the brakes' ABS regulates, else 0"),
        Signal("steering_assist_active", PURE_NUMBER, "", "1 while a motor steers, as for lane keeping, else 0"),
        Signal("reverse", PURE_NUMBER, "", "1 while the truck drives backward, or is in reverse gear, else 0"),
        Signal("axle_lifted", PURE_NUMBER, "", "1 while the axle that can be lifted is up, else 0"),
        Signal("rear_axle_angle", ANGLE, "", "road wheels of a steered rear axle (`rear_axle_steers`), left positive"),
        Signal("steering_wheel_angle_sensor_type", PURE_NUMBER, "", "SPN 1812: 0 relative, 1 absolute"),
        Signal("latitude", Quantity("deg", {"deg": 1.0}), "", "WGS 84"),
        Signal("longitude", Quantity("deg", {"deg": 1.0}), "", "WGS 84"),
        Signal("heading", Quantity("deg", {"deg": 1.0}), "", "GNSS, clockwise from north"),
        Signal("course", Quantity("deg", {"deg": 1.0}), "", "GNSS over ground, clockwise from north"),
        Signal("lateral_speed", SPEED, "v_y", "GNSS over ground, left positive"),
    )
}

# True, 1, or false, 0; a state has nothing between.
STATUSES = ("stability_control_active", "anti_lock_active", "steering_assist_active", "reverse", "axle_lifted")


@dataclass(frozen=True)
class SignalName:
    """The name of a signal in a log: an entry of a vehicle file's `[signals]` table.

    `name` is the column, the MF4 channel, or `Message.Signal` of a DBC. `unit` is a key of the quantity's factors, or
    None for the file's own unit. `sign` is -1 where right is positive. `sign_by` is a signal that is not zero where a
    magnitude is to the right, `plus` one that is added, both named as `name` and sent in the same message. `time` is
    the column or variable with its times, or the group that has them; `time_unit` is their unit. `gain` is the steering
    ratio for an angle of the road wheels, else 1. `true_when` are the values of a true status, numbers or their names
    in the database; all other values are false.
    """

    name: str
    unit: str | None = None
    sign: int = 1
    sign_by: str | None = None
    plus: str | None = None
    time: str | None = None
    time_unit: str | None = None
    gain: float = 1.0
    true_when: tuple[float | str, ...] | None = None

    @property
    def factor(self) -> float:
        """Signal per value, both in one unit."""
        return self.sign * self.gain


@dataclass(frozen=True)
class Source:
    """Origin of a signal, and its rate and availability before resampling to the common tick."""

    description: str  # "VDC2 from 0x3E", "column swa_deg", "channel YawRate (VDC2)"
    rate_hz: float  # of its own messages, median
    samples: int
    not_available: int  # of the samples
    others: tuple[str, ...] = ()  # further sources of the signal, not used
    place: str = ""  # by a database: "STEERING.ANGLE 16|13@1- of truck.dbc"


@dataclass(frozen=True, init=False, repr=False)
class Signals:
    """A drive as a table of signals.

    Attributes:
        table: polars DataFrame, `time_s` strictly increasing with step 1/rate_hz except at gaps (one longer than a few
            seconds has no rows), then one Float64 column per signal in SI, named `Signal.column`; NaN where not
            available; a signal that the log lacks has no column. The constructor takes it, or its columns.
        columns: the same columns by name, as NumPy arrays of shape (n,).
        ticks: rows of the table.
        sources: by signal name, one for each column.
        rate_hz: of the table, 20 to 200.
        log: name of the source, for people.
        notes: one line each about choices made while reading, for people.
        vin: of the truck, where the log contains it: frames as J1939 VI, tables in metadata or a column.
        start_s: begin of the drive in s since 1970, where a table states it beside its time.
        account: of all values in the log; None for a table that was not read from one.
        duration_s: time from the first tick to the last, without steps of the clock: backward, or by more than a day.
    """

    table: pl.DataFrame
    sources: Mapping[str, Source]
    rate_hz: float
    log: str
    notes: tuple[str, ...] = ()
    vin: str | None = None
    start_s: float | None = None
    account: Account | None = None

    def __init__(
        self,
        table: pl.DataFrame | Columns,
        sources: Mapping[str, Source],
        rate_hz: float,
        log: str,
        notes: tuple[str, ...] = (),
        vin: str | None = None,
        start_s: float | None = None,
        account: Account | None = None,
    ) -> None:
        given = "columns" if isinstance(table, Mapping) else "table"
        facts = {"rate_hz": rate_hz, "log": log, "notes": notes, "vin": vin, "start_s": start_s, "account": account}
        vars(self).update({given: table}, sources=sources, **facts)

    @cached_property  # type: ignore[no-redef]
    def table(self) -> pl.DataFrame:
        import polars as pl  # late import: it takes longer than an answer, and most answers need no table

        return pl.DataFrame(self.columns)

    @cached_property
    def columns(self) -> Columns:
        return {name: self.table[name].to_numpy() for name in self.table.columns}

    @property
    def ticks(self) -> int:
        return len(self.columns["time_s"])

    @property
    def begin_s(self) -> float | None:
        """Begin of the drive in s since 1970: by the stamps, else as the file states it; None where it has neither."""
        first = float(self.columns["time_s"][0]) if self.ticks else 0.0
        stated = self.start_s if self.start_s is not None and 0.0 <= self.start_s < LAST_S else None
        return first if EPOCH_S < first < LAST_S else stated

    @property
    def duration_s(self) -> float:
        time = self.columns["time_s"]
        if not len(time):
            return 0.0
        steps = time[1:] - time[:-1]
        return float(time[-1] - time[0] - steps[(steps < 0.0) | (steps > CLOCK_STEP_S)].sum())

    def replaced(
        self,
        columns: Columns | None = None,
        sources: Mapping[str, Source] | None = None,
        log: str | None = None,
        notes: tuple[str, ...] | None = None,
    ) -> Signals:
        """The same drive with other columns, sources, log or notes."""
        return Signals(
            self.columns if columns is None else columns,
            self.sources if sources is None else sources,
            self.rate_hz,
            self.log if log is None else log,
            self.notes if notes is None else notes,
            self.vin,
            self.start_s,
            self.account,
        )

    def length(self) -> str:
        """The length in words, "1800.0 s at 100 Hz"."""
        return f"{self.duration_s:.1f} s at {self.rate_hz:.4g} Hz"

    def __repr__(self) -> str:
        return f"Signals({self.log!r}, {self.length()}: {', '.join(self.sources)})"

    def _repr_html_(self) -> str:
        """A row a signal: unit, range, share of ticks without a number, rate and source."""
        from oncenter.notebook import html_table  # late import: notebooks alone need it

        rows = []
        for name, source in self.sources.items():
            signal = SIGNALS[name]
            unit = shown_unit(signal.quantity)
            values = self.columns[signal.column] / signal.quantity.factors[unit]
            numbers = values[values == values]
            span = f"{numbers.min():.4g} to {numbers.max():.4g}" if len(numbers) else "-"
            missing = f"{100.0 * (1.0 - len(numbers) / max(len(values), 1)):.0f} %"
            rows.append((name, span, in_words(unit), missing, f"{source.rate_hz:.0f} Hz", source.description))
        head = ("signal", "range", "unit", "missing", "rate", "source")
        return html_table(f"{self.log}: {self.length()}", head, rows)


def drives_of(given: object, verb: str) -> tuple[Signals, ...]:
    """The drives given to a verb, one or several.

    Raises:
        OncenterError: "not_signals", exit code 2: another type; the message names the conversion.
    """
    if isinstance(given, Signals):
        return (given,)
    if isinstance(given, Sequence) and not isinstance(given, str | bytes):
        return tuple(drive for each in given for drive in drives_of(each, verb))
    is_file = isinstance(given, str | os.PathLike)
    how = "oncenter.read(path)" if is_file else "oncenter.from_dataframe(frame)"
    raise OncenterError(
        f"{verb} needs Signals, from {how}; got {type(given).__name__}", code="not_signals", exit_code=WRONG_USAGE
    )
