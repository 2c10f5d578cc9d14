"""The answer while it is driven: what a bus gives frame by frame is what its log gives, and nothing is lost."""

import io
import json
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from drive_frames import DBC, START_S, Frame, candump, drive, identifier, truth, vdc2
from live_drive import TRUCK, cut, drive_log, fed, frames_of_log, in_batches, new_learner, one_frame, until
from rich.console import Console

import oncenter as oc
from oncenter.cli import run
from oncenter.live.history import CLOUD_POINTS, COURSE_POINTS, STRIP_S, History
from oncenter.live.learner import Learner, Stepped, needed
from oncenter.live.replay import Replay
from oncenter.live.session import Notices, Session
from oncenter.live.terminal import one_line, panel
from oncenter.offset.inputs import params_of
from oncenter.read.frames import Frames, joined
from oncenter.read.stream import Stream, Ticks
from oncenter.simulate import simulate_to_log


@pytest.fixture(scope="module")
def log() -> Path:
    return drive_log()


def in_one(parts: list[Ticks]) -> dict[str, np.ndarray]:
    parts = [part for part in parts if len(part["time_s"])]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def state(learner: Learner) -> bytes:
    assert learner.core is not None
    return learner.core.state_bytes()


def without_log(answer: oc.Answer | None) -> dict[str, Any]:
    assert answer is not None
    return {key: value for key, value in answer.to_dict().items() if key not in ("log", "accounts", "drives")}


def troubled_drive() -> list[Frame]:
    """12 s with a sensor that has no number for 0.3 s, a speed that is silent for 2 s, and a bus that is for 7."""
    frames = [frame for frame in drive(30.0) if not 13.0 < frame.time - START_S < 20.0]
    speed = identifier(65265, 0)
    frames = [frame for frame in frames if not (frame.identifier == speed and 8.0 < frame.time - START_S < 10.0)]
    return [
        replace(frame, data=b"\xff" * 8)
        if frame.identifier == identifier(61449, 0x3E) and 10.5 < frame.time - START_S < 10.8
        else frame
        for frame in frames
    ]


@pytest.mark.parametrize(("most", "dbc"), [(3, ()), (60, ()), (60, (DBC,)), (2000, ())])
def test_frames_one_by_one_give_the_ticks_of_their_log(tmp_path: Path, most: int, dbc: tuple[Path, ...]) -> None:
    path = tmp_path / "drive.log"
    path.write_text(candump(troubled_drive()))
    table = oc.read(path, dbc=dbc).table
    stream = Stream("bus", ("steering_wheel_angle", "yaw_rate", "vehicle_speed"), dbc=dbc)
    parts = [stream.add(batch) for batch in in_batches(frames_of_log(path), seed=most, most=most)]
    ticks = in_one([*parts, stream.finish()])
    assert list(ticks) == table.columns
    for name, column in ticks.items():
        assert np.array_equal(column, table[name].to_numpy(), equal_nan=True), name
    assert np.diff(ticks["time_s"]).max() > 6.0
    assert np.isnan(ticks["vehicle_speed_m_s"]).sum() > 150


def test_a_tick_is_given_out_as_soon_as_the_slowest_signal_is_past_it() -> None:
    position = [Frame(START_S + 0.4 + 2.0 * k, identifier(65267, 0x1C), b"\x00\x10\x20\x70" * 2) for k in range(10)]
    path_frames = sorted([*drive(20.0), *position], key=lambda frame: frame.time)  # where it is, nobody waits for
    stream = Stream("bus", ("steering_wheel_angle", "yaw_rate", "vehicle_speed"))
    rows = [(f.time, f.identifier, f.extended, f.data) for f in path_frames]
    late = []
    for time_s, number, extended, data in rows:
        ticks = stream.add(one_frame(time_s, number, extended, data))
        if not stream.listening and len(ticks["time_s"]):
            late.append(time_s - ticks["time_s"][0])
    assert np.max(late[1:]) < 0.12  # CCVS1 comes every 0.1 s


def test_live_and_offline_give_the_same_numbers_for_the_same_log(log: Path) -> None:
    learner = new_learner(str(log))
    stepped = fed(learner, frames_of_log(log))
    truck = oc.vehicle(TRUCK)
    answer = oc.offset(oc.read(log), truck)
    assert answer.offset.status == "valid"
    live = learner.known().answer
    assert live is not None and live.log == answer.log and without_log(live) == without_log(answer)
    angle = oc.angle(oc.read(log), truck)
    live_angle = np.concatenate([step.outputs["angle"]["angle"] for step in stepped])
    assert np.array_equal(live_angle, angle["steering_wheel_angle_rad"].to_numpy())


