"""birthsim-replay: a recording of birthsim-live in the same page."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.commands.shared import run
from birthsim_live.commands.serving import add_address, need_server, serve
from birthsim_live.rig.player import Player
from birthsim_live.rig.recording import load_recording
from birthsim_live.server.addresses import listen


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim-replay",
        description="Play a recording of birthsim-live in the page that it was made with: pause, seek, slow motion.",
    )
    parser.add_argument("file", type=Path, help="what birthsim-live wrote, .rec")
    add_address(parser, 8001)
    run(parser, _replay)


def _replay(arguments: argparse.Namespace) -> None:
    need_server()
    # After that: it needs pydantic, which comes with the extra only.
    from birthsim_live.server.replay_hub import ReplayHub

    with listen(arguments.host, arguments.port) as listening:
        recording = load_recording(arguments.file)
        title = f"birthsim-replay {arguments.file.name}, {recording.duration:.1f} s"
        hub = ReplayHub(Player(recording), arguments.file.name)
        serve(hub, listening, arguments.host, title, arguments.request_time)


if __name__ == "__main__":
    main()
