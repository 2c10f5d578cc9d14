"""A child process for work that may crash, hang or grow, and the parent that monitors it.

Logs may be hostile, and the libraries that read them are not hardened. So they run in a separate process, which the
parent stops when it uses more CPU time or memory than a file of that size can need. A child's end costs one log and
nothing else. Linux reports the usage of another process in /proc; on Windows and macOS psutil asks the system.

The parent starts it as `python -m MODULE` and writes one JSON line per request. The child answers with messages: a JSON
line each, followed by the number of bytes given in it. Nothing is unpickled on either side. This file imports nothing
heavy.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from oncenter.errors import OncenterError

if sys.platform != "linux":
    import psutil

Message = tuple[Mapping[str, Any], bytes]  # header, and the bytes that follow it
Send = Callable[..., None]  # takes a header, then the buffers that follow it

# python-can, slower than each reader here, takes 0.17 s/MB for .asc (bench/logs.py): the limit is twelve times as much.
_CPU_BASE_S, _CPU_S_PER_BYTE = 10.0, 2e-6
# A table as text takes 8 times its size in memory, a compressed one (csv.gz) 30 times; imports take about 0.2 GiB.
_RESIDENT_BASE, _RESIDENT_PER_BYTE = 1 << 30, 32
_WAIT_PER_CPU = 3.0  # elapsed time per CPU time: allows waiting for a slow disk, but not for ever
_CHECK_EVERY_S = 0.02  # memory and time: a growth of 4 GB/s is stopped 80 MB late
_LONGEST_CHECK_S = 0.5  # a longer interval between checks means that the parent was suspended
_RESIDENT_TO_KEEP = 400 << 20  # a child with more memory after its work is not reused
_MESSAGES_AHEAD = 8
_PARENT_EVERY_S = 0.5  # interval at which a child on macOS checks that its parent is alive
_NT_STATUS = 0x80000000  # on Windows, larger exit codes are crash reasons
READER_DEATHS = ("reader_crashed", "reader_time", "reader_memory")
_STOPPED_FROM_OUTSIDE = (signal.SIGINT, signal.SIGTERM)
_KILLED = getattr(signal, "SIGKILL", None)  # Windows has no signals between processes


@dataclass(frozen=True)
class Limits:
    """Limits of one request."""

    cpu_s: float
    resident_bytes: int


def limits_for(size: int) -> Limits:
    """Limits for a file's size in bytes; memory at most half of this machine's."""
    resident = _RESIDENT_BASE + _RESIDENT_PER_BYTE * size
    half = _half_of_memory()
    return Limits(_CPU_BASE_S + _CPU_S_PER_BYTE * size, resident if half is None else min(resident, half))


class ChildDied(Exception):
    """A child ended during a request.

    Attributes:
        code: one of `READER_DEATHS`, or "stopped" if it was ended from outside or did not start.
        by_kill: it was killed, but not by its parent: by the system when out of memory, or by a user.
    """

    def __init__(self, code: str, what: str, *, by_kill: bool = False) -> None:
        super().__init__(what)
        self.code = code
        self.by_kill = by_kill

    def of(self, file: str) -> OncenterError:
        """The error for the file that was read."""
        return OncenterError(f"cannot read {file}: {self}", code=self.code)


class Child:
    """One process; a request at a time.

    Args:
        module: `python -m module` calls `serve`.
    """

    def __init__(self, module: str) -> None:
        # -P: no modules from the current folder, which may not be trusted
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module, str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # output of a crashing library is not for users
            env=environment(),
        )
        self._messages: queue.Queue[Message | None] = queue.Queue(_MESSAGES_AHEAD)
        self._killed = self._ready = False
        threading.Thread(target=self._receive, name="child's messages", daemon=True).start()

    def ask(self, request: Mapping[str, Any], limits: Limits) -> Iterator[Message]:
        """Sends a request at once, and gives the messages of its answer as they arrive, including the last one.

        Relative paths in the request refer to the caller's current folder, which may differ from that at the child's
        start. A caller that does not take all messages must call `kill`. Taking messages raises:

        Raises:
            ChildDied: it crashed, was stopped at a limit, or was stopped from outside.
            OncenterError: as the child raised it.
        """
        watch = _Watch(self._process.pid, limits)
        self._send({"cpu_s": limits.cpu_s, "folder": _current_folder(), **request})
        return self._answer(watch)

    def _answer(self, watch: _Watch) -> Iterator[Message]:
        while True:
            message = self._next(watch)
            if message is None:
                raise self._end()
            header, _ = message
            if "error" in header:
                raise _raised(header["error"])
            yield message
            if header.get("last"):
                return

    def fit_for_more(self) -> bool:
        return self._process.poll() is None and (_resident_bytes(self._process.pid) or 0) < _RESIDENT_TO_KEEP

    def signal_end(self) -> None:
        self._process.kill()

    def kill(self) -> None:
        """Ends the child at once."""
        self._killed = True
        self._process.kill()
        self._process.wait()
        with contextlib.suppress(OSError):
            self._stdin.close()
        while True:  # so that the receiving thread does not wait to put a message
            try:
                self._messages.get_nowait()
            except queue.Empty:
                return

    @property
    def _stdin(self) -> BinaryIO:
        assert self._process.stdin is not None
        return self._process.stdin  # type: ignore[return-value]

    def _send(self, request: Mapping[str, Any]) -> None:
        with contextlib.suppress(OSError):  # the end of a dead child is reported by the next message
            self._stdin.write(json.dumps(request).encode() + b"\n")
            self._stdin.flush()

    def _receive(self) -> None:
        out = self._process.stdout
        assert out is not None
        with out:
            while (line := out.readline()).endswith(b"\n"):
                header = json.loads(line)
                if "ready" in header:
                    self._ready = True
                    continue
                payload = out.read(header.get("bytes", 0))
                if self._killed or len(payload) < header.get("bytes", 0):
                    break
                self._messages.put((header, payload))
        self._messages.put(None)

    def _next(self, watch: _Watch) -> Message | None:
        while True:
            why = watch.exceeded()
            if why is not None:
                self.kill()
                raise why
            with contextlib.suppress(queue.Empty):
                return self._messages.get(timeout=_CHECK_EVERY_S)

    def _end(self) -> ChildDied:
        if self._killed:
            return ChildDied("stopped", "its reader was stopped")
        code = self._process.wait()
        if -code in _STOPPED_FROM_OUTSIDE:
            return ChildDied("stopped", f"its reader was stopped from outside ({_signal_name(-code)})")
        how = _how_it_ended(code)
        if not self._ready:
            return ChildDied("stopped", f"the process that reads it did not start ({how})")
        return ChildDied(
            "reader_crashed",
            f"its reader crashed ({how}): the file is damaged or hostile; copy or export it again",
            by_kill=-code == _KILLED,
        )


class _Watch:
    """Monitors time and memory of one request."""

    def __init__(self, pid: int, limits: Limits) -> None:
        self._pid, self._limits = pid, limits
        self._cpu_before_s = _cpu_s(pid) or 0.0
        self._waited_s = 0.0
        self._checked_s = time.monotonic()

    def exceeded(self) -> ChildDied | None:
        now = time.monotonic()
        if now - self._checked_s < _CHECK_EVERY_S:  # messages may arrive faster
            return None
        # time in which the parent was suspended does not count
        self._waited_s += min(now - self._checked_s, _LONGEST_CHECK_S)
        self._checked_s = now
        resident = _resident_bytes(self._pid)
        if resident is not None and resident > self._limits.resident_bytes:
            at = f"{self._limits.resident_bytes / (1 << 30):.1f} GiB"
            return ChildDied(
                "reader_memory",
                f"its reader was stopped at {at} of memory, more than a file of this size needs: the file is probably "
                "damaged",
            )
        cpu_s = (_cpu_s(self._pid) or 0.0) - self._cpu_before_s
        if cpu_s > self._limits.cpu_s or self._waited_s > _WAIT_PER_CPU * self._limits.cpu_s:
            # gives the limits, not the measured times: tables of a fleet must not differ from night to night
            return ChildDied(
                "reader_time",
                f"its reader was stopped after {self._limits.cpu_s:.0f} s of CPU time or "
                f"{_WAIT_PER_CPU * self._limits.cpu_s:.0f} s in total, longer than a file of this size needs: the file "
                "is probably damaged",
            )
        return None


def _current_folder() -> str | None:
    try:
        return os.getcwd()
    except OSError:  # it is deleted
        return None


_idle: dict[str, list[Child]] = {}
_idle_lock = threading.Lock()
_idle_of = os.getpid()


def begin(module: str) -> None:
    """Starts a child in the background, unless one is idle: its imports take a quarter of a second."""
    _give_back(module, _take(module))


@contextlib.contextmanager
def borrowed(module: str) -> Iterator[Child]:
    """An idle child, or a new one. It is kept for the next request unless its work failed or its memory has grown."""
    child = _take(module)
    try:
        yield child
    except OncenterError:
        _give_back(module, child)
        raise
    except BaseException:  # interrupted in the middle of an answer
        child.kill()
        raise
    else:
        _give_back(module, child)


def _take(module: str) -> Child:
    global _idle_of
    with _idle_lock:
        if _idle_of != os.getpid():  # after a fork: the pipes of these children belong to the parent
            _idle.clear()
            _idle_of = os.getpid()
        waiting = _idle.get(module, [])
        while waiting:
            child = waiting.pop()
            if child.fit_for_more():
                return child
            child.kill()
    return Child(module)


def _give_back(module: str, child: Child) -> None:
    if not child.fit_for_more():
        child.kill()
        return
    with _idle_lock:
        _idle.setdefault(module, []).append(child)


def end_idle(module: str) -> None:
    """Ends idle children and frees their memory."""
    with _idle_lock:
        waiting = _idle.pop(module, [])
    for child in waiting:
        child.kill()


@atexit.register
def _end_all_idle() -> None:
    """Ends idle children with this process, without waiting."""
    if _idle_of == os.getpid():
        for children in _idle.values():
            for child in children:
                child.signal_end()


def collect_rarely() -> None:
    """Makes garbage collection rare, and leaves it out at the end of the process: collecting among the 100,000
    permanent objects of its imports takes an eighth of the start time, and as long at the end."""
    gc.set_threshold(100_000, 10, 10)
    atexit.register(gc.freeze)


def serve(answer: Callable[[Mapping[str, Any], Send], None]) -> None:
    """The child's side: answers requests until the parent is gone.

    Args:
        answer: sends the messages of one request; the last one has the key "last". Exceptions go to the parent.
    """
    out = _own_output()

    def send(header: Mapping[str, Any], *parts: Any) -> None:
        _write(out, header, parts)

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    _no_core_dumps()
    threading.Thread(target=_end_with_the_parent, args=(int(sys.argv[1]),), daemon=True).start()
    send({"ready": True})
    for line in sys.stdin.buffer:
        request = json.loads(line)
        _limit_cpu(request["cpu_s"])
        try:
            if request["folder"] is not None:
                os.chdir(request["folder"])
            answer(request, send)
        except Exception as error:
            send({"error": _as_message(error)})


def _write(out: BinaryIO, header: Mapping[str, Any], parts: Iterable[Any]) -> None:
    buffers = [memoryview(part).cast("B") for part in parts]
    size = sum(len(buffer) for buffer in buffers)
    out.write(json.dumps({**header, "bytes": size} if size else header).encode() + b"\n")
    for buffer in buffers:
        out.write(buffer)
    out.flush()


def _own_output() -> BinaryIO:
    """The pipe to the parent; output that libraries print is discarded."""
    own = os.dup(1)
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)
    return os.fdopen(own, "wb")


def _end_with_the_parent(parent: int) -> None:
    """Ends the child if the parent is killed during a request, when no one closes its pipe."""
    with contextlib.suppress(OSError):  # already ended
        _wait_for_end_of(parent)
    os._exit(0)


def _wait_for_end_of(parent: int) -> None:
    if sys.platform == "win32":
        import _winapi

        handle = _winapi.OpenProcess(_winapi.SYNCHRONIZE, False, parent)
        _winapi.WaitForSingleObject(handle, _winapi.INFINITE)
    elif sys.platform == "darwin":  # its poll does not report a closed pipe without a requested event
        while os.getppid() == parent:
            time.sleep(_PARENT_EVERY_S)
    else:
        import select

        hung_up = select.poll()
        hung_up.register(0, 0)
        hung_up.poll()


def _no_core_dumps() -> None:
    if sys.platform != "win32":
        import resource

        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))


def _limit_cpu(cpu_s: float) -> None:
    """A second limit, for a child that loops in C after its parent was killed."""
    if sys.platform != "win32":
        import resource

        until = int(time.process_time() + 2.0 * cpu_s) + 1
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_CPU, (until, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def _as_message(error: Exception) -> dict[str, Any]:
    if isinstance(error, OncenterError):
        return {"message": str(error), "code": error.code, "exit_code": error.exit_code, "needs": error.needs}
    return {"internal": f"{type(error).__name__}: {error}", "traceback": traceback.format_exc()}


class ChildFailed(Exception):
    """An internal error in a child; its traceback is a note of this one."""


def _raised(sent: Mapping[str, Any]) -> Exception:
    if "internal" in sent:
        failed = ChildFailed(sent["internal"])
        failed.add_note(sent["traceback"])
        return failed
    return OncenterError(sent["message"], code=sent["code"], exit_code=sent["exit_code"], needs=tuple(sent["needs"]))


def environment() -> dict[str, str]:
    """Puts this package first on PYTHONPATH: the parent may not have imported it from an installation."""
    own = str(Path(__file__).resolve().parents[2])
    given = [
        place for place in os.environ.get("PYTHONPATH", "").split(os.pathsep) if place
    ]  # an empty entry would mean the current folder
    return os.environ | {"PYTHONPATH": os.pathsep.join([own, *given])}


def _how_it_ended(code: int) -> str:
    if code < 0:
        return _signal_name(-code)
    return f"exit code {code:#010x}" if code >= _NT_STATUS else f"exit code {code}"


def _signal_name(number: int) -> str:
    with contextlib.suppress(ValueError):
        return signal.Signals(number).name
    return f"signal {number}"


def _resident_bytes(pid: int) -> int | None:
    """The memory of a process; None once it has ended. On Windows its private memory counts if that is more: the
    resident part shrinks when the machine runs out of memory."""
    if sys.platform != "linux":
        try:
            memory = psutil.Process(pid).memory_info()
        except psutil.Error:
            return None
        return int(max(memory.rss, getattr(memory, "private", 0)))
    try:
        with open(f"/proc/{pid}/statm", "rb") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError, ValueError):
        return None


def _cpu_s(pid: int) -> float | None:
    """CPU time so far; None once the process has ended."""
    if sys.platform != "linux":
        try:
            times = psutil.Process(pid).cpu_times()
        except psutil.Error:
            return None
        return float(times.user + times.system)
    try:
        with open(f"/proc/{pid}/stat", "rb") as file:
            fields = file.read().rpartition(b")")[2].split()  # the process name before it may contain blanks
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError):
        return None


def _half_of_memory() -> int | None:
    if sys.platform != "linux":
        return int(psutil.virtual_memory().total) // 2
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    except (ValueError, OSError):
        return None
