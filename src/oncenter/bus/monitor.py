"""The core one tick at a time, for a live bus or another program: the same code as for logs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.estimates.estimates import DEFAULT_METHOD, METHODS, Method
from oncenter.vehicle import Vehicle, core_of

NOT_AVAILABLE = float("nan")

_REFUSALS = {
    "missing": "does not begin as an image of oncenter does",
    "truncated": "is not complete",
    "damaged": "is damaged: its CRC-32 is wrong",
    "layout": "is from another version of oncenter",
    "foreign": "is from another vehicle, or from other params, method or rate",
    "implausible": "contains a value that no drive can give",
}


@dataclass(frozen=True)
class Tick:
    """One tick of signals, SI and rad, left positive; NaN is not available. A status is 1 or 0."""

    time_s: float
    steering_wheel_angle_rad: float
    yaw_rate_rad_s: float
    vehicle_speed_m_s: float
    lateral_acceleration_m_s2: float = NOT_AVAILABLE
    wheel_speed_front_left_m_s: float = NOT_AVAILABLE
    wheel_speed_front_right_m_s: float = NOT_AVAILABLE
    wheel_speed_rear_left_m_s: float = NOT_AVAILABLE
    wheel_speed_rear_right_m_s: float = NOT_AVAILABLE
    steering_wheel_torque_nm: float = NOT_AVAILABLE
    stability_control_active: float = NOT_AVAILABLE
    anti_lock_active: float = NOT_AVAILABLE
    steering_assist_active: float = NOT_AVAILABLE
    reverse: float = NOT_AVAILABLE
    axle_lifted: float = NOT_AVAILABLE
    rear_axle_angle_rad: float = NOT_AVAILABLE


@dataclass(frozen=True)
class Now:
    """The result of a tick. The motion is one filter delay old; the offset uses final evidence only.

    `angle_rad` is the true steering wheel angle of this tick, with its rate and standard deviation. By `angle_source`
    it is "compensated", the measured angle less the offset, or "estimated" from the motion alone, while the sensor is
    lost or faulty. It is "unobservable" in `angle_status` while it is held at walking speed, and where there never was
    a sensor; the standard deviation contains that. `angle_estimate_rad` is the estimate from the motion alone, also
    beside a working sensor. `angle_delay_s` is the delay that is left in an estimated angle; the standard deviation
    contains it. `oncenter.angle` gives the same numbers for a log.

    `offset_rad`, its standard deviation `offset_sd_rad` and the part of it from this drive, `offset_drive_sd_rad`, are
    None while the offset is unobservable. `reasons` are those for which the tick cannot be used; without any, the tick
    waits for clean ticks after it. `sensor_fault` is "none" or the fault of the angle sensor; the offset is "invalid"
    then, and from before the fault. `signal_fault` is "none" or what is wrong with `signals_at_fault`, which are not
    what their names say; the offset is "invalid" then, too. Gradient and play are 0 until estimated. The yaw rate bias
    is from wheel speeds and standstill; its standard deviation is the prior's before.
    """

    time_s: float
    reasons: tuple[str, ...]
    angle_rad: float
    angle_rate_rad_s: float
    angle_sd_rad: float
    angle_status: str
    angle_source: str
    angle_delay_s: float
    angle_estimate_rad: float
    angle_estimate_sd_rad: float
    curvature_1_m: float
    bank_m_s2: float
    residual_rad: float
    offset_rad: float | None
    offset_sd_rad: float | None
    offset_drive_sd_rad: float | None
    offset_status: str
    sensor_fault: str
    signal_fault: str
    signals_at_fault: tuple[str, ...]
    understeer_gradient_rad_m_s2: float
    backlash_rad: float
    yaw_rate_bias_rad_s: float
    yaw_rate_bias_sd_rad_s: float


class Monitor:
    """The estimator of one truck, fed tick by tick.

    Args:
        vehicle: its `[params]` apply.
        rate_hz: of the ticks, 20 to 200.
        method: as for `oncenter.offset`; "wheel-speed" with the axle whose track width the vehicle has, the rear one
            where it has both.
        params: override the vehicle's.

    Raises:
        OncenterError: "method", "params" or "rate", exit code 2.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        rate_hz: float = 100.0,
        *,
        method: Method = DEFAULT_METHOD,
        params: Mapping[str, float] | None = None,
    ) -> None:
        if method not in METHODS:
            raise OncenterError(
                f"method '{method}' does not exist; use one of {', '.join(METHODS)}",
                code="method",
                exit_code=WRONG_USAGE,
            )
        if not _core.RATE_MIN_HZ <= rate_hz <= _core.RATE_MAX_HZ:
            raise OncenterError(f"'rate_hz' must be 20 to 200, got {rate_hz:g}", code="rate", exit_code=WRONG_USAGE)
        self._core = core_of(vehicle, rate_hz, method=method, params=params)
        self._sequence = 0
        self._about = f"{vehicle.name!r}, rate_hz={rate_hz:g}, method={method!r}"

    def __repr__(self) -> str:
        return f"Monitor({self._about})"

    def step(self, tick: Tick) -> Now:
        """Takes one tick. A tick that cannot be used has `reasons` and changes no estimate."""
        output = self._core.step(asdict(tick))
        angle = output["angle"]
        status = _core.STATUSES[output["offset_status"]]
        observable = status != "unobservable"
        return Now(
            time_s=output["time"],
            reasons=_core.reasons_of(output["reasons"]),
            angle_rad=angle["angle"],
            angle_rate_rad_s=angle["rate"],
            angle_sd_rad=angle["standard_deviation"],
            angle_status=_core.STATUSES[angle["status"]],
            angle_source="compensated" if angle["by_sensor"] else "estimated",
            angle_delay_s=angle["delay"],
            angle_estimate_rad=angle["estimate"],
            angle_estimate_sd_rad=angle["estimate_sd"],
            curvature_1_m=output["motion"]["curvature"],
            bank_m_s2=output["motion"]["bank"],
            residual_rad=output["motion"]["residual"],
            offset_rad=output["offset"] if observable else None,
            offset_sd_rad=output["offset_sd"] if observable else None,
            offset_drive_sd_rad=output["offset_parts"]["drive_sd"] if observable else None,
            offset_status=status,
            sensor_fault=_core.FAULTS[output["fault"]],
            signal_fault=_core.SIGNAL_FAULTS[output["signal_fault"]],
            signals_at_fault=_core.signals_of(output["signals_at_fault"]),
            understeer_gradient_rad_m_s2=output["understeer_gradient"],
            backlash_rad=output["backlash"],
            yaw_rate_bias_rad_s=output["yaw_rate_bias"],
            yaw_rate_bias_sd_rad_s=output["yaw_rate_bias_sd"],
        )

    def save(self) -> bytes:
        """The state of the monitor as an image for a later process; the same bytes on every machine."""
        self._sequence = (self._sequence + 1) % 2**32
        return self._core.save(self._sequence)

    def restore(self, image: bytes) -> None:
        """Continues from the image of `save`, for the same vehicle, params, method and rate.

        If the next tick is the next one of the drive, the results are the same to the last bit as without the cut;
        after a gap in time the filters start anew. Call `restart` after it where the ignition was off or the clock
        started anew: gyro bias, steering wheel and heading can be different then.

        Raises:
            OncenterError: "image_missing", "image_truncated", "image_damaged", "image_layout", "image_foreign" or
                "image_implausible"; the monitor is in its initial state then.
        """
        fault, self._sequence = self._core.restore(image)
        if fault != "ok":
            raise OncenterError(
                f"the saved image {_REFUSALS[fault]}; the estimates start without it", code=f"image_{fault}"
            )

    def message(self, counter: int = 0) -> bytes:
        """The result message after the last `step`, 8 bytes (see `oncenter.bus.message.decode`); `counter` 0 to 15.

        It contains the sensor's angle of that tick: a repeated call gives the same.
        """
        return self._core.message(counter)

    def message_parts(self, counter: int = 0) -> bytes:
        """The second frame of the result after the last `step`, 8 bytes (see `oncenter.bus.message.decode_parts`):
        the parts of the offset's uncertainty. `counter` is that of the first frame."""
        return self._core.message_parts(counter)

    def restart(self) -> None:
        """Ignition: the state of the filters is lost, the estimates stay."""
        self._core.restart()
