"""Adaptive robust control: its loop at rest against a PID on the force, what it learns in motion, and its bounds."""

import numpy as np
import pytest

from baselines.rivals.adaptive_robust import MOST_LOAD, MOST_MASS, AdaptiveRobust, Learned
from baselines.rivals.feedforward import SIGN_WIDTH
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry, jacobian
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop
from tests.oracles import derived_law as derived
from tests.oracles.closed_loop import FRICTIONLESS, PNEUMATIC_STIFFNESS, slippery
from tests.rivals.unseen_weight import BELIEVED, BESIDE, expected, pushed

L, K, A, B = 20.0, 20.0, 6.0, 80.0


@pytest.mark.parametrize(("robustness", "gain"), [(0.0, K), (20.0, 2 * K)])
def test_at_rest_it_is_a_pid_on_the_force(robustness: float, gain: float) -> None:
    """Within the layer of the robust term and without it. States e, de/dt, D/m_e, load/m_e and the push."""
    gains = {"error_rate": L, "feedback_rate": K, "robustness": robustness, "learning_rate": A, "force_rate": B}
    found = pushed(AdaptiveRobust(BELIEVED, **gains, friction_fraction=0.0, dead_zone=0.0), 0.8)
    e, v, force, load, push = np.eye(5)
    for i in range(2):
        s, acceleration = v + L * e, force - load
        wanted = load - L * v - gain * s
        turned = -L * acceleration - gain * (acceleration + L * v)
        motion = [v, force - found.viscous[i] * v + push]
        rates = np.array([*motion, turned + B * (wanted - force), -A * K * s, 0 * e])
        predicted = expected(rates, found.push[i] * push + BESIDE[i] * e, len(found.error))[:, 0]
        largest = np.abs(predicted).max()
        assert np.abs(found.error[:, i] - predicted).max() < 0.06 * largest


def missing(law: AdaptiveRobust, rig: Parameters, wanted: Reference) -> tuple[Array, Array, Array]:
    """The force that the law has learned to add, and the one that mass and sliding friction ask for, N, (2,) each; and the
    reference speeds of the pistons, m/s."""
    found, believed, pistons = Learned(law._memories[-1]), law.parameters, inverse_geometry(wanted.position, rig)[:, 0]
    columns = jacobian(pistons, rig)
    speed = np.linalg.solve(columns, wanted.velocity[:, 0])
    way = speed / np.sqrt(speed**2 + SIGN_WIDTH**2)
    carried = columns.T @ (wanted.acceleration[:, 0] + [0.0, rig.mechanics.gravity])
    pressures = derived.air_for(np.zeros(2), PNEUMATIC_STIFFNESS[:, 0], pistons, rig)
    fed, true = (np.array(derived.coulomb_levels(pressures, speed, one)) for one in (believed, rig))
    learned = found.share[:, 0] * fed * way + carried * found.mass[0] + found.load[:, 0]
    return learned, (true - fed) * way + carried * (rig.mechanics.mass - believed.mechanics.mass), speed


RIGS = {
    "light": (FRICTIONLESS, FRICTIONLESS.replace({"mechanics.mass": FRICTIONLESS.mechanics.mass - 0.4})),
    "heavy": (FRICTIONLESS, FRICTIONLESS.replace({"mechanics.mass": FRICTIONLESS.mechanics.mass + 0.5})),
    "slippery": (slippery(1.0), slippery(0.6)),
    "rough": (slippery(1.0), slippery(1.5)),
}
"""What is believed, and what is so."""


@pytest.mark.parametrize("kind", RIGS)
def test_it_learns_the_force_that_its_model_lacks(kind: str) -> None:
    """On the fifth and sixth circle, where the pistons slide."""
    believed, rig = RIGS[kind]
    law, nothing = AdaptiveRobust(believed, friction_fraction=1.0), np.zeros((2, 1))
    plant, learned, true = closed_loop.resting_at(circle(0.0), rig), [], []
    for t, wanted, _, _ in closed_loop.run(plant, law.command, circle, lambda t: nothing, 12.0):
        if t > 8.0 and round(1e3 * t) % 20 == 0:
            found, exact, speed = missing(law, rig, wanted)
            slides = np.abs(speed) > 0.04
            learned += [*found[slides]]
            true += [*exact[slides]]
    wrong, right = np.subtract(learned, true), np.array(true)
    assert len(learned) > 100
    assert np.sqrt(np.mean(wrong**2)) < 0.2 * np.sqrt(np.mean(right**2))


def circle(t: float) -> Reference:
    return closed_loop.circling(t, 0.06, 2.0, 2000.0)


def test_what_it_learns_stays_between_bounds() -> None:
    """Of a rig of 9 kg, believed to have 3."""
    reference = closed_loop.holding(np.array([[0.5], [0.0]]), 2000.0)
    plant, law = closed_loop.resting_at(reference, Parameters().replace({"mechanics.mass": 9.0})), AdaptiveRobust()
    for _ in closed_loop.run(plant, law.command, lambda t: reference, lambda t: np.zeros((2, 1)), 3.0):
        found = Learned(law._memories[-1])
        assert found.mass[0] <= MOST_MASS * 3.0
        assert np.abs(found.load[1, 0]) <= MOST_LOAD
    kappa = np.hypot(*jacobian(inverse_geometry(plant.end_effector()[:2], Parameters())[:, 0], Parameters())[:, 0])
    assert found.mass[0] == MOST_MASS * 3.0
    assert abs(found.load[0, 0]) == pytest.approx(MOST_LOAD * kappa, rel=0.2)
