"""Pieces on a Ray cluster of loopback: the same bytes as with joblib, failures by name, a worker that dies, evaluations."""

import json
import os
import socket
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from baselines.bench.evaluation import merged
from baselines.named import make_controller
from baselines.work.side_by_side import side_by_side
from baselines.work.tasks import Task, run_tasks
from birthsim_build.device.evaluation import evaluate_on
from birthsim_env import Parameters


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """The address of a head with two workers, which Ray's own command has started."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    # Ray reads it when it is imported, and would take this machine's other address instead of loopback's.
    os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"
    ray = str(Path(sys.executable).with_name("ray"))
    start = [
        *("start", "--head", "--node-ip-address=127.0.0.1", f"--port={port}", "--num-cpus=2", "--include-dashboard=false"),
        *("--disable-usage-stats", f"--temp-dir={tmp_path_factory.mktemp('ray')}"),
    ]
    subprocess.run([ray, *start], check=True, capture_output=True)
    yield f"ray:127.0.0.1:{port}"
    subprocess.run([ray, "stop", "--force"], check=True, capture_output=True)


def files(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_files_are_those_of_joblibs_processes(cluster, tmp_path):
    tasks = [Task(f"deep/{k}", json.loads, {"s": '{"a": 1}' if k != 3 else "{"}) for k in range(8)]
    found = {name: run_tasks(tasks, tmp_path / name, 2, "work", where) for name, where in (("joblib", None), ("ray", cluster))}
    assert found["ray"] == found["joblib"]
    assert list(found["ray"][1]) == ["deep/3"]
    assert files(tmp_path / "ray") == files(tmp_path / "joblib")
    assert len(files(tmp_path / "ray")) == 7


def test_an_evaluation_has_the_same_bytes(cluster, tmp_path):
    world = ("--env", "BirthSIM/Probe-v3", "--controller", "backstepping", "pid", "--episodes", "4")
    for name, workers in (("joblib", ("--jobs", "2")), ("ray", ("--cluster", cluster))):
        command = [sys.executable, "-m", "birthsim", "evaluate", *world, "--out", str(tmp_path / name), *workers]
        subprocess.run(command, check=True, capture_output=True)
    for name in ("evaluation.csv", "evaluation.json", "evaluation.md"):
        assert (tmp_path / "ray" / name).read_bytes() == (tmp_path / "joblib" / name).read_bytes()


def test_two_devices_in_two_workers_are_one(cluster):
    law = make_controller("admittance-backstepping", Parameters())
    world = {"sensors": "lab", "randomize": True, "duration": 0.3}
    run, parts = partial(evaluate_on, "host", "BirthSIM/Circle-v2", law, "law", **world), {}
    side_by_side(run, [(3, 0), (4, 3)], 2, parts.__setitem__, cluster)
    assert json.dumps(merged([parts[0], parts[1]], "law").to_dict()) == json.dumps(run(7, 0).to_dict())


def test_what_a_piece_raises_is_raised_here(cluster):
    with pytest.raises(ZeroDivisionError):
        side_by_side(divmod, [(1, 1), (1, 0)], 2, lambda number, result: None, cluster)


def test_a_worker_that_dies_is_an_error_that_says_so(cluster):
    with pytest.raises(OSError, match="a worker of the cluster has died"):
        side_by_side(os._exit, [(1,)], 2, lambda number, result: None, cluster)


def test_where_no_cluster_answers_it_says_so():
    with pytest.raises(ValueError, match=r"--cluster 'ray:127.0.0.1:1': no cluster answers there .*; allowed: "):
        side_by_side(divmod, [(1, 1)], 2, lambda number, result: None, "ray:127.0.0.1:1")
