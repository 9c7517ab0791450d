"""A force by error and speed follows the motion of mass, spring and damper where its gains are high enough."""

import numpy as np
import pytest

from baselines.bench.evaluation import evaluate
from baselines.named import make_controller
from birthsim_env import Parameters

RIG = Parameters()


def settled(name: str, **options: float) -> float:
    law = make_controller(name, RIG, **options)
    found = evaluate("BirthSIM/Circle-v2", law, name, 4, 0, progress=False, randomize=True, duration=3.0)
    assert not any(found.lost)
    return float(np.median(found.metrics["settled_rms"]))


def test_it_follows_and_less_well_where_it_is_soft() -> None:
    shut, soft, stiff = settled("shut-valves"), settled("force-pd", bandwidth=15.0), settled("force-pd")
    assert stiff < 0.5 * soft
    assert soft < 0.7 * shut


@pytest.mark.parametrize("gain", ["bandwidth", "force_rate"])
def test_a_gain_without_a_sign_is_refused(gain: str) -> None:
    with pytest.raises(ValueError, match=f"{gain} = -1.*; allowed: a positive number"):
        make_controller("force-pd", RIG, **{gain: -1.0})
