"""Writes logs of a simulated drive, one module per format. The same drive always gives the same bytes."""

from __future__ import annotations

from pathlib import Path

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.files.log_formats import WRITTEN, Format, format_of, imported
from oncenter.files.whole_file import whole_file
from oncenter.simulate.can import frames
from oncenter.simulate.sensors import Sensed


def format_to_write(log: Path) -> Format:
    """The format of a log's name, one that can be written.

    Raises:
        OncenterError: "output", exit code 2: its name ends in none of `WRITTEN`.
    """
    log_format = format_of(log.name)
    if log_format is None or not log.name.endswith(WRITTEN):
        raise OncenterError(
            f"cannot write {log}: its name must end in {', '.join(WRITTEN)}", code="output", exit_code=WRONG_USAGE
        )
    return log_format


def require_writer(log: Path) -> None:
    """Checks, before a drive is simulated, that the package that writes its log is installed.

    Raises:
        OncenterError: as `format_to_write`; "missing_extra": the package is not installed.
    """
    package = format_to_write(log).writer_needs
    if package:
        require_package(package, log.name)


def write_log(sensed: Sensed, log: Path, *, jitter_sd_s: float, seed: int) -> None:
    """Writes a drive in the format given by the log's suffix, overwriting an existing file.

    Args:
        sensed: the sensors' output.
        log: ends in one of `WRITTEN`.
        jitter_sd_s: of the frames' delays, 0 to 0.002; tables have none.
        seed: of the jitter, and of the day on which a log of frames begins.

    Raises:
        OncenterError: "output", exit code 2: as `format_to_write`, or the log cannot be written; as `require_writer`.
    """
    require_writer(log)
    log_format = format_to_write(log)
    with whole_file(log) as unfinished:
        is_table = log_format.content == "columns"
        content = sensed.signals.table if is_table else frames(sensed, jitter_sd_s=jitter_sd_s, seed=seed)
        imported(log_format.writer)(content, unfinished)
