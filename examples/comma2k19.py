"""A drive from numpy arrays, without any log file: a minute of a Toyota RAV4, nearly straight.

    python examples/comma2k19.py SEGMENT

SEGMENT is a folder of https://github.com/commaai/comma2k19 that has `processed_log` in it; without it, the example
segment in the folder that ONCENTER_REAL_DATA names is taken.
"""

import os
import sys
from pathlib import Path

import numpy as np
import polars as pl

import oncenter as oc
from oncenter.signals import DEGREE, SIGNALS, Source

RATE_HZ = 100.0

RAV4 = oc.Vehicle(
    name="Toyota RAV4 2016-18",
    wheelbase_m=2.65,
    steering_ratio=16.88,
    source=dict.fromkeys(("wheelbase_m", "steering_ratio"), "opendbc, toyota/values.py, TOYOTA_RAV4"),
    # The accelerometer is a phone's behind the windscreen, which shakes and leans with the body: a_y - r*v leaves
    # Table 4's 0.3 m/s^2 every few seconds though the road is flat.
    params={"bank_max_m_s2": 1.0},
)

# Signal, array, its column, and what makes it SI with left positive. The IMU's axes point forward, right and down:
# gravity reads -9.7 m/s^2 on the third, the first follows the slope of the speed, and the third gyro follows the
# steering wheel angle with its sign reversed. Wheels are front left, front right, rear left, rear right.
ARRAYS = {
    "steering_wheel_angle": ("CAN/steering_angle", 0, DEGREE),
    "yaw_rate": ("IMU/gyro", 2, -1.0),
    "vehicle_speed": ("CAN/speed", 0, 1.0),
    "lateral_acceleration": ("IMU/accelerometer", 1, -1.0),
    "longitudinal_acceleration": ("IMU/accelerometer", 0, 1.0),
    "wheel_speed_front_left": ("CAN/wheel_speed", 0, 1.0),
    "wheel_speed_front_right": ("CAN/wheel_speed", 1, 1.0),
    "wheel_speed_rear_left": ("CAN/wheel_speed", 2, 1.0),
    "wheel_speed_rear_right": ("CAN/wheel_speed", 3, 1.0),
}


def read(segment: Path) -> oc.Signals:
    """The segment on one tick. All stamps are of one clock; samples come at 83 Hz or more without a hole, so straight
    lines between them invent nothing."""
    stamps, values = (
        {array: np.load(segment / "processed_log" / array / file) for array, _, _ in ARRAYS.values()}
        for file in ("t", "value")
    )
    begin, end = max(t[0] for t in stamps.values()), min(t[-1] for t in stamps.values())
    time = np.arange(begin, end, 1 / RATE_HZ)
    columns, sources = {"time_s": time - begin}, {}
    for name, (array, axis, factor) in ARRAYS.items():
        t = stamps[array]
        columns[SIGNALS[name].column] = factor * np.interp(time, t, values[array].reshape(len(t), -1)[:, axis])
        sources[name] = Source(f"array {array}", float(1 / np.median(np.diff(t))), len(t), not_available=0)
    return oc.Signals(pl.DataFrame(columns), sources, RATE_HZ, log=segment.name)


def main() -> None:
    data = Path(os.environ.get("ONCENTER_REAL_DATA", "."))
    segment = Path(sys.argv[1]) if len(sys.argv) > 1 else data / "comma2k19_example"
    if not (segment / "processed_log").is_dir():
        sys.exit(f"{segment} has no processed_log: give a comma2k19 segment, or its parent in ONCENTER_REAL_DATA")
    answer = oc.offset(read(segment), RAV4, method="thesis")
    print(answer)
    print(f"understeer gradient: {answer.understeer_gradient}")


if __name__ == "__main__":
    main()
