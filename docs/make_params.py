"""Writes the rows of core/*.toml into the C and into their pages: run it after any change.

The params are in core/truck/params.{h,c} and docs/params.md; the tuned constants in the C file that uses them, in
src/oncenter/tuned.py and in docs/tuned.md; the terms of the joint model in core/joint, in docs/method.md and in
src/oncenter/tuned.py; what changes between two drives in core/truck/between_drives.{h,c}, in docs/truck_over_time.md
and in src/oncenter/tuned.py.

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


TERMS = table("terms")
SUMS = {name: row["sum"] for name, row in TERMS.items() if "sum" in row}
SLOPES = [name for name, row in TERMS.items() if row.get("slope")]


def count() -> Iterator[str]:
    yield f"    OC_TERMS = {len(TERMS)}, /* of a hypothesis, without the offset */"


def term_names() -> Iterator[str]:
    for name, row in TERMS.items():
        about = f"/* {row['symbol']}, {row['unit']}: {row['meaning']} */"
        yield from textwrap.wrap(about, 120, initial_indent="    ", subsequent_indent="     * ")
        yield f"    {name},"


def slopes() -> Iterator[str]:
    return (f"    OC_SLOPE_{name}," for name in SLOPES)


def priors() -> Iterator[str]:
    return (f"    [{name}] = {{{', '.join(map(_c_number, row['prior']))}}}," for name, row in TERMS.items())


def sums() -> Iterator[str]:
    return (f"    sums[{name}] += {regressor};" for name, regressor in SUMS.items())


def weights() -> Iterator[str]:
    for name, row in TERMS.items():
        if "weight" in row:
            minus = "-" if row["weight"].startswith("-") else ""
            yield f"    design->of_sum[{name}] *= {minus}design->{row['weight'].lstrip('-')};"


def equation() -> Iterator[str]:
    """The terms that matter most come first."""
    line = "    delta_m - i L kappa = o"
    for row in reversed(TERMS.values()):
        if "regressor" in row:
            minus = row["regressor"].startswith("-")
            summand = f" {'-' if minus else '+'} {row['symbol']} {row['regressor'].lstrip('-')}"
            if len(line) + len(summand) > 100:
                yield line
                line = " " * 25
            line += summand
    yield f"{line} + noise"


def term_table() -> Iterator[str]:
    yield "| term | symbol | meaning | unit | prior: mean | sd | source of the prior |"
    yield "|---|---|---|---|--:|--:|---|"
    for name, row in reversed(TERMS.items()):
        mean, sd = row["prior"]
        cells = (name.lower(), row["symbol"], row["meaning"], row["unit"], mean, sd, row["source"])
        yield f"| {' | '.join(cells)} |"


def between_names() -> Iterator[str]:
    for name, row in table("between_drives").items():
        yield from with_comment(f"    OC_BETWEEN_{name},", f"{row['unit']}, {row['meaning']}")


def between_spreads() -> Iterator[str]:
    for name, row in table("between_drives").items():
        yield f"    [OC_BETWEEN_{name}] = {{{_c_number(row['at_ignition'])}, {_c_number(row['per_root_day'])}}},"


def between_table() -> Iterator[str]:
    yield "| quantity | unit | sd at an ignition | and per root of a day | source |"
    yield "|---|---|--:|--:|---|"
    for row in table("between_drives").values():
        cells = (row["meaning"], row["unit"], row["at_ignition"], row["per_root_day"], row["source"])
        yield f"| {' | '.join(cells)} |"


def _in_si(given: str) -> str:
    number, _, unit = given.partition(" ")
    return repr(float(number) * (math.pi / 180.0 if unit == "deg" else 1.0))


def _c_number(given: str) -> str:
    """`1.5 deg` as `1.5f * 0.017453292f`, which has the same bits on all machines."""
    number, _, unit = given.partition(" ")
    return f"{float(number)!r}f" + (" * 0.017453292f" if unit == "deg" else "")


BLOCKS: dict[str, dict[str, Callable[[], Iterator[str]]]] = {
    "params": {"members": members, "defaults": defaults, "ranges": ranges, "names": names},
    "terms": {"count": count, "names": term_names, "slopes": slopes, "priors": priors, "sums": sums,
              "weights": weights, "equation": equation, "table": term_table},
    "between_drives": {"names": between_names, "spreads": between_spreads, "table": between_table},
}  # fmt: skip
BLOCK = re.compile(
    r"(?ms)^( *(?:/\*|<!--) (?:Tuned, in )?(params|tuned|terms|between_drives)\.toml: (\w+) (?:\*/|-->))$"
    r".*?^( *(?:/\*|<!--) end (?:\*/|-->))$"
)


def with_rows(source: str) -> str:
    """The source with new text in each block between a comment `TABLE.toml: NAME` and the comment `end`."""

    def block(found: re.Match[str]) -> str:
        rows = tuned(found[3]) if found[2] == "tuned" else BLOCKS[found[2]][found[3]]()
        return "\n".join([found[1], *rows, found[4]])

    return BLOCK.sub(block, source)


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
    priors = [f'    "{name}": ({", ".join(map(_in_si, row["prior"]))}),' for name, row in TERMS.items()]
    between = [
        f'    "{name}": ({_in_si(row["at_ignition"])}, {_in_si(row["per_root_day"])}),'
        for name, row in table("between_drives").items()
    ]
    lines = [
        '"""Numbers of the core, angles in rad. Written by docs/make_params.py from the tables core/*.toml."""',
        "",
        *("TUNED = {  # by file and name", *rows, "}"),
        *("PRIORS = {  # mean and sd of each term", *priors, "}"),
        *("BETWEEN_DRIVES = {  # sd of each quantity's change at an ignition, and per root of a day", *between, "}"),
        "",
    ]
    return "\n".join(lines)


def tuned_page() -> str:
    lines = [
        "# Tuned constants",
        "",
        "Numbers in the core and in a truck's model that a bench or a drive fixed, or that somebody chose, each with",
        "its evidence. They are the same for all trucks; what an engineer sets for a truck is a",
        "[parameter](params.md). The columns small and large give the effect of a smaller and a larger value: measured",
        "if the source gives a figure, else by reading of the code. Rows in code type are those of the bench; seven",
        "characters in brackets are a commit, and `git show 72504e3^:CHANGELOG.md` has the figures of former versions.",
        "This page is written by `docs/make_params.py` from `core/tuned.toml`.",
    ]
    for stem, rows in table("tuned").items():
        lines += [
            "",
            "## truck/now.py" if stem == "truck_now" else f"## {stem}.c",
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
    pages = [ROOT / "docs" / name for name in ("method.md", "truck_over_time.md")]
    files = [*(ROOT / "core").rglob("*.[ch]"), *ROOT.glob("src/oncenter/truck/native/*.c"), *pages]
    texts = {path: path.read_text(encoding="utf-8") for path in files}
    return {path: with_rows(text) for path, text in texts.items() if BLOCK.search(text)} | {
        ROOT / "docs" / "params.md": page(),
        ROOT / "docs" / "tuned.md": tuned_page(),
        ROOT / "src" / "oncenter" / "tuned.py": tuned_module(),
    }


if __name__ == "__main__":
    for path, text in made().items():
        if not path.exists() or path.read_text(encoding="utf-8") != text:  # else make would compile the core again
            path.write_text(text, encoding="utf-8", newline="\n")
