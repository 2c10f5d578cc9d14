"""J1939 frames and frames of any DBC give the values of the standard and of cantools, from the right source."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import independent_readers
import numpy as np
import pytest
from cantools.database import conversion
from cantools.database.can import Message, Signal
from drive_frames import START_S, Frame, candump, ccvs1, database, drive, identifier, truth, vdc2
from hypothesis import given
from hypothesis import strategies as st
from real_data import real_drive

from oncenter.errors import OncenterError
from oncenter.read import dbc as databases
from oncenter.read import j1939, read, require
from oncenter.read.frames import Frames, pgn_of
from oncenter.signals import DEGREE, SignalName, Signals


def frames_of(payloads: list[bytes], extended: bool = True) -> Frames:
    count = len(payloads)
    return Frames(
        np.arange(count) / 100,
        np.full(count, identifier(61449, 0x3E), np.uint32),
        np.full(count, extended),
        np.array([int.from_bytes(p.ljust(8, b"\xff"), "little") for p in payloads], np.uint64),
        np.array([len(p) for p in payloads], np.uint8),
        np.zeros(count, np.uint64),
    )


def read_frames(folder: Path, frames: list[Frame], **options: object) -> Signals:
    path = folder / "drive.log"
    path.write_text(candump(sorted(frames, key=lambda frame: frame.time)))
    return read(path, **options)  # type: ignore[arg-type]


def test_frames_of_a_real_truck_read_as_published() -> None:
    given_by = j1939.signals_of(
        j1939.VDC2,
        {
            p.spn: j1939.decode(
                p, frames_of([bytes.fromhex(h) for h in ("697D7F637D577F7D", "2E8820857D577D7D", "FFFF7F8F7D877E7D")])
            )
            for p in j1939.VDC2.parameters
        },
    )
    angle = given_by["steering_wheel_angle"] / DEGREE
    assert angle[0] == pytest.approx(-1.230, abs=5e-4)
    assert angle[1] == pytest.approx(153.0, abs=0.05)
    assert np.isnan(angle[2])
    assert given_by["yaw_rate"][0] / DEGREE == pytest.approx(-0.095, abs=5e-4)
    assert given_by["lateral_acceleration"][0] == pytest.approx(0.230, abs=5e-4)
    assert list(given_by["steering_wheel_angle_sensor_type"]) == [1, 0, 1]


@given(st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=20))
def test_the_built_in_layout_and_cantools_with_the_shipped_dbc_agree(payloads: list[bytes]) -> None:
    frames = frames_of(payloads)
    for message in j1939.MESSAGES.values():
        described = database().get_message_by_name(message.name)
        assert described.frame_id >> 8 & 0x3FFFF == message.pgn
        assert described.frame_id & 0xFF == 0xFE
        decoded = [described.decode(payload, decode_choices=False) for payload in payloads]
        for parameter in message.parameters:
            own = j1939.decode(parameter, frames)
            layout = described.get_signal_by_name(parameter.name)
            theirs = np.array([float(row[parameter.name]) for row in decoded])
            is_number = (theirs <= float(layout.maximum) + 1e-6) & (theirs >= float(layout.minimum) - 1e-6)
            assert np.array_equal(~np.isnan(own), is_number), parameter.name
            assert np.allclose(own[is_number], theirs[is_number], rtol=0, atol=1e-9), parameter.name
            assert layout.spn == parameter.spn


@given(st.data())
def test_any_layout_decodes_as_cantools_does(data: st.DataObject) -> None:
    little = data.draw(st.booleans())
    length = data.draw(st.integers(1, 64))
    first = data.draw(st.integers(0, 64 - length))
    start = first if little else 8 * (first // 8) + 7 - first % 8
    layout = Signal(
        "x",
        start,
        length,
        "little_endian" if little else "big_endian",
        is_signed=data.draw(st.booleans()),
        conversion=conversion.LinearConversion(
            data.draw(st.sampled_from([1, 0.5, -0.01])), data.draw(st.sampled_from([0, -40.0])), is_float=False
        ),
    )
    message = Message(0x123, "m", 8, [layout])
    payloads = data.draw(st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=5))
    own = databases.decode(layout, frames_of(payloads, extended=False))
    theirs = [float(message.decode(payload)["x"]) for payload in payloads]
    assert own == pytest.approx(theirs, rel=1e-12)


def test_float_signals_and_frames_that_are_too_short() -> None:
    layout = Signal("x", 0, 32, conversion=conversion.LinearConversion(1, 0, is_float=True))
    payload = np.array([1.25, 0.0], "<f4").tobytes()
    values = databases.decode(layout, frames_of([payload, payload[:3]], extended=False))
    assert values[0] == 1.25
    assert np.isnan(values[1])


def test_a_group_is_recognised_at_any_priority_source_and_destination() -> None:
    broadcast = [0x18F0093E, 0x0CF00900, 0x00F009FE]
    assert pgn_of(np.array(broadcast, np.uint32)).tolist() == [61449] * 3
    # PDU1: the third byte is an address (TSC1 to the engine, XBR to the brakes), not part of the group.
    assert pgn_of(np.array([0x0C000021, 0x0C04002A, 0x18EAFF00], np.uint32)).tolist() == [0, 1024, 59904]


def test_wheel_speeds_are_the_axle_speed_and_what_ebc2_adds(tmp_path: Path) -> None:
    values = {
        "FrontAxleSpeed": 72.0,
        "RelativeSpeedFrontAxleLeftWheel": -1.0,
        "RelativeSpeedFrontAxleRightWheel": 1.0,
        "RelativeSpeedRearAxle1LeftWheel": -0.5,
        "RelativeSpeedRearAxle1RightWheel": 0.5,
        "RelativeSpeedRearAxle2LeftWheel": 0.0,
        "RelativeSpeedRearAxle2RightWheel": 0.0,
    }
    data = bytes(database().encode_message("EBC2", values))
    signals = read_frames(tmp_path, [Frame(START_S + k / 20, identifier(65215, 0x0B), data) for k in range(40)])
    row = signals.table.row(10, named=True)
    assert row["vehicle_speed_m_s"] == pytest.approx(20.0)
    assert row["wheel_speed_front_left_m_s"] * 3.6 == pytest.approx(71.0)
    assert row["wheel_speed_front_right_m_s"] * 3.6 == pytest.approx(73.0)
    assert row["wheel_speed_rear_left_m_s"] * 3.6 == pytest.approx(71.5)
    assert row["wheel_speed_rear_right_m_s"] * 3.6 == pytest.approx(72.5)


def constant(name: str, pgn: int, values: dict[str, float], address: int, period_s: float) -> list[Frame]:
    """A message at a steady rate; states that are not given are not available."""
    message = database().get_message_by_name(name)
    unknown = {signal.name: 3 for signal in message.signals if signal.length == 2}
    data = bytes(message.encode(unknown | values, padding=True, strict=False))
    return [Frame(START_S + k * period_s, identifier(pgn, address), data) for k in range(round(4 / period_s))]


WHEELS = ("FrontAxleLeftWheelSpeed", "FrontAxleRightWheelSpeed", "RearAxleLeftWheelSpeed", "RearAxleRightWheelSpeed")


def test_speed_is_selected_in_the_documented_order_and_other_sources_are_listed(tmp_path: Path) -> None:
    hrw = constant("HRW", 65134, dict(zip(WHEELS, (35.0, 37.0, 35.0, 37.0), strict=True)), 0x0B, 0.02)
    tco1 = constant("TCO1", 65132, {"TachographVehicleSpeed": 36.5}, 0xEE, 0.05)
    first = constant("CCVS1", 65265, {"WheelBasedVehicleSpeed": 37.0}, 0x00, 0.1)

    speed = read_frames(tmp_path, hrw)
    assert speed.table["vehicle_speed_m_s"][5] == pytest.approx(10.0)
    speed = read_frames(tmp_path, hrw + tco1)
    assert speed.sources["vehicle_speed"].description == "TCO1 from 0xEE"
    speed = read_frames(tmp_path, hrw + tco1 + first)
    assert speed.sources["vehicle_speed"].description == "CCVS1 from 0x00"
    assert speed.sources["vehicle_speed"].others == ("TCO1 from 0xEE", "HRW from 0x0B")
    assert speed.sources["wheel_speed_rear_left"].description == "HRW from 0x0B"


SENT = {"VDC1": 65103, "EBC1": 61441, "ETC2": 61445, "TCO1": 65132}
GIVES = {"VDC1": "stability_control_active", "EBC1": "anti_lock_active", "ETC2": "reverse", "TCO1": "reverse"}
_SPEED = {"TachographVehicleSpeed": 10.0}


@pytest.mark.parametrize(
    ("message", "values", "status"),
    [
        ("VDC1", {"ROPEngineControlActive": 1}, 1.0),
        ("VDC1", {"ROPBrakeControlActive": 1, "YCBrakeControlActive": 0}, 1.0),
        ("VDC1", {"YCEngineControlActive": 1}, 1.0),
        ("VDC1", {"YCBrakeControlActive": 1, "YCEngineControlActive": 2}, 1.0),
        ("VDC1", {"YCBrakeControlActive": 0}, 0.0),
        ("VDC1", {"YCBrakeControlActive": 2}, None),
        ("EBC1", {"AntiLockBrakingActive": 1}, 1.0),
        ("EBC1", {"AntiLockBrakingActive": 0}, 0.0),
        ("EBC1", {"AntiLockBrakingActive": 3}, None),
        ("ETC2", {"TransmissionCurrentGear": -1}, 1.0),
        ("ETC2", {"TransmissionCurrentGear": 0}, 0.0),
        ("ETC2", {"TransmissionCurrentGear": 12}, 0.0),
        ("ETC2", {"TransmissionCurrentGear": -125}, None),  # zeros, as of a controller that starts
        ("ETC2", {"TransmissionCurrentGear": 126}, None),  # park
        ("TCO1", {"TachographDirectionIndicator": 1, **_SPEED}, 1.0),
        ("TCO1", {"TachographDirectionIndicator": 0, **_SPEED}, 0.0),
        ("TCO1", {"TachographDirectionIndicator": 3, **_SPEED}, None),
    ],
)
def test_a_status_there_and_back_and_as_the_independent_reader_has_it(
    tmp_path: Path, message: str, values: dict[str, float], status: float | None
) -> None:
    frames = constant(message, SENT[message], values, 0x0B, 0.1) + constant(
        "CCVS1", 65265, {"WheelBasedVehicleSpeed": 10.0}, 0x00, 0.1
    )
    table = read_frames(tmp_path, frames).table
    theirs = independent_readers._signals(SENT[message], frames[0].data)[GIVES[message]]
    if status is None:
        assert GIVES[message] not in table.columns and np.isnan(theirs)
    else:
        assert set(table[GIVES[message]].drop_nans()) == {status} == {theirs}


def test_the_gear_gives_the_direction_before_the_tachograph(tmp_path: Path) -> None:
    tco1 = constant("TCO1", 65132, {"TachographDirectionIndicator": 0, **_SPEED}, 0xEE, 0.05)
    etc2 = constant("ETC2", 61445, {"TransmissionCurrentGear": -2}, 0x03, 0.1)
    source = read_frames(tmp_path, tco1 + etc2).sources["reverse"]
    assert (source.description, source.others) == ("ETC2 from 0x03", ("TCO1 from 0xEE",))


def test_a_database_gives_the_same_gear_and_no_impossible_one(tmp_path: Path) -> None:
    dbc = Path(__file__).parents[1] / "dbc" / "oncenter_j1939.dbc"
    frames = constant("CCVS1", 65265, {"WheelBasedVehicleSpeed": 10.0}, 0x00, 0.1)
    for gear, status in ((-1, {1.0}), (3, {0.0}), (-125, set())):
        etc2 = constant("ETC2", 61445, {"TransmissionCurrentGear": gear}, 0x03, 0.1)
        table = read_frames(tmp_path, etc2 + frames, dbc=[dbc]).table
        found = set(table["reverse"].drop_nans()) if "reverse" in table.columns else set()
        assert found == status


def test_a_real_truck_at_standstill_is_never_in_reverse_and_its_stability_control_is_unknown() -> None:
    """All its VDC1 are 0xFF, and eight of its ETC2 zeros."""
    signals = read(real_drive("j1939_truck_stationary/truck_stationary.mf4"))
    assert "stability_control_active" not in signals.sources
    assert set(signals.table["reverse"].drop_nans()) == {0.0}
    assert signals.account is not None and signals.account.signals["reverse"].left_out == {"reserved_code": 8}


def test_a_source_without_valid_samples_is_not_used(tmp_path: Path) -> None:
    silent = [Frame(START_S + k / 10, identifier(65265, 0x00), b"\xff" * 8) for k in range(40)]
    speed = read_frames(tmp_path, silent + constant("TCO1", 65132, {"TachographVehicleSpeed": 36.0}, 0xEE, 0.05))
    assert speed.sources["vehicle_speed"].description == "TCO1 from 0xEE"


def test_an_angle_that_is_never_available_is_reported_missing_with_the_reason(tmp_path: Path) -> None:
    data = bytes.fromhex("FFFF7F8F7D877E7D")
    signals = read_frames(tmp_path, [Frame(START_S + k / 100, identifier(61449, 0x3E), data) for k in range(200)])
    assert "steering_wheel_angle_rad" not in signals.table.columns
    with pytest.raises(OncenterError, match="no valid sample in VDC2 from 0x3E"):
        require(signals, ["steering_wheel_angle"])


def second_vdc2(turned_deg: float, address: int = 0x0B) -> list[Frame]:
    frames = []
    for k in range(400):
        exact = {name: float(value) for name, value in truth(np.array(k / 100)).items()}
        angle = exact["steering_wheel_angle_rad"] + turned_deg * DEGREE
        frames.append(
            vdc2(
                START_S + k / 100 + 0.003,
                angle,
                exact["yaw_rate_rad_s"],
                exact["lateral_acceleration_m_s2"],
                address,
            )
        )
    return frames


def test_of_two_agreeing_sources_the_lowest_address_is_used(tmp_path: Path) -> None:
    signals = read_frames(tmp_path, drive() + second_vdc2(0.0))
    assert signals.sources["steering_wheel_angle"].description == "VDC2 from 0x0B"
    assert signals.sources["steering_wheel_angle"].others == ("VDC2 from 0x3E",)


def test_two_disagreeing_sources_are_refused_until_one_is_chosen(tmp_path: Path) -> None:
    frames = drive() + second_vdc2(5.0)
    with pytest.raises(OncenterError, match="--source steering_wheel_angle=0x0B") as refused:
        read_frames(tmp_path, frames)
    assert (refused.value.code, refused.value.exit_code) == ("sources_disagree", 1)
    assert refused.value.needs == ("steering_wheel_angle",)

    for named in ("0x3E", "62", "vdc2 0x3e", "VDC2 from 0x3E"):
        signals = read_frames(tmp_path, frames, take={"steering_wheel_angle": named})
        assert signals.sources["steering_wheel_angle"].description == "VDC2 from 0x3E", named
        assert signals.table["steering_wheel_angle_rad"][0] == pytest.approx(0.0, abs=1e-3)
    other = read_frames(tmp_path, frames, take={"all": "0x0B"})
    assert other.table["steering_wheel_angle_rad"][0] == pytest.approx(5.0 * DEGREE, abs=2e-3)
    assert other.sources["vehicle_speed"].description == "CCVS1 from 0x00"  # 0x0B has none


@pytest.mark.parametrize("take", [{"yaw_rate": "0x77"}, {"yaw": "0x3E"}, {"all": "VDC9"}])
def test_a_missing_source_is_wrong_usage(tmp_path: Path, take: dict[str, str]) -> None:
    with pytest.raises(OncenterError, match="--source") as refused:
        read_frames(tmp_path, drive(), take=take)
    assert (refused.value.code, refused.value.exit_code) == ("unknown_source", 2)


def test_the_same_message_on_two_buses_is_two_sources(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    lines = candump(drive(), "can0").splitlines() + candump(drive(), "can1").splitlines()
    path.write_text("\n".join(sorted(lines)) + "\n")
    signals = read(path)
    assert signals.rate_hz == 100.0
    assert signals.sources["yaw_rate"].description == "VDC2 from 0x3E on can0"
    assert signals.sources["yaw_rate"].others == ("VDC2 from 0x3E on can1",)


def test_a_relative_sensor_is_named(tmp_path: Path) -> None:
    data = bytes.fromhex("2E8820857D577D7D")
    signals = read_frames(tmp_path, [Frame(START_S + k / 100, identifier(61449, 0x3E), data) for k in range(200)])
    assert (signals.table["steering_wheel_angle_sensor_type"] == 0.0).all()
    assert not any("relative" in note for note in read_frames(tmp_path, drive()).notes)


OTHER_TRUCK = """VERSION ""
BU_: Vector__XXX
BO_ 291 STEER: 8 Vector__XXX
 SG_ Wheel : 7|16@0- (0.1,0) [-800|800] "deg" Vector__XXX
 SG_ Turning : 23|16@0- (0.01,0) [0|0] "deg/s" Vector__XXX
