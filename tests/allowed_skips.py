"""The skips that a run may have with ONCENTER_NO_SKIPS=1, as .ci/run sets it: one for another reason fails the run.

So a package that is missing on the machine fails the run, and not one test fewer runs in silence.
"""

from __future__ import annotations

import os
import re
from importlib.util import find_spec

import pytest

ALLOWED = [
    r"^real drive \S+ is not in",  # recorded drives are no part of the project
    r"^of \S+ alone$",  # features of an operating system
    r"^the binaries are compared with those for Linux on x86-64",
    r"^(systemd-analyze|kubectl) is not installed",  # they check examples
    r"^Ray's processes do not always begin under the sanitizers",
]
IN_MAKE_FMU = r"make fmu"  # which installs zig, the emulators and the importers
if find_spec("ziglang") is None:
    ALLOWED.append(IN_MAKE_FMU)


def not_allowed(config: pytest.Config) -> list[str]:
    """A line for each such test, or file of tests, with its reason. Only a controller of pytest-xdist has them all."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    if reporter is None or os.environ.get("ONCENTER_NO_SKIPS") != "1":
        return []
    reasons = {report.nodeid: report.longrepr[2].removeprefix("Skipped: ") for report in reporter.getreports("skipped")}
    return [
        f"FAILED {name} - skipped: {reason}"
        for name, reason in reasons.items()
        if not any(re.search(pattern, reason) for pattern in ALLOWED)
    ]


def pytest_sessionfinish(session: pytest.Session) -> None:
    if not_allowed(session.config) and session.exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if skipped := not_allowed(config):
        terminalreporter.section("skipped, for a reason that tests/allowed_skips.py does not list", red=True)
        for line in skipped:
            terminalreporter.line(line)
