"""Write a simulated drive as a CAN log of the network in chassis.dbc.

    pip install 'oncenter[can]'
    python examples/own_dbc/write_log.py own.log

The angle sensor's true offset is printed, so that the estimate can be compared with it.
"""

import argparse
import math
from pathlib import Path

import can
import cantools

import oncenter as oc

NETWORK = cantools.database.load_file(Path(__file__).parent / "chassis.dbc")
START_S = 1_466_000_000  # the drive's first frame, seconds since 1970
PERIODS_S = {"STEERING": 0.01, "MOTION": 0.01, "SPEED": 0.02}
# DBC signal: column of the simulated table, factor to the unit and sign of the DBC
SIGNALS = {
    "WheelAngle": ("steering_wheel_angle_rad", -math.degrees(1.0)),  # this network counts to the right
    "YawRate": ("yaw_rate_rad_s", math.degrees(1.0)),
    "LatAccel": ("lateral_acceleration_m_s2", 1.0),
    "VehSpeed": ("vehicle_speed_m_s", 3.6),
}


def write_log(path: str, scenario: str) -> float:
    """Returns the true offset of the steering wheel angle sensor in deg, left positive."""
    signals, truth = oc.simulate(scenario)
    columns = {name: (signals.table[column] * factor).to_list() for name, (column, factor) in SIGNALS.items()}
    with can.Logger(path) as log:
        for tick, time_s in enumerate(signals.table["time_s"]):
            for name, period_s in PERIODS_S.items():
                if tick % round(period_s * signals.rate_hz) == 0:
                    log.on_message_received(frame(name, {each: columns[each][tick] for each in columns}, time_s))
    return math.degrees(truth.offset_rad)


def frame(name: str, values: dict[str, float], time_s: float) -> can.Message:
    message = NETWORK.get_message_by_name(name)
    data = message.encode({each.name: values.get(each.name, 0.0) for each in message.signals})
    return can.Message(
        timestamp=START_S + time_s, arbitration_id=message.frame_id, is_extended_id=False, data=data, channel=0
    )


if __name__ == "__main__":
    options = argparse.ArgumentParser(description="Write a simulated drive as a CAN log of the network in chassis.dbc.")
    options.add_argument("log", metavar="LOG", help="the log to write: .log (candump), .asc, .blf or .trc")
    options.add_argument(
        "scenario", metavar="SCENARIO", nargs="?", default="thesis_drive", help="a scenario, by its name or TOML file"
    )
    given = options.parse_args()
    offset_deg = write_log(given.log, given.scenario)
    print(f"wrote {given.log}; the true offset is {offset_deg:.2f} deg")
