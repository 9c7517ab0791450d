"""Episodes that begin on a device: what is drawn there, and where they start, has the bits of the native environment."""

import re

import gymnasium
import numpy as np
import pytest

from birthsim_build.code.compiler import compile_object
from birthsim_build.code.threads import RUNS
from birthsim_build.device.beginning import beginning_with
from birthsim_build.device.program import program_of
from birthsim_env import Circle, ForceProfile
from birthsim_env.loop.loop import Loop
from birthsim_env.parts.scenarios import environment_id
from tests.build.loops import BEGUN, OFTEN, begun
from tests.build.targets import assert_fusing_changes_nothing, need_threads
from tests.build.test_device import assert_equal, assert_same_run
from tests.build.test_threads import assert_exact

SEED = 2_200_000


def made(device, case, lanes, **more):
    scenario, arguments = BEGUN[case]
    given = {"randomize": True, **arguments, **more}
    return gymnasium.make_vec(environment_id(scenario), num_envs=lanes, device=device, **given)


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
@pytest.mark.parametrize("case", [pytest.param(name, marks=() if name in OFTEN else pytest.mark.weekly) for name in BEGUN])
def test_episodes_begin_with_the_bits_of_the_native_environment(case, device):
    envs = [made(where, case, 33, max_episode_steps=3) for where in ("cpu", device)]
    assert_same_run(*envs, 8, staggered=True)
    # Anywhere that a rail reaches too, by seeds of 64 bits, and again by the seeds of before.
    for given in ({"seed": [2**64 + 16 - k for k in range(33)]}, {"options": {"position": (0.51, 0.0)}}):
        assert_equal(*(env.reset(**given)[0] for env in envs))
    assert_equal(*(env.unwrapped.plant_state for env in envs))


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
@pytest.mark.parametrize("lanes", [1, 1000])
def test_many_and_one(lanes, device):
    assert_same_run(*(made(place, "circle honest", lanes, max_episode_steps=2) for place in ("cpu", device)), 4)


@pytest.mark.slow
@pytest.mark.parametrize(
    "case", ["circle honest", *(pytest.param(name, marks=pytest.mark.weekly) for name in ("noise", "contractions", "options"))]
)
def test_ptx_of_a_beginning_is_exact_and_alone(case, tmp_path):
    need_threads()
    many, other = (begun(case, lanes) for lanes in (3, 2))
    pieces = beginning_with(many)
    program = program_of(pieces, beginning_with(other), pieces.functions)
    compile_object(pieces.functions, "ptx", tmp_path / "code.o", threads=program.threads)
    text = (tmp_path / "code.ptx").read_text()
    assert_exact(text)
    assert re.findall(r"^\.visible \.entry birthsim_(\w+)", text, re.MULTILINE) == list(RUNS)
    if case == "circle honest":  # of which drawing is most
        assert_fusing_changes_nothing(tmp_path, "begin", 50_000)


class Taps(ForceProfile):
    """A user's hand that is compiled, with a number of knots of its own in every episode."""

    def knots(self, rng):
        return [(0.0, 0.0, 0.0), *((0.01 * k, rng.uniform(-20, 20), 0.0) for k in range(1, rng.integers(2, 30)))]


class Wandering(Circle):
    """A user's circle that is compiled, with a centre of its own in every episode."""

    def begin(self, lane, rng):
        super().begin(lane, rng)
        self._own[0, lane] += rng.normal(scale=1e-3)


def test_what_no_device_draws_is_refused_by_name():
    for name, part in {"user_force": Taps(), "reference": Wandering()}.items():
        said = rf"{name} = {type(part).__name__}, drawn in Python; allowed on a device: what draws for all lanes at once"
        with pytest.raises(ValueError, match=said):
            made("host", "circle ideal", 2, **{name: part})
    env = made("host", "nothing drawn", 2)
    with pytest.raises(ValueError, match=r"position = \(2, 0\) m is unreachable"):
        env.reset(seed=0, options={"position": (2.0, 0.0)})


@pytest.mark.parametrize("case", ["circle honest", "nothing drawn"])
def test_stages_begin_a_block_as_a_simulation_does(case):
    lanes = 5
    episodes = begun(case, lanes)
    pieces = beginning_with(episodes)
    numbers = np.arange(3, 3 + lanes)
    episodes.begin_first([SEED + lane for lane in range(lanes)], numbers)
    arrays = pieces.arrays()
    expected = [array.copy() for array in arrays]
    episodes.begin_first([0] * lanes, np.zeros(lanes, dtype=np.int64))
    episodes.forget(np.ones(lanes, dtype=bool))
    words = pieces.beginning[0].memory.view(np.uint64)
    words[0], words[1] = SEED + np.arange(lanes), numbers
    Loop(lanes, pieces.world, pieces.seen, pieces.beginning).run()
    for array, one in zip(arrays, expected, strict=True):
        if array is not pieces.beginning[0].memory:
            assert array.tobytes() == one.tobytes()
