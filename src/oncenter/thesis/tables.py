"""Tables 1 to 4 beside the values of this code."""

from __future__ import annotations

import numpy as np

import oncenter as oc
from oncenter import _core
from oncenter.signals import DEGREE, SIGNALS, STANDARD_GRAVITY
from oncenter.thesis.drives import simulated
from oncenter.thesis.figure import Claim, Exhibit, Misprint, Progress, Table


def run(progress: Progress) -> list[Exhibit]:
    """The sensors of a simulated drive, the truck's file, the signals, the core's defaults."""
    sensors = _sensors()
    progress(0.9)
    return [sensors, _truck(), _symbols(), _thresholds()]


def _sensors() -> Table:
    signals, truth = simulated("thesis_drive")
    rows, claims = [], []
    for name, column, factor, unit, resolution, most, offset in (
        ("SAS", "steering_wheel_angle_rad", DEGREE, "deg", 0.1, 1500.0, 2.5),
        ("yaw rate sensor", "yaw_rate_rad_s", DEGREE, "deg/s", 0.1, 100.0, 3.0),
        ("accelerometer", "lateral_acceleration_m_s2", STANDARD_GRAVITY, "g", 0.01, 2.0, 0.1),
    ):
        read = signals.columns[column] / factor
        true = truth.table[column if "lateral" not in column else "felt_lateral_acceleration_m_s2"].to_numpy() / factor
        step = float(np.median(np.diff(np.unique(np.round(read, 9)))))
        off = float(np.mean(read - true))
        rows.append(
            (
                name,
                f"{resolution:g} {unit}",
                f"{step:.3g} {unit}",
                f"{most:g} {unit}",
                f"< {offset:g} {unit}",
                f"{off:.2g} {unit}",
            )
        )
        claims.append(
            Claim("Table 1", f"resolution of the {name}", resolution, step, unit, "the simulated drive's steps")
        )
        claims.append(
            Claim(
                "Table 1",
                f"largest offset of the {name}",
                offset,
                abs(off),
                unit,
                "mean of measured minus true in that drive",
            )
        )
    claims += [
        Claim("5.5.3", "0.1 g of Table 1 as a bias", 1.0, 0.1 * STANDARD_GRAVITY, "m/s²", "the thesis rounds"),
        Claim("5.5.3", "2.5's 0.03 g/min as a drift", 0.3, 0.03 * STANDARD_GRAVITY, "m/s²/min", "the thesis rounds"),
    ]
    return Table(
        "1",
        "Sensors",
        ("sensor", "resolution", "simulated", "range", "offset", "simulated"),
        tuple(rows),
        "As printed, and as read from a simulated thesis drive. There the angle's offset is the mounting's, which "
        "Table 1 "
        "does not mean.",
        tuple(claims),
    )


def _truck() -> Table:
    truck = oc.vehicle("scania_r730_4x2")
    sources = truck.source
    rows = (
        ("Model", "R730 LA4x2MNA", truck.name, sources["name"]),
        ("Wheelbase", "3.700 m", f"{truck.wheelbase_m:.3f} m", sources["wheelbase_m"]),
        ("Steering gear ratio (near center)", "19.3", f"{truck.ratio_near_centre:g}", sources["steering_ratio"]),
        ("Wheel configuration", "4x2", str(truck.axle_layout), sources["axle_layout"]),
        ("Front track", "", f"{truck.track_width_front_m:g} m", sources["track_width_front_m"]),
        ("Rear track", "", f"{truck.track_width_rear_m:g} m", sources["track_width_rear_m"]),
    )
    return Table(
        "2",
        "The truck",
        ("what", "thesis", "vehicles/scania_r730_4x2.toml", "source"),
        rows,
        "The thesis's tractor as this code's vehicle file has it.",
        (
            Claim("Table 2", "wheelbase", 3.7, truck.wheelbase_m, "m", "the vehicle file"),
            Claim(
                "Table 2", "steering gear ratio near the centre", 19.3, truck.ratio_near_centre, "", "the vehicle file"
            ),
        ),
    )


