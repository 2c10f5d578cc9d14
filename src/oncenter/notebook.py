"""Signals and answers in a notebook: a small HTML table in place of the repr."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from oncenter.offset.answer import Answer
    from oncenter.signals import Signals

_SHOWN_AS = {"rad": "deg", "rad_s": "deg_s", "m_s": "km_h"}  # by SI unit: the unit for people


def signals_table(signals: Signals) -> str:
    """A row a signal: unit, range, share of ticks without a number, rate and source."""
    from oncenter.signals import SIGNALS

    rows = []
    for name, source in signals.sources.items():
        signal = SIGNALS[name]
        unit = _SHOWN_AS.get(signal.quantity.unit, signal.quantity.unit)
        values = signals.columns[signal.column] / signal.quantity.factors[unit]
        numbers = values[values == values]
        span = f"{numbers.min():.4g} to {numbers.max():.4g}" if len(numbers) else "-"
        missing = f"{100.0 * (1.0 - len(numbers) / max(len(values), 1)):.0f} %"
        shown_unit = {"deg_s": "deg/s", "km_h": "km/h", "m_s2": "m/s^2", "nm": "N m", "1": ""}.get(unit, unit)
        rows.append((name, span, shown_unit, missing, f"{source.rate_hz:.0f} Hz", source.description))
    return _table(f"{signals.log}: {signals.length()}", ("signal", "range", "unit", "missing", "rate", "source"), rows)


def answer_table(answer: Answer) -> str:
    """The verdict and the answer in words, a row a quantity, then the findings."""
    from oncenter.verdict import verdicts_of

    rows = []
    for name, estimate in answer.quantities.items():
        given = estimate.to_dict()
        value = "-" if given["value"] is None else f"{given['value']:.3g}"
        interval = "-" if given["ci95"] is None else "{:.3g} to {:.3g}".format(*given["ci95"])
        rows.append((name, value, interval, given["unit"], given["status"]))
    verdict = f"<p><b>{escape(verdicts_of(answer)[0].words())}</b></p>"
    table = _table(answer.words(), ("quantity", "value", "95 % interval", "unit", "status"), rows)
    findings = "".join(f"<li>{escape(f'{each.severity}: {each.text}')}</li>" for each in answer.findings)
    return verdict + table + (f"<ul>{findings}</ul>" if findings else "")


def _table(caption: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    cells = "".join(f"<th>{escape(name)}</th>" for name in head)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    return f"<table><caption>{escape(caption)}</caption><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"
