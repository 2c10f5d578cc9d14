"""Whether the signals of a drive fit together: sign, scale, lag, ratio times wheelbase, zero, resolution.

Four signals show a turn: the angle, the yaw rate, the lateral acceleration and the difference of the rear wheel speeds.
Each check compares some of them and returns a finding, None (no objection), or `CannotTell` with the evidence that is
missing. Limits without a source are tuned; they are wide enough for any road vehicle.

SI and rad inside; findings are for people and files and hold degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

from oncenter.findings import Finding, most_severe_first
from oncenter.plausibility import axles, lag, presence, ratio, signal_fault, signs_and_units, statuses, zeros
from oncenter.plausibility.check_result import CannotTell, CheckResult
from oncenter.plausibility.grid_signals import USEFUL, GridSignals
from oncenter.plausibility.recording import recording_findings
from oncenter.plausibility.reversing import reversing
from oncenter.plausibility.values_left_out import values_left_out
from oncenter.signals import Signals
from oncenter.vehicle import Vehicle

__all__ = ["CannotTell", "Plausibility", "check", "faults", "rough_ratio_times_wheelbase_m"]


@dataclass(frozen=True)
class Plausibility:
    """`findings`, the most severe first, empty where all judged checks passed; `cannot_tell`: checks not judged."""

    findings: tuple[Finding, ...]
    cannot_tell: tuple[CannotTell, ...]


def check(signals: Signals, vehicle: Vehicle | None = None) -> Plausibility:
    """Judges the signals of a drive together.

    Args:
        signals: of one drive; a check that needs a missing one is not judged.
        vehicle: with it, ratio times wheelbase is judged; without, the drive's value is reported.
    """
    with_fit_statuses, contradicted = statuses.without_contradicted(signals)
    usable, unfit_axles = axles.without_unfit_axles(with_fit_statuses, vehicle)
    drive = GridSignals(usable, vehicle)
    sign, units = signs_and_units.sign(drive), signs_and_units.units(drive)
    comparable = not (isinstance(sign, Finding) or isinstance(units, Finding))  # else r/v and r*v mean nothing
    verdicts: list[CheckResult] = [
        *values_left_out(signals, USEFUL),
        *recording_findings(signals, USEFUL),
        *contradicted,
        reversing(drive.seems_to_reverse, drive.step_s, drive.has("reverse")),
        *presence.missing(drive),
        *presence.availability(drive),
        *presence.stuck(drive),
        *presence.coarse(drive),
        sign,
        units,
        signs_and_units.wheels(drive, units) if drive.has(*drive.wheel_pair()) or not unfit_axles else None,
        *(unfit.finding for unfit in unfit_axles),
        *signs_and_units.torque(drive, comparable),
        lag.yaw_rate(drive),
        lag.lateral_acceleration(drive),
        ratio.ratio_times_wheelbase(drive, comparable),
        zeros.yaw_rate(drive),
        zeros.lateral_acceleration(drive),
        zeros.bank(drive, comparable),
        zeros.relative_sensor(drive),
        zeros.whole_turns(drive, comparable),
    ]
    if not any(isinstance(verdict, Finding) and verdict.severity == "error" for verdict in verdicts):
        verdicts.append(signal_fault.found_in(with_fit_statuses, vehicle))
    return Plausibility(
        most_severe_first(verdict for verdict in verdicts if isinstance(verdict, Finding)),
        tuple(verdict for verdict in verdicts if isinstance(verdict, CannotTell)),
    )


def faults(signals: Signals, vehicle: Vehicle | None = None) -> tuple[Finding, ...]:
    """The errors of `check` in existing signals: a reversed sign, a wrong unit, a stuck value.

    With one of them, a drive gives no useful estimate. Takes a tenth of a second for hours of driving.
    """
    drive = GridSignals(signals, vehicle)
    units = signs_and_units.units(drive)
    verdicts = (*presence.stuck(drive), signs_and_units.sign(drive), units, signs_and_units.wheels(drive, units))
    return tuple(each for each in verdicts if isinstance(each, Finding) and each.severity == "error")


def rough_ratio_times_wheelbase_m(signals: Signals) -> float | None:
    """The product from a drive's bends; None where they are too few, or where signs or scales contradict each other."""
    drive = GridSignals(signals, None)
    if signs_and_units.sign(drive) is not None or signs_and_units.units(drive) is not None:
        return None
    return ratio.rough_m(drive)
