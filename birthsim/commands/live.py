"""birthsim live: the rig in the browser, in real time, to see and to push."""

import socket
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from baselines.controller import RESIDUAL
from birthsim.command_line.settings import CONTROL, MANY, Configured, RigFile, number, whole
from birthsim.serving import need_server, serve
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import names
from birthsim_live.logs.recording import SUFFIX, load_recording
from birthsim_live.rig.folder import Packed, offer, packed_page, write_page
from birthsim_live.server.addresses import host_name, listen


@dataclass(kw_only=True)
class Settings(Configured):
    """A rig in real time in the browser: drag the end effector, change stiffness, scenario, controller, valves and sensors
    while it moves, record it for --replay. Works without internet, for this machine alone.
    """

    replay: Annotated[Path | None, Parameter(metavar="FILE")] = None
    """Play what the page recorded, .rec: pause, seek, slow motion. Or a log, as identify reads it, beside its twin: the rig of
    --parameters in free run under the log's openings and forces."""
    port: Annotated[int | None, whole(0, 65535)] = None
    """Port; 0 takes any that is free. [default: 8000, with --replay 8001]"""
    host: str = "127.0.0.1"
    """Address or name to serve; any but the loopback lets in everybody who can reach it."""
    allowed_host: Annotated[list[str], MANY, Parameter(metavar="NAME...")] = field(default_factory=list)
    """Other names by which the page is opened, behind a published port or a proxy; with them --host may be 0.0.0.0."""
    request_time: Annotated[float, number("S", above=0.0, most=3600.0)] = 10.0
    """Seconds after which a connection is closed whose request has not arrived."""
    parameters: RigFile = None
    controller: Annotated[str | None, Parameter(group=CONTROL, metavar="NAME")] = None
    """Open with it, as pid[bandwidth=60]; your own, path/to/file.py:Class, runs in Python, and the rig waits for it."""
    compare: Annotated[str | None, Parameter(group=CONTROL, metavar="NAME")] = None
    """Open with a second rig under this controller beside the first."""
    policy: Annotated[list[str], MANY, Parameter(group=CONTROL, metavar="DIR...")] = field(default_factory=list)
    """Policies in addition to the shipped ones: folders that birthsim train wrote; the page opens with the first."""
    static: Annotated[Path | None, Parameter(metavar="FOLDER")] = None
    """Only write the page with its rig into this new folder, for any web server."""


def main(settings: Settings) -> None:
    """Serve or write the page, or play a recording."""
    if settings.replay is not None:
        _replay(settings, settings.replay)
    elif settings.static is not None:
        size = write_page(settings.static, _packed(settings, load_parameters(settings.parameters)))
        seen = f"python -m http.server -d {settings.static} shows it at http://127.0.0.1:8000"
        print(f"written to {settings.static}: {size / 1e6:.2f} MB; {seen}")
    else:
        need_server()
        with _listening(settings, 8000) as listening:
            rig = load_parameters(settings.parameters)
            serve(_packed(settings, rig), rig, listening, settings, "birthsim live")


def _listening(settings: Settings, port: int) -> socket.socket:
    """The socket of the settings, on ``port`` unless they name another."""
    settings.allowed_host = [host_name(name) for name in settings.allowed_host]
    return listen(settings.host, port if settings.port is None else settings.port, bool(settings.allowed_host))


def _packed(settings: Settings, rig: Parameters) -> Packed:
    """What the page of a rig is made of, with what it opens with."""
    opens = {"controller": f"{RESIDUAL}:{settings.policy[0]}"} if settings.policy else {}
    opens |= {name: value for name in ("controller", "compare") if (value := getattr(settings, name)) is not None}
    packed = packed_page(rig, settings.policy, opens.values())
    packed.content["opens"] |= opens
    if settings.static is None:
        offer(packed.content, rig, opens.values())
    for name in opens.values():
        allowed = [one["name"] for one in packed.content["hello"]["choices"]["controller"] if "missing" not in one]
        if name not in allowed:
            raise ValueError(f"controller = {shown(name)}; allowed: {', '.join(allowed)}")
    return packed


def _replay(settings: Settings, file: Path) -> None:
    is_log = file.suffix.lower() in names("reader")
    for name in ("controller", "compare", "static", "policy", *(() if is_log else ("parameters",))):
        if getattr(settings, name):
            raise ValueError(f"--{name} with --replay; allowed: without it, a recording has its own rig")
    need_server()
    with tempfile.TemporaryDirectory() as folder:
        if is_log:
            settings.replay = _twin(file, settings.parameters, Path(folder))
        _play(settings, settings.replay or file, file.name)


def _twin(log: Path, parameters: str | None, folder: Path) -> Path:
    """A recording of a log beside the free run of a rig."""
    from baselines.identification.log.log_columns import LogOptions  # these load what identifies
    from birthsim.identification import compare_log, judging_of
    from birthsim_live.logs.twin import write_twin

    found, path = compare_log(log, [parameters], LogOptions(), judging_of()), folder / f"{log.stem}{SUFFIX}"
    write_twin(found.nearest, found.trial, path)
    return path


def _play(settings: Settings, file: Path, name: str) -> None:
    """Serve the page of a recording, which is called ``name``."""
    from birthsim_live.rig.greeting import greeting  # which draws

    with _listening(settings, 8001) as listening:
        recording = load_recording(file)
        packed = packed_page(Parameters())
        # It draws the recording's rig; the one that it could run stands still and is not seen.
        hello = packed.content["hello"]
        drawn = greeting(recording.rig, hello["choices"]["controller"])
        hello |= {**drawn, "defaults": hello["defaults"], "replay": name}
        serve(packed, recording.rig, listening, settings, f"birthsim live --replay {name}, {recording.duration:.1f} s")
