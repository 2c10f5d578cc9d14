"""Whatever a bus does to stamps, frames and turns: who heard it frame by frame says what its log says, bit for bit."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_drive import TRUCK, cut, drive_log, fed, frames_of_log

import oncenter as oc
from oncenter.live.learner import Learner, needed
from oncenter.read.frames import Frames, joined, pgn_of
from oncenter.read.stream import Stream
from oncenter.signals import SignalName
from oncenter.simulate import simulate_to_log

VDC2, EBC2, HRW = 61449, 65215, 65134

ALL_IN_ONE = """VERSION ""
BU_: car
BO_ 512 All: 8 car
 SG_ Angle : 0|16@1- (0.0002,0) [-6.5|6.5] "rad" car
 SG_ YawRate : 16|16@1- (0.00002,0) [-0.6|0.6] "rad/s" car
 SG_ Speed : 32|16@1+ (0.001,0) [0|65] "m/s" car
 SG_ Side : 48|16@1- (0.0005,0) [-16|16] "m/s2" car
"""
ALL_NAMES = {
    "steering_wheel_angle": SignalName("All.Angle", "rad"),
    "yaw_rate": SignalName("All.YawRate", "rad_s"),
    "vehicle_speed": SignalName("All.Speed", "m_s"),
    "lateral_acceleration": SignalName("All.Side", "m_s2"),
}


@cache
def driven() -> Frames:
    return frames_of_log(drive_log(400.0))


def of_group(frames: Frames, *pgns: int) -> np.ndarray:
    return frames.extended & np.isin(pgn_of(frames.identifier), pgns)


def stamped(frames: Frames, time: np.ndarray) -> Frames:
    """The frames in the order of their new stamps, as a logger writes them."""
    order = np.argsort(time, kind="stable")
    return replace(frames.where(order), time=np.round(time[order], 6))


def trembling(frames: Frames, seed: int, sigma_s: float = 0.002) -> Frames:
    return stamped(frames, frames.time + np.random.default_rng(seed).normal(0.0, sigma_s, len(frames)))


def in_bursts(frames: Frames, seed: int) -> Frames:
    """A gateway that hands over every 30 ms or so what has come, one frame after the other."""
    chances = np.random.default_rng(seed)
    handed = frames.time[0] + np.cumsum(chances.uniform(0.02, 0.04, 30_000))
    to = handed[np.searchsorted(handed, frames.time)]
    first = np.concatenate(([True], to[1:] != to[:-1]))
    place = np.arange(len(to)) - np.maximum.accumulate(np.where(first, np.arange(len(to)), 0))
    return stamped(frames, to + 0.0003 * place)


def with_losses(frames: Frames, seed: int) -> Frames:
    """Every sixth frame, in the first second every second one."""
    share = np.where(frames.time < frames.time[0] + 1.0, 0.5, 1 / 6)
    return frames.where(np.random.default_rng(seed).random(len(frames)) > share)


def silent_at_first(frames: Frames) -> Frames:
    """Three frames, nothing for a second, then all but the angle's sender, which comes another second later."""
    since = frames.time - frames.time[0]
    return frames.where((np.arange(len(frames)) < 3) | (since > 2.0) | ((since > 1.0) & ~of_group(frames, VDC2)))


def wheels_that_know_nothing_before_they_roll(frames: Frames) -> Frames:
    mute = of_group(frames, EBC2, HRW) & (frames.time < frames.time[0] + 20.0)
    return replace(frames, data=np.where(mute, np.uint64(0xFFFFFFFFFFFFFFFF), frames.data))


def wheels_that_begin_late(frames: Frames) -> Frames:
    return frames.where(~of_group(frames, EBC2, HRW) | (frames.time > frames.time[0] + 4.5))


def wheels_that_join_later(frames: Frames) -> Frames:
    """EBC2 first, HRW, which is better, a second after it; the lateral acceleration's sender all the time."""
    since = frames.time - frames.time[0]
    return frames.where((~of_group(frames, EBC2) | (since > 60.0)) & (~of_group(frames, HRW) | (since > 61.0)))


def wheels_that_come_at_the_end(frames: Frames) -> Frames:
    return frames.where(~of_group(frames, EBC2, HRW) | (frames.time > frames.time[-1] - 1.5))


def slow_by_its_clock(frames: Frames) -> Frames:
    """A sender built for 80 Hz whose quartz is off, trembling: no nominal rate is near."""
    return trembling(replace(frames, time=frames.time[0] + (frames.time - frames.time[0]) * 1.2513), seed=9)


def written(frames: Frames, path: Path) -> Path:
    lines = (
        f"({time:.6f}) can0 {number:0{8 if wide else 3}X}#{int(data).to_bytes(8, 'little')[:size].hex().upper()}\n"
        for time, number, wide, data, size in zip(
            frames.time, frames.identifier, frames.extended, frames.data, frames.length, strict=True
        )
    )
    path.write_text("".join(lines))
    return path


# What a log says of its holes, ends and values; a bus has no end.
OF_LOGS = ("recording_has_holes", "signal_began_late", "signal_ended_early", "values_left_out")


def numbers(answer: oc.Answer | None) -> dict[str, Any]:
    assert answer is not None
    members = {
        key: value for key, value in answer.to_dict().items() if key not in ("log", "notes", "accounts", "drives")
    }
    return members | {"findings": [each for each in members["findings"] if each["code"] not in OF_LOGS]}


