"""Clients of the page: what waits to be sent to each, so that a slow one holds up nobody."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from birthsim_live.server.protocol import encode

ANSWERS = 32
"""Answers (errors, pongs) that wait for a client; a client that floods loses its oldest."""


class Client:
    """One window of a browser. Of each kind of news only the newest waits, and one frame."""

    def __init__(self, send: Callable[[str], Awaitable[None]]) -> None:
        self._send = send
        self.closed = False
        self._news: dict[str, str] = {}
        self._answers: deque[str] = deque(maxlen=ANSWERS)
        self._frame: str | None = None
        self._ready = asyncio.Event()

    def tell(self, kind: str, text: str) -> None:
        """Send news of a kind (hello, settings, state, path)."""
        self._news.pop(kind, None)
        self._news[kind] = text
        self._ready.set()

    def answer(self, message: Mapping[str, Any]) -> None:
        """Send an answer to what this client sent."""
        self._answers.append(encode(message))
        self._ready.set()

    def show(self, frame: str) -> None:
        """Send the newest frame."""
        self._frame = frame
        self._ready.set()

    async def send_all(self) -> None:
        """Send whatever waits, for ever; ends with the exception of a closed socket."""
        while True:
            await self._ready.wait()
            self._ready.clear()
            while self._news:
                await self._send(self._news.pop(next(iter(self._news))))
            while self._answers:
                await self._send(self._answers.popleft())
            if self._frame is not None:
                frame, self._frame = self._frame, None
                await self._send(frame)
