"""The page as text: the verdict first, then truck and numbers, the two main figures, the rest, and the provenance."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from oncenter.estimates.by_priors import PRIORS_IN_WORDS, ByPrior, OffsetBy
from oncenter.offset.answer import NOT_YET_OR_NO_MORE
from oncenter.report.course import Course, course
from oncenter.report.document import (
    document,
    duration,
    embedded,
    joined,
    key,
    nothing,
    number,
    sentence,
    status,
    table,
    typeset,
)
from oncenter.report.legend import legend
from oncenter.report.origin import Origin
from oncenter.report.plots import STRIP_NAMES, figures, limits_near_course
from oncenter.report.truck_part import of_truck, truck_section
from oncenter.report.verdict_part import verdict_header
from oncenter.signals import DEGREE, SIGNALS
from oncenter.verdict import verdicts_of

if TYPE_CHECKING:
    from oncenter.estimates.estimate import Estimate
    from oncenter.offset.answer import Answer

_QUANTITIES = {
    "offset": "Straight-ahead offset",
    "backlash": "Free play, at the steering wheel",
    "understeer_gradient": "Understeer gradient <i>K</i><sub>us</sub>/<i>g</i>, at the road wheel",
    "unloading_acceleration": "Neutral lateral acceleration",
    "yaw_rate_bias": "Yaw rate sensor bias",
    "lateral_acceleration_bias": "Accelerometer bias, lateral",
}
_WITHOUT_RATIO = {  # in place of the understeer gradient
    "understeer_at_steering_wheel": "Understeer, at the steering wheel",
    "ratio_times_wheelbase": "Steering ratio times wheelbase",
}
_CAUSES = {
    "pull": "by a pull, not identifiable from one drive",
    "mean_wind": "by the mean crosswind, not identifiable either",
    "axle_set_up": "by an axle set up for the crown, not identifiable either",
    "axle_layout": "by the axle layout, which is not given",
}
_OF_BOTH_AXLES = {
    "combined_offset": "Combined offset of the front and the rear axle's sensors",
    "rear_axle_offset": "Offset of the rear axle's sensor, road wheels",
}
_UNSIGNED = ("backlash", "understeer_gradient", *_WITHOUT_RATIO)


def page(answer: Answer, rows: npt.NDArray[Any], origin: Origin | None = None) -> str:
    """The whole HTML document for an answer and its `outputs_of` (oncenter.offset.run); by default of no origin."""
    drive = course(answer, rows)
    pictures = figures(answer, drive)
    script, divs = embedded(pictures)
    body = f"""{verdict_header(verdicts_of(answer), f"{answer.vehicle.name} · {answer.log}")}
<div class="facts">
{truck_section(answer, origin or Origin())}
{_quantities(answer)}
</div>
{_findings(answer)}
{_main_pictures(answer, drive, divs)}
{_time(answer)}
{_by_priors(answer)}
{_pictures(answer, drive, divs)}
{_provenance(answer)}"""
    return document(f"Straight-ahead offset: {answer.log}", body, script)


def _quantities(answer: Answer) -> str:
    lines, titles = [], dict(_QUANTITIES)
    if "steering_ratio" in answer.vehicle.assumed:
        del titles["understeer_gradient"]
        titles |= _WITHOUT_RATIO
    if answer.combined_offset is not None:
        titles = {"offset": titles["offset"], **_OF_BOTH_AXLES, **titles}
    for name, title in titles.items():
        estimate: Estimate = getattr(answer, name)
        number, interval = _number_and_interval(estimate, signed=name not in _UNSIGNED)
        given = estimate.to_dict()
        unit = typeset(given["unit"]) if number != "—" else ""
        looks = ' class="not-valid"' if given["status"] in NOT_YET_OR_NO_MORE else ""
        lines.append(
            f'<tr{looks}><th scope="row">{title}</th><td class="number">{number} <span class="unit">{unit}</span></td>'
            f'<td class="number interval{"" if interval != "—" else " none"}">{interval}</td>'
            f"<td>{status(given['status'])}</td></tr>"
        )
        if name == "offset" and answer.not_identifiable:
            lines += _parts(answer)
    return f"""<section class="numbers">
