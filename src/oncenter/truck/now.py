"""A truck now: one function of its rows, of what a person stated, and of priors.

The filter (native/truck_filter.c) gives histories: what changed between which drives, and the truck's state given that.
Here they become the offset with its interval, the changes with their dates, and the kind of the sensor's zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.truck.events import Event, is_former
from oncenter.truck.evidence import Numbers
from oncenter.truck.loads import LOADS_DIFFER, Loads, loads_of
from oncenter.truck.priors import Priors
from oncenter.truck.row import Row
from oncenter.truck.zero import Zero
from oncenter.tuned import TUNED

OFFSET, PLAY, BIAS, PULL, CROWN, STEER, STEER_BENT = range(7)
_DAY_S = 86400.0
_DAYS_UNKNOWN = 1.0  # between two drives whose dates are unknown or overlap
_STATED = {"calibrated": "offset", "repaired": "both", "changed": "alignment"}
_ANYWHERE_INFORMATION = 1e-3  # 1/rad^2, against a division by zero
_WIDE_PULL = 2  # variant of the filter's trucks, see `priors_of_filter`
_TINY = 1e-12  # against a division by zero


@dataclass(frozen=True)
class Change:
    """The offset, or the play, changed before drive `at`; rad. A repair that changed both is two of them."""

    at: int
    kind: str  # of _core.TRUCK_CHANGES; "play": the numbers are of the play
    before: float
    after: float
    size: float
    sd: float
    probability: float


@dataclass(frozen=True)
class Truck:
    """A truck after its last drive; SI and rad.

    `offset` is less the pull as far as the drives identify it, with the interval `own` from the driving and `whole`
    with what the drives do not identify. `since` is the first drive of the present offset, `play_since` of the present
    play. `is_ambiguous`: the interval holds two values, and a further drive decides.
    `offsets` are those of each drive, given the other estimates of the truck. `evidence_s` is the driving since the
    last change.
    """

    offset: float
    own: tuple[float, float]
    whole: tuple[float, float]
    accelerometer_bias: float
    accelerometer_bias_sd: float
    pull: float
    pull_sd: float
    pull_effect: float
    play: float
    play_sd: float
    neutral: float
    neutral_sd: float
    load_would_help: bool
    changes: tuple[Change, ...]
    since: int
    play_since: int
    zero: Zero
    evidence_s: float
    has_flanks: bool
    is_ambiguous: bool
    offsets: Numbers
    offset_sds: Numbers

    @property
    def own_sd(self) -> float:
        return (self.own[1] - self.own[0]) / (2.0 * 1.96)

    @property
    def lean(self) -> float:
        """Distance of the middle of `whole` from `offset`."""
        return 0.5 * (self.whole[0] + self.whole[1]) - self.offset

    @property
    def whole_sd(self) -> float:
        """With the lean, as in an oc_estimate; never below `own_sd`."""
        return max(math.hypot((self.whole[1] - self.whole[0]) / (2.0 * 1.96), self.lean), self.own_sd)

    def is_narrow(self, params: Mapping[str, float]) -> bool:
        return 1.96 * self.own_sd <= params["offset_drive_half_width_max_rad"]

    def has_evidence(self, params: Mapping[str, float], used_s: float) -> bool:
        """Whether more of the same driving decides nothing; `used_s` is the time used of all drives."""
        return self.is_valid(params) or (used_s >= params["joint_evidence_min_s"] and not self.is_narrow(params))

    def is_valid(self, params: Mapping[str, float]) -> bool:
        """Whether the offset is exact enough to be set: one value, enough driving since its last change, lateral force
        to both sides, and a narrow interval from the driving."""
        has_evidence = self.has_flanks and self.evidence_s >= params["joint_evidence_min_s"]
        return has_evidence and not self.is_ambiguous and self.is_narrow(params)


def usable(rows: Iterable[Row], events: Sequence[Event]) -> list[Row]:
    """Those that count for the truck, in order of time: with evidence, and not of a former truck. If one
    has no date, all keep their places."""
    counted = [row for row in rows if row.is_usable and not is_former(row.start_s, events)]
    is_dated = all(math.isfinite(row.start_s) for row in counted)
    return sorted(counted, key=lambda row: row.start_s) if is_dated else counted


def trucks_now(
    trucks: Sequence[Sequence[Row]], priors: Sequence[Priors], events: Sequence[Sequence[Event]] = ()
) -> list[Truck]:
    """The trucks after their usable drives, in order of time; each has one. The result of a truck does not depend on
    the others."""
    stated = events or [()] * len(trucks)
    trucks = list(map(of_one_side, trucks))
    loads = [loads_of(rows, prior) for rows, prior in zip(trucks, priors, strict=True)]
    tables = [table_of(*one) for one in zip(trucks, priors, stated, loads, strict=True)]
    of_trucks = np.array(
        [priors_of_filter(prior, rows) for rows, prior in zip(trucks, priors, strict=True)], _core.TRUCK_PRIORS
    )
    found = _core.truck_histories(np.concatenate(tables), [len(rows) for rows in trucks], of_trucks)
    return [_truck(*one) for one in zip(found, tables, trucks, priors, loads, strict=True)]


def of_one_side(rows: Sequence[Row]) -> Sequence[Row]:
    """The rows, those without a side of traffic with that of all others."""
    sides = {row.side for row in rows} - {0.0}
    return [replace(row, side=row.side or max(sides)) for row in rows] if len(sides) == 1 else rows


def truck_now(rows: Sequence[Row], events: Sequence[Event], priors: Priors) -> Truck:
    """A truck after its usable drives, in order of time, at least one.

    Args:
        events: what a person stated, see `oncenter.truck.events`.
    """
    return trucks_now([rows], [priors], [events])[0]


def table_of(rows: Sequence[Row], priors: Priors, events: Sequence[Event], loads: Loads) -> npt.NDArray[np.void]:
    """A truck's drives as the filter takes them, dtype _core.TRUCK_DRIVE."""
    table = np.zeros(len(rows), _core.TRUCK_DRIVE)
    ratio = np.array([row.ratio for row in rows])
    side = np.array([row.side for row in rows])
    measured = np.array([row.measured for row in rows])
    rigid = 1.0 - priors.compliance_share_1
    table["per_pull"] = ratio * (loads.mean + rigid * (loads.gradient - loads.mean))
    table["per_crown"] = np.where(measured, 0.0, -side * ratio * loads.gradient)
    table["load"] = loads.load
    table["load_bent"] = loads.load**2 - np.mean(loads.load**2)
    table["noise"][:, 0] = priors.offset_noise_sd_rad**2 + (ratio * priors.pull_sd_m_s2) ** 2 * loads.variance
    table["noise"][:, 1] = priors.play_noise_sd_rad**2
    table["noise"][:, 2] = priors.wind_sd_m_s2**2
    start = np.array([row.start_s for row in rows])
    ends = start + np.array([row.length_s for row in rows])
    days = (start[1:] - ends[:-1]) / _DAY_S  # of drives that overlap a date is wrong
    table["days"][1:] = np.where(days >= 0.0, days, _DAYS_UNKNOWN)
    table["modes"] = [len(row.modes) for row in rows]
    modes = table["mode"]
    for place, row in enumerate(rows):
        count = len(row.modes)
        modes["log_weight"][place, :count] = row.modes[:, 0]
        modes["information"][place, :count] = row.modes[:, 1:7]
        modes["vector"][place, :count] = row.modes[:, 7:]
    table["wrong"] = [
        priors.wrong_valid if row.status == "valid" and row.has_gradient else priors.wrong_other for row in rows
    ]
    along = np.where(side == 0.0, 1.0, side)
    share = priors.standing_crown_share_1
    for name, of_crown, values, variance in (
        (
            "driving",
            1.0,
            [row.bank for row in rows],
            priors.road_sd_m_s2**2 + np.array([row.bank_variance for row in rows]),
        ),
        ("standing", share, [row.standing for row in rows], np.full(len(rows), priors.standing_slope_sd_m_s2**2)),
    ):
        has = np.isfinite(values)
        bank = table[name]
        bank["value"] = np.where(has, np.array(values) - of_crown * side * priors.crown_m_s2, 0.0)
        bank["variance"] = np.where(has, variance, 0.0)
        bank["per_crown"] = of_crown * along
    places = np.searchsorted(start, [event.time_s for event in events])
    for place, row in enumerate(rows):
        stated = [
            _Stated(
                _STATED[event.kind], 1.0, event.by_rad or 0.0, 0.0 if event.by_rad is None else priors.stated_sd_rad
            )
            for event, at in zip(events, places, strict=True)
            if at == place > 0
        ]
        if row.moved_sd > 0.0:
            stated.append(_Stated("offset", TUNED["truck_now.found_share"], row.moved, row.moved_sd))
        if stated:
            _state(table[place], stated)
    return table


