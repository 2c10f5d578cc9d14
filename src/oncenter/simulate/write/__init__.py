"""Writes logs of a simulated drive, one module per format. The same drive always gives the same bytes."""

from __future__ import annotations

from pathlib import Path

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.files.whole_file import whole_file
from oncenter.simulate.can import frames
from oncenter.simulate.sensors import Sensed
from oncenter.simulate.write.candump import write_candump
from oncenter.simulate.write.mf4 import write_mf4
from oncenter.simulate.write.python_can import write_asc, write_blf, write_trc
from oncenter.simulate.write.tabular import write_csv, write_csv_gz, write_parquet

_FRAME_LOGS = {
    ".log": write_candump,
    ".asc": write_asc,
    ".blf": write_blf,
    ".trc": write_trc,
    ".mf4": write_mf4,
}
_TABLES = {".csv": write_csv, ".csv.gz": write_csv_gz, ".parquet": write_parquet}
SUFFIXES = (*_FRAME_LOGS, *_TABLES)
_PACKAGES = {".asc": "can", ".blf": "can", ".trc": "can", ".mf4": "asammdf"}

__all__ = ["SUFFIXES", "require_writer", "suffix_of", "write_log"]


def suffix_of(log: Path) -> str:
    """The suffix of a log's name, one of `SUFFIXES`.

    Raises:
        OncenterError: "output", exit code 2: it has none of them.
    """
    for suffix in SUFFIXES:
        if log.name.endswith(suffix):
            return suffix
    raise OncenterError(
        f"cannot write {log}: its name must end in {', '.join(SUFFIXES)}", code="output", exit_code=WRONG_USAGE
    )


def require_writer(log: Path) -> None:
    """Checks, before a drive is simulated, that the package that writes its log is installed.

    Raises:
        OncenterError: as `suffix_of`; "missing_extra": the package is not installed.
    """
    package = _PACKAGES.get(suffix_of(log))
    if package is not None:
        require_package(package, log.name)


def write_log(sensed: Sensed, log: Path, *, jitter_sd_s: float, seed: int) -> None:
    """Writes a drive in the format given by the log's suffix, overwriting an existing file.

    Args:
        sensed: the sensors' output.
        log: ends in one of `SUFFIXES`.
        jitter_sd_s: of the frames' delays, 0 to 0.002; tables have none.
        seed: of the jitter.

    Raises:
        OncenterError: "output", exit code 2: as `suffix_of`, or the log cannot be written; as `require_writer`.
    """
    suffix = suffix_of(log)
    require_writer(log)
    with whole_file(log) as unfinished:
        if suffix in _TABLES:
            _TABLES[suffix](sensed.signals.table, unfinished)
        else:
            _FRAME_LOGS[suffix](frames(sensed, jitter_sd_s=jitter_sd_s, seed=seed), unfinished)
