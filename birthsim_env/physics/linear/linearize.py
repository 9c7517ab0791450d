"""The plant linearised at rest: exact derivatives of ``dynamics.right_hand_side`` at a pose and chamber pressures.

Friction is not smooth, so the caller says how the pistons are. Either way dry friction carries what pressures, weight and hand
leave over, so that the point is a balance of forces.

- "stuck": the bristle of each piston is a spring s0 with damping s1 + Fv. The term |v| z of LuGre is even in v and has no slope
  on average. The Coulomb law has no bristle and becomes its regularisation, viscous with Fc/sign_speed + Fv; what is left over
  then accelerates the pistons (``OperatingPoint.rates``).
- "sliding": dry friction has reached its level, which does not change with small motions; Fv v is left, and the bristles are no
  states. The falling part of Stribeck's curve, below about ``stribeck_speed``, is left out.

Shut spools lie on a kink: opening fills a chamber from the supply, closing empties it to the atmosphere. The gain there is the
mean of both (``duals``). An opening on one side of zero, however small, gives the gain of that side.
"""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from birthsim_env.physics import control_model, dynamics, geometry, mechanics, options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, parameter_array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.linear.duals import Dual, lifted
from birthsim_env.physics.linear.model import LinearModel, OperatingPoint, Signal
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import shown

_UNITS = {"y": "m", "v": "m/s", "z": "m", "P": "Pa", "T": "K", "s": "1"}
STATES = tuple(Signal(name, _UNITS[name[0]]) for name in at.STATE_NAMES)
INPUTS = (*(Signal(name, "1") for name in ("u1P", "u1N", "u2P", "u2N")), Signal("Fx", "N"), Signal("Fy", "N"))
"""Opening that each spool goes to, and the hand's force."""
OUTPUTS = (
    *(Signal(name, "m") for name in ("x", "y")),
    *(Signal(name, "m/s") for name in ("vx", "vy")),
    *(Signal(name, "N") for name in ("F1", "F2")),
    *(Signal(name, "N/m") for name in ("K1", "K2")),
    *(Signal(f"{name}_out", "Pa") for name in ("Pp1", "Pn1", "Pp2", "Pn2")),
)
"""End effector, pneumatic forces (3) and stiffness (9) of the cylinders, chamber pressures."""

EDGE = 1e-9
"""Relative. Flow between equal pressures has a slope but its square root has none: pressures keep this far from the supply's
and the atmosphere's, deep inside the laminar range, where the slope is the same."""


def balanced_pressures(
    parameters: Parameters | str | Path | None, pose: ArrayLike, pneumatic_stiffness: ArrayLike = (4600.0, 2300.0)
) -> Array:
    """Pressures of chambers P1, N1, P2, N2, (4,), Pa, that carry the weight at rest at an end effector position (2,), m.

    ``pneumatic_stiffness`` (2,), N/m, is that of (9); one out of reach is approached. Raises ``ValueError`` for a pose
    outside the workspace and for a stiffness that is not finite.
    """
    rig = load_parameters(parameters)
    piston = geometry.inverse_geometry(checked("pose", pose, (2,), "m"), rig)
    stiffness = checked("pneumatic_stiffness", pneumatic_stiffness, (2,), "N/m")
    state = balanced_state(parameter_array(rig, 1), piston[:, None], None, stiffness[:, None])
    return state[list(at.PRESSURES), 0]


