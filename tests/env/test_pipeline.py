"""The order of a control period: read, printed and edited by name, in one environment and in many lanes."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from baselines.bench.measures import Measures
from baselines.driving import driving
from birthsim_env import Circle, Parameters
from birthsim_env.loop.pipeline import ORDER, Pipeline, Step
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.actuation import ValveActuation
from birthsim_env.physics.compiled.compilation import kernel

CIRCLE = "BirthSIM/Circle-v2"
STILL = np.zeros(4, np.float32)


@kernel
def pull(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    for i in range(n):
        world.force[0, i], world.force[1, i] = 7.0, -3.0
    return 0


@kernel
def count(world: World, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    for i in range(n):
        world.force[0, i] += 1.0
    return 0


class OwnCircle(Circle):
    def sample(self, time):
        return super().sample(time)


def made(**arguments):
    env = gymnasium.make(CIRCLE, **arguments).unwrapped
    env.reset(seed=1)
    return env


def test_it_is_a_tuple_of_steps_in_order_that_says_when_each_runs():
    for env in (gymnasium.make(CIRCLE, sensors="honest"), gymnasium.make_vec(CIRCLE, num_envs=2, sensors="honest")):
        pipeline = env.unwrapped.pipeline
        assert pipeline.names == ORDER
        assert isinstance(pipeline, tuple)
        assert not pipeline.stops
        assert pipeline[2] is pipeline[2:3][0]
        assert pipeline["plant"].name == "plant"
        assert [step.name for step in pipeline if step.closes] == ["outcome"]
        assert [step.name for step in pipeline if step.part is None] == ["start"]
        begins = ["target", "setpoints", "start", "hand", "jumps", "sensors", "outcome"]
        assert [step.name for step in pipeline if step.begin is not None] == begins


def test_a_group_has_a_step_for_each_stage():
    env = made(actuation=driving(make_controller("backstepping", Parameters()), None), force_sensor=False)
    names = env.pipeline.names
    own = [name for name in names if name.startswith("actuation")]
    assert (own[0], own[-1]) == ("actuation.ask", "actuation.backstepping")
    assert len(env.pipeline.group("actuation")) == len(own) > 2
    assert names[-3:-1] == ("sensors.ideal_stage", "sensors.hide_force")
    assert len(env.pipeline.group("sensors")) == 2
    assert env.pipeline["sensors"].name == "sensors.ideal_stage"


def test_it_prints_what_runs_with_layouts_memory_and_instants():
    env = made(reference=OwnCircle())
    lines = str(env.pipeline).splitlines()
    assert lines[0].split() == ["step", "runs", "reads", "and", "writes", "memory", "when"]
    said = {line.split()[0]: line for line in lines[1:]}
    assert list(said) == list(env.pipeline.names)
    assert "birthsim_env.loop.world:_plant" in said["plant"]
    assert "World, Seen, Clock" in said["plant"]
    assert said["plant"].endswith("period")
    assert "OwnCircle.sample (Python)" in said["target"]
    assert said["target"].endswith("period, episode begins")
    assert "5 rows" in said["jumps"]
    assert said["start"].endswith("  episode begins")
    assert said["outcome"].endswith("policy step, episode begins")
    assert repr(env.pipeline) == str(env.pipeline)


def test_a_stage_takes_the_place_of_another_when_episodes_begin_too():
    env = made()
    env.pipeline = env.pipeline.replace("hand", Stage(pull))
    for _ in range(2):
        env.reset(seed=1)
        np.testing.assert_array_equal(env.simulation.force[:, 0], [7.0, -3.0])
        env.step(STILL)
        np.testing.assert_array_equal(env.simulation.force[:, 0], [7.0, -3.0])
    assert not env.pipeline.stops


def test_what_runs_before_and_after_is_seen_by_what_follows():
    env = made(user_force=lambda time: (0.0, 0.0))
    pipeline = env.pipeline.replace("hand", Stage(pull)).after("hand", Stage(count)).before("sensors", Stage(count))
    assert pipeline.names == (*ORDER[:1], *ORDER[2:7], "count", "jumps", "count2", "sensors", "outcome")
    env.pipeline = pipeline
    env.step(STILL)
    assert env.measurement.user_force[0] == 9.0


def test_python_is_called_once_a_period_and_may_close_a_step():
    env, periods, ends = made(), [], []
    reference = made()
    closing = Step("end", ends.append, closes=True)
    env.pipeline = env.pipeline.after("plant", periods.append).after("outcome", closing)
    assert env.pipeline.stops
    assert "append" in env.pipeline.names
    found, expected = (one.step(STILL)[0] for one in (env, reference))
    np.testing.assert_array_equal(found, expected)
    assert periods == list(range(10))
    assert ends == [9]


def test_without_a_step_it_does_not_run():
    env = made()
    env.pipeline = env.pipeline.without("sensors", "hand")
    before = env.measurement.position.copy()
    for _ in range(5):
        env.step(np.full(4, 0.5, np.float32))
    np.testing.assert_array_equal(env.measurement.position, before)
    assert np.abs(env.simulation.motion[:2, 0] - before).max() > 1e-4


def test_an_edit_is_there_in_later_episodes_and_in_copies_and_under_another_actuation():
    env = made()
    env.pipeline = env.pipeline.replace("hand", Stage(pull)).without("jumps")
    names = env.pipeline.names
    for other in (copy.deepcopy(env), pickle.loads(pickle.dumps(env)), env):
        other.reset(seed=2)
        other.step(STILL)
        assert other.pipeline.names == names
        np.testing.assert_array_equal(other.simulation.force[:, 0], [7.0, -3.0])
    law = driving(make_controller("backstepping", Parameters()), None)
    law.begin(np.ones(1, dtype=bool))
    env.simulation.actuation = law
    assert env.pipeline.names[0] == "actuation.ask"
    assert tuple(name for name in env.pipeline.names if not name.startswith("actuation")) == names[1:]


def test_a_law_guards_itself_where_an_added_part_is_python():
    env = made(actuation=driving(make_controller("backstepping", Parameters()), None))
    plain = env.pipeline.names
    env.pipeline = env.pipeline.after("actuation", lambda period: None)
    own = [name for name in env.pipeline.names if name.startswith("actuation")]
    assert own == ["actuation.let_pass", *(name for name in plain if name.startswith("actuation")), "actuation.end"]
    assert env.pipeline[len(own)].name == "lambda"


def test_the_state_of_an_added_stage_is_part_of_the_environments():
    env, memory = made(), np.zeros((2, 1))
    env.pipeline = env.pipeline.after("plant", Step("own", Stage(pull, memory=memory)))
    env.reset(seed=1)
    memory[:] = 3.0
    state = env.get_state()
    memory[:] = 0.0
    env.set_state(state)
    np.testing.assert_array_equal(memory, 3.0)


def test_an_evaluation_measures_in_place_of_what_closes_a_step():
    env = made(actuation=driving(make_controller("backstepping", Parameters()), None))
    measures = Measures(env.simulation, 100)
    assert not measures.stops
    names = env.pipeline.names
    assert names.index("measure") == names.index("plant") - 1
    assert names.index("reward") == names.index("sensors") - 1
    assert "outcome" not in names


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (lambda pipeline: pipeline.replace("plan", Stage(pull)), r"name = 'plan' \(did you mean 'plant'\?\)"),
        (lambda pipeline: pipeline.without("x"), "name = 'x' .*allowed: actuation, plant"),
        (lambda pipeline: pipeline.before(3, Stage(pull)), "name = 3 .*allowed: actuation"),
        (lambda pipeline: pipeline.after("plant", 5), "part = 5; allowed: a Stage, a function"),
        (lambda pipeline: pipeline.after("plant", Step("hand", None)), "name = 'hand' .*allowed: names that differ"),
        (lambda pipeline: Pipeline([*pipeline, Stage(pull)]), "a step of the pipeline = .*allowed: Step"),
    ],
)
def test_errors_name_the_step_and_what_there_is(edit, said):
    with pytest.raises(ValueError, match=said):
        edit(gymnasium.make(CIRCLE).unwrapped.pipeline)


class Bare(ValveActuation):
    def stages(self, lanes, sampled, foreign):
        return None


def test_an_actuation_in_python_is_named_by_its_class():
    assert "Bare.openings (Python)" in str(made(actuation=Bare("two_valves")).pipeline)
    with pytest.raises(ValueError, match=r"actuation = .*allowed: None or an object of a class derived from Actuation"):
        gymnasium.make(CIRCLE, actuation=object())


def test_lanes_on_a_device_refuse_another_pipeline():
    env = gymnasium.make_vec(CIRCLE, num_envs=2, device="host").unwrapped
    assert env.pipeline.names == (ORDER[0], *ORDER[2:])
    with pytest.raises(NotImplementedError, match=r"pipeline.*allowed: .*without device="):
        env.pipeline = env.pipeline