<h2>Numbers</h2>
<table class="quantities">
<thead><tr><th>Quantity</th><th class="number">Value</th><th class="number">95 % interval</th>
<th>Status</th></tr></thead>
<tbody>
{joined(lines)}
</tbody>
</table>
<p class="quiet">The straight-ahead offset is the sensor's reading at zero lateral force, at the midpoint of the
free play. Left is positive. The true angle is the measured angle less the offset.</p>
</section>"""


def _by_priors(answer: Answer) -> str:
    """The whole interval by halved and doubled priors, and the drive's part where the prior is inside it."""
    now = answer.offset_now
    if not answer.by_priors or now is None:
        return ""

    def interval(by: OffsetBy, inside_drive: bool) -> str:
        ends = [by.ci95_drive, by.ci95] if inside_drive else [by.ci95]
        return "; ".join(f"{number(low / DEGREE, 2, True)} to {number(high / DEGREE, 2, True)}" for low, high in ends)

    lines = [
        f'<tr><th scope="row">{PRIORS_IN_WORDS[each.prior]}, {each.size:.2g}{_unit_of(each)}</th>'
        f'<td class="number" data-label="by half">{interval(now + each.halved, each.inside_drive)}</td>'
        f'<td class="number" data-label="by twice">{interval(now + each.doubled, each.inside_drive)}</td></tr>'
        for each in answer.by_priors
    ]
    return f"""<section class="numbers screen-only">
<h2>Dependence on priors</h2>
<p>The 95 % interval of the offset (deg) where a prior is half or twice as large. The prior of the accelerometer's
zero also changes the part from the driving, which stands first.</p>
<table class="quantities">
<thead><tr><th>Prior</th><th class="number">by half</th><th class="number">by twice</th></tr></thead>
<tbody>
{joined(lines)}
</tbody>
</table>
</section>"""


def _unit_of(each: ByPrior) -> str:
    return " of all axles" if each.prior == "axle_set_up" else " m/s² (sd)"


def _parts(answer: Answer) -> list[str]:
    """Rows of the offset's interval: the part of this drive, and each cause that no single drive identifies."""
    of_drive = answer.offset_half_width_rad or 0.0
    rows = [("from this drive, without a pull", of_drive, "")]
    rows += [
        (_CAUSES[cause.cause], 1.96 * cause.sd_rad, f"assumed: {cause.prior.sd_m_s2:.2g} m/s² (sd)")
        for cause in answer.not_identifiable
        if cause.sd_rad > 0.0
    ]
    return [
        f'<tr class="part"><th scope="row">{title}</th><td class="number none"></td>'
        f'<td class="number interval">± {number(half_width_rad / DEGREE, 2, False)}</td>'
        f'<td class="quiet">{prior}</td></tr>'
        for title, half_width_rad, prior in rows
    ]


def _findings(answer: Answer) -> str:
    if not answer.findings:
        return ""
    lines = [
        f'<li class="{escape(finding.severity)}"><b>{escape(finding.severity)}</b> {sentence(finding.text)}</li>'
        for finding in answer.findings
    ]
    return f'<section>\n<h2>Findings</h2>\n<ul class="findings">\n{joined(lines)}\n</ul>\n</section>'


def _time(answer: Answer) -> str:
    whole = max(answer.duration_s, 1e-9)
    meanings = _reasons(answer)
    lines = [_bar("Used", answer.used_s, whole, "used")]
    lines += [
        _bar(f"{meanings[reason]} <i>{STRIP_NAMES[reason]}</i>", seconds, whole, "rejected")
        for reason, seconds in sorted(answer.rejected_s.items(), key=lambda item: -item[1])
        if seconds > 0.0
    ]
    return f"""<section class="screen-only">
<h2>Time used and rejected</h2>
<p>{duration(answer.used_s)} of {duration(answer.duration_s)} used for the offset, {duration(answer.unused_s)} not.
Reasons overlap, so they may sum to more than that.</p>
<div class="bars">
{joined(lines)}
</div>
</section>"""


def _bar(label: str, seconds: float, whole: float, colour: str) -> str:
    share = 100.0 * min(seconds / whole, 1.0)
    return (
        f'<div class="bar"><span>{label}</span><span class="number">{duration(seconds)}</span>'
        f'<span class="track"><span class="{colour}" style="width:{share:.2f}%"></span></span></div>'
    )


