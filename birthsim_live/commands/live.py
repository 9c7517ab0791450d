"""birthsim live: the rig in the browser, in real time, to see and to push."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from baselines.commands.shared import run
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_live.commands.serving import add_address, need_server, serve
from birthsim_live.server.addresses import listen


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim live",
        description="One rig in real time in the browser: drag the end effector, change stiffness, scenario, controller, "
        "valves and sensors while it moves, record it for --replay. Works without internet, for this machine alone.",
    )
    parser.add_argument(
        "--replay", type=Path, metavar="FILE", help="play what the page recorded, .rec: pause, seek, slow motion"
    )
    add_address(parser)
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--compare", metavar="CONTROLLER", help="open with a second rig under this controller beside the first")
    parser.add_argument(
        "--record-dir", type=Path, default=Path("out/live"), help="folder for recordings (default: %(default)s)"
    )
    parser.add_argument(
        "--static",
        type=Path,
        metavar="FOLDER",
        help="write the page with its rig into this new folder, for any web server, and end",
    )
    parser.add_argument(
        "--policy",
        nargs="+",
        default=[],
        metavar="DIR",
        help="policies to choose from besides those that are shipped: folders that birthsim train wrote; the page opens with "
        "the first, which may be a shipped name",
    )
    run(parser, _live)


def _live(arguments: argparse.Namespace) -> None:
    if arguments.replay is not None:
        _replay(arguments)
        return
    if arguments.static is not None:
        if arguments.compare is not None:
            raise ValueError(f"--compare {arguments.compare} beside --static; allowed: ?compare={arguments.compare} in a link")
        _build(arguments.static, arguments.parameters, arguments.policy)
        return
    need_server()
    # After that: both need pydantic, which comes with the extra only.
    from birthsim_live.rig.session import Session
    from birthsim_live.rig.settings import opening_settings
    from birthsim_live.server.live_hub import LiveHub

    with listen(arguments.host, 8000 if arguments.port is None else arguments.port) as listening:
        rig = load_parameters(arguments.parameters)
        _check(arguments.policy, rig)
        session = Session(rig, opening_settings(rig, arguments.policy), policies=arguments.policy)
        if arguments.compare is not None:
            session.change({"compare": arguments.compare})
        session.advance(1)  # compiles what is not cached yet, before anybody looks
        session.reset()
        hub = LiveHub(session, arguments.record_dir)
        serve(hub, listening, arguments.host, "birthsim live", arguments.request_time, arguments.record_dir)


def _replay(arguments: argparse.Namespace) -> None:
    for name in ("parameters", "compare", "static", "policy"):
        if getattr(arguments, name):
            raise ValueError(f"--{name} with --replay; allowed: without it, a recording has its own rig")
    need_server()
    # After that: it needs pydantic, which comes with the extra only.
    from birthsim_live.rig.player import Player
    from birthsim_live.rig.recording import load_recording
    from birthsim_live.server.replay_hub import ReplayHub

    file: Path = arguments.replay
    with listen(arguments.host, 8001 if arguments.port is None else arguments.port) as listening:
        recording = load_recording(file)
        title = f"birthsim live --replay {file.name}, {recording.duration:.1f} s"
        serve(ReplayHub(Player(recording), file.name), listening, arguments.host, title, arguments.request_time)


def _check(policies: Sequence[str], rig: Parameters) -> None:
    """``ValueError`` that names a policy which is none, or the extra that policies need."""
    if not policies:
        return
    try:
        from agents.policy.controller import ResidualController
    except ImportError as error:
        raise ValueError(f"{error}; a policy needs the extra: pip install 'birthsim[agents]'") from error
    for policy in policies:
        ResidualController(rig, policy=policy)


def _build(folder: Path, parameters: str | None, policies: Sequence[str]) -> None:
    try:
        # They need pydantic and safetensors, which come with extras only.
        from birthsim_live.static.build import build_page
    except ImportError as error:
        raise ValueError(
            f"{error}; the page without a server needs extras: pip install 'birthsim[live,agents,build]'"
        ) from error
    rig = load_parameters(parameters)
    _check(policies, rig)
    size = build_page(folder, rig, policies)
    print(f"written to {folder}: {size / 1e6:.2f} MB; python -m http.server -d {folder} shows it at http://127.0.0.1:8000")
