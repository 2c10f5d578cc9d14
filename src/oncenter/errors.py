"""Everything that may go wrong and is not our fault, as one exception with a code, an exit code and what would help."""

from functools import partial
from typing import Any

LOG_CANNOT_BE_ANSWERED = 1
WRONG_USAGE = 2
STATUS_TO_FAIL_ON = 3  # only where it was asked for
INTERRUPTED = 130


class OncenterError(Exception):
    """One line for people, a code for programs.

    Args:
        message: one line that names the file, signal or parameter and what would do.
        code: snake_case, stable; goes into the JSON error object.
        exit_code: 1 the log cannot be answered, 2 wrong usage, vehicle file or DBC, 130 interrupted.
        needs: names of signals, columns or parameters that would do.
    """

    def __init__(
        self,
        message: str,
        *,
        code: str,
        exit_code: int = LOG_CANNOT_BE_ANSWERED,
        needs: tuple[str, ...] = (),
    ) -> None:
        super().__init__(message)
        self.code = code
        self.exit_code = exit_code
        self.needs = needs

    def __reduce__(self) -> tuple[Any, ...]:
        """From another process, too, it comes as it was: unpickled, an exception is called with its message alone."""
        rest = partial(type(self), code=self.code, exit_code=self.exit_code, needs=self.needs)
        return rest, (str(self),)


class NeedsLibrary(Exception):
    """Our own reader does not know something in a log: python-can may, in a child process. Says what."""
