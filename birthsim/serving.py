"""The server's run, of the page and of a replay."""

import contextlib
import os
import signal
import socket
import tempfile
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from birthsim.command_line.start import endings
from birthsim_env.extras import installation
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.folder import Packed, write_page
from birthsim_live.server.addresses import LOOPBACK, is_loopback, is_unspecified

if TYPE_CHECKING:
    from birthsim.commands.live import Settings


def need_server() -> None:
    """``ValueError`` without the extra: to be called before anything that takes time."""
    try:
        import uvicorn  # noqa: F401
        import websockets  # noqa: F401  uvicorn's own import would name no extra

        import birthsim_live.server.app  # noqa: F401
    except ImportError as error:
        raise ValueError(f"{error}; the page needs the extra: {installation('live')}") from error


def serve(packed: Packed, rig: Parameters, listening: socket.socket, settings: "Settings", title: str) -> None:
    """Serve the page of what is ``packed`` on a socket of ``listen`` until a signal asks it to end; after ``need_server``."""
    import uvicorn

    from birthsim_live.server.app import create_app
    from birthsim_live.server.connections import configured

    address, port, *_ = listening.getsockname()
    # One that means every address is nobody's name: pages are opened by those that are allowed.
    own = [] if is_unspecified(address) else [settings.host]
    host = [*own, *settings.allowed_host][0]
    loopback = is_loopback(settings.host)

    class Server(uvicorn.Server):
        """Ends at once at the second signal."""

        def handle_exit(self, sig: int, frame: FrameType | None) -> None:
            if self.should_exit:
                os.write(2, f"birthsim live: {endings()[sig]}\n".encode())
                os._exit(128 + sig)
            super().handle_exit(sig, frame)

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "page"
        write_page(folder, packed, settings.replay)
        hosts = {*settings.allowed_host, *(LOOPBACK if loopback else ()), *own}
        app = create_app(folder, rig, packed.content["python"], hosts)
        print(f"{title}: http://{f'[{host}]' if ':' in host else host}:{port}  (Ctrl-C ends it)", flush=True)
        if not loopback:
            print(
                f"exposed: everybody who can reach {settings.host} may run this page's controllers on this machine; there is "
                f"no password and no encryption. Pages must be opened by exactly {' or '.join(sorted(hosts))}.",
                flush=True,
            )
        server = Server(configured(app, settings.request_time))
        if hasattr(signal, "SIGHUP"):
            # As the server does with SIGTERM: the folder goes before the command ends.
            signal.signal(signal.SIGHUP, lambda _, frame: server.handle_exit(signal.SIGTERM, frame))
        with contextlib.suppress(KeyboardInterrupt):
            server.run(sockets=[listening])
