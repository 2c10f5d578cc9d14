"""Writes the rows of core/ecu/saved_layout.c, the numbers of a saved image, from the headers."""

import runpy
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
LAYOUT = ROOT / "core" / "ecu" / "saved_layout.c"
MEANING = 5  # raise it when a member keeps its name and type but changes its meaning
KINDS = {"double": "DOUBLES", "float": "FLOATS", "int32_t": "INTEGERS", "uint64_t": "COUNTS"}
WIDE = ("DOUBLES", "COUNTS")
ENUM = "ENUMS"
NOT_SAVED = "ready"  # a restored state is set ready when its image is found intact
WIDTH = 120

BEGIN, END = "/* docs/make_layout.py writes the following from the headers. */\n", "/* end */\n"

Number = tuple[str, str, int, int, int]  # name, kind and place; of structs in an array the step and their number


def numbers(ffi: Any, ctype: Any, name: str) -> Iterator[Number]:
    """All numbers in a type, with their places on this machine, bytes; of structs in an array those of the first."""
    if ctype.kind == "struct":
        for field, about in ctype.fields:
            for member, kind, place, step, times in numbers(ffi, about.type, f"{name}.{field}" if name else field):
                yield member, kind, place + about.offset, step, times
    elif ctype.kind == "array":
        step = ffi.sizeof(ctype.item)
        of_first = list(numbers(ffi, ctype.item, f"{name}[0]"))
        if len({kind for _, kind, *_ in of_first}) > 1:
            yield from ((member, kind, place, step, ctype.length) for member, kind, place, _, _ in of_first)
            return
        for k in range(ctype.length):
            for member, kind, place, _, _ in numbers(ffi, ctype.item, f"{name}[{k}]"):
                yield member, kind, place + k * step, 0, 1
    else:
        yield name, ENUM if ctype.kind == "enum" else KINDS[ctype.cname], 0, 0, 1


def rows(struct: str, found: list[Number]) -> Iterator[str]:
    """Numbers of one kind that follow one another without a gap."""

    def row(first: str, kind: str, count: int, step: int, times: int) -> str:
        if times == 1:
            return f"{kind}({struct}, {first}, {count}),"
        return f"{kind}_OF_EACH({struct}, {first}, {count}, {first.partition('[0]')[0]}),"

    first, kind, count, end, each = "", "", 0, -1, (0, 1)
    for name, of, place, step, times in found:
        if (of, place, (step, times)) != (kind, end, each):
            if count:
                yield row(first, kind, count, *each)
            first, kind, count, each = name, of, 0, (step, times)
        count += 1
        end = place + (8 if of in WIDE else 4)
    yield row(first, kind, count, *each)


def table(name: str, struct: str, found: list[Number]) -> str:
    lines = [f"static const oc_saved_run {name}[] = {{"]
    for row in rows(struct, found):
        joined = f"{lines[-1]} {row}"
        if len(lines) > 1 and len(joined) <= WIDTH:
            lines[-1] = joined
        else:
            lines.append(f"    {row}")
    return "\n".join([*lines, "};"])


def made() -> dict[Path, str]:
    """The text of the file."""
    ffi = runpy.run_path(str(ROOT / "liboncenter.py"))["ffi"]
    state = [row for row in numbers(ffi, ffi.typeof("oc_state"), "") if row[0] != NOT_SAVED]
    coefficients = numbers(ffi, ffi.typeof("oc_coefficients"), "")
    keyed = [row for row in coefficients if row[0].startswith(("vehicle.", "params.")) or row[0] == "rate_hz"]
    hashed = "\n".join([str(MEANING), *(f"{name} {kind} {times}" for name, kind, _, _, times in state)])
    parts = [
        f"/* Derived. */\nstatic const uint32_t layout_hash = 0x{zlib.crc32(hashed.encode()):08X}u;",
        table("state_runs", "oc_state", state),
        table("keyed_runs", "oc_coefficients", keyed),
    ]
    before, _, rest = LAYOUT.read_text(encoding="utf-8").partition(BEGIN)
    return {LAYOUT: before + BEGIN + "\n\n".join(parts) + "\n" + END + rest.partition(END)[2]}


if __name__ == "__main__":
    for path, text in made().items():
        if path.read_text(encoding="utf-8") != text:  # else make would compile the core again
            path.write_text(text, encoding="utf-8", newline="\n")
