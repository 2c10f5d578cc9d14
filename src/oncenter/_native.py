"""The shared library `liboncenter`: `lib` has its functions and constants, `ffi` their types."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from oncenter._declarations import ffi as _ffi

_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")

ffi: Any = _ffi
lib: Any = ffi.dlopen(str(Path(__file__).with_name(f"liboncenter{_SUFFIX}")))
