"""Where the logs are answered: in child processes of this machine, or on the machines of a Ray cluster.

Both take logs when they are free and return rows in the order in which they finish, with a bounded number in flight.
"""

from __future__ import annotations

import logging
import os
import socket
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from importlib import import_module
from itertools import chain, islice
from threading import Event, Thread
from typing import Any
from urllib.parse import urlsplit

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files.extra import require_package
from oncenter.fleet.files import LogFile

Row = dict[str, Any]
Engine = Callable[[Callable[[LogFile], Row], Iterable[LogFile]], Iterator[tuple[LogFile, Row]]]

_IN_FLIGHT_PER_WORKER = 2
_LOGS_PER_TASK = 8  # of Ray: a task costs milliseconds
_CALL_S = 10.0
_LOGS_WHILE_RAY_BEGINS = 1000  # more than this machine answers in that time
_LOGS_WHILE_RAY_ENDS = 64  # two cores answer about as many in a second

_ray_ends: list[Thread] = []  # at most one: a process has one Ray


def processes(work: Callable[[LogFile], Row], logs: Iterable[LogFile]) -> Iterator[tuple[LogFile, Row]]:
    """One child process per core and one more, each watched by a thread: while one waits for a disk another works."""
    workers = 1 + _cores()
    waiting = iter(logs)
    with ThreadPoolExecutor(workers, thread_name_prefix="fleet") as pool:
        open_work: dict[Future[Row], LogFile] = {}
        try:
            while True:
                for log in islice(waiting, _IN_FLIGHT_PER_WORKER * workers - len(open_work)):
                    open_work[pool.submit(work, log)] = log
                if not open_work:
                    return
                done, _ = wait(open_work, return_when=FIRST_COMPLETED)
                for future in done:
                    yield open_work.pop(future), future.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_ray(address: str | None, workers: int | None = None) -> Engine:
    """An engine on a running cluster (`address`), or on one of this machine's cores that starts and ends with the run.

    Ray takes seconds to start; meanwhile this machine's own child processes answer logs. They also answer the last logs
    while a cluster started here ends, and the logs of tasks that were killed or whose machine went away. The cluster's
    machines need oncenter[fleet] and must have logs and vehicle files under the same names.

    Args:
        address: as `ray.init` takes it, "auto" or "ray://host:10001"; None starts a cluster on this machine.
        workers: of a cluster started here; None: one per core.

    Raises:
        OncenterError: "missing_extra": Ray is not installed; "ray", exit code 2: it does not start, or there is no such
            cluster.
    """
    require_package("ray", "--engine ray")

    def begin() -> None:
        while _ray_ends:
            _ray_ends.pop().join()
        import ray

        _begin_ray(ray, address, workers)

    def engine(work: Callable[[LogFile], Row], logs: Iterable[LogFile]) -> Iterator[tuple[LogFile, Row]]:
        waiting = iter(logs)
        first = deque(islice(waiting, _LOGS_WHILE_RAY_BEGINS))
        if not first:
            return
        answered: deque[tuple[LogFile, Row]] = deque()
        try:
            try:
                _answer_until_done(begin, work, first, answered)
            finally:  # answered logs are kept, whether Ray starts or not
                yield from answered
            import ray

            last: deque[LogFile] = deque()
            but_last = _but_the_last(_LOGS_WHILE_RAY_ENDS if address is None else 0, chain(first, waiting), last)
            lost: deque[LogFile] = deque()
            yield from _by_tasks(ray, work, but_last, lost)
            _end()
            yield from processes(work, chain(last, lost))
        finally:
            _end()

    return engine


def _begin_ray(ray: Any, address: str | None, workers: int | None) -> None:
    place = "Ray did not start on this machine"
    try:
        if address is None:
            ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False, logging_level=logging.ERROR)
        else:
            place = f"no Ray cluster at {address}"
            _call(address)
            place = f"something answers at {address}, but not as a Ray cluster that lets this computer in"
            ray.init(address, log_to_driver=False, logging_level=logging.ERROR)
        there = [ray.remote(num_cpus=1)(_is_there).remote() for _ in range(_ray_cores(ray))]
        ray.wait(there, num_returns=1)  # a worker takes a second to load
    except Exception as error:  # Ray has no exception class for a node that does not start
        raise OncenterError(f"{place}: {' '.join(str(error).split())}", code="ray", exit_code=WRONG_USAGE) from None


def _but_the_last(count: int, logs: Iterable[LogFile], last: deque[LogFile]) -> Iterator[LogFile]:
    """All but the last `count`, which are in `last` afterwards."""
    for log in logs:
        last.append(log)
        if len(last) > count:
            yield last.popleft()


def _end() -> None:
    """Ends Ray in a thread: its processes take a second to end."""
    import ray

    if ray.is_initialized() and not _ray_ends:
        _ray_ends.append(Thread(target=ray.shutdown, name="ray-ends"))
        _ray_ends[-1].start()


def _call(address: str) -> None:
    """Checks the address, since Ray would try a host that does not answer for a quarter of an hour.

    Raises:
        OSError: no answer.
    """
    place = urlsplit(address if "//" in address else f"//{address}")
    if place.hostname and place.port:
        with socket.create_connection((place.hostname, place.port), timeout=_CALL_S):
            pass


def _answer_until_done(
    begin: Callable[[], None],
    work: Callable[[LogFile], Row],
    logs: deque[LogFile],
    answered: deque[tuple[LogFile, Row]],
) -> None:
    """Threads answer logs until `begin` returns."""
    begun = Event()

    def answer() -> None:
        while not begun.is_set():
            try:
                log = logs.popleft()
            except IndexError:  # none is left
                return
            answered.append((log, work(log)))

    with ThreadPoolExecutor(_cores(), thread_name_prefix="fleet") as pool:
        answering = [pool.submit(answer) for _ in range(_cores())]
        try:
            begin()
        finally:
            begun.set()
    for each in answering:
        each.result()


def _by_tasks(
    ray: Any, work: Callable[[LogFile], Row], logs: Iterable[LogFile], lost: deque[LogFile]
) -> Iterator[tuple[LogFile, Row]]:
    """Logs of a task that failed on a machine of the cluster are put into `lost`: Ray itself would retry without
    end a task that its memory monitor kills."""
    task = ray.remote(num_cpus=1, max_retries=0)(_several)
    shared = ray.put(work)
    limit = _IN_FLIGHT_PER_WORKER * _ray_cores(ray)
    waiting = iter(logs)
    open_tasks: dict[Any, list[LogFile]] = {}
    while True:
        while len(open_tasks) < limit and (batch := list(islice(waiting, _LOGS_PER_TASK))):
            open_tasks[task.remote(shared, batch)] = batch
        if not open_tasks:
            return
        done, _ = ray.wait(list(open_tasks), num_returns=1)
        for reference in done:
            batch = open_tasks.pop(reference)
            try:
                rows = ray.get(reference)
            except ray.exceptions.RayError:
                lost.extend(batch)
                continue
            yield from zip(batch, rows, strict=True)


def _ray_cores(ray: Any) -> int:
    return max(1, int(ray.cluster_resources().get("CPU", 1)))


def _is_there() -> None:
    """Loads a worker's modules."""
    import_module("oncenter.fleet.watched")


def _several(work: Callable[[LogFile], Row], logs: list[LogFile]) -> list[Row]:
    return [work(log) for log in logs]
