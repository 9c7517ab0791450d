"""The Lyapunov function of the backstepping law, to be followed along any run.

Per cylinder, with w = g z3 and e the error of the pneumatic stiffness in a unit of its own,
    V = (z1^2 + z2^2 + w^2 + e^2) / 2
Along the control model (13), or (5) with weight compensation, under the law and with constant setpoints
    z1' = z2 - c1 z1,  z2' = w - z1 - c2 z2 + c1' z1,  e' = -c4 e
    w'  = -z2 - (c3 - g'/g) w + (c1' + c2') z2 + (c2 - c1) c1' z1
since the law takes its gains as constant and divides dF*/dt by g, not by its integral. So
    V' = -c1 z1^2 - c2 z2^2 - (c3 - g'/g) w^2 - c4 e^2 + c1' z1 z2 + (c2 - c1) c1' z1 w + (c1' + c2') z2 w

Proved is therefore: cylinder 2 has a constant g, so that at constant gains V falls at least as exp(-2 min(c1, c2, c3, c4) t).
For cylinder 1, g = 1/(m kappa^2) and g'/g = -2 kappa'/kappa: there V falls as long as kappa'/kappa > -c3/2, which is some
-20 1/s, where a speed of 1 m/s makes some 5 1/s. The gains vary with the pose where Kclx and Kcly differ, and on cylinder 1 by
its viscous friction; then V falls where ``decay`` is positive. Nothing is proved for a setpoint that jumps (V jumps with the
gains), valves that lag or saturate, or forces that the model does not know, such as the hand's.
"""

import copy
from dataclasses import dataclass

import numpy as np

from baselines.backstepping.controller import BacksteppingController
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import jacobian
from birthsim_env.physics.rig.parameters import Parameters

PNEUMATIC_UNIT = 1e-5
"""e per N/m of pneumatic stiffness; assumed: an error of 100 N/m weighs as much as 1 mm."""


@dataclass(frozen=True)
class LyapunovValue:
    """V at one instant in N lanes; the second-last axis counts cylinders 1 and 2.

    ``errors`` (4, 2, N): z1 (m), z2 (m/s), w = g z3 (m/s2), e. ``value`` (2, N): V, the sum of their squares over 2. ``rate``
    (2, N): V' as the model predicts it. ``decay`` (2, N), 1/s: the largest number with V' <= -2 decay V for all errors in
    this pose and at this speed.
    """

    errors: Array
    value: Array
    rate: Array
    decay: Array


class LyapunovFunction:
    """V and its predicted rate along a run of ``law``, of whose observer it keeps a copy.

    With one valve per cylinder, where the pneumatic stiffness is nobody's aim, e is zero. Raises ``ValueError`` for a law with
    frozen friction, which has left the proof.
    """

    def __init__(self, law: BacksteppingController) -> None:
        if law.frozen_friction:
            raise ValueError("law.frozen_friction = True; allowed: False, for the proof needs the whole of dF*/dt")
        self._law = copy.deepcopy(law)
        self._law.reset()

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        self._law.reset(lanes)

    def evaluate(self, measurement: Measurement, reference: Reference) -> LyapunovValue:
        """V for signals over N lanes, once per control period.

        Raises ``ValueError`` for signals over different numbers of lanes.
        """
        law, rig, terms = self._law, self._law.parameters, self._law.inspect(measurement, reference)
        (y, v), (yd, vd) = terms.joints.reshape(2, 2, -1), terms.wanted[:4].reshape(2, 2, -1)
        (c1, c2, c3), (c1_rate, c2_rate, _) = terms.gains, terms.gain_rates
        inertia, growth = apparent_masses(terms.joints, rig)
        z1 = y - yd
        z2 = v - vd + c1 * z1
        w = (pneumatic_forces(measurement.pressures, rig) - terms.wanted_force) / inertia
        pneumatic = (reference.pneumatic_stiffness_rate - terms.pneumatic_stiffness_rate) / law.pneumatic_gain
        e = PNEUMATIC_UNIT * pneumatic * (law.valves == "two_valves")
        # -V' as a quadratic form of z1, z2, w.
        form = np.zeros((*z1.shape, 3, 3))
        form[..., 0, 0], form[..., 1, 1], form[..., 2, 2] = c1, c2, c3 + growth
        form[..., 0, 1] = form[..., 1, 0] = -c1_rate / 2
        form[..., 0, 2] = form[..., 2, 0] = -(c2 - c1) * c1_rate / 2
        form[..., 1, 2] = form[..., 2, 1] = -(c1_rate + c2_rate) / 2
        z = np.stack([z1, z2, w])
        rate = -np.einsum("icn,cnij,jcn->cn", z, form, z) - law.pneumatic_gain * e**2
        decay = np.linalg.eigvalsh(form)[..., 0]
        if law.valves == "two_valves":
            decay = np.minimum(decay, law.pneumatic_gain)
        return LyapunovValue(np.stack([z1, z2, w, e]), ((z**2).sum(axis=0) + e**2) / 2, rate, decay)


def apparent_masses(joints: Array, parameters: Parameters) -> tuple[Array, Array]:
    """m_e = 1/g of both cylinders, kg, and m_e'/m_e, 1/s, both (2, N), at ``joints`` (4, N): y1, y2 (m), v1, v2 (m/s)."""
    g, (y1, y2, v1, v2) = parameters.geometry, joints
    r4, r2 = y1 + g.k1, y2 + g.k2
    w = r4**2 - g.d3**2 - g.d6**2
    growth = v2 / r2 + v1 / r4 + 2 * r4 * w * v1 / (4 * g.d3**2 * g.d6**2 - w**2)
    squares = (jacobian(joints[:2], parameters) ** 2).sum(axis=0)
    return parameters.mechanics.mass * squares, np.stack([2 * growth, np.zeros_like(growth)])


def pneumatic_forces(pressures: Array, parameters: Parameters) -> Array:
    """F = Pp Sp - Pn Sn (3) of both cylinders, N, (2, N), for the pressures (4, N), Pa."""
    a, b = parameters.cylinder1, parameters.cylinder2
    return np.stack([pressures[0] * a.area_p - pressures[1] * a.area_n, pressures[2] * b.area_p - pressures[3] * b.area_n])
