"""A truck of which the wheelbase or the steering ratio is not given: the drive identifies their product.

The core starts from an assumed product with a wide prior.
"""

from __future__ import annotations

from collections.abc import Mapping

from oncenter import _core
from oncenter.findings import Finding, Kind, demand, finding
from oncenter.tuned import PRIORS
from oncenter.vehicle import ANY_SIDE_FORCE_M2_S2, Vehicle

_VALID = 0.5 * PRIORS["WHEELBASE"][1]  # sd of an identified product, as a share: as core/monitor/joint_verdict.c
_LAYOUT_SD = 0.85  # sd of the lateral forces of the four layouts, 7 (m/s)^2, over the one that is assumed
SIDE_FORCE = "tandem_side_force_m2_s2"
_BENDS_S = 60.0
_SPOKEN = {"wheelbase_m": "the wheelbase", "steering_ratio": "the steering ratio"}
_WORTH = ("traffic_side", "axle_layout", "wheelbase_m", "steering_ratio")  # the most useful one first


def sd_by_layout(native: _core.OcAnswer, of_one_axle: _core.OcAnswer) -> float:
    """Standard deviation of the offset by an axle layout that is not given, rad.

    Args:
        native: the core's oc_answer with the tandem force of any layout.
        of_one_axle: of the same pass with that of one rear axle, none.
    """
    return _LAYOUT_SD * abs(native["offset"]["value"] - of_one_axle["offset"]["value"])


def lacks_axles(vehicle: Vehicle, params: Mapping[str, float]) -> bool:
    return vehicle.axle_layout is None and params[SIDE_FORCE] == ANY_SIDE_FORCE_M2_S2


def product_of(native: _core.OcAnswer, vehicle: Vehicle) -> tuple[float, float]:
    """Ratio times wheelbase of the core's answer and its standard deviation, m; zeros without evidence."""
    fitted, ratio = native["equivalent_wheelbase"], vehicle.ratio_near_centre
    return ratio * fitted["value"], ratio * fitted["standard_deviation"]


def _is_usual(product_m: float, vehicle: Vehicle) -> bool:
    mean_m, sd_m = vehicle.prior_of_product_m
    return abs(product_m - mean_m) < 2.0 * sd_m


@finding("unknown_truck", "info", "m")
def unknown_truck(found: Kind, native: _core.OcAnswer, vehicle: Vehicle) -> Finding | None:
    """The vehicle file lacks the wheelbase or the steering ratio, or there is none."""
    if not vehicle.assumed:
        return None
    product_m, sd_m = product_of(native, vehicle)
    mean_m, prior_sd_m = vehicle.prior_of_product_m
    low_m, high_m = mean_m - 2.0 * prior_sd_m, mean_m + 2.0 * prior_sd_m
    lacking = " and ".join(_SPOKEN[key] for key in vehicle.assumed)
    given = f"{lacking} {'is' if len(vehicle.assumed) == 1 else 'are'} not given"
    if native["used"] > 0.0 and not _is_usual(product_m, vehicle):
        return found(
            f"{given}, and no usual truck fits this drive: steering ratio times wheelbase would be {product_m:.0f} m, "
            f"and trucks have {low_m:.0f} to {high_m:.0f} m. Either free play explains the whole angle, or the angle, "
            "the yaw rate or the speed has a wrong scale. There is no valid offset. Check the signals with oncenter "
            f"signals, drive {demand(_BENDS_S)} of bends to both sides, or give {lacking} in a vehicle file",
            product_m,
            severity="warning",
        )
    lacks = f"This drive hardly identifies it: drive {demand(_BENDS_S)} more of bends to both sides, at several speeds"
    is_identified = native["used"] > 0.0 and sd_m < _VALID * product_m
    shown = f"The bends of this drive show {product_m:.1f} ±{1.96 * sd_m:.1f} m" if is_identified else lacks
    useful = [key for key in _WORTH if key in vehicle.assumed or getattr(vehicle, key) is None]
    return found(
        f"{given}: {low_m:.0f} to {high_m:.0f} m were assumed for steering ratio times wheelbase. {shown}. An angle in "
        "a wrong scale hides in this number, and then the offset has the same wrong scale. A vehicle file narrows the "
        f"interval (oncenter vehicle new truck.toml), by these keys, the most useful first: {', '.join(useful)}",
        product_m if native["used"] > 0.0 else None,
    )
