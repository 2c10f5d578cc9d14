"""Writes CONTENTS: the files of the installed package, from the tree. A build that lacks one of them fails by its name.

Usage: make_contents.py
"""

import runpy
from pathlib import Path

ROOT = Path(__file__).parents[1]
CONTENTS = ROOT / "CONTENTS"
MADE = {"oncenter/_declarations.py"}  # when the library is built
NOT_READ = ("__pycache__", "native")  # bytecode; what is compiled into the library


def made() -> dict[Path, str]:
    """The text of the file; the library itself has another name on each platform."""
    source = ROOT / "src"
    libraries = (".so", ".dylib", ".dll")
    own = [file for file in (source / "oncenter").rglob("*") if file.is_file() and file.suffix not in libraries]
    names = {file.relative_to(source).as_posix() for file in own if not set(file.parts) & set(NOT_READ)}
    for folder, kinds in runpy.run_path(str(ROOT / "liboncenter.py"))["SHIPPED"].items():
        files = [file.relative_to(ROOT) for kind in kinds for file in (ROOT / folder).glob(kind)]
        names |= {f"oncenter/{file.as_posix()}" for file in files}
    return {CONTENTS: "\n".join(sorted(names | MADE)) + "\n"}


if __name__ == "__main__":
    for path, text in made().items():
        path.write_text(text, encoding="utf-8", newline="\n")
