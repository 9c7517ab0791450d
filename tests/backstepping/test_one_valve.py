"""One 5/3 valve per cylinder: opposite openings, and the pneumatic stiffness settles by itself."""

import numpy as np
from scipy.optimize import brentq

from baselines import BacksteppingController
from baselines.bench.probes import POSES
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Cylinder, Parameters
from tests.backstepping.test_backstepping import as_signals, random_situations
from tests.oracles import closed_loop, rigid_body
from tests.oracles import derived_law as derived
from tests.oracles.closed_loop import AT_ONCE, FRICTIONLESS


def test_openings_are_opposite_and_give_the_force_rate() -> None:
    """dF/dt that the flows through both orifices make is the law's, wherever the valve is not saturated."""
    rig = Parameters().replace(AT_ONCE)
    s = random_situations(rig, 0.01, True, 400, np.random.default_rng(5))
    law = BacksteppingController(rig, weight_compensation=True, sign_width=0.01, valves="one_valve")
    u, terms = law.command(*as_signals(s, rig)), law.inspect(*as_signals(s, rig))
    assert np.array_equal(u[[1, 3]], -u[[0, 2]])
    free = np.abs(u[[0, 2]]) < 1
    assert 100 < free.sum() < free.size
    now = rigid_body.Instant(s["piston"], s["speed"], s["pressures"], s["pneumatic"])
    np.testing.assert_allclose(rigid_body.force_rates(u, now, rig)[free], terms.force_rate[free], rtol=1e-9, atol=1e-4)


def balance(force: float, cylinder: Cylinder, rig: Parameters) -> Array:
    """Pp and Pn at which a valve with opposite openings holds both pressures, and their difference the force."""
    area_p, area_n = derived.areas(cylinder)

    def held(opening: float) -> Array:
        limits = (rig.air.atmospheric_pressure, rig.air.supply_pressure)
        return np.array([brentq(lambda p, s=s: derived.net_flow(s, p, rig), *limits) for s in (opening, -opening)])

    return held(brentq(lambda opening: held(opening) @ [area_p, -area_n] - force, -1.0, 1.0, xtol=1e-12))


def test_pressures_settle_where_leakage_balances() -> None:
    """Each chamber ends where its valve's flows balance: within ten seconds with valves that leak ten times more."""
    rig = FRICTIONLESS.replace({"valves.leakage_ratio": 0.05})
    reference = closed_loop.holding(np.ascontiguousarray(np.array(POSES).T), 2000.0)
    plant, law = closed_loop.resting_at(reference, rig), BacksteppingController(rig, True, valves="one_valve")
    push, rest = np.array([[8.0], [0.0]]), reference.position
    start = plant.pressures
    for time, _, _, openings in closed_loop.run(
        plant, law.command, lambda t: reference, lambda t: push * np.clip(t - 10, 0, 1) * np.ones(len(POSES)), 12.0
    ):
        assert np.abs(openings).max() < 0.5
        if time == 10.0:
            settled, rest = plant.pressures, plant.end_effector()[:2]
    for lane in range(len(POSES)):
        for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
            chambers = slice(2 * i, 2 * i + 2)
            force = derived.forces(settled[:, lane], rig)[i]
            np.testing.assert_allclose(settled[chambers, lane], balance(force, cylinder, rig), rtol=0.01)
    assert np.abs(settled - start).max() > 1e5
    assert settled.min() > 3e5
    assert settled.max() < 6.5e5
    moved = plant.end_effector()[:2] - rest
    np.testing.assert_allclose(8.0 / moved[0], 2000.0, rtol=0.02)
