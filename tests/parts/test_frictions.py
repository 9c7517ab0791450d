"""The sweep of frictions: what it has, that lanes draw it, and that nothing but friction differs from entry to entry."""

import gymnasium
import numpy as np
import pytest

from birthsim_build.device.drawing import Symbolic
from birthsim_env import Parameters
from birthsim_env.gradients.graph import Graph
from birthsim_env.parts.drawn.frictions import LAW, with_friction
from birthsim_env.parts.drawn.randomization import checked_ranges, described, documented_ranges, draw_parameters, draw_rig
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.drawn.streams import Streams
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import parameter_column, parameter_columns
from birthsim_env.physics.rig.parameters import DECLARED, value_of
from birthsim_env.physics.rig.rows import rows_of
from birthsim_env.registry import entries, names

LAWS = DECLARED[LAW].choices
FRICTIONAL = ("friction.", "coulomb_friction", "pressure_friction", "direction_asymmetry")
"""What names of parameters have that are of friction that a sweep may draw."""


def drawn(friction: str, lanes: int, seed: int = 7) -> np.ndarray:
    rig = with_friction(Parameters(), friction)
    streams = Streams(list(range(seed, seed + lanes)), np.zeros(lanes, dtype=np.int64), "parameters")
    return parameter_columns(draw_rig(rig, documented_ranges(rig), streams), lanes)


def test_the_sweep_has_every_law_and_what_is_in_doubt_of_bristles():
    ranges = {name: documented_ranges(with_friction(Parameters(), name)) for name in names("friction")}
    assert {law for one in ranges.values() for law in one[LAW]} == set(LAWS)
    for name, factors in (("friction.bristle_stiffness", (0.1, 10.0)), ("friction.bristle_damping", (0.25, 4.0))):
        own = value_of(Parameters(), name)
        assert (min(one[name][0] for one in ranges.values()), max(one[name][1] for one in ranges.values())) == pytest.approx(
            (factors[0] * own, factors[1] * own)
        )
    assert {(1.0, 1.0), (1.8, 1.8), (1.0, 1.8)} < {one["friction.static_ratio"] for one in ranges.values()}


@pytest.mark.parametrize("one", entries("friction"), ids=lambda one: one.name)
def test_an_entry_is_possible_and_within_what_drawn_draws(one):
    rig = with_friction(Parameters(), one.name)
    ranges, widest = documented_ranges(rig), documented_ranges(with_friction(Parameters(), "drawn"))
    assert checked_ranges(ranges, rig) == ranges
    assert ranges.keys() == widest.keys(), "a seed draws as many numbers"
    assert set(ranges[LAW]) <= set(widest[LAW])
    for name in ranges.keys() - {LAW}:
        inside = widest[name][0] <= ranges[name][0] and ranges[name][1] <= widest[name][1]
        assert inside or (one.name, name.partition(".")[2]) == ("pressed", "coulomb_friction"), name
        assert ranges[name] == documented_ranges(Parameters()).get(name) or any(word in name for word in FRICTIONAL)
    assert one.made.source


def test_lanes_draw_every_law_alike_and_what_one_rig_draws():
    lanes = 800
    columns = drawn("drawn", lanes)
    own = {"lugre": columns[at.LUGRE], "gms": columns[at.GMS], "coulomb": 1.0 - columns[at.BRISTLED]}
    for of in (*own.values(), 1.0 - sum(own.values())):
        assert set(of) == {0.0, 1.0}
        assert abs(of.sum() - lanes / 4) < 4.5 * np.sqrt(lanes * 3 / 16)
    rig = with_friction(Parameters(), "drawn")
    for lane in range(40):
        one = draw_parameters(rig, documented_ranges(rig), stream(7 + lane, 0, "parameters"))
        np.testing.assert_array_equal(columns[:, lane], parameter_column(one))


@pytest.mark.parametrize("friction", ["gms", "pressed", "asymmetric", "drawn"])
def test_a_seed_has_one_rig_under_all_frictions(friction):
    rows, other = drawn("lugre", 50), drawn(friction, 50)
    changed = {name for name, a, b in zip(at.PARAMETER_NAMES, rows, other, strict=True) if not np.array_equal(a, b)}
    frictional = {
        *("lugre", "gms", "bristled", "s0", "s1", "stribeck", "static_ratio"),
        *(f"{name}{k}" for k in (1, 2) for name in ("fc", "fp", "asymmetry")),
    }
    assert changed
    assert changed <= frictional
    assert np.ptp(rows[at.MASS]) > 2.0


def test_controllers_believe_the_rig_of_the_file_and_default_worlds_know_one_law(tmp_path):
    (tmp_path / "rig.toml").write_text('[mechanics]\nmass = 4.0\n[randomize]\nfriction = "coulomb"\n')
    env = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=3, parameters=tmp_path / "rig.toml", randomize="plant")
    env.reset(seed=0)
    assert env.simulation.parameters.friction.law == "lugre"
    assert env.simulation.nominal[at.BRISTLED] == 1.0
    assert not env.simulation.plant.lane_parameters[at.BRISTLED].any()
    assert LAW not in documented_ranges(Parameters())


