"""Environments on a device: the code of a GPU's thread run by this processor gives the bits of the native environment."""

import copy
import json
import sys
import types
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from baselines import evaluate, make_controller
from baselines.controller import PlainController
from birthsim_build.device import machine
from birthsim_build.device.evaluation import evaluate_on
from birthsim_env import ForceProfile, Parameters, Trajectory
from tests.build.loops import SOFT
from tests.build.targets import imported, need_threads
from tests.oracles.golden import fingerprints

SEED = 2_100_000
CIRCLE, RESIDUAL = "BirthSIM/Circle-v2", "BirthSIM/CircleResidual-v2"
OFTEN = ("circle, ideal, openings", "circle, ideal, residual", "circle, lab, admittance-backstepping")
"""Rows of fingerprints that a commit runs on a device; where a controller is outside of the program, all have one code."""


@pytest.fixture(autouse=True)
def _threads_run_here():
    need_threads()


def made(device, name=CIRCLE, lanes=7, **arguments):
    return gymnasium.make_vec(name, num_envs=lanes, randomize=True, device=device, **arguments)


def bits(value):
    """What an environment returns, in its own order, with type, shape and bytes of every array."""
    if isinstance(value, dict):
        return {name: bits(one) for name, one in value.items()}
    if isinstance(value, tuple) or (isinstance(value, np.ndarray) and value.dtype.hasobject):
        return [bits(one) for one in value]
    value = value.get() if type(value).__module__.startswith("cupy") else value
    return None if value is None else (type(value), value.dtype, value.shape, value.tobytes())


def assert_equal(one, other):
    assert bits(one) == bits(other)


def assert_same_refusal(words, *runs):
    said = []
    for run in runs:
        with pytest.raises(ValueError, match=words) as refused:
            run()
        said.append(str(refused.value))
    assert said[0] == said[1]


def assert_same_run(here, there, steps, **options):
    rng = np.random.default_rng(2)
    assert_equal(*(env.reset(seed=SEED, options=options) for env in (here, there)))
    for _ in range(steps):
        actions = rng.uniform(-0.3, 0.3, here.action_space.shape)
        assert_equal(here.step(actions), there.step(actions))
    assert_equal(*((env.plant_state, env.measurement.pressures, env.reference.rows) for env in (here, there)))


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
@pytest.mark.parametrize(("mode", "staggered"), [("NextStep", False), ("NextStep", True), ("SameStep", True)])
@pytest.mark.parametrize(("name", "sensors"), [(CIRCLE, "ideal"), ("BirthSIM/Forceps-v2", "honest"), (RESIDUAL, "lab")])
def test_the_bits_of_the_native_environment(mode, staggered, name, sensors, device):
    shared = {"sensors": sensors, "autoreset_mode": mode, "max_episode_steps": 4}
    assert_same_run(made("cpu", name, **shared), made(device, name, **shared), 11, staggered=staggered)


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
def test_lanes_that_wait_begin_where_they_are_told(device):
    envs = [made(place, autoreset_mode="Disabled", max_episode_steps=2) for place in ("cpu", device)]
    mask = np.arange(7) % 2 == 0
    for env in envs:
        env.reset(seed=[5, 3, None, 8, 1, 0, 2], options={"staggered": True})
        env.step(np.zeros((7, 4)))
        with pytest.raises(ValueError, match=r"lanes \[4, 5, 6\] have ended; allowed: reset"):
            env.step(np.zeros((7, 4)))
    outcomes = [env.reset(options={"reset_mask": mask | (np.arange(7) > 3), "position": (0.51, 0.01)}) for env in envs]
    for ours in (slice(2), slice(3, None)):  # lane 2 drew its own seed
        assert_equal(*(seen[ours] for seen, _ in outcomes))


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
@pytest.mark.parametrize(
    "row", [pytest.param(row, marks=() if row in OFTEN else pytest.mark.weekly) for row in fingerprints.rows()]
)
def test_the_stored_fingerprints(row, device):
    stored = json.loads(fingerprints.FILE.read_text(encoding="utf-8"))
    assert fingerprints.fingerprint(*fingerprints.rows()[row], device=device) == stored[row]


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
def test_tensors_are_taken_without_a_copy(device):
    torch = imported("torch")
    here, there = made("cpu"), made(device)
    seen, _ = there.reset(seed=SEED)
    here.reset(seed=SEED)
    tensor = torch.from_dlpack(seen)
    assert tensor.data_ptr() == machine.machine_named(device).address(seen)
    actions = torch.linspace(-0.5, 0.5, 28, dtype=torch.float32).reshape(7, 4)
    assert_equal(here.step(actions.numpy())[0], there.step(actions.to(tensor.device))[0])


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
@pytest.mark.parametrize("wrong", [np.zeros((7, 3)), np.full((7, 4), np.nan), np.full((7, 4), 1.1), "forward"])
def test_wrong_actions_are_refused_in_the_same_words(wrong, device):
    envs = [made(place) for place in ("cpu", device)]
    for env in envs:
        env.reset(seed=SEED)
    assert_same_refusal("action", *(partial(env.step, wrong) for env in envs))


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
def test_a_law_without_gains_is_explained_in_the_same_words(device):
    envs = [made(place, RESIDUAL, stiffness=SOFT) for place in ("cpu", device)]
    for env in envs:
        env.reset(seed=SEED)
    assert_same_refusal("10", *(partial(env.step, np.zeros(env.action_space.shape)) for env in envs))
    runs = evaluate, partial(evaluate_on, device)
    assert_same_refusal("10", *(partial(run, CIRCLE, law("backstepping"), "law", 2, SEED, stiffness=SOFT) for run in runs))


