"""The side of traffic of an answer: by the vehicle file, else by the log's position, else by former drives."""

from __future__ import annotations

from collections.abc import Sequence

from oncenter.findings import Finding, Kind, finding
from oncenter.signals import Signals
from oncenter.traffic_side import Side, side_of
from oncenter.truck.events import Event, is_former
from oncenter.truck.row import Row
from oncenter.vehicle import Vehicle

_SIDES: dict[float, Side] = {1.0: "right", -1.0: "left"}  # of rows


def with_traffic_side(
    vehicle: Vehicle, drives: Sequence[Signals], before: Sequence[Row] = (), events: Sequence[Event] = ()
) -> tuple[Vehicle, tuple[Finding, ...], tuple[str, ...]]:
    """The vehicle with the side of traffic of these drives, a finding where two sources contradict each other, and a
    note on a side that the vehicle file does not give.

    Args:
        vehicle: of the user; its own side is the first source.
        drives: of the answer, whose positions are the second one.
        before, events: of the truck; the side of its former drives is the third one.
    """
    by_position = side_of(drives)
    if vehicle.traffic_side is not None:
        found = _contradicted(vehicle.traffic_side, by_position)
        return (vehicle, (), ()) if found is None else (vehicle.with_traffic_side(None, None), (found,), ())
    if by_position is not None:
        note = f"traffic keeps {by_position}, by the positions in the log"
        return vehicle.with_traffic_side(by_position, "position"), (), (note,)
    sides = {row.side for row in before if not is_former(row.start_s, events)} & {*_SIDES}
    if len(sides) != 1:
        return vehicle, (), ()
    former = _SIDES[sides.pop()]
    return vehicle.with_traffic_side(former, "former drives"), (), (f"traffic keeps {former}, as in former drives",)


@finding("traffic_side_contradicted", "warning")
def _contradicted(found: Kind, given: Side, by_position: Side | None) -> Finding | None:
    """The log's positions are where traffic keeps to the other side than in the vehicle file."""
    if by_position in (None, given):
        return None
    return found(
        f"the truck is given as driven on the {given}, and the positions in the log are where traffic keeps "
        f"{by_position}. The offset is estimated without a side of traffic, so it is less certain. Correct "
        "'traffic_side' in the vehicle file, or check the signals of the position"
    )
