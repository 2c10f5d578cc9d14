"""What the README says of 2 deg follows from its formula, for the truck of the demo."""

import math
import re
from pathlib import Path

import oncenter as oc

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
TRUCK = oc.vehicle("scania_r730_4x2")


def test_the_metres_beside_the_lane_follow_from_steady_cornering() -> None:
    limit = math.radians(2.0)
    gradient = math.radians(float(re.findall(r"K = ([\d.]+) deg/\(m/s²\)", README)[0]))
    speed = float(re.findall(r"v = ([\d.]+) m/s", README)[0])
    assert f"i = {TRUCK.steering_ratio:g}, wheelbase L = {TRUCK.wheelbase_m:g} m" in README
    assert round(speed * 3.6) == 80

    at_the_road_wheels = limit / TRUCK.steering_ratio
    # (10): front wheel angle = L / R + K a, and a = v² / R.
    acceleration = at_the_road_wheels / (TRUCK.wheelbase_m / speed**2 + gradient)
    assert f"2/{TRUCK.steering_ratio:g} = {math.degrees(at_the_road_wheels):.2f} deg" in README
    assert f"{acceleration:.2f} m/s² of lateral acceleration" in README
    one_line = " ".join(README.split())
    assert f"{acceleration * 2**2 / 2:.2f} m beside its path after 2 s" in one_line
    assert f"{acceleration * 3**2 / 2:.2f} m after 3 s" in one_line
    assert f"expects {math.degrees(acceleration / speed):.2f} deg/s" in one_line
