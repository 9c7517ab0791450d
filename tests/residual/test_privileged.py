"""What a privileged policy is told is what was drawn, and no more."""

import gymnasium
import numpy as np

from agents.residual.privileged import TRUE_PARAMETERS, acting, true_parameters, with_true_parameters
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.rig.parameters import Parameters

LANES = 64


def make(**arguments):
    env = gymnasium.make_vec("BirthSIM/CircleResidual-v2", num_envs=LANES, **arguments)
    env.reset(seed=5)
    return env


def test_as_described_nothing_is_special():
    figures = true_parameters(make(sensors="lab"))
    np.testing.assert_array_equal(figures, np.tile([1.0] * (TRUE_PARAMETERS - 6) + [0.0] * 6, (LANES, 1)).astype(np.float32))


def described(rig, names):
    """What the owner describes, of the edges' curvatures the slopes."""
    values = [getattr(getattr(rig, section), own) for section, own in (name.split(".") for name in names)]
    overlap = dict(zip(names, values, strict=True))
    for name, value in zip(names, values, strict=True):
        beside = overlap.get(name.replace("curvature", "overlap"))
        yield (1 + value) / (1 - beside) if name.endswith("curvature") else value


def test_every_figure_of_the_rig_that_is_drawn_is_told():
    nominal, ranges = Parameters(), documented_ranges(Parameters())
    figures = true_parameters(make(randomize="plant")).T[:-9]
    names = (
        "mechanics.mass", "cylinder1.coulomb_friction", "cylinder2.coulomb_friction", "cylinder1.pressure_friction",
        "cylinder2.pressure_friction", "cylinder1.viscous_friction", "cylinder2.viscous_friction", "friction.bristle_stiffness",
        "valves.time_constant", "chambers.dead_volume", "chambers.wall_heat_transfer",
        "valves.supply_overlap", "valves.supply_curvature", "valves.exhaust_overlap", "valves.exhaust_curvature",
    )  # fmt: skip
    assert set(names) == set(ranges)
    told = dict(zip(names, figures * [[one] for one in described(nominal, names)], strict=True))
    for side in ("supply", "exhaust"):
        # Of an edge its slope is told.
        told[f"valves.{side}_curvature"] = told[f"valves.{side}_curvature"] * (1 - told[f"valves.{side}_overlap"]) - 1
    for name, row in told.items():
        low, high = ranges[name]
        assert low * (1 - 1e-5) <= row.min() < row.max() <= high * (1 + 1e-5), name
        spread = np.log if name == "friction.bristle_stiffness" else np.asarray
        assert np.ptp(spread(row)) > 0.8 * np.ptp(spread([low, high])), name


def test_supply_and_bores_are_told_where_a_rig_has_ranges_of_them():
    drawn = {"air.supply_pressure": 8e5, "cylinder1.piston_diameter": 0.02, "cylinder2.piston_diameter": 0.024}
    rig = Parameters(ranges=tuple((name, value, value) for name, value in drawn.items()))
    figures = true_parameters(make(randomize="plant", parameters=rig)).T[-9:-6]
    # Of bores the square is told, over that of the default 25 mm; the default supply has 7 bar.
    np.testing.assert_allclose(figures, np.repeat([[8 / 7], [0.64], [0.9216]], LANES, axis=1), rtol=1e-6)


def test_what_a_rig_has_none_of_is_told_as_it_is():
    names = ("coulomb_friction", "viscous_friction", "pressure_friction")
    rig = Parameters().replace({f"cylinder{k}.{name}": 0.0 for k in (1, 2) for name in names})
    figures = true_parameters(make(parameters=rig)).T
    np.testing.assert_array_equal(figures[1:7], 0.0)
    assert np.isfinite(figures).all()


def test_the_errors_of_honest_sensors_are_told():
    rig = Parameters().replace({f"electronics.{name}": 0.0 for name in ("position_noise", "pressure_noise", "missed_periods")})
    rig = rig.replace({"electronics.adc_bits": 0.0})
    env = make(sensors="honest", parameters=rig)
    figures, simulation = true_parameters(env).T[-6:], env.simulation
    seen = simulation.measurement
    # The first sample of an episode is not late. A single's 24 bits of numbers near 1.
    np.testing.assert_allclose(figures[4:], 1e3 * (seen.position - simulation.motion[:2]), atol=1e-6)
    np.testing.assert_allclose(figures[:4], (seen.pressures - simulation.plant.pressures) / 2000.0, atol=1e-6)
    assert (np.ptp(figures, axis=1) > 0.5).all()


def test_only_a_privileged_policy_is_told():
    env = make(randomize=True)
    seen = np.zeros((LANES, 4), np.float32)
    for privileged, length in ((False, 4), (True, 4 + TRUE_PARAMETERS)):
        assert acting(np.shape, env, privileged)(seen) == (LANES, length)
    np.testing.assert_array_equal(with_true_parameters(env, seen)[:, 4:], true_parameters(env))