class _Stated(NamedTuple):
    """A change that a person stated, or that the core found in the drive, with its probability; rad, `by_sd` 0 where
    its size is not given."""

    kind: str
    share: float
    by: float
    by_sd: float


def _state(drive: Any, stated: Sequence[_Stated]) -> None:
    """Several changes before a drive are one, of all that they change; its size is their sum where each has one."""
    kinds = {one.kind for one in stated}
    is_all = {"both", "alignment"} <= kinds
    kind = "all" if is_all else next(each for each in ("both", "alignment", "offset") if each in kinds)
    drive["stated"], drive["stated_share"] = _core.TRUCK_CHANGES.index(kind), max(one.share for one in stated)
    if all(one.by_sd > 0.0 for one in stated):
        drive["stated_by"] = sum(one.by for one in stated)
        drive["stated_by_sd"] = math.hypot(*(one.by_sd for one in stated))


def priors_of_filter(priors: Priors, rows: Sequence[Row]) -> npt.NDArray[np.void]:
    """The priors as the filter takes them, of a truck with these drives."""
    one = np.zeros((), _core.TRUCK_PRIORS)
    unknown_side = 0.0 if all(row.side for row in rows) else priors.crown_m_s2
    one["mean"][[PLAY, BIAS, PULL]] = priors.play_mean_rad, priors.accelerometer_bias_m_s2, priors.pull_m_s2
    one["variance"] = (
        np.array(
            [
                priors.offset_sd_rad,
                priors.play_sd_rad,
                priors.accelerometer_bias_sd_m_s2,
                priors.pull_sd_m_s2,
                math.hypot(priors.region_sd_m_s2, unknown_side),
                0.0,
                0.0,
            ]
        )
        ** 2
    )
    one["at_ignition"][BIAS] = priors.bias_wander_sd_m_s2**2
    one["per_day"][[PLAY, BIAS, PULL]] = (
        priors.play_day_sd_rad**2,
        priors.bias_day_sd_m_s2**2,
        priors.pull_day_sd_m_s2**2,
    )
    one["changes_per_day"] = priors.changes_per_day
    one["new_variance"] = priors.new_offset_sd_rad**2
    one["wrong_variance"] = np.square(priors.wrong_sds_rad)
    little, much = np.square(np.array(priors.load_steer_sds_rad) * rows[0].ratio)
    usual, wide = priors.pull_sd_m_s2**2 * np.array([1.0, priors.wide_pull**2])
    tail = priors.wide_pull_probability
    of_little, of_much = priors.load_steer_weights
    one["variant_probability"] = (1.0 - tail) * of_little, (1.0 - tail) * of_much, tail
    one["variant_steer"], one["variant_pull"] = (little, much, little), (usual, usual, wide)
    one["zero_probability"] = priors.zero_probabilities
    one["moves_variance"], one["relative_variance"] = priors.moves_sd_rad**2, priors.relative_sd_rad**2
    return one


