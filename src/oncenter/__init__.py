"""The offset of a truck's steering wheel angle sensor, from signals that are already on its CAN bus.

>>> import oncenter as oc
>>> answer = oc.offset(oc.read("drive.log"), oc.vehicle("truck.toml"))  # doctest: +SKIP

A drive from any source becomes `Signals`; a truck is a `Vehicle`:

    read(path)                 the signals of a log: candump, ASC, BLF, TRC, MF4, CSV, Parquet
    from_dataframe(frame)      the signals of a table of pandas, polars or pyarrow, or of a dict of arrays
    simulate(scenario, seed)   the signals of a simulated drive, and its truth
    vehicle(path)              a truck, from its TOML file

Results:

    offset(signals, vehicle)   the offset of the sensor: an `Answer`, in words by `print`, as JSON by `to_json`
    angle(signals, vehicle)    the steering wheel angle without its sensor, as a table
    reference(signals)         the offset measured by driving one straight both ways
    budget(vehicle)            the effect of each sensor error on the offset
    compare(before, after)     the effect of a calibration or a repair, from the answers of two drives
    report(answer, path)       an answer as one offline page
    trace(answer)              the output of the core at each tick of an answer, as a table
    Monitor(vehicle, rate_hz)  the same core, one tick at a time, as in the truck: `Tick` in, `Now` out

Each error of input or usage is an `OncenterError` of one line. SI and rad; left turns are positive (ISO 8855).
Names are loaded when they are first used.
"""

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from oncenter.angle.run import angle as angle
    from oncenter.bus.monitor import Monitor as Monitor
    from oncenter.bus.monitor import Now as Now
    from oncenter.bus.monitor import Tick as Tick
    from oncenter.errors import OncenterError as OncenterError
    from oncenter.offset.answer import Answer as Answer
    from oncenter.offset.budget import Budget as Budget
    from oncenter.offset.budget import budget as budget
    from oncenter.offset.compare import Comparison as Comparison
    from oncenter.offset.compare import compare as compare
    from oncenter.offset.run import offset as offset
    from oncenter.offset.trace import trace as trace
    from oncenter.read import read as read
    from oncenter.read.dataframe import from_dataframe as from_dataframe
    from oncenter.reference.run import Reference as Reference
    from oncenter.reference.run import reference as reference
    from oncenter.report import report as report
    from oncenter.signals import Signals as Signals
    from oncenter.simulate import simulate as simulate
    from oncenter.vehicle import Vehicle as Vehicle
    from oncenter.vehicle import vehicle as vehicle

# Where each public name lives. A verb may share its name with its room: the verb wins.
_HOMES = {
    "angle": "angle.run",
    "Budget": "offset.budget",
    "budget": "offset.budget",
    "OncenterError": "errors",
    "Answer": "offset.answer",
    "Comparison": "offset.compare",
    "compare": "offset.compare",
    "offset": "offset.run",
    "trace": "offset.trace",
    "Monitor": "bus.monitor",
    "Now": "bus.monitor",
    "Tick": "bus.monitor",
    "read": "read",
    "from_dataframe": "read.dataframe",
    "Reference": "reference.run",
    "reference": "reference.run",
    "report": "report",
    "Signals": "signals",
    "simulate": "simulate",
    "Vehicle": "vehicle",
    "vehicle": "vehicle",
}

__all__ = [*_HOMES, "__version__"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from oncenter import _core

        return _core.version()
    if name not in _HOMES:
        raise AttributeError(f"module 'oncenter' has no attribute '{name}'")
    from importlib import import_module

    value = getattr(import_module(f"oncenter.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)


class _Package(ModuleType):
    """Importing a room would put it in the place of the verb of the same name; here it does not."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
