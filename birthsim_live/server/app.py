"""The web server: the page, its files, recordings, and the socket; nothing for foreign origins."""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator, Collection
from pathlib import Path
from urllib.parse import urlsplit

from fastapi import FastAPI, HTTPException, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse
from fastapi.staticfiles import StaticFiles
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from birthsim_live.server.addresses import LOOPBACK
from birthsim_live.server.clients import Client
from birthsim_live.server.hub import Hub

PAGE = Path(__file__).resolve().parent.parent / "page"

HEADERS = {
    "content-security-policy": "default-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-cache",
}


class OriginMiddleware:
    """Lets in only what asks for one of the ``hosts`` by name, and of browsers only the page's own origin."""

    def __init__(self, app: ASGIApp, hosts: Collection[str]) -> None:
        self._app, self._hosts = app, frozenset(host.lower() for host in hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        refusal = self._refusal(Headers(scope=scope))
        if refusal is None:
            await self._app(scope, receive, _with_headers(send))
        elif scope["type"] == "http":
            await PlainTextResponse(refusal, 403)(scope, receive, send)
        else:
            # Before the socket is accepted this is answered with 403.
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": refusal})

    def _refusal(self, headers: Headers) -> str | None:
        host, origin = headers.get("host", ""), headers.get("origin")
        if _name(host) not in self._hosts:
            return f"host {host[:80]!r} is foreign; allowed: {', '.join(sorted(self._hosts))}"
        # A program that is no browser sends no origin.
        if origin is not None and origin.lower() not in (f"http://{host.lower()}", f"https://{host.lower()}"):
            return f"origin {origin[:80]!r} is foreign; allowed: that of the page itself"
        return None


def _name(host: str) -> str:
    """The name in a Host header, without its port."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers[name] = value
        await send(message)

    return sending


def create_app(hub: Hub, hosts: Collection[str] = LOOPBACK, recordings: Path | None = None) -> ASGIApp:
    """The application of a hub for requests to ``hosts``; finished recordings are given out from ``recordings``."""

    @contextlib.asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        await hub.open()
        try:
            yield
        finally:
            await hub.close()

    app = FastAPI(lifespan=lifespan, docs_url=None, redoc_url=None, openapi_url=None)

    @app.get("/")
    async def page() -> FileResponse:
        return FileResponse(PAGE / "index.html")

    @app.get("/recordings/{name}")
    async def recording(name: str) -> FileResponse:
        if recordings is None or not re.fullmatch(r"[\w-]+\.rec", name) or not (recordings / name).is_file():
            raise HTTPException(404, "no such recording")
        return FileResponse(recordings / name, media_type="application/octet-stream", filename=name)

    @app.websocket("/ws")
    async def socket(socket: WebSocket) -> None:
        await socket.accept()
        client = Client(socket.send_text)
        sending = asyncio.create_task(client.send_all())
        try:
            await hub.join(client)
            while True:
                message = await socket.receive()
                if message["type"] == "websocket.disconnect":
                    break
                await hub.receive(client, message["text"] if message.get("text") is not None else message["bytes"])
        except WebSocketDisconnect:
            pass
        finally:
            hub.leave(client)
            sending.cancel()
            # However a socket broke, it is closed.
            with contextlib.suppress(asyncio.CancelledError, Exception):
                await sending

    app.mount("/static", StaticFiles(directory=PAGE), name="static")
    return OriginMiddleware(app, hosts)
