"""Many lanes begin at once with the same numbers, to the last bit, as one by one with NumPy's generators."""

import copy

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from birthsim_env import Circle, FixedTarget, StiffnessSchedule
from birthsim_env.parts import courses
from birthsim_env.parts.drawn.randomization import draw_parameters
from birthsim_env.parts.drawn.seeding import STREAMS, draw, stream, stream_key, vectorised, whole
from birthsim_env.parts.drawn.streams import TOGETHER, Streams, begin, worlds
from birthsim_env.parts.hands.user_forces import ForceProfile, Ramp
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import parameter_column
from birthsim_env.registry import names
from birthsim_env.simulation import Simulation

SEEDS = st.one_of(st.sampled_from([0, 1, 2**32 - 1, 2**32, 2**64 - 1]), st.integers(0, 2**64 - 1))
NUMBERS = st.floats(-1e6, 1e6)
CALLS = st.one_of(
    st.builds(
        lambda a, b, size: ("uniform", min(a, b), max(a, b), size), NUMBERS, NUMBERS, st.sampled_from([(), (3,), (2, 4)])
    ),
    st.just(("integers", 2**64, np.uint64)),
)


def both(seeds, episodes, name):
    ours = Streams(seeds, np.array(episodes), name)
    return ours, [stream(seed, episode, name) for seed, episode in zip(seeds, episodes, strict=True)]


def assert_alike(ours, theirs, calls):
    for method, *arguments in calls:
        options = {"dtype": arguments.pop()} if arguments[-1] is np.uint64 else {}
        drawn, *expected = (getattr(one, method)(*arguments, **options) for one in (ours, *theirs))
        np.testing.assert_array_equal(drawn, np.stack(expected, axis=-1))


@settings(max_examples=200)
@given(
    st.lists(SEEDS, min_size=1, max_size=5), st.integers(0, 2**32 - 5), st.sampled_from(STREAMS), st.lists(CALLS, max_size=12)
)
def test_any_calls_in_any_order_give_what_numpy_gives(seeds, episode, name, calls):
    assert_alike(*both(seeds, [episode + k for k in range(len(seeds))], name), calls)


@pytest.mark.parametrize(("seeds", "episodes"), [([2**64, 3, 10**50], [0, 1, 2]), ([5, 6], [2**32, 2**40])])
def test_seeds_and_episodes_of_any_size_are_served(seeds, episodes):
    calls = [("uniform", 2.0, 3.0, (2,)), ("integers", 2**64, np.uint64), ("uniform", 0.0, 4.0)]
    assert_alike(*both(seeds, episodes, "sensors"), calls)


def test_whole_numbers_are_alike_and_the_same_for_one_lane_and_many():
    ours, theirs = both(list(range(3000)), [0] * 3000, "user_force")
    drawn = whole(-2, 3, ours)
    assert drawn.tolist() == [whole(-2, 3, one) for one in theirs]
    counts = [(drawn == value).sum() for value in (-2, -1, 0, 1, 2)]
    assert sum(counts) == 3000
    # No count is off by more than 4.5 standard deviations.
    assert np.abs(np.array(counts) - 600).max() < 4.5 * np.sqrt(600 * 0.8)


def test_every_seed_episode_and_part_has_a_stream_key_its_own():
    keys = {
        stream_key(seed, episode, name)
        for seed in (0, 1, 2**64 - 1, 2**64, 2**64 + 1)
        for episode in (0, 1, 2**40)
        for name in STREAMS
    }
    assert len(keys) == 5 * 3 * len(STREAMS)
    assert all(0 <= word < 2**64 for key in keys for word in key)


def test_the_generators_start_where_the_streams_do():
    ours, theirs = both([3, 4], [1, 2], "reference")
    drawn = ours.uniform()
    assert [one.random() for one in ours.generators()] == [one.random() for one in theirs] == drawn.tolist()


RANGES = {
    "plant": True,
    "bores": {"cylinder1.piston_diameter": (0.022, 0.03), "cylinder2.rod_diameter": (0.008, 0.012)},
    "bores and volume": {"cylinder2.piston_diameter": (0.022, 0.03), "chambers.dead_volume": (2e-5, 3e-5)},
    "air and valves": {
        "air.supply_pressure": (6e5, 8e5), "air.temperature": (280.0, 300.0), "valves.leakage_ratio": (0.0, 0.01),
        "valves.sonic_conductance": (3e-9, 5e-9), "friction.breakaway_ratio": (0.5, 0.8), "friction.static_ratio": (1.0, 2.0),
    },
}  # fmt: skip


