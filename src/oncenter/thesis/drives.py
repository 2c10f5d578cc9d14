"""Simulated drives of the thesis's truck, and of other trucks: shipped scenarios with changed values."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import oncenter as oc
from oncenter.signals import Signals
from oncenter.simulate.truth import Truth

SEED = 2016  # the seed of figures that show one drive; the thesis's year


def simulated(
    base: str, changes: Mapping[str, Mapping[str, Any]] | None = None, seed: int = SEED
) -> tuple[Signals, Truth]:
    """A drive of a shipped scenario with changed values.

    Args:
        base: its name.
        changes: by section, as a scenario file holds them: {"road": {"crown_percent": 7.0}}.
        seed: of its random numbers.

    Raises:
        OncenterError: as `oncenter.simulate`.
    """
    if not changes:
        return oc.simulate(base, seed)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{base}_changed.toml"
        file.write_text(_toml({"base": base, "about": "changed", **changes}), encoding="utf-8")
        return oc.simulate(file, seed)


def _toml(values: Mapping[str, Any]) -> str:
    return "".join(f"{key} = {_inline(value)}\n" for key, value in values.items())


def _inline(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_inline(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(value)
