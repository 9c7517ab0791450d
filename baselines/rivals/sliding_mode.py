"""Sliding mode of each piston about the motion that it follows.

With e = y - yd, its derivatives from the measured pressures by the control model, d2e/dt2 = (F - F* - Fv de/dt)/m_e, and the
integral E of e beyond a dead zone, the surface is of third order in E,
    s = (d/dt + r)^3 E = d2e/dt2 + 3 r de/dt + 3 r^2 e + r^3 E.
By (5) and (10) the equivalent control and the switching term in a boundary layer,
    dF/dt = dF*/dt + Fv d2e/dt2 - m_e (3 r d2e/dt2 + 3 r^2 de/dt + r^3 dE/dt) - m_e h sat(s/layer),   layer = h/b,
make ds/dt = -h sat(s/layer): the layer is reached in (|s| - layer)/h, inside s decays at the rate b. s, h and layer are those
at the end effector (kappa s of cylinder 1). h must beat 3 r times the acceleration by which the model is wrong. dF/dt goes to
the valves as in the paper, with its regulation of the pneumatic stiffness.

These commands found the gains (with ideal, then with lab) by the search that birthsim-tune had before it used Optuna:
    birthsim-tune --controller sliding-mode --trials 75 --seed 0 --sensors ideal --out out/tune/sliding-mode-ideal
"""

from __future__ import annotations

from typing import ClassVar

from baselines.backstepping.controller import PNEUMATIC_GAIN
from baselines.rivals.feedforward import FORCE1, KAPPA, RATE1
from baselines.rivals.tracking import LEAST_LENGTH, MEMORY, TrackingController, beyond, carry_on, held, signals
from baselines.valve_inverse import two_valve_openings
from birthsim_env.loop.rows import SEEN
from birthsim_env.loop.stage import block, numbers
from birthsim_env.physics import control_model
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS

PERIOD, SURFACE, REACHING, LAYER, ZONE, STIFFNESS_GAIN, RIG = range(7)
"""Constants of the stage: control period, s; r, 1/s; h, m/s3; b, 1/s; dead zone, m; c4, 1/s. The rig follows."""


@kernel
def control(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Carries the integrals, m s, on. The signals are those of ``tracking``."""
    s, m, about = block(seen, SEEN), block(memory, MEMORY), numbers(constants, RIG + PARAMETERS)
    (joints, wanted, needed, pressures, target, openings), p = signals(s), about[RIG:]
    r, reaching, inside, zone, c4 = about[SURFACE], about[REACHING], about[LAYER], about[ZONE], about[STIFFNESS_GAIN]
    for cylinder in range(2):
        row = 2 * cylinder
        ap, an = (p[at.AREA_P1], p[at.AREA_N1]) if cylinder == 0 else (p[at.AREA_P2], p[at.AREA_N2])
        half, viscous = (p[at.HALF_L1], p[at.FV1]) if cylinder == 0 else (p[at.HALF_L2], p[at.FV2])
        for i in range(n):
            y, v, pp, pn = joints[cylinder, i], joints[2 + cylinder, i], pressures[row, i], pressures[row + 1, i]
            scale = needed[KAPPA, i] if cylinder == 0 else 1.0
            mass = p[at.MASS] * scale * scale
            excess = pp * ap - pn * an - needed[FORCE1 + cylinder, i]
            error, error_rate = y - wanted[cylinder, i], v - wanted[2 + cylinder, i]
            second = (excess - viscous * error_rate) / mass
            summed = held(m, cylinder, i, -excess / (mass * r * r * r))
            slope = beyond(error, zone / scale)
            surface = scale * (second + r * (3.0 * error_rate + r * (3.0 * error + r * summed)))
            switched = max(-reaching, min(reaching, inside * surface)) / scale
            turned = viscous / mass * second - r * (3.0 * second + r * (3.0 * error_rate + r * slope)) - switched
            rate = needed[RATE1 + cylinder, i] + mass * turned
            lp, ln = max(half + y, LEAST_LENGTH), max(half - y, LEAST_LENGTH)
            stiffness = control_model.pneumatic_stiffness(pp, pn, ap, an, lp, ln, p[at.INDEX])
            stiffness_rate = target[12 + cylinder, i] - c4 * (stiffness - target[10 + cylinder, i])
            two_valve_openings(openings, i, row, rate, stiffness_rate, pp, pn, ap, an, lp, ln, v, p)
            carry_on(m, cylinder, i, summed, slope, about[PERIOD], openings)
    return 0


class SlidingMode(TrackingController):
    """Third-order sliding mode about the compliant motion (this module).

    Arguments are those of ``TrackingController``. The gains are friction_fraction, dead_zone and three more:

    - surface_rate: r, 1/s, at which errors decay on the surface;
    - reaching_rate: h, m/s3, at which the boundary layer is approached;
    - layer_rate: b, 1/s, at which s decays inside the layer, which is h/b thick.
    """

    LAW = staticmethod(control)
    TUNABLE: ClassVar[dict[str, tuple[float, float]]] = {
        "surface_rate": (10.0, 100.0),
        "reaching_rate": (100.0, 10000.0),
        "layer_rate": (10.0, 200.0),
        "friction_fraction": (0.0, 1.0),
        "dead_zone": (0.0, 5e-4),
    }
    TUNED: ClassVar[dict[str, dict[str, float]]] = {
        "ideal": {
            "surface_rate": 72.36,
            "reaching_rate": 2607.0,
            "layer_rate": 14.79,
            "friction_fraction": 0.2856,
            "dead_zone": 1.763e-05,
        },
        "lab": {
            "surface_rate": 28.38,
            "reaching_rate": 955.9,
            "layer_rate": 46.51,
            "friction_fraction": 0.7042,
            "dead_zone": 0.0002013,
        },
    }

    def _design(self, gains: dict[str, float]) -> tuple[float, ...]:
        return gains["surface_rate"], gains["reaching_rate"], gains["layer_rate"], gains["dead_zone"], PNEUMATIC_GAIN
