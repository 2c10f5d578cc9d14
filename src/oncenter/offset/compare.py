"""Two offsets of one truck, before and after a calibration or a repair: was it successful, by how much, how sure.

Most causes that one drive cannot identify are the same before and after. A pull, an accelerometer bias and the axle's
set-up add (offset per lateral acceleration) * cause to both offsets, so the difference holds only the part by which
that factor differs, for example because the load does. The mean crosswind differs from drive to drive and stays in the
interval. bench/compare.py shows the coverage. Degrees here: comparisons are for people and files.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, NoReturn, cast

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.estimates.by_priors import INSIDE_DRIVE
from oncenter.files.file_name import printable
from oncenter.files.regular_file import read_regular_file
from oncenter.offset.answer import SCHEMAS, Answer
from oncenter.truck.fingerprint import Print
from oncenter.truck.zero import Zero
from oncenter.utc import iso
from oncenter.vehicle_keys import OFFSET_LIMIT_DEG, OFFSET_LIMIT_MAX_DEG, OFFSET_LIMIT_MIN_DEG
from oncenter.verdict.decision import Case, decide, is_whole_turns
from oncenter.verdict.numbers import Shown, shown
from oncenter.verdict.offset import turns_words
from oncenter.verdict.states import AT_FAULT, OF_OFFSET, STATES, Code

State = Literal[
    "successful", "unchanged", "wrong_direction", "not_successful", "within_limit", "undecided", "no_correction"
]
_SCHEMAS = tuple(f"oncenter/{schema}" for schema in SCHEMAS)
_ORDER = "drive_order"  # code of errors
_VARIES = "mean_wind"  # of the causes the one that differs from drive to drive
_NOT_FIXED = ("relative_angle_sensor", "zero_differs_at_starts", "zero_moves")  # codes of findings
_FORMER = {"no_verdict": "check_signal"}  # codes of a verdict in answers of former versions
_NUMBER_MAX = 1e9  # deg, or m/s^2: no answer is near it, and its square is a number
_QUOTED_MAX = 200  # characters of a file's text in a message
_BYTES_MAX = 16 << 20  # of an answer's file; one with a hundred changes and findings has 60 kB


@dataclass(frozen=True)
class Offset:
    """An answer's offset in deg as `oncenter offset --json` gives it; `half_width_deg` of this drive's part.

    `causes` has (sd_m_s2, sd_deg) by cause; empty where the answer does not separate them. `is_fixed`: the sensor's
    zero is the same at each start and within the drive. `whole_deg` is the whole interval, `verdict` the answer's code.
    """

    log: str
    vehicle: str
    vin: str | None
    method: str
    value_deg: float | None
    half_width_deg: float
    status: str
    causes: Mapping[str, tuple[float, float]]
    limit_deg: float = OFFSET_LIMIT_DEG
    is_fixed: bool = True
    whole_deg: tuple[float, float] | None = None
    verdict: Code | None = None
    start_s: float | None = None  # of the drive, since 1970
    drives: tuple[Print, ...] = ()  # empty in answers of former versions
    own_by_priors_deg: tuple[tuple[float, float], ...] = ()
    is_combined: bool = False  # a rear axle steers, and only the offset of both sensors together is identified

    def code(self, limit_deg: float) -> Code:
        """The verdict with that limit."""
        at_fault = self.verdict if self.verdict in AT_FAULT else None
        if self.value_deg is None or self.whole_deg is None:
            return at_fault or "no_offset"
        own = (self.value_deg - self.half_width_deg, self.value_deg + self.half_width_deg)
        is_valid, zero = self.status == "valid", "fixed" if self.is_fixed else "relative"
        has_evidence = is_valid or self.verdict in ("over", "within")
        has_play, by_priors = self.method == "joint", self.own_by_priors_deg
        case = Case(at_fault, cast(Zero, zero), is_valid, has_evidence, own, self.whole_deg, has_play, by_priors)
        return decide(case, limit_deg)

    def shown(self, limit_deg: float) -> Shown:
        """Offset and half-width with the digits that the decision needs."""
        assert self.value_deg is not None
        return shown(self.value_deg, self.half_width_deg, limit_deg)


@dataclass(frozen=True)
class Comparison:
    """The change from `before` to `after`; `change_deg` is None where one of the two has no offset.

    `half_width_deg` is the change's 95 % half-width; `shared_half_width_deg` is what the causes add to each offset
    that cancel in the change.
    """

    before: Offset
    after: Offset
    limit_deg: float
    change_deg: float | None
    half_width_deg: float | None
    shared_half_width_deg: float
    state: State

    @property
    def headline(self) -> str:
        """The verdict in one sentence, with its numbers."""
        if self.change_deg is None:
            return f"Undecided: {self._without_offset()}."
        return f"{_BEGINS[self.state]}: {self._change_words()} ({self._limit_words()})."

    @property
    def action(self) -> str:
        """What to do now; empty where nothing is."""
        value = self.after.value_deg
        if self.state == "no_correction":
            return "Do not store a correction: it would not hold."
        if self.state == "undecided" or value is None:
            return self._more_driving()
        if is_whole_turns(value):
            return f"Set the zero of the sensor with the wheels straight ahead. {turns_words(value)}"
        after = self.after.shown(self.limit_deg)
        add = f"Add {-after.value + 0.0:+.{after.digits}f} deg (left is positive)"
        return {
            "successful": "",
            "within_limit": "",
            "unchanged": f"Check that the correction was stored in the control unit. {add}, then compare again.",
            "wrong_direction": f"The sign of the correction was reversed. {add}, then compare again.",
            "not_successful": f"{add}, then compare again.",
        }[self.state]

    @property
    def order_note(self) -> str:
        """The reason for an order that the start times do not give; empty where they do."""
        why = _why_not_by_date(self.before, self.after)
        return f"The user gave the order of the drives: {why}." if why else ""

    def _more_driving(self) -> str:
        if self.after.code(self.limit_deg) in AT_FAULT:
            return "Correct the signal or the sensor of the drive after, then compare again."
        if self.before.is_combined or self.after.is_combined:
            return "A rear axle steers: give rear_axle_zero_deg in the vehicle file, then compare again."
        if self.after.status == "valid":
            return "Log another drive after the repair, and compare with both logs together."
        return "Drive on until both offsets are valid, then compare again."

    def to_dict(self) -> dict[str, Any]:
        """The object of the schema oncenter/compare-1; degrees."""
        return {
            "schema": "oncenter/compare-1",
            "state": self.state,
            "headline": self.headline,
            "action": self.action,
            "order": "given" if self.order_note else "date",
            "limit_deg": self.limit_deg,
            "change": {
                "value": self.change_deg,
                "unit": "deg",
                "ci95": _interval(self.change_deg, self.half_width_deg),
            },
            "cancelled_half_width_deg": self.shared_half_width_deg,
            "before": _offset_dict(self.before, self.limit_deg),
            "after": _offset_dict(self.after, self.limit_deg),
        }

    def to_json(self) -> str:
        return json.dumps(self.to_dict(), ensure_ascii=False, allow_nan=False, indent=2)

    def __str__(self) -> str:
        lines = [f"{self.headline} {self.action}".rstrip(), ""]
        for name, offset in _named(self):
            word = STATES[offset.code(self.limit_deg)].word
            value = "no offset" if offset.value_deg is None else str(offset.shown(self.limit_deg))
            lines.append(f"  {name:8}{value:24}{offset.status:14}{word:18}{printable(offset.log)}")
        if self.change_deg is not None and self.half_width_deg is not None:
            lines.append(f"  {'change':8}{_signed(self.change_deg)} ± {_width(self.half_width_deg)} deg")
        shared = _width(self.shared_half_width_deg)
        if shared != _width(0.0):
            lines += [
                "",
                f"  A pull or an accelerometer bias may add ± {shared} deg to both offsets. It cancels in the change,",
                "  unless the wheel alignment was adjusted between the two drives.",
            ]
        if self.order_note:
            lines += ["", f"  {self.order_note}"]
        return "\n".join(lines)

    def _without_offset(self) -> str:
        lacking = [(name, offset.status) for name, offset in _named(self) if offset.value_deg is None]
        return " and ".join(f"the drive {name} has no offset ({status})" for name, status in lacking)

    def _change_words(self) -> str:
        assert self.change_deg is not None and self.half_width_deg is not None
        assert self.before.value_deg is not None and self.after.value_deg is not None
        first, last = (offset.shown(self.limit_deg) for _, offset in _named(self))
        both = f"from {first.value:+.{first.digits}f} to {last.value:+.{last.digits}f} deg"
        if self.state == "unchanged":
            return f"the offset did not change: {both}, difference ± {_width(self.half_width_deg)} deg"
        return f"the offset changed by {_signed(self.change_deg)} ± {_width(self.half_width_deg)} deg, {both}"

    def _limit_words(self) -> str:
        limit = f"limit {self.limit_deg:g} deg"
        open_ones = [f"{name} is {offset.status}" for name, offset in _named(self) if offset.status != "valid"]
        inside = "inside the interval after" if self.after.code(self.limit_deg) == "undecided" else ""
        return "; ".join([" ".join(filter(None, (limit, inside if not open_ones else ""))), *open_ones])


_BEGINS: Mapping[State, str] = {
    "successful": "Calibration successful",
    "unchanged": "Calibration not successful",
    "wrong_direction": "Calibration not successful",
    "not_successful": "Calibration not complete",
    "within_limit": "Within the limit before and after",
    "undecided": "Undecided",
    "no_correction": "No correction can hold, since the zero of the sensor changes",
}


def compare(before: Answer, after: Answer, *, limit_deg: float | None = None) -> Comparison:
    """The effect of a calibration or a repair between two drives of one truck.

    Args:
        before: the answer of the drive before it, `after` of the one after it, by the same method.
        limit_deg: an offset of this size or more, either sign, needs a calibration; the vehicle's `offset_limit_deg`
            where left out.

    Raises:
        OncenterError: exit code 2: "different_trucks" or "usage": other vehicles, VINs or methods, or one drive;
            "drive_order": `before` began after `after`.
    """
    first, second = (offset_of(answer.to_dict(), answer.log) for answer in (before, after))
    return compared(first, second, after.vehicle.offset_limit_deg if limit_deg is None else limit_deg)


def read_answer(path: str | os.PathLike[str]) -> Any:
    """The JSON of an answer's file: UTF-8, or UTF-16 as PowerShell's `>` writes it.

    Raises:
        OncenterError: "not_an_answer", exit code 2: it cannot be read, or is not JSON.
    """
    try:
        return json.loads(read_regular_file(path, _BYTES_MAX), parse_constant=_refuse_constant)
    except OSError as error:
        raise _not_an_answer(str(path), error.strerror or str(error)) from None
    except (ValueError, RecursionError) as error:
        raise _not_an_answer(str(path), f"not JSON: {error}") from None


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a JSON number")


def offset_of(answer: Any, name: str) -> Offset:
    """The offset of a JSON object of `oncenter offset`; `name` is its file's, for messages.

    Raises:
        OncenterError: "not_an_answer", exit code 2: it is another object.
    """
    schema = answer.get("schema") if isinstance(answer, Mapping) else None
    schema = schema if isinstance(schema, str) else None
    if schema == "oncenter/error-1":
        message = answer.get("message")
        raise _not_an_answer(name, f"it holds an error: {message[:_QUOTED_MAX] if isinstance(message, str) else ''}")
    if schema not in _SCHEMAS:
        has = "it has no schema" if schema is None else f"its schema is {schema[:_QUOTED_MAX]!r}"
        raise _not_an_answer(name, f"{has}, not {' or '.join(_SCHEMAS)}")
    try:
        return _offset(answer)
    except (KeyError, TypeError, ValueError, ArithmeticError, AttributeError, IndexError) as error:
        raise _not_an_answer(name, f"wrong or missing: {str(error)[:_QUOTED_MAX]}") from None


def _not_an_answer(name: str, why: str) -> OncenterError:
    return OncenterError(
        f"{name} is not an answer of oncenter offset: {why}; write one with: oncenter offset LOG --vehicle FILE --json",
        code="not_an_answer",
        exit_code=WRONG_USAGE,
    )


def _offset(answer: Mapping[str, Any]) -> Offset:
    offset, start = answer["offset"], answer.get("start_time")
    interval = offset.get("ci95_drive") or offset["ci95"]
    value = None if offset["value"] is None or interval is None else _number(offset["value"])
    causes = {
        _text(cause["cause"]): (_number(cause["sd_m_s2"]), _number(cause["sd_deg"]))
        for cause in offset.get("not_identifiable", ())
    }
    return Offset(
        log=_text(answer["log"]),
        vehicle=_text(answer["vehicle"]),
        vin=None if answer.get("vin") is None else _text(answer["vin"]),
        method=_text(answer["method"]),
        value_deg=value,
        half_width_deg=math.inf if value is None else 0.5 * (_ends(interval)[1] - _ends(interval)[0]),
        status=_text(offset["status"]),
        causes=causes,
        limit_deg=_limit(answer.get("limit_deg")),
        whole_deg=None if offset["ci95"] is None else _ends(offset["ci95"]),
        verdict=_verdict_in(answer),
        own_by_priors_deg=tuple(
            _ends(each[factor]["ci95_drive"])
            for each in offset.get("by_priors", ())
            if each["prior"] in INSIDE_DRIVE
            for factor in ("halved", "doubled")
        ),
        is_combined=offset["value"] is None and "combined_offset" in answer,
        is_fixed=not any(finding["code"] in _NOT_FIXED for finding in answer.get("findings", ())),
        start_s=None if start is None else _seconds(start),
        drives=tuple(map(_print, answer.get("drives", ()))),
    )


def _print(drive: Mapping[str, Any]) -> Print:
    start_s = math.nan if drive["start_time"] is None else _seconds(drive["start_time"])
    return Print(_text(drive["fingerprint"]), _number(drive["duration_s"]), start_s)


def _seconds(start: str) -> float:
    return datetime.fromisoformat(start).timestamp()


def _number(given: object) -> float:
    """
    Raises:
        ValueError: it is none, or one that no answer has: NaN, infinite or huge.
    """
    if not isinstance(given, int | float) or isinstance(given, bool) or not abs(given) <= _NUMBER_MAX:
        raise ValueError("a number that no answer has")
    return float(given)


def _text(given: object) -> str:
    if not isinstance(given, str):
        raise ValueError("a text that is none")
    return given


def _ends(given: Any) -> tuple[float, float]:
    low, high = map(_number, given)
    if low > high:
        raise ValueError("an interval whose lower end is above the upper one")
    return low, high


def _limit(given: object) -> float:
    if given is None:
        return OFFSET_LIMIT_DEG
    limit_deg = _number(given)
    if not OFFSET_LIMIT_MIN_DEG <= limit_deg <= OFFSET_LIMIT_MAX_DEG:
        raise ValueError(f"a limit of {limit_deg:g} deg")
    return limit_deg


def in_order(one: Offset, other: Offset) -> tuple[Offset, Offset]:
    """The offset of the earlier drive, then that of the later one.

    Raises:
        OncenterError: "drive_order", exit code 2: a drive has no start time, or both have the same.
    """
    why = _why_not_by_date(one, other)
    if not why:
        return (one, other) if (one.start_s or 0.0) < (other.start_s or 0.0) else (other, one)
    raise OncenterError(
        f"the order of the drives is not certain: {why}; give the drive before the calibration first, with "
        "--in-given-order",
        code=_ORDER,
        exit_code=WRONG_USAGE,
    )


def _why_not_by_date(one: Offset, other: Offset) -> str:
    """Why the start times give no order; empty where they do."""
    undated = [offset.log for offset in (one, other) if offset.start_s is None]
    if undated:
        return f"no start time in {' and '.join(undated)}"
    return "both drives have the same start time" if one.start_s == other.start_s else ""


def _verdict_in(answer: Mapping[str, Any]) -> Code | None:
    """Of an answer of the present codes or of former ones; None in offset-1, which has none."""
    verdicts = answer.get("verdicts")
    code = str(verdicts[0]["state"]) if verdicts else ""
    return next((each for each in OF_OFFSET if each == _FORMER.get(code, code)), None)


def compared(before: Offset, after: Offset, limit_deg: float) -> Comparison:
    """The comparison of two offsets, as `compare`."""
    _refuse_other_truck(before, after)
    _refuse_one_drive(before, after)
    _refuse_reversed(before, after)
    shared, left = _causes(before, after)
    change = half_width = None
    if before.value_deg is not None and after.value_deg is not None:
        change = after.value_deg - before.value_deg
        half_width = math.hypot(before.half_width_deg, after.half_width_deg, left)
    return Comparison(
        before, after, limit_deg, change, half_width, shared, _state(before, after, limit_deg, change, half_width)
    )


def _refuse_one_drive(before: Offset, after: Offset) -> None:
    """Drives are compared by their signals, since two may have one name, one date and one length."""
    if before == after or any(one.is_in(other) for one in before.drives for other in after.drives):
        raise OncenterError(
            f"before ({before.log}) and after ({after.log}) are of one drive, or one is a part of the other: compare "
            "two drives",
            code="usage",
            exit_code=WRONG_USAGE,
        )


def _refuse_reversed(before: Offset, after: Offset) -> None:
    if before.start_s is not None and after.start_s is not None and after.start_s < before.start_s:
        raise OncenterError(
            f"before ({before.log}) was driven at {iso(before.start_s)}, later than after ({after.log}, "
            f"{iso(after.start_s)}): exchange them",
            code=_ORDER,
            exit_code=WRONG_USAGE,
        )


def _refuse_other_truck(before: Offset, after: Offset) -> None:
    pairs = (("VIN", before.vin, after.vin), ("vehicle", before.vehicle, after.vehicle))
    for what, one, other in pairs:
        if one is not None and other is not None and one != other:
            raise OncenterError(
                f"{before.log} and {after.log} are of two trucks ({what} {one} and {other}): compare two drives of one",
                code="different_trucks",
                exit_code=WRONG_USAGE,
            )
    if before.method != after.method:
        raise OncenterError(
            f"{before.log} was answered by method {before.method}, {after.log} by {after.method}: answer both by one",
            code="usage",
            exit_code=WRONG_USAGE,
        )


def _causes(before: Offset, after: Offset) -> tuple[float, float]:
    """95 % half-widths, deg, of the causes: what is the same in both offsets, and what is left in their difference."""
    shared = left = 0.0
    for cause in before.causes.keys() & after.causes.keys():
        (acceleration_sd, one), (_, other) = before.causes[cause], after.causes[cause]
        if cause == _VARIES:
            left += one**2 + other**2
        elif acceleration_sd > 0.0:
            shared += max(one, other) ** 2
            left += (one - other) ** 2
    return 1.96 * math.sqrt(shared), 1.96 * math.sqrt(left)


def _state(before: Offset, after: Offset, limit_deg: float, change: float | None, half_width: float | None) -> State:
    if not (before.is_fixed and after.is_fixed):
        return "no_correction"
    if change is None or half_width is None or after.status != "valid":
        return "undecided"
    assert before.value_deg is not None and after.value_deg is not None
    was, now = before.code(limit_deg), after.code(limit_deg)
    if now not in ("within", "over", "recalibrate"):
        return "undecided"
    has_changed = abs(change) > half_width
    if now == "within":
        return "within_limit" if was == "within" else "successful" if has_changed else "undecided"
    if not has_changed:
        return "unchanged"
    is_doubled = before.status == "valid" and abs(after.value_deg - 2.0 * before.value_deg) < half_width
    return "wrong_direction" if is_doubled else "not_successful"


def _named(comparison: Comparison) -> tuple[tuple[str, Offset], ...]:
    return (("before", comparison.before), ("after", comparison.after))


def _offset_dict(offset: Offset, limit_deg: float) -> dict[str, Any]:
    return {
        "log": offset.log,
        "vehicle": offset.vehicle,
        "value": offset.value_deg,
        "unit": "deg",
        "ci95_drive": _interval(offset.value_deg, offset.half_width_deg),
        "status": offset.status,
        "verdict": offset.code(limit_deg),
    }


def _interval(value_deg: float | None, half_width_deg: float | None) -> list[float] | None:
    if value_deg is None or half_width_deg is None:
        return None
    return [value_deg - half_width_deg, value_deg + half_width_deg]


def _signed(value_deg: float) -> str:
    return f"{round(value_deg, 1) + 0.0:+.1f}"


def _width(half_width_deg: float) -> str:
    return f"{half_width_deg:.{1 if half_width_deg >= 0.095 else 2}f}"
