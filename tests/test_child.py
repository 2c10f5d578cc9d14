"""A child process may crash, hang or grow: its parent reports it in one line and continues."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from oncenter.errors import OncenterError
from oncenter.files import child as room
from oncenter.files.child import Child, ChildDied, ChildFailed, Limits, begin, borrowed, limits_for

pytestmark = pytest.mark.system

PATIENT = Limits(cpu_s=60.0, resident_bytes=2 << 30)
MODULE = "a_reader_of_tests"
CODE = """
import os, sys, time
from oncenter.files.child import serve
from oncenter.errors import OncenterError

def answer(request, send):
    do = request["do"]
    if do == "echo":
        print("noise of a library"); print("more", file=sys.stderr); os.write(1, b"noise below Python")
        send({"progress": 0.5})
        send({"said": request["say"], "pid": os.getpid(), "last": True}, b"ab", b"cde")
    elif do == "refuse":
        raise OncenterError("drive.csv is wrong", code="wrong", exit_code=2, needs=("yaw_rate",))
    elif do == "fail":
        raise KeyError("nobody thought of this")
    elif do == "crash":
        os.abort()
    elif do == "exit":
        os._exit(3)
    elif do == "compute":
        while True: pass
    elif do == "chatter":
        while True: send({"progress": 0.1})
    elif do == "grow":
        held = []
        while True: held.append(bytearray(os.urandom(1 << 20)) * 16)
    elif do == "wait":
        send({"pid": os.getpid()})
        time.sleep(600)

serve(answer)
"""


@pytest.fixture(autouse=True)
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / f"{MODULE}.py").write_text(CODE)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")


def ask(child: Child, limits: Limits = PATIENT, **request: Any) -> list[tuple[Mapping[str, Any], bytes]]:
    return list(child.ask(request, limits))


def end_of(limits: Limits = PATIENT, **request: Any) -> ChildDied:
    with pytest.raises(ChildDied) as died:
        ask(Child(MODULE), limits, **request)
    assert "\n" not in str(died.value)
    return died.value


def test_messages_arrive_in_order_with_their_bytes_despite_prints_of_libraries() -> None:
    child = Child(MODULE)
    for text in ("one", "zwei\udcff"):  # the second as a file's name that is no UTF-8 has it
        progress, last = ask(child, do="echo", say=text)
        assert progress == ({"progress": 0.5}, b"")
        assert (last[0]["said"], last[1]) == (text, b"abcde")
    child.kill()


def test_an_error_arrives_as_raised_and_an_internal_error_with_its_traceback() -> None:
    child = Child(MODULE)
    with pytest.raises(OncenterError, match=r"drive\.csv is wrong") as refusal:
        ask(child, do="refuse")
    assert (refusal.value.code, refusal.value.exit_code, refusal.value.needs) == ("wrong", 2, ("yaw_rate",))
    with pytest.raises(ChildFailed, match="KeyError: 'nobody thought of this'") as failure:
        ask(child, do="fail")
    assert "in answer" in failure.value.__notes__[0]
    assert ask(child, do="echo", say="still there")
    child.kill()


@pytest.mark.posix
def test_a_crash_is_named_by_its_signal() -> None:
    died = end_of(do="crash")
    assert (died.code, died.by_kill) == ("reader_crashed", False)
    error = died.of("drive.mf4")
    assert str(error).startswith("cannot read drive.mf4: its reader crashed (SIGABRT)")
    assert (error.code, error.exit_code) == ("reader_crashed", 1)


def test_a_child_that_does_not_start_is_not_blamed_on_the_file() -> None:
    with pytest.raises(ChildDied, match=r"did not start \(exit code 1\)") as died:
        ask(Child("no_such_module"), do="echo")
    assert died.value.code == "stopped"


def test_an_exit_during_an_answer_is_a_crash() -> None:
    assert "exit code 3" in str(end_of(do="exit"))


@pytest.mark.parametrize("do", ["compute", "chatter"])
def test_endless_computing_is_stopped_even_if_it_sends_messages(do: str) -> None:
    begin = time.monotonic()
    died = end_of(Limits(cpu_s=0.5, resident_bytes=2 << 30), do=do)
    assert died.code == "reader_time"
    assert time.monotonic() - begin < 30.0


def test_endless_waiting_is_stopped() -> None:
    assert end_of(Limits(cpu_s=0.3, resident_bytes=2 << 30), do="wait").code == "reader_time"


def test_the_processor_time_of_a_child_is_measured_until_it_ends() -> None:
    child = Child(MODULE)
    pid = child._process.pid
    assert ask(child, do="echo", say="ready")
    before = room._cpu_s(pid)
    with pytest.raises(ChildDied):
        ask(child, Limits(cpu_s=0.5, resident_bytes=2 << 30), do="compute")
    assert before is not None and 0.0 < before < 5.0
    assert room._cpu_s(pid) is None and room._resident_bytes(pid) is None


def test_the_text_of_a_time_limit_does_not_depend_on_the_load() -> None:
    limits = Limits(cpu_s=0.6, resident_bytes=2 << 30)
    assert str(end_of(limits, do="compute")) == str(end_of(limits, do="wait"))


def test_endless_growth_is_stopped_soon_after_the_limit() -> None:
    died = end_of(Limits(cpu_s=60.0, resident_bytes=500 << 20), do="grow")
    assert died.code == "reader_memory"
    assert "0.5 GiB" in str(died)


@pytest.mark.posix
@pytest.mark.parametrize(
    ("number", "code", "by_kill"), [(signal.SIGTERM, "stopped", False), (signal.SIGKILL, "reader_crashed", True)]
)
def test_an_end_from_outside_is_distinguished_from_a_crash(number: int, code: str, by_kill: bool) -> None:
    with pytest.raises(ChildDied) as died:
        for said, _ in Child(MODULE).ask({"do": "wait"}, PATIENT):
            os.kill(said["pid"], number)
    assert (died.value.code, died.value.by_kill) == (code, by_kill)


def test_time_in_which_the_parent_was_suspended_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    watch = room._Watch(os.getpid(), Limits(cpu_s=10.0, resident_bytes=1 << 40))
    now = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: now + 3600.0)
    assert watch.exceeded() is None


def pid_of(child: Child) -> int:
    return int(ask(child, do="echo", say="")[-1][0]["pid"])


def test_a_child_is_reused_unless_it_died() -> None:
    with borrowed(MODULE) as child:
        first = pid_of(child)
    with borrowed(MODULE) as child:
        assert pid_of(child) == first
        with pytest.raises(OncenterError):
            ask(child, do="refuse")
    with pytest.raises(ChildDied), borrowed(MODULE) as child:
        assert pid_of(child) == first
        ask(child, do="crash")
    with borrowed(MODULE) as child:
        assert pid_of(child) != first


def test_a_second_command_of_a_process_starts_no_second_child() -> None:
    room.end_idle(MODULE)
    begin(MODULE)
    (first,) = room._idle[MODULE]
    begin(MODULE)
    assert room._idle[MODULE] == [first]
    first.kill()
    begin(MODULE)
    (second,) = room._idle[MODULE]
    assert second is not first


def test_a_child_that_grew_is_not_reused(monkeypatch: pytest.MonkeyPatch) -> None:
    with borrowed(MODULE) as child:
        first = pid_of(child)
        monkeypatch.setattr(room, "_RESIDENT_TO_KEEP", 1 << 20)
    with borrowed(MODULE) as child:
        assert pid_of(child) != first


def test_two_at_once_get_a_child_each() -> None:
    with borrowed(MODULE) as one, borrowed(MODULE) as other:
        assert pid_of(one) != pid_of(other)


@pytest.mark.parametrize("do", ["wait", "compute"])
def test_a_child_ends_with_its_parent_even_in_the_middle_of_its_work(do: str) -> None:
    script = f"""
