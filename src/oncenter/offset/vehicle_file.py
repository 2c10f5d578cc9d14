"""A vehicle file with a large error of its wheelbase or steering ratio: the drive itself identifies their product.

The core estimates an equivalent wheelbase near the given one (prior sd 5 %). Where the error is far larger, the core is
run again with the wheelbase of its last answer until the two agree. A lifted axle or another tyre changes the product
by less and is left to the core.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from oncenter import _core
from oncenter.findings import Finding, Kind, finding
from oncenter.plausibility import rough_ratio_times_wheelbase_m
from oncenter.plausibility.ratio import FAR_OFF, fit_words
from oncenter.signals import Signals
from oncenter.vehicle import Vehicle

_DOUBTFUL = 0.05  # of the core's first run: worth another; its prior's sd is as much
_AGREES = 0.04  # between the given wheelbase and the one that the core then finds
_RUNS_MAX = 8
_WORSE_MAX = 1.1  # of the first run's unexplained angle: another wheelbase must explain the drive as well
_FACTOR_MAX = 4.0  # a larger factor is a wrong unit, not a wrong vehicle file
_WRONG_FILE_MAX = 1.7  # up to this factor; beyond, a signal may have another size as well
_WHEELBASES_M = (1.0, 20.0)  # accepted by the core


def fitted_vehicle(
    first: _core.OcAnswer,
    drives: Sequence[Signals],
    vehicle: Vehicle,
    params: Mapping[str, float],
    run: Callable[[Vehicle], _core.OcAnswer],
) -> Vehicle | None:
    """The vehicle with the wheelbase that explains the drives; None where the file's own does, or none is better.

    Args:
        first: the core's oc_answer of the joint method with `vehicle`.
        drives, vehicle, params: of it.
        run: the core's oc_answer with another vehicle.
    """
    share = _share(first, vehicle)
    configured = params["known_wheelbase_share_sd_1"] > 0.0
    if configured or (is_observable(first) and abs(share) < _DOUBTFUL):
        return None
    start_m = _shown_m(drives, vehicle)
    if start_m is None or not _is_far(start_m, vehicle):
        if abs(share) < _DOUBTFUL:
            return None
        start_m = first["equivalent_wheelbase"]["value"]
    found = _agreed(start_m, vehicle, run)
    if found is None:
        return None
    fitted, last = found
    walked = first["offset_walks"] and not last["offset_walks"]  # an offset that walks follows any model's errors
    as_good = walked or last["unexplained"] < _WORSE_MAX * first["unexplained"]
    return fitted if as_good and _is_far(fitted.wheelbase_m, vehicle) else None


def size_of_angle(fitted: Vehicle, given: Vehicle) -> float | None:
    """The steering wheel angle over that of the given vehicle, where no wrong vehicle file explains it; else None."""
    factor = fitted.wheelbase_m / given.wheelbase_m
    return None if 1.0 / _WRONG_FILE_MAX < factor < _WRONG_FILE_MAX else factor


def is_observable(native: _core.OcAnswer) -> bool:
    return _core.status_of(native["equivalent_wheelbase"]) == "valid"


def _share(native: _core.OcAnswer, vehicle: Vehicle) -> float:
    return native["equivalent_wheelbase"]["value"] / vehicle.wheelbase_m - 1.0


def _is_far(wheelbase_m: float, vehicle: Vehicle) -> bool:
    factor = wheelbase_m / vehicle.wheelbase_m
    return 1.0 / _FACTOR_MAX < factor < _FACTOR_MAX and abs(factor - 1.0) > FAR_OFF


def _agreed(
    start_m: float, vehicle: Vehicle, run: Callable[[Vehicle], _core.OcAnswer]
) -> tuple[Vehicle, _core.OcAnswer] | None:
    """Vehicle and answer with the same wheelbase, from a first guess; None where none is found."""
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
    """Rough estimate without the core, from the first drive with enough bends."""
    shown = next(filter(None, map(rough_ratio_times_wheelbase_m, drives)), None)
    return None if shown is None else shown / vehicle.ratio_near_centre


@finding("wheelbase_or_ratio", "warning", "m")
def far_off(found: Kind, fitted: Vehicle, given: Vehicle) -> Finding:
    """The correction that the vehicle file needs."""
    return found(
        fit_words(fitted.wheelbase_m / given.wheelbase_m - 1.0, given.wheelbase_m, given.ratio_near_centre),
        fitted.wheelbase_m,
    )
