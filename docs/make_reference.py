"""Writes docs/reference/: commands.md, vehicle_file.md, json.md and the JSON schemas, from the program itself.

Run it after a change of an option, of a key of the vehicle file or of a JSON object.
"""

from __future__ import annotations

import inspect
import json
import re
import runpy
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from typer.main import get_command

from oncenter.cli import EXIT_CODES
from oncenter.cli.program import program_of
from oncenter.files.toml_text import entry
from oncenter.vehicle import tandem_side_force_m2_s2
from oncenter.vehicle_file.written import vehicle_text
from oncenter.vehicle_keys import KEYS, SIGNAL_ENTRY, TABLES, Key

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "reference"
_MADE = "This page is written by `docs/make_reference.py`."
_TYPES = {bool: "flag", int: "whole number", float: "number", str: "text", Path: "path"}
Schema = Mapping[str, Any]


def table(head: tuple[str, ...], cells: Iterator[tuple[str, ...]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield f"|{'---|' * len(head)}"
    for row in cells:
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"


# commands.md


def commands_page() -> str:
    lines = [
        "# Commands",
        "",
        "Every command and option. `oncenter COMMAND -h` shows the same in a terminal.",
        _MADE,
        "",
        "Shells complete commands, options, names of shipped vehicle files and scenarios, and signals after",
        "`oncenter --install-completion` (bash, zsh, fish, PowerShell).",
        "",
        "## Exit codes",
        "",
        *table(("code", "meaning"), ((str(code), meaning) for code, meaning in EXIT_CODES.items())),
        "",
        "An error is one line on standard error; with `--json` also an object of the schema",
        "[error-1](json.md#error-1) on standard output.",
    ]
    for path, command in commands():
        lines += ["", *_command(path, command)]
    return "\n".join([*lines, ""])


def commands() -> Iterator[tuple[str, Any]]:
    """Every command with its whole name, the program itself first."""
    yield from _below("oncenter", get_command(program_of()))


def _below(path: str, command: Any) -> Iterator[tuple[str, Any]]:
    yield path, command
    for name, each in getattr(command, "commands", {}).items():
        yield from _below(f"{path} {name}", each)


def _command(path: str, command: Any) -> Iterator[str]:
    yield f"## {path}"
    yield ""
    yield from (" ".join(part.split()) + "\n" for part in (command.help or "").split("\n\n") if part.strip())
    yield f"```\n{_usage(path, command)}\n```"
    parameters = [each for each in command.params if each.name != "help"]
    if parameters:
        yield ""
        types, helps = _types(command), helps_of(command)
        rows = (_row(each, types.get(each.name, bool), helps[each.name]) for each in parameters)
        yield from table(("option", "value", "default", "meaning"), rows)
    example = re.search(r"oncenter .*", command.epilog or "", re.DOTALL)
    if example and not hasattr(command, "commands"):
        yield f"\nExample:\n\n```sh\n{' '.join(example[0].split())}\n```"


def _usage(path: str, command: Any) -> str:
    needed = [_called(each) for each in command.params if each.required]
    free = [f"[{_called(each)}]" for each in command.params if _is_argument(each) and not each.required]
    options = any(not _is_argument(each) and not each.required for each in command.params)
    rest = ["COMMAND"] if hasattr(command, "commands") else []
    return " ".join([path, *needed, *free, *(["[OPTIONS]"] if options else []), *rest])


def _called(parameter: Any) -> str:
    name = (parameter.metavar or parameter.name.upper()).strip("[]")
    return name if _is_argument(parameter) else f"{parameter.opts[0]} {name}"


def _is_argument(parameter: Any) -> bool:
    return bool(parameter.param_type_name == "argument")


def _row(parameter: Any, kind: Any, about: str) -> tuple[str, ...]:
    choices, plain = _choices(kind), _TYPES.get(_plain(kind), "text")
    value = ", ".join(f"`{each}`" for each in choices) or (parameter.metavar or "").strip("[]") or plain
    if plain in ("number", "whole number") and parameter.metavar:
        value = f"{value} ({plain})"
    repeated = ", repeatable" if parameter.multiple else ""
    if parameter.required:
        default = "required"
    elif parameter.default in (None, False) or callable(parameter.default):
        default = ""
    else:
        default = f"`{parameter.default}`"
    names = f"`{_called(parameter)}`" if _is_argument(parameter) else ", ".join(f"`{name}`" for name in parameter.opts)
    return names, f"{value}{repeated}", default, " ".join(about.split())


def helps_of(command: Any) -> Mapping[str, str]:
    """By parameter, its help. Typer 0.19 with a newer click loses that of arguments, which the function still has."""
    annotated = get_type_hints(inspect.unwrap(command.callback), include_extras=True) if command.callback else {}
    declared = {
        name: each.help
        for name, kind in annotated.items()
        for each in getattr(kind, "__metadata__", ())
        if getattr(each, "help", None)
    }
    return {each.name: each.help or declared.get(each.name, "") for each in command.params}


def _types(command: Any) -> Mapping[str, Any]:
    """By parameter, its type: click's own differ between versions of Typer."""
    return get_type_hints(inspect.unwrap(command.callback)) if command.callback else {}


def _plain(kind: Any) -> Any:
    """The type without None and without the list of an option that may be repeated."""
    if get_origin(kind) in (Union, UnionType):
        return _plain(next(each for each in get_args(kind) if each is not type(None)))
    return _plain(get_args(kind)[0]) if get_origin(kind) is list else kind


def _choices(kind: Any) -> tuple[str, ...]:
    plain = _plain(kind)
    return get_args(plain) if get_origin(plain) is Literal else ()


# vehicle_file.md


def vehicle_page() -> str:
    lines = [
        "# Vehicle file",
        "",
        "A TOML file that describes the truck. `wheelbase_m` and `steering_ratio` are enough; the other keys narrow",
        "the interval, name the signals of logs that are not J1939, or change parameters. The smallest file:",
        "",
        "```toml",
        'name = "truck 17"',
        "wheelbase_m = 3.7",
        "steering_ratio = 19.3",
        "```",
        "",
        "- `oncenter vehicle new truck.toml` writes a file with all keys explained, and prompts for values.",
        "- `oncenter vehicle check truck.toml [LOG]` checks a file, and whether a log has the signals that it names.",
        "- `oncenter vehicle list` shows the files that come with oncenter; `--vehicle` takes their names.",
        "",
        _MADE,
        "",
        "## Keys",
        "",
        *table(
            ("key", "unit", "range", "default", "meaning"),
            (_key(key) for name, key in KEYS.items() if "." not in name),
        ),
        "",
        "## Where to find the values",
        "",
        *(f"- `{key.name}`: {key.where}" for name, key in KEYS.items() if key.where and "." not in name),
        "",
        "## Axle layouts",
        "",
        "Rear axles that resist turning load the front axle in bends. oncenter sets a parameter for it:",
        "",
        *table(
            ("`axle_layout`", "`tandem_side_force_m2_s2`, (m/s)^2"),
            ((f"`{layout}`", f"{force:g}") for layout, force in tandem_side_force_m2_s2().items()),
        ),
        "",
        "The wheelbase of a truck with several rear axles is the equivalent wheelbase (Winkler): that of a two-axle",
        "truck which turns alike. It is the distance from the first axle to the middle of the rear axles, plus 0.3 to",
        "0.6 m.",
        "oncenter compares it with the bends of the drive and reports a value that does not fit.",
        "",
        "## Steering ratio",
        "",
        "A number is the steering wheel angle per front wheel angle. If the gear's ratio varies with the angle, give",
        "the polynomial from the steering wheel angle to the front wheel angle, both in rad, lowest power first:",
        "",
        "```toml",
        "steering_ratio = [0.0, 0.0518, 0.0, 0.0001]  # 0.0518 x + 0.0001 x^3",
        "```",
        "",
        "It has 2 to 8 coefficients; its slope must be a ratio of 1 to 60 up to 3 rad to either side, and the constant",
        "at most 2 deg.",
    ]
    for table_key in TABLES.values():
        lines += ["", *_table_section(table_key)]
    lines += ["", "## All keys in one file", "", "```toml", _all_in_one().rstrip(), "```"]
    return "\n".join([*lines, ""])


def _key(key: Key, table: str = "") -> tuple[str, ...]:
    default = key.without or "required"
    return f"`{key.name.removeprefix(table)}`", key.unit, key.range.removesuffix(key.unit).strip(), default, key.meaning


def _table_section(key: Key) -> Iterator[str]:
    yield f"## [{key.name}]"
    yield ""
    yield f"{key.meaning} Default: {key.without}."
    if key.name == "params":
        yield "\n[Parameters](../params.md) lists all of them with range, default and source."
    rows = {"sensors": [_key(each, "sensors.") for name, each in KEYS.items() if name.startswith("sensors.")]}
    rows["signals"] = [_key(each) for each in SIGNAL_ENTRY.values()]
    if key.name in rows:
        yield ""
        yield from table(("key", "unit", "range", "default", "meaning"), iter(rows[key.name]))
    if key.name == "signals":
        from oncenter.read.units import factors
        from oncenter.signals import SIGNALS

        yield "\nThe signals, and their units in logs:\n"
        cells = (
            (f"`{s.name}`", ", ".join(f"`{unit}`" for unit in factors(s.name)), f"{s.about}") for s in SIGNALS.values()
        )
        yield from table(("signal", "units", "meaning"), cells)
        yield "\n`time` names the time column; its units are `s`, `ms`, `us` and `ns`."
    example = {
        name.removeprefix("sensors."): each.example for name, each in KEYS.items() if name.startswith("sensors.")
    }
    yield "\n```toml"
    yield f"[{key.name}]"
    yield from (entry(name, value) for name, value in (key.example or example).items())
    yield "```"


def _all_in_one() -> str:
    return vehicle_text({"name": "truck 17", "wheelbase_m": 3.7, "steering_ratio": 19.3})


# json.md


def json_page(schemas: Mapping[str, Schema]) -> str:
    lines = [
        "# JSON",
        "",
        "With `--json` a command prints one object on standard output: its answer, or an error. Angles are in degrees.",
        "`schema` names the object and its version. A version keeps its fields; the newest one may get further fields.",
        _MADE,
        "",
        "A **quantity** is an object with these fields; the tables below show it as one row:",
        "",
        *table(("field", "type", "meaning"), _quantity(schemas["offset-2"]["properties"]["backlash"])),
    ]
    for name, schema in schemas.items():
        lines += ["", f"## {name}", "", schema["description"], f"Its JSON Schema: [schema/{name}.schema.json]"]
        lines[-1] += f"(schema/{name}.schema.json)."
        lines += [""]
        lines += table(("field", "type", "unit", "meaning"), _fields(schema, ""))
    return "\n".join([*lines, ""])


_QUANTITY = ("value", "unit", "ci95", "status")


def _is_quantity(schema: Schema) -> bool:
    return set(_QUANTITY) <= set(schema.get("properties", {})) and "kind" not in schema["properties"]


def _quantity(schema: Schema) -> Iterator[tuple[str, ...]]:
    for name in _QUANTITY:
        field = schema["properties"][name]
        yield f"`{name}`", "string" if name == "unit" else _kind(field), field["description"]


def _fields(schema: Schema, prefix: str) -> Iterator[tuple[str, ...]]:
    is_quantity = _is_quantity(schema)
    for name, each in schema["properties"].items():
        if is_quantity and name in _QUANTITY:
            continue
        path = f"{prefix}{name}"
        left_out = "" if name in schema["required"] else " May be missing."
        about = f"{each['description']}{left_out}"
        if _is_quantity(each):
            yield f"`{path}`", "quantity", each["properties"]["unit"]["enum"][0], about
        else:
            yield f"`{path}`", _kind(each), each.get("unit", ""), about
        yield from _inside(each, path)


def _inside(schema: Schema, path: str) -> Iterator[tuple[str, ...]]:
    """The fields of an object, of the rows of an array, and of an object by name."""
    if "properties" in schema:
        yield from _fields(schema, f"{path}.")
    rows = schema.get("items", {})
    if "properties" in rows:
        yield from _fields(rows, f"{path}[].")
    named = schema.get("additionalProperties")
    if isinstance(named, Mapping) and "properties" in named:
        yield from _fields(named, f"{path}.NAME.")


def _kind(schema: Schema) -> str:
    if "enum" in schema:
        return " or ".join(f"`{'null' if value is None else value}`" for value in schema["enum"])
    kinds = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    return " or ".join(kinds)


def made() -> dict[Path, str]:
    """The text of each file."""
    schemas = runpy.run_path(str(ROOT / "docs" / "json_schemas.py"))["schemas"]()
    files = {
        FOLDER / "schema" / f"{name}.schema.json": json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
        for name, schema in schemas.items()
    }
    return files | {
        FOLDER / "commands.md": commands_page(),
        FOLDER / "vehicle_file.md": vehicle_page(),
        FOLDER / "json.md": json_page(schemas),
    }


if __name__ == "__main__":
    for path, text in made().items():
        path.write_text(text, encoding="utf-8", newline="\n")
