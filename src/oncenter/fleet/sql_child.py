"""`python -m oncenter.fleet.sql_child`: runs queries for a parent that watches it, see `oncenter.files.child`."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from oncenter.files.child import Send, serve
from oncenter.fleet.sql import result_of


def _answer(request: Mapping[str, Any], send: Send) -> None:
    packed = io.BytesIO()
    result_of(request["sql"], Path(request["output"])).write_ipc(packed)
    send({"last": True}, packed.getbuffer())


if __name__ == "__main__":
    serve(_answer)
