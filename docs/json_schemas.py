"""The JSON objects that oncenter prints, field by field: type, unit, meaning. docs/make_reference.py writes them.

A new field of an answer gets one line here; a field that may be left out is named in `optional`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from oncenter.fleet.news import KINDS
from oncenter.fleet.tables import TRUCKS
from oncenter.verdict.states import OF_OFFSET, STATES

Schema = dict[str, Any]
STATUSES = ("valid", "converging", "unobservable", "invalid")
_ROOT = "https://json-schema.org/draft/2020-12/schema"


def text(about: str, *, choices: Sequence[str] = (), null: bool = False) -> Schema:
    schema = _typed("string", about, null=null)
    return {**schema, "enum": [*choices, *([None] if null else [])]} if choices else schema


def number(unit: str, about: str, *, null: bool = False, kind: str = "number") -> Schema:
    """`unit` is "" where the number has none."""
    return {**_typed(kind, about, null=null), **({"unit": unit} if unit else {})}


def count(about: str) -> Schema:
    return {**number("", about, kind="integer"), "minimum": 0}


def interval(unit: str, about: str) -> Schema:
    items = {"type": "number", "unit": unit} if unit else {"type": "number"}
    return {**_typed("array", about, null=True), "items": items, "minItems": 2, "maxItems": 2}


def rows(about: str, items: Schema) -> Schema:
    return {**_typed("array", about), "items": items}


def lines(about: str) -> Schema:
    return rows(about, {"type": "string"})


def object_of(about: str, fields: Mapping[str, Schema], *, optional: Sequence[str] = (), null: bool = False) -> Schema:
    """An object with these fields and no others."""
    return {
        **_typed("object", about, null=null),
        "properties": dict(fields),
        "required": [name for name in fields if name not in optional],
        "additionalProperties": False,
    }


def by_name(about: str, each: Schema) -> Schema:
    """An object whose keys are names."""
    return {**_typed("object", about), "additionalProperties": each}


def _typed(kind: str, about: str, *, null: bool = False) -> Schema:
    return {"type": [kind, "null"] if null else kind, "description": about}


def quantity(unit: str, about: str, **more: Schema) -> Schema:
    """An estimated quantity."""
    return object_of(
        about,
        {
            "value": number(unit, "The estimate; null if there is none.", null=True),
            "unit": text("Unit of value and interval.", choices=[unit]),
            "ci95": interval(unit, "95 % interval [low, high]. It need not be centred on the value."),
            "status": text(
                "valid: usable. converging: more driving is needed. unobservable: not identifiable from this drive. "
                "invalid: a signal is at fault, and the value is from before the fault.",
                choices=STATUSES,
            ),
            **more,
        },
    )


def measured(unit: str, about: str, *, null: bool = False) -> Schema:
    """A value with its unit."""
    fields = {"value": number(unit, "The value.", null=null), "unit": text("Its unit.", choices=[unit])}
    return object_of(about, fields)


_SCHEMA_OF = "Name and version of this schema."
_VERSION = text("Version of oncenter.")
_NOTES = lines("Remarks for people on choices made while reading and estimating.")
FINDING = object_of(
    "An observation about the drive or the truck.",
    {
        "code": text("Stable name; docs/reference/findings.md lists the codes."),
        "severity": text(
            "error: an answer is missing or wrong without action. warning: look at it. info: for completeness.",
            choices=("error", "warning", "info"),
        ),
        "text": text("What was observed, what it means, and what to do. For people: the words may change."),
        "value": number("", "The observed number, in the unit of `unit`; null if there is none.", null=True),
        "unit": text("Unit of the value.", null=True),
    },
)
_CHANGE = object_of(
    "A change during the drive.",
    {
        "kind": text(
            "offset: the angle sensor reads differently at all times. straight_ahead: the same, but load, ride height "
            "or wind may be the cause. bends: bends need another angle than before, straights the same.",
            choices=("offset", "straight_ahead", "bends"),
        ),
        "log": text("The log in which it happened."),
        "time_s": number("s", "Time of the change on the clock of the log."),
        "into_log_s": number("s", "Time of the change since the begin of the log."),
        "value": number("deg", "Size of the change of the offset; null for the kind bends.", null=True),
        "ci95": interval("deg", "95 % interval of the size."),
        "unit": text("Unit of the angles.", choices=["deg"]),
        "offset_before": number("deg", "Offset before the change."),
        "offset_after": number("deg", "Offset after the change: at the next change, or at the end.", null=True),
    },
)
_CAUSE = object_of(
    "A cause of a wider interval that no single drive identifies.",
    {
        "cause": text("Its name.", choices=("pull", "mean_wind", "axle_set_up", "axle_layout")),
        "sd_m_s2": number("m/s^2", "Standard deviation of the lateral acceleration that it makes."),
        "sd_deg": number("deg", "Standard deviation of the offset that follows."),
        "prior": object_of(
            "Assumption before any drive.",
            {
                "sd_m_s2": number("m/s^2", "Standard deviation."),
                "source": text("Where the assumption is from."),
            },
        ),
    },
)
_VERDICT = object_of(
    "A verdict for a workshop.",
    {
        "about": text("The part: offset, angle sensor, free play, yaw rate sensor or accelerometer."),
        "state": text("Code of the verdict.", choices=list(STATES)),
        "word": text("Word of the verdict, one for each code."),
        "headline": text("The verdict as a sentence."),
        "action": text("What to do, as a sentence; empty if nothing."),
        "note": text("A remark; empty if there is none."),
    },
    optional=("note", "word"),
)
_DRIVE = {
    "log": text("Its log."),
    "start_time": text("Its start, UTC, 2026-03-02T07:00:00Z; null without one.", null=True),
    "duration_s": number("s", "Its length."),
    "fingerprint": text("Of the signals: a copy or a part of the drive in another log has the same hashes."),
}


_BY_PRIOR_TIMES = {
    "value_deg": number("deg", "The offset."),
    "ci95_drive": interval("deg", "The part of the interval that this drive, or these drives, decide."),
    "ci95": interval("deg", "The whole interval."),
}
_BY_PRIOR = object_of(
    "The offset by another prior: the same evidence, its equations solved anew.",
    {
        "prior": text("Its name.", choices=("pull", "mean_wind", "axle_set_up", "accelerometer_zero")),
        "param": text("Its parameter, see params."),
        "size": number("m/s^2 or 1", "The value in force, a standard deviation; of axle_set_up a probability."),
        "halved": object_of("By half of it.", _BY_PRIOR_TIMES),
        "doubled": object_of("By twice of it.", _BY_PRIOR_TIMES),
    },
)
_REASONS = by_name("By reason, the number that was left out.", {"type": "integer", "minimum": 0})
_SIGNAL_ACCOUNT = object_of(
    "in_file = used + superseded + left_out; ticks = fresh + held + missing.",
    {
        "in_file": count("Samples in the file; of a table its cells with a number."),
        "used": count("Samples that decide at least one tick."),
        "superseded": count("Samples with a newer one before the next tick."),
        "left_out": _REASONS,
        "ticks": count("Ticks of the common rate."),
        "fresh": count("Ticks whose nearest sample is not that of the tick before."),
        "held": count("Ticks with a value, whose nearest sample is that of the tick before."),
        "missing": count("Ticks without a value."),
        "outside_range": count("Samples that are used although they are outside the range of the database."),
    },
)
_ACCOUNT = {
    "unit": text("What is counted of the file.", choices=("frames", "rows", "samples")),
    "in_file": count("Number in the file; in_file = used + left_out."),
    "used": count("Number that was used."),
    "left_out": _REASONS,
    "signals": by_name("By name of the signal.", _SIGNAL_ACCOUNT),
}
_LOG = object_of("A log.", {"log": text("The log."), **_ACCOUNT})


def _offset(schema: str) -> Schema:
    is_first = schema == "offset-1"
    parts = {
        "applied_deg": number("deg", "Correction that the ECU adds to the sensor's reading already, as given."),
        "ci95_drive": interval("deg", "The part of the interval that this drive, or these drives, decide."),
        "not_identifiable": rows("The causes of the other part of the interval.", _CAUSE),
        "by_priors": rows("How far the offset depends on each prior; of the joint method.", _BY_PRIOR),
    }
    correction = object_of(
        "What the ECU must add to the sensor's reading; the values are null unless the offset is valid.",
        {
            "remaining_deg": number("deg", "In addition to the correction that is applied already.", null=True),
            "total_deg": number("deg", "In total.", null=True),
        },
    )
    variance = number(
        "deg^2", "Variance by (43) if all samples were independent; of the thesis method, else null.", null=True
    )
    verdicts = {
        "limit_deg": number("deg", "An offset of this size or more, either sign, needs a recalibration."),
        "verdicts": rows("What to do, the offset first.", _VERDICT),
        "vin": text("Of the truck, where a log has it.", null=True),
        "start_time": text("Start of the first drive, UTC, 2026-03-02T07:00:00Z; null without one.", null=True),
        "drives": rows("The drives of the answer.", object_of("A drive.", _DRIVE)),
    }
    at_steering_wheel = {
        "assumed": lines("wheelbase_m and steering_ratio, where the vehicle file does not give them."),
        "ratio_times_wheelbase": quantity("m", "Steering ratio times wheelbase that fits the bends."),
        "understeer_at_steering_wheel": quantity("deg/(m/s^2)", "Steering wheel angle per lateral acceleration."),
    }
    both_axles = {
        "combined_offset": quantity(
            "deg", "Of a truck whose rear axle steers: front offset less ratio times weight times the rear axle's."
        ),
        "rear_axle_offset": quantity("deg", "Of that axle's sensor, road wheel angle."),
    }
    traffic_side = object_of(
        "Side of the road on which the truck is driven.",
        {
            "side": text("Null where it is unknown.", choices=("right", "left"), null=True),
            "by": text("Source of the side.", choices=("vehicle file", "position", "former drives"), null=True),
        },
    )
    fields = {
        "schema": text(_SCHEMA_OF, choices=[f"oncenter/{schema}"]),
        "version": _VERSION,
        "log": text("The log; several are joined by commas."),
        "vehicle": text("Name of the truck."),
        **({} if is_first else {"traffic_side": traffic_side}),
        "method": text("Method of the estimate.", choices=("joint", "thesis", "wheel-speed")),
        "params": by_name("Parameters that were used, by name; docs/params.md has units.", {"type": "number"}),
        "signals": by_name("By signal, its source in the log.", {"type": "string"}),
        "offset": quantity(
            "deg",
            "Straight-ahead offset: reading of the angle sensor at zero lateral force and mid-play; left is positive.",
            variance_if_independent_deg2=variance,
            **({} if is_first else parts),
        ),
        **({} if is_first else both_axles),
        **({} if is_first else {"correction": correction, **verdicts}),
        "understeer_gradient": quantity("deg/(m/s^2)", "Front wheel angle per lateral acceleration."),
        "backlash": quantity("deg", "Free play of the steering at the steering wheel, full width."),
        "unloading_acceleration": quantity("m/s^2", "Neutral lateral acceleration, as measured: no lateral force."),
        "equivalent_wheelbase": quantity("m", "Wheelbase that fits the bends; a wrong steering ratio changes it, too."),
        **({} if is_first else at_steering_wheel),
        "yaw_rate_bias": quantity("deg/s", "Reading of the yaw rate sensor at zero yaw rate."),
        "lateral_acceleration_bias": quantity("m/s^2", "Reading of the accelerometer on level ground."),
        "wheel_radius_mismatch_rear": quantity("1", "Left over right rolling radius of the rear wheels, minus one."),
        "wheel_radius_mismatch_front": quantity("1", "Left over right rolling radius of the front wheels, minus one."),
        "changes": rows("Changes during the drive, the first one first.", _CHANGE),
        "time": object_of(
            "Use of the drive.",
            {
                "duration_s": number("s", "Duration of the drive."),
                "used_s": number("s", "Time that the estimate uses."),
                "unused_s": number("s", "The rest."),
                "rejected_s": by_name(
                    "By reason, the time that the gate rejected; the reasons overlap.", {"type": "number", "unit": "s"}
                ),
            },
        ),
        "findings": rows("Findings, large losses of values first, then errors.", FINDING),
        "notes": _NOTES,
        **({} if is_first else {"accounts": rows("For each log that was read, what became of its values.", _LOG)}),
    }
    return object_of(
        f"Answer of `oncenter offset --json --schema {schema}`.",
        fields,
        optional=(*verdicts, *both_axles, *at_steering_wheel, "accounts"),
    )


def _error() -> Schema:
    return object_of(
        "An error, printed by every command with --json in place of its answer.",
        {
            "schema": text(_SCHEMA_OF, choices=["oncenter/error-1"]),
            "log": text("The log that has no answer; with `oncenter offset --each` only."),
            "code": text("Stable name of the error, such as missing_signal, vehicle_file or usage."),
            "message": text("One line for people."),
            "needs": lines("Names of signals, columns or parameters that are missing."),
        },
        optional=("log",),
    )


def _offsets() -> Schema:
    return object_of(
        "Answers of `oncenter offset --each --json`.",
        {
            "schema": text(_SCHEMA_OF, choices=["oncenter/offsets-1"]),
            "version": _VERSION,
            "answers": rows(
                "For each log its answer, as offset-2 or offset-1, or its error, as error-1.",
                {"anyOf": [{"$ref": f"{name}.schema.json"} for name in ("offset-2", "offset-1", "error-1")]},
            ),
            "notes": lines("Remarks on files that were skipped."),
        },
    )


def _signals() -> Schema:
    row = object_of(
        "A signal of the log.",
        {
            "source": text("Sender, column or channel."),
            "rate_hz": number("Hz", "Median rate of its messages."),
            "samples": count("Number of samples."),
            "not_available": count("Samples that are marked as not available."),
            "ticks_without": count("Ticks of the common rate without a number."),
            "min": number("", "Smallest value in `unit`.", null=True),
            "max": number("", "Largest value in `unit`.", null=True),
            "unit": text("Unit of min and max."),
            "others": lines("Senders that have the signal, too, and were not taken."),
        },
    )
    not_checked = {"check": text("Name of the check."), "why": text("Why it was not possible.")}
    return object_of(
        "Answer of `oncenter signals --json`.",
        {
            "schema": text(_SCHEMA_OF, choices=["oncenter/signals-1"]),
            "version": _VERSION,
            "log": text("The log."),
            "rate_hz": number("Hz", "Common rate of all signals."),
            "duration_s": number("s", "Time from the first to the last tick."),
            "recorded_s": number("s", "The same without holes in the recording."),
            "holes": count("Number of holes in the recording."),
            "signals": by_name("By name of the signal.", row),
            "account": object_of("What became of the values in the log.", _ACCOUNT, null=True),
            "findings": rows("Signals that contradict each other, errors first.", FINDING),
            "cannot_tell": rows("Checks that were not possible.", object_of("A check.", not_checked)),
            "notes": _NOTES,
        },
    )


def _reference() -> Schema:
    one_pass = object_of(
        "One pass over the straight.",
        {
            "begin_s": number("s", "Begin since the first tick of the log."),
            "duration_s": number("s", "Duration."),
            "mean_speed_m_s": number("m/s", "Mean speed."),
            "mean_deg": number("deg", "Mean steering wheel angle."),
        },
    )
    way = object_of(
        "One direction of the straight.",
        {
            "heading_deg": number("deg", "Heading, clockwise from north."),
            "compass": text("The same in words."),
            "mean": measured("deg", "Mean steering wheel angle."),
            "standard_deviation": measured("deg", "Standard deviation between the places of the straight."),
            "lateral_acceleration": measured("m/s^2", "Mean lateral acceleration, as measured.", null=True),
            "passes": rows("The passes in this direction.", one_pass),
        },
    )
    return object_of(
        "Answer of `oncenter reference --json`.",
        {
            "schema": text(_SCHEMA_OF, choices=["oncenter/reference-1"]),
            "version": _VERSION,
            "log": text("The log."),
            "offset": quantity(
                "deg",
                "Straight-ahead offset: the midpoint of both directions.",
                standard_deviation=number("deg", "Its standard deviation."),
            ),
            "place_standard_deviation": measured("deg", "Standard deviation between the places of the straight."),
            "ways": rows("Both directions.", way),
            "straight": object_of(
                "The straight.",
                {
                    "length_m": number("m", "Length."),
                    "residual_sd_m": number("m", "Standard deviation of the positions from its line."),
                    "ways_apart_m": number("m", "Distance between the lines of both directions."),
                },
            ),
            "notes": _NOTES,
        },
    )


def _budget() -> Schema:
    error = {"value": number("", "The value."), "unit": text("Its unit.")}
    contribution = object_of(
        "One error and its effect.",
        {
            "size": object_of("Size of the error.", error),
            "sensor": text("The sensor that has it; null if it is not of a sensor.", null=True),
            "as_printed": measured("deg", "Effect on the offset by the equations as the thesis prints them."),
            "as_corrected": measured("deg", "Effect on the offset by the corrected equations."),
            "enough": object_of("Size at which the sensor is good enough.", error, null=True),
        },
    )
    return object_of(
        "Answer of `oncenter budget --json`.",
        {
            "schema": text(_SCHEMA_OF, choices=["oncenter/budget-1"]),
            "version": _VERSION,
            "vehicle": text("Name of the truck."),
            "mean_speed": measured("km/h", "Mean speed of the drives."),
            "understeer_gradient": measured("deg/(m/s^2)", "Understeer gradient that is assumed."),
            "contributions": by_name("By name of the error.", contribution),
            "total_as_printed": measured("deg", "Root of the sum of squares, equations as printed."),
            "total_as_corrected": measured("deg", "Root of the sum of squares, equations corrected."),
            "total_without_accelerometer": measured("deg", "The same with yaw rate times speed for the accelerometer."),
            "next_sensor": text("The sensor to improve first; null if none is worth it.", null=True),
            "advice": lines("What to do, for people."),
            "notes": _NOTES,
        },
    )


def _compare() -> Schema:
    offset = object_of(
        "One of the two offsets.",
        {
            "log": text("Its log, or its file."),
            "vehicle": text("Name of the truck."),
            "value": number("deg", "Straight-ahead offset; null if there is none.", null=True),
            "unit": text("Unit of value and interval.", choices=["deg"]),
            "ci95_drive": interval("deg", "The part of its interval that its drive decides."),
            "status": text("Its status, as in offset-2.", choices=STATUSES),
            "verdict": text("Code of its verdict, with the limit of the comparison.", choices=list(OF_OFFSET)),
        },
        optional=("verdict",),
    )
    change = {
        "value": number("deg", "Offset after minus offset before; null if one of them is missing.", null=True),
        "unit": text("Unit of value and interval.", choices=["deg"]),
        "ci95": interval("deg", "95 % interval of the change."),
    }
    return object_of(
        "Answer of `oncenter compare --json`.",
        {
            "schema": text(_SCHEMA_OF, choices=["oncenter/compare-1"]),
            "state": text("Result of the calibration or repair as one word."),
            "headline": text("The result as a sentence."),
            "action": text("What to do, as a sentence; empty if nothing."),
            "order": text("By the start times, or as the user gave it.", choices=("date", "given")),
            "limit_deg": number("deg", "An offset of this size or more, either sign, needs a recalibration."),
            "change": object_of("Change of the offset.", change),
            "cancelled_half_width_deg": number(
                "deg", "Half-width that pull and biases add to both offsets; it cancels in the change."
            ),
            "before": offset,
            "after": offset,
        },
    )


def _query() -> Schema:
    row = {"type": "object", "description": "A row by column; docs/fleet.md lists the columns of the tables."}
    return object_of(
        "Answer of `oncenter fleet query --json`.",
        {"schema": text(_SCHEMA_OF, choices=["oncenter/query-1"]), "rows": rows("Rows of the result.", row)},
    )


_KINDS = {"text": "string", "number": "number", "count": "integer", "truth": "boolean", "time": "number"}


def _fleet() -> Schema:
    truck = {
        name: {**_typed(_KINDS[kind], f"{about}.", null=True), **({"unit": "s since 1970"} if kind == "time" else {})}
        for name, (kind, about) in TRUCKS.items()
    }
    counts = {"type": "integer", "minimum": 0}
    unread = {
        "log": text("The log."),
        "truck": text("Its truck; empty if it is not named."),
        "error_code": text("The reason as a code."),
        "error": text("The reason as a sentence."),
    }
    changed = {"truck": text("The truck."), "before": text("Code of its verdict."), "now": text("Code now.")}
    new = {
        "is_first_night": {"type": "boolean", "description": "No night before it ended: everything is new."},
        "calibrate": lines("Trucks that are to be calibrated, and were not: verdict recalibrate without watch."),
        "fault": lines("Trucks with a signal or sensor at fault, and no such fault before."),
        "verdicts": rows("Changed verdicts.", object_of("A truck.", changed)),
        "trucks": lines("Trucks that are new."),
        "unread": lines("Logs without an answer that had none of this reason before."),
    }
    found = {"count": count("Trucks or logs that have it."), "names": lines("The first 1,000 of them.")}
    of_truck = {"log": text("The log."), "truck": text("Its truck.")}
    twice = {
        "log": text("The first of its logs by name."),
        "trucks": lines("Its trucks."),
        "logs": rows("A log of each of them.", object_of("A log.", of_truck)),
    }
    poisonous = by_name("A log at which a reader crashed or was stopped.", {"type": "string"})
    return object_of(
        "Answer of `oncenter fleet run --json`, which is also the file metrics.json.",
        {
            "version": _VERSION,
            "output": text("Folder of tables and page."),
            "limit_deg": number("deg", "Offset from which on a truck needs a recalibration.", null=True),
            "logs_found": count("Logs found."),
            "logs_answered": count("Logs answered in this run."),
            "logs_refused": count("Logs without an answer in this run."),
            "logs_copied": count("Logs copied, moved or renamed, whose answers stand."),
            "seconds": number("s", "Duration of the run."),
            "logs_per_second": number("1/s", "Rate while logs were answered."),
            "peak_memory_mb": number("MB", "Memory of the largest process; null on Windows.", null=True),
            "drives": count("Drives in the tables."),
            "copies": count("Of them copies or parts of another drive, which do not count."),
            "refused": by_name("By error code, the number of logs without an answer.", counts),
            "unread": rows("The first 1,000 logs without an answer.", object_of("A log.", unread)),
            "poisonous": rows("Logs that are skipped.", poisonous),
            "new": object_of("What differs from the last night.", new),
            "kinds": object_of("By kind of --fail-on.", {kind: object_of("A kind.", found) for kind in KINDS}),
            "damaged": lines("What of the ledger was damaged and set apart in this run."),
            "in_two_trucks": rows("Logs that count for several trucks.", object_of("A log.", twice)),
            "gone": rows(
                "The first 1,000 drives that count no longer: logs were removed.", object_of("A log.", of_truck)
            ),
            "events": count("Events of the trucks that a person stated."),
            "trucks": count("Trucks in the tables."),
            "changes_of_offset": count("Changes of an offset."),
            "verdicts": by_name("By code of the verdict, the number of trucks.", counts),
            "states": by_name("The same; kept until the next release.", counts),
            "worst": rows("The first ten trucks of the ranking.", object_of("A truck.", truck)),
        },
        optional=("states",),
    )


def schemas() -> dict[str, Schema]:
    """All schemas by name, in the order of the page."""
    made = {
        "offset-2": _offset("offset-2"),
        "offset-1": _offset("offset-1"),
        "offsets-1": _offsets(),
        "error-1": _error(),
        "signals-1": _signals(),
        "reference-1": _reference(),
        "budget-1": _budget(),
        "compare-1": _compare(),
        "fleet-run": _fleet(),
        "query-1": _query(),
    }
    return {name: {"$schema": _ROOT, "title": f"oncenter/{name}", **schema} for name, schema in made.items()}
