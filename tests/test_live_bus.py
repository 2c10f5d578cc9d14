"""A live bus, and what may happen to it: lost, silent, faster than the computer, lied to."""

import json
import logging
import os
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from drive_frames import START_S, drive
from live_drive import TRUCK, frames_of_log, message, new_learner, until

import oncenter as oc
from oncenter.errors import OncenterError
from oncenter.live import bus as live_bus
from oncenter.live.bus import Bus
from oncenter.live.record import Recorder
from oncenter.live.session import Notices, Session
from oncenter.live.snapshot import Dropped
from oncenter.live.socket_losses import SocketLosses

pytestmark = pytest.mark.system


def without_log(answer: oc.Answer | None) -> dict[str, Any]:
    assert answer is not None
    return {key: value for key, value in answer.to_dict().items() if key not in ("log", "accounts", "drives")}


def sender(channel: str) -> can.BusABC:
    return can.Bus(channel=channel, interface="virtual", preserve_timestamps=True)


def ended(session: Session, when: Any, timeout_s: float = 60.0) -> Session:
    """Runs it until something is so, then ends it."""
    session.start()
    until_s = time.monotonic() + timeout_s
    while not when(session.snapshot) and session.is_alive():
        assert time.monotonic() < until_s
        time.sleep(0.02)
    session.stop()
    session.join()
    if session.failure is not None:
        raise session.failure
    return session


@pytest.mark.parametrize("trembling_s", [0.0, 0.002])
def test_what_is_recorded_of_a_bus_answers_as_the_bus_did(trembling_s: float, tmp_path: Path) -> None:
    notices, chances = Notices(), np.random.default_rng(1)
    stamps = (frame.time + 1.234e-7 + chances.normal(0.0, trembling_s) for frame in drive(60.0))  # finer than a log's
    frames = sorted(map(lambda frame, time: replace(frame, time=time), drive(60.0), stamps), key=lambda f: f.time)
    channel = f"recorded {trembling_s}"
    bus, learner = Bus(channel, "virtual", None, notices.say), new_learner()
    path = tmp_path / "kept.log"
    with sender(channel) as sending:
        for frame in frames:
            sending.send(message(frame))
        session = Session(bus, learner, "truck", notices, recorder=Recorder(path, notices.say))
        ended(session, lambda now: now.frames == len(frames))
    assert len(path.read_text().splitlines()) == len(frames)
    live = session.snapshot.known.answer
    assert without_log(live) == without_log(oc.offset(oc.read(path), oc.vehicle(TRUCK)))
    assert session.snapshot.dropped == Dropped()


def test_a_bus_that_is_lost_is_opened_again_and_nothing_learned_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    pieces = [drive(20.0), [frame for frame in drive(40.0) if frame.time - START_S > 22.0]]
    opened = []

    class Cable:
        """Gives a piece of the drive, then fails as a driver does; the second time it cannot be opened at first."""

        def __init__(self, **options: Any) -> None:
            opened.append(options)
            if len(opened) == 2:
                raise can.CanInitializationError("no device")
            self.frames = iter(pieces.pop(0))

        def recv(self, timeout: float) -> can.Message | None:
            frame = next(self.frames, None)
            if frame is None and pieces:
                raise can.CanOperationError("Network is down")
            return None if frame is None else message(frame)

        def fileno(self) -> int:
            raise NotImplementedError

        def shutdown(self) -> None:
            raise OSError("already gone")

    total = sum(map(len, pieces))
    monkeypatch.setattr(can, "Bus", Cable)
    monkeypatch.setattr(live_bus, "TRY_AGAIN_S", 0.05)
    notices = Notices()
    learner = new_learner()
    bus = Bus("can0", "socketcan", 250_000, notices.say)
    session = ended(Session(bus, learner, "truck", notices), lambda now: now.frames == total)
    assert opened == [{"channel": "can0", "interface": "socketcan", "bitrate": 250_000}] * 3
    lost, back = (line.text for line in session.snapshot.notices)
    assert lost.startswith("can0 (socketcan) is lost: Network is down; oncenter tries to open it again, after ")
    assert back.startswith("can0 (socketcan) is back after ")
    assert session.snapshot.driven_s == pytest.approx(40.0, abs=0.1)  # 2 s of silence are ticks without signals


def test_a_bus_that_falls_silent_is_reported_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("oncenter.live.session.SILENT_S", 0.2)
    notices = Notices()
    bus = Bus("silent", "virtual", None, notices.say)
    with sender("silent") as sending:
        session = Session(bus, new_learner(), "truck", notices)
        session.start()
        time.sleep(0.8)
        sending.send(message(drive(0.1)[0]))
        ended_with = [line.text for line in _stopped(session, lambda now: now.frames == 1).notices]
    assert ended_with[0] == "no frame on silent (virtual) for 0 s: check cable, ignition and bitrate"
    assert len(ended_with) == 2 and ended_with[1].startswith("frames again after ")