def test_a_file_and_a_mapping_keep_it_and_what_they_name_besides_counts_more():
    rig = Parameters.from_dict({"randomize": {"friction": "drawn", LAW: ["gms"], "friction.static_ratio": [1.2, 1.4]}})
    assert Parameters.from_dict(rig.to_dict()) == rig
    assert documented_ranges(rig)[LAW] == ("gms",)
    assert documented_ranges(rig)["friction.static_ratio"] == (1.2, 1.4)
    assert documented_ranges(rig)["friction.bristle_damping"] == (37.5, 600.0)
    assert with_friction(rig, "") is rig
    assert with_friction(with_friction(rig, "lugre"), "drawn") == rig


def test_what_is_drawn_of_a_choice_is_said():
    assert described(Parameters(), {LAW: ("gms", "coulomb")}) == "rigs drawn: law of friction gms or coulomb"


def test_a_device_draws_words_too():
    """The graph of one lane, computed here, beside NumPy's generator."""
    graph, rig = Graph(), with_friction(Parameters(), "drawn")
    rows = rows_of(draw_rig(rig, documented_ranges(rig), Symbolic(graph, "rig", 0)))
    assert all(np.shape(rows[row]) == (1,) for row in (at.LUGRE, at.GMS, at.BRISTLED))


@pytest.mark.parametrize(
    ("randomize", "words"),
    [
        ({LAW: ("gms", "stick")}, r"randomize\['friction.law'\] = .*; allowed: one or more of 'lugre', .*, each once"),
        ({LAW: ("gms", "gms")}, "each once"),
        ({LAW: ()}, "one or more"),
        ({LAW: (0.0, 1.0)}, "one or more"),
    ],
)
def test_words_that_cannot_be_drawn_are_refused(randomize, words):
    with pytest.raises(ValueError, match=words):
        gymnasium.make("BirthSIM/Circle-v2", randomize=randomize)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"friction": "drwan"}, r"friction = 'drwan' \(did you mean 'drawn'\?\)"),
        ({"friction": ["drawn"]}, r"\[randomize\] friction = \['drawn'\]; allowed: the name of a friction"),
        ({LAW: "gms"}, r"\[randomize\] friction.law = 'gms'; allowed: .*some of its choices"),
    ],
)
def test_tables_that_name_no_friction_are_refused(table, words):
    with pytest.raises(ValueError, match=words):
        gymnasium.make("BirthSIM/Circle-v2", parameters={"randomize": table}, randomize=True)


def test_a_law_that_the_rigs_steps_do_not_follow_is_refused():
    stiff = {"parameters": {"friction": {"sign_speed": 0.001}}, "randomize": {LAW: ("lugre", "coulomb")}}
    with pytest.raises(ValueError, match=r"some of the rigs drawn are impossible: Mechanics\.mass"):
        gymnasium.make("BirthSIM/Circle-v2", **{**stiff, "randomize": {**stiff["randomize"], "mechanics.mass": (1.0, 3.0)}})


def test_lanes_of_several_laws_have_the_bits_of_single_environments_while_laws_come_and_go():
    """Seed 6 draws generalised Maxwell slip in its first episode and none in the next: the kernel changes on the way."""
    given = {"parameters": {"randomize": {"friction": "drawn"}}, "randomize": True, "duration": 0.1}
    envs = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=4, autoreset_mode="SameStep", **given)
    envs.reset(seed=5)
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (15, 4, 4)).astype(np.float32)
    states, slips = [], []
    for action in actions:
        envs.step(action)
        states.append(envs.simulation.plant.state.copy())
        slips.append(envs.simulation.plant.lane_parameters[at.GMS].any())
    assert slips[0]
    assert not slips[-1]
    for lane in range(4):
        env = gymnasium.make("BirthSIM/Probe-v3", **given)
        env.reset(seed=5 + lane)
        for action, state in zip(actions, states, strict=True):
            *_, terminated, truncated, _ = env.step(action[lane])
            if terminated or truncated:
                env.reset()
            np.testing.assert_array_equal(env.unwrapped.simulation.plant.state[:, 0], state[:, lane])


def test_a_device_refuses_a_law_with_states_that_the_rig_has_not():
    with pytest.raises(ValueError, match=r"friction\.law drawn from lugre, .*, gms; allowed on a device: all but gms"):
        gymnasium.make_vec(
            "BirthSIM/Probe-v3", num_envs=2, device="host", randomize=True, parameters={"randomize": {"friction": "drawn"}}
        )


def test_gradients_refuse_an_episode_that_draws_such_a_law():
    """One that comes later than the first, when gradients were asked for."""
    env = gymnasium.make("BirthSIM/Probe-v3", randomize={LAW: ("lugre", "gms")}, duration=0.02).unwrapped
    for seed in range(20):
        env.reset(seed=seed)
        if env.simulation.plant.lane_parameters[at.GMS, 0] == 0.0:
            break
    env.record()
    env.step(np.zeros(4, np.float32))
    for _ in range(20):
        env.reset()
        if env.simulation.plant.lane_parameters[at.GMS, 0] == 1.0:
            break
    with pytest.raises(ValueError, match=r"gradients of a rig with one of .*'gms'"):
        env.step(np.zeros(4, np.float32))