def test_a_relative_sensor_s_whole_turns_are_taken_out_once_the_truck_has_driven(tmp_path: Path) -> None:
    path = tmp_path / "relative.log"
    truth = simulate_to_log("relative_angle", 1, path)  # -1 turn, and 2 after an ignition
    learner = new_learner()
    stepped = fed(learner, frames_of_log(path))
    live, offline = learner.known().answer, oc.offset(oc.read(path), oc.vehicle(TRUCK))
    assert live is not None and live.offset.ci95 is not None and offline.offset.value is not None
    low, high = live.offset.ci95
    assert low < truth.offset_rad < high
    assert live.offset.value == pytest.approx(offline.offset.value, abs=np.radians(0.5))
    angle = np.concatenate([step.ticks["steering_wheel_angle_rad"] for step in stepped])
    speed = np.concatenate([step.ticks["vehicle_speed_m_s"] for step in stepped])
    assert np.nanmax(np.abs(angle[speed > 10.0])) < np.pi
    assert [note for note in live.notes if "turn" in note] == [
        f"{turns} whole turns are taken from the relative steering wheel angle from here on" for turns in ("-1", "+2")
    ]


def test_malformed_frames_and_29_bit_noise_change_nothing(log: Path) -> None:
    frames = cut(frames_of_log(log), 0, 20_000)
    quiet, noisy = new_learner(), new_learner()
    fed(quiet, frames)
    fed(noisy, _with_noise(frames))
    assert state(quiet) == state(noisy)


def _with_noise(frames: Frames) -> Frames:
    """The frames and as many others: random identifiers of 29 and 11 bits, lengths 0 to 8, wild stamps on groups that
    are ours from senders that are not used, and empty frames of a sender that is."""
    chances = np.random.default_rng(5)
    n = len(frames)
    number = chances.integers(0, 1 << 29, n).astype(np.uint32)
    ours = np.isin(
        (number >> np.uint32(8)) & np.uint32(0x3FFFF), np.unique(frames.identifier >> np.uint32(8) & 0x3FFFF)
    )
    number[ours] = 0x18FEF100 + 0x7F
    length = chances.integers(0, 9, n).astype(np.uint8)
    data = chances.integers(0, 1 << 63, n).astype(np.uint64) * np.uint64(2)
    extended = chances.random(n) < 0.8
    number[~extended] &= np.uint32(0x7FF)
    empty = chances.random(n) < 0.01
    number[empty], length[empty], data[empty] = 0x18F00900 | 0x55, 0, np.uint64(0xFFFFFFFFFFFFFFFF)
    extended[empty] = True
    time_s = frames.time.copy()
    wild = chances.random(n) < 0.01
    number[wild] = 0x18FFFF00
    extended[wild] = True
    time_s[wild] = 1e300
    noise = Frames(time_s, number, extended, data, length, frames.bus)
    both = joined([frames, noise])
    order = np.argsort(np.concatenate((np.arange(n), np.arange(n) + 0.5)), kind="stable")
    return both.where(order)


def test_before_the_needed_signals_are_there_it_says_which_are_not() -> None:
    stream = Stream("bus", ("steering_wheel_angle", "yaw_rate", "vehicle_speed"))
    for frame in drive(8.0):
        if frame.identifier >> 8 & 0xFFFF != 65265:
            stream.add(one_frame(frame.time, frame.identifier, frame.extended, frame.data))
    assert stream.listening
    assert "no vehicle speed (PGN 65265 CCVS1" in stream.missing()
    assert "61449 VDC2" in stream.missing() and "61444 EEC1" in stream.missing()
    rear = Stream("bus", ("rear_axle_angle",))
    for frame in drive(6.0):
        rear.add(one_frame(frame.time, frame.identifier, frame.extended, frame.data))
    assert "no rear axle angle (no J1939 message has it: name it in [signals]" in rear.missing()


def with_other_sender(frames: list[Frame], turned: dict[str, float], until_s: float = 1e9) -> list[Frame]:
    """A second VDC2 that differs from the first one in what is given, for a while."""
    added = []
    for frame in frames:
        if frame.identifier == identifier(61449, 0x3E) and frame.time - START_S < until_s:
            exact = {name: float(value) for name, value in truth(np.array(frame.time - START_S)).items()}
            values = [
                exact[name] + turned.get(name, 0.0)
                for name in ("steering_wheel_angle_rad", "yaw_rate_rad_s", "lateral_acceleration_m_s2")
            ]
            forward = turned.get("longitudinal_acceleration_m_s2", 0.0)
            added.append(vdc2(frame.time + 1e-4, *values, address=0x40, forward=forward))
    return sorted([*frames, *added], key=lambda frame: frame.time)


