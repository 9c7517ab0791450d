"""What the admittance with stiff backstepping achieves on the whole plant with friction: outcomes."""

import numpy as np
import pytest

from baselines.admittance.controller import AdmittanceController
from baselines.bench.probes import StiffnessResult, StiffnessTest, run_stiffness_test
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop

BELIEVED = Parameters()


def errors(probes: StiffnessTest, answers: StiffnessResult) -> tuple[Array, Array]:
    """|stiffness error| (N,), and the larger axis' hunting (N,), mm."""
    return np.abs(answers.stiffness_error(probes.force)), 1e3 * answers.hunting.max(axis=0)


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic"])
def test_exact_sensors_and_friction_off_by_a_quarter(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """5 and 40 N at five poses, 1000-4000 N/m: measured 0.013 % and 0.0006 mm, with LuGre's drift and without."""
    closed_loop.shorten_probes(monkeypatch)
    probes = closed_loop.pushes((5.0, -40.0), rigs=[closed_loop.slippery(scale, law) for scale in (0.75, 1.25)])
    error, hunting = errors(probes, run_stiffness_test(probes, AdmittanceController(BELIEVED, learn=False)))
    assert error.max() < 0.002
    assert hunting.max() < 0.01


@pytest.mark.parametrize(
    ("law", "forces", "seed"),
    [
        ("lugre", (5.0, -40.0), 11),
        ("elasto_plastic", (5.0, -40.0), 11),
        *(
            pytest.param("lugre", (5.0, -5.0, 10.0, -10.0, 20.0, -20.0, 40.0, -40.0), 100_000 * k, marks=pytest.mark.slow)
            for k in range(4)
        ),
    ],
)
def test_a_trackers_samples(law: str, forces: tuple[float, ...], seed: int) -> None:
    """The rig as believed; over 1920 pushes: median 0.12 %, 95 % 0.61 %, worst 2.3 %; hunting 0.42 mm."""
    probes = closed_loop.pushes(forces, rigs=[closed_loop.slippery(1.0, law)])
    error, hunting = errors(probes, run_stiffness_test(probes, AdmittanceController(BELIEVED, learn=False), "lab", seed=seed))
    assert np.quantile(error, 0.95) < 0.01
    assert error.max() < 0.05
    assert hunting.max() < 0.5


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_it_comes_back_calmly_from_a_load_beyond_its_strength(sensors: str) -> None:
    """5 kg and 45 N downwards are more than cylinder 1 can lift; with unbounded errors it swung by 100 mm for two seconds."""
    rig = BELIEVED.replace({"mechanics.mass": 5.0, "valves.time_constant": 0.007})
    wanted = closed_loop.holding(np.array([[0.55], [0.0]]), 2000.0)
    plant, law = closed_loop.resting_at(wanted, rig), AdmittanceController(BELIEVED, learn=False)
    sense, off = closed_loop.ideal if sensors == "ideal" else closed_loop.tracker(rig, 1), []
    for _ in closed_loop.run(
        plant, law.command, lambda t: wanted, lambda t: np.array([[0.0], [-45.0 * (0.5 <= t < 1.3)]]), 2.8, sense
    ):
        off.append(np.hypot(*(plant.end_effector()[:2, 0] - wanted.position[:, 0])))
    assert max(off) > 0.04
    assert max(off[1800:]) < 3e-3
