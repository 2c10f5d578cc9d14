"""oncenter live: the answer while the truck is driven."""

from __future__ import annotations

import gc
import signal
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated

import typer

from oncenter.cli.options import Dbc, Json, Schema, Source, UnknownTruck, sources_of
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.log_formats import OF_FRAMES

if TYPE_CHECKING:
    from oncenter.live.bus import Bus
    from oncenter.live.replay import Replay
    from oncenter.live.session import Notices, Session
    from oncenter.offset.answer import Answer
    from oncenter.read.stream import Stream
    from oncenter.vehicle import Vehicle


Channel = Annotated[str | None, typer.Argument(metavar="CHANNEL", help="can0, PCAN_USBBUS1, 239.74.163.2 …")]
Interface = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Interface of python-can: socketcan (default on Linux), pcan, vector, kvaser, udp_multicast …",
    ),
]
Bitrate = Annotated[int | None, typer.Option(metavar="BIT/S", help="Bit rate of the bus, for interfaces that need it.")]
Replayed = Annotated[
    Path | None, typer.Option(metavar="LOG", help=f"Replay a log of frames instead: {' '.join(OF_FRAMES)}")
]
Speed = Annotated[
    float | None,
    typer.Option(metavar="TIMES", help="Speed of the replay, 1 to 100 times the drive's; default 1."),
]
Web = Annotated[bool, typer.Option("--web", help="Also serve a page for browsers.")]
Address = Annotated[str, typer.Option(metavar="HOST", help="Address at which the page is served.")]
Port = Annotated[int, typer.Option(metavar="PORT", min=0, max=65535, help="Port of the page; 0 takes a free one.")]
Record = Annotated[Path | None, typer.Option(metavar="OUT.log", help="Record the raw frames in candump's format.")]
Traced = Annotated[
    Path | None, typer.Option(metavar="OUT", help="At the end, write all samples with their results: .parquet or .mf4")
]
Truck = Annotated[
    str | None, typer.Option(metavar="KEY", help="Name of the saved state; by default the vehicle file's name.")
]
State = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Folder of the saved states; a replay saves only if it is given.")
]


Limit = Annotated[
    float | None,
    typer.Option(
        metavar="DEG",
        help="Recalibrate from this offset on, either sign; default: offset_limit_deg of the vehicle file.",
    ),
]


def live(
    channel: Channel = None,
    vehicle_file: UnknownTruck = None,
    interface: Interface = None,
    bitrate: Bitrate = None,
    replay: Replayed = None,
    speed: Speed = None,
    web: Web = False,
    address: Address = "127.0.0.1",
    port: Port = 5006,
    record: Record = None,
    trace: Traced = None,
    truck: Truck = None,
    state: State = None,
    limit: Limit = None,
    json: Json = False,
    schema: Schema = "offset-2",
    dbc: Dbc = None,
    source: Source = None,
) -> None:
    """Watch the offset converge while the truck is driven. Ctrl-C ends the session, saves and prints the result."""
    from oncenter.cli.offset import as_table, vehicle_of, with_limit
    from oncenter.cli.overwriting import spare_inputs
    from oncenter.files.extra import require_package
    from oncenter.live.learner import needed
    from oncenter.live.memory import default_folder
    from oncenter.live.session import Notices
    from oncenter.read.stream import Stream

    _check(channel, bitrate, replay, speed, record)
    if web:
        require_package("bokeh", "--web", "live")
    outputs = {"--record": record, "--trace": trace}
    spare_inputs(outputs, [replay, *filter(None, [vehicle_file]), *(dbc or ())])
    vehicle = with_limit(vehicle_of(vehicle_file), limit)
    databases = dbc or vehicle.databases()
    spare_inputs(outputs, databases)
    notices = Notices()
    with ExitStack() as opened:
        given = _opened(channel, interface, bitrate, replay, speed, notices)
        opened.callback(given.close)
        names, take = vehicle.signal_names, sources_of(source)
        stream = Stream(given.name, needed(vehicle), names=names, dbc=databases, take=take)
        folder = state or (default_folder() if replay is None else None)
        if folder is not None and vehicle_file is None and truck is None:
            folder = None
            notices.say("nothing is saved, since this truck has no name: give --truck KEY or --vehicle FILE")
        session = _session(given, stream, vehicle, truck or vehicle.name, folder, notices, record=record, trace=trace)
        if web:
            from oncenter.live.web import Page
            from oncenter.offset.inputs import params_of

            page = opened.enter_context(Page(session, params_of(vehicle, None), address, port, notices.say))
            typer.echo(f"oncenter: the page is at {page.url}", err=True)  # no notice, since the page shows those
        _watch(session, vehicle)
    answer = _answer(session, stream, needed(vehicle))
    typer.echo(answer.to_json(schema) if json else as_table(answer))


