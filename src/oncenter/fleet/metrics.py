"""A run's numbers in the text format of Prometheus, for the textfile collector of its node exporter."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from oncenter.files.whole_file import write_whole
from oncenter.verdict.states import OF_OFFSET

if TYPE_CHECKING:
    from oncenter.fleet.night import Summary

_ESCAPED = str.maketrans({"\\": r"\\", '"': r"\"", "\n": r"\n"})


def write_metrics(path: Path, summary: Summary) -> None:
    """A collector reads every file that ends in .prom: a half-written one does not, see `write_whole`.

    Raises:
        OncenterError: "output", exit code 2: it cannot be written.
    """
    write_whole(path, as_prometheus(summary, time.time()))


def as_prometheus(summary: Summary, end_s: float) -> str:
    """
    Args:
        end_s: of the run, s since 1970.
    """
    lines = [line for metric in _metrics(summary, end_s) for line in metric]
    return "\n".join(lines) + "\n"


def _metrics(summary: Summary, end_s: float) -> Iterator[list[str]]:
    unchanged = summary.logs_found - summary.logs_answered - summary.logs_refused - summary.logs_copied
    yield _metric("info", "Version of oncenter.", {f'version="{summary.version.translate(_ESCAPED)}"': 1})
    yield _metric("end_timestamp_seconds", "End of the last run that wrote its tables.", {"": end_s})
    yield _metric("run_seconds", "Duration of this run.", {"": summary.seconds})
    yield _metric("logs_per_second", "Rate while logs were answered.", {"": summary.logs_per_second})
    if summary.peak_memory_mb is not None:
        yield _metric("peak_memory_bytes", "Of the largest process.", {"": summary.peak_memory_mb * 1024.0**2})
    logs = {
        "answered": summary.logs_answered,
        "without_answer": summary.logs_refused,
        "copied": summary.logs_copied,
        "unchanged": unchanged,
    }
    yield _metric("logs", "Logs that this run found.", _by("result", logs))
    yield _metric("drives", "Drives in the tables.", {"": summary.drives})
    yield _metric("trucks", "Trucks by verdict.", _by("verdict", {code: summary.verdicts[code] for code in OF_OFFSET}))
    yield _metric("unread_logs", "Logs in the tables without an answer.", _by("reason", summary.refused))
    for kind, about in (
        ("unread", "Logs without an answer, oncenter's own files left out."),
        ("new-unread", "Of them those that had none of this reason last night."),
        ("new-calibrate", "Trucks to be calibrated that were not last night."),
        ("new-fault", "Trucks with a signal or sensor at fault that had none last night."),
        ("damaged", "Rows of the ledger, or ledgers, that were damaged and set apart."),
    ):
        yield _metric(kind.replace("-", "_"), about, {"": summary.kinds[kind]["count"]})


def _by(label: str, counts: Mapping[str, int]) -> dict[str, float]:
    return {f'{label}="{name.translate(_ESCAPED)}"': count for name, count in counts.items()}


def _metric(name: str, about: str, values: Mapping[str, float]) -> list[str]:
    """By labels; a metric without a value keeps its description."""
    whole = f"oncenter_fleet_{name}"
    lines = [f"{whole}{{{labels}}} {value!r}" if labels else f"{whole} {value!r}" for labels, value in values.items()]
    return [f"# HELP {whole} {about}", f"# TYPE {whole} gauge", *lines]
