"""Shows oncenter this machine as Windows or macOS: modules, functions and constants that those lack are not there.

`ONCENTER_AS=win32` (or darwin) with this folder on PYTHONPATH: every Python process then begins here, the child
processes that oncenter starts among them. Only modules of oncenter are shown less; the standard library and other
packages see Linux. What a system lacks is read from typeshed, the types of the standard library that mypy brings. What
Windows does in another way than Linux is imitated below: files that are opened as text unless said otherwise, renaming
over an open file, locks, sockets for another process, exit codes, the encoding of a redirected output.
"""

from __future__ import annotations

import ast
import builtins
import errno
import importlib
import importlib.util
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import types
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

PLATFORM = os.environ.get("ONCENTER_AS", sys.platform)
SHOWN = ("errno", "mmap", "os", "select", "selectors", "shutil", "signal", "socket", "subprocess", "sys", "time")
ABSENT = {
    "win32": "crypt curses fcntl grp nis posix pty pwd readline resource spwd syslog termios tty _posixsubprocess",
    "darwin": "msvcrt nis ossaudiodev spwd _winapi",
}
O_BINARY = 0x8000
SIGBREAK = 21
OF_WINDOWS = ("SIGABRT", "SIGFPE", "SIGILL", "SIGINT", "SIGSEGV", "SIGTERM")


@cache
def names(module: str, platform: str) -> frozenset[str]:
    """What typeshed says a module has on a platform."""
    mypy = importlib.util.find_spec("mypy")
    assert mypy is not None and mypy.submodule_search_locations, "mypy is not installed"
    stub = Path(mypy.submodule_search_locations[0]) / "typeshed" / "stdlib" / module
    file = stub / "__init__.pyi" if stub.is_dir() else stub.with_suffix(".pyi")
    return frozenset(_defined(ast.parse(file.read_text(encoding="utf-8")).body, platform))


def _defined(body: list[ast.stmt], platform: str) -> Iterator[str]:
    for part in body:
        if isinstance(part, ast.If):
            yield from _defined(part.body if _holds(part.test, platform) else part.orelse, platform)
        elif isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield part.name
        elif isinstance(part, ast.Assign):
            yield from (target.id for target in part.targets if isinstance(target, ast.Name))
        elif isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            yield part.target.id
        elif isinstance(part, ast.ImportFrom) and part.names[0].name == "*":
            yield from names(str(part.module), platform)
        elif isinstance(part, ast.Import | ast.ImportFrom):
            yield from (alias.asname or alias.name for alias in part.names)


def _holds(test: ast.expr, platform: str) -> bool:
    version = types.SimpleNamespace(platform=platform, version_info=sys.version_info)
    return bool(eval(compile(ast.Expression(test), "typeshed", "eval"), {"sys": version, "TYPE_CHECKING": True}))


def lacking() -> dict[str, list[str]]:
    """The names that a module lacks on the platform. Child processes inherit them: typeshed takes 0.1 s to parse."""
    inherited = f"ONCENTER_LACKING_ON_{PLATFORM}"
    if inherited not in os.environ:
        found = {module: sorted(names(module, "linux") - names(module, PLATFORM)) for module in SHOWN}
        os.environ[inherited] = json.dumps(found)
    given: dict[str, list[str]] = json.loads(os.environ[inherited])
    return given


class Shown(types.ModuleType):
    """A module of the standard library without what a platform lacks, and with what it has instead."""

    def __init__(self, real: types.ModuleType, lacking: list[str], instead: dict[str, Any]) -> None:
        super().__init__(real.__name__)
        self.__dict__.update(_real=real, _lacking=set(lacking) - set(instead), **instead)

    def __getattr__(self, name: str) -> Any:
        if name in self.__dict__["_lacking"]:
            raise AttributeError(f"module '{self.__name__}' has no attribute '{name}' on {PLATFORM}")
        return getattr(self.__dict__["_real"], name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self.__dict__["_real"], name, value)  # as a test does that puts another function in its place


def show() -> None:
    instead: dict[str, dict[str, Any]] = {"sys": {"platform": PLATFORM}}
    given: dict[str, types.ModuleType] = {}
    if PLATFORM == "win32":
        instead |= {"os": _os(), "signal": _signal(), "socket": _socket(), "subprocess": _subprocess()}
        given = {"msvcrt": _msvcrt(), "_winapi": _winapi()}
    lacks = lacking()
    shown = {name: Shown(importlib.import_module(name), lacks[name], instead.get(name, {})) for name in SHOWN} | given
    absent = frozenset(ABSENT[PLATFORM].split())
    real_import: Callable[..., Any] = builtins.__import__

    def import_(name: str, scope: Any = None, local: Any = None, fromlist: Any = (), level: int = 0) -> Any:
        if level or not _is_ours(scope or {}):
            return real_import(name, scope, local, fromlist, level)
        root = name.partition(".")[0]
        if root in absent:
            raise ModuleNotFoundError(f"No module named '{name}' on {PLATFORM}", name=name)
        if root in given:
            return given[root]
        imported = real_import(name, scope, local, fromlist, level)
        return shown.get(name if fromlist else root, imported)

    builtins.__import__ = import_


