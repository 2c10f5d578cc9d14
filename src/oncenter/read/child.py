"""`python -m oncenter.read.child`: reads logs for a parent process, see `oncenter.files.child`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from oncenter.files.child import Send, collect_rarely, serve


def _answer(request: Mapping[str, Any], send: Send) -> None:
    from oncenter.read.apart import sent, sent_frames
    from oncenter.read.frames_of_log import frames_of_log
    from oncenter.read.here import read_here, read_joined
    from oncenter.read.named import columns_of_log, signals_of
    from oncenter.read.packed import logs_of_archive, unpack
    from oncenter.signals import SignalName

    def progress(fraction: float) -> None:
        send({"progress": fraction})

    if "frames" in request:
        notes: list[str] = []
        for frames in frames_of_log(Path(request["frames"]), notes, progress):
            sent_frames(frames, send)
        send({"notes": notes, "last": True})
        return
    if "unpack" in request:
        log = unpack(Path(request["unpack"]), request["member"], Path(request["into"]))
        send({"log": str(log), "last": True})
        return
    if "logs_of" in request:
        send({"logs": logs_of_archive(Path(request["logs_of"])), "last": True})
        return
    if "names_in" in request:
        names_of = {"log": columns_of_log, "database": signals_of}[request["kind"]]
        send({"names": list(map(asdict, names_of(Path(request["names_in"])))), "last": True})
        return
    names = {signal: SignalName(**name) for signal, name in request["names"].items()}
    dbc = [Path(file) for file in request["dbc"]]
    paths = [Path(request["signals"]), *map(Path, request["join"])]
    if len(paths) > 1:
        sent(read_joined(paths, names, dbc, request["take"], progress), send)
    else:
        sent(read_here(paths[0], names, dbc, request["take"], progress), send)


if __name__ == "__main__":
    collect_rarely()
    import oncenter.read.here  # noqa: F401 - while the parent prepares its request

    serve(_answer)
