"""Figure 15, drawn from the monitor's own source: its steps are the comments of `step` in monitor.c, in order."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from oncenter import _core
from oncenter.files.shipped import shipped
from oncenter.thesis.figure import INK, MUTED, OURS, THESIS, Claim, Exhibit, Figure, Progress
from oncenter.thesis.sketch import arrow, blank, box, label

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

Array = npt.NDArray[np.float64]

_RATE_HZ = 100.0
_PRINTED_CUTOFF_HZ = 3.0  # 5.1.1
_BAND_HZ = 2.0
_ROW_IN, _GAP_IN = 0.2, 0.2  # of the chart


@dataclass(frozen=True)
class Step:
    """One comment of `step`, the functions of other files that it calls, and the reasons that end a tick there."""

    text: str
    calls: tuple[str, ...]
    leaves_with: tuple[str, ...]


def run(progress: Progress) -> list[Exhibit]:
    """The chart, and the effect of 5.1.1's filter in the core."""
    core = shipped("core")
    found = steps(
        *(core.joinpath(name).read_text(encoding="utf-8") for name in ("monitor/monitor.c", "signals/motion.c"))
    )
    cutoff_hz, delay_s = _cutoff_hz(), _delay_s(np.linspace(0.2, _BAND_HZ, 10))
    design = _core.Core(3.7, 19.3, {}, _RATE_HZ).coefficients()["preprocess"]
    angle_delay_s = (design["delay_ticks"] + design["delay_fraction"]) / _RATE_HZ

    def draw(canvas: Canvas) -> None:
        _chart(canvas, found)

    return [
        Figure(
            "15",
            "The steps of the monitor for one tick",
            draw,
            "Each box is a step of core/monitor/monitor.c in the words of its source, with the section of the thesis "
            "and the core's functions that it calls; to the right, the reasons that end a tick there. Drawn from the "
            "source, "
            "so it shows the code that runs.",
            claims=(
                Claim(
                    "5.1.1",
                    "cut-off frequency of the low-pass, gain 1/√2",
                    _PRINTED_CUTOFF_HZ,
                    cutoff_hz,
                    "Hz",
                    "sines of yaw rate through the core, and its curvature",
                ),
                Claim(
                    "5.1.1",
                    "delay of the steering wheel angle, the filters' group delay around 0 to 2 Hz",
                    None,
                    1000.0 * angle_delay_s,
                    "ms",
                    f"the core's; mean phase delay of the same sines up to 2 Hz: {1000.0 * delay_s:.0f} ms",
                ),
            ),
            size_in=(5.2, (_height_in(found) + 0.75) * 5.2 / 6.2 + 0.1),
        )
    ]


def steps(monitor: str, motion: str) -> list[Step]:
    """The steps of `step` in monitor.c, in order, split at its own-line comments, with the calls of its own functions;
    the gate's reasons are those of `oc_gate` in motion.c."""
    body = _body(monitor, "static void step(")
    parts = re.split(r"^ +/\* (.+?) \*/$", body, flags=re.MULTILINE | re.DOTALL)[1:]
    codes = [_with_own_functions(code, monitor) for code in parts[1::2]]
    return [
        Step(" ".join(text.split()), _calls(code), _ends_with(code, motion))
        for text, code in zip(parts[::2], codes, strict=True)
    ]


def _with_own_functions(code: str, source: str) -> str:
    """Followed by the bodies of the functions of that source which it calls."""
    own = [name for name in re.findall(r"\b([a-z]\w+)\(", code) if re.search(rf"^static .*\b{name}\(", source, re.M)]
    bodies = (re.split(rf"^static .*\b{name}\(", source, maxsplit=1, flags=re.M)[1] for name in own)
    return "".join([code, *(body[: body.index("\n}\n")] for body in bodies)])


def _body(source: str, beginning: str) -> str:
    begin = source.index(beginning)
    return source[begin : source.index("\n}\n", begin)]


