"""Several senders of one signal: those that disagree are named with their values, and with a --source that selects."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from drive_frames import START_S, Frame, candump, drive, identifier, truth, vdc2

from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.read import read
from oncenter.signals import DEGREE

NEEDED = ("steering_wheel_angle", "yaw_rate", "lateral_acceleration")


def second(address: int = 0x0B, **more: float) -> list[Frame]:
    """A second VDC2, each signal in SI with a constant added."""
    frames = []
    for k in range(400):
        at = {name: float(value) for name, value in truth(np.array(k / 100)).items()}
        angle = at["steering_wheel_angle_rad"] + more.get("steering_wheel_angle", 0.0)
        yaw_rate = at["yaw_rate_rad_s"] + more.get("yaw_rate", 0.0)
        acceleration = at["lateral_acceleration_m_s2"] + more.get("lateral_acceleration", 0.0)
        frames.append(vdc2(START_S + k / 100 + 0.003, angle, yaw_rate, acceleration, address))
    return frames


def log_of(folder: Path, *buses: list[Frame]) -> Path:
    lines = [line for number, frames in enumerate(buses) for line in candump(frames, f"can{number}").splitlines()]
    (folder / "drive.log").write_text("\n".join(sorted(lines)) + "\n")
    return folder / "drive.log"


def proposed(error: str) -> list[str]:
    """The sources that a message proposes, as a shell takes them."""
    words = shlex.split(error.partition("choose one with ")[2].partition("; ")[0])
    return [word for word in words if "=" in word]


@pytest.mark.parametrize(
    ("signal", "constant", "said"),
    [
        ("steering_wheel_angle", 0.8 * DEGREE, r"by 0\.80 deg \(medians -?\d+\.\d+ and -?\d+\.\d+ deg\)"),
        ("steering_wheel_angle", -0.4 * DEGREE, r"by 0\.40 deg"),
        ("yaw_rate", 0.2 * DEGREE, r"by 0\.20 deg/s"),
        ("lateral_acceleration", 0.2, r"by 0\.20 m/s\^2"),
    ],
)
def test_a_constant_difference_of_two_senders_is_refused_with_its_number(
    signal: str, constant: float, said: str, tmp_path: Path
) -> None:
    log = log_of(tmp_path, drive() + second(**{signal: constant}))
    with pytest.raises(OncenterError, match=said) as refused:
        read(log)
    assert (refused.value.code, refused.value.needs) == ("sources_disagree", (signal,))
    values = []
    for choice in proposed(str(refused.value)):
        name, _, source = choice.partition("=")
        given = read(log, take={name: source})
        column = next(each for each in given.columns if each.startswith(f"{signal}_"))
        values.append(float(np.nanmedian(given.columns[column])))
    assert abs(abs(values[0] - values[1]) - abs(constant)) < 0.1 * abs(constant)


@pytest.mark.parametrize(
    ("signal", "constant"),
    [("steering_wheel_angle", 0.2 * DEGREE), ("yaw_rate", 0.05 * DEGREE), ("lateral_acceleration", 0.05)],
)
def test_two_senders_that_agree_within_their_noise_are_used(signal: str, constant: float, tmp_path: Path) -> None:
    assert read(log_of(tmp_path, drive() + second(**{signal: constant}))).sources[signal].others == ("VDC2 from 0x3E",)


def test_of_two_buses_with_one_address_the_bus_is_proposed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = log_of(tmp_path, drive(), second(0x3E, steering_wheel_angle=0.8 * DEGREE))
    assert run(["signals", str(log)]) == 1
    first, other = proposed(capsys.readouterr().err)
    assert (first, other) == (
        "steering_wheel_angle=VDC2 from 0x3E on can0",
        "steering_wheel_angle=VDC2 from 0x3E on can1",
    )
    for choice in (first, other):
        assert run(["signals", str(log), "--source", choice]) == 0
        assert choice.partition("=")[2] in capsys.readouterr().out


STEER = 'BO_ {id} {name}: 8 X\n SG_ {signal} : {bit}|16@1- (0.1,0) [0|0] "deg" X\n'


def databases(folder: Path, *messages: str) -> list[Path]:
    paths = []
    for number, message in enumerate(messages):
        paths.append(folder / f"net{number}.dbc")
        paths[-1].write_text(f'VERSION ""\nBU_: X\n{message}')
    return paths


def steer(identifiers: list[int], extended: bool = False) -> list[Frame]:
    """The angle 1 deg in the first two bytes of the first identifier, 2 deg in the others and in the next two bytes."""
    data = [((10 + 10 * (k > 0)).to_bytes(2, "little") + (20).to_bytes(2, "little")) for k in range(len(identifiers))]
    return [
        Frame(START_S + k / 100 + 1e-3 * n, each, data[n] + bytes(4), extended)
        for k in range(300)
        for n, each in enumerate(identifiers)
    ]


def test_messages_of_one_name_have_descriptions_that_select_them(tmp_path: Path) -> None:
    angle = {"name": "STEER", "signal": "steering_wheel_angle"}
    one_id = [STEER.format(id=291, bit=bit, **angle) for bit in (0, 16)]
    two_ids = STEER.format(id=291, bit=0, **angle) + STEER.format(id=292, bit=0, **angle)
    of_extended = STEER.format(id=0x98FF0103, bit=0, **angle) + STEER.format(id=0x98FF0203, bit=0, **angle)
    for messages, frames in (
        (one_id, steer([291])),
        ([two_ids], steer([291, 292])),
        ([of_extended], steer([0x18FF0103, 0x18FF0203], extended=True)),
    ):
        dbc = databases(tmp_path, *messages)
        log = log_of(tmp_path, frames)
        with pytest.raises(OncenterError, match=r"by 1\.00 deg") as refused:
            read(log, dbc=dbc)
        values = []
        for choice in proposed(str(refused.value)):
            drive_ = read(log, dbc=dbc, take={"steering_wheel_angle": choice.partition("=")[2]})
            values.append(float(drive_.columns["steering_wheel_angle_rad"][50]) / DEGREE)
        assert sorted(values) == pytest.approx([1.0, 2.0]), str(refused.value)


def test_one_message_in_two_databases_is_one_source(tmp_path: Path) -> None:
    text = STEER.format(id=291, name="STEER", bit=0, signal="steering_wheel_angle")
    signals = read(log_of(tmp_path, steer([291])), dbc=databases(tmp_path, text, text))
    assert signals.sources["steering_wheel_angle"].description == "STEER (0x123)"
    assert signals.sources["steering_wheel_angle"].others == ()


def test_the_control_unit_of_a_database_is_not_named_for_frames_of_another(tmp_path: Path) -> None:
    angle = STEER.format(id=0x8CF0093E, name="SAS_VDC2", bit=0, signal="steering_wheel_angle")
    log = log_of(tmp_path, steer([identifier(61449, 0x0B)], extended=True))
    source = read(log, dbc=databases(tmp_path, angle)).sources["steering_wheel_angle"].description
    assert source == "PGN 61449 from 0x0B (as SAS_VDC2)"
    assert re.fullmatch(r"SAS_VDC2 from 0x3E", _from_its_own(tmp_path, angle))


def _from_its_own(folder: Path, angle: str) -> str:
    log = log_of(folder, steer([identifier(61449, 0x3E)], extended=True))
    return read(log, dbc=databases(folder, angle)).sources["steering_wheel_angle"].description


def test_of_a_proprietary_message_the_described_sender_is_used(tmp_path: Path) -> None:
    """Other control units send other contents by the same number."""
    angle = STEER.format(id=0x98FF0133, name="SAS", bit=0, signal="steering_wheel_angle")
    log = log_of(tmp_path, steer([0x18FF0133, 0x18FF0111], extended=True))
    source = read(log, dbc=databases(tmp_path, angle)).sources["steering_wheel_angle"]
    assert source.description == "SAS from 0x33"
