"""The web server: the files of the page, and a socket for controllers; nothing for foreign origins."""

from collections.abc import Collection
from pathlib import Path
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.routing import Mount, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.server.addresses import LOOPBACK
from birthsim_live.server.controller import command

HEADERS = {
    "content-security-policy": "frame-ancestors 'none'",  # besides what the page says itself
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
            allowed = f"allowed: {', '.join(sorted(self._hosts))}, and what birthsim live is given as --allowed-host NAME"
            return f"host {host[:80]!r} is foreign; {allowed}"
        # A program that is no browser sends no origin.
        if origin is not None and origin.lower() not in (f"http://{host.lower()}", f"https://{host.lower()}"):
            return f"origin {origin[:80]!r} is foreign; allowed: that of the page itself; a proxy has to hand its Host on"
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


def create_app(folder: Path, rig: Parameters, controllers: Collection[str] = (), hosts: Collection[str] = LOOPBACK) -> ASGIApp:
    """The application of a page in ``folder`` for requests to ``hosts``; ``controllers`` run in Python and believe in a
    ``rig``."""

    async def socket(socket: WebSocket) -> None:
        await command(socket, rig, controllers)

    files = StaticFiles(directory=folder, html=True)
    return OriginMiddleware(Starlette(routes=[WebSocketRoute("/controller", socket), Mount("/", files)]), hosts)
