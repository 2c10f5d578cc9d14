"""The only access to native memory: the C core's structs as NumPy dtypes, its functions as Python functions.

SI units and rad. core/*/*.h documents the members.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from oncenter._native import ffi, lib

if TYPE_CHECKING:
    from oncenter._structs import OcAnswer as OcAnswer
    from oncenter._structs import OcChanged as OcChanged
    from oncenter._structs import OcEstimate as OcEstimate
    from oncenter._structs import OcOffsetParts as OcOffsetParts
    from oncenter._structs import OcOutput as OcOutput

_NUMBERS = {"double": "f8", "float": "f4", "int32_t": "i4", "uint32_t": "u4", "uint64_t": "u8", "_Bool": "?"}

RATE_MIN_HZ, RATE_MAX_HZ = 20.0, 200.0
RATIO_TERMS_MAX = int(lib.OC_RATIO_TERMS_MAX)
SECOND_COST_MAX = float(lib.OC_SECOND_COST_MAX)

# Columns of the core: names in tables and in oc_columns.
COLUMNS = {
    "time_s": "time",
    "steering_wheel_angle_rad": "steering_wheel_angle",
    "yaw_rate_rad_s": "yaw_rate",
    "vehicle_speed_m_s": "vehicle_speed",
    "lateral_acceleration_m_s2": "lateral_acceleration",
    "wheel_speed_front_left_m_s": "wheel_speed_front_left",
    "wheel_speed_front_right_m_s": "wheel_speed_front_right",
    "wheel_speed_rear_left_m_s": "wheel_speed_rear_left",
    "wheel_speed_rear_right_m_s": "wheel_speed_rear_right",
    "lateral_speed_m_s": "lateral_speed",
    "steering_wheel_torque_nm": "steering_wheel_torque",
    "stability_control_active": "stability_control_active",
    "anti_lock_active": "anti_lock_active",
    "steering_assist_active": "steering_assist_active",
    "reverse": "reverse",
    "axle_lifted": "axle_lifted",
    "rear_axle_angle_rad": "rear_axle_angle",
}
_VALID_BITS = {name: getattr(lib, f"OC_HAS_{name.upper()}") for name in COLUMNS.values() if name != "time"}


def _text(pointer: Any) -> str:
    return str(ffi.string(pointer).decode("ascii"))


def version() -> str:
    return _text(lib.oc_version())


STATUSES: tuple[str, ...] = tuple(_text(lib.oc_status_name(k)) for k in range(lib.OC_STATUS_COUNT))
METHODS: tuple[str, ...] = tuple(_text(lib.oc_method_name(k)) for k in range(lib.OC_METHOD_COUNT))
ANGLE_METHODS: tuple[str, ...] = tuple(_text(lib.oc_angle_method_name(k)) for k in range(lib.OC_ANGLE_METHOD_COUNT))
SIGNAL_BITS = {name: bit for name, bit in _VALID_BITS.items() if bit < 16}  # those that the core judges
SIGNAL_FAULTS: tuple[str, ...] = tuple(_text(lib.oc_signal_fault_name(k)) for k in range(lib.OC_SIGNAL_FAULT_COUNT))
FAULTS: tuple[str, ...] = tuple(_text(lib.oc_fault_name(k)) for k in range(lib.OC_FAULT_COUNT))
IMAGE_FAULTS: tuple[str, ...] = tuple(_text(lib.oc_image_fault_name(k)) for k in range(lib.OC_IMAGE_FAULT_COUNT))
ANGLE_SOURCES: tuple[str, ...] = tuple(_text(lib.oc_angle_source_name(k)) for k in range(lib.OC_SOURCE_COUNT))


def _names(enum: str, prefix: str) -> tuple[str, ...]:
    return tuple(name.removeprefix(prefix).lower() for _, name in sorted(ffi.typeof(enum).elements.items()))


CHANGE_KINDS = _names("oc_change_kind", "OC_CHANGE_")
TRUCK_CHANGES = _names("truck_change_kind", "TRUCK_CHANGE_")[:-1]  # the last one counts them
TRUCK_ZEROS = _names("truck_zero", "TRUCK_ZERO_")[:-1]
MESSAGE_PGN, MESSAGE_PARTS_PGN = int(lib.OC_MESSAGE_PGN), int(lib.OC_MESSAGE_PARTS_PGN)
REASONS: dict[str, int] = {_text(lib.oc_reason_name(1 << k)): 1 << k for k in range(lib.OC_REASON_COUNT)}


def dtype_of(kind: Any) -> np.dtype[Any]:
    """The NumPy dtype of a C type."""
    if kind.kind == "array":
        return np.dtype((dtype_of(kind.item), (kind.length,)))
    if kind.kind == "enum":
        return np.dtype(f"u{ffi.sizeof(kind)}")
    if kind.kind == "struct":
        return np.dtype(
            {
                "names": [name for name, _ in kind.fields],
                "formats": [dtype_of(field.type) for _, field in kind.fields],
                "offsets": [field.offset for _, field in kind.fields],
                "itemsize": ffi.sizeof(kind),
            }
        )
    return np.dtype(_NUMBERS[kind.cname])


OUTPUT_DTYPE = dtype_of(ffi.typeof("oc_output"))
TRUCK_DRIVE, TRUCK_PRIORS = dtype_of(ffi.typeof("truck_drive")), dtype_of(ffi.typeof("truck_priors"))
TRUCK_HISTORIES = dtype_of(ffi.typeof("truck_histories"))
_STATE_DTYPE = dtype_of(ffi.typeof("oc_state"))
_EQUATIONS_DTYPE = dtype_of(ffi.typeof("oc_equations"))


def _values(array: npt.NDArray[Any] | np.void) -> bytes:
    if array.dtype.names is None:
        return array.tobytes()
    return b"".join(_values(array[name]) for name in array.dtype.names)


def _members(struct: Any) -> dict[str, Any]:
    """A struct as a dict, including nested structs and arrays."""

    def plain(value: Any) -> Any:
        if not isinstance(value, ffi.CData):
            return value
        kind = ffi.typeof(value)
        if kind.kind == "array":
            return [plain(item) for item in value]
        return {name: plain(getattr(value, name)) for name, _ in kind.fields}

    return {name: plain(getattr(struct, name)) for name, _ in ffi.typeof(struct).item.fields}


def interval_95(value: Any, sd: Any, lean: Any) -> tuple[Any, Any]:
    """Low and high, of numbers or arrays. The interval is not centred on the estimate; `lean` is its shift."""
    middle, half_width = value + lean, 1.96 * np.sqrt(np.maximum(sd * sd - lean * lean, 0.0))
    return middle - half_width, middle + half_width


def status_of(estimate: OcEstimate) -> str:
    return STATUSES[estimate["status"]]


def ci95(estimate: OcEstimate) -> tuple[float, float]:
    """The 95 % interval of an oc_estimate."""
    low, high = interval_95(estimate["value"], estimate["standard_deviation"], estimate["lean"])
    return float(low), float(high)


def standing_yaw_rate_sd() -> float:
    """The standard deviation of the yaw rate bias from readings without scatter at standstill, rad/s."""
    still = ffi.new("oc_standstill *", {"yaw_rate": {"weight": 2.0}})
    return float(lib.oc_standstill_yaw_rate(still, 1.0, 0.0).standard_deviation)


def few_batches_factor(batches: int) -> float:
    """Factor of a 95 % interval for few batches: Student's over the normal quantile."""
    return float(lib.oc_few_batches_factor(float(batches)))