def linearize(
    parameters: Parameters | str | Path | None,
    pose: ArrayLike,
    pressures: ArrayLike | None = None,
    *,
    friction: str = "stuck",
    openings: ArrayLike = (0.0, 0.0, 0.0, 0.0),
    force: ArrayLike = (0.0, 0.0),
) -> LinearModel:
    """The plant near rest at an end effector position ``pose`` (2,), m, as a ``LinearModel``; air is at ambient temperature.

    ``pressures`` (4,), Pa absolute, of chambers P1, N1, P2, N2 (default: ``balanced_pressures``); ``openings`` (4,) of their
    spools; ``force`` (2,), N, of the hand; ``friction`` "stuck" or "sliding" (see above). Inputs are the openings that spools
    go to and the hand's force; deadband and hysteresis of the valves are left out. Raises ``ValueError`` for a pose outside the
    workspace, pressures that the air cannot have or friction cannot hold, and rigs with ``physics.options``.
    """
    rig = load_parameters(parameters)
    p = parameter_array(rig, 1)
    if not options.are_off(p):
        raise ValueError("linearize knows no supply line, tube or handle; allowed: a rig whose options are off")
    if friction not in ("stuck", "sliding"):
        raise ValueError(f"friction = {shown(friction)}; allowed: 'stuck', 'sliding'")
    piston = geometry.inverse_geometry(checked("pose", pose, (2,), "m"), rig)
    pressure = checked("pressures", balanced_pressures(rig, pose) if pressures is None else pressures, (4,), "Pa")
    low, high = float(p[at.ATMOSPHERE, 0]), float(p[at.SUPPLY, 0])
    if not np.all((pressure >= low * (1 - EDGE)) & (pressure <= high * (1 + EDGE))):
        raise ValueError(f"pressures = {shown(pressure.tolist())}; allowed: {low:g} to {high:g} (Pa, atmosphere to supply)")
    u, f = checked("openings", openings, (4,), "1").copy(), checked("force", force, (2,), "N").copy()
    if np.abs(u).max() > 1:
        raise ValueError(f"openings = {shown(u.tolist())}; allowed: -1 to 1")

    x = np.zeros(at.STATES)
    x[[at.Y1, at.Y2]] = piston
    x[list(at.PRESSURES)] = np.clip(pressure, low * (1 + EDGE), high * (1 - EDGE))
    x[list(at.TEMPERATURES)] = p[at.TEMPERATURE, 0]
    x[list(at.SPOOLS)] = u
    kept = np.ones(at.STATES, dtype=bool)
    has_bristle = p[at.LUGRE, 0] + p[at.ELASTO_PLASTIC, 0] > 0.5
    level = p[[at.FS1, at.FS2] if has_bristle else [at.FC1, at.FC2], 0]
    if friction == "sliding":
        # A bristle that neither moves nor damps holds dry friction where it is.
        p[at.LUGRE], p[at.ELASTO_PLASTIC], p[at.BRISTLE_S1] = 1.0, 0.0, 0.0
    kept[[at.Z1, at.Z2]] = friction == "stuck" and has_bristle
    load = geometry.joint_force([f[0], f[1] - p[at.MASS, 0] * p[at.GRAVITY, 0]], piston, rig)
    leans = friction == "sliding" or has_bristle
    x[[at.Z1, at.Z2]] = _left_over(x, load, p, level) / p[at.BRISTLE_S0, 0] if leans else 0.0
    rates, outputs = _derivatives(x, u, f, p)
    jacobian, measured = np.stack([r.gradient for r in rates])[kept], np.stack([r.gradient for r in outputs])
    state, inputs = np.flatnonzero(kept), slice(at.STATES, None)
    where = OperatingPoint(x, u, f, np.array([r.value for r in outputs]), np.array([r.value for r in rates]), friction)
    names = tuple(signal for signal, keep in zip(STATES, kept, strict=True) if keep)
    matrices = jacobian[:, state], jacobian[:, inputs], measured[:, state], measured[:, inputs]
    return LinearModel(*matrices, names, INPUTS, OUTPUTS, where)


def _left_over(x: Array, load: Array, p: Array, level: Array) -> Array:
    """What pressures leave of a load along the pistons (2,), N, to friction, (2,), N; refuses more than its ``level`` (2,)."""
    areas, pressures = p[[at.AREA_P1, at.AREA_N1, at.AREA_P2, at.AREA_N2], 0], x[list(at.PRESSURES)]
    pushed = lifted(mechanics.piston_force)
    left: Array = load + pushed(pressures[::2], pressures[1::2], areas[::2], areas[1::2], p[at.ATMOSPHERE, 0])
    rounding = 1e-9 * p[at.SUPPLY, 0] * areas[::2]
    if np.any(np.abs(left) > level + rounding):
        k = int(np.argmax(np.abs(left) - level))
        raise ValueError(
            f"pressures, weight and force leave {left[k]:.4g} N on piston {k + 1}; "
            f"allowed: what friction holds, at most {level[k]:.4g} N either way"
        )
    return left


def _derivatives(x: Array, u: Array, f: Array, p: Array) -> tuple[list[Dual], list[Dual]]:
    """Rates (18) and outputs (12) with gradients with respect to the state, openings and force, (24,)."""
    numbers = np.concatenate([x, u, f])
    duals = [[Dual(float(number), row)] for number, row in zip(numbers, np.eye(len(numbers)), strict=True)]
    state, command, force = (np.array(part, dtype=object) for part in (duals[:18], duals[18:22], duals[22:]))
    own, rates = p.astype(object), np.zeros((at.STATES, 1), dtype=object)
    lifted(dynamics.right_hand_side)(state, command, force, own, rates, 1)
    nothing = np.zeros(len(numbers))
    # Bristles of a law without any have the rate 0.0.
    return [r if isinstance(r, Dual) else Dual(r, nothing) for r in rates[:, 0]], _outputs(state[:, 0], own[:, 0])


def _outputs(x: Array, p: Array) -> list[Dual]:
    """``OUTPUTS`` of a state of ``Dual``."""
    names = (at.K1, at.K2, at.D_SQUARES, at.D_PRODUCT, at.SIN_GAMMA3, at.COS_GAMMA3)
    _, r2, _, _, _, kappa, sine, cosine = lifted(geometry.pose)(x[at.Y1], x[at.Y2], *(p[name] for name in names))
    velocity = -kappa * cosine * x[at.V1] + sine * x[at.V2], -kappa * sine * x[at.V1] - cosine * x[at.V2]
    piston_force, stiffness = lifted(mechanics.piston_force), lifted(control_model.pneumatic_stiffness)
    areas = (p[at.AREA_P1], p[at.AREA_N1]), (p[at.AREA_P2], p[at.AREA_N2])
    lengths = [(half + y, half - y) for half, y in ((p[at.HALF_L1], x[at.Y1]), (p[at.HALF_L2], x[at.Y2]))]
    pressures = (x[at.PP1], x[at.PN1]), (x[at.PP2], x[at.PN2])
    return [
        *(r2 * sine, -r2 * cosine, *velocity),
        *(piston_force(*pressures[c], *areas[c], p[at.ATMOSPHERE]) for c in range(2)),
        *(stiffness(*pressures[c], *areas[c], *lengths[c], p[at.INDEX]) for c in range(2)),
        *pressures[0],
        *pressures[1],
    ]
