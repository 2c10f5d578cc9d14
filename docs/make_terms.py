"""Writes the rows of core/terms.toml into core/joint and docs/method.md.

Needs nothing but Python, so that it also runs where the core does not compile.
"""

import re
import textwrap
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
JOINT = ROOT / "core" / "joint"
TERMS: dict[str, dict[str, Any]] = tomllib.loads((ROOT / "core" / "terms.toml").read_text(encoding="utf-8"))
COMPILED = {name: row["sum"] for name, row in TERMS.items() if "sum" in row}
SLOPES = [name for name, row in TERMS.items() if row.get("slope")]


def count() -> Iterator[str]:
    yield f"    OC_TERMS = {len(TERMS)}, /* of a hypothesis, without the offset */"


def names() -> Iterator[str]:
    for name, row in TERMS.items():
        about = f"/* {row['symbol']}, {row['unit']}: {row['meaning']} */"
        yield from textwrap.wrap(about, 120, initial_indent="    ", subsequent_indent="     * ")
        yield f"    {name},"


def slopes() -> Iterator[str]:
    return (f"    OC_SLOPE_{name}," for name in SLOPES)


def priors() -> Iterator[str]:
    return (f"        [{name}] = {{{', '.join(map(_c_number, row['prior']))}}}," for name, row in TERMS.items())


def sums() -> Iterator[str]:
    return (f"    sums[{name}] += {regressor};" for name, regressor in COMPILED.items())


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


def table() -> Iterator[str]:
    yield "| term | symbol | meaning | unit | prior: mean | sd | source of the prior |"
    yield "|---|---|---|---|--:|--:|---|"
    for name, row in reversed(TERMS.items()):
        mean, sd = row["prior"]
        cells = (name.lower(), row["symbol"], row["meaning"], row["unit"], mean, sd, row["source"])
        yield f"| {' | '.join(cells)} |"


def _c_number(given: str) -> str:
    """`1.5 deg` as `1.5f * 0.017453292f`, which has the same bits on all machines."""
    number, _, unit = given.partition(" ")
    return f"{float(number)!r}f" + (" * 0.017453292f" if unit == "deg" else "")


BLOCKS: dict[str, Callable[[], Iterator[str]]] = {
    "count": count, "names": names, "slopes": slopes, "priors": priors, "sums": sums, "weights": weights,
    "equation": equation, "table": table,
}  # fmt: skip


def with_rows(source: str) -> str:
    """The source with new text in each block between a comment `terms.toml: NAME` and the comment `end`."""

    def block(found: re.Match[str]) -> str:
        return "\n".join([found[1], *BLOCKS[found[2]](), found[3]])

    return re.sub(r"(?ms)^( *(?:/\*|<!--) terms\.toml: (\w+) .{2,3})$.*?^( *(?:/\*|<!--) end .{2,3})$", block, source)


def made() -> dict[Path, str]:
    """The text of each file."""
    in_core = (JOINT / name for name in ("triangle.h", "joint_model.h", "joint_model.c", "play.h", "hypothesis.c"))
    return {path: with_rows(path.read_text(encoding="utf-8")) for path in (*in_core, ROOT / "docs" / "method.md")}


if __name__ == "__main__":
    for path, text in made().items():
        if path.read_text(encoding="utf-8") != text:  # else make would compile the core again
            path.write_text(text, encoding="utf-8", newline="\n")