def default_params() -> dict[str, float]:
    """The core's params by name, without the methods. Each name ends in its unit; docs/params.md documents them."""
    params = ffi.new("oc_params *")
    lib.oc_params_defaults(params)
    return {name: value for name, value in _members(params).items() if name not in ("method", "angle_method")}


def bad_param(params: Mapping[str, float]) -> str | None:
    """Name of the first param out of its range, or None."""
    name = lib.oc_params_check(_params(params, METHODS[0]))
    return None if name == ffi.NULL else _text(name)


def bad_vehicle(
    wheelbase_m: float, steering_ratio: float, track_width_front_m: float = 0.0, track_width_rear_m: float = 0.0
) -> str | None:
    """Name of the first vehicle value out of its range, or None."""
    name = lib.oc_vehicle_check(_vehicle(wheelbase_m, steering_ratio, track_width_front_m, track_width_rear_m))
    return None if name == ffi.NULL else _text(name)


def _params(params: Mapping[str, float], method: str, angle_method: str = ANGLE_METHODS[0]) -> Any:
    native = ffi.new("oc_params *")
    lib.oc_params_defaults(native)
    native.method = METHODS.index(method)
    native.angle_method = ANGLE_METHODS.index(angle_method)
    for name, value in params.items():
        setattr(native, name, int(value) if name == "use_accelerometer" else value)
    return native