class Blow(ForceProfile):
    """A hand that throws some lanes out of their range."""

    def knots(self, rng):
        return [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.101, *rng.uniform(-600, 600, 2))]


def law(name="admittance-backstepping"):
    return make_controller(name, Parameters())


@pytest.mark.slow
@pytest.mark.usefixtures("in_one_code")
@pytest.mark.parametrize(("lanes", "world"), [(33, {}), (300, {"user_force": Blow()})])
def test_an_evaluation_measures_the_same(lanes, world, device):
    shared = {"sensors": "lab", "randomize": True, "duration": 0.6, **world}
    here = evaluate(CIRCLE, law(), "law", lanes, SEED, False, **copy.deepcopy(shared))
    there = evaluate_on(device, CIRCLE, law(), "law", lanes, SEED, False, **copy.deepcopy(shared))
    # JSON writes every bit of a number, and NaN as NaN.
    assert json.dumps(here.to_dict()) == json.dumps(there.to_dict())
    assert_equal(np.concatenate(here.traces, axis=1), np.concatenate(there.traces, axis=1))
    assert bool(world) == (0 < sum(here.lost) < lanes)
    assert 0.0 < there.cost < 1e6


class Still(Trajectory):
    def sample(self, time):
        return np.repeat([[0.5], *[[0.0]] * 7], len(time), axis=1)


class Asleep(PlainController):
    """A user's controller."""


def test_what_no_device_does_is_refused_by_name(monkeypatch):
    with pytest.raises(ValueError, match=r"reference = Still, in Python; allowed on a device: what is compiled"):
        made("host", reference=Still())
    with pytest.raises(ValueError, match=r"controller = Asleep, in Python; allowed on a device: what is compiled"):
        evaluate_on("host", CIRCLE, Asleep(lambda measurement, reference: 0.0), "asleep", 2, SEED)
    with pytest.raises(ValueError, match=r"device = 'cuda'; allowed: 'cpu'; birthsim_build\.device\.evaluation\.evaluate_on"):
        evaluate(CIRCLE, law(), "law", 2, SEED, device="cuda")
    with pytest.raises(ValueError, match=r"device = 'gpu'; allowed: .*cpu.*cuda"):
        made("gpu")
    with pytest.raises(ValueError, match=r"render_mode, with device = 'host', = 'rgb_array'; allowed: None"):
        made("host", render_mode="rgb_array")
    monkeypatch.setitem(sys.modules, "cupy", None)
    with pytest.raises(ValueError, match=r"'cuda' needs NVIDIA's driver and the extra: pip install -e '.\[cuda\]'"):
        made("cuda")
    env = made("host")
    with pytest.raises(RuntimeError, match=r"step\(\) before reset\(\)"):
        env.step(np.zeros((7, 4)))
    with pytest.raises(NotImplementedError, match=r"get_state\(\) of lanes on a device"):
        env.unwrapped.get_state()


