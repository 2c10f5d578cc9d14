"""Writes src/oncenter/_structs.pyi, the core's answers as types, from the headers: type checkers alone read it."""

import runpy
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
STRUCTS = ROOT / "src" / "oncenter" / "_structs.pyi"
OF = ("oc_answer", "oc_output")
KINDS = {"double": "float", "float": "float", "int32_t": "int", "uint32_t": "int", "uint64_t": "int", "_Bool": "bool"}
# Members that Python adds, with the function.
ADDED = {
    "oc_answer": (
        "yaw_rate_step_sd: NotRequired[float]  # offset.coarse_recording.widened",
        "yaw_rate_bias_moved: NotRequired[float]  # offset.bias_course.BiasCourse",
    )
}
HEAD = '''"""Structs of the core as dicts; core/*/*.h documents the members. docs/make_structs.py writes this file."""

from typing import NotRequired, TypedDict
'''


def python_of(kind: Any, classes: dict[str, str]) -> str:
    """The Python type of a C type; adds the class of a struct, after those of its members."""
    if kind.kind == "array":
        return f"list[{python_of(kind.item, classes)}]"
    if kind.kind == "struct":
        name = "".join(part.capitalize() for part in kind.cname.split("_"))
        members = [f"{member}: {python_of(field.type, classes)}" for member, field in kind.fields]
        lines = "".join(f"    {line}\n" for line in (*members, *ADDED.get(kind.cname, ())))
        classes[name] = f"\nclass {name}(TypedDict):\n{lines}"
        return name
    return "int" if kind.kind == "enum" else KINDS[kind.cname]


def made() -> dict[Path, str]:
    """The text of the file."""
    ffi = runpy.run_path(str(ROOT / "liboncenter.py"))["ffi"]
    classes: dict[str, str] = {}
    for name in OF:
        python_of(ffi.typeof(name), classes)
    return {STRUCTS: HEAD + "".join(classes.values())}


if __name__ == "__main__":
    for path, text in made().items():
        path.write_text(text, encoding="utf-8", newline="\n")
