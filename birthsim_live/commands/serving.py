"""What the page and a replay share: address, port, and the server's run."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import socket
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from baselines.commands.shared import finite_number
from baselines.commands.start import endings
from birthsim_env.physics.rig.values import shown
from birthsim_live.server.addresses import LOOPBACK, is_loopback

if TYPE_CHECKING:
    from birthsim_live.server.hub import Hub

REQUEST_TIME = 10.0
"""s, assumed, in which a request must arrive."""


def add_address(parser: argparse.ArgumentParser) -> None:
    """The options --port, --host and --request-time."""
    parser.add_argument("--port", type=port_number, help="0 takes any that is free (default: 8000, with --replay 8001)")
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address or name to serve; other than the loopback it lets in everybody who can reach it (default: %(default)s)",
    )
    parser.add_argument(
        "--request-time",
        type=request_time,
        default=REQUEST_TIME,
        metavar="S",
        help="seconds in which a request must arrive; then its connection is closed (default: %(default)g)",
    )


def port_number(text: str) -> int:
    """A port, for argparse."""
    if not (text.isascii() and text.isdecimal() and len(text) <= 5 and int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{shown(text)}; allowed: a whole number from 0 to 65535")
    return int(text)


def need_server() -> None:
    """``ValueError`` without the extra: to be called before anything that takes time."""
    try:
        import uvicorn  # noqa: F401
        import websockets  # noqa: F401  uvicorn's own import would name no extra

        import birthsim_live.server.app  # noqa: F401
    except ImportError as error:
        raise ValueError(f"{error}; the page needs the extra: pip install 'birthsim[live]'") from error


def request_time(text: str) -> float:
    """A time for a request, s, for argparse."""
    seconds = finite_number(text)
    if not 0 < seconds <= 3600:
        raise argparse.ArgumentTypeError(f"{shown(text)}; allowed: a number of seconds > 0 and <= 3600")
    return seconds


def serve(
    hub: Hub, listening: socket.socket, host: str, title: str, request_time: float, recordings: Path | None = None
) -> None:
    """Serve a hub on a socket of ``listen``, by the name ``host``, until a signal asks it to end; after ``need_server``."""
    import uvicorn

    from birthsim_live.server.app import create_app
    from birthsim_live.server.connections import configured

    loopback = is_loopback(host)
    shown = f"[{host}]" if ":" in host else host
    print(f"{title}: http://{shown}:{listening.getsockname()[1]}  (Ctrl-C ends it)", flush=True)
    if not loopback:
        print(
            f"exposed: everybody who can reach {host} may watch and push this rig, change its settings and fetch its "
            "recordings; there is no password and no encryption. Pages must be opened by exactly this name.",
            flush=True,
        )
    app = create_app(hub, {host, *LOOPBACK} if loopback else {host}, recordings)

    class Server(uvicorn.Server):
        """Closes the hub at the first signal, and ends at once at the second, when recordings lack half a second at most."""

        def handle_exit(self, sig: int, frame: FrameType | None) -> None:
            if self.should_exit:
                os.write(2, f"birthsim live: {endings()[sig]}\n".encode())
                os._exit(128 + sig)
            super().handle_exit(sig, frame)

    server = Server(configured(app, request_time))
    if hasattr(signal, "SIGHUP"):
        # As the server does with SIGTERM: the hub is closed before the command ends.
        signal.signal(signal.SIGHUP, lambda _, frame: server.handle_exit(signal.SIGTERM, frame))
    try:
        with contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=[listening])
    finally:
        # An exception too leaves no recording unfinished.
        hub.finish()