def _is_ours(scope: dict[str, Any]) -> bool:
    name = scope.get("__name__")
    if name == "__main__":
        name = getattr(scope.get("__spec__"), "name", "")
    return str(name).partition(".")[0] == "oncenter"


def _os() -> dict[str, Any]:
    def open_(path: Any, flags: int, mode: int = 0o777) -> int:
        if os.path.isdir(path):
            raise PermissionError(errno.EACCES, "Permission denied", os.fspath(path))
        assert flags & O_BINARY or path == os.devnull, f"{path} is opened as text: Windows changes its line ends"
        return os.open(path, flags & ~O_BINARY, mode)

    def replace(source: Any, target: Any) -> None:
        there = {os.path.realpath(source), os.path.realpath(target)}
        if any(path in there for path in _open_paths()):
            raise PermissionError(errno.EACCES, "Access is denied")
        os.replace(source, target)

    return {"O_BINARY": O_BINARY, "name": "nt", "open": open_, "replace": replace}


def _open_paths() -> Iterator[str]:
    for number in os.listdir("/proc/self/fd"):
        try:
            yield os.readlink(f"/proc/self/fd/{number}")
        except OSError:  # of the listing itself
            continue


def _signal() -> dict[str, Any]:
    known = {SIGBREAK, *(getattr(signal, name) for name in OF_WINDOWS)}

    def signal_(number: int, handler: Any) -> Any:
        if number not in known:
            raise ValueError("invalid signal value")
        return signal.signal(number, handler)

    return {"SIGBREAK": SIGBREAK, "signal": signal_}


def _socket() -> dict[str, Any]:
    """A duplicate for another process comes to it, and to no other, by a socket of Unix."""

    def share(self: socket.socket, process_id: int) -> bytes:
        name = f"\0oncenter-{process_id}-{os.urandom(8).hex()}".encode()
        listening = socket.socket(socket.AF_UNIX)
        listening.bind(name)
        listening.listen(1)
        duplicate = os.dup(self.fileno())

        def give() -> None:
            asking, _ = listening.accept()
            with listening, asking:
                socket.send_fds(asking, [b"."], [duplicate])
            os.close(duplicate)

        threading.Thread(target=give, daemon=True).start()
        return name

    def fromshare(data: bytes) -> socket.socket:
        assert data.startswith(f"\0oncenter-{os.getpid()}-".encode()), "is shared with another process"
        with socket.socket(socket.AF_UNIX) as asking:
            asking.connect(data)
            _, (number,), _, _ = socket.recv_fds(asking, 1, 1)
        return socket.socket(fileno=number)

    socket.socket.share = share  # type: ignore[attr-defined]
    return {"fromshare": fromshare}


def _subprocess() -> dict[str, Any]:
    class Popen(subprocess.Popen[Any]):
        def __init__(self, *arguments: Any, creationflags: int = 0, **options: Any) -> None:
            wrong = {"pass_fds", "preexec_fn", "process_group", "start_new_session", "umask", "user"} & set(options)
            assert not wrong, f"Windows has no {wrong}"
            super().__init__(*arguments, **options)

        def poll(self) -> int | None:
            return _exit_code(super().poll())

        def wait(self, timeout: float | None = None) -> int:
            code = _exit_code(super().wait(timeout))
            assert code is not None
            return code

    return {"Popen": Popen, "CREATE_NEW_PROCESS_GROUP": 0x200, "BELOW_NORMAL_PRIORITY_CLASS": 0x4000}


def _exit_code(code: int | None) -> int | None:
    """Of a process that is ended by another 1, of a crash what Windows calls it."""
    if code is None or code >= 0:
        return code
    return 1 if -code in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT) else 0xC0000409


def _msvcrt() -> types.ModuleType:
    import fcntl

    def locking(file: int, mode: int, count: int) -> None:
        assert mode == 2 and count == 1 and os.lseek(file, 0, os.SEEK_CUR) >= os.fstat(file).st_size
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise PermissionError(errno.EACCES, "Permission denied") from None

    module = types.ModuleType("msvcrt")
    module.__dict__.update(LK_NBLCK=2, locking=locking)
    return module


def _winapi() -> types.ModuleType:
    def wait_for_single_object(handle: int, milliseconds: int) -> None:
        ended = select.poll()
        ended.register(handle, select.POLLIN)
        ended.poll()

    module = types.ModuleType("_winapi")
    module.__dict__.update(
        SYNCHRONIZE=0x100000,
        INFINITE=0xFFFFFFFF,
        OpenProcess=lambda access, inherit, process_id: os.pidfd_open(process_id),
        WaitForSingleObject=wait_for_single_object,
    )
    return module


if sys.platform != PLATFORM:
    show()
    if PLATFORM == "win32" and sys.stdout is not None and not sys.stdout.isatty():
        sys.stdout.reconfigure(encoding="cp1252", errors="strict")  # type: ignore[union-attr]