def heard(frames: list[Frame], stream: Stream) -> list[Ticks]:
    return [stream.add(one_frame(frame.time, frame.identifier, True, frame.data)) for frame in frames if frame.extended]


def test_senders_that_disagree_pause_the_estimate_with_the_option_that_would_do() -> None:
    stream = Stream("bus", ("steering_wheel_angle", "yaw_rate", "vehicle_speed"))
    frames = with_other_sender(drive(30.0), {"yaw_rate_rad_s": 0.05}, until_s=12.0)
    before = [frame for frame in frames if frame.time - START_S < 11.0]
    heard(before, stream)
    assert stream.listening and stream.paused is not None
    assert "VDC2 from 0x3E and VDC2 from 0x40 disagree about yaw_rate" in stream.missing()
    assert stream.missing().startswith("paused: ") and "--source yaw_rate=0x3E" in stream.missing()
    heard(frames[len(before) :], stream)
    assert not stream.listening and stream.paused is None and stream.missing() == ""


def test_a_disagreement_about_a_signal_that_the_answer_does_not_need_leaves_it_out(tmp_path: Path) -> None:
    frames = with_other_sender(drive(20.0), {"longitudinal_acceleration_m_s2": 2.0})
    stream = Stream("bus", ("steering_wheel_angle", "yaw_rate", "vehicle_speed"))
    ticks = in_one([*heard(frames, stream), stream.finish()])
    left_out = "longitudinal_acceleration: left out, VDC2 from 0x3E and VDC2 from 0x40 disagree about longitudinal_acc"
    assert [note for note in stream.notes if note.startswith(left_out)] == stream.notes != []
    path = tmp_path / "drive.log"
    path.write_text(candump(frames))
    table = oc.read(path).table
    assert list(ticks) == table.columns and "longitudinal_acceleration_m_s2" not in ticks
    assert [note for note in oc.read(path).notes if note.startswith(left_out)] != []


def test_an_angle_that_comes_too_rarely_pauses_the_estimate() -> None:
    stream = Stream("bus", ("steering_wheel_angle", "yaw_rate", "vehicle_speed"))
    angle = identifier(61449, 0x3E)
    heard([f for f in drive(12.0) if f.identifier != angle or round((f.time - START_S) * 100) % 25 == 0], stream)
    assert stream.paused is not None and stream.paused.code == "rate_too_low"


def test_a_clock_that_is_set_back_while_a_bus_is_listened_to_begins_it_anew() -> None:
    stream = Stream("bus", ("steering_wheel_angle", "yaw_rate", "vehicle_speed"))
    early, late = drive(8.0), [replace(frame, time=frame.time + 1e6) for frame in drive(1.0)]
    heard(late, stream)
    assert stream.listening
    heard(early, stream)
    assert not stream.listening