BO_ 2566852862 PROP: 8 Vector__XXX
 SG_ RoadSpeed : 0|16@1+ (0.01,0) [0|300] "km/h" Vector__XXX
BA_DEF_ SG_ "SPN" INT 0 524287;
BA_DEF_DEF_ "SPN" 0;
BA_ "SPN" SG_ 2566852862 RoadSpeed 84;
"""


def test_a_dbc_adds_messages_outside_j1939(tmp_path: Path) -> None:
    (tmp_path / "other.dbc").write_text(OTHER_TRUCK)
    frames = []
    for k in range(200):
        payload = (-123 + k).to_bytes(2, "big", signed=True) + (50).to_bytes(2, "big") + b"\0" * 4
        frames.append(Frame(START_S + k / 100, 0x123, payload, extended=False))
        if k % 10 == 0:
            frames.append(Frame(START_S + k / 100, 2566852862 & 0x1FFFFF00 | 0x42, (7200).to_bytes(2, "little")))
    names = {
        "steering_wheel_angle": SignalName("STEER.Wheel", sign=-1),
        "yaw_rate": SignalName("Turning", "deg/s"),
    }
    signals = read_frames(tmp_path, frames, names=names, dbc=[tmp_path / "other.dbc"])
    row = signals.table.row(100, named=True)
    assert row["steering_wheel_angle_rad"] == pytest.approx(2.3 * DEGREE)
    assert row["yaw_rate_rad_s"] == pytest.approx(0.5 * DEGREE)
    assert row["vehicle_speed_m_s"] == pytest.approx(20.0)
    assert signals.sources["steering_wheel_angle"].description == "STEER (0x123)"
    assert signals.sources["vehicle_speed"].description == "PROP from 0x42"


MIXED = """VERSION ""
NS_ :
    SG_MUL_VAL_
