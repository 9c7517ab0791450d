"""The dense grid of impedances, and the openings that exact rendering commands, against other ways to them."""

import numpy as np
import pytest

from baselines.impedance import declared_by, mass_spring_damper
from baselines.valve_inverse import driving_flows
from birthsim_env.physics.compiled.lanes import PN2, PP2, Rig, parameter_array, parameter_column
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.linkage.geometry import inverse_geometry
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.bandwidth.stimuli import BANDS, hand_lines, lines
from lab.studies.bandwidth.study import felt_impedance
from lab.studies.bandwidth.valves import commanded_openings
from lab.studies.haptics.recording import record
from lab.studies.haptics.worlds import POSES, Condition, resting
from lab.studies.stability.rig_port import RigPort
from tests.oracles.closed_loop import IDEAL


def test_there_are_twenty_lines_a_decade():
    frequency = np.concatenate([lines(low, high, period) for low, high, period, _ in BANDS])
    assert frequency[0] == pytest.approx(0.1)
    assert frequency[-1] == pytest.approx(20.0, abs=0.5 / BANDS[-1][2] + 0.03)
    assert (np.diff(frequency) > 0).all()
    for low, high, period, _ in BANDS:
        # R 20 has a ratio of 1.122; rounding moves either line by half a multiple of 1/period at most.
        own = frequency[(frequency >= low) & (frequency <= high)]
        assert (own[1:] / own[:-1]).max() < 10**0.05 * (1 + 0.5 / (low * period)) / (1 - 0.5 / (low * period))


def test_an_impedance_is_that_of_a_port_recorded():
    rig, period, frequency = Parameters(), 1.0, np.array([1.0, 3.0])
    condition = Condition("admittance-backstepping", rig, "ideal", 5, 0, True)
    direction, force = np.array([[1.0, 0.0], [0.0, 1.0]]), hand_lines(10.0, 5, frequency, period)
    reference = resting(POSES[:2], [2000.0] * 2)
    felt, lost = felt_impedance(condition, [rig] * 2, reference, direction, frequency, force, period, 1)
    assert not lost.any()

    def hand(now, position, velocity):
        return direction * (force * np.exp(2j * np.pi * frequency * now)).sum().real * min(now / 0.5, 1.0)

    recording = record(RigPort([rig] * 2, reference, condition.law()), hand, 6.0).part(5.0, 6.0)
    turns = np.exp(-2j * np.pi * frequency[:, None] * recording.time)
    moved = 2 / len(recording.time) * turns @ np.einsum("tin,in->tn", recording.position - recording.position[0], direction)
    # The port answers four times a period, the loop holds its force for one: (2 pi f h)^2/24 of 3 Hz is 1.5e-5.
    np.testing.assert_allclose(felt, force[:, None] / moved, rtol=1e-3)
    declared = declared_by(condition.law(), reference).along(frequency, direction)
    np.testing.assert_allclose(np.abs(felt / declared), 1.0, atol=0.1)


@pytest.mark.parametrize("hertz", [2.0, 8.0])
def test_openings_of_a_push_along_a_cylinder_without_friction(hertz):
    """Along cylinder 2 its pressures carry -(K + jw (B - Fv)) X, of which w X/C of the flow follows by hand."""
    rig = IDEAL.replace({"mechanics.gravity": 0.0})
    pose = np.array(POSES[1])
    direction, reference = (pose / np.hypot(*pose))[:, None], resting([tuple(pose)], [2000.0])
    declared = mass_spring_damper(reference, rig.mechanics.mass, 0.7)
    peak, w, p = 1.0, 2 * np.pi * hertz, Rig(parameter_column(rig))
    found = commanded_openings(rig, reference, declared, direction, np.array([hertz]), np.array([[peak + 0j]]), 4.0)[0, 0]
    damping = float(declared.damping[0, 0, 0])
    moved = peak / abs(2000.0 - w * w * rig.mechanics.mass + 1j * w * damping)
    y = inverse_geometry(pose[:, None], rig)
    pp, pn = balanced_state(parameter_array([rig], 1), y, None, reference.pneumatic_stiffness)[[PP2, PN2], 0]
    carried = abs(reference.pneumatic_stiffness[1, 0] - 2000.0 - 1j * w * (damping - p.fv2)) * moved
    flow = w * carried * 2 * p.half_l2 / (2 * p.index * p.gas * p.temperature)
    (fill_p, drain_p), (fill_n, drain_n) = driving_flows(pp, p), driving_flows(pn, p)
    length_p, length_n = p.half_l2 + y[1, 0], p.half_l2 - y[1, 0]
    weaker = min(fill_p / length_p + drain_n / length_n, drain_p / length_p + fill_n / length_n)
    opening = flow / (p.conductance * p.half_l2 * weaker)
    # Lengths and pressures move with the head by 1 %; slopes are differences over 1 ms, a fortieth of a radian at 8 Hz.
    assert found == pytest.approx(opening * np.hypot(1.0, w * p.tau), rel=0.03)
