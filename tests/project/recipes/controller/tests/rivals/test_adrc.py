"""Active disturbance rejection follows the motion of mass, spring and damper, on rigs that its model does not describe."""

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


def test_it_follows_where_its_observer_is_quick_and_less_well_where_it_is_slow() -> None:
    shut, slow, quick = settled("shut-valves"), settled("adrc", observer_bandwidth=0.1), settled("adrc")
    assert quick < 0.3 * slow
    assert slow < 0.3 * shut


@pytest.mark.parametrize("gain", ["bandwidth", "force_rate"])
def test_a_gain_without_a_sign_is_refused(gain: str) -> None:
    with pytest.raises(ValueError, match=f"{gain} = -1.*; allowed: a positive number"):
        make_controller("adrc", RIG, **{gain: -1.0})
