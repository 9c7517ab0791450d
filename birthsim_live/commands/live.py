"""birthsim-live: the rig in the browser, in real time, to see and to push."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.commands.shared import run
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_live.commands.serving import add_address, need_server, serve
from birthsim_live.server.addresses import listen


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim-live",
        description="One rig in real time in the browser: drag the end effector, change stiffness, scenario, controller, "
        "valves and sensors while it moves, record it for birthsim-replay. Works without internet, for this machine alone.",
    )
    add_address(parser, 8000)
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument(
        "--record-dir", type=Path, default=Path("out/live"), help="folder for recordings (default: %(default)s)"
    )
    run(parser, _live)


def _live(arguments: argparse.Namespace) -> None:
    need_server()
    # After that: both need pydantic, which comes with the extra only.
    from birthsim_live.rig.session import Session
    from birthsim_live.server.live_hub import LiveHub

    with listen(arguments.host, arguments.port) as listening:
        session = Session(load_parameters(arguments.parameters))
        session.advance(1)  # compiles what is not cached yet, before anybody looks
        session.reset()
        hub = LiveHub(session, arguments.record_dir)
        serve(hub, listening, arguments.host, "birthsim-live", arguments.record_dir)


if __name__ == "__main__":
    main()
