"""What birthsim-live and birthsim-replay share: address, port, and the server's run."""

from __future__ import annotations

import argparse
import contextlib
import ipaddress
import os
import socket
from pathlib import Path

import uvicorn

from birthsim_live.desk import Desk
from birthsim_live.server import LOOPBACK, create_app

LARGEST = 1 << 20
"""Bytes of a message that is still answered by an error; a larger one closes the socket."""


def add_address(parser: argparse.ArgumentParser, port: int) -> None:
    """The options --port and --host."""
    parser.add_argument("--port", type=port_number, default=port, help="0 takes any that is free (default: %(default)s)")
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address or name to serve; other than the loopback it lets in everybody who can reach it (default: %(default)s)",
    )


def port_number(text: str) -> int:
    """A port, for argparse."""
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r}; allowed: a whole number from 0 to 65535")
    return int(text)


def serve(desk: Desk, listening: socket.socket, host: str, title: str, recordings: Path | None = None) -> None:
    """Serve a desk on a bound socket (``listen``), by the name ``host``, until an interrupt."""
    loopback = is_loopback(host)
    shown = f"[{host}]" if ":" in host else host
    print(f"{title}: http://{shown}:{listening.getsockname()[1]}  (Ctrl-C ends it)", flush=True)
    if not loopback:
        print(
            f"exposed: everybody who can reach {host} may watch and push this rig, change its settings and fetch its "
            "recordings; there is no password and no encryption. Pages must be opened by exactly this name.",
            flush=True,
        )
    app = create_app(desk, LOOPBACK if loopback else (host,), recordings)
    options = uvicorn.Config(
        app, log_level="warning", ws="websockets-sansio", ws_max_size=LARGEST, ws_per_message_deflate=False,
        timeout_graceful_shutdown=1, proxy_headers=False, server_header=False,
    )  # fmt: skip
    try:
        with contextlib.suppress(KeyboardInterrupt):
            uvicorn.Server(options).run(sockets=[listening])
    finally:
        # After a second interrupt the server leaves without closing the desk.
        desk.finish()


def listen(host: str, port: int) -> socket.socket:
    """A socket bound to the address; ``ValueError`` where it is taken, unknown or all addresses at once."""
    try:
        family, kind, number, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, UnicodeError) as error:
        raise ValueError(f"host = {host!r} is unknown ({error}); allowed: an address or name of this machine") from error
    if ipaddress.ip_address(address[0]).is_unspecified:
        raise ValueError(f"host = {host!r} means every address; allowed: one address or name, by which pages are opened")
    listening = socket.socket(family, kind, number)
    # Without it a port stays taken for a minute after its server has ended.
    if os.name == "posix":
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(address)
        listening.listen()
    except OSError as error:
        listening.close()
        raise ValueError(
            f"port = {port} of {host} cannot be served ({error.strerror}); allowed: a free port, --port 0 finds one"
        ) from error
    return listening


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach ``host``."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host in LOOPBACK
