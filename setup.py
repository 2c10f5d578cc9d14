"""What pyproject.toml cannot say: the version that the C header holds, and the two extension modules."""

import re
from pathlib import Path

from setuptools import setup

HEADER = Path(__file__).parent / "core" / "monitor.h"


def version() -> str:
    text = HEADER.read_text(encoding="utf-8")
    return ".".join(re.findall(r"\bOC_VERSION_(?:MAJOR|MINOR|PATCH) = (\d+)", text))


setup(
    version=version(),
    cffi_modules=["src/oncenter/_build.py:ffi", "src/oncenter/simulate/_build.py:ffi"],
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