def _reasons(answer: Answer) -> dict[str, str]:
    """The meaning of each reason of the gate, with the limits in force."""
    params, jointly = answer.params, answer.method == "joint"
    of = "joint_" if jointly else ""
    speed = params[f"{of}speed_min_m_s"]
    return {
        "missing_signal": "A signal not available",
        "time": "Time stood still or ran backward",
        "signal_fault": "A signal that is not what its name says",
        "gap": f"First tick after a hole of more than {params['gap_max_s']:g} s",
        "settling": "Filters settling",
        "speed": f"Slower than {speed:g} m/s ({3.6 * speed:.0f} km/h)",
        "curvature": f"In a bend tighter than {1.0 / params[f'{of}curvature_max_1_m']:.0f} m",
        "lateral_acceleration": (
            f"Lateral acceleration above {params['joint_lateral_acceleration_max_m_s2']:g} m/s²: tyres and axles bend "
            "the line"
        ),
        "yaw_rate_bias": "Yaw rate bias moving faster than it can be followed",
        "longitudinal_acceleration": (
            f"Speeding up or braking by more than {params[f'{of}longitudinal_acceleration_max_m_s2']:g} m/s²"
        ),
        "bank": (
            f"a<sub>y</sub> − r·v farther than {params['joint_bank_change_max_m_s2']:g} m/s² from its mean: kerbs"
            if jointly
            else f"Road bank or accelerometer bias, |a<sub>y</sub> − r·v| above {params['bank_max_m_s2']:g} m/s²"
        ),
        "intervention": "Stability control or anti-lock brakes active, or until a second ago",
        "reverse": "Driving backward",
        "steering_assist": "A steering assistance active: the position in the free play is unknown",
        "window": "No whole second clean, or in doubt while a change was suspected"
        if jointly
        else f"Not clean for {params['clean_time_s']:g} s on end",
    }


def _main_pictures(answer: Answer, drive: Course, divs: Mapping[str, str]) -> str:
    """The offset over time and the play: the second printed page."""
    jointly = answer.method == "joint"
    clean = "Nothing to draw: no tick passed the gate. The strip below gives the reasons."
    bands = (
        "; inner band: 95 % from this drive, outer band: with causes not identifiable from one drive"
        if answer.not_identifiable
        else ", with its 95 % interval"
    )
    offset_key = {"estimate": f"offset as estimated up to then{bands}"}
    if "offset" in divs:
        offset_key["measured_dashed"] = (
            f"limit ±{answer.vehicle.offset_limit_deg:g} deg{_out_of_picture(answer, drive)}"
        )
    if drive.changes:
        offset_key["rejected_dashed"] = "a change"
    return joined(
        [
            '<div class="main-figures">\n<section>\n<h2>For the engineer: straight-ahead offset over time</h2>',
            _several(drive),
            key(**offset_key) if "offset" in divs else "",
            divs.get("offset", nothing("No offset with an interval was estimated at any time.")),
            "</section>\n<section>\n<h2>Free play: residual against lateral acceleration</h2>",
            f"<p>The residual is the measured angle less the Ackermann angle i·L·r/v, at all ticks that passed the "
            f"gate{_since(answer, drive)}. Free play shows as two parallel lines, one for each flank.</p>",
            (_key_of_flanks(answer) if jointly else _key_of_cloud(answer)) if "cloud" in divs else "",
            divs.get("cloud", nothing(clean)),
            legend() if jointly else "",
            '<p class="quiet print-only">The HTML page has further figures, the parameters and the sources.</p>',
            "</section>\n</div>",
        ]
    )


def _out_of_picture(answer: Answer, drive: Course) -> str:
    """Where the limit is too far from the offset to be drawn."""
    limits = limits_near_course(answer, drive)
    if len(limits) == 2:
        return ""
    return f", of which {number(-limits[0], 1, True)} is outside the picture" if limits else ", outside the picture"


def _several(drive: Course) -> str:
    count = len(drive.starts)
    return f"<p>{count} logs, one after the other, separated by dotted lines.</p>" if count > 1 else ""


def _pictures(answer: Answer, drive: Course, divs: Mapping[str, str]) -> str:
    return joined(
        [
            '<section class="screen-only">\n<h2>The drive</h2>',
            _several(drive),
            key(measured="measured", estimate=f"expected from the motion without offset, {_expected(answer)}"),
            divs.get("angle", nothing("The log has no steering wheel angle.")),
            divs.get("speed", ""),
            divs.get("yaw_rate", ""),
            key(measured="measured (specific force)", estimate="r·v; the difference is the road's bank or a bias")
            if drive.lateral_acceleration is not None
            else key(estimate="r·v, in place of an accelerometer"),
            divs.get("lateral_acceleration", ""),
            key(estimate="yaw rate bias as estimated at the time, with its 95 % interval")
            if "yaw_rate_bias" in divs
            else "",
            divs.get("yaw_rate_bias", ""),
            '</section>\n<section class="screen-only">\n<h2>The gate</h2>',
            key(used="used for the offset", rejected="rejected, one row per reason as named under Time above"),
            divs.get("gate", nothing("The drive has no tick.")),
            '</section>\n<section class="screen-only">\n<h2>Understeer gradient</h2>',
            _understeer(answer, divs),
            "</section>",
        ]
    )


