"""Kinds of files: each is written by the project, altered or damaged, and read again."""

import json
import struct
import tomllib
import zlib
from functools import cache
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import Rng, damaged, json_bytes, toml_bytes

STEPS = 12


def written(case: Case, path: Path, content: bytes) -> Path:
    """The path of a case's file, written."""
    path.write_bytes(content)
    case.names, case.shown = (path.name,), repr(content[:600])
    return path


def run_a_little(rig: Any, rng: Rng, **arguments: Any) -> None:
    """A few steps of a rig that was accepted: no state is anything but finite behind an observation that is."""
    env: Any = gymnasium.make_vec("BirthSIM/Probe-v2", num_envs=2, parameters=rig, **arguments)
    env.reset(seed=int(rng.integers(2**31)))
    for _ in range(STEPS):
        observation, reward, terminated, *_ = env.step(rng.uniform(-1, 1, (2, 4)))
        if not (np.isfinite(observation).all() and np.isfinite(reward).all()):
            raise FloatingPointError("an observation or reward is not finite")
        if not np.isfinite(env.unwrapped.simulation.plant.state[:, ~terminated]).all():
            raise FloatingPointError("a state is not finite")
        if terminated.any():
            break


def _rig_files(_: Path) -> list[dict[str, Any]]:
    from birthsim_env.physics.rig.parameters import Parameters
    from lab.studies.fuzz.odd_rigs import odd_rig

    rig = Parameters()
    run_a_little(rig, np.random.default_rng(0), randomize="plant", policy_period=0.01)
    for law in ("coulomb", "elasto_plastic"):
        run_a_little(rig.replace({"friction.law": law}), np.random.default_rng(0))
    ranges = {"randomize": {"mechanics.mass": [2.0, 5.0], "cylinder1.coulomb_friction": [6.0, 25.0]}}
    return [rig.to_dict(), {"mechanics": {"mass": 9.0}, "cylinder1": {"stroke": 0.3}, **ranges}, *map(odd_rig, range(4))]


def _rig(files: list[dict[str, Any]], rng: Rng, folder: Path, case: Case) -> None:
    from birthsim_env.physics.rig.parameters import Parameters

    path = written(case, folder / "our_rig.toml", toml_bytes(rng, files[rng.integers(len(files))]))
    rig = Parameters.from_toml(path)
    case.names = ()
    period = rig.electronics.control_period
    run_a_little(rig, rng, policy_period=period * max(1, round(0.01 / period)), randomize=bool(rng.integers(2)) and "plant")


def _configurations(_: Path) -> list[dict[str, Any]]:
    from agents.training.configuration import FOLDER, load_configuration

    load_configuration("circle")
    return [tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.toml"))]


def _configuration(files: list[dict[str, Any]], rng: Rng, folder: Path, case: Case) -> None:
    from agents.training.configuration import load_configuration

    load_configuration(written(case, folder / "ours.toml", toml_bytes(rng, files[rng.integers(len(files))])))


@cache
def _bomb() -> bytes:
    """A chunk of 200 MB, packed where memory is not yet limited."""
    return _chunk(bytes(200 * 2**20))


def _recordings(folder: Path) -> tuple[dict[str, Any], dict[str, Any], np.ndarray[Any, Any], bytes]:
    from birthsim_env.physics.rig.parameters import Parameters
    from tests.live.recordings.made import events_of, example, header_of, write_recording

    rows = example(40)
    _bomb()
    return header_of(Parameters()), {"events": events_of(40)}, rows, write_recording(folder / "one.rec", rows).read_bytes()


def _rows(rng: Rng, rows: np.ndarray[Any, Any]) -> bytes:
    match int(rng.integers(6)):
        case 0:
            return rows[: int(rng.integers(3))].tobytes()
        case 1:
            return rows.astype(rng.choice(["f4", ">f8", "i8", "c16", "U8"])).tobytes()
        case 2:
            return rows[:, : int(rng.integers(5))].tobytes()
        case 3:
            damage = rows.copy()
            damage.flat[rng.integers(damage.size, size=9)] = rng.choice([np.nan, np.inf, -1e308, 1e30, 0.0], size=9)
            return damage.tobytes()
        case _:
            return rows.tobytes()


def _said(rng: Rng, said: dict[str, Any]) -> bytes:
    return json_bytes(rng, said) if rng.random() < 0.6 else json.dumps(said).encode()


def _chunk(content: bytes, digest: int = 0) -> bytes:
    content = zlib.compress(content)
    return struct.pack("<II", len(content), zlib.crc32(content) ^ digest) + content


def _recording(valid: tuple[Any, Any, Any, bytes], rng: Rng, folder: Path, case: Case) -> None:
    from birthsim_live.logs.recording import load_recording

    header, events, rows, content = valid
    if rng.random() < 0.35:
        content = damaged(rng, content)
    else:
        chunks = [_chunk(_said(rng, header) + b"\n"), _chunk(_said(rng, events) + b"\n" + _rows(rng, rows))]
        match int(rng.integers(10)):
            case 0:
                chunks.append(_bomb())
            case 1:
                chunks[int(rng.integers(2))] = _chunk(b"{}\n", digest=1)
            case 2:
                chunks.reverse()
            case 3:
                chunks.append(struct.pack("<II", 2**32 - 1, 0))
        content = b"".join(chunks)
    recording = load_recording(written(case, folder / "ours.rec", content))
    case.names = ()
    assert len(recording.rows) == len(recording.second) > 0
    assert all(0 <= event["row"] < len(recording.rows) for event in recording.events)


def loaded(_: Path) -> None:
    """What the readers of small files need, before memory is limited."""
    import baselines.work.tasks
    from baselines.registry import make_controller
    from birthsim_env.parts.own_parts import trajectory_of
    from birthsim_env.physics.rig.parameters import Parameters

    make_controller("pid", Parameters())
    trajectory_of(lambda time: (0.5, 0.0), 1.0).sample(np.zeros(2))
    baselines.work.tasks.code_stamp(loaded)


def _tasks(folder: Path) -> dict[str, Any]:
    """A complete piece as it is written."""
    loaded(folder)
    _run(folder)
    (path,) = folder.glob("piece-*.json")
    piece: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return {"file": path.name, "piece": piece}


def _run(folder: Path) -> None:
    from baselines.work.tasks import Task, run_tasks

    results, failures = run_tasks([Task("piece", _worked, {"seed": 1})], folder, 1, "pieces")
    assert not failures
    assert results == {"piece": {"mean": 1.0, "values": [1.0]}}


def _task(valid: dict[str, Any], rng: Rng, folder: Path, case: Case) -> None:
    written(case, folder / valid["file"], json_bytes(rng, valid["piece"]))
    _run(folder)


def _worked(seed: int) -> dict[str, Any]:
    return {"mean": 1.0, "values": [float(seed)]}


def _gains(_: Any, rng: Rng, folder: Path, case: Case) -> None:
    from birthsim.commands.tune import start_of

    content = {"gains": {"bandwidth": 60.0, "friction_fraction": 0.5}, "cost": 1.0, "parts": {}}
    bounds = {"bandwidth": (10.0, 90.0), "friction_fraction": (0.0, 1.0)}
    start = start_of(written(case, folder / "gains.json", json_bytes(rng, content)), bounds)
    assert all(np.isfinite(value) for value in start.values())


FILES: dict[str, Kind] = {
    "rig": Kind(_rig_files, _rig),
    "configuration": Kind(_configurations, _configuration),
    "recording": Kind(_recordings, _recording),
    "task": Kind(_tasks, _task),
    "gains": Kind(loaded, _gains),
}