def _truck(found: Any, table: npt.NDArray[np.void], rows: Sequence[Row], priors: Priors, loads: Loads) -> Truck:
    histories = found["history"][: found["count"]]
    weights, means, covariances = _not_negative(
        np.exp(histories["log_weight"]), histories["mean"], histories["covariance"].reshape(-1, 7, 7)
    )
    pull, pull_variance = _mixed(weights, means[:, PULL], covariances[:, PULL, PULL])
    at_first = priors.pull_sd_m_s2**2 * np.where(histories["variant"] == _WIDE_PULL, priors.wide_pull**2, 1.0)
    share = 1.0 - float(weights @ (covariances[:, PULL, PULL] / np.maximum(at_first, _TINY)))
    identified = max(2.0 * share - 1.0, 0.0)
    own_mean, own_variance = _given_pull(means, covariances, priors.pull_m_s2, identified)
    common = priors.offset_common_sd_rad**2
    own = _interval(weights, own_mean, np.sqrt(own_variance + common))
    whole = _interval(weights, means[:, OFFSET], np.sqrt(covariances[:, OFFSET, OFFSET] + common))
    offset = _core.quantile(weights, own_mean, np.sqrt(own_variance + common), 0.5)
    half_width = max(own[1] - offset, offset - own[0])  # of several values the most probable one, all in the interval
    own = offset - half_width, offset + half_width
    narrowest = 2.0 * 1.96 * math.sqrt(float(np.min(own_variance)) + common)
    bias, bias_variance = _mixed(weights, means[:, BIAS], covariances[:, BIAS, BIAS])
    play, play_variance = _mixed(weights, means[:, PLAY], covariances[:, PLAY, PLAY])
    row = np.zeros(7)
    row[[BIAS, PULL]] = 1.0
    neutral, neutral_variance = _mixed(weights, means @ row, np.einsum("i,nij,j->n", row, covariances, row))
    offsets, offset_sds = _of_drives(table, (play, play_variance), (neutral, neutral_variance))
    zero = _zero(weights, histories)
    of_zero = np.where(histories["zero"] == _core.TRUCK_ZEROS.index(zero), weights, 0.0)  # only they name changes
    of_zero = of_zero / of_zero.sum() if of_zero.any() else weights
    changes = tuple(_changes(of_zero, histories, histories[int(np.argmax(of_zero))], priors))
    since, play_since = (_since(weights, histories[name]) for name in ("offset_since", "play_since"))
    flank_s = TUNED["joint_answer.flank_s"]
    recent = rows[play_since:]
    return Truck(
        offset=offset,
        own=own,
        whole=(min(own[0], whole[0]), max(own[1], whole[1])),
        accelerometer_bias=bias,
        accelerometer_bias_sd=math.sqrt(bias_variance),
        pull=pull,
        pull_sd=math.sqrt(pull_variance),
        pull_effect=abs(float(np.mean(table["per_pull"])) * pull),
        play=play,
        play_sd=math.sqrt(play_variance),
        neutral=neutral,
        neutral_sd=math.sqrt(neutral_variance),
        load_would_help=loads.differ_by() < LOADS_DIFFER,
        changes=changes,
        since=since,
        play_since=play_since,
        zero=zero,
        evidence_s=sum(r.used_s for r in rows[since:]),
        has_flanks=min(sum(r.left_s for r in recent), sum(r.right_s for r in recent)) >= flank_s,
        is_ambiguous=own[1] - own[0] > TUNED["truck_now.ambiguous"] * narrowest,
        offsets=offsets,
        offset_sds=offset_sds,
    )