def check_same(log: Path, **of_read: Any) -> float:
    """Ticks, answer and angle; the rate, Hz, of both."""
    signals, truck = oc.read(log, **of_read), oc.vehicle(TRUCK)
    learner = Learner(Stream("bus", needed(truck), **of_read), truck)
    stepped = fed(learner, frames_of_log(log), most=2000)
    live_s = np.concatenate([step.ticks["time_s"] for step in stepped])
    assert learner.stream.rate_hz == signals.rate_hz
    assert np.array_equal(live_s, signals.table["time_s"].to_numpy())
    answer = oc.offset(signals, truck)
    assert answer.offset.value is not None
    assert numbers(learner.known().answer) == numbers(answer)
    live_angle = np.concatenate([step.outputs["angle"]["angle"] for step in stepped])
    assert np.array_equal(live_angle, oc.angle(signals, truck)["steering_wheel_angle_rad"].to_numpy())
    return signals.rate_hz


@pytest.mark.parametrize(
    "frames_of",
    [
        lambda frames: trembling(frames, seed=1, sigma_s=0.001),
        lambda frames: trembling(frames, seed=2),
        lambda frames: in_bursts(frames, seed=3),
        lambda frames: with_losses(frames, seed=4),
        silent_at_first,
        wheels_that_know_nothing_before_they_roll,
        wheels_that_begin_late,
        wheels_that_join_later,
        wheels_that_come_at_the_end,
    ],
    ids=[
        "1 ms",
        "2 ms",
        "in bursts",
        "lost",
        "silent at first",
        "no wheel speeds at first",
        "wheels begin late",
        "wheels join later",
        "wheels at the end",
    ],
)
def test_live_is_the_log_whatever_the_bus_does(frames_of: Any, tmp_path: Path) -> None:
    assert check_same(written(frames_of(driven()), tmp_path / "drive.log")) == 100.0


def test_a_sender_of_no_usual_rate_has_one_rate_live_and_in_the_log(tmp_path: Path) -> None:
    rate_hz = check_same(written(slow_by_its_clock(cut(driven(), 0, 60_000)), tmp_path / "drive.log"))
    assert rate_hz == pytest.approx(79.9, rel=0.02)


def test_with_too_many_losses_for_a_rate_log_and_live_use_the_same_one(tmp_path: Path) -> None:
    frames = trembling(with_losses(driven(), seed=5), seed=6)
    assert check_same(written(frames, tmp_path / "drive.log")) == pytest.approx(100.0, rel=0.2)


def test_of_two_senders_as_good_a_frame_more_does_not_decide(tmp_path: Path) -> None:
    frames = cut(driven(), 0, 60_000)
    angle = of_group(frames, VDC2)
    own = int(frames.identifier[angle][0] & 0xFF)
    other = replace(frames, identifier=np.where(angle, frames.identifier + 1, frames.identifier))
    late = replace(other, time=frames.time + 0.001).where(angle)
    first = frames.where(~(angle & (np.cumsum(angle) % 50 == 7)))  # two in a hundred are lost
    path = written(stamped(joined([first, late]), joined([first, late]).time), tmp_path / "drive.log")
    check_same(path)
    assert oc.read(path).sources["steering_wheel_angle"].description == f"VDC2 from 0x{own:02X}"


@pytest.mark.parametrize("sigma_s", [0.0, 0.0004, 0.002])
def test_signals_that_share_one_message_are_the_same_live(sigma_s: float, tmp_path: Path) -> None:
    dbc = tmp_path / "all.dbc"
    dbc.write_text(ALL_IN_ONE)
    frames = trembling(in_one_message(), seed=7, sigma_s=sigma_s)
    assert check_same(written(frames, tmp_path / "drive.log"), dbc=(dbc,), names=ALL_NAMES) == 100.0


def in_one_message() -> Frames:
    table = oc.read(drive_log(400.0)).table.fill_nan(0.0)
    fields = {
        "steering_wheel_angle_rad": 0.0002,
        "yaw_rate_rad_s": 0.00002,
        "vehicle_speed_m_s": 0.001,
        "lateral_acceleration_m_s2": 0.0005,
    }
    raw = [np.round(table[name].to_numpy() / scale).astype(np.int64) & 0xFFFF for name, scale in fields.items()]
    data = sum((part.astype(np.uint64) << np.uint64(16 * k) for k, part in enumerate(raw)), np.zeros(1, np.uint64))
    n = table.height
    return Frames(
        table["time_s"].to_numpy(),
        np.full(n, 512, np.uint32),
        np.zeros(n, bool),
        data,
        np.full(n, 8, np.uint8),
        np.zeros(n, np.uint64),
    )


def test_a_relative_sensor_is_the_same_live(tmp_path: Path) -> None:
    whole = tmp_path / "whole.log"
    truth = simulate_to_log("relative_angle", 1, whole)  # -1 turn, and 2 after an ignition
    frames = frames_of_log(whole)
    path = written(trembling(frames, seed=8), tmp_path / "drive.log")
    assert check_same(path) == 100.0
    signals = oc.read(path)
    answer = oc.offset(signals, oc.vehicle(TRUCK))
    assert answer.offset.ci95 is not None
    low, high = answer.offset.ci95
    assert low < truth.offset_rad < high
    assert [note for note in answer.notes if "whole turns" in note] != []
