"""The page's process: by default for this machine only, and for those who have the key."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
import socket
import sys
from multiprocessing.connection import Connection

from tornado.iostream import StreamClosedError
from tornado.web import HTTPError

from oncenter.app.guard import POLICY_OF_CHARTS, Guarded, Server, server
from oncenter.app.texts import LIVE
from oncenter.live.handed_sockets import taken
from oncenter.live.page import News, rendered
from oncenter.live.web import NEXT, READY, Hello

NICE = 10  # recording and estimation get nine tenths of a core that this process competes for
VIEWERS_MAX = 32  # enough for a workshop
SLOW_S = (
    60.0  # a viewer who takes longer for an event, or for a part of a file, is cut off; the page comes back by itself
)
_UNREAD_MAX_BYTES = 1 << 16  # in the kernel for one viewer: more would only be outdated; and of a file, here


def main() -> None:
    """Takes the pipe and the listening sockets; ends when the other end of the pipe closes."""
    if sys.platform != "win32":  # Windows starts it with a lower priority
        os.nice(NICE)
    pipe, *listening = taken()
    serve(Connection(pipe.detach()), listening)


def serve(pipe: Connection, sockets: list[socket.socket]) -> None:
    # Windows' default loop cannot watch sockets by number
    with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
        runner.run(_serve(pipe, sockets))


async def _serve(pipe: Connection, sockets: list[socket.socket]) -> None:
    hello: Hello = pipe.recv()
    news = News(hello.first, hello.params, lambda: pipe.send_bytes(NEXT))
    served = _server(news, hello.address, hello.key)
    for own in sockets:
        own.setblocking(False)
        own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _UNREAD_MAX_BYTES)  # its connections inherit it
    served.add_sockets(sockets)
    over = asyncio.Event()

    def receive() -> None:
        try:
            news.update(pipe.recv())
        except (EOFError, OSError):
            loop.remove_reader(pipe.fileno())
            over.set()

    loop = asyncio.get_running_loop()
    loop.add_reader(pipe.fileno(), receive)
    pipe.send_bytes(READY)
    await over.wait()
    await news.end()
    served.stop()
    await served.close_all_connections()


def _server(news: News, address: str, key: str) -> Server:
    files = [
        (re.escape(path), _File, {"kind": kind, "content": content.encode()})
        for path, (kind, content) in rendered(news).items()
    ]
    return server([*files, ("/events", _Events, {"news": news})], address, key, POLICY_OF_CHARTS)


class _ToViewers(Guarded):
    def refuse_beyond_viewers(self) -> None:
        """
        Raises:
            HTTPError: no other viewer is let in.
        """
        if len(self.settings["held"]) >= VIEWERS_MAX:
            raise HTTPError(503, reason=LIVE["viewers"].format(VIEWERS_MAX))

    async def send(self, part: bytes) -> None:
        """Waits until it is taken: no other one waits here meanwhile.

        Raises:
            StreamClosedError: who asked is too slow, or has left.
        """
        self.write(part)
        try:
            await asyncio.wait_for(self.flush(), SLOW_S)
        except TimeoutError:
            self.stream().close()
            raise StreamClosedError from None


class _File(_ToViewers):
    def initialize(self, kind: str, content: bytes) -> None:
        self._kind, self._content = kind, content

    async def get(self) -> None:
        if self.request.path == "/":
            self.refuse_beyond_viewers()
        self.set_header("Content-Type", f"{self._kind}; charset=utf-8")
        with contextlib.suppress(StreamClosedError):
            for begin in range(0, len(self._content), _UNREAD_MAX_BYTES):
                await self.send(self._content[begin : begin + _UNREAD_MAX_BYTES])


class _Events(_ToViewers):
    """One viewer, as server-sent events."""

    _following: asyncio.Task[None] | None = None

    def initialize(self, news: News) -> None:
        self._news = news

    async def get(self) -> None:
        self.refuse_beyond_viewers()
        self.stream().set_nodelay(True)
        self.set_header("Content-Type", "text/event-stream")
        self.hold()
        self._following = self._news.begin(self.send)
        (failure,) = await asyncio.gather(self._following, return_exceptions=True)
        if failure is not None:  # he is too slow, or has left
            self.on_connection_close()
            self.detach().close()

    def on_connection_close(self) -> None:
        super().on_connection_close()
        if self._following is not None:
            self._following.cancel()


if __name__ == "__main__":
    main()
