"""Controllers over seeded episodes: the same worlds for each, lost lanes, interrupts, and tables."""

import json
import math

import gymnasium
import numpy as np
import pytest

from baselines import BacksteppingController, make_controller
from baselines.bench import evaluation
from baselines.bench.evaluation import Evaluation, evaluate, overview, table
from baselines.bench.measures import DISCOUNTS, TRACE
from baselines.bench.metrics import UNITS, EpisodeMetrics
from birthsim_env import Parameters

PROBE, CIRCLE = "BirthSIM/Probe-v3", "BirthSIM/Circle-v2"
RIG = Parameters()


class Spy:
    """A law whose calls are counted; after ``interrupt_at`` of them it raises KeyboardInterrupt."""

    def __init__(self, law=None, interrupt_at=None):
        self.law = law or BacksteppingController()
        self.interrupt_at, self.calls, self.resets, self.commands = interrupt_at, 0, 0, []

    def reset(self, lanes=None):
        self.resets += 1
        self.law.reset(lanes)

    def command(self, measurement, reference):
        if self.calls == self.interrupt_at:
            raise KeyboardInterrupt
        self.calls += 1
        self.commands.append(self.law.command(measurement, reference))
        return self.commands[-1]


class Slam:
    """Holds all lanes with the law but ``lane``, whose cylinder 2 it slams into its end stop from ``begins`` s on."""

    def __init__(self, lanes=(1,), begins=0.3):
        self.law, self.lanes, self.begins = BacksteppingController(), list(lanes), begins

    def reset(self, lanes=None):
        self.law.reset(lanes)

    def command(self, measurement, reference):
        openings = self.law.command(measurement, reference)
        late = [lane for lane in self.lanes if measurement.time[lane] >= self.begins]
        openings[:, late] = np.array([0.0, 0.0, 1.0, -1.0])[:, None]
        return openings


def run(controller, name="it", episodes=3, seed=5, env=PROBE, **arguments):
    arguments = {"duration": 0.8, "randomize": True, **arguments}
    return evaluate(env, controller, name, episodes, seed, progress=False, **arguments)


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_a_seed_means_the_same_world_in_every_batch_and_for_a_law_that_was_used_before(sensors, monkeypatch):
    law, arguments = BacksteppingController(), {"sensors": sensors, "duration": 0.3, "episodes": 5}
    together = run(law, **arguments)
    monkeypatch.setattr(evaluation, "LANES", 2)
    batches = run(law, **arguments)
    assert [trace.shape[1] for trace in batches.traces] == [2, 2, 1]
    assert together.seeds == batches.seeds == [5, 6, 7, 8, 9]
    np.testing.assert_equal(together.metrics, batches.metrics)
    assert not set(together.metrics["error_rms_x"]) & set(run(law, seed=50, **arguments).metrics["error_rms_x"])


@pytest.mark.parametrize(("name", "good"), [("pid", True), ("backstepping", False)])
def test_figures_are_those_of_the_environment_step_by_step(name, good):
    setting = {"duration": 1.2, "randomize": "plant"}
    result = run(make_controller(name, RIG), episodes=2, seed=3, env=CIRCLE, **setting)
    env = gymnasium.make_vec(CIRCLE, num_envs=2, policy_period=1e-3, **setting)
    _, info = env.reset(seed=3)
    law, errors, flows, openings, paid = make_controller(name, RIG), [], [], [], []
    for _ in range(1200):
        errors.append(1e3 * info["tracking_error"])
        flows.append(info["supply_flow"])
        openings.append(law.command(env.measurement, env.reference))
        _, rewards, _, _, info = env.step(openings[-1].T)
        paid.append(rewards)
    size = np.array(errors)
    np.testing.assert_allclose(result.metrics["error_rms_x"], np.sqrt((size[..., 0] ** 2).mean(axis=0)))
    np.testing.assert_allclose(result.metrics["error_max_y"], np.abs(size[..., 1]).max(axis=0))
    # Settled from 0.5 s on, until the push that begins at 1 s.
    np.testing.assert_allclose(result.metrics["settled_rms_y"], np.sqrt((size[500:1001, :, 1] ** 2).mean(axis=0)))
    np.testing.assert_allclose(result.metrics["air"], np.mean(flows, axis=0) / 1.293 * 60e3)
    np.testing.assert_allclose(result.metrics["saturation"], 100 * (np.abs(openings).max(axis=1) >= 1).mean(axis=0))
    np.testing.assert_array_equal(1e3 * result.traces[0], size[:: round(TRACE / 1e-3)])
    assert np.isnan(result.metrics["stiffness_error"]).all()
    for discount in DISCOUNTS:
        weights = discount ** (0.1 * np.arange(1200))
        np.testing.assert_allclose(result.returns[discount], weights @ np.array(paid), rtol=1e-10)
    assert result.success == info["is_success"].tolist() == [good, good]