def test_a_clock_that_is_set_back_costs_the_filters_and_not_what_was_learned(log: Path) -> None:
    frames = frames_of_log(log)
    learner = new_learner()
    fed_frames = cut(frames, 0, len(frames) // 2)
    for batch in in_batches(fed_frames, seed=2, most=4000):
        learner.take(batch)
    before = learner.known().answer
    rest = cut(frames, len(frames) // 2, len(frames))
    learner.take(replace(rest, time=rest.time - 1e9))
    after = learner.known().answer
    assert before is not None and after is not None
    assert after.used_s > before.used_s + 100.0


def test_the_course_is_the_same_in_few_large_steps_as_in_many_small_ones(log: Path) -> None:
    courses = []
    for most in (200, 60_000):
        history = History()
        for step in fed(new_learner(), frames_of_log(log), most=most):
            history.take(step)
        courses.append(history.course())
    assert len(courses[0].time_s) > 300
    assert courses[0] == courses[1]


def test_history_takes_no_more_memory_after_a_day(log: Path) -> None:
    history = History()
    stepped = fed(new_learner(), cut(frames_of_log(log), 0, 40_000))
    for hour in range(20):
        for step in stepped:
            later = {**step.ticks, "time_s": step.ticks["time_s"] + 100.0 * hour}
            history.take(Stepped(later, step.outputs))
    assert len(history.course().time_s) <= COURSE_POINTS
    assert len(history.strip().begin_s) == STRIP_S
    assert len(history.cloud().place) <= CLOUD_POINTS


# The verb


@pytest.mark.system
def test_a_replay_says_what_offset_says(capsys: pytest.CaptureFixture[str]) -> None:
    short = drive_log(60.0)
    assert run(["live", "--replay", str(short), "--speed", "100", "--vehicle", TRUCK, "--json"]) == 0
    live = json.loads(capsys.readouterr().out)
    assert run(["offset", str(short), "--vehicle", TRUCK, "--json"]) == 0
    assert live.pop("drives")[0]["fingerprint"] == ""  # a bus has no file
    offline = json.loads(capsys.readouterr().out)
    assert offline.pop("drives") and live == offline | {"accounts": []}


@pytest.mark.system
@pytest.mark.parametrize(
    ("arguments", "exit_code", "words"),
    [
        ([], 2, "name either a CHANNEL or --replay LOG"),
        (["can0", "--interface", "telepathy"], 2, "interfaces of python-can: "),
        pytest.param(["can99"], 1, "cannot open can99 (socketcan)", marks=pytest.mark.linux),
        (["--replay", "none.log"], 1, "cannot read none.log: No such file or directory"),
        (["--replay", "/"], 1, "/ is a directory, not a log"),
        (["--replay", "none.log", "--speed", "1000"], 2, "--speed must be 1 to 100"),
        (["--replay", "none.log", "--bitrate", "250000"], 2, "--bitrate is for a bus"),
        (["can0", "--speed", "2"], 2, "--speed is for --replay"),
        (["can0", "--web", "--port", "99999"], 2, "--port"),
        (["can0", "--web", "--port", "-1"], 2, "--port"),
    ],
)
def test_wrong_usage_is_one_line(
    arguments: list[str], exit_code: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["live", *arguments, "--vehicle", TRUCK]) == exit_code
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1


def test_a_table_is_not_replayed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "drive.csv"
    log.write_text("time_s,yaw_rate_deg_s\n0,0\n1,0\n")
    assert run(["live", "--replay", str(log), "--vehicle", TRUCK]) == 2
    assert "for a table use oncenter offset" in capsys.readouterr().err


@pytest.mark.system
def test_ctrl_c_saves_and_answers(log: Path, tmp_path: Path) -> None:
    trace = tmp_path / "trace.parquet"
    arguments = ["live", "--replay", str(log), "--speed", "100", "--vehicle", TRUCK, "--state", str(tmp_path / "state")]
    process = subprocess.Popen(
        [sys.executable, "-m", "oncenter", *arguments, "--trace", str(trace), "--truck", "vin 7"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    until((tmp_path / "state" / "vin%207.state").exists)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert process.returncode == 0, err
    ending, finished = err.splitlines()
    assert ending == "oncenter: the session ends"
    assert re.fullmatch(r"oncenter: finished at \d\d:\d\d:\d\d after .* of signals: final result\.", finished)
    assert out.split(":")[0] in ("Undecided", "Within the limit", "Recalibrate")
    assert sorted(p.name for p in (tmp_path / "state").iterdir()) == ["vin%207.state"]
    assert pl.read_parquet(trace).height > 100


def test_a_replay_of_a_drive_that_pauses_does_not_wait(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    path.write_text(candump([*drive(1.0), *(replace(f, time=f.time + 9000.0) for f in drive(1.0))]))
    replay = Replay(path, 10.0)
    frames = 0
    begin_s = time.monotonic()
    while not replay.ended:
        frames += len(replay.take(0.01))
        assert time.monotonic() < begin_s + 20.0
    assert frames == 2 * len(drive(1.0))


def test_the_terminal_names_the_missing_driving(capsys: pytest.CaptureFixture[str]) -> None:
    truck = oc.vehicle(TRUCK)
    replay = Replay(drive_log(60.0), 100.0)
    session = Session(replay, Learner(Stream(replay.name, needed(truck)), truck), "truck 7", Notices())
    session.run()
    assert session.failure is None
    console = Console(file=io.StringIO(), width=120, record=True)
    console.print(panel(session.snapshot, params_of(truck, None)))
    shown = console.export_text()
    assert "truck 7 on " in shown and "more above 11 km/h" in shown and "s of bends to the" in shown
    assert "13200 in all" in shown
    line = one_line(session.snapshot, params_of(truck, None))
    assert line.startswith("Undecided: drive ") and "still needed: " in line and "more above 11 km/h" in line
