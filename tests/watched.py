"""A command as its user's machine sees it: how it ended, how long it took, how much memory all its processes held."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

MIB = 1 << 20
SLOW_S, KILL_S = 20.0, 60.0
LARGE_MIB, KILL_MIB = 2048, 3072

_POLL_S = 0.03
_TEXT_KEPT = 1 << 20  # bytes of standard output and of standard error
_LIMITED = ("sh", "-c", 'ulimit -c 0; exec "$@"', "sh")  # no core dumps
_PAGE = resource.getpagesize()


@dataclass(frozen=True)
class Ended:
    """Attributes:
    code: exit code, negative for a signal; None when it was killed here for time or memory.
    seconds: by the clock, until it ended or was killed.
    cpu_s: computing time of it and of those of its children that it waited for.
    peak_mib: resident memory of all its processes together, or of the largest of them if it was too brief to be seen.
    """

    code: int | None
    out: str
    err: str
    seconds: float
    cpu_s: float
    peak_mib: float

    @property
    def waited(self) -> bool:
        """Whether it was slow without computing: it hangs, or the machine had no time for it."""
        return self.seconds > SLOW_S > self.cpu_s

    @property
    def harm(self) -> str:
        """What no log may do to a machine or a user, for people; empty where it did none of it."""
        if self.peak_mib > LARGE_MIB:
            return f"memory {self.peak_mib:.0f} MiB after {self.seconds:.1f} s"
        if self.code is None or self.seconds > SLOW_S:
            return f"{'killed after' if self.code is None else 'took'} {self.seconds:.1f} s"
        if self.code is not None and self.code < 0:
            return f"signal {signal.Signals(-self.code).name}"
        if self.code == 70:
            return f"exit 70: {self.err.strip()[-300:]}"
        if "Traceback (most recent call last)" in self.err:
            return f"traceback, exit {self.code}: {self.err.strip()[-300:]}"
        return ""


def oncenter(*arguments: str | Path) -> list[str]:
    """The command line of a verb."""
    return [sys.executable, "-m", "oncenter", *map(str, arguments)]


def watch(command: Sequence[str], kill_s: float = KILL_S, kill_mib: float = KILL_MIB) -> Ended:
    """Runs a command to its end, or until it takes too much time or memory; then all its processes are killed."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        started = time.monotonic()
        process = subprocess.Popen(
            [*_LIMITED, *command], stdin=subprocess.DEVNULL, stdout=out, stderr=err, start_new_session=True
        )
        peak, seen = 0.0, {process.pid}
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            seconds = time.monotonic() - started
            if pid:
                code: int | None = os.waitstatus_to_exitcode(status)
                break
            held, tree = _resident_mib(process.pid)
            peak, seen = max(peak, held), seen | tree
            if seconds > kill_s or peak > kill_mib:
                _kill(tree)
                _, status, usage = os.wait4(process.pid, 0)
                code = None
                break
            time.sleep(_POLL_S)
        process.returncode = os.waitstatus_to_exitcode(status)  # or else Popen asks for it once more
        _kill({pid for pid in seen - {process.pid} if _session(pid) == process.pid})
        cpu_s = usage.ru_utime + usage.ru_stime
        return Ended(code, _text(out.fileno()), _text(err.fileno()), seconds, cpu_s, max(peak, _largest_mib(usage)))


def _resident_mib(root: int) -> tuple[float, set[int]]:
    """Resident memory of a process and its descendants, and which these are. Pages that they share count for each."""
    tree, waiting, pages = set(), [root], 0
    while waiting:
        pid = waiting.pop()
        tree.add(pid)
        with contextlib.suppress(OSError, IndexError):  # it ended meanwhile
            pages += int(Path(f"/proc/{pid}/statm").read_text().split()[1])
            for thread in Path(f"/proc/{pid}/task").iterdir():
                waiting += map(int, (thread / "children").read_text().split())
    return pages * _PAGE / MIB, tree


def _largest_mib(usage: resource.struct_rusage) -> float:
    """The size of the largest process; 0 where that may be the parent's own, which a new process has for a moment."""
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return usage.ru_maxrss * 1024 / MIB if usage.ru_maxrss > own else 0.0


def _session(pid: int) -> int:
    with contextlib.suppress(OSError):
        return int(Path(f"/proc/{pid}/stat").read_text(encoding="latin-1").rpartition(") ")[2].split()[3])
    return -1


def _kill(pids: set[int]) -> None:
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def _text(file: int) -> str:
    os.lseek(file, 0, os.SEEK_SET)
    return os.read(file, _TEXT_KEPT).decode("utf-8", "replace")
