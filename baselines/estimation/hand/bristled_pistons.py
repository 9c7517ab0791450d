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
def carry(
    b: Bristled,
    i: int,
    joints: Joints,
    air: PerChamber,
    pose: tuple[float, ...],
    noise: float,
    push_noise: float,
    unseen: float,
    p: Rig,
    period: float,
    new: bool,
) -> tuple[float, float]:
    """Carries both pistons of lane ``i`` on by a period, or starts them where ``joints`` are; forces of the chambers, N.

    ``noise``, m, is that of a position sample; ``push_noise`` and ``unseen`` are those of ``bristle_filter.predict``.
    """
    r4, r2, w, s2, _, kappa, sine, cosine = pose
    v1, v2 = joints.speed[0, i], joints.speed[1, i]
    own1 = mechanics.acceleration1(0.0, v1, v2, r2, r4, w, s2, kappa, sine, p.inverse_mass, p.gravity)
    own2 = mechanics.acceleration2(0.0, v1, r2, r4, s2, cosine, p.inverse_mass, p.gravity)
    load1 = mechanics.piston_force(air.p1[i], air.n1[i], p.area_p1, p.area_n1, p.atmosphere)
    load2 = mechanics.piston_force(air.p2[i], air.n2[i], p.area_p2, p.area_n2, p.atmosphere)
    for k in range(2):
        b.level[k, i] = dry_friction.level_at(k, air.rows, i, p)
    if new:
        bristle_filter.begin(b, 0, i, joints.position[0, i], v1, -load1 - own1 * p.mass * kappa * kappa, noise / kappa, p)
        bristle_filter.begin(b, 1, i, joints.position[1, i], v2, -load2 - own2 * p.mass, noise, p)
    bristle_filter.predict(b, 0, i, load1, own1, p.inverse_mass / (kappa * kappa), push_noise, unseen, p, period)
    bristle_filter.predict(b, 1, i, load2, own2, p.inverse_mass, push_noise, unseen, p, period)
    return load1, load2


@helper
def see(b: Bristled, i: int, sample: Joints, joints: Joints, kappa: float, age: float, noise: float) -> None:
    """Takes a position ``sample`` of both pistons of lane ``i`` that is ``age`` s old and has ``noise``, m, along piston 2."""
    for k in range(2):
        v, spread = joints.speed[k, i], noise / kappa if k == 0 else noise
        bristle_filter.correct(b, k, i, sample.position[k, i] - (b.position[k, i] - v * age), spread + LATE * abs(v))
