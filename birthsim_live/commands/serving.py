"""What the page and a replay share: address, port, and the server's run."""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import socket
import tempfile
from pathlib import Path
from types import FrameType

from baselines.commands.shared import finite_number
from baselines.commands.start import endings
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import shown
from birthsim_live.rig.folder import Packed, write_page
from birthsim_live.server.addresses import LOOPBACK, is_loopback

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


def serve(packed: Packed, rig: Parameters, listening: socket.socket, arguments: argparse.Namespace, title: str) -> None:
    """Serve the page of what is ``packed`` on a socket of ``listen`` until a signal asks it to end; after ``need_server``."""
    import uvicorn

    from birthsim_live.server.app import create_app
    from birthsim_live.server.connections import configured

    host: str = arguments.host
    loopback = is_loopback(host)

    class Server(uvicorn.Server):
        """Ends at once at the second signal."""

        def handle_exit(self, sig: int, frame: FrameType | None) -> None:
            if self.should_exit:
                os.write(2, f"birthsim live: {endings()[sig]}\n".encode())
                os._exit(128 + sig)
            super().handle_exit(sig, frame)

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "page"
        write_page(folder, packed, arguments.replay)
        app = create_app(folder, rig, packed.content["python"], {host, *LOOPBACK} if loopback else {host})
        print(
            f"{title}: http://{f'[{host}]' if ':' in host else host}:{listening.getsockname()[1]}  (Ctrl-C ends it)", flush=True
        )
        if not loopback:
            print(
                f"exposed: everybody who can reach {host} may run this page's controllers on this machine; there is no "
                "password and no encryption. Pages must be opened by exactly this name.",
                flush=True,
            )
        server = Server(configured(app, arguments.request_time))
        if hasattr(signal, "SIGHUP"):
            # As the server does with SIGTERM: the folder goes before the command ends.
            signal.signal(signal.SIGHUP, lambda _, frame: server.handle_exit(signal.SIGTERM, frame))
        with contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=[listening])
