"""A commented vehicle file: every key is present, a key without a value is commented out."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from oncenter.files.toml_text import entry
from oncenter.vehicle_file.proposals import Proposal
from oncenter.vehicle_keys import KEYS, TABLES, Key

_WIDTH = 110  # characters of a comment
_HEAD = """\
# Vehicle file of oncenter.
# A line that begins with "#" and a key, such as "#mass_kg = 18000.0", is not in force: delete the "#" to give a value.
# All keys: docs/reference/vehicle_file.md; to check this file: oncenter vehicle check FILE
"""


def vehicle_text(values: Mapping[str, Any], proposals: Sequence[Proposal] = ()) -> str:
    """The text of a vehicle file.

    Args:
        values: as a vehicle file holds them, tables as mappings.
        proposals: entries of `[signals]`, for the user to check; their other candidates are written as comments.
    """
    lines = [_HEAD]
    for name, key in KEYS.items():
        if "." not in name:
            lines += [*_about(key), _entry(name, values.get(name, key.example), name in values), ""]
    for table in TABLES.values():
        lines += [*_about(table), *_table(table, values.get(table.name, {}), proposals), ""]
    return "\n".join(lines).rstrip() + "\n"


def _about(key: Key) -> Iterator[str]:
    """The comment above a key: its meaning; its range and default; where to find its value."""
    yield from _comment(key.meaning)
    range_ = f"Range: {key.range}. " if key.range else ""
    yield from _comment(f"{range_}Default: {key.without or 'none, the key is required'}.")
    if key.where:
        yield from _comment(f"Find it: {key.where}")


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, _WIDTH, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False)


def _entry(name: str, value: object, is_given: bool) -> str:
    return f"{'' if is_given else '#'}{entry(name, value)}"


def _table(table: Key, given: Mapping[str, Any], proposals: Sequence[Proposal]) -> Iterator[str]:
    proposed = [each for each in proposals if each.signal not in given] if table.name == "signals" else []
    yield f"{'' if given or proposed else '#'}[{table.name}]"
    yield from (_entry(name, value, True) for name, value in given.items())
    if table.name == "sensors":
        for name, key in KEYS.items():
            key_name = name.removeprefix("sensors.")
            if key_name != name and key_name not in given:
                yield from _about(key)
                yield _entry(key_name, key.example, False)
        return
    if proposed:
        yield from _proposed(proposed)
        return
    yield from (_entry(name, value, False) for name, value in table.example.items() if name not in given)


def _proposed(proposals: Sequence[Proposal]) -> Iterator[str]:
    """The best candidate of each signal in force, the others as comments below it."""
    files = ", ".join(dict.fromkeys(each.named.file for each in proposals if each.named.file))
    yield from _comment(
        f"Proposed{f' from {files}' if files else ''}: check name, unit and sign (-1 where right is positive). "
        "`oncenter signals LOG --vehicle FILE` names a wrong sign or unit."
    )
    for proposal in proposals:
        yield from _comment(proposal.remark)
        yield _entry(proposal.signal, proposal.entry(), True)
        for other in proposal.others:
            yield from _comment(f"Another candidate. {other.remark}".strip())
            yield _entry(other.signal, other.entry(), False)