def test_a_disagreement_of_senders_does_not_end_the_recording(tmp_path: Path) -> None:
    other = [replace(frame, identifier=frame.identifier + 2, time=frame.time + 1e-4) for frame in drive(10.0)[::4]]
    turned = [replace(frame, data=b"\x00\x70" + frame.data[2:]) for frame in other]  # the angle's bytes
    frames = sorted([*drive(10.0), *turned], key=lambda frame: frame.time)
    notices, path = Notices(), tmp_path / "kept.log"
    bus = Bus("disagreeing", "virtual", None, notices.say)
    with sender("disagreeing") as sending:
        for frame in frames:
            sending.send(message(frame))
        session = Session(bus, new_learner(), "truck", notices, recorder=Recorder(path, notices.say))
        ended(session, lambda now: now.frames == len(frames) and now.phase == "paused")
    assert len(path.read_text().splitlines()) == len(frames)
    assert session.snapshot.known.answer is None
    (line,) = (line.text for line in notices.all())
    assert line.startswith("the estimate is paused, recording continues: VDC2 from 0x3E and VDC2 from 0x40 disagree")
    assert "--source steering_wheel_angle=0x3E" in line


def test_frames_that_no_can_bus_can_carry_are_counted_said_once_and_not_recorded(tmp_path: Path) -> None:
    good = [message(frame) for frame in drive(1.0)]
    wrong = [
        can.Message(arbitration_id=1 << 29, timestamp=START_S),
        can.Message(arbitration_id=1 << 40, timestamp=START_S),
        can.Message(arbitration_id=0x900, is_extended_id=False, timestamp=START_S),
        can.Message(arbitration_id=1, timestamp=float("nan")),
        can.Message(arbitration_id=1, timestamp=1e300),
        can.Message(arbitration_id=1, timestamp=START_S, data=bytes(300), dlc=300),
    ]
    good[5].channel = "can0 00000001#00\n(0.0) can0"  # becomes part of a line of the recording
    notices, path = Notices(), tmp_path / "kept.log"
    bus = Bus("gateway", "virtual", None, notices.say)
    with sender("gateway") as sending:
        for one in [*wrong[:3], *good, *wrong[3:]]:
            sending.send(one)
        session = Session(bus, new_learner(), "truck", notices, recorder=Recorder(path, notices.say))
        ended(session, lambda now: now.frames == len(good) and now.dropped.impossible == len(wrong))
    assert len(frames_of_log(path)) == len(path.read_text().splitlines()) == len(good)
    assert [line.text for line in notices.all()] == [
        "gateway (virtual) sent a frame with an identifier, length or time that is impossible on CAN: such frames are "
        "discarded and counted",
        f"of {len(good)} frames in all, discarded: {len(wrong)} that are no CAN frames",
    ]


# A bus over UDP: a socket of which the kernel drops frames


@pytest.fixture
def group() -> str:
    """The group of this process: two runs of the tests beside each other must not receive each other's frames."""
    return f"239.74.{os.getpid() // 256 % 256}.{os.getpid() % 256}"


def over_udp(group: str, port: int = 43177) -> can.BusABC:
    return can.Bus(channel=group, interface="udp_multicast", port=port)


@pytest.mark.linux
def test_frames_that_the_kernel_drops_are_counted(group: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("oncenter.live.socket_losses.HOLD_BYTES", 4096)
    with over_udp(group) as receiving, over_udp(group) as sending:
        losses = SocketLosses(receiving, group)
        for frame in drive(1.0) * 3:
            sending.send(message(frame))
        got = 0
        while receiving.recv(0.2) is not None:
            got += 1
        assert 0 < got < 3 * len(drive(1.0))
        assert got + losses.new() == 3 * len(drive(1.0))
        assert losses.new() == 0
        losses.close()


def test_the_kernel_holds_more_where_it_may(group: str) -> None:
    with over_udp(group) as receiving:
        before = receiving._multicast._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
        SocketLosses(receiving, group).close()
        after = receiving._multicast._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    assert after > before


@pytest.mark.linux
def test_a_can_interface_s_own_counters_are_among_the_losses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    counters = tmp_path / "can0" / "statistics"
    counters.mkdir(parents=True)
    for name, count in (("rx_dropped", 7), ("rx_over_errors", 2)):
        (counters / name).write_text(f"{count}\n")
    monkeypatch.setattr("oncenter.live.socket_losses._NETWORK", tmp_path)
    monkeypatch.setattr(socket, "AF_CAN", socket.AF_INET)  # this machine may have no CAN
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        losses = SocketLosses(own, "can0")
        (counters / "rx_dropped").write_text("10\n")
        assert (losses.new(), losses.new()) == (3, 0)
        losses.close()


def test_lost_frames_are_said_once_where_they_were_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_bus, "WAITING_MAX", 5)
    notices = Notices()
    bus = Bus("fast", "virtual", None, notices.say)
    frames = drive(1.0)
    with sender("fast") as sending:
        for frame in frames:
            sending.send(message(frame))
        until(lambda: bus.dropped.queue == len(frames) - 5)
        session = Session(bus, new_learner(), "truck", notices)
        ended(session, lambda now: now.frames == 5)
    lost = f"lost: {len(frames) - 5} in oncenter's queue"
    assert [line.text for line in notices.all()] == [f"frames are being lost: {lost}", f"of 5 frames in all, {lost}"]


