"""Who does the work: threads of this process, since the core lets others run, or the machines of a Ray cluster.

Both take logs as they are free and give rows as they are done, a bounded number in flight.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import Any

from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.fleet.files import LogFile

Row = dict[str, Any]
Engine = Callable[[Callable[[LogFile], Row], Iterable[LogFile]], Iterator[tuple[LogFile, Row]]]

_IN_FLIGHT_PER_WORKER = 2
_LOGS_PER_TASK = 8  # of Ray: a task costs some milliseconds


def threads(work: Callable[[LogFile], Row], logs: Iterable[LogFile]) -> Iterator[tuple[LogFile, Row]]:
    """One thread a core, and one more: whenever two wait for each other's Python, a core would have nothing to do."""
    workers = 1 + (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1)
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


def on_ray(address: str | None, workers: int | None = None) -> Engine:
    """On a cluster that is there already (`address`), or one of this machine's cores that ends with the run.

    Its machines need oncenter[fleet], and see logs and vehicle files under the same names.

    Args:
        address: as `ray.init` takes it, "auto" or "ray://host:10001"; None begins one here.
        workers: of one begun here; None: one a core.

    Raises:
        OncenterError: "ray", exit code 2: it is not installed, or there is no such cluster.
    """
    try:
        import ray
    except ImportError:
        raise OncenterError(
            "--engine ray needs Ray: pip install 'oncenter[fleet]'", code="ray", exit_code=WRONG_USAGE
        ) from None

    def engine(work: Callable[[LogFile], Row], logs: Iterable[LogFile]) -> Iterator[tuple[LogFile, Row]]:
        try:
            ray.init(address, num_cpus=workers, include_dashboard=False, log_to_driver=False) if address is None else (
                ray.init(address, log_to_driver=False)
            )
        except (ConnectionError, RuntimeError, ValueError) as error:
            raise OncenterError(
                f"no Ray cluster at {address}: {' '.join(str(error).split())}", code="ray", exit_code=WRONG_USAGE
            ) from None
        try:
            yield from _by_tasks(ray, work, logs)
        finally:
            ray.shutdown()

    return engine


def _by_tasks(ray: Any, work: Callable[[LogFile], Row], logs: Iterable[LogFile]) -> Iterator[tuple[LogFile, Row]]:
    task = ray.remote(num_cpus=1)(_several)
    shared = ray.put(work)
    limit = _IN_FLIGHT_PER_WORKER * max(1, int(ray.cluster_resources().get("CPU", 1)))
    waiting = iter(logs)
    open_tasks: dict[Any, list[LogFile]] = {}
    while True:
        while len(open_tasks) < limit and (batch := list(islice(waiting, _LOGS_PER_TASK))):
            open_tasks[task.remote(shared, batch)] = batch
        if not open_tasks:
            return
        done, _ = ray.wait(list(open_tasks), num_returns=1)
        for reference in done:
            yield from zip(open_tasks.pop(reference), ray.get(reference), strict=True)


def _several(work: Callable[[LogFile], Row], logs: list[LogFile]) -> list[Row]:
    return [work(log) for log in logs]