def _expected(answer: Answer) -> str:
    if answer.method != "joint":
        return "i·L·r/v + i·K<sub>us</sub>·a<sub>y</sub>"
    return "i·L·r/v + i·K<sub>us</sub>·(a<sub>y</sub> − a<sub>0</sub>) + the position in the play; r corrected"


def _since(answer: Answer, drive: Course) -> str:
    if drive.begin_of_offset == 0.0:
        return ""
    return f" since the offset last changed, {drive.begin_of_offset:.1f} {drive.time_unit} into the drive"


def _key_of_cloud(answer: Answer) -> str:
    if not _known(answer.offset):
        return key(used="clean ticks")
    return key(used="clean ticks", estimate="offset + i·K<sub>us</sub>·a<sub>y</sub>, with the offset's 95 % interval")


def _key_of_flanks(answer: Answer) -> str:
    lines = {
        "used_up": "left flank of the play",
        "right_down": "right flank",
        "measured": "in between",
    }
    if _known(answer.offset):
        lines["estimate"] = "offset ± half the play + i·K<sub>us</sub>·(a<sub>y</sub> − a<sub>0</sub>)"
        lines["rejected"] = "offset at the neutral lateral acceleration a<sub>0</sub>, with their 95 % intervals"
    return key(**lines)


def _understeer(answer: Answer, divs: Mapping[str, str]) -> str:
    jointly = answer.method == "joint"
    low, high = (answer.params[f"understeer_acceleration_{end}_m_s2"] for end in ("min", "max"))
    if "bends" not in divs:
        return nothing(
            "Not estimated: no second was used."
            if jointly
            else f"Not estimated: it needs a trusted offset, and bends of {low:g} to {high:g} m/s² that only the "
            "curvature limit rejects. It was taken as zero."
        )
    ticks = "ticks used" if jointly else f"ticks in bends of {low:g} to {high:g} m/s²"
    line = f"i·K<sub>us</sub>·{'(a<sub>y</sub> − a<sub>0</sub>)' if jointly else 'a<sub>y</sub>'}, 95 %"
    return f"""<div class="pair">
<div>{key(estimate="K<sub>us</sub>/g as estimated up to then; band: 95 % interval of the last")}
{divs["understeer"]}</div>
<div>{key(used=ticks, estimate=line)}
{divs["bends"]}</div>
</div>"""


def _provenance(answer: Answer) -> str:
    vehicle = answer.vehicle
    truck = {
        "Vehicle": escape(vehicle.name),
        **of_truck(vehicle),
        "Method": escape(answer.method),
        "Version": f"oncenter {escape(answer.version)}",
    }
    logs = [f"{escape(d.log)} <span class=quiet>{d.ticks} ticks at {d.rate_hz:g} Hz</span>" for d in answer.drives]
    truck["Logs" if len(logs) > 1 else "Log"] = "<br>".join(logs)
    sources = {_signal_name(name): escape(text) for name, text in answer.sources.items()}
    params = dict(_param(name, value) for name, value in answer.params.items())
    notes = "".join(f"<li>{escape(note)}</li>" for note in answer.notes)
    return f"""<section class="provenance screen-only">
<h2>Provenance</h2>
{table(truck)}
<h3>Signals and their sources</h3>
{table(sources)}
{f"<h3>Notes</h3><ul>{notes}</ul>" if notes else ""}
<details><summary>Parameters in force</summary>
{table(params)}
</details>
</section>"""


def _signal_name(name: str) -> str:
    symbol = SIGNALS[name].symbol if name in SIGNALS else ""
    return escape(name.replace("_", " ")) + (f" <i>{escape(symbol)}</i>" if symbol else "")


def _param(name: str, value: float) -> tuple[str, str]:
    """A param as in a vehicle file: angles in deg. A narrow window breaks the name after an underscore."""
    parts = name.split("_")
    shown = escape("_".join("deg" if part == "rad" else part for part in parts)).replace("_", "_<wbr>")
    return shown, f"{value / DEGREE if 'rad' in parts else value:.4g}"


def _known(estimate: Estimate) -> bool:
    return estimate.status != "unobservable" and estimate.value is not None


def _number_and_interval(estimate: Estimate, signed: bool) -> tuple[str, str]:
    """Value and interval in the page's unit with as many digits as the interval bears; a dash for what there is not."""
    given = estimate.to_dict()
    if not _known(estimate):
        return "—", "—"
    if given["ci95"] is None:
        return number(given["value"], 2, signed), "—"
    low, high = given["ci95"]
    digits = 1 if high - low > 4.0 else 2 if high - low > 0.1 else 3
    return number(given["value"], digits, signed), f"{number(low, digits, signed)} to {number(high, digits, signed)}"
