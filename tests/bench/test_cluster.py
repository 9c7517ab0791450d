"""Pieces on a Ray cluster of loopback: the same bytes as with joblib, failures by name, a worker that dies."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from baselines.bench.tasks import run_tasks
from baselines.side_by_side import side_by_side
from tests.bench.test_tasks import fail, made

# Ray reads its settings when it is imported, which the package does when it is needed.
pytestmark = [pytest.mark.weekly, pytest.mark.skipif(find_spec("ray") is None, reason="needs Ray")]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """The address of a head with two workers, which Ray's own command has started."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    ray = [sys.executable, "-m", "ray.scripts.scripts"]
    root = Path(__file__).parent.parent.parent
    # Its workers find this package where a test does.
    # And none of it leaves the loopback interface, which Ray would replace by the address of this machine.
    os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(root), os.environ.get("PYTHONPATH", "")])}
    start = [
        *("start", "--head", "--node-ip-address=127.0.0.1", f"--port={port}", "--num-cpus=2", "--include-dashboard=false"),
        *("--disable-usage-stats", f"--temp-dir={tmp_path_factory.mktemp('ray')}"),
    ]
    subprocess.run([*ray, *start], env=environment, check=True, capture_output=True)
    yield f"ray:127.0.0.1:{port}"
    subprocess.run([*ray, "stop", "--force"], check=True, capture_output=True)


def test_the_files_are_those_of_joblibs_processes(cluster, tmp_path):
    log = tmp_path / "log"
    found = {
        name: run_tasks(made(log, fail, range(8)), tmp_path / name, 2, "work", where)
        for name, where in (("joblib", None), ("ray", cluster))
    }
    assert found["ray"] == found["joblib"]
    assert found["ray"][1] == {"deep/3": "RuntimeError: three is not for me"}
    files = {name: sorted(path for path in (tmp_path / name).rglob("*") if path.is_file()) for name in found}
    assert [path.read_bytes() for path in files["ray"]] == [path.read_bytes() for path in files["joblib"]]
    assert len(files["ray"]) == 7


def test_what_a_piece_raises_is_raised_here(cluster):
    with pytest.raises(ZeroDivisionError):
        side_by_side(divmod, [(1, 1), (1, 0)], 2, lambda number, result: None, cluster)


def test_a_worker_that_dies_is_an_error_that_says_so(cluster):
    with pytest.raises(OSError, match="a worker of the cluster has died"):
        side_by_side(os._exit, [(1,)], 2, lambda number, result: None, cluster)


def test_where_no_cluster_answers_it_says_so():
    with pytest.raises(ValueError, match=r"--cluster 'ray:127.0.0.1:1': no cluster answers there "):
        side_by_side(divmod, [(1, 1)], 2, lambda number, result: None, "ray:127.0.0.1:1")
