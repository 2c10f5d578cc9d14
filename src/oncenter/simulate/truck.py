"""The single-track truck's parameters from a scenario: its loaded axles, and what follows from them by (10).

Cornering stiffness grows with axle load by a power (2.3: about in proportion). The axles of a group share its load by
their suspension. A truck with several unsteered axles turns like a two-axle truck with the equivalent wheelbase
(Winkler [8]) L_e = L (1 + T/L^2 (1 + C_r/C_f)), where T is the mean square of the rear axles' distances from their
centre; dual tyres add to T. A semitrailer's axles act through the hitch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from oncenter._native import ffi, lib
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.signals import DEGREE, STANDARD_GRAVITY
from oncenter.simulate.road_sections import Patches
from oncenter.simulate.scenario import Scenario
from oncenter.simulate.truck_sections import LIFTING_S, Payload, Steering, Trailer, Truck, Tyres

_SPEED_MARGIN = 0.8  # of the critical speed; above it the driver cannot control an oversteering truck


@dataclass(frozen=True)
class _Axle:
    behind_m: float  # the first axle, or a trailer's hitch
    stiffness_n_rad: float  # of its tyres
    load_n: float
    scrub_n_m2: float = 0.0
    steer_share: float = 0.0


@dataclass(frozen=True)
class _Body:
    """Mass, inertia about the centre of gravity, and the distance of that behind the first axle or the hitch."""

    mass_kg: float
    yaw_inertia_kg_m2: float
    behind_m: float

    def laden(self, payload: Payload | None) -> _Body:
        if payload is None:
            return self
        return self.with_goods(payload.mass_kg, payload.distance_m, payload.length_m)

    def with_goods(self, mass_kg: float, distance_m: float, length_m: float) -> _Body:
        """mass_kg: negative for goods that are unloaded."""
        mass = self.mass_kg + mass_kg
        behind = (self.mass_kg * self.behind_m + mass_kg * distance_m) / mass
        inertia = self.yaw_inertia_kg_m2 + mass_kg * length_m**2 / 12.0
        for m, x in ((self.mass_kg, self.behind_m), (mass_kg, distance_m)):
            inertia += m * (x - behind) ** 2
        return _Body(mass, inertia, behind)


def first_axle_distance_m(truck: Truck) -> float:
    """The distance from the centre of gravity, payload included, to the first axle."""
    return _body(truck).behind_m


def equivalent_wheelbase_m(truck: Truck, steering: Steering, *, lifted: bool = False) -> float:
    """Winkler's equivalent wheelbase [8]: L of (10) for any axles, dual tyres and semitrailer; tyres near zero slip.

    Args:
        truck, steering: the steering's compliance softens the front axles.
        lifted: with the last axle off the road.
    """
    return float(_stance(truck, steering, lifted, 1.0, 0.0).front_wheel_angle)


def understeer_gradient(truck: Truck, steering: Steering, *, lifted: bool = False) -> float:
    """K_us/g of (10) at the road wheel, compliance and roll steer included, rad/(m/s^2); tyres near zero slip."""
    by_roll = steering.roll_steer_deg_deg * truck.roll_deg_m_s2 * DEGREE
    return float(_stance(truck, steering, lifted, 0.0, 1.0).front_wheel_angle) - by_roll


def steered_force_n(
    truck: Truck, steering: Steering, lateral_acceleration_m_s2: float, curvature_1_m: float = 0.0
) -> float:
    """Lateral force of the steered wheels for a lateral acceleration without a bend, as on a banked road, plus that for
    a curvature alone, against which the rear axles scrub."""
    return float(_stance(truck, steering, False, curvature_1_m, lateral_acceleration_m_s2).steered_force)


def steered_stiffness_n_rad(truck: Truck, steering: Steering) -> float:
    """Lateral force of all steered wheels per front wheel angle, as loaded, steering compliance included."""
    native = native_truck(truck, steering)
    axles = [native.axles[k] for k in range(truck.front_axle_count)]
    return float(sum(axle.steer_share * lib.sim_axle_stiffness(ffi.addressof(axle)) for axle in axles))


def check_holdable(scenario: Scenario) -> None:
    """Refuses a truck without load on one of its axles, and an oversteering truck near or above its critical speed.

    Raises:
        OncenterError: "scenario_file", exit code 2.
    """
    truck, patches = scenario.truck, scenario.road.patches
    states = [(truck, False)]
    if truck.lift_axle_up_s:
        states.append((truck, True))
    if truck.load_change is not None:
        _check_goods(scenario.name, truck)
        states.append((load_changed(truck), False))
    if patches is not None:
        states += [(on_patch(state, patches), lifted) for state, lifted in states]
    for state, lifted in states:
        _check_drivable(scenario, state, lifted)


def _check_drivable(scenario: Scenario, truck: Truck, lifted: bool) -> None:
    _check_stands(scenario.name, truck, lifted)
    gradient = understeer_gradient(truck, scenario.steering, lifted=lifted)
    if gradient >= 0.0:
        return
    critical_km_h = (equivalent_wheelbase_m(truck, scenario.steering, lifted=lifted) / -gradient) ** 0.5 * 3.6
    if scenario.driver.speed_km_h[1] > _SPEED_MARGIN * critical_km_h:
        raise _refusal(
            scenario.name,
            f"'truck' oversteers and has a critical speed of {critical_km_h:.0f} km/h; reduce 'driver.speed_km_h' or "
            "increase 'truck.rear_cornering_stiffness_n_rad'",
        )


def _check_goods(name: str, truck: Truck) -> None:
    trailer = truck.trailer
    if trailer is None:
        return
    if _goods_place_m(trailer) >= trailer.axles_m:
        raise _refusal(name, "'truck.load_change' needs the payload in front of the trailer's axles")
    payload_kg = trailer.payload.mass_kg if trailer.payload is not None else 0.0
    if -_goods_kg(truck) > payload_kg:
        raise _refusal(
            name,
            f"'truck.load_change.load_percent' removes {-_goods_kg(truck):.0f} kg, but 'truck.trailer.payload' has "
            f"only {payload_kg:.0f} kg",
        )


def _check_stands(name: str, truck: Truck, lifted: bool) -> None:
    if truck.trailer is not None:
        if _trailer_body(truck.trailer).behind_m >= truck.trailer.axles_m:
            raise _refusal(
                name, "'truck.trailer' has its centre of gravity behind its axles, so the hitch load is negative"
            )
        if _hitch_load_kg(truck.trailer) < 0.0:
            raise _refusal(name, "'truck.trailer' has its centre of gravity in front of the hitch")
    if min(_group_loads_n(truck, lifted)) <= 0.0:
        raise _refusal(name, "'truck' has an axle without load; change 'front_axle_distance_m' or 'payload'")


def rear_steer_share(truck: Truck) -> float:
    """Angle of the last axle per front wheel angle, while it is not locked; 0 if it is not steered."""
    if truck.rear_steering is None:
        return 0.0
    if truck.rear_steering.share is not None:
        return truck.rear_steering.share
    return (truck.wheelbase_m - _places_m(truck)[-1]) / truck.wheelbase_m


def rear_steer_weight(truck: Truck, steering: Steering) -> float:
    """Front wheel angle per angle of a steered last axle, in any steady motion: 1 for two axles; tyres near zero slip.

    The curvature is (front - weight * rear) / L_e, with L_e and K_us of the locked axle.
    """
    native = native_truck(truck, steering)
    axles = [native.axles[k] for k in range(native.axle_count)]
    stiffness = [lib.sim_axle_stiffness(ffi.addressof(axle)) for axle in axles]
    total, moment = sum(stiffness), sum(c * axle.distance for c, axle in zip(stiffness, axles, strict=True))
    front, rear = axles[0], axles[-1]
    return float(stiffness[-1] * (moment - rear.distance * total) / (stiffness[0] * (front.distance * total - moment)))


def axle_lift(truck: Truck, time_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Lift of the last axle at each time, 0 to 1; it starts to move at the scenario's times."""
    knots_s, shares = [-1.0], [0.0]
    for up_s, down_s in truck.lift_axle_up_s:
        knots_s += [up_s, up_s + LIFTING_S, down_s, down_s + LIFTING_S]
        shares += [0.0, 1.0, 1.0, 0.0]
    return np.interp(time_s, knots_s, shares)


