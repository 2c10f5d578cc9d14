"""A vehicle file whose wheelbase or steering ratio is far off: the drive itself shows their product.

The core looks for an equivalent wheelbase near the given one (prior sd 5 %). Where the file is off by far more, the
core is run again with the wheelbase that it tended to, until the two agree. An axle that is lifted or a tyre changes
the product by less and is left to the core.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from oncenter.offset.findings import Finding, from_table
from oncenter.signals import Signals
from oncenter.vehicle import Vehicle

FAR_OFF = 0.2  # share of the file's product; a lifted tag axle makes 15 %
_DOUBTFUL = 0.05  # of the core's first run: worth another; its prior's sd is as much
_AGREES = 0.04  # between the given wheelbase and the one that the core then finds
_RUNS_MAX = 8
_WORSE_MAX = 1.1  # of what the first run leaves unexplained: where it found the wheelbase, another explains no more
_FACTOR_MAX = 4.0  # beyond it a unit is mixed up, no file
_WHEELBASES_M = (1.0, 20.0)  # that the core takes

Native = Mapping[str, Any]


def fitted_vehicle(
    first: Native,
    drives: Sequence[Signals],
    vehicle: Vehicle,
    params: Mapping[str, float],
    run: Callable[[Vehicle], Native],
) -> Vehicle | None:
    """The vehicle with the wheelbase that explains the drives; None where the file's own does, or nothing better shows.

    Args:
        first: the core's oc_answer of the joint method with `vehicle`.
        drives, vehicle, params: of it.
        run: the core's oc_answer with another vehicle.
    """
    share = _share(first, vehicle)
    known = params["known_wheelbase_share_sd_1"] > 0.0
    if known or (is_observable(first) and abs(share) < _DOUBTFUL):
        return None
    start_m = _shown_m(drives, vehicle)
    if start_m is None or not _is_far(start_m, vehicle):
        if abs(share) < _DOUBTFUL or not _fit_together(drives):
            return None
        start_m = first["equivalent_wheelbase"]["value"]
    found = _agreed(start_m, vehicle, run)
    if found is None:
        return None
    fitted, last = found
    as_good = last["unexplained"] < _WORSE_MAX * first["unexplained"]
    return fitted if as_good and _is_far(fitted.wheelbase_m, vehicle) else None


def is_observable(native: Native) -> bool:
    from oncenter.offset.core_findings import status_of

    return status_of(native["equivalent_wheelbase"]) == "valid"


def _share(native: Native, vehicle: Vehicle) -> float:
    share: float = native["equivalent_wheelbase"]["value"] / vehicle.wheelbase_m - 1.0
    return share


def _is_far(wheelbase_m: float, vehicle: Vehicle) -> bool:
    factor = wheelbase_m / vehicle.wheelbase_m
    return 1.0 / _FACTOR_MAX < factor < _FACTOR_MAX and abs(factor - 1.0) > FAR_OFF


def _agreed(start_m: float, vehicle: Vehicle, run: Callable[[Vehicle], Native]) -> tuple[Vehicle, Native] | None:
    """Vehicle and answer whose wheelbases agree, from a first guess on; None where none is found."""
    for _ in range(_RUNS_MAX):
        if not _WHEELBASES_M[0] < start_m < _WHEELBASES_M[1]:
            return None
        tried = vehicle.model_copy(update={"wheelbase_m": start_m})
        native = run(tried)
        if is_observable(native) and abs(_share(native, tried)) < _AGREES:
            return tried, native
        start_m = native["equivalent_wheelbase"]["value"]
    return None


def _shown_m(drives: Sequence[Signals], vehicle: Vehicle) -> float | None:
    """What the first drive whose bends tell it shows without the core, roughly."""
    from oncenter.plausibility import rough_ratio_times_wheelbase_m

    shown = next(filter(None, map(rough_ratio_times_wheelbase_m, drives)), None)
    return None if shown is None else shown / vehicle.ratio_near_centre


def _fit_together(drives: Sequence[Signals]) -> bool:
    """Whether the signals have no sign or unit at fault, which would change the product as well."""
    from oncenter.plausibility import faults

    return not any(faults(drive) for drive in drives)


def finding(fitted: Vehicle, given: Vehicle) -> Finding:
    """What to correct in the vehicle file."""
    ratio = given.ratio_near_centre
    fits = fitted.wheelbase_m / given.wheelbase_m
    text = (
        f"ratio times wheelbase in the bends of this drive is {ratio * fitted.wheelbase_m:.0f} m, the vehicle file "
        f"says {ratio * given.wheelbase_m:.0f} m: correct its wheelbase ({fitted.wheelbase_m:.2f} m fits, "
        f"{given.wheelbase_m:.2f} given) or its steering ratio ({ratio * fits:.1f} fits, {ratio:.1f} given); "
        "the offset uses the fitted value"
    )
    return from_table("wheelbase_or_ratio", text, fitted.wheelbase_m, severity="warning")
