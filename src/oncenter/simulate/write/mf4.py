"""Writes ASAM MDF 4 with raw frames in its bus logging layout: one group, one structured channel."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import numpy as np

from oncenter.simulate.can import BusFrames

_NAME = "CAN_DataFrame"
_DTYPE = np.dtype(
    [
        (f"{_NAME}.BusChannel", "<u1"),
        (f"{_NAME}.ID", "<u4"),
        (f"{_NAME}.IDE", "<u1"),
        (f"{_NAME}.DLC", "<u1"),
        (f"{_NAME}.DataLength", "<u1"),
        (f"{_NAME}.DataBytes", "(8,)u1"),
        (f"{_NAME}.Dir", "<u1"),
        (f"{_NAME}.EDL", "<u1"),
        (f"{_NAME}.BRS", "<u1"),
        (f"{_NAME}.ESI", "<u1"),
    ]
)
_TRANSPOSED_AND_DEFLATED: Final = 2


def write_mf4(frames: BusFrames, path: Path) -> None:
    """The file history contains the time of the drive; asammdf would use the time of writing."""
    from asammdf import MDF, Signal
    from asammdf.blocks.v4_blocks import FileHistory, SourceInformation
    from asammdf.blocks.v4_constants import BUS_TYPE_CAN, SOURCE_BUS

    records = np.zeros(len(frames.microseconds), _DTYPE)
    records[f"{_NAME}.BusChannel"] = 1
    records[f"{_NAME}.ID"] = frames.identifier
    records[f"{_NAME}.IDE"] = 1
    records[f"{_NAME}.DLC"] = records[f"{_NAME}.DataLength"] = 8
    records[f"{_NAME}.DataBytes"] = frames.payload
    bus = SourceInformation(source_type=SOURCE_BUS, bus_type=BUS_TYPE_CAN)
    start = datetime.fromtimestamp(frames.start_s, UTC)
    written = FileHistory()
    written.time_stamp = start
    written.comment = "<FHcomment><TX>simulated</TX><tool_id>oncenter</tool_id></FHcomment>"
    with MDF(version="4.10") as mdf:
        mdf.start_time = start
        mdf.append(Signal(records, frames.microseconds / 1e6, name=_NAME, source=bus))
        mdf.file_history.append(written)
        mdf.save(path, overwrite=True, compression=_TRANSPOSED_AND_DEFLATED, add_history_block=False)
