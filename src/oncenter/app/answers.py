"""Answers of the page: each is one run of `oncenter offset` or `oncenter compare` in a process of its own, so that the
page says what the command says, and a cancelled one leaves nothing behind."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import secrets
import signal
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from oncenter.app.texts import ENGLISH
from oncenter.errors import OncenterError

Kept = Callable[[dict[str, Any]], None]
RUNNING_MAX = 2  # at once
KEPT_MAX = 20  # answers with their reports


@dataclass
class Answer:
    """`state` is "running", "done", "failed" or "cancelled"; `said` is the JSON of the command; `truck` is None where
    no memory is written."""

    report: Path
    truck: str | None = None
    state: str = "running"
    said: dict[str, Any] | None = None
    process: asyncio.subprocess.Process | None = None


class Answers:
    """All answers of the page; the running ones are cancelled and the reports deleted when its context ends."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="oncenter-app-", ignore_cleanup_errors=True)
        self._of: dict[str, Answer] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def __enter__(self) -> Answers:
        return self

    def __exit__(self, *_: object) -> None:
        for answer in self._of.values():
            _end(answer)
        self._folder.cleanup()

    def begin(
        self, logs: Sequence[Path], options: Sequence[str], truck: str | None = None, kept: Kept = lambda said: None
    ) -> str:
        """The key of an answer that is begun; needs a running event loop.

        Args:
            logs: of one folder.
            options: of `oncenter offset`.
            truck: whose memory the options name; None where they name none.
            kept: called with the JSON of a command that is done.

        Raises:
            OncenterError: "page": others run.
        """
        if truck is not None and any(each.state == "running" and each.truck == truck for each in self._of.values()):
            raise OncenterError(ENGLISH["truck_is_busy"], code="page")
        return self._begin("offset", logs, options, truck, kept)

    def _begin(
        self,
        verb: str,
        inputs: Sequence[Path],
        options: Sequence[str],
        truck: str | None = None,
        kept: Kept = lambda said: None,
    ) -> str:
        if sum(answer.state == "running" for answer in self._of.values()) >= RUNNING_MAX:
            raise OncenterError(f"{RUNNING_MAX} answers are being made: wait, or cancel one", code="page")
        for key in list(self._of)[: 1 - KEPT_MAX]:
            self._of.pop(key).report.unlink(missing_ok=True)
        key = secrets.token_urlsafe(12)
        answer = self._of[key] = Answer(Path(self._folder.name) / f"{key}.html", truck)
        task = asyncio.create_task(_run(answer, verb, inputs, options, kept))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return key

    def begin_comparison(self, before: dict[str, Any] | None, after: dict[str, Any] | None) -> str:
        """The key of a comparison of the JSON of two answers, by the dates of their drives; its report is the
        certificate.

        Raises:
            OncenterError: "page": one of them is missing, both are the same, or others run.
        """
        if before is None or after is None or before == after:
            raise OncenterError(ENGLISH["needs_two"], code="page")
        files = [Path(self._folder.name) / f"{secrets.token_urlsafe(12)}.json" for _ in (before, after)]
        for said, file in zip((before, after), files, strict=True):
            file.write_text(json.dumps(said), encoding="utf-8")
        starts = {before["start_time"], after["start_time"]}
        return self._begin("compare", files, ["--in-given-order"] if None in starts or len(starts) < 2 else [])

    def of(self, key: str) -> Answer | None:
        return self._of.get(key)

    def said(self, key: str) -> dict[str, Any] | None:
        """The JSON of one that is done."""
        answer = self._of.get(key)
        return answer.said if answer is not None and answer.state == "done" else None

    def cancel(self, key: str) -> None:
        answer = self._of.get(key)
        if answer is not None and answer.state == "running":
            answer.state = "cancelled"
            _end(answer)


async def _run(answer: Answer, verb: str, inputs: Sequence[Path], options: Sequence[str], kept: Kept) -> None:
    options = [*options, "--json", "--report", str(answer.report)]
    answer.process = await asyncio.create_subprocess_exec(
        sys.executable,
        *("-m", "oncenter", verb, *options, "--", *(path.name for path in inputs)),  # the report shows the names
        cwd=inputs[0].parent,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        start_new_session=sys.platform != "win32",
    )
    if answer.state == "cancelled":  # while it started
        _end(answer)
    out, err = await answer.process.communicate()
    if answer.state == "cancelled":
        return
    try:
        answer.said = json.loads(out)
    except ValueError:
        ended = err.decode(errors="replace").strip().removeprefix("oncenter: ")
        answer.said = {"code": "bug", "message": ended or f"it ended with code {answer.process.returncode}"}
    if "message" not in answer.said:
        kept(answer.said)
    answer.state = "failed" if "message" in answer.said else "done"


def _end(answer: Answer) -> None:
    """Its reader, a child of it, ends with it."""
    if answer.process is None or answer.process.returncode is not None:
        return
    with contextlib.suppress(OSError):
        if sys.platform == "win32":
            answer.process.kill()
        else:
            os.killpg(answer.process.pid, signal.SIGKILL)
