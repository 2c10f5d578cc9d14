"""One log becomes one row: read, answered, with its truck and its start time, or with its error."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from oncenter import _core
from oncenter.errors import OncenterError
from oncenter.estimates.cause import together_rad
from oncenter.estimates.estimate import Estimate
from oncenter.files.file_name import printable, printable_name
from oncenter.files.own_file import NOT_A_LOG
from oncenter.fleet.files import LogFile, at_hand
from oncenter.fleet.start import starts_outside, valid_start
from oncenter.fleet.summaries import columns_of
from oncenter.fleet.trucks import Truck, Trucks
from oncenter.fleet.vins import refuse_other_vin
from oncenter.offset.answer import Answer
from oncenter.offset.run import offset
from oncenter.plausibility.grid_signals import USEFUL
from oncenter.read import refuse_unreadable
from oncenter.read.here import read_here
from oncenter.read.identity_of_log import identity_of
from oncenter.read.packed import unpacked_here
from oncenter.signals import DEGREE, Signals
from oncenter.truck.fingerprint import fingerprint_of
from oncenter.truck.row import Row
from oncenter.tuned import TUNED
from oncenter.utc import EPOCH_S
from oncenter.vehicle import Vehicle
from oncenter.verdict import verdicts_of
from oncenter.verdict.offset import has_evidence


@dataclass(frozen=True)
class Work:
    """The inputs of every answer: plain data, so that it can be sent to another machine.

    Attributes:
        trucks: the vehicle files.
        reports: folder for each drive's page, or None.
    """

    trucks: Trucks
    reports: Path | None = None

    def __call__(self, log: LogFile) -> dict[str, Any]:
        """The row of `tables.DRIVES`; times in s since 1970. A log without an answer gets a row with its error."""
        row: dict[str, Any] = {"log": printable_name(log.uri), "truck": "", "version": _core.version(), "key": ""}
        truck = self.trucks.by_path(log.uri)
        try:
            with at_hand(log) as (packed, key), unpacked_here(packed) as path:
                row["key"] = key
                truck = truck or self._by_vin(path) or self._by_copy(log, key)
                row |= {"truck": truck.name, "vehicle_file": truck.vehicle_file} if truck else {}
                if truck is not None and (key, truck.name, True) in log.known:
                    return copy_of(key, truck.name)
                vehicle = self._vehicle(log, truck)
                signals = _read(path, vehicle)
                row |= {"span_s": _span_s(signals)} | when(log, signals)
                row |= _largest_loss(signals)
                row |= {"fingerprint": fingerprint_of(signals), "vin": signals.vin}
                refuse_other_vin(row)
                former = [_former(each, vehicle) for each in log.former]
                answer = offset([*former, signals], vehicle)
                row |= of_answer(answer)
                if log.former:
                    row["rows"] = [of_one_drive(each, answer) for each in answer.rows]
                elif self.reports is not None:
                    _report(answer, self.reports, key)
        except OncenterError as error:
            row |= {"error_code": error.code, "error": printable(" ".join(str(error).split()))}
            if error.code == NOT_A_LOG:  # no drive of the truck in whose folder it lies
                truck = None
                row |= {"truck": "", "vehicle_file": None}
        except Exception as error:  # one log must not end the run
            row |= {"error_code": "bug", "error": printable(f"internal error: {type(error).__name__}: {error}")}
        row["settings"] = self.trucks.settings(truck.vehicle_file if truck else None)
        return row

    def _by_vin(self, path: Path) -> Truck | None:
        vin = identity_of(path).vin
        return None if vin is None else self.trucks.by_vin(vin)

    def _by_copy(self, log: LogFile, key: str) -> Truck | None:
        """The truck of another file with this content: a log may be moved to where nothing names its truck."""
        names = sorted(name for its_key, name, _ in log.known if its_key == key)
        return self.trucks.by_path(names[0]) if names else None

    def _vehicle(self, log: LogFile, truck: Truck | None) -> Vehicle:
        if truck is None:
            raise OncenterError(
                f"no vehicle file for {log.uri}: no part of its path and no VIN in it matches a file in --vehicles",
                code="unknown_truck",
            )
        return self.trucks.vehicle(truck.vehicle_file)


def _read(path: Path, vehicle: Vehicle) -> Signals:
    """In this process, which is a watched child already: a second child would have the same limits."""
    refuse_unreadable(path)
    return read_here(path, vehicle.signal_names, vehicle.databases(), {}, lambda fraction: None)


def _former(log: LogFile, vehicle: Vehicle) -> Signals:
    with at_hand(log) as (packed, _), unpacked_here(packed) as path:
        return _read(path, vehicle)


def of_one_drive(row: Row, answer: Answer) -> dict[str, Any]:
    """The columns of one drive that are not those of all these logs."""
    times = {"duration_s": row.length_s, "used_s": row.used_s, "start": row.start_s}
    loads = {"side_force_left_s": row.left_s, "side_force_right_s": row.right_s}
    return columns_of(row, answer.params) | times | loads | {"offset_status": row.status, "log": row.logs[-1]}


def copy_of(key: str, truck: str) -> dict[str, Any]:
    """In place of a row: the log has the content of another one, whose answer holds for it."""
    return {"key": key, "truck": truck, "is_copy": True}


def _report(answer: Answer, folder: Path, key: str) -> None:
    """Writes the drive's page, completely or not at all."""
    from oncenter.report import report

    report(answer, folder / f"{key}.html")