PAST = ("_state", "impacts", "_queue", "_shown", "_arrived", "_passed", "_late", "_readings")
"""What looking leaves."""


def arrays(simulation: Simulation):
    """Everything that a new episode draws, per part."""
    parts = (simulation.plant, simulation.trajectory, simulation.user_force, simulation.stiffness, simulation.sensors)
    for part in parts:
        for name, value in vars(part).items():
            if isinstance(value, np.ndarray) and name not in PAST:
                yield f"{type(part).__name__}.{name}", value


def begin_one_by_one(simulation: Simulation, lanes, seeds, episodes):
    """As it was before lanes began together, with NumPy's generators."""
    for lane in lanes:
        world = {name: stream(seeds[lane], int(episodes[lane]), name) for name in STREAMS}
        if simulation.ranges:
            drawn = draw_parameters(simulation.parameters, simulation.ranges, world["parameters"])
            simulation.plant.lane_parameters[:, lane] = parameter_column(drawn)
        simulation.trajectory.begin(lane, world["reference"])
        simulation.user_force.begin(lane, world["user_force"])
        simulation.stiffness.begin(lane, world["stiffness"])
        simulation.sensors.begin(lane, world["sensors"])


CASES = [
    *(
        {"scenario": name, "randomize": varied, "sensors": "lab"}
        for name in names("scenario")
        for varied in (False, True, "scenario")
    ),
    *({"scenario": "circle", "user_force": hand, "randomize": varied} for hand in names("hand") for varied in (False, True)),
    *({"scenario": "probe", "randomize": ranges} for ranges in RANGES.values()),
    {"scenario": "circle", "user_force": ForceProfile([(0, 0, 0), (1.0, 3.0, 4.0), (1.0, 0, 0)]), "randomize": True},
    {"scenario": "circle", "stiffness": StiffnessSchedule((0.0, 1.0), (2000.0, 3000.0), ((4000.0, 4600.0),) * 2, (2300.0,) * 2,
      ((1000.0, 2000.0),) * 2, ((-500.0, 500.0),) * 2)},
]  # fmt: skip


def said(case):
    """A case in words that are the same in every process."""
    plain = (str, bool, int, dict)
    return ", ".join(f"{name} {value if isinstance(value, plain) else type(value).__name__}" for name, value in case.items())


@pytest.mark.parametrize("case", CASES, ids=said)
def test_lanes_begin_together_as_they_begin_one_by_one(case):
    name, lanes = environment_id(case["scenario"]), 9
    arguments = {key: value for key, value in case.items() if key != "scenario"}
    envs = [gymnasium.make_vec(name, num_envs=lanes, **copy.deepcopy(arguments)).unwrapped for _ in range(2)]
    together, single = (env.simulation for env in envs)
    seeds, episodes = [2**40 * k + 7 for k in range(lanes)], np.zeros(lanes, dtype=np.int64)
    for mask in (np.ones(lanes, dtype=bool), np.arange(lanes) % 3 == 0, np.arange(lanes) == 8, np.ones(lanes, dtype=bool)):
        together.begin(mask, seeds, episodes, 2.0)
        begin_one_by_one(single, np.flatnonzero(mask).tolist(), seeds, episodes)
        for (key, ours), (_, theirs) in zip(arrays(together), arrays(single), strict=True):
            np.testing.assert_array_equal(ours, theirs, err_msg=key)
        episodes[mask] += 1


def test_more_lanes_than_begin_together():
    count = TOGETHER + 100
    envs = [gymnasium.make_vec("BirthSIM/Descent-v2", num_envs=n, randomize=True, sensors="lab").unwrapped for n in (count, 3)]
    chosen = [0, TOGETHER - 1, count - 1]
    envs[0].reset(seed=50), envs[1].reset(seed=[50 + lane for lane in chosen])
    for (key, many), (_, values) in zip(*(arrays(env.simulation) for env in envs), strict=True):
        if many.shape[-1] == count:
            np.testing.assert_array_equal(many[..., chosen], values, err_msg=key)


