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
