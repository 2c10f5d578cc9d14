"""Errors of input and usage: one exception with a message, a code and an exit code."""

from functools import partial
from typing import Any

LOG_CANNOT_BE_ANSWERED = 1
WRONG_USAGE = 2
STATUS_TO_FAIL_ON = 3  # only with --fail-on
INTERRUPTED = 130


class OncenterError(Exception):
    """One line for people, a code for programs.

    Args:
        message: one line that names the file, signal or parameter and the remedy.
        code: snake_case, stable; in the JSON error object, and explained by `oncenter explain CODE`.
        exit_code: 1 the log cannot be answered, 2 wrong usage, vehicle file or DBC, 130 interrupted.
        needs: names of the missing signals, columns or parameters.
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
        """Keeps the codes across processes: unpickling calls an exception with its message alone."""
        rest = partial(type(self), code=self.code, exit_code=self.exit_code, needs=self.needs)
        return rest, (str(self),)
