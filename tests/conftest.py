"""Settings of Hypothesis (no deadline: speed is measured in bench/; reproducible in CI), and the fleet shared by
several test files."""

import os
import sys
from pathlib import Path
from threading import Lock
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from two_trucks import write_fleet

from oncenter.fleet import run
from oncenter.fleet.drive import Work
from oncenter.fleet.files import LogFile
from oncenter.fleet.watched import Watched

pytest_plugins = ["allowed_skips", "browser"]

settings.register_profile(
    "oncenter", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize="CI" in os.environ
)
settings.load_profile("oncenter")


def pytest_xdist_auto_num_workers() -> int:
    """One more than cores: a third of the time the tests wait for processes that they started."""
    return (os.cpu_count() or 1) + 1


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skips tests of features that the platform, or an emulated one (`tests/elsewhere`), does not have."""
    platform = os.environ.get("ONCENTER_AS", sys.platform)
    lacking = {"win32": ("posix", "linux"), "darwin": ("linux",)}.get(platform, ())
    for item in items:
        for name in lacking:
            if item.get_closest_marker(name) is not None:
                item.add_marker(pytest.mark.skip(f"of {name} alone"))


@pytest.fixture(scope="session")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """See `two_trucks`; read only."""
    root = tmp_path_factory.mktemp("fleet")
    write_fleet(root)
    return root


@pytest.fixture(scope="session")
def undisturbed(fleet: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The output of an undisturbed run."""
    output = tmp_path_factory.mktemp("undisturbed")
    run([str(fleet / "logs")], fleet / "vehicles", output)
    return output


@pytest.fixture
def answered_here(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """The logs of a fleet are answered in this process: each night's child processes take seconds to begin. Tests of
    the system, and `undisturbed`, have them."""
    one_at_a_time = Lock()

    def answered(self: Watched, log: LogFile) -> dict[str, Any]:
        with one_at_a_time:
            return Work(self.trucks, self.reports)(log)

    if request.node.get_closest_marker("system") is None:
        monkeypatch.setattr(Watched, "_answered", answered)
