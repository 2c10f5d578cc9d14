"""A log that a plug-in reads, by the rules for CSV files."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

from oncenter.errors import OncenterError
from oncenter.read.dataframe import NoTable, samples_of_frame
from oncenter.read.identity import Identity
from oncenter.read.plugins import called
from oncenter.read.samples import Samples
from oncenter.signals import SignalName


def read_plugin(
    path: Path, plugin: EntryPoint, names: Mapping[str, SignalName], notes: list[str]
) -> tuple[list[Samples], Identity]:
    """Signals of a log that a plug-in reads, and its truck, by the rules for CSV files.

    Raises:
        OncenterError: "plugin_failed": it raised, or returned no table; else as `oncenter.read` of a CSV file.
    """
    try:
        frame: Any = plugin.load()(path)
    except (Exception, SystemExit) as error:
        first = (str(error).splitlines() or [""])[0][:200]
        what = str(error) if isinstance(error, OncenterError) else f"{type(error).__name__}: {first}"
        raise OncenterError(
            f"cannot read {path.name}: {called(plugin)} failed: {what}", code="plugin_failed"
        ) from error
    try:
        return samples_of_frame(frame, path, names, notes)
    except NoTable as wrong:
        raise OncenterError(
            f"cannot read {path.name}: {called(plugin)} returned no usable table: {wrong}", code="plugin_failed"
        ) from None