def _symbols() -> Table:
    """Table 3's symbols by their names in this code."""
    symbols = {signal.symbol: signal.column for signal in SIGNALS.values() if signal.symbol}
    motion = set(_core.OUTPUT_DTYPE["motion"].names or ())
    outputs = set(_core.OUTPUT_DTYPE.names or ())
    rows = [
        ("r", "Yaw rate", "Measured", symbols["r"]),
        ("v_x", "Longitudinal speed", "Measured", symbols["v_x"]),
        ("δ", "Steering wheel angle", "Measured", symbols["delta_m"]),
        ("a_y", "Lateral acceleration", "Measured", symbols["a_y"]),
        ("L", "Vehicle wheelbase", "Supplied parameter", "wheelbase_m"),
        ("i_gear", "Overall steering gear ratio", "Supplied parameter", "steering_ratio"),
    ]
    for symbol, text, name in (
        ("â_g", "Component of gravity across", "bank"),
        ("v̇_x (dot missing)", "Longitudinal acceleration", "longitudinal_acceleration"),
        ("1/R", "Inverse turn radius", "curvature"),
        ("δ̂", "Steering wheel angle by (37)", "residual"),
        ("δ̂_o", "Offset", "offset"),
    ):
        place = "motion." + name if name in motion else name
        assert name in motion | outputs, f"the core no longer has {name}"
        rows.append((symbol, text, "Estimated", place if symbol != "δ̂" else f"{place}, which is δ minus it"))
    return Table(
        "3",
        "Signals, parameters and estimates",
        ("symbol", "description", "type", "in this code"),
        tuple(rows),
        "Table 3 with the name that each has here: a signals table's column, a vehicle file's key, or a member of "
        "oc_output.",
        misprints=(
            Misprint(
                "Table 3",
                "longitudinal acceleration v̂_x",
                "with a dot: v_x would be the speed, which the table has already",
                f"by reading: the symbol stands twice, for {symbols['v_x']} and for its slope",
                True,
            ),
            *_of_the_text(),
        ),
    )


def _of_the_text() -> tuple[Misprint, ...]:
    """Misprints that need no computation."""
    return (
        Misprint(
            "1.2",
            "chapter 3 is on real-time estimation and chapter 4 on the offset",
            "chapters 4 and 5",
            "by reading: the table of contents has the validation data as chapter 3",
            True,
        ),
        Misprint(
            "5.3.1",
            "the method of Gustafsson et al. [15]",
            "which work it is",
            "by reading: the references end at [14]",
            True,
        ),
    )


def _thresholds() -> Table:
    known = _core.default_params()
    rows, claims = [], []
    for symbol, name, printed, unit in (
        ("1/R_max", "curvature_max_1_m", 1.0 / 800.0, "1/m"),
        ("v̇_x,max", "longitudinal_acceleration_max_m_s2", 0.3, "m/s²"),
        ("a_y,max", "bank_max_m_s2", 0.3, "m/s²"),
        ("t_1", "clean_time_s", 2.0, "s"),
    ):
        rows.append((symbol, f"{printed:g} {unit}", f"{known[name]:g} {unit}", name))
        claims.append(Claim("Table 4", f"{symbol}, {name}", printed, known[name], unit, "the core's default"))
    claims.append(Claim("5.1", "minimum speed", 10.0, known["speed_min_m_s"], "m/s", "the core's default"))
    claims.append(
        Claim(
            "5.1.3",
            "largest lateral acceleration from which K_us is learned",
            1.5,
            known["understeer_acceleration_max_m_s2"],
            "m/s²",
            "the core's default",
        )
    )
    claims.append(
        Claim(
            "5.5.1",
            "sufficient time of active estimation",
            20.0,
            known["offset_evidence_min_s"],
            "s",
            "the core's default",
        )
    )
    way_m = 15.0 * known["offset_evidence_min_s"]
    claims.append(Claim("5.5.1", "distance of that at 15 m/s", 300.0, way_m, "m", "the core's default times 15 m/s"))
    return Table(
        "4",
        "Thresholds",
        ("symbol", "thesis", "the core's default", "parameter"),
        tuple(rows),
        "The gate of (34) and (35) as printed and as core/truck/params.c has it for the thesis's method.",
        tuple(claims),
        (
            Misprint(
                "5.5.2",
                "the parameters listed in Fig. 4",
                "in Tab. 4",
                f"by reading: Figure 4 is the single-track model, and Table 4 has {len(rows)} parameters",
                True,
            ),
        ),
    )
