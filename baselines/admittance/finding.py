"""What the law gives the filter that finds its rig (``rig_filter``): one call a control period."""

from baselines.admittance.rows import Constants, Memory
from baselines.estimation import dry_friction, rig_filter
from baselines.estimation.rig_filter import BALANCE, RigFilter
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.stack import column
from birthsim_env.physics.linkage import geometry, mechanics


@helper
def find(finder: RigFilter, i: int, seen: Seen, memory: Memory, constants: Constants, own: Constants, left: float) -> bool:
    """Carries the filter of lane ``i`` on by one period; returns whether the lane is to be told what was found.

    ``own`` are the ``constants`` with the rig that the lane believes in now, ``left`` is what ``believe`` returns."""
    described, p, period = constants.model.rig, own.model.rig, constants.model.period
    joints, chambers, pistons = memory.joints, memory.chambers, memory.pistons
    if memory.fresh[i] > 0.0:
        for chamber in range(4):
            finder.pressure[chamber, i], finder.spool[chamber, i] = seen.pressure[chamber, i], 0.0
        return False
    for a in range(rig_filter.SIZE):
        finder.believed[a, i] = finder.told[a, i] + left * (finder.believed[a, i] - finder.told[a, i])
    for chamber in range(4):
        rig_filter.read_chamber(
            finder,
            i,
            chamber,
            chambers.opening[chamber, i],
            seen.pressure[chamber, i],
            joints,
            period,
            constants.cell_noise,
            p,
        )
    finder.since[i] += period
    finder.age[i] += period
    due: bool = finder.since[i] >= rig_filter.EVERY
    signals = column(BALANCE)
    _, _, _, _, _, kappa, sine, cosine = geometry.pose(
        joints.position[0, i], joints.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
    )
    fx, fy, share = seen.user_force[0, i], seen.user_force[1, i], period * constants.model.bandwidth
    for k in range(2):
        pressure_p, pressure_n, speed = chambers.pressure[2 * k, i], chambers.pressure[2 * k + 1, i], joints.speed[k, i]
        area_p, area_n, viscous = (p.area_p1, p.area_n1, p.fv1) if k == 0 else (p.area_p2, p.area_n2, p.fv2)
        hand = mechanics.user_force1(fx, fy, kappa, sine, cosine) if k == 0 else mechanics.user_force2(fx, fy, sine, cosine)
        load = mechanics.piston_force(pressure_p, pressure_n, area_p, area_n, p.atmosphere) - viscous * speed
        drag = p.s0 * memory.bristle[k, i]
        fed = -constants.friction_fraction * memory.friction.level[k, i] * drag
        along = drag / dry_friction.level_at(k, chambers.pressure, i, p) if drag * speed > 0.0 else 0.0
        signals[rig_filter.HAND] = hand + (area_p - area_n) * (pressure_n - p.atmosphere)
        signals[rig_filter.SPECIFIC] = (load + hand + fed) / memory.inertia.mass[i]
        signals[rig_filter.SPEED], signals[rig_filter.DIFFERENCE] = speed, pressure_p - pressure_n
        signals[rig_filter.SLIDING] = along * speed * speed / (speed * speed + rig_filter.SLOW * rig_filter.SLOW)
        rig_filter.remember(finder, i, k, signals, share / (1.0 + share))
        half = p.half_l1 if k == 0 else p.half_l2
        if due and abs(joints.position[k, i]) < half - rig_filter.MARGIN:
            found = pistons.disturbance[k, i] * (kappa * kappa if k == 0 else 1.0)
            rig_filter.balance(finder, i, k, found, chambers.pressure, described)
    finder.fresh[i] = 0.0
    if due:
        finder.since[i] = 0.0
    return due