def _check(
    channel: str | None, bitrate: int | None, replay: Path | None, speed: float | None, record: Path | None
) -> None:
    wrong = ""
    if (channel is None) == (replay is None):
        wrong = "name either a CHANNEL or --replay LOG"
    elif replay is not None and record is not None:
        wrong = "--record is for a bus, not for --replay: the log exists already"
    elif replay is not None and bitrate is not None:
        wrong = "--bitrate is for a bus, not for --replay"
    elif channel is not None and speed is not None:
        wrong = "--speed is for --replay, not for a bus"
    if wrong:
        raise OncenterError(wrong, code="usage", exit_code=WRONG_USAGE)


def _session(
    given: Bus | Replay,
    stream: Stream,
    vehicle: Vehicle,
    truck: str,
    folder: Path | None,
    notices: Notices,
    *,
    record: Path | None,
    trace: Path | None,
) -> Session:
    from oncenter.live.learner import Learner
    from oncenter.live.memory import Memory
    from oncenter.live.record import Recorder
    from oncenter.live.session import Session
    from oncenter.live.trace import Trace

    memory = Memory(folder, truck, notices.say) if folder is not None else None
    tracer = Trace(trace, notices.say) if trace is not None else None
    recorder = Recorder(record, notices.say) if record is not None else None
    learner = Learner(stream, vehicle, memory.resume if memory is not None else None)
    return Session(given, learner, truck, notices, memory=memory, recorder=recorder, trace=tracer)


def _watch(session: Session, vehicle: Vehicle) -> None:
    from oncenter.live.terminal import watch
    from oncenter.offset.inputs import params_of

    with _ended_by_signals(session):
        gc.collect()
        gc.freeze()  # loaded modules stay: the collector would stop all threads for 0.2 s to scan them
        session.start()
        watch(session, params_of(vehicle, None))


def _answer(session: Session, stream: Stream, signals: tuple[str, ...]) -> Answer:
    """The final answer; `signals` are those it needs.

    Raises:
        OncenterError: "no_usable_second", or the reason why the session ended.
    """
    if session.failure is not None:
        raise session.failure
    answer = session.snapshot.known.answer
    if answer is not None:
        return answer
    if stream.paused is not None:
        raise stream.paused
    why = stream.missing() or "the session was too short"
    raise OncenterError(f"no usable second on {stream.name}: {why}", code="no_usable_second", needs=signals)


def _opened(
    channel: str | None,
    interface: str | None,
    bitrate: int | None,
    replay: Path | None,
    speed: float | None,
    notices: Notices,
) -> Bus | Replay:
    if replay is not None:
        from oncenter.live.replay import SLOWEST, Replay

        return Replay(replay, SLOWEST if speed is None else speed)
    from oncenter.live.bus import Bus

    assert channel is not None
    return Bus(channel, _interface(interface), bitrate, notices.say)


def _interface(named: str | None) -> str:
    """
    Raises:
        OncenterError: "usage", exit code 2: SocketCAN, on a system that lacks it.
    """
    if sys.platform != "linux" and named in (None, "socketcan"):
        raise OncenterError(
            "only Linux has SocketCAN: name the interface of your CAN adapter with --interface: pcan, vector, kvaser, "
            "ixxat, slcan, gs_usb or another one of python-can",
            code="usage",
            exit_code=WRONG_USAGE,
        )
    return named or "socketcan"


@contextmanager
def _ended_by_signals(session: Session) -> Iterator[None]:
    """Ctrl-C and SIGTERM end a session without loss; a second Ctrl-C interrupts the ending."""

    def end(number: int, frame: FrameType | None) -> None:
        print("oncenter: the session ends", file=sys.stderr)
        session.stop()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    if sys.platform == "win32":
        closed = signal.SIGBREAK  # the console window closes, or Ctrl-Break
    else:
        closed = signal.SIGHUP
    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM, closed)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
