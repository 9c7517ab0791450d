"""birthsim live: the rig in the browser, in real time, to see and to push."""

from __future__ import annotations

import argparse
from pathlib import Path

from baselines.about import RESIDUAL
from baselines.commands.shared import run
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import shown
from birthsim_live.commands.serving import add_address, need_server, serve
from birthsim_live.logs.recording import load_recording
from birthsim_live.rig.folder import Packed, packed_page, write_page
from birthsim_live.server.addresses import listen


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="birthsim live",
        description="A rig in real time in the browser: drag the end effector, change stiffness, scenario, controller, "
        "valves and sensors while it moves, record it for --replay. Works without internet, for this machine alone.",
    )
    parser.add_argument(
        "--replay", type=Path, metavar="FILE", help="play what the page recorded, .rec: pause, seek, slow motion"
    )
    add_address(parser)
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument(
        "--controller",
        metavar="NAME",
        help="open with this controller, such as lqr or pid[bandwidth=60]; one of your own, path/to/file.py:Class, runs in "
        "Python, and the rig waits for it",
    )
    parser.add_argument("--compare", metavar="NAME", help="open with a second rig under this controller beside the first")
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
    elif arguments.static is not None:
        size = write_page(arguments.static, _packed(arguments, load_parameters(arguments.parameters)))
        shown = f"python -m http.server -d {arguments.static} shows it at http://127.0.0.1:8000"
        print(f"written to {arguments.static}: {size / 1e6:.2f} MB; {shown}")
    else:
        need_server()
        with listen(arguments.host, 8000 if arguments.port is None else arguments.port) as listening:
            rig = load_parameters(arguments.parameters)
            serve(_packed(arguments, rig), rig, listening, arguments, "birthsim live")


def _packed(arguments: argparse.Namespace, rig: Parameters) -> Packed:
    """What the page of a rig is made of, with what it opens with."""
    opens = {"controller": f"{RESIDUAL}:{arguments.policy[0]}"} if arguments.policy else {}
    opens |= {name: value for name in ("controller", "compare") if (value := getattr(arguments, name)) is not None}
    packed = packed_page(rig, arguments.policy, opens.values())
    packed.content["opens"] |= opens
    if arguments.static is None:
        from birthsim_live.server.controller import offer  # needs the extra

        offer(packed.content, rig, opens.values())
    for name in opens.values():
        allowed = [one["name"] for one in packed.content["hello"]["choices"]["controller"] if "missing" not in one]
        if name not in allowed:
            raise ValueError(f"controller = {shown(name)}; allowed: {', '.join(allowed)}")
    return packed


def _replay(arguments: argparse.Namespace) -> None:
    for name in ("parameters", "controller", "compare", "static", "policy"):
        if getattr(arguments, name):
            raise ValueError(f"--{name} with --replay; allowed: without it, a recording has its own rig")
    need_server()
    from birthsim_live.rig.greeting import greeting  # which draws

    file: Path = arguments.replay
    with listen(arguments.host, 8001 if arguments.port is None else arguments.port) as listening:
        recording = load_recording(file)
        packed = packed_page(Parameters())
        # It draws the recording's rig; the one that it could run stands still and is not seen.
        hello = packed.content["hello"]
        hello |= {**greeting(recording.rig, hello["choices"]["controller"]), "replay": file.name}
        serve(packed, recording.rig, listening, arguments, f"birthsim live --replay {file.name}, {recording.duration:.1f} s")
