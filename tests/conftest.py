"""How Hypothesis works here: as long as it needs (speed is measured in bench/), and the same in every run of CI. And
the fleet that several files' tests look at."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from two_trucks import write_fleet

from oncenter.fleet import run

settings.register_profile(
    "oncenter", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize="CI" in os.environ
)
settings.load_profile("oncenter")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Where this machine is shown as another (`tests/elsewhere`), what that one lacks is not tested."""
    lacking = {"win32": ("posix", "linux"), "darwin": ("linux",)}.get(os.environ.get("ONCENTER_AS", ""), ())
    for item in items:
        for name in lacking:
            if item.get_closest_marker(name) is not None:
                item.add_marker(pytest.mark.skip(f"of {name} alone"))


@pytest.fixture(scope="session")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """See `two_trucks`; not to be written to."""
    root = tmp_path_factory.mktemp("fleet")
    write_fleet(root)
    return root


@pytest.fixture(scope="session")
def undisturbed(fleet: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a run makes of it that nothing disturbs."""
    output = tmp_path_factory.mktemp("undisturbed")
    run([str(fleet / "logs")], fleet / "vehicles", output)
    return output
