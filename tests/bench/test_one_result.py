"""One episode has one result: however many episodes run beside it."""

import numpy as np
import pytest

from baselines.bench.evaluation import evaluate
from baselines.registry import make_controller
from birthsim_env import Parameters


@pytest.mark.parametrize("name", ["residual", "admittance-backstepping"])
def test_an_episode_does_not_depend_on_how_many_run_beside_it(name):
    """Drawn rigs, lab sensors and friction make a difference in the last bit grow; there is none."""
    options = {"policy": "probe"} if name == "residual" else {}
    traces = []
    for first, episodes in ((7, 1), (7, 2), (0, 33)):
        controller = make_controller(name, Parameters(), **options)
        setting = {"sensors": "lab", "randomize": True, "duration": 1.6, "progress": False}
        result = evaluate("BirthSIM/Probe-v2", controller, name, episodes, first, **setting)
        traces.append(np.concatenate(result.traces, axis=1)[:, result.seeds.index(7)])
    assert np.abs(traces[0]).max() > 1e-5
    assert all(np.array_equal(traces[0], trace) for trace in traces)
