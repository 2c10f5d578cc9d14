"""The truck of a log by which its vehicle file is found, before its signals are read."""

from __future__ import annotations

import os
from pathlib import Path

from oncenter.errors import OncenterError
from oncenter.files.own_file import NOT_A_LOG
from oncenter.read.frames import Wanted
from oncenter.read.frames_of_log import frames_of_log
from oncenter.read.identity import NOT_STATED, PGNS, Identity, assembled
from oncenter.read.mdf_comment import vin_in_header
from oncenter.read.plugins import known_format
from oncenter.read.tabular import identity_of_table

_TABLES = (".csv", ".csv.gz", ".parquet")


def identity_of(path: Path) -> Identity:
    """The identity of a log, by the parser of its signals.

    Frames: from VI, PGN 65260, in one frame or in packets; MF4 also from its header comment. Parquet: metadata
    `vin` and `start_time`, or columns of these names. CSV: columns. `start_time` is an ISO date (UTC if it names no
    zone), or seconds since 1970.

    Raises:
        OncenterError: "not_a_log": oncenter wrote the file.
    """
    try:
        log_format = None if os.path.isdir(path) else known_format(path)
        if log_format is None or log_format.content not in ("frames", "frames and channels"):
            is_table = log_format is not None and log_format.suffixes[0] in _TABLES
            return identity_of_table(path) if is_table else NOT_STATED
        frames = frames_of_log(path, [], lambda fraction: None, Wanted(PGNS))
        return Identity(assembled(frames) or vin_in_header(path))
    except OncenterError as error:
        if error.code == NOT_A_LOG:
            raise
        return NOT_STATED  # reading its signals reports the error
    except (OSError, ValueError):
        return NOT_STATED