def _largest_loss(signals: Signals) -> dict[str, Any]:
    """The columns of the signal that lost most of its samples for one reason, among those of an answer; else empty."""
    largest = None if signals.account is None else signals.account.largest(USEFUL)
    if largest is None:
        return {}
    signal, reason, share = largest
    return {"left_out_share": share, "left_out_reason": reason, "left_out_signal": signal}


def of_answer(answer: Answer) -> dict[str, Any]:
    """The answer's columns of a drive's row."""
    row: dict[str, Any] = {
        "rate_hz": answer.drives[0].rate_hz,
        "duration_s": answer.duration_s,
        "used_s": answer.used_s,
        "side_force_left_s": answer.side_force_s[0],
        "side_force_right_s": answer.side_force_s[1],
        "changes_in_drive": len(answer.changes),
        "findings": " ".join(finding.code for finding in answer.findings),
    }
    for name, unit in _UNITS.items():
        row |= _columns(name, unit, getattr(answer, name))
    row |= {"verdict": verdicts_of(answer)[0].state, "evidence_enough": has_evidence(answer)}
    return row | columns_of(answer.rows[0] if answer.rows else None, answer.params) | _parts(answer)


def _parts(answer: Answer) -> dict[str, float]:
    """The offset's interval and both parts of it, deg; empty without an offset."""
    if answer.offset_half_width_rad is None or answer.offset.ci95 is None:
        return {}
    low, high = answer.offset.ci95
    return {
        "offset_low_deg": low / DEGREE,
        "offset_high_deg": high / DEGREE,
        "offset_drive_sd_deg": answer.offset_half_width_rad / 1.96 / DEGREE,
        "offset_not_identifiable_sd_deg": together_rad(answer.not_identifiable) / DEGREE,
    }


# By attribute of `Answer`, the unit in the columns.
_UNITS: Mapping[str, str] = {
    "offset": "deg",
    "backlash": "deg",
    "unloading_acceleration": "m_s2",
    "yaw_rate_bias": "deg_s",
    "understeer_gradient": "deg_m_s2",
}


# The axle may be set up for the crown, with another offset. The interval leans toward that offset by half the distance
# and has a share of the squared distance more variance. The set-up is the same in all drives of a truck, so this
# variance is taken out of each drive.
_OF_LEAN = TUNED["hypothesis_equations.two_ends_share"] / 0.5**2


def _columns(name: str, unit: str, estimate: Estimate) -> dict[str, Any]:
    given = estimate.to_dict()
    low, high = given["ci95"] or (None, None)
    sd = None
    if low is not None and high is not None:
        sd = (high - low) / (2.0 * 1.96)
        # the play's interval is clamped at zero, which is no lean
        lean = 0.5 * (low + high) - given["value"] if name == "offset" else 0.0
        sd = math.sqrt(max(sd**2 - _OF_LEAN * lean**2, 0.25 * sd**2))
    return {f"{name}_{unit}": given["value"], f"{name}_sd_{unit}": sd, f"{name}_status": given["status"]}


def when(log: LogFile, signals: Signals) -> dict[str, Any]:
    """When the drive began, in s since 1970, from the first of these that has a time: the log's own time stamps; a
    table's metadata or column `start_time`; a date with time of day in the name of the file or of a folder near it
    (UTC); the time of the last write minus the drive's duration. Empty if none has a time of the years 1970 to 9999."""
    for source, start_s in _starts(log, signals):
        if valid_start(start_s) is not None:
            return {"start": start_s, "start_source": source}
    return {}


def _starts(log: LogFile, signals: Signals) -> Iterator[tuple[str, float | None]]:
    first = float(signals.columns["time_s"][0])
    yield "log", first if first > EPOCH_S else None
    yield "metadata", signals.start_s
    yield from starts_outside(log.uri, log.modified_s, _span_s(signals))


def _span_s(signals: Signals) -> float:
    return float(signals.columns["time_s"][-1]) - float(signals.columns["time_s"][0])
