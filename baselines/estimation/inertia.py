"""The mass that pistons move, from how they answer to force.

    F = m (a + g)   across and along cylinder 2, with F the force of chambers, hand and believed friction

The observer adds d to the acceleration F/m that it expects, and follows the truth with its bandwidth. So F, low-passed like
that, and F/m + d are force and acceleration at one instant. Both are high-passed: weight, biases and friction of a piston that
slides one way do not change, and so tell nothing. With x and y the two that are left of either direction,
    1/m = (P/m0 + sum of x y)/(P + sum of x^2)
is a regression that begins at the believed mass m0. Friction that turns moves x alone: what is found is rather too heavy, so a
mass above m0 is not learned. A rig that is lighter than believed swings, and by that tells its mass.
"""

from baselines.estimation.rows import AssumedParameters, Inputs, Pistons
from birthsim_env.loop.signals import PerChamber
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows
from birthsim_env.physics.linkage import mechanics

LEAST = 0.25
"""assumed: every rig has at least this fraction of the believed mass."""

PRIOR = 20.0
"""P, N2 s: weight of the believed mass; found by trial. A head that swings by 20 N outweighs it in 0.1 s."""

CHANGE = 30.0
"""1/s, of the high-pass; found by trial. Rigs that are too light swing at 40 to 60 1/s."""


class Inertia(Rows):
    """What is learned of the mass."""

    mass = row("kg", "mass")
    first = rows("first_t first_n", "N", "force across and along cylinder 2, low-passed once")
    second = rows("second_t second_n", "N", "low-passed twice")
    force = rows("force_t force_n", "N", "low-passed three times, as the observer does")
    steady = rows("steady_t steady_n", "N", "what of it does not change")
    pull = rows("pull_t pull_n", "m/s2", "what of the acceleration, weight included, does not change")
    squares = row("N2 s", "sum of x^2")
    products = row("N m/s", "sum of x y")


@helper
def learn(
    inertia: Inertia,
    i: int,
    pose: tuple[float, float, float],
    pistons: Pistons,
    pressures: Array,
    inputs: Inputs,
    assumed: AssumedParameters,
    fresh: Array,
) -> None:
    """Carries lane ``i`` on by one period; ``pose`` is kappa, sin(theta1) and cos(theta1), ``pressures`` (4, N) in Pa."""
    (kappa, sine, cosine), p, period, air = pose, assumed.rig, assumed.period, PerChamber(pressures)
    fx, fy, mass = inputs.force[0, i], inputs.force[1, i], inertia.mass[i]
    load1 = mechanics.piston_force(air.p1[i], air.n1[i], p.area_p1, p.area_n1, p.atmosphere) - p.fv1 * pistons.speed[0, i]
    load2 = mechanics.piston_force(air.p2[i], air.n2[i], p.area_p2, p.area_n2, p.atmosphere) - p.fv2 * pistons.speed[1, i]
    across = cosine * fx + sine * fy - (load1 + inputs.believed[0, i]) / kappa
    along = sine * fx - cosine * fy + load2 + inputs.believed[1, i]
    share = period * assumed.bandwidth / (1.0 + period * assumed.bandwidth)
    for k in range(2):
        force, found = (across, -kappa * pistons.disturbance[0, i]) if k == 0 else (along, pistons.disturbance[1, i])
        if fresh[i] > 0.0:
            inertia.first[k, i], inertia.second[k, i], inertia.force[k, i] = force, force, force
            inertia.steady[k, i], inertia.pull[k, i] = force, force / mass
        inertia.first[k, i] += share * (force - inertia.first[k, i])
        inertia.second[k, i] += share * (inertia.first[k, i] - inertia.second[k, i])
        inertia.force[k, i] += share * (inertia.second[k, i] - inertia.force[k, i])
        pull = inertia.force[k, i] / mass + found
        inertia.steady[k, i] += period * CHANGE * (inertia.force[k, i] - inertia.steady[k, i])
        inertia.pull[k, i] += period * CHANGE * (pull - inertia.pull[k, i])
        x, y = inertia.force[k, i] - inertia.steady[k, i], pull - inertia.pull[k, i]
        inertia.squares[i] += period * x * x
        inertia.products[i] += period * x * y
    lightness = p.mass * (PRIOR / p.mass + inertia.products[i]) / (PRIOR + inertia.squares[i])
    inertia.mass[i] = p.mass / max(1.0, min(1.0 / LEAST, lightness))