@pytest.mark.parametrize(
    ("name", "seeds", "sensors"),
    [("pid[damping=0.01]", (11, 12, 13), "honest"), ("admittance-adaptive", (5, 6), "lab"), ("lqr", (5, 6), "ideal")],
)
def test_a_law_in_the_loop_has_the_figures_of_one_that_is_called_back(name, seeds, sensors):
    """Also of an episode that is lost, as it is by a law with hardly any damping."""
    settings = {"seed": seeds[0], "episodes": len(seeds), "sensors": sensors, "duration": 4.0, "env": CIRCLE}
    inside = run(make_controller(name, RIG), **settings)
    called = run(spy := Spy(make_controller(name, RIG)), **settings)
    for what in ("seeds", "lost", "metrics", "returns", "success", "traces"):
        np.testing.assert_equal(getattr(inside, what), getattr(called, what), err_msg=what)
    assert spy.calls == 4000
    assert any(inside.lost) or not name.startswith("pid")


def test_a_class_that_changes_command_is_called_back():
    class Still(BacksteppingController):
        def command(self, measurement, reference):
            return np.zeros((4, measurement.position.shape[1]))

    still, law = (run(one, duration=0.3).metrics for one in (Still(), BacksteppingController()))
    assert max(still["saturation"]) == 0.0
    assert still["error_rms_x"] != law["error_rms_x"]


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_a_lane_that_terminates_is_lost_and_stops_contributing(sensors):
    calm, slammed = run(Slam(lanes=()), sensors=sensors), run(Slam(lanes=(1,)), sensors=sensors)
    assert calm.lost == [False] * 3
    assert slammed.lost == [False, True, False]
    for name in UNITS:
        np.testing.assert_array_equal(slammed.metrics[name][::2], calm.metrics[name][::2], err_msg=name)
    # The lost lane's figures are those of its episode alone, up to the end.
    env = gymnasium.make_vec(PROBE, num_envs=1, policy_period=1e-3, duration=0.8, randomize=True, sensors=sensors)
    _, info = env.reset(seed=[6])
    alone, metrics, steps, terminated = Slam(lanes=(0,)), EpisodeMetrics(1, 1e-3), 0, [False]
    while not terminated[0]:
        command = alone.command(env.measurement, env.reference)
        metrics.add(info, command, np.ones(1, bool))
        _, _, terminated, _, info = env.step(command.T)
        steps += 1
    assert 300 < steps < 800
    for name, values in metrics.result().items():
        np.testing.assert_array_equal(slammed.metrics[name][1], values[0], err_msg=name)
    trace = slammed.traces[0]
    assert trace.shape == (80, 3, 2)
    assert np.isfinite(trace[:, [0, 2]]).all()
    seen = math.ceil(steps / 10)
    assert np.isfinite(trace[:seen, 1]).all()
    assert np.isnan(trace[seen:, 1]).all()


def test_nothing_runs_on_once_every_lane_is_lost():
    result = run(spy := Spy(Slam(lanes=(0, 1))), episodes=2, duration=7.0)
    assert result.lost == [True, True]
    assert 300 < spy.calls < 1000
    assert result.traces[0].shape == (700, 2, 2)


@pytest.mark.parametrize(("at", "complete"), [(375, 2), (200, 2), (599, 4)])
def test_an_interrupt_keeps_the_episodes_that_are_complete(monkeypatch, capsys, at, complete):
    monkeypatch.setattr(evaluation, "LANES", 2)
    whole, cut = run(Spy(), episodes=6, duration=0.2), run(Spy(interrupt_at=at), episodes=6, duration=0.2)
    assert cut.seeds == whole.seeds[:complete]
    assert cut.lost == whole.lost[:complete]
    np.testing.assert_equal(cut.metrics, {name: values[:complete] for name, values in whole.metrics.items()})
    assert len(cut.traces) == complete // 2
    assert math.isfinite(cut.cost)
    assert f"{complete} of 6 episodes" in capsys.readouterr().out
    assert f"0 of {complete}" in table([cut])