def new():
    """Three lanes, and their streams of hands."""
    ((lanes, streams),) = worlds(np.arange(3), [11, 12, 13], np.zeros(3, dtype=np.int64))
    assert lanes.tolist() == [0, 1, 2]
    return lanes, streams["user_force"]


def test_a_users_own_begin_is_called_lane_by_lane_with_numpys_generator():
    class Own(Circle):
        def begin(self, lane, rng):
            assert isinstance(lane, int)
            assert isinstance(rng, np.random.Generator)
            super().begin(lane, rng)
            self._own[2, lane] += rng.normal()

    own, circle = Own(radius=(0.03, 0.1)), Circle(radius=(0.03, 0.1))
    for part in (own, circle):
        part.prepare(3), begin(part, *new())
    for lane, seed in enumerate((11, 12, 13)):
        rng = stream(seed, 0, "user_force")
        radius = rng.uniform(0.03, 0.1)
        assert circle._own[2, lane] == radius
        assert own._own[2, lane] == radius + rng.normal()


@pytest.mark.parametrize("base", [ForceProfile, Ramp])
def test_a_users_own_knots_are_drawn_lane_by_lane(base):
    class Own(base):
        def knots(self, rng):
            assert isinstance(rng, np.random.Generator)
            before = super().knots(rng)
            assert all(type(number) is float for number in before[-1])
            return [*before, (50.0, rng.normal(), 0.0), *([(51.0, 0.0, 0.0)] * int(rng.integers(3)))]

    own, built_in = Own(), base()
    for part in (own, built_in):
        part.prepare(3), begin(part, *new())
    for lane, seed in enumerate((11, 12, 13)):
        rng = stream(seed, 0, "user_force")
        before = np.array(base().knots(rng))
        np.testing.assert_array_equal(own._knots[: len(before), :, lane], before)
        np.testing.assert_array_equal(built_in._knots[: len(before), :, lane], before)
        assert own._knots[len(before), 1, lane] == rng.normal()
        assert own._counts[lane] == len(before) + 1 + rng.integers(3)


def test_knots_of_many_lanes_are_refused_by_the_first_that_is_wrong():
    class Back(Ramp):
        @vectorised
        def knots(self, rng):
            return [(1.0, 0.0, 0.0), (0.5, draw(self.amplitude, rng), 0.0)]

    hand = Back(amplitude=(1.0, 2.0))
    hand.prepare(3)
    size = stream(11, 0, "user_force").uniform(1.0, 2.0)
    with pytest.raises(ValueError, match=rf"Back\.knots\(rng\) = \[.*\(0\.5, {size!r}, 0\.0\)\]; allowed: finite"):
        begin(hand, *new())


def test_only_the_lanes_that_begin_are_sampled(monkeypatch):
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=50, randomize=True).unwrapped
    env.reset(seed=0)
    sizes = []
    check = courses._check
    monkeypatch.setattr(courses, "_check", lambda *given: sizes.append(given[1].shape[1]) or check(*given))
    env.reset(options={"reset_mask": np.arange(50) < 2})
    assert sum(sizes) == 2 * courses.CHECKS


@pytest.mark.parametrize("part", ["reference", "stiffness"])
def test_a_users_own_sample_is_the_one_that_is_checked(part):
    class Away(FixedTarget):
        def sample(self, time):
            return super().sample(time) + np.where(time > 2.0, 1.0, 0.0)

    class Soft(StiffnessSchedule):
        def sample(self, time):
            return super().sample(time) * np.where(time > 2.0, -1.0, 1.0)

    own = {"reference": Away(), "stiffness": Soft()}[part]
    env = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=3, **{part: own})
    words = {"reference": r"reference at 2\.\d+ s: .* unreachable", "stiffness": r"stiffness\.sample\(time = 2\.\d+ s\) = -"}
    with pytest.raises(ValueError, match=words[part]):
        env.reset(seed=0)


def test_a_reference_on_the_very_border_of_the_workspace_is_allowed():
    """The quick look is undecided there; the exact one decides."""
    env = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=2, reference=FixedTarget((0.7, 0.0)), user_force="sine")
    env.reset(seed=0)
    with pytest.raises(ValueError, match="unreachable"):
        gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=2, reference=FixedTarget((0.7 + 1e-9, 0.0))).reset(seed=0)