def load_changes(truck: Truck, time_s: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """1 at each time from the load change on, else 0."""
    assert truck.load_change is not None
    return (time_s >= truck.load_change.begin_s).astype(np.float64)


def load_changed(truck: Truck) -> Truck:
    """The truck after its load change, with the goods merged into its own mass."""
    assert truck.load_change is not None
    if truck.trailer is not None:
        return truck.model_copy(update={"load_change": None, "trailer": _reloaded(truck.trailer, truck)})
    length_m = truck.payload.length_m if truck.payload is not None else 0.0
    body = _body(truck).with_goods(_goods_kg(truck), _rear_middle_m(truck), length_m)
    before_n = _group_loads_of(truck, truck.mass_kg, truck.mass_kg * truck.front_axle_distance_m, False)
    after_n = _group_loads_of(truck, body.mass_kg, body.mass_kg * body.behind_m, False)
    front, rear = ((b / a) ** truck.stiffness_load_exponent for a, b in zip(before_n, after_n, strict=True))
    changes = {
        "mass_kg": body.mass_kg,
        "yaw_inertia_kg_m2": body.yaw_inertia_kg_m2,
        "front_axle_distance_m": body.behind_m,
        "front_cornering_stiffness_n_rad": truck.front_cornering_stiffness_n_rad * front,
        "rear_cornering_stiffness_n_rad": truck.rear_cornering_stiffness_n_rad * rear,
    }
    return truck.model_copy(update=changes | {"payload": None, "load_change": None})


def on_patch(truck: Truck, patches: Patches) -> Truck:
    """The truck with the tyre stiffness of the road patches."""
    front, rear = 1.0 + patches.front_stiffness_percent / 100.0, 1.0 + patches.rear_stiffness_percent / 100.0
    changes: dict[str, Any] = {
        "front_cornering_stiffness_n_rad": truck.front_cornering_stiffness_n_rad * front,
        "rear_cornering_stiffness_n_rad": truck.rear_cornering_stiffness_n_rad * rear,
    }
    if truck.trailer is not None:
        of_trailer = {"cornering_stiffness_n_rad": truck.trailer.cornering_stiffness_n_rad * rear}
        changes["trailer"] = truck.trailer.model_copy(update=of_trailer)
    return truck.model_copy(update=changes)


def _reloaded(trailer: Trailer, truck: Truck) -> Trailer:
    """The trailer after the load change, with the goods merged into its own mass."""
    length_m = trailer.payload.length_m if trailer.payload is not None else 0.0
    body = _trailer_body(trailer).with_goods(_goods_kg(truck), _goods_place_m(trailer), length_m)
    by_load = body.mass_kg * body.behind_m / (trailer.mass_kg * trailer.gravity_centre_m)
    changes = {
        "mass_kg": body.mass_kg,
        "yaw_inertia_kg_m2": body.yaw_inertia_kg_m2,
        "gravity_centre_m": body.behind_m,
        "cornering_stiffness_n_rad": trailer.cornering_stiffness_n_rad * by_load**truck.stiffness_load_exponent,
    }
    return trailer.model_copy(update=changes | {"payload": None})


def _goods_kg(truck: Truck) -> float:
    """Mass of goods for the given change of the rear axle load; negative for unloading."""
    assert truck.load_change is not None
    rear_kg = _group_loads_n(truck, False)[1] / STANDARD_GRAVITY * truck.load_change.load_percent / 100.0
    if truck.trailer is None:
        return rear_kg
    front_m = _centre(_places_m(truck), _load_shares(truck, False), slice(None, truck.front_axle_count))
    of_hitch = (truck.trailer.hitch_m - front_m) / (_rear_middle_m(truck) - front_m)
    return rear_kg / of_hitch / (1.0 - _goods_place_m(truck.trailer) / truck.trailer.axles_m)


def _goods_place_m(trailer: Trailer) -> float:
    return trailer.payload.distance_m if trailer.payload is not None else trailer.gravity_centre_m


def native_truck(truck: Truck, steering: Steering, *, lifted: bool = False) -> Any:
    """The truck as a `sim_truck`, with its payload and its trailer."""
    body = _body(truck)
    compliance_rad_n = steering.compliance_deg_kn_m * DEGREE / 1000.0 * steering.trail_m
    native = ffi.new(
        "sim_truck *",
        {
            "mass": body.mass_kg,
            "yaw_inertia": body.yaw_inertia_kg_m2,
            "roll_per_acceleration": truck.roll_deg_m_s2 * DEGREE,
            "roll_frequency": 2.0 * np.pi * truck.roll_frequency_hz,
            "roll_damping": truck.roll_damping,
        },
    )
    axles, (front, rear) = _axles(truck, lifted), _frictions(truck.tyres)
    native.axle_count = len(axles)
    for k, axle in enumerate(axles):
        steered = axle.steer_share > 0.0
        compliance, friction = (compliance_rad_n, front) if steered else (0.0, rear)
        native.axles[k] = _native_axle(axle, body.behind_m, truck, compliance, friction)
    if truck.trailer is not None:
        native.hitch_distance = body.behind_m - truck.trailer.hitch_m
        native.trailer = _native_trailer(truck.trailer, truck)[0]
    return native


def _native_trailer(trailer: Trailer, truck: Truck) -> Any:
    body = _trailer_body(trailer)
    native = ffi.new(
        "sim_trailer *",
        {
            "mass": body.mass_kg,
            "yaw_inertia": body.yaw_inertia_kg_m2,
            "gravity_centre_distance": body.behind_m,
            "axle_count": trailer.axle_count,
            "friction": trailer.fifth_wheel_friction_n_m,
        },
    )
    front, _ = _frictions(truck.tyres)
    for k, axle in enumerate(_trailer_axles(trailer, truck.stiffness_load_exponent)):
        native.axles[k] = _native_axle(axle, 0.0, truck, 0.0, front)
    return native


def _native_axle(axle: _Axle, from_m: float, truck: Truck, compliance_rad_n: float, friction: float) -> dict[str, Any]:
    return {
        "distance": from_m - axle.behind_m,
        "steer_share": axle.steer_share,
        "compliance": compliance_rad_n,
        "relaxation_length": truck.relaxation_length_m,
        "scrub_stiffness": axle.scrub_n_m2,
        "tyre": _native_tyre(axle, truck.tyres, friction),
    }


def _frictions(tyres: Tyres | None) -> tuple[float, float]:
    """Friction of the truck's steered tyres and a trailer's, and of the truck's other tyres."""
    if tyres is None:
        return 0.0, 0.0
    return tyres.friction, tyres.friction if tyres.rear_friction is None else tyres.rear_friction


def _native_tyre(axle: _Axle, tyres: Tyres | None, friction: float) -> dict[str, Any]:
    if tyres is None:
        return {"model": lib.SIM_TYRE_LINEAR, "cornering_stiffness": axle.stiffness_n_rad}
    return {
        "model": lib.SIM_TYRE_BRUSH if tyres.model == "brush" else lib.SIM_TYRE_MAGIC_FORMULA,
        "cornering_stiffness": axle.stiffness_n_rad,
        "D": friction * axle.load_n,
        "C": tyres.C or 0.0,
        "E": tyres.E or 0.0,
    }


def _stance(truck: Truck, steering: Steering, lifted: bool, curvature_1_m: float, a_y: float) -> Any:
    return lib.sim_truck_stance(native_truck(truck, steering, lifted=lifted), curvature_1_m, a_y)


def _body(truck: Truck) -> _Body:
    return _Body(truck.mass_kg, truck.yaw_inertia_kg_m2, truck.front_axle_distance_m).laden(truck.payload)


def _trailer_body(trailer: Trailer) -> _Body:
    return _Body(trailer.mass_kg, trailer.yaw_inertia_kg_m2, trailer.gravity_centre_m).laden(trailer.payload)


def _hitch_load_kg(trailer: Trailer) -> float:
    body = _trailer_body(trailer)
    return body.mass_kg * (1.0 - body.behind_m / trailer.axles_m)


def _axles(truck: Truck, lifted: bool) -> list[_Axle]:
    """Axles from first to last, as loaded."""
    in_front = truck.front_axle_count
    empty = _loads_n(truck, _group_loads_of(truck, truck.mass_kg, truck.mass_kg * truck.front_axle_distance_m, False))
    loads = _loads_n(truck, _group_loads_n(truck, lifted), lifted)
    groups_n_rad = truck.front_cornering_stiffness_n_rad, truck.rear_cornering_stiffness_n_rad
    shares = _load_shares(truck, False)
    scrub_n_m2 = truck.dual_tyre_longitudinal_stiffness_n * truck.dual_tyre_spacing_m**2
    duals = {"6x2": 1}.get(truck.axle_layout, truck.rear_axle_count)  # a tag axle has single tyres
    axles = []
    for k, behind_m in enumerate(_places_m(truck)):
        ratio = (loads[k] / empty[k]) ** truck.stiffness_load_exponent if loads[k] > 0.0 else 0.0
        stiffness = groups_n_rad[k >= in_front] * shares[k] * ratio
        scrub = scrub_n_m2 if in_front <= k < in_front + duals else 0.0
        axles.append(_Axle(behind_m, stiffness, loads[k], scrub, _steer_share(truck, k)))
    return axles


def _places_m(truck: Truck) -> list[float]:
    front, rear = truck.front_axle_spacing_m, truck.rear_axle_spacing_m
    first = [0.0] if front is None else [0.0, front]
    return [*first, truck.wheelbase_m] if rear is None else [*first, truck.wheelbase_m, truck.wheelbase_m + rear]


def _steer_share(truck: Truck, k: int) -> float:
    """Steering angle of axle k per angle of the first: by default both point to one turning centre (Ackermann)."""
    if k == 0:
        return 1.0
    if k >= truck.front_axle_count:
        return 0.0
    if truck.second_axle_steer_share is not None:
        return truck.second_axle_steer_share
    to_middle_m = _rear_middle_m(truck)
    return (to_middle_m - _places_m(truck)[k]) / to_middle_m


def _rear_middle_m(truck: Truck) -> float:
    return _centre(_places_m(truck), _load_shares(truck, False), slice(truck.front_axle_count, None))


def _load_shares(truck: Truck, lifted: bool) -> list[float]:
    """Load share of each axle in its group."""
    front = [1.0 / truck.front_axle_count] * truck.front_axle_count
    if truck.rear_axle_count == 1:
        return [*front, 1.0]
    last = 0.0 if lifted else truck.last_axle_load_share
    return [*front, 1.0 - last, last]


def _centre(places_m: Sequence[float], shares: Sequence[float], group: slice) -> float:
    return sum(x * s for x, s in zip(places_m[group], shares[group], strict=True))


def _group_loads_n(truck: Truck, lifted: bool) -> tuple[float, float]:
    """Load on all front and on all rear axles, with payload and hitch load."""
    body = _body(truck)
    mass, moment = body.mass_kg, body.mass_kg * body.behind_m
    if truck.trailer is not None:
        mass += _hitch_load_kg(truck.trailer)
        moment += _hitch_load_kg(truck.trailer) * truck.trailer.hitch_m
    return _group_loads_of(truck, mass, moment, lifted)


def _group_loads_of(truck: Truck, mass_kg: float, moment_kg_m: float, lifted: bool) -> tuple[float, float]:
    """moment_kg_m: mass times its distance behind the first axle."""
    places_m, shares = _places_m(truck), _load_shares(truck, lifted)
    front_m = _centre(places_m, shares, slice(None, truck.front_axle_count))
    rear_m = _centre(places_m, shares, slice(truck.front_axle_count, None))
    rear_kg = (moment_kg_m - mass_kg * front_m) / (rear_m - front_m)
    return (mass_kg - rear_kg) * STANDARD_GRAVITY, rear_kg * STANDARD_GRAVITY


def _loads_n(truck: Truck, groups_n: tuple[float, float], lifted: bool = False) -> list[float]:
    shares = _load_shares(truck, lifted)
    return [share * groups_n[k >= truck.front_axle_count] for k, share in enumerate(shares)]


def _trailer_axles(trailer: Trailer, load_exponent: float) -> list[_Axle]:
    """Equally loaded axles, centred at `axles_m`."""
    n, body = trailer.axle_count, _trailer_body(trailer)
    empty_kg = trailer.mass_kg * trailer.gravity_centre_m / trailer.axles_m
    carried_kg = body.mass_kg * body.behind_m / trailer.axles_m
    stiffness = trailer.cornering_stiffness_n_rad / n * (carried_kg / empty_kg) ** load_exponent
    offs_m = [(k - (n - 1) / 2) * trailer.axle_spacing_m for k in range(n)]
    return [_Axle(trailer.axles_m + off, stiffness, carried_kg * STANDARD_GRAVITY / n) for off in offs_m]


def _refusal(name: str, message: str) -> OncenterError:
    return OncenterError(f"scenario {name}: {message}", code="scenario_file", exit_code=WRONG_USAGE)
