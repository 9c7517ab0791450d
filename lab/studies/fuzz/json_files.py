"""Kinds of JSON files that commands read: of trainings, evaluations, entries of the leaderboard and results of studies."""

import json
import math
from io import BytesIO
from pathlib import Path
from typing import Any

from lab.studies.fuzz.files import loaded, written
from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import Rng, json_bytes


def _trainings(folder: Path) -> dict[str, Any]:
    from agents.policy.seeds import policy_folders
    from agents.reports.card import settings_of
    from agents.reports.learning_curves import learning_curves

    loaded(folder)
    place = policy_folders("probe")[0]
    settings_of(place)
    learning_curves([place])
    content: dict[str, Any] = json.loads((place / "training.json").read_text(encoding="utf-8"))
    return content


def _training(valid: dict[str, Any], rng: Rng, folder: Path, case: Case) -> None:
    from agents.reports.card import settings_of
    from agents.reports.learning_curves import METRICS, learning_curves
    from birthsim_env.physics.rig.parameters import Parameters

    written(case, folder / "training.json", json_bytes(rng, valid))
    (training,) = learning_curves([folder])
    case.names = ()
    for point in (training["law"], *training["curve"]):
        assert all(point[name] is None or math.isfinite(point[name]) for name, _ in METRICS)
    Parameters.from_dict(settings_of(folder)["rig"])


def _evaluations(folder: Path) -> dict[str, Any]:
    from birthsim_env.physics.compiled.sources import ROOT
    from birthsim_live.logs.reading import read_log

    loaded(folder)
    place = ROOT / "lab" / "leaderboard" / "pid.json"
    _write(read_log(place))
    content: dict[str, Any] = json.loads(place.read_text(encoding="utf-8"))
    for result in content["results"]:  # a few episodes, which are faster to change
        for name in ("seeds", "lost", "success", "required_strength_ratio"):
            result[name] = result[name][:2]
        for name in ("episodes", "returns"):
            result[name] = {one: values[:2] for one, values in result[name].items()}
    return content


def _write(log: Any) -> None:
    from baselines.logs.writing import WRITERS

    for writer in WRITERS.values():
        writer(log, BytesIO())


def _evaluation(valid: dict[str, Any], rng: Rng, folder: Path, case: Case) -> None:
    from birthsim_live.logs.reading import read_log

    _write(read_log(written(case, folder / "evaluation.json", json_bytes(rng, valid))))


def _entries(folder: Path) -> dict[str, Any]:
    from lab.studies import leaderboard

    content = _evaluations(folder)
    path = folder / "entry.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    assert leaderboard.against_rules(leaderboard.entry(path), folder) == ""
    return content


def _entry(valid: dict[str, Any], rng: Rng, folder: Path, case: Case) -> None:
    from lab.studies import leaderboard

    said = leaderboard.entry(written(case, folder / "entry.json", json_bytes(rng, valid)))
    case.names = ()
    if problem := leaderboard.against_rules(said, folder):
        raise ValueError(problem)
    leaderboard.row(said, "entry")


def _results(folder: Path) -> dict[str, Any]:
    from lab.engine.results import read_result

    loaded(folder)
    content = read_result("stiffest")
    assert content is not None
    return content


def _result(valid: dict[str, Any], rng: Rng, folder: Path, case: Case) -> None:
    from lab.engine.results import changed, read_result

    path = written(case, folder / "stiffest.json", json_bytes(rng, valid))
    content = read_result(path.stem, folder)
    assert content is not None
    changed(content, ())


JSON_FILES: dict[str, Kind] = {
    "training": Kind(_trainings, _training),
    "evaluation": Kind(_evaluations, _evaluation),
    "entry": Kind(_entries, _entry),
    "result": Kind(_results, _result),
}