def _not_negative(weights: Numbers, means: Numbers, covariances: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Weights, means and covariances of the histories where no play is negative: the moments of a normal density that
    is cut at zero, and what follows for the other states."""
    sd = np.sqrt(covariances[:, PLAY, PLAY])
    at_zero = np.maximum(-means[:, PLAY] / sd, -8.0)
    above = np.array([0.5 * math.erfc(x / math.sqrt(2.0)) for x in at_zero])
    above = np.maximum(above, _TINY)
    excess = np.exp(-0.5 * at_zero**2) / (math.sqrt(2.0 * math.pi) * above)
    share = np.clip(excess * (excess - at_zero), 0.0, 1.0)  # of the play's variance that goes
    per_play = covariances[:, :, PLAY] / sd[:, None]
    less = share[:, None, None] * per_play[:, :, None] * per_play[:, None, :]
    return weights * above / float(weights @ above), means + excess[:, None] * per_play, covariances - less


def _given_pull(means: Numbers, covariances: Numbers, prior_mean: float, identified: float) -> tuple[Numbers, Numbers]:
    """The offset's mean and variance from the driving, of each history: of a pull only the identified share counts."""
    per_pull = covariances[:, OFFSET, PULL] / np.maximum(covariances[:, PULL, PULL], _TINY)
    mean = means[:, OFFSET] + (1.0 - identified) * per_pull * (prior_mean - means[:, PULL])
    rest = covariances[:, OFFSET, OFFSET] - (1.0 - identified**2) * per_pull**2 * covariances[:, PULL, PULL]
    return mean, np.maximum(rest, 0.0)


def _mixed(weights: Numbers, means: Numbers, variances: Numbers) -> tuple[float, float]:
    mean = float(weights @ means)
    return mean, float(weights @ (variances + (means - mean) ** 2))


def _interval(weights: Numbers, means: Numbers, sds: Numbers) -> tuple[float, float]:
    """The 95 % interval of a mixture of normal densities, with 2.5 % on either side."""
    return _core.quantile(weights, means, sds, 0.025), _core.quantile(weights, means, sds, 0.975)


_FULL = np.array([[0, 1, 3], [1, 2, 4], [3, 4, 5]])  # of a lower triangle by rows


def _of_drives(
    table: npt.NDArray[np.void], play: tuple[float, float], neutral: tuple[float, float]
) -> tuple[Numbers, Numbers]:
    """The offset of each drive and its standard deviation, given the play and the neutral acceleration of the truck."""
    modes = table["mode"]
    information, vector = modes["information"][..., _FULL], modes["vector"].copy()
    information[..., 0, 0] += _ANYWHERE_INFORMATION
    for place, (value, variance) in ((1, play), (2, neutral)):
        own = 1.0 / (variance + table["noise"][:, place, None])
        information[..., place, place] += own
        vector[..., place] += own * value
    covariance = np.linalg.inv(information)
    mean = np.einsum("dmij,dmj->dmi", covariance, vector)
    level = modes["log_weight"] + 0.5 * np.einsum("dmi,dmi->dm", mean, vector) + 0.5 * np.linalg.slogdet(covariance)[1]
    level = np.where(np.arange(level.shape[1]) < table["modes"][:, None], level, -np.inf)
    weight = np.exp(level - level.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    offset = np.sum(weight * mean[..., 0], axis=1)
    variance = np.sum(weight * (covariance[..., 0, 0] + (mean[..., 0] - offset[:, None]) ** 2), axis=1)
    return offset, np.sqrt(variance + table["noise"][:, 0])


def _since(weights: Numbers, firsts: Numbers) -> int:
    """The most probable first drive."""
    total: dict[int, float] = {}
    for weight, first in zip(weights.tolist(), firsts.tolist(), strict=True):
        total[first] = total.get(first, 0.0) + weight
    return max(total, key=lambda first: total[first])


def _zero(weights: Numbers, histories: npt.NDArray[np.void]) -> Zero:
    for code, name in enumerate(_core.TRUCK_ZEROS):
        is_sure = float(weights[histories["zero"] == code].sum()) > TUNED["truck_now.sure"]
        if name != "fixed" and is_sure:
            return cast(Zero, name)
    return "fixed"


def _changes(weights: Numbers, histories: npt.NDArray[np.void], best: Any, priors: Priors) -> list[Change]:
    """Those of the most probable history that most histories share, with the values before and after."""
    drives, kinds = histories["change"]["drive"], histories["change"]["kind"]
    there = np.arange(drives.shape[1]) < histories["changes"][:, None]
    of_offset = _given_pull(best["mean"][None], best["covariance"].reshape(1, 7, 7), priors.pull_m_s2, 0.0)
    after = {False: (of_offset[0][0], of_offset[1][0]), True: (best["mean"][PLAY], best["covariance"][8])}
    found: list[Change] = []
    for drive, kind, *before in best["change"][: best["changes"]][::-1].tolist():
        for of_play, alike in _CHANGED.items():
            same = there & (drives == drive) & np.isin(kinds, alike)
            probability = float(weights @ same.any(axis=1))
            if kind in alike and probability > 0.5:
                was, was_variance = before[2:] if of_play else before[:2]
                value, variance = after[of_play]
                sd, name = math.sqrt(variance + was_variance), "play" if of_play else _core.TRUCK_CHANGES[kind]
                found.insert(0, Change(drive, name, was, float(value), float(value - was), sd, probability))
                after[of_play] = was, was_variance
    return found


# Kinds of changes of the play, and of the offset.
_CHANGED = {
    of_play: [_core.TRUCK_CHANGES.index(name) for name in names]
    for of_play, names in ((True, ("play", "both", "all")), (False, ("offset", "both", "alignment", "all")))
}
