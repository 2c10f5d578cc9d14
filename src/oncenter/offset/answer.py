"""The estimates of a drive, or of several of one truck, in words and as JSON.

SI and rad inside; degrees appear in `Answer.words`, `Answer.to_json` and in findings, which are for people and files.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Literal

from oncenter.estimates.cause import in_words, together_rad
from oncenter.estimates.correction import NO_CORRECTION
from oncenter.estimates.estimate import Estimate, number
from oncenter.estimates.estimates import Estimates
from oncenter.findings import large_losses
from oncenter.signals import DEGREE
from oncenter.truck.fingerprint import fingerprint_of
from oncenter.utc import iso
from oncenter.verdict import lines_of, verdicts_of
from oncenter.verdict.numbers import shown

Schema = Literal["offset-1", "offset-2"]
SCHEMAS: tuple[Schema, ...] = ("offset-1", "offset-2")
DEFAULT_SCHEMA: Schema = "offset-2"

# By status, the words beside an offset that must not be set. An invalid offset with a value was estimated before the
# fault of the angle sensor.
NOT_YET_OR_NO_MORE: Mapping[str, str] = {"converging": "still converging", "invalid": "before the fault"}
_NO_PLAY_DEG = 0.5  # an interval that reaches below it includes no play at all
_CORRECTION_REPORTED_FROM_RAD_S = 0.05 * DEGREE


class Answer(Estimates):
    """The answer on a steering wheel angle sensor: `str(answer)` in words, `to_json` as the contract's object."""

    def words(self) -> str:
        """The numbers of the answer in one paragraph; the verdict says what to do."""
        parts = [self.offset_words()]
        if self.backlash.value is not None:
            parts.append(f"the steering has {_play(self.backlash)} of play")
        bias = self.yaw_rate_bias.value if self.yaw_rate_bias.status in ("valid", "converging") else None
        if self.method == "joint" and bias is not None and abs(bias) > _CORRECTION_REPORTED_FROM_RAD_S:
            parts.append(f"corrected for a gyro bias of {bias / DEGREE:.2g} deg/s")
        return "; ".join([*parts, self._driven()])

    def offset_words(self) -> str:
        """The straight-ahead offset with both parts of its interval."""
        value, drive = self.offset.value, self.offset_half_width_rad
        if value is None or drive is None:
            return self._combined_words() or f"straight-ahead offset {self.offset.status}"
        more = 1.96 * together_rad(self.not_identifiable)
        limit_deg = self.vehicle.offset_limit_deg
        digits = shown(value / DEGREE, drive / DEGREE, limit_deg, 1 if drive >= 0.095 * DEGREE else 2).digits
        of_drive = f" from {'this drive' if len(self.drives) == 1 else 'these logs'}" if self.method == "joint" else ""
        status = "" if self.offset.status in ("valid", "invalid") else f" ({self.offset.status})"
        begin = f"invalid; {NOT_YET_OR_NO_MORE['invalid']} " if self.offset.status == "invalid" else ""
        words = f"straight-ahead offset {begin}{number(value, digits)} deg ± {number(drive, digits)}{of_drive}{status}"
        causes = in_words(self.not_identifiable)
        if not causes:
            return words
        return f"{words}; {causes} can add ± {number(more, digits)} deg"

    def _combined_words(self) -> str:
        """Of a truck whose rear axle steers, where its zero is unknown; else empty."""
        if self.combined_offset is None or self.combined_offset.value is None:
            return ""
        return f"combined offset of the front and the rear axle's sensors {self.combined_offset}"

    @property
    def quantities(self) -> dict[str, Estimate]:
        """The quantities by their printed names."""
        of_ratio = (
            {
                "understeer at steering wheel": self.understeer_at_steering_wheel,
                "ratio times wheelbase": self.ratio_times_wheelbase,
            }
            if "steering_ratio" in self.vehicle.assumed
            else {"understeer gradient": self.understeer_gradient}
        )
        return {
            "straight-ahead offset": self.offset,
            **({} if self.combined_offset is None else {"combined offset": self.combined_offset}),
            **({} if self.rear_axle_offset is None else {"rear axle's offset": self.rear_axle_offset}),
            **of_ratio,
            "free play": self.backlash,
            "neutral lateral acceleration": self.unloading_acceleration,
            "yaw rate bias": self.yaw_rate_bias,
            "lateral acceleration bias": self.lateral_acceleration_bias,
        }

    def _driven(self) -> str:
        """The usable part of the drive, and the most frequent reasons for the rest."""
        unit, per_unit = ("minutes", 60.0) if self.duration_s >= 120.0 else ("seconds", 1.0)
        digits = 0 if self.duration_s / per_unit >= 10.0 else 1
        worst = sorted(((s, name) for name, s in self.rejected_s.items() if s > 0.05 * self.duration_s), reverse=True)
        rejected = [f"{s / per_unit:.{digits}f} rejected for {name.replace('_', ' ')}" for s, name in worst[:3]]
        usable = f"{self.used_s / per_unit:.{digits}f} of {self.duration_s / per_unit:.{digits}f} {unit} usable"
        return ", ".join([usable, *rejected])

    def __repr__(self) -> str:
        return f"Answer({self.log!r}, offset {self.offset}, {len(self.findings)} findings)"

    def _repr_html_(self) -> str:
        from html import escape  # late import, as in `Signals`: notebooks alone need it

        from oncenter.notebook import html_table

        rows = []
        for name, estimate in self.quantities.items():
            given = estimate.to_dict()
            value = "-" if given["value"] is None else f"{given['value']:.3g}"
            interval = "-" if given["ci95"] is None else "{:.3g} to {:.3g}".format(*given["ci95"])
            rows.append((name, value, interval, given["unit"], given["status"]))
        verdict = f"<p><b>{escape(verdicts_of(self)[0].words())}</b></p>"
        table = html_table(self.words(), ("quantity", "value", "95 % interval", "unit", "status"), rows)
        findings = "".join(f"<li>{escape(f'{each.severity}: {each.text}')}</li>" for each in self.findings)
        return verdict + table + (f"<ul>{findings}</ul>" if findings else "")

    def __str__(self) -> str:
        lines = [*large_losses(self.findings), *lines_of(self), self.words()]
        lines += [finding.line() for finding in self.findings]
        return "\n".join(lines)

    def to_dict(self, schema: Schema = DEFAULT_SCHEMA) -> dict[str, Any]:
        """The object of the schema oncenter/offset-2, or of offset-1, which lacks the parts of the interval."""
        return {
            "schema": f"oncenter/{schema}",
            "version": self.version,
            "log": self.log,
            "vehicle": self.vehicle.name,
            **({} if schema == "offset-1" else {"traffic_side": self._traffic_side()}),
            "method": self.method,
            "params": dict(self.params),
            "signals": dict(self.sources),
            "offset": {
                **self.offset.to_dict(),
                "variance_if_independent_deg2": None
                if self.offset.value is None or self.variance_if_independent_rad2 is None
                else self.variance_if_independent_rad2 / DEGREE**2,
                **({} if schema == "offset-1" else self._parts()),
            },
            **({} if schema == "offset-1" else self._of_both_axles()),
            **({} if schema == "offset-1" else self._decision()),
            "understeer_gradient": self.understeer_gradient.to_dict(),
            "backlash": self.backlash.to_dict(),
            "unloading_acceleration": self.unloading_acceleration.to_dict(),
            "equivalent_wheelbase": self.equivalent_wheelbase.to_dict(),
            **({} if schema == "offset-1" else self._at_steering_wheel()),
            "yaw_rate_bias": self.yaw_rate_bias.to_dict(),
            "lateral_acceleration_bias": self.lateral_acceleration_bias.to_dict(),
            "wheel_radius_mismatch_rear": self.wheel_radius_mismatch_rear.to_dict(),
            "wheel_radius_mismatch_front": self.wheel_radius_mismatch_front.to_dict(),
            "changes": [change.to_dict() for change in self.changes],
            "time": {
                "duration_s": self.duration_s,
                "used_s": self.used_s,
                "unused_s": self.unused_s,
                "rejected_s": {name: s for name, s in self.rejected_s.items() if s > 0},
            },
            "findings": [finding.to_dict() for finding in self.findings],
            "notes": list(self.notes),
            **({} if schema == "offset-1" else {"accounts": self._accounts()}),
        }

    def _traffic_side(self) -> dict[str, str | None]:
        return {"side": self.vehicle.traffic_side, "by": self.vehicle.traffic_side_by}

    def _of_both_axles(self) -> dict[str, Any]:
        given = {"combined_offset": self.combined_offset, "rear_axle_offset": self.rear_axle_offset}
        return {name: estimate.to_dict() for name, estimate in given.items() if estimate is not None}

    def _at_steering_wheel(self) -> dict[str, Any]:
        return {
            "assumed": list(self.vehicle.assumed),
            "ratio_times_wheelbase": self.ratio_times_wheelbase.to_dict(),
            "understeer_at_steering_wheel": self.understeer_at_steering_wheel.to_dict(),
        }

    def _accounts(self) -> list[dict[str, Any]]:
        """For each log that was read, what became of its values."""
        return [{"log": drive.log, **drive.account.to_dict()} for drive in self.drives if drive.account is not None]

    def _parts(self) -> dict[str, Any]:
        drive, now = self.offset_ci95_drive, self.offset_now
        return {
            "applied_deg": self.vehicle.offset_applied_deg,
            "ci95_drive": None if drive is None else [bound / DEGREE for bound in drive],
            "not_identifiable": [cause.to_dict() for cause in self.not_identifiable],
            "by_priors": [each.to_dict(now) for each in self.by_priors] if now else [],
        }

    def _decision(self) -> dict[str, Any]:
        return {
            "correction": NO_CORRECTION if self.correction is None else self.correction.to_dict(),
            "limit_deg": self.vehicle.offset_limit_deg,
            "verdicts": [verdict.to_dict() for verdict in verdicts_of(self)],
            "vin": self.vin,
            "start_time": _date(self.begin_s),
            "drives": [
                {
                    "log": drive.log,
                    "start_time": _date(drive.begin_s),
                    "duration_s": drive.duration_s,
                    "fingerprint": fingerprint_of(drive),
                }
                for drive in self.drives
            ],
        }

    def to_json(self, schema: Schema = DEFAULT_SCHEMA) -> str:
        return json.dumps(self.to_dict(schema), ensure_ascii=False, allow_nan=False, indent=2)


def _date(time_s: float | None) -> str | None:
    return None if time_s is None else iso(time_s)


def _play(play: Estimate) -> str:
    """Its width in words, with the interval where that is wide."""
    assert play.value is not None and play.ci95 is not None
    low, high = (bound / DEGREE for bound in play.ci95)
    if low < _NO_PLAY_DEG:
        return f"at most {high:.1f} deg"
    return f"{play.value / DEGREE:.1f} deg" + (f" ({low:.1f} to {high:.1f})" if high - low > 1.0 else "")
