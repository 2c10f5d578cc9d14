"""Reads segments of https://github.com/commaai/comma2k19: folders of numpy arrays with different sample times."""

from pathlib import Path

import numpy as np

RATE_HZ = 100.0

# Column: array, its column, factor to the unit with left positive. The IMU's axes point forward, right and down:
# gravity reads -9.7 m/s^2 on the third, the first follows the derivative of the speed, and the third gyro follows the
# steering wheel angle with reversed sign. Wheels are front left, front right, rear left, rear right.
ARRAYS = {
    "steering_wheel_angle_deg": ("CAN/steering_angle", 0, 1.0),
    "yaw_rate_rad_s": ("IMU/gyro", 2, -1.0),
    "vehicle_speed_m_s": ("CAN/speed", 0, 1.0),
    "lateral_acceleration_m_s2": ("IMU/accelerometer", 1, -1.0),
    "longitudinal_acceleration_m_s2": ("IMU/accelerometer", 0, 1.0),
    "wheel_speed_front_left_m_s": ("CAN/wheel_speed", 0, 1.0),
    "wheel_speed_front_right_m_s": ("CAN/wheel_speed", 1, 1.0),
    "wheel_speed_rear_left_m_s": ("CAN/wheel_speed", 2, 1.0),
    "wheel_speed_rear_right_m_s": ("CAN/wheel_speed", 3, 1.0),
}


def read(segment: Path) -> dict[str, np.ndarray]:
    """Resamples the segment to one tick. All stamps are of one clock, and samples come at 83 Hz or more without gaps,
    so linear interpolation is safe."""
    stamps, values = (
        {array: np.load(segment / "processed_log" / array / file) for array, _, _ in ARRAYS.values()}
        for file in ("t", "value")
    )
    begin, end = max(t[0] for t in stamps.values()), min(t[-1] for t in stamps.values())
    time = np.arange(begin, end, 1 / RATE_HZ)
    columns = {"time_s": time - begin}
    for name, (array, axis, factor) in ARRAYS.items():
        t = stamps[array]
        columns[name] = factor * np.interp(time, t, values[array].reshape(len(t), -1)[:, axis])
    return columns
