"""Wherever logs lie, and whoever does the work, a night ends with the same bytes."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import polars as pl
import pytest
from two_trucks import tables

from oncenter.errors import OncenterError
from oncenter.fleet import engines, run
from oncenter.fleet.engines import on_ray
from oncenter.fleet.files import LogFile
from oncenter.fleet.watched import Watched

pytestmark = pytest.mark.slow


def test_ray_gives_the_bytes_that_this_machines_processes_give(
    fleet: Path, undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[ray]'")
    if "libasan" in os.environ.get("LD_PRELOAD", ""):
        pytest.skip("Ray's processes do not always begin under the sanitizers; what they call is tested without Ray")
    monkeypatch.setattr(engines, "_LOGS_WHILE_RAY_BEGINS", 3)
    monkeypatch.setattr(engines, "_LOGS_WHILE_RAY_ENDS", 2)  # those between are Ray's
    here: list[str] = []
    answer = Watched.__call__

    def noted(self: Watched, log: LogFile) -> dict[str, Any]:
        here.append(log.uri)
        return answer(self, log)

    monkeypatch.setattr(Watched, "__call__", noted)
    summary = run([str(fleet / "logs")], fleet / "vehicles", tmp_path, engine=on_ray(None, workers=2))
    assert 2 < len(here) <= 5 < summary.logs_found
    assert set(sorted(pl.read_parquet(tmp_path / "drives.parquet")["log"])[-2:]) <= set(here)
    assert tables(tmp_path) == tables(undisturbed)


def test_what_was_answered_is_kept_where_ray_does_not_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[ray]'")
    logs = [LogFile(f"{k}.csv", "", 0, 0.0) for k in range(20)]
    done = threading.Event()

    def work(log: LogFile) -> dict[str, Any]:
        if log == logs[-1]:
            done.set()
        return {"answered": log.uri}

    def init(*_: object, **__: object) -> None:
        done.wait(10.0)
        raise Exception("The current node timed out")  # of Ray, word for word

    monkeypatch.setattr(ray, "init", init)
    rows = {}
    with pytest.raises(OncenterError, match="Ray did not start on this machine: The current node timed out"):
        for log, row in on_ray(None)(work, logs):
            rows[log] = row
    assert rows == {log: {"answered": log.uri} for log in logs}


def test_ray_ends_also_with_a_run_that_fails_before_its_first_task(monkeypatch: pytest.MonkeyPatch) -> None:
    ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[ray]'")
    answered, ended = threading.Event(), threading.Event()

    def work(_: LogFile) -> dict[str, Any]:
        answered.set()
        return {}

    monkeypatch.setattr(ray, "init", lambda **_: answered.wait(10.0))
    monkeypatch.setattr(ray, "is_initialized", lambda: not ended.is_set())
    monkeypatch.setattr(ray, "shutdown", ended.set)
    rows = on_ray(None)(work, [LogFile("0.csv", "", 0, 0.0)])
    next(iter(rows))
    del rows  # as a full disk does it
    assert ended.wait(10.0)


def test_the_last_logs_are_left_for_while_ray_ends_and_none_is_lost() -> None:
    logs = [LogFile(f"{k}.csv", "", 0, 0.0) for k in range(5)]
    for count, left in ((0, 0), (2, 2), (5, 5), (9, 5)):
        last: deque[LogFile] = deque()
        given = list(engines._but_the_last(count, iter(logs), last))
        assert len(last) == left
        assert given + list(last) == logs


def test_logs_whose_task_ray_killed_are_answered_by_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ray's memory monitor kills tasks when other work fills the machine; it would try such a task again for ever."""
    ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[ray]'")
    logs = [LogFile(f"{k}.csv", "", 0, 0.0) for k in range(20)]
    tried: list[LogFile] = []

    def get(batch: list[LogFile]) -> list[dict[str, Any]]:
        tried.extend(batch)
        if logs[9] in batch:
            raise ray.exceptions.OutOfMemoryError("Task was killed due to the node running low on memory.")
        return [{"by": "Ray"} for _ in batch]

    def remote(**options: int) -> Any:
        assert options["max_retries"] == 0
        return lambda _: SimpleNamespace(remote=lambda _, batch: tuple(batch))

    monkeypatch.setattr(ray, "remote", remote)
    monkeypatch.setattr(ray, "put", lambda work: work)
    monkeypatch.setattr(ray, "wait", lambda tasks, num_returns: (tasks[:1], tasks[1:]))
    monkeypatch.setattr(ray, "get", get)
    monkeypatch.setattr(ray, "cluster_resources", lambda: {"CPU": 1})
    lost: deque[LogFile] = deque()
    rows = dict(engines._by_tasks(ray, lambda _: {}, iter(logs), lost))
    assert tried == logs
    assert list(lost) == logs[8:16]
    assert rows == {log: {"by": "Ray"} for log in logs if log not in lost}