import sys
from oncenter.files.child import Child, Limits
child = Child({MODULE!r})
print(child._process.pid, flush=True)
for _ in child.ask({{"do": {do!r}}}, Limits(2.0, 2 << 30)):
    pass
"""
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    time.sleep(0.3)
    parent.kill()
    parent.wait()
    parent.stdout.close()
    deadline = time.monotonic() + 30.0
    while _is_running(pid):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[0] != b"Z"
    except OSError:
        return False


def test_a_relative_path_refers_to_the_caller_s_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A notebook may change its folder while the child lives."""
    from oncenter.read import read

    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        rows = "".join(f"{k / 100},1\n" for k in range(300 if name == "one" else 400))
        (tmp_path / name / "drive.csv").write_text(f"time_s,yaw_rate_deg_s\n{rows}")
    for name, ticks in (("one", 300), ("two", 400)):
        monkeypatch.chdir(tmp_path / name)
        assert read("drive.csv").table.height == ticks


def test_a_module_of_the_current_folder_is_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An untrusted folder may contain a polars.py."""
    folder = tmp_path / "logs"
    folder.mkdir()
    (folder / "polars.py").write_text("open('IMPORTED', 'w')")
    (folder / "drive.csv").write_text("time_s,yaw_rate_deg_s\n" + "".join(f"{k / 100},1\n" for k in range(300)))
    monkeypatch.chdir(folder)
    from oncenter.read import read

    assert read("drive.csv").table.height == 300
    assert not (folder / "IMPORTED").exists()


def test_limits_follow_from_the_files_size_and_leave_half_of_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    small, large = limits_for(1000), limits_for(50 << 20)
    assert small.cpu_s == pytest.approx(10.0, abs=0.1)
    assert large.cpu_s > 100.0
    assert small.resident_bytes < large.resident_bytes
    monkeypatch.setattr(room, "_half_of_memory", lambda: 1 << 30)
    assert limits_for(1 << 40).resident_bytes == 1 << 30