def _ends_with(code: str, motion: str) -> tuple[str, ...]:
    if "oc_gate(" in code:
        return _reasons(_body(motion, "uint32_t oc_gate("))
    return _reasons("".join(re.findall(r"tick->reasons = (?:tick->stands \? )?OC_REASON_\w+", code)))


def _calls(code: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(re.findall(r"\b(oc_\w+)\(", code)))


def _reasons(code: str) -> tuple[str, ...]:
    found = dict.fromkeys(re.findall(r"OC_REASON_(\w+)", code))
    return tuple(name.lower().replace("_", " ") for name in found)


def _passed(frequency_hz: float) -> tuple[float, float]:
    """Gain of the core's filter and its delay, s, by a least-squares sine through its output."""
    time = np.arange(0.0, 40.0, 1.0 / _RATE_HZ)
    speed, turned = 20.0, 0.01 * np.sin(2.0 * np.pi * frequency_hz * time)
    columns = {
        "time_s": time,
        "steering_wheel_angle_rad": np.zeros_like(time),
        "yaw_rate_rad_s": turned,
        "vehicle_speed_m_s": np.full_like(time, speed),
        "lateral_acceleration_m_s2": np.zeros_like(time),
    }
    outputs = np.zeros(len(time), _core.OUTPUT_DTYPE)
    _core.Core(3.7, 19.3, {}, _RATE_HZ).run(columns, outputs)
    late = time > 10.0
    phase = 2.0 * np.pi * frequency_hz * time[late]
    terms = np.column_stack([np.sin(phase), np.cos(phase)])
    sine, cosine = np.linalg.lstsq(terms, outputs["motion"]["curvature"][late] * speed / 0.01, rcond=None)[0]
    return float(np.hypot(sine, cosine)), float(-np.arctan2(cosine, sine) / (2.0 * np.pi * frequency_hz))


def _cutoff_hz() -> float:
    tried = np.linspace(2.0, 4.0, 41)
    gains = np.array([_passed(float(frequency))[0] for frequency in tried])
    return float(np.interp(-np.sqrt(0.5), -gains, tried))


def _delay_s(tried_hz: Array) -> float:
    return float(np.mean([_passed(float(frequency))[1] for frequency in tried_hz]))


def _chart(canvas: Canvas, found: list[Step]) -> None:
    axes = blank(canvas, (0.0, 6.2), (-_height_in(found), 0.75))
    box(axes, (2.3, 0.45), 3.0, 0.4, "tick: δ, r, $v_x$, $a_y$ (Table 3)", edgecolor=MUTED)
    arrow(axes, (2.3, 0.25), (2.3, 0.0))
    top = 0.0
    for step in found:
        rows = _rows(step)
        middle = top - 0.5 * _box_in(rows)
        box(axes, (2.3, middle), 4.4, _box_in(rows), "")
        for n, (text, colour, size) in enumerate(rows):
            label(axes, (2.3, middle + _ROW_IN * (0.5 * (len(rows) - 1) - n)), text, colour, fontsize=size, zorder=5)
        if step.leaves_with:
            arrow(axes, (4.5, middle), (4.85, middle), THESIS)
            label(
                axes, (4.92, middle), "left out for:\n" + "\n".join(step.leaves_with), THESIS, fontsize=7.5, ha="left"
            )
        top -= _box_in(rows) + _GAP_IN
        arrow(axes, (2.3, top + _GAP_IN), (2.3, top))
    label(axes, (2.3, top - 0.15), "offset $\\hat\\delta_o$, gradient, reasons", fontsize=8.5)


def _rows(step: Step) -> list[tuple[str, str, float]]:
    """Text, colour and size of each line in a step's box."""
    calls = ", ".join(call.removeprefix("oc_") for call in step.calls)
    lines = [(line, INK, 8.0) for line in textwrap.wrap(step.text, 54)]
    return lines + [(line, OURS, 6.8) for line in textwrap.wrap(calls, 64)]


def _box_in(rows: list[tuple[str, str, float]]) -> float:
    return _ROW_IN * len(rows) + 0.26


def _height_in(found: list[Step]) -> float:
    return sum(_box_in(_rows(step)) + _GAP_IN for step in found) + 0.35
