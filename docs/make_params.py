"""Writes the rows of core/params.toml and core/tuned.toml into the C and into their pages: run it after any change.

The params are in core/truck/params.{h,c} and docs/params.md; the tuned constants in the C file that uses them, in
src/oncenter/tuned.py and in docs/tuned.md.

Needs nothing but Python, so that it also runs where the core does not compile.
"""

import math
import re
import textwrap
import tomllib
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
Group = dict[str, Any]  # its title, and its params by name


@cache
def table(name: str) -> dict[str, Group]:
    return tomllib.loads((ROOT / "core" / f"{name}.toml").read_text(encoding="utf-8"))


def groups() -> list[Group]:
    return list(table("params").values())


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
            about = f"{row['meaning']}. {row['default']}, {row['source']}"
            yield from with_comment(f"    double {name};", about)


def with_comment(line: str, about: str) -> Iterator[str]:
    """A line of C with its comment behind it, or above it if both are too long for one line."""
    indent = line[: len(line) - len(line.lstrip())]
    if len(line) + len(about) <= 113:
        yield f"{line} /* {about} */"
    else:
        yield from textwrap.wrap(f"/* {about} */", 120, initial_indent=indent, subsequent_indent=f"{indent} * ")
        yield line


def is_in_rad(name: str, row: Mapping[str, Any]) -> bool:
    """Whether the C has an angle that the table has in degrees."""
    return row["unit"].startswith("deg") and "_deg" not in name


def tuned(stem: str) -> Iterator[str]:
    """The constants of a C file."""
    for name, row in table("tuned")[stem].items():
        kind, unit = row.get("type", "float"), row["unit"]
        suffix = "f" if kind == "float" else ""
        if is_in_rad(name, row):
            unit = unit.replace("deg", "rad", 1)
            suffix += f" * {row.get('factor', '0.017453292f')}"
        if "size" in row:
            name += f"[{row['size']}]"
            value = f"{{{', '.join(f'{each!r}{suffix}' for each in row['value'])}}}"
        else:
            value = f"{row['value']!r}{suffix}"
        line = f"static const {kind} {name} = {value};"
        about = row["meaning"] if unit == "1" else f"{unit}: {row['meaning']}"
        yield from with_comment(line, about if len(line) + len(about) <= 113 else about.split(";")[0])


def defaults() -> Iterator[str]:
    return (f"    .{name} = {c_default(row['default'])}," for name, row in all_params())


def ranges() -> Iterator[str]:
    return (f"    {{{row['range'][0]!r}f, {row['range'][1]!r}f}}, /* {name} */" for name, row in all_params())


def names() -> Iterator[str]:
    listed = ", ".join(f'"{name}"' for name, _ in all_params())
    yield from textwrap.wrap(f"{listed},", 120, initial_indent="    ", subsequent_indent="    ")


BLOCKS: dict[str, Callable[[], Iterator[str]]] = {
    "members": members, "defaults": defaults, "ranges": ranges, "names": names,
}  # fmt: skip


def with_rows(source: str) -> str:
    """C source with new text in each block from `/* params.toml: NAME */`, or of tuned.toml, to `/* end */`."""

    def block(found: re.Match[str]) -> str:
        rows = tuned(found[3]) if found[2] == "tuned" else BLOCKS[found[3]]()
        return "\n".join([found[1], *rows, found[4]])

    return re.sub(r"(?ms)^( */\* (?:Tuned, in )?(params|tuned)\.toml: (\w+) \*/)$.*?^( */\* end \*/)$", block, source)


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


def tuned_module() -> str:
    rows = [
        f'    "{stem}.{name}": {row["value"] * (math.pi / 180.0 if is_in_rad(name, row) else 1.0)!r},'
        for stem, group in table("tuned").items()
        for name, row in group.items()
        if "size" not in row
    ]
    about = (
        "The core's tuned constants, by C file and name, in rad. Written by docs/make_params.py from core/tuned.toml."
    )
    return "\n".join([f'"""{about}"""', "", "TUNED = {", *rows, "}", ""])


def tuned_page() -> str:
    lines = [
        "# Tuned constants",
        "",
        "Numbers in the core that a bench or a drive fixed, or that somebody chose, each with its evidence. They are",
        "the same for all trucks; what an engineer sets for a truck is a [parameter](params.md). The columns small and",
        "large give the effect of a smaller and a larger value: measured if the source gives a figure, else by reading",
        "of the code. Rows in code type are those of the bench; seven characters in brackets are a commit, and",
        "`git show 72504e3^:CHANGELOG.md` has the figures of former versions.",
        "This page is written by `docs/make_params.py` from `core/tuned.toml`.",
    ]
    for stem, rows in table("tuned").items():
        lines += [
            "",
            f"## {stem}.c",
            "",
            "| name | value | meaning | small | large | source |",
            "|---|--:|---|---|---|---|",
        ]
        for name, row in rows.items():
            values = row["value"] if "size" in row else [row["value"]]
            value = ", ".join(f"{each:g}" for each in values) + ("" if row["unit"] == "1" else f" {row['unit']}")
            cells = (f"`{name}`", value, row["meaning"], row["small"], row["large"], row["source"])
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def made() -> dict[Path, str]:
    """The text of each file."""
    files = [*(f"params.{end}" for end in "hc"), *(f"{stem}.c" for stem in table("tuned"))]
    sources = [next((ROOT / "core").rglob(file)) for file in files]
    return {path: with_rows(path.read_text(encoding="utf-8")) for path in sources} | {
        ROOT / "docs" / "params.md": page(),
        ROOT / "docs" / "tuned.md": tuned_page(),
        ROOT / "src" / "oncenter" / "tuned.py": tuned_module(),
    }


if __name__ == "__main__":
    for path, text in made().items():
        if not path.exists() or path.read_text(encoding="utf-8") != text:  # else make would compile the core again
            path.write_text(text, encoding="utf-8", newline="\n")