class There(np.ndarray):
    """An array that does not mix with NumPy's, as CuPy's do not."""

    def __array_ufunc__(self, ufunc, method, *inputs, out=None, **more):
        for one in (*inputs, *(out or ())):
            if type(one) is np.ndarray and one.ndim:
                raise TypeError(f"{ufunc.__name__} of an array here and one there")
        bare = [np.asarray(one) if isinstance(one, There) else one for one in inputs]
        more |= {} if out is None else {"out": tuple(np.asarray(one) for one in out)}
        found = getattr(ufunc, method)(*bare, **more)
        return out[0] if out else np.asarray(found).view(There)

    def __setitem__(self, where, value):
        for one in (*(where if isinstance(where, tuple) else (where,)), value):
            if type(one) is np.ndarray and one.ndim:
                raise TypeError("an array here in one there")
        super().__setitem__(where, value)

    @property
    def data(self):
        return types.SimpleNamespace(ptr=self.ctypes.data)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_what_is_asked_of_cupy(monkeypatch, mode):
    """With arrays that are in this memory, and kernels that are the host's."""
    compiled, asked = machine._compiled, []

    def compile_here(functions, target, space, ending):
        if target != "ptx":
            return compiled(functions, target, space, ending)
        asked.append((functions, space))
        return b"PTX"

    class RawKernel:
        def __init__(self, path, name):
            self.path, self.name = path, name

        def compile(self):
            assert Path(self.path).read_bytes() == b"PTX"
            self.run = machine.Host().load(*asked[-1])

        def __call__(self, grid, block, arguments):
            assert all(type(one) is np.int64 for one in arguments)
            self.run(self.name.removeprefix("birthsim_"), grid[0] * block[0], *map(int, arguments))

    def there_by(made):
        return lambda *given, **named: made(*given, **named).view(There)

    alike = (np.zeros, np.asarray, np.array, np.arange, np.argwhere, np.clip, np.flatnonzero, np.concatenate)
    cupy = types.SimpleNamespace(**{made.__name__: there_by(made) for made in alike}, asnumpy=np.array)
    cupy.RawModule = lambda path: types.SimpleNamespace(get_function=lambda name: RawKernel(path, name))
    cupy.cuda = types.SimpleNamespace(runtime=types.SimpleNamespace(getDeviceCount=lambda: 1))
    monkeypatch.setitem(sys.modules, "cupy", cupy)
    monkeypatch.setattr(machine, "_compiled", compile_here)
    here, there = (made(device, autoreset_mode=mode, max_episode_steps=3) for device in ("cpu", "cuda"))
    here.reset(seed=SEED)
    seen, _ = there.reset(seed=SEED, options={"reset_mask": np.ones(7, dtype=bool)})
    assert type(seen) is There
    actions = np.random.default_rng(2).uniform(-0.3, 0.3, (7, 4))
    for _ in range(7):
        for one, other in zip(here.step(actions)[:4], there.step(actions.view(There))[:4], strict=True):
            assert type(other) is There
            assert_equal(one, np.array(other))
    # Gradients, from the middle of an episode on.
    recorders = [env.unwrapped.record() for env in (here, there)]
    for env, given in ((here, actions), (there, actions.view(There))):
        env.step(given)
    ones = {"reward": np.ones(7), "motion": np.ones((4, 7)), "observation": np.ones(here.observation_space.shape)}
    found = recorders[0].taken()(**ones), recorders[1].taken()(**{name: one.view(There) for name, one in ones.items()})
    for one, other in zip(*found, strict=True):
        assert type(other) is There
        assert_equal(one, np.array(other))
