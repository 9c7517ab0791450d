"""Connections of the web server: how long a request may take to arrive, and what of broken ones is worth a line."""

import asyncio
import logging
from functools import partial
from typing import Any

import h11
import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

LARGEST = 1 << 12
"""Bytes of a message; a larger one closes its socket."""


UNREAD = 1 << 18
"""Bytes of answers that a client may leave unread; a socket with more is closed."""


class BoundedSockets(WebSocketsSansIOProtocol):
    """Closes a socket whose client sends pings and never reads what they are answered with."""

    def handle_ping(self) -> None:
        if self.transport.is_closing():
            return
        super().handle_ping()
        if self.transport.get_write_buffer_size() > UNREAD:
            self.transport.abort()


class TimedRequests(H11Protocol):
    """Closes a connection whose request is not whole ``request_time`` s after it began; a first one begins at once."""

    def __init__(self, request_time: float, **options: Any) -> None:
        super().__init__(**options)
        self._request_time = request_time
        self._ending: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._await_request()

    def data_received(self, data: bytes) -> None:
        super().data_received(data)
        self._await_request()

    def connection_lost(self, exc: Exception | None) -> None:
        self._stop_waiting()
        super().connection_lost(exc)

    def _await_request(self) -> None:
        # After an upgrade another protocol has the connection.
        if self.conn.their_state not in (h11.IDLE, h11.SEND_BODY) or self.transport.get_protocol() is not self:
            self._stop_waiting()
        elif self._ending is None:
            self._ending = self.loop.call_later(self._request_time, self.transport.close)

    def _stop_waiting(self) -> None:
        if self._ending is not None:
            self._ending.cancel()
            self._ending = None


def configured(app: ASGIApp, request_time: float) -> uvicorn.Config:
    """What a server needs to serve ``app``; a request has ``request_time`` s to arrive."""
    config = uvicorn.Config(
        app,
        log_level="warning",
        http=partial(TimedRequests, request_time),  # type: ignore[arg-type]
        ws=BoundedSockets,
        ws_max_size=LARGEST,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=1,
        proxy_headers=False,
        server_header=False,
    )
    logging.getLogger("uvicorn.error").addFilter(_worth_a_line)
    return config


def _worth_a_line(record: logging.LogRecord) -> bool:
    """False for text of a client that is no UTF-8: its socket is closed with 1007, which is all there is to do."""
    return not str(record.msg).startswith("Invalid UTF-8 sequence")
