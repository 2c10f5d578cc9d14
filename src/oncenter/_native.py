"""The shared library `liboncenter`: `lib` has its functions and constants, `ffi` their types."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from oncenter._declarations import ffi as _ffi

_LIBRARY = next(Path(__file__).parent.glob("liboncenter.*"))  # .so, .dylib or .dll: there is one

ffi: Any = _ffi
lib: Any = ffi.dlopen(str(_LIBRARY))