def _vehicle(
    wheelbase_m: float,
    steering_ratio: float,
    track_width_front_m: float,
    track_width_rear_m: float,
    traffic_side: float = 0.0,
    ratio_polynomial: Sequence[float] = (),
) -> Any:
    terms = list(ratio_polynomial)
    return ffi.new(
        "oc_vehicle *",
        {
            "wheelbase": wheelbase_m,
            "steering_ratio": steering_ratio,
            "track_width_front": track_width_front_m,
            "track_width_rear": track_width_rear_m,
            "traffic_side": traffic_side,
            "ratio": {"terms": len(terms), "coefficients": terms, "ratio": steering_ratio},
        },
    )


def front_wheel_angles(
    wheelbase_m: float, track_m: float, left: npt.NDArray[np.float64], right: npt.NDArray[np.float64], *, exact: bool
) -> npt.NDArray[np.float64]:
    """The front wheels' mean angle by their speeds, rad, left positive: by (2) solved for R, or by (3)."""
    of = lib.oc_front_wheel_exact if exact else lib.oc_wheel_speed_front_angle
    return np.array([of(wheelbase_m, track_m, v_l, v_r, 0.0) for v_l, v_r in zip(left, right, strict=True)])


def decoded_message(payload: bytes) -> dict[str, Any] | None:
    """The oc_message as a dict with `measured`, NaN where not available; None for an invalid payload."""
    message, measured = ffi.new("oc_message *"), ffi.new("double *")
    if len(payload) != lib.OC_MESSAGE_BYTES or not lib.oc_message_decode(message, ffi.from_buffer(payload)):
        return None
    available = lib.oc_message_measured(message, measured)
    return _members(message) | {"measured": measured[0] if available else float("nan")}


def decoded_message_parts(payload: bytes) -> dict[str, Any] | None:
    """The oc_message_parts as a dict, NaN where not available; None for an invalid payload."""
    if len(payload) != lib.OC_MESSAGE_BYTES:
        return None
    return _members(ffi.new("oc_message_parts *", lib.oc_message_parts_decode(ffi.from_buffer(payload))))


def _refusal(error: int, params: Mapping[str, float], rate_hz: float) -> str:
    """The error as text. A rate that is too low for the low-pass is refused, too."""
    if error == lib.OC_ERROR_RATE and RATE_MIN_HZ <= rate_hz <= RATE_MAX_HZ:
        cutoff_hz = params.get("cutoff_hz", default_params()["cutoff_hz"])
        return f"parameter 'cutoff_hz' must be below {0.45 * rate_hz:g} at a rate of {rate_hz:g} Hz, got {cutoff_hz:g}"
    return f"the core refuses the {_text(lib.oc_error_name(error))}"


def signals_of(bits: int) -> tuple[str, ...]:
    """The signals of these bits, by name."""
    return tuple(name for name, bit in SIGNAL_BITS.items() if bits & bit)


def reasons_of(bits: int) -> tuple[str, ...]:
    """The reasons of these bits, by name."""
    return tuple(name for name, bit in REASONS.items() if bits & bit)


def texts_of(codes: npt.NDArray[Any], text: Callable[[int], str]) -> npt.NDArray[np.object_]:
    """The text of each code of a column, which has few different ones."""
    different, rows = np.unique(codes, return_inverse=True)
    return np.array([text(int(code)) for code in different], object)[rows]


def solved_hypotheses(state: Any, design: Mapping[str, Any]) -> list[tuple[Any, Any, float]]:
    """The joint method's hypotheses that count, each solved, with its oc_equations and its noise, rad^2.

    Args:
        state: `Core.state()`.
        design: the members of an oc_hypothesis_design.
    """
    joint, prior = state["evidence"]["joint"], state["tracking"]["joint"]["prior"]
    hypotheses = joint["hypotheses"][: joint["count"]].copy()
    equations = np.zeros(len(hypotheses), _EQUATIONS_DTYPE)
    h = ffi.from_buffer("oc_hypothesis[]", hypotheses, require_writable=True)
    of_h = ffi.from_buffer("oc_equations[]", equations, require_writable=True)
    second = ffi.from_buffer("oc_second[]", joint["second"].tobytes())
    given = ffi.from_buffer("oc_prior[]", prior.tobytes()), second
    counted = [k for k in range(len(hypotheses)) if lib.oc_hypothesis_counts(h + k, second)]
    of_design = ffi.new("oc_hypothesis_design *", design)
    for k in counted:
        lib.oc_hypothesis_solve(h + k, of_design, *given, of_h + k)
    return [(hypotheses[k], equations[k], float(lib.oc_hypothesis_noise(h + k))) for k in counted]


