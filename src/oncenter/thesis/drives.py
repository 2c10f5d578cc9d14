"""Simulated drives of the thesis's truck, and of other trucks: shipped scenarios with changed values."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import oncenter as oc
from oncenter.files.toml_text import entry
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
        values = {"base": base, "about": "changed", **changes}
        file.write_text("\n".join(entry(*each) for each in values.items()), encoding="utf-8")
        return oc.simulate(file, seed)
