"""Passes sockets to a new process.

On POSIX the new process inherits them. On Windows each is duplicated for the process number that the new process prints
first, since a virtual environment's `python.exe` starts another process.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence

from oncenter.files.child import environment

_LENGTH_BYTES = 4


def begin(module: str, sockets: Sequence[socket.socket]) -> subprocess.Popen[bytes]:
    """Starts `python -m module`, which takes the sockets with `taken`.

    In its own process group: Ctrl-C ends this process, which then ends the other. In the same session, since Linux
    compares niceness only within a session. `-P`: modules in the current folder are not imported.
    """
    command = [sys.executable, "-P", "-m", module]
    if sys.platform == "win32":
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment(),
            creationflags=subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.BELOW_NORMAL_PRIORITY_CLASS,
        )
        _share(process, sockets)
        return process
    passed = [own.fileno() for own in sockets]
    return subprocess.Popen(
        [*command, *map(str, passed)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=environment(),
        pass_fds=passed,
        process_group=0,
    )


def taken() -> list[socket.socket]:
    """The sockets in the process that `begin` started, in the same order."""
    if sys.platform == "win32":
        print(os.getpid(), flush=True)
        sockets = [socket.fromshare(data) for data in _parts(sys.stdin.buffer.read())]
        print("taken", flush=True)
        return sockets
    return [socket.socket(fileno=int(number)) for number in sys.argv[1:]]


if sys.platform == "win32":

    def _share(process: subprocess.Popen[bytes], sockets: Sequence[socket.socket]) -> None:
        assert process.stdin is not None and process.stdout is not None
        # if the process fails meanwhile, its end is handled by the caller that waits for it
        with process.stdout as answers, contextlib.suppress(OSError, ValueError):
            with process.stdin as given:
                number = int(answers.readline())
                for data in (own.share(number) for own in sockets):
                    given.write(len(data).to_bytes(_LENGTH_BYTES) + data)
            answers.readline()  # they arrived: this process may close its own

    def _parts(data: bytes) -> Iterator[bytes]:
        while data:
            end = _LENGTH_BYTES + int.from_bytes(data[:_LENGTH_BYTES])
            yield data[_LENGTH_BYTES:end]
            data = data[end:]
