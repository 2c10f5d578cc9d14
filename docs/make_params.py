"""Writes the rows of core/params.toml into core/truck/params.{h,c} and docs/params.md.

Needs nothing but Python, so that it also runs where the core does not compile.
"""

import re
import textwrap
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
Group = dict[str, Any]  # its title, and its params by name


def groups() -> list[Group]:
    return list(tomllib.loads((ROOT / "core" / "params.toml").read_text(encoding="utf-8")).values())


def params(group: Group) -> Iterator[tuple[str, dict[str, Any]]]:
    return ((name, row) for name, row in group.items() if name != "title")


def all_params() -> Iterator[tuple[str, dict[str, Any]]]:
    return (each for group in groups() for each in params(group))


def c_default(default: str) -> str:
    """`1.5 deg` as `1.5 * DEGREE`, in the order of operations that fixes the bits."""
    number, _, unit = default.partition(" ")
    value = " / ".join(repr(float(part)) for part in number.split("/"))
    value += " * DEGREE" if unit.startswith("deg") else ""
    return value + (" / 60.0" if unit.endswith("/min") else "")


def members() -> Iterator[str]:
    for group in groups():
        yield f"    /* {group['title']} */"
        for name, row in params(group):
            about = f"/* {row['meaning']}. {row['default']}, {row['source']} */"
            line = f"    double {name}; {about}"
            if len(line) <= 120:
                yield line
            else:
                yield from textwrap.wrap(about, 120, initial_indent=" " * 4, subsequent_indent="     * ")
                yield f"    double {name};"


def defaults() -> Iterator[str]:
    return (f"    .{name} = {c_default(row['default'])}," for name, row in all_params())


def ranges() -> Iterator[str]:
    return (f"    {{{row['range'][0]!r}f, {row['range'][1]!r}f}}, /* {name} */" for name, row in all_params())


def names() -> Iterator[str]:
    return (f'    "{name}",' for name, _ in all_params())


BLOCKS: dict[str, Callable[[], Iterator[str]]] = {
    "members": members, "defaults": defaults, "ranges": ranges, "names": names,
}  # fmt: skip


def with_rows(source: str) -> str:
    """C source with new text in each block between `/* params.toml: NAME */` and `/* end */`."""

    def block(found: re.Match[str]) -> str:
        return "\n".join([found[1], *BLOCKS[found[2]](), found[3]])

    return re.sub(r"(?ms)^( */\* params\.toml: (\w+) \*/)$.*?^( */\* end \*/)$", block, source)


def page() -> str:
    lines = [
        "# Parameters",
        "",
        "Tuning parameters: set them in a vehicle file's `[params]` or by `params=` in Python. Names end in the unit;",
        "an angle may also be given in degrees, as `_deg`. Numbers such as 5.1.1, and tables, are the thesis's.",
        "This page is written by `docs/make_params.py` from `core/params.toml`.",
    ]
    for group in groups():
        lines += ["", f"## {group['title']}", "", "| name | default | range | unit | meaning | source |"]
        lines += ["|---|--:|--:|---|---|---|"]
        for name, row in params(group):
            low, high = row["range"]
            between = f"{low:g} to {high:g}"
            cells = (f"`{name}`", row["default"], between, row["unit"], row["meaning"], row["source"])
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def made() -> dict[Path, str]:
    """The text of each file."""
    sources = (ROOT / "core" / "truck" / "params.h", ROOT / "core" / "truck" / "params.c")
    return {path: with_rows(path.read_text(encoding="utf-8")) for path in sources} | {
        ROOT / "docs" / "params.md": page()
    }


if __name__ == "__main__":
    for path, text in made().items():
        if path.read_text(encoding="utf-8") != text:  # else make would compile the core again
            path.write_text(text, encoding="utf-8", newline="\n")
