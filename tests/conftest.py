"""How Hypothesis works here: as long as it needs (speed is measured in bench/), and the same in every run of CI."""

import os

from hypothesis import HealthCheck, settings

settings.register_profile(
    "oncenter", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize="CI" in os.environ
)
settings.load_profile("oncenter")
