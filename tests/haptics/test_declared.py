"""What laws declare is what they render: series, slow pushes on a rig without dry friction, and the rigid part of (18)."""

import numpy as np
import pytest

from baselines import named
from baselines.backstepping.impedance import joint_impedance
from baselines.impedance import declared_by, mass_spring_damper, matrix_root
from baselines.named import controlling_names, make_controller, uncontrolled_names
from birthsim_env import Parameters, Reference
from lab.studies.haptics.multisine import FREQUENCIES, SECONDS, impedance_felt, multisine_hand
from lab.studies.haptics.recording import record
from lab.studies.haptics.worlds import Condition, resting, uses_force
from lab.studies.stability.rig_port import RigPort
from tests.oracles.closed_loop import IDEAL

RIG = Parameters()
POSES = [(0.5, 0.0), (0.4, 0.05)]


def test_series_of_a_piston():
    """K + B s + M s^2 is the law's Z(s) up to the third order: an error 8 times smaller at half the s."""
    c, mass, viscous = (20.0, 30.0, 50.0), 4.0, 35.0
    m, b, k = joint_impedance(c, mass, viscous)
    a2, a1, a0 = 100.0, 20 * 30 + 20 * 50 + 30 * 50 + 2.0, 70.0 + 20 * 30 * 50

    def missed(s):
        exact = mass * (s**3 + a2 * s**2 + a1 * s + a0) / (s + a2 - viscous / mass)
        return abs(exact - (k + b * s + m * s * s))

    assert missed(0.1) / missed(0.05) == pytest.approx(8, rel=0.01)


INTEGRAL = "backstepping-integral"
"""It takes a slow push for an error of its model, and has no stiffness left for it."""


@pytest.mark.parametrize("name", [name for name in controlling_names() if name != INTEGRAL])
def test_every_law_declares_the_stiffness_that_is_asked_for(name):
    """(18) loses nothing of a stiffness that is the same along x and y; mass and damping are positive definite."""
    declared = declared_by(make_controller(name, RIG), resting(POSES, [1000.0, 4000.0]))
    assert declared is not None
    for lane, stiffness in enumerate((1000.0, 4000.0)):
        np.testing.assert_allclose(declared.stiffness[..., lane], stiffness * np.eye(2), rtol=0, atol=1e-3 * stiffness)
        for matrix in (declared.mass, declared.damping):
            assert np.linalg.eigvalsh(matrix[..., lane] + matrix[..., lane].T).min() > 0


@pytest.mark.parametrize("name", [*uncontrolled_names(), INTEGRAL])
def test_what_has_no_stiffness_declares_nothing(name):
    assert declared_by(make_controller(name, RIG), resting(POSES, [1000.0, 4000.0])) is None


def test_a_coupled_stiffness_is_felt_along_the_push():
    """The displacement along a push of a pure spring is u^T K^-1 u; roots of matrices are roots."""
    rows = resting([POSES[0]], [2000.0]).rows.copy()
    rows[9], rows[14] = 3000.0, 800.0
    declared = mass_spring_damper(Reference(rows), 3.0, 0.9)
    k = np.array([[2000.0, 800.0], [800.0, 3000.0]])
    u = np.array([0.6, 0.8])
    found = declared.along(np.zeros(1), u[:, None])[0, 0]
    assert found == pytest.approx(1 / (u @ np.linalg.inv(k) @ u), rel=1e-12)
    root = matrix_root(k[:, :, None])[..., 0]
    np.testing.assert_allclose(root @ root, k, rtol=1e-12)
    np.testing.assert_allclose(declared.damping[..., 0] @ declared.damping[..., 0], (1.8**2) * 3.0 * k, rtol=1e-12)


@pytest.mark.parametrize("name", controlling_names())
def test_who_is_said_to_use_the_force_of_the_hand_does(name):
    assert uses_force(Condition(name, RIG, "ideal", 0, 0, force_sensor=True)) is named.uses_force(name)
    assert not uses_force(Condition(name, RIG, "ideal", 0, 0, force_sensor=False))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "options"),
    [("backstepping", {"weight_compensation": True}), ("backstepping-cartesian", {}), ("admittance-backstepping", {})],
)
def test_without_dry_friction_a_hand_feels_what_is_declared(name, options):
    """Up to 2.2 Hz within 5 % and 5 degrees at 2000 N/m, two poses, along x and y: half the bandwidth's bounds.

    Valves of 4 ms, pressures that follow, and air that is not polytropic are what is left; valves are linear, since small flows
    wait in an overlap that the law crosses softly.
    """
    poses = [pose for pose in POSES for _ in range(2)]
    direction = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]])
    law, reference = make_controller(name, IDEAL, **options), resting(poses, [2000.0] * 4)
    port = RigPort([IDEAL] * 4, reference, law)
    felt = impedance_felt(record(port, multisine_hand(direction, np.full(4, 5.0), 1), SECONDS), direction)
    declared = declared_by(law, reference)
    assert declared is not None
    ratio = (felt / declared.along(FREQUENCIES, direction))[FREQUENCIES < 2.5]
    assert np.abs(np.abs(ratio) - 1).max() < 0.05
    assert np.abs(np.degrees(np.angle(ratio))).max() < 5


def test_a_mass_of_the_hand_moves_with_the_rig_and_weighs_nothing():
    """Valves shut: the energy given is that of port forces, and a rig starts at rest whatever the hand's mass."""
    law = make_controller("shut-valves", RIG)
    port = RigPort([RIG] * 2, resting([POSES[0]] * 2, [2000.0] * 2), law, hand_mass=np.array([0.0, 2.0]))

    def hand(now, position, velocity):
        return np.repeat([[60.0], [0.0]], 2, axis=1) * (now > 0.05)

    recording = record(port, hand, 0.2)
    assert np.abs(recording.position[:50] - recording.position[0]).max() < 2e-5
    light, heavy = recording.velocity[65, 0]
    assert 0 < heavy < 0.8 * light
    moved = (0.5 * (recording.force[1:] + recording.force[:-1]) * np.diff(recording.position, axis=0)).sum(axis=(0, 1))
    np.testing.assert_allclose(recording.energy[-1], -moved, rtol=0.05)
