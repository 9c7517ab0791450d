"""The compiled law: how many lanes it could not serve, how short a chamber counts, what it remembers and believes."""

import numpy as np
import pytest

from baselines import BacksteppingController
from baselines.backstepping import law as kernel
from baselines.valve_inverse import air_at
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Joints, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.geometry import joint_force
from birthsim_env.physics.rig.parameters import Parameters
from tests.backstepping.test_backstepping import many
from tests.oracles import closed_loop


@pytest.mark.parametrize("ratio", [0.0, 1.2])
def test_lanes_without_gains_are_counted_once_each(ratio: float) -> None:
    """Below the least stiffness of either cylinder or of both; the others have their gains."""
    stiffness = np.array([[2000.0, 20.0, 2000.0, 20.0, 3000.0], [2000.0, 2000.0, 1.0, 1.0, 3000.0]])
    lanes = stiffness.shape[1]
    options = kernel.Options(kernel.Options.lane(pneumatic_gain=30.0, sign_width=0.01, damping_ratio=ratio))
    seen, at_rest = Seen(np.zeros((Seen.size, lanes))), Joints(np.zeros((Joints.size, lanes)))
    seen.asked.position[0], seen.asked.stiffness[:], seen.pressure[:] = 0.5, stiffness, 3e5
    seen.asked.pneumatic_stiffness[0], seen.asked.pneumatic_stiffness[1] = 4400.0, 2200.0
    served = Rig(parameter_column(Parameters()))
    few = kernel.command(seen, at_rest, served, options, lanes)
    alone = [
        kernel.command(Seen(seen.rows[:, [k]].copy()), Joints(at_rest.rows[:, [k]].copy()), served, options, 1)
        for k in range(lanes)
    ]
    assert alone == [0, 1, 1, 1, 0]
    assert few == 3


def test_no_chamber_counts_as_shorter_than_two_millimetres() -> None:
    p = Rig(parameter_column(Parameters()))
    for k, half in enumerate((p.half_l1, p.half_l2)):
        beyond = ((0.03, half + 0.03, half - 0.03), (half - 0.0015, 2 * half - 0.0015, 0.002), (-2 * half, 0.002, 3 * half))
        for y, length_p, length_n in beyond:
            air = air_at(k, 3e5, 3e5, y, 0.0, p)
            assert (air.length_p, air.length_n) == pytest.approx((length_p, length_n))


def test_the_law_has_no_memory_of_exact_measurements() -> None:
    measured, reference, _ = many(5)
    law = BacksteppingController()
    first = law.command(measured, reference)
    assert np.array_equal(law.command(measured, reference), first)
    law.reset(np.array([True, False, True, False, False]))
    law.reset()
    assert np.array_equal(law.command(measured, reference), first)


def test_believing_the_users_force_removes_the_compliance() -> None:
    """Pushed with 10 N on each axis: 5 mm at 2000 N/m; nothing where the law is told of it along the cylinders (17)."""
    rig = closed_loop.FRICTIONLESS
    reference = closed_loop.holding(np.array([[0.5, 0.5, 0.45, 0.45], [0.0, 0.0, 0.05, 0.05]]), 2000.0)
    plant, law = closed_loop.resting_at(reference, rig), BacksteppingController(rig, weight_compensation=True)
    told, push = np.array([0.0, 1.0, 0.0, 1.0]), np.full((2, 4), 10.0)

    def command(measured: Measurement, reference: Reference) -> Array:
        return law.command(measured, reference, told * joint_force(measured.user_force, plant.piston, rig))

    for _ in closed_loop.run(plant, command, lambda t: reference, lambda t: push * min(t / 0.5, 1.0), 2.0):
        pass
    moved = plant.end_effector()[:2] - reference.position
    np.testing.assert_allclose(moved[:, told == 0], 0.005, rtol=0.01)
    np.testing.assert_allclose(moved[:, told == 1], 0, atol=0.00001)
