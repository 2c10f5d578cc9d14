"""Values as TOML, by tomlkit: quotes and escapes. Order, comments and tables are the writer's."""

from __future__ import annotations

from collections.abc import Mapping

import tomlkit


def entry(name: str, value: object) -> str:
    """`name = value`; a name that is no bare key is quoted."""
    return f"{tomlkit.key(name).as_string()} = {toml(value)}"


def toml(value: object) -> str:
    """A number, text, truth, list or mapping as TOML in one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(entry(name, inner) for name, inner in value.items()) + " }" if value else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    return tomlkit.item(value).as_string()