def truck_histories(
    drives: npt.NDArray[np.void], counts: Sequence[int], priors: npt.NDArray[np.void]
) -> npt.NDArray[np.void]:
    """The histories of trucks after all their drives (src/oncenter/truck/native/truck_filter.h).

    Args:
        drives: dtype TRUCK_DRIVE, of one truck after the other, in order of time.
        counts: the number of drives of each truck.
        priors: dtype TRUCK_PRIORS, shape (trucks,).

    Returns: dtype TRUCK_HISTORIES, shape (trucks,).
    """
    assert drives.dtype == TRUCK_DRIVE and priors.dtype == TRUCK_PRIORS and len(priors) == len(counts)
    assert sum(counts) == len(drives)
    found = np.zeros(len(counts), TRUCK_HISTORIES)
    first = ffi.from_buffer("truck_drive[]", drives)
    of_truck = ffi.from_buffer("truck_priors[]", priors)
    target = ffi.from_buffer("truck_histories[]", found, require_writable=True)
    begin = 0
    for k, count in enumerate(counts):
        lib.truck_run(target + k, first + begin, count, of_truck + k)
        begin += count
    return found


def quantile(
    weights: npt.NDArray[np.float64], means: npt.NDArray[np.float64], sds: npt.NDArray[np.float64], share: float
) -> float:
    """The value below which a mixture of normal densities has this share; the weights sum to 1."""
    arrays = [np.ascontiguousarray(values, np.float64) for values in (weights, means, sds)]
    return float(lib.truck_quantile(*(ffi.from_buffer("double[]", values) for values in arrays), len(weights), share))


