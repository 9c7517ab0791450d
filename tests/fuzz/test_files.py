"""Files that the project writes and reads again: rigs, trainings' configurations, recordings, pieces of work, tuned gains."""

import json
import struct
import tomllib
import zlib
from functools import cache

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from agents.training.configuration import FOLDER, load_configuration
from baselines.work.tasks import Task, run_tasks
from birthsim.commands.tune import start_of
from birthsim_env import Parameters
from birthsim_live.logs.recording import load_recording
from tests.fuzz.rigs import odd_rig, run_a_little
from tests.fuzz.strategies import composite, damaged, json_texts, sampled, toml_texts
from tests.fuzz.watched import MEMORY, cases, watched
from tests.live.recordings.made import events_of, example, header_of

RANGES = {"randomize": {"mechanics.mass": [2.0, 5.0], "cylinder1.coulomb_friction": [6.0, 25.0]}}
RIGS = [
    Parameters().to_dict(),
    {"mechanics": {"mass": 9.0}, "cylinder1": {"stroke": 0.3}, **RANGES},
    *map(odd_rig, range(4)),
]
CONFIGURATIONS = [tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.toml"))]
GAINS = {"gains": {"bandwidth": 60.0, "friction_fraction": 0.5}, "cost": 1.0, "parts": {}}
BOUNDS = {"bandwidth": (10.0, 90.0), "friction_fraction": (0.0, 1.0)}


@cache
def default_runs():
    """What is compiled meanwhile counts for no example."""
    for law in ("lugre", "coulomb", "elasto_plastic"):
        run_a_little(Parameters().replace({"friction.law": law}), randomize="plant")


@cases
@given(content=toml_texts(RIGS), drawn=st.booleans())
def test_a_rig(content, drawn):
    default_runs()
    with watched("our_rig.toml") as case:
        path = case.folder / "our_rig.toml"
        path.write_bytes(content)
        rig = Parameters.from_toml(path)
        case.names = ()
        run_a_little(rig, randomize=drawn and "plant")


@cases
@given(content=toml_texts(CONFIGURATIONS))
def test_a_configuration(content):
    with watched("ours.toml") as case:
        path = case.folder / "ours.toml"
        path.write_bytes(content)
        load_configuration(path)


def chunk(content, digest=0):
    content = zlib.compress(content, 1)
    return struct.pack("<II", len(content), zlib.crc32(content) ^ digest) + content


@cache
def recorded():
    """What a recording says first, its events, its rows, and a chunk that unpacks to more than is allowed."""
    return header_of(Parameters()), {"events": events_of(40)}, example(40), chunk(bytes(MEMORY + 2**25))


@composite
def odd_rows(draw, rows):
    match draw(sampled(("as they are", "fewer", "type", "columns", "numbers"))):
        case "fewer":
            rows = rows[: draw(st.integers(0, 2))]
        case "type":
            rows = rows.astype(draw(sampled(("f4", ">f8", "i8", "c16", "U8"))))
        case "columns":
            rows = rows[:, : draw(st.integers(0, 4))]
        case "numbers":
            rows = rows.copy()
            rows.flat[draw(st.integers(0, rows.size - 1))] = draw(sampled((np.nan, np.inf, -1e308, 1e30, 0.0)))
    return rows.tobytes()


@composite
def recordings(draw):
    header, events, rows, bomb = recorded()
    first = draw(sampled([json.dumps(header).encode()]) | json_texts(header))
    then = draw(sampled([json.dumps(events).encode()]) | json_texts(events))
    chunks = [chunk(first + b"\n"), chunk(then + b"\n" + draw(odd_rows(rows)))]
    match draw(sampled((*[""] * 6, "bomb", "digest", "order", "length", "damage", "damage"))):
        case "bomb":
            chunks.append(bomb)
        case "digest":
            chunks[draw(st.integers(0, 1))] = chunk(b"{}\n", digest=1)
        case "order":
            chunks.reverse()
        case "length":
            chunks.append(struct.pack("<II", 2**32 - 1, 0))
        case "damage":
            return draw(damaged(b"".join(chunks)))
    return b"".join(chunks)


@cases
@given(content=recordings())
def test_a_recording(content):
    with watched("ours.rec") as case:
        path = case.folder / "ours.rec"
        path.write_bytes(content)
        recording = load_recording(path)
        case.names = ()
        assert len(recording.rows) == len(recording.second) > 0
        assert all(0 <= event["row"] < len(recording.rows) for event in recording.events)


def worked(seed):
    return {"mean": 1.0, "values": [float(seed)]}


def run(folder):
    results, failures = run_tasks([Task("piece", worked, {"seed": 1})], folder, 1, "pieces")
    assert not failures
    assert results == {"piece": {"mean": 1.0, "values": [1.0]}}


@cache
def piece(folder):
    """Name and content of a complete piece as it is written."""
    run(folder)
    (path,) = folder.glob("piece-*.json")
    return path.name, json.loads(path.read_text(encoding="utf-8"))


@cases
@given(data=st.data())
def test_a_piece_of_work(data, tmp_path_factory):
    """Whatever it is, the piece is done again or taken, and the results are the same."""
    name, content = piece(tmp_path_factory.getbasetemp())
    text = data.draw(json_texts(content))
    with watched() as case:
        (case.folder / name).write_bytes(text)
        run(case.folder)
    assert case.refused == ""


@cases
@given(content=json_texts(GAINS))
def test_gains(content):
    with watched("gains.json") as case:
        path = case.folder / "gains.json"
        path.write_bytes(content)
        start = start_of(path, BOUNDS)
        assert all(np.isfinite(value) for value in start.values())