def test_an_interrupt_before_any_episode_is_complete_is_passed_on():
    with pytest.raises(KeyboardInterrupt):
        run(Spy(interrupt_at=10))


def test_a_controller_begins_anew_with_every_batch_and_is_called_at_the_rate_of_its_rig(monkeypatch):
    monkeypatch.setattr(evaluation, "LANES", 2)
    rig = RIG.replace({"electronics.control_period": 0.002})
    spy = Spy(BacksteppingController(rig))
    run(spy, episodes=5, duration=0.1, parameters=rig)
    assert (spy.resets, spy.calls) == (3, 3 * 50)


def test_the_dictionary_is_json_and_says_everything():
    result = run(Slam(lanes=(1,)), "mine")
    read = json.loads(json.dumps(result.to_dict()))
    assert read["controller"] == "mine"
    assert read["seeds"] == [5, 6, 7]
    assert read["units"] == UNITS
    assert read["lost"] == [False, True, False]
    assert read["lost_episodes"] == 1
    # A world asks for what it asks, whatever controls it.
    assert read["required_strength_ratio"] == run(Slam(lanes=())).required_strength_ratio
    assert len(set(read["required_strength_ratio"])) == 3
    assert result.cost > 0
    assert set(read["episodes"]) == set(read["summary"]) == set(UNITS)
    for name in UNITS:
        assert len(read["episodes"][name]) == 3
        assert set(read["summary"][name]) == {"median", "mean", "q95", "max"}
    x = read["episodes"]["error_rms_x"]
    assert read["summary"]["error_rms_x"]["median"] == pytest.approx(max(x[0], x[2]))
    assert read["summary"]["error_rms_x"]["max"] == "lost"


def example(name, values, lost, cost):
    metrics = {metric: [math.nan] * len(lost) for metric in UNITS}
    return Evaluation(name, list(range(len(lost))), {**metrics, **values}, lost, cost=cost)


def test_the_table_has_a_row_per_metric_with_figures_and_three_columns_per_controller():
    one = example(
        "law", {"error_rms_x": [1.0, 2.0, 9.87654], "stiffness_error": [-30.0, 1.0, 2.0]}, [False, False, False], 1.23456
    )
    other = example("mine", {"error_rms_x": [0.5, 0.5, 0.1]}, [False, False, True], 2.0)
    lines = table([one, other]).splitlines()
    cells = {line.split("|")[1].strip(): [cell.strip() for cell in line.split("|")[2:-1]] for line in lines}
    assert cells["metric"] == ["unit", "law: median", "95 %", "max", "mine: median", "95 %", "max"]
    assert set(lines[1]) == {"|", "-", " "}
    assert len({line.count("|") for line in lines}) == 1
    assert cells["error_rms_x"] == ["mm", "2", f"{np.quantile([1, 2, 9.87654], 0.95):.3g}", "9.88", "0.5", "lost", "lost"]
    # Tails are of the size: -30 % is as bad as +30 %.
    assert cells["stiffness_error"] == ["%", "1", f"{np.quantile([30, 1, 2], 0.95):.3g}", "30", "-", "-", "-"]
    assert "hunting_x" not in cells, "no controller has anything to say of it"
    assert cells["lost episodes"] == ["", "0 of 3", "", "", "1 of 3", "", ""]
    assert cells["successful episodes"][1] == "0 of 0"
    assert len(lines) == 2 + 2 + 3


def test_the_overview_says_which_episodes_were_never_settled_and_calls_the_lost_ones_lost():
    one = Evaluation("mine", metrics={**{name: [1.0] * 3 for name in UNITS}, "settled_rms": [0.5, np.nan, np.nan]})
    one.lost = [False, False, True]
    lines = overview([one]).splitlines()
    assert lines[1].split() == ["mine", "lost", "lost", "lost", "1", "of", "3"]
    assert lines[2] == "mine: 1 of 3 episodes were never settled and are left out above"
