"""JSON that commands and studies read: of trainings, evaluations, entries of the leaderboard and results of studies."""

import json
import math
from functools import cache
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.policy.seeds import policy_folders
from agents.reports.card import settings_of
from agents.reports.learning_curves import METRICS, learning_curves
from baselines.logs.writing import WRITERS
from birthsim_env import Parameters
from birthsim_live.logs.reading import read_log
from lab.engine.results import changed, read_result
from lab.studies.leaderboard import entries as leaderboard
from lab.studies.leaderboard.cards import cards
from lab.studies.leaderboard.records import standings
from tests.evaluated import evaluation_in
from tests.fuzz.strategies import json_texts
from tests.fuzz.watched import cases, watched


def training(path, case):
    (curve,) = learning_curves([path.parent])
    case.names = ()
    for point in (curve["law"], *curve["curve"]):
        assert all(point[name] is None or math.isfinite(point[name]) for name, _ in METRICS)
    Parameters.from_dict(settings_of(path.parent)["rig"])


def evaluation(path, case):
    log = read_log(path)
    for writer in WRITERS.values():
        writer(log, BytesIO())


def entry(path, case):
    said = leaderboard.entry(path)
    case.names = ()
    if problem := leaderboard.against_rules(said, path):
        raise ValueError(problem)
    known = {"entry": said}
    cards(known)
    for one in said["tasks"]:
        assert len(standings(one["task"], known)) <= 1


def result(path, case):
    changed(read_result(path.stem, path.parent), ())


def evaluated():
    with TemporaryDirectory() as folder:
        return json.loads(evaluation_in(Path(folder)).read_text(encoding="utf-8"))


def scored():
    """An entry of one task, which is faster to change."""
    content = json.loads((leaderboard.ENTRIES / "pid.json").read_text(encoding="utf-8"))
    return {**content, "tasks": content["tasks"][:1]}


RESULT = {
    "command": "birthsim study stiffest",
    "commit": "3aeb44ec4468e384e2b6d31c53c293c3f4f9a02a",
    "dirty": False,
    "date": "2026-11-26T08:36:37+00:00",
    "versions": {"python": "3.11.7", "numpy": "2.4.6"},
    "used": {"controller=pid": "baselines.rivals.pid"},
    "sources": {"birthsim_env/state.py": {"take_state": "9eeb256a93e6", "give_state": "02a98f0e4b17"}},
    "seconds": 21.3,
    "settings": {"sampled": True},
    "units": {"controller": "", "mass": "kg"},
    "figures": [["backstepping", 1.5], ["pid", 0.002]],
}
"""Not a stored one, as each of these changes with many commits."""
OLDER = {name: value for name, value in RESULT.items() if name != "used"}

READERS = {
    "training.json": (training, lambda: json.loads((policy_folders("probe")[0] / "training.json").read_text(encoding="utf-8"))),
    "evaluation.json": (evaluation, evaluated),
    "entry.json": (entry, scored),
    "result.json": (result, lambda: RESULT),
    "result_of_files.json": (result, lambda: {**OLDER, "sources": {"birthsim_env/state.py": "9eeb256a93e6"}}),
}


@cache
def valid(name):
    """What is altered; as it is, it is read."""
    read, content = READERS[name][0], READERS[name][1]()
    with watched(name, memory=2**30) as case:
        path = case.folder / name
        path.write_text(json.dumps(content), encoding="utf-8")
        read(path, case)
    assert case.refused == ""
    return content


@pytest.mark.parametrize("name", READERS)
@cases
@given(data=st.data())
def test_json(name, data):
    content = data.draw(json_texts(valid(name)))
    with watched(name) as case:
        path = case.folder / name
        path.write_bytes(content)
        READERS[name][0](path, case)