def test_a_ray_cluster_that_does_not_answer_is_named_at_once() -> None:
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[ray]'")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    for address in (f"127.0.0.1:{port}", f"ray://127.0.0.1:{port}"):
        with pytest.raises(OncenterError, match=f"no Ray cluster at {address}: .*refused"):
            list(on_ray(address)(lambda _: {}, [LogFile("a night's only log", "", 0, 0.0)]))


@contextlib.contextmanager
def s3_server() -> Iterator[str]:
    """Its address; a process of its own, since pyarrow waits for it without letting others run."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    server = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        for _ in range(200):
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 0.1):
                break
            time.sleep(0.05)
        yield f"127.0.0.1:{port}"
    finally:
        server.terminate()
        server.wait()


def test_logs_in_an_s3_bucket_give_the_answers_that_they_give_on_disk(
    fleet: Path, undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("moto", reason="moto is not installed: pip install 'oncenter[dev]'")
    from pyarrow.fs import LocalFileSystem, S3FileSystem, copy_files

    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "any")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "any")
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    with s3_server() as address:
        store = S3FileSystem(endpoint_override=address, scheme="http", allow_bucket_creation=True)
        store.create_dir("nightly")
        copy_files(str(fleet / "logs"), "nightly/logs", LocalFileSystem(), store)
        place = f"s3://nightly/logs?scheme=http&endpoint_override={address}"
        summary = run([place], fleet / "vehicles", tmp_path)
        again = run([place], fleet / "vehicles", tmp_path)
        with pytest.raises(OncenterError, match="no such bucket") as refusal:
            run([place.replace("nightly", "weekly")], fleet / "vehicles", tmp_path)
    assert refusal.value.exit_code == 2
    assert (summary.logs_answered, summary.logs_refused, again.logs_answered) == (12, 0, 0)
    ours, theirs = (pl.read_parquet(folder / "drives.parquet").drop("log") for folder in (tmp_path, undisturbed))
    assert ours.equals(theirs)
    assert "s3://nightly/logs/depot-7/day0.parquet" in pl.read_parquet(tmp_path / "drives.parquet")["log"].to_list()


@contextlib.contextmanager
def another_host() -> Iterator[tuple[str, list[str]]]:
    """The address of a server of somebody else, and the requests that it gets."""
    got: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def do_HEAD(self) -> None:
            got.append(self.path)
            self.send_error(404)

        do_GET = do_HEAD

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"127.0.0.1:{server.server_address[1]}", got
    finally:
        server.shutdown()
        server.server_close()


def test_a_key_of_a_bucket_is_a_name_whatever_characters_it_holds(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A key as an address would send the token of the session to a host that the key names, or read another bucket."""
    pytest.importorskip("moto", reason="moto is not installed: pip install 'oncenter[dev]'")
    import boto3

    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_SESSION_TOKEN"):
        monkeypatch.setenv(name, "any")
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    day = (fleet / "logs" / "depot-7" / "day0.parquet").read_bytes()
    with s3_server() as address, another_host() as (elsewhere, got):
        store = boto3.client("s3", endpoint_url=f"http://{address}")
        for bucket in ("nightly", "secret"):
            store.create_bucket(Bucket=bucket)
        store.put_object(Bucket="secret", Key="day.parquet", Body=day)
        names = [
            f"q?scheme=http&endpoint_override={elsewhere}#.parquet",
            "a#b.parquet",
            "%41.parquet",
            "..%2fup.parquet",
            "back\\slash.parquet",
            "\x1b[31m red.parquet",
            "a" * 900 + ".parquet",
        ]
        for name in names:
            store.put_object(Bucket="nightly", Key=f"logs/depot-7/{name}", Body=day)
        no_names = ["logs/depot-7//a.parquet", "logs/../../secret/day.parquet", "logs/./b.parquet"]
        for key in no_names:
            store.put_object(Bucket="nightly", Key=key, Body=day)
        place = f"s3://nightly/logs?scheme=http&endpoint_override={address}"
        summary = run([place], fleet / "vehicles", tmp_path)
        again = run([place], fleet / "vehicles", tmp_path)
    assert got == []
    assert (summary.logs_found, summary.logs_answered, summary.refused) == (10, len(names), {"not_a_file": 3})
    assert (again.logs_found, again.logs_answered, again.logs_refused) == (10, 0, 0)
    drives = pl.read_parquet(tmp_path / "drives.parquet")
    refused = sorted(drives.filter(error_code="not_a_file")["log"])
    assert refused == [
        "s3://nightly/logs/../../secret/day.parquet",
        "s3://nightly/logs/./b.parquet",
        "s3://nightly/logs/depot-7//",
    ]
    assert not any("\x1b" in text for text in drives["log"])
