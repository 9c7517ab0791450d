"""What the admittance with stiff backstepping achieves on the whole plant with friction: outcomes."""

import numpy as np
import pytest

from baselines.admittance.controller import AdmittanceController
from baselines.bench.probes import StiffnessResult, StiffnessTest, run_stiffness_test
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR, MPYE_5_M5, Curve
from tests.oracles import closed_loop

BELIEVED = Parameters()


def errors(probes: StiffnessTest, answers: StiffnessResult) -> tuple[Array, Array]:
    """|stiffness error| (N,), and the larger axis' hunting (N,), mm."""
    return np.abs(answers.stiffness_error(probes.force)), 1e3 * answers.hunting.max(axis=0)


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic"])
@pytest.mark.parametrize(
    ("curve", "most_error", "most_hunting"),
    [(LINEAR, 0.002, 0.01), (MPYE_5_M5, 0.02, 0.025)],
    ids=["linear valves", "catalogue"],
)
def test_exact_sensors_and_friction_off_by_a_quarter(
    curve: Curve, most_error: float, most_hunting: float, law: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """5 and 40 N at five poses, 1000-4000 N/m, with LuGre's drift and without; with linear valves measured 0.013 %, 0.0006 mm.

    The catalogue's, whose overlap is crossed softly: worst 0.84 %, 95 % within 0.17 %; 0.011 mm.
    """
    closed_loop.shorten_probes(monkeypatch)
    rigs = [closed_loop.slippery(scale, law).replace(curve.changes()) for scale in (0.75, 1.25)]
    probes, believed = closed_loop.pushes((5.0, -40.0), rigs=rigs), BELIEVED.replace(curve.changes())
    error, hunting = errors(probes, run_stiffness_test(probes, AdmittanceController(believed, learn=False)))
    assert np.quantile(error, 0.95) < 0.005
    assert error.max() < most_error
    assert hunting.max() < most_hunting


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
    """The rig as believed; over 960 pushes: median 0.34 %, 95 % 2.3 %, worst 6.2 % (elasto-plastic: 12 %); hunting 0.49 mm.

    Linear valves have 0.1 %, 0.6 % and 2.3 %: noise throws the valves across their overlap all the time.
    """
    probes = closed_loop.pushes(forces, rigs=[closed_loop.slippery(1.0, law)])
    error, hunting = errors(probes, run_stiffness_test(probes, AdmittanceController(BELIEVED, learn=False), "lab", seed=seed))
    assert np.median(error) < 0.007
    assert np.quantile(error, 0.95) < 0.05
    assert error.max() < 0.2
    assert hunting.max() < 0.8


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
