"""Both pistons of a rig under ``bristle_filter``, with what is known to act on them: chambers, weight and the turning lever."""

from baselines.estimation import dry_friction
from baselines.estimation.hand import bristle_filter
from baselines.estimation.hand.bristle_filter import Bristled
from birthsim_env.loop.signals import Joints, PerChamber
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.linkage import mechanics

LATE = 0.002
"""s; found by trial: a moving head is off by so much times its speed, as ``identify`` leaves 0.5 to 1 ms of a latency."""


@helper
def loads(i: int, joints: Joints, air: PerChamber, pose: tuple[float, ...], p: Rig) -> tuple[float, float, float, float]:
    """Forces of the chambers along both pistons of lane ``i``, N, and their accelerations without any force, m/s2."""
    r4, r2, w, s2, _, kappa, sine, cosine = pose
    v1, v2 = joints.speed[0, i], joints.speed[1, i]
    own1 = mechanics.acceleration1(0.0, v1, v2, r2, r4, w, s2, kappa, sine, p.inverse_mass, p.gravity)
    own2 = mechanics.acceleration2(0.0, v1, r2, r4, s2, cosine, p.inverse_mass, p.gravity)
    load1 = mechanics.piston_force(air.p1[i], air.n1[i], p.area_p1, p.area_n1, p.atmosphere)
    load2 = mechanics.piston_force(air.p2[i], air.n2[i], p.area_p2, p.area_n2, p.atmosphere)
    return load1, load2, own1, own2


@helper
def carry(
    b: Bristled,
    i: int,
    joints: Joints,
    air: PerChamber,
    pose: tuple[float, ...],
    noise: float,
    push_noise: float,
    p: Rig,
    period: float,
    new: bool,
) -> None:
    """Carries both pistons of lane ``i`` on by a period, or starts them where ``joints`` are.

    ``noise``, m, is that of a position sample; ``push_noise`` is that of ``bristle_filter.predict``.
    """
    kappa, law = pose[5], bristle_filter.lugre(p)
    load1, load2, own1, own2 = loads(i, joints, air, pose, p)
    for k in range(2):
        b.level[k, i] = dry_friction.level_at(k, air.rows, i, p)
    if new:
        start1, start2 = -load1 - own1 * p.mass * kappa * kappa, -load2 - own2 * p.mass
        bristle_filter.begin(b, 0, i, joints.position[0, i], joints.speed[0, i], start1, noise / kappa, law, p)
        bristle_filter.begin(b, 1, i, joints.position[1, i], joints.speed[1, i], start2, noise, law, p)
    answer1 = p.inverse_mass / (kappa * kappa)
    bristle_filter.predict(b, 0, i, load1, own1, answer1, push_noise, 0.0, 0.0, law, p, period)
    bristle_filter.predict(b, 1, i, load2, own2, p.inverse_mass, push_noise, 0.0, 0.0, law, p, period)


@helper
def see(b: Bristled, i: int, sample: Joints, joints: Joints, kappa: float, age: float, noise: float) -> None:
    """Takes a position ``sample`` of both pistons of lane ``i`` that is ``age`` s old and has ``noise``, m, along piston 2."""
    for k in range(2):
        v, spread = joints.speed[k, i], noise / kappa if k == 0 else noise
        bristle_filter.correct(b, k, i, sample.position[k, i] - (b.position[k, i] - v * age), spread + LATE * abs(v))