def test_a_stranger_s_datagram_does_not_end_the_bus(group: str, monkeypatch: pytest.MonkeyPatch) -> None:
    of_port = can.Bus
    monkeypatch.setattr(can, "Bus", lambda **options: of_port(**{**options, "port": 43178}))
    notices = Notices()
    bus = Bus(group, "udp_multicast", None, notices.say)
    with over_udp(group, port=43178) as sending:
        for data in (b"\xff", b"\x81\xa1x\x01", b"", b"\xc1" * 2000):
            sending._multicast.send(data)
        sending.send(message(drive(0.1)[0]))
        taken: list[can.Message] = []
        until(lambda: bool(taken.extend(bus.take(0.1)) or taken))
    bus.close()
    assert bus.dropped == Dropped(impossible=4)
    assert [line.text for line in notices.all()] == [
        f"{group} (udp_multicast) sent a frame that cannot be read: such frames are discarded and counted"
    ]


# A bus over TCP: a gateway that goes away


class Gateway:
    """A socketcand that gives each client two frames and then closes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.opened = 0
        self.listening: socket.socket | None = None
        with socket.create_server(("127.0.0.1", 0)) as probe:
            self.port = probe.getsockname()[1]
        of_peer = {"host": "127.0.0.1", "port": self.port}
        monkeypatch.setenv("CAN_CONFIG", json.dumps(of_peer))

    def begin(self) -> None:
        self.listening = socket.create_server(("127.0.0.1", self.port))
        threading.Thread(target=self._serve, args=(self.listening,), daemon=True).start()

    def end(self) -> None:
        if self.listening is not None:
            self.listening.shutdown(socket.SHUT_RDWR)
            self.listening.close()
            self.listening = None

    def _serve(self, listening: socket.socket) -> None:
        while True:
            try:
                client, _ = listening.accept()
            except OSError:
                return
            with client:
                try:
                    self._talk(client)
                except OSError:
                    continue

    def _talk(self, client: socket.socket) -> None:
        client.sendall(b"< hi >")
        for _ in range(2):
            if not client.recv(100):
                return
            client.sendall(b"< ok >")
        self.opened += 1
        client.sendall(b"< frame 18F00900 1700000000.5 0011223344556677 >< frame 3FFFFFFFF 1.0 00 >")
        time.sleep(0.1)


@pytest.fixture
def gateway(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gateway]:
    made = Gateway(monkeypatch)
    yield made
    made.end()


def test_a_gateway_that_closes_is_asked_again_and_one_that_refuses_is_said_once(
    gateway: Gateway, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(live_bus, "TRY_AGAIN_S", 0.05)
    notices = Notices()
    gateway.begin()
    bus = Bus("can0", "socketcand", None, notices.say)
    until(lambda: gateway.opened >= 2)  # it closed, and was opened again
    gateway.end()
    time.sleep(0.5)  # its last client has gone by then
    until(lambda: notices.all()[-1].text.startswith("can0 (socketcand) is lost: the peer closed the connection"))
    count = len(notices.all())
    time.sleep(1.0)
    assert len(notices.all()) == count  # it refuses
    gateway.begin()
    opened = gateway.opened
    until(lambda: gateway.opened > opened)
    until(lambda: any(" is back after " in line.text for line in notices.all()[count:]))
    bus.close()
    assert len(bus.take(0.0)) == gateway.opened
    assert bus.dropped == Dropped(impossible=gateway.opened)  # of 34 bits
    assert capfd.readouterr().err == ""


def test_a_gateway_that_refuses_is_asked_more_and_more_rarely(
    gateway: Gateway, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_bus, "TRY_AGAIN_S", 1.0)
    pauses: list[float] = []

    class Stopping(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            pauses.append(timeout or 0.0)
            if len(pauses) == 8:
                self.set()
            return self.is_set()

    gateway.begin()
    bus = Bus("can0", "socketcand", None, print)
    gateway.end()
    bus._stopping = Stopping()
    until(lambda: len(pauses) == 8)
    bus.close()
    assert pauses == [1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0, 30.0]


def test_a_gateway_that_is_not_there_is_one_line_at_once(
    gateway: Gateway, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL)
    begin_s = time.monotonic()
    with pytest.raises(OncenterError, match=r"cannot open can0 \(socketcand\): .*Connection refused"):
        Bus("can0", "socketcand", None, print)
    assert time.monotonic() - begin_s < 5.0  # python-can alone asks for 10 s without a pause
    assert capfd.readouterr().err == ""


def _stopped(session: Session, when: Any) -> Any:
    until_s = time.monotonic() + 60.0
    while not when(session.snapshot):
        assert time.monotonic() < until_s
        time.sleep(0.02)
    session.stop()
    session.join()
    return session.snapshot