BU_: Vector__XXX
BO_ 800 MIX: 8 Vector__XXX
 SG_ SEL M : 0|8@1+ (1,0) [0|0] "" Vector__XXX
 SG_ SUB m0M : 8|8@1+ (1,0) [0|0] "" Vector__XXX
 SG_ steering_wheel_angle m1 : 16|16@1- (0.1,0) [-800|800] "deg" Vector__XXX
 SG_ yaw_rate m2 : 16|16@1- (0.01,0) [0|0] "deg/s" Vector__XXX
 SG_ vehicle_speed m1 : 16|16@1+ (0.01,0) [0|300] "km/h" Vector__XXX

SG_MUL_VAL_ 800 SUB SEL 0-0;
SG_MUL_VAL_ 800 steering_wheel_angle SUB 1-1, 5-6;
SG_MUL_VAL_ 800 yaw_rate SUB 2-2;
SG_MUL_VAL_ 800 vehicle_speed SEL 1-1;
"""


def test_a_multiplexed_signal_is_read_from_its_own_frames(tmp_path: Path) -> None:
    """Two nested multiplexers, one with ranges: other signals at the same position are not used."""
    (tmp_path / "mix.dbc").write_text(MIXED)
    frames = []
    for k in range(200):
        at = START_S + k / 100
        for late, (select, below, value) in enumerate([(0, (1, 5, 6)[k % 3], 100 + k), (0, 2, 300), (0, 3, 9999)]):
            data = bytes([select, below]) + value.to_bytes(2, "little") + bytes(4)
            frames.append(Frame(at + 0.002 * late, 800, data, extended=False))
        if k % 10 == 0:
            frames.append(Frame(at + 0.007, 800, b"\1\1" + (7200).to_bytes(2, "little") + bytes(4), extended=False))
    signals = read_frames(tmp_path, frames, dbc=[tmp_path / "mix.dbc"])
    assert np.allclose(signals.table["steering_wheel_angle_rad"], (10 + np.arange(200) / 10) * DEGREE)
    assert signals.table["yaw_rate_rad_s"].drop_nans().unique().to_list() == pytest.approx([3.0 * DEGREE])
    assert signals.table["vehicle_speed_m_s"].drop_nans().unique().to_list() == pytest.approx([20.0])
    assert {name: (s.rate_hz, s.samples, s.not_available) for name, s in signals.sources.items()} == {
        "steering_wheel_angle": (100.0, 200, 0),
        "yaw_rate": (100.0, 200, 0),
        "vehicle_speed": (10.0, 20, 0),
    }


def test_a_dbc_of_another_network_is_reported_by_its_messages(tmp_path: Path) -> None:
    (tmp_path / "mix.dbc").write_text(MIXED)
    car = [Frame(START_S + k / 100, 0x123, b"\1\2\3", extended=False) for k in range(50)]
    with pytest.raises(OncenterError, match=r"none of the messages that the database describes: MIX .0x320."):
        read_frames(tmp_path, car, dbc=[tmp_path / "mix.dbc"])


def test_the_shipped_dbc_by_option_changes_nothing(tmp_path: Path) -> None:
    plain = read_frames(tmp_path, drive())
    described = read_frames(tmp_path, drive(), dbc=[Path(__file__).parents[1] / "dbc" / "oncenter_j1939.dbc"])
    without_bits = {name: replace(source, place="") for name, source in described.sources.items()}
    assert without_bits == plain.sources != described.sources
    assert np.allclose(described.table.to_numpy(), plain.table.to_numpy(), atol=1e-12, rtol=0, equal_nan=True)


def test_a_named_signal_needs_a_unit(tmp_path: Path) -> None:
    (tmp_path / "other.dbc").write_text(OTHER_TRUCK.replace('"deg"', '""'))
    with pytest.raises(OncenterError, match="steering_wheel_angle") as refused:
        read_frames(
            tmp_path,
            drive(),
            names={"steering_wheel_angle": SignalName("STEER.Wheel")},
            dbc=[tmp_path / "other.dbc"],
        )
    assert (refused.value.code, refused.value.exit_code) == ("unit_missing", 2)


def test_speed_of_two_gateways_need_not_be_the_same_to_be_used(tmp_path: Path) -> None:
    """0.1 km/h apart is rounding, not another truck."""
    one = [ccvs1(START_S + k / 10, 20.0, 0x00) for k in range(40)]
    two = [ccvs1(START_S + k / 10 + 0.01, 20.03, 0x27) for k in range(40)]
    assert read_frames(tmp_path, one + two).sources["vehicle_speed"].description == "CCVS1 from 0x00"