class Core:
    """Coefficients and state of one truck in native memory.

    Args:
        wheelbase_m: 1 to 20.
        steering_ratio: steering wheel angle per front wheel angle, 1 to 60.
        params: values that differ from `default_params`.
        rate_hz: ticks per second, 20 to 200.
        track_width_front_m, track_width_rear_m: 1 to 3; 0 where unknown.
        traffic_side: 1 right, -1 left, 0 unknown.
        ratio_polynomial: from steering wheel to front wheel angle, rad, lowest power first; none: a constant ratio.
        method: one of METHODS.
        angle_method: one of ANGLE_METHODS.

    Raises:
        ValueError: the core refuses the vehicle, the params or the rate; the text names it.
    """

    def __init__(
        self,
        wheelbase_m: float,
        steering_ratio: float,
        params: Mapping[str, float],
        rate_hz: float,
        *,
        track_width_front_m: float = 0.0,
        track_width_rear_m: float = 0.0,
        traffic_side: float = 0.0,
        ratio_polynomial: Sequence[float] = (),
        method: str = METHODS[0],
        angle_method: str = ANGLE_METHODS[0],
    ) -> None:
        self._coefficients = ffi.new("oc_coefficients *")
        self._state = ffi.new("oc_state *")
        vehicle = _vehicle(
            wheelbase_m, steering_ratio, track_width_front_m, track_width_rear_m, traffic_side, ratio_polynomial
        )
        error = lib.oc_setup(self._coefficients, vehicle, _params(params, method, angle_method), float(rate_hz))
        if error != lib.OC_OK:
            raise ValueError(_refusal(error, params, rate_hz))
        lib.oc_init(self._state)
        self._tick, self._output = ffi.new("oc_signals *"), ffi.new("oc_output *")  # of the last step

    def restart(self, elapsed_s: float = 0.0) -> None:
        """Ignition, or the next log, after `elapsed_s` seconds, 0 where unknown: filters are lost, evidence stays, less
        certain by what may have changed; time may start at any value."""
        lib.oc_restart(self._state, elapsed_s)

    def run(self, columns: Mapping[str, npt.NDArray[np.float64]], outputs: npt.NDArray[np.void] | None = None) -> None:
        """One step per row. `columns` by table name (COLUMNS), float64, shape (n,); an omitted one is missing.

        Fills `outputs`, dtype OUTPUT_DTYPE and shape (n,), if given. Releases the GIL.
        """
        kept = {COLUMNS[name]: np.ascontiguousarray(column, np.float64) for name, column in columns.items()}
        count = len(kept["time"])
        assert all(len(column) == count for column in kept.values())  # the core would read beyond a shorter one
        native = ffi.new("oc_columns *", {"count": count})
        for name, column in kept.items():
            setattr(native, name, ffi.from_buffer("double[]", column))
        target = ffi.NULL if outputs is None else ffi.from_buffer("oc_output[]", outputs, require_writable=True)
        lib.oc_run(self._state, self._coefficients, native, target)

    def smoothed(self, outputs: npt.NDArray[np.void]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Angle (rad) and rate (rad/s) of a run's outputs by a Kalman smoother, both of shape (n,)."""
        angles = outputs["angle"]
        smoothed = np.array(angles["angle"], np.float64)
        rate = np.zeros_like(smoothed)
        lib.oc_smooth_angle(
            ffi.from_buffer("double[]", smoothed, require_writable=True),
            ffi.from_buffer("double[]", rate, require_writable=True),
            ffi.from_buffer("double[]", np.ascontiguousarray(angles["standard_deviation"])),
            ffi.from_buffer("uint8_t[]", np.ascontiguousarray(angles["by_sensor"])),
            len(smoothed),
            self._coefficients.tick_s,
            ffi.from_buffer("double[]", np.ascontiguousarray(angles["delay"])),
        )
        return smoothed, rate

    def step(self, tick: Mapping[str, float]) -> OcOutput:
        """One tick by table name (COLUMNS), NaN or omitted: not available."""
        native = ffi.new("oc_signals *")
        for name, value in tick.items():
            member = COLUMNS[name]
            setattr(native, member, value)
            native.valid |= 0 if value != value else _VALID_BITS.get(member, 0)
        lib.oc_step(self._state, self._coefficients, native, self._output)
        self._tick = native
        return cast("OcOutput", _members(self._output))

    def message(self, counter: int) -> bytes:
        """The result message's payload after the last `step`."""
        message = ffi.new("oc_message *", lib.oc_message_of(self._output, self._tick, counter))
        payload = bytearray(lib.OC_MESSAGE_BYTES)
        lib.oc_message_encode(message, ffi.from_buffer(payload))
        return bytes(payload)

    def message_parts(self, counter: int) -> bytes:
        """The payload of the result's second frame after the last `step`."""
        parts = ffi.new("oc_message_parts *", lib.oc_message_parts_of(self._output, counter))
        payload = bytearray(lib.OC_MESSAGE_BYTES)
        lib.oc_message_parts_encode(parts, ffi.from_buffer(payload))
        return bytes(payload)

    def answer(self) -> OcAnswer:
        native = ffi.new("oc_answer *")
        lib.oc_answer_get(self._state, self._coefficients, native)
        return cast("OcAnswer", _members(native))

    def answer_by(self, other: Core) -> OcAnswer:
        """The answer on this core's evidence by the priors of another core of the same truck, whose state is lost."""
        native = ffi.new("oc_answer *")
        other.copy_state_from(self)
        lib.oc_answer_by_priors(other._state, other._coefficients, native)
        return cast("OcAnswer", _members(native))

    def teach(self, estimates: Mapping[str, tuple[float, float]], truck: Mapping[str, float]) -> None:
        """Sets what a drive without its angle sensor never replaces.

        Args:
            estimates: value and standard deviation by member of oc_learned.
            truck: by member of oc_angle_truck.
        """
        learned = self._state.learned
        for name, (value, sd) in estimates.items():
            setattr(learned, name, {"value": value, "standard_deviation": sd, "evidence": 1.0, "status": lib.OC_VALID})
        for name, value in truck.items():
            setattr(learned.truck, name, value)

    def coefficients(self) -> dict[str, Any]:
        """The oc_coefficients as a dict, for checks of the design."""
        return _members(self._coefficients)

    def state(self) -> Any:
        """A copy of the oc_state; members by name."""
        return np.frombuffer(bytes(ffi.buffer(self._state)), _STATE_DTYPE)[0]

    def state_bytes(self) -> bytes:
        """The state's values without padding, to compare two runs on this machine."""
        return _values(self.state())

    def save(self, sequence: int) -> bytes:
        """The state as an image; `sequence`, 32 bits: the larger one of two images is newer."""
        image = bytearray(lib.oc_save_size())
        lib.oc_save(self._state, self._coefficients, sequence, ffi.from_buffer(image), len(image))
        return bytes(image)

    def restore(self, image: bytes) -> tuple[str, int]:
        """One of IMAGE_FAULTS, and the image's sequence. Unless "ok", the state is the initial one."""
        sequence = ffi.new("uint32_t *")
        fault = lib.oc_restore(self._state, self._coefficients, ffi.from_buffer(image), len(image), sequence)
        return IMAGE_FAULTS[fault], sequence[0]

    def copy_state_from(self, other: Core) -> None:
        ffi.buffer(self._state)[:] = ffi.buffer(other._state)[:]
