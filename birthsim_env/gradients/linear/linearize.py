"""The plant linearised: at rest, at a pose and chamber pressures, or wherever N plants are.

Friction is not smooth, so the caller says how the pistons are. Either way dry friction carries what pressures, weight and hand
leave over, so that the point is a balance of forces.

- "stuck": the bristle of each piston is a spring s0 with damping s1 + Fv. The term |v| z of LuGre is even in v and has no slope
  on average. The Coulomb law has no bristle and becomes its regularisation, viscous with Fc/sign_speed + Fv; what is left over
  then accelerates the pistons (``OperatingPoint.rates``).
- "sliding": dry friction has reached its level, which does not change with small motions; Fv v is left, and the bristles are no
  states. The falling part of Stribeck's curve, below about ``stribeck_speed``, is left out.

Shut spools lie on a kink: opening fills a chamber from the supply, closing empties it to the atmosphere. The gain there is the
mean of both (``derivatives``). An opening on one side of zero, however small, gives the gain of that side. Within an overlap
there is none.
"""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from birthsim_env.gradients.linear.derivatives import derivatives_of
from birthsim_env.gradients.linear.model import Jacobians, LinearModel, OperatingPoint, Signal
from birthsim_env.gradients.tracing import call
from birthsim_env.physics import options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, parameter_array
from birthsim_env.physics.dynamics import coulomb_level
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.linkage.mechanics import piston_force
from birthsim_env.physics.plant import Plant, checked
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import shown
from birthsim_env.physics.seals.maxwell_slip import ELEMENTS

_UNITS = {"y": "m", "v": "m/s", "z": "m", "P": "Pa", "T": "K", "s": "1"}
STATES = tuple(Signal(name, _UNITS[name[0]]) for name in at.STATE_NAMES)
FURTHER = (
    Signal("Ps", "Pa"), Signal("xh", "m"), Signal("yh", "m"), Signal("vxh", "m/s"), Signal("vyh", "m/s"),
    *(Signal(f"{name}{chamber}", unit) for name, unit in (("Pv", "Pa"), ("q", "kg/s")) for chamber in ("1P", "1N", "2P", "2N")),
    *(Signal(f"z{cylinder}_{element}", "m") for cylinder in (1, 2) for element in range(1, ELEMENTS + 1)),
    *(Signal(f"slips{cylinder}_{element}", "1") for cylinder in (1, 2) for element in range(1, ELEMENTS + 1)),
)  # fmt: skip
"""States of rigs with ``physics.options``: supply at the valves, handle, ends of tubes, flows in them, elements of bristles."""
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
    """Pressures that carry the weight at rest.

    Parameters
    ----------
    parameters : Parameters, path, mapping or None
        The rig.
    pose : array-like, (2,)
        Position x, y of the end effector, m.
    pneumatic_stiffness : array-like, (2,)
        Of cylinders 1 and 2, N/m; one out of reach is approached.

    Returns
    -------
    array, (4,)
        Of chambers P1, N1, P2, N2, Pa absolute.

    Raises
    ------
    ValueError
        For a pose outside the workspace, and a stiffness that is not finite.

    Notes
    -----
    The pneumatic stiffness is (9) of Herzig et al., IROS 2015, doi 10.1109/IROS.2015.7353583.

    Examples
    --------
    >>> import birthsim
    >>> pressures = birthsim.balanced_pressures(None, (0.5, 0.0))
    >>> pressures.shape, bool((pressures > 1e5).all())
    ((4,), True)
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
    """The plant near rest as a linear model, with air at ambient temperature.

    Parameters
    ----------
    parameters : Parameters, path, mapping or None
        The rig.
    pose : array-like, (2,)
        Position x, y of the end effector, m.
    pressures : array-like, (4,), optional
        Of chambers P1, N1, P2, N2, Pa absolute; else ``balanced_pressures``.
    friction : str
        ``"stuck"``: the bristle of each piston is a spring; ``"sliding"``: viscous friction alone is left.
    openings : array-like, (4,)
        Of the chambers' spools, -1 to 1.
    force : array-like, (2,)
        Of the hand, N.

    Returns
    -------
    LinearModel
        A, B, C, D with names and units. Inputs are the openings that spools go to and the hand's force.

    Raises
    ------
    ValueError
        For a pose outside the workspace, and pressures that the air cannot have or friction cannot hold.

    Notes
    -----
    Hysteresis of the valves is left out, and so are states of options that a rig has not. A valve that stands within its
    overlap has no gain. A handle on a structure that bends is where it carries the hand's force. docs/linear.md compares the
    model with the plant.

    Examples
    --------
    >>> import birthsim
    >>> model = birthsim.linearize(None, (0.5, 0.0), friction="sliding")
    >>> model.A.shape, model.inputs[-1]
    ((16, 16), Signal(name='Fy', unit='N'))
    """
    rig = load_parameters(parameters)
    p = parameter_array(rig, 1)
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
    # The mean bristle of a stuck piston is that of its elements.
    kept = np.repeat([True, *(p[[at.LINE, at.MODE_RATE, at.TUBE_LENGTH], 0] > 0.0), False], [at.STATES, 1, 4, 8, 4 * ELEMENTS])
    has_bristle = p[at.BRISTLED, 0] > 0.5
    ratio = p[at.STATIC_RATIO, 0] if has_bristle else 1.0
    if friction == "sliding":
        # A bristle that neither moves nor damps holds dry friction where it is.
        p[at.LUGRE], p[at.BRISTLED], p[at.GMS], p[at.S1] = 1.0, 1.0, 0.0, 0.0
    kept[[at.Z1, at.Z2]] = friction == "stuck" and has_bristle
    load = geometry.joint_force([f[0], f[1] - p[at.MASS, 0] * p[at.GRAVITY, 0]], piston, rig)
    leans = friction == "sliding" or has_bristle
    x[[at.Z1, at.Z2]] = _left_over(x, load, p, ratio) / p[at.S0, 0] if leans else 0.0
    names = STATES
    if not options.are_off(p):
        x, names = np.concatenate([x, _further(x, f, p)]), STATES + FURTHER
    kept = kept[: len(x)]
    found, slopes = derivatives_of(x[:, None], u[:, None], f[:, None], p)
    jacobian, measured = slopes[0, : len(x)][kept], slopes[0, len(x) :]
    state, inputs = np.flatnonzero(kept), slice(len(x), None)
    where = OperatingPoint(x, u, f, found[len(x) :, 0], found[: len(x), 0], friction)
    matrices = jacobian[:, state], jacobian[:, inputs], measured[:, state], measured[:, inputs]
    return LinearModel(*matrices, tuple(names[k] for k in state), INPUTS, OUTPUTS, where)


def linearize_lanes(plant: Plant, opening_command: ArrayLike, user_force: ArrayLike) -> Jacobians:
    """The derivatives of N plants where they are, moving or at rest.

    Parameters
    ----------
    plant : Plant
        N lanes; along a trajectory its states are those of the lanes.
    opening_command : array-like, (4, N)
        Openings that the spools of chambers P1, N1, P2, N2 go to, -1 to 1.
    user_force : array-like, (2, N)
        Of the hand, N.

    Returns
    -------
    Jacobians
        A (N, S, S), B (N, S, 6), C (N, 12, S), D (N, 12, 6), with the rates (S, N) and outputs (12, N) there.

    Raises
    ------
    ValueError
        For wrong shapes and values that are not finite.

    Examples
    --------
    >>> import numpy as np, birthsim
    >>> found = birthsim.linearize_lanes(birthsim.Plant(num_envs=3), np.zeros((4, 3)), np.zeros((2, 3)))
    >>> found.A.shape, found.D.shape
    ((3, 18, 18), (3, 12, 6))
    """
    u = checked("opening_command", opening_command, (4, plant.num_envs), "1")
    f = checked("user_force", user_force, (2, plant.num_envs), "N")
    has_options = not options.are_off(plant.lane_parameters)
    x = np.concatenate([plant.state, plant.memory[4:]]) if has_options else plant.state
    found, slopes = derivatives_of(x, u, f, plant.lane_parameters)
    first, last = slice(0, len(x)), slice(len(x), None)
    matrices = slopes[:, first, first], slopes[:, first, last], slopes[:, last, first], slopes[:, last, last]
    return Jacobians(*matrices, found[: len(x)], found[len(x) :])


def _further(x: Array, f: Array, p: Array) -> Array:
    """The further states of options (FURTHER,) at rest in a state (18,), where a handle carries the hand's force."""
    further = np.empty((options.FURTHER, 1))
    options.rest(x[:, None], p, further)
    further[options.RESERVOIR] *= 1 - EDGE
    if p[at.MODE_RATE, 0] > 0.0:
        stiffness = p[at.HANDLE, 0] * p[at.MASS, 0] * p[at.MODE_RATE, 0] ** 2
        further[options.HANDLE : options.HANDLE + 2, 0] += f / stiffness
    return further[:, 0]


def _left_over(x: Array, load: Array, p: Array, ratio: float) -> Array:
    """What pressures leave of a load along the pistons (2,), N, to friction, (2,), N; refuses more than ``ratio`` times the
    Coulomb level of the way in which it would drive the piston."""
    areas, pressures = p[[at.AREA_P1, at.AREA_N1, at.AREA_P2, at.AREA_N2], 0], x[list(at.PRESSURES)]
    left: Array = load + call(piston_force, pressures[::2], pressures[1::2], areas[::2], areas[1::2], p[at.ATMOSPHERE, 0])
    driven = x.copy()
    driven[[at.V1, at.V2]] = left
    level = ratio * np.array([call(coulomb_level, driven[:, None], p, 0, k) for k in range(2)], dtype=float)
    rounding = 1e-9 * p[at.SUPPLY, 0] * areas[::2]
    if np.any(np.abs(left) > level + rounding):
        k = int(np.argmax(np.abs(left) - level))
        raise ValueError(
            f"pressures, weight and force leave {left[k]:.4g} N on piston {k + 1}; "
            f"allowed: what friction holds, at most {level[k]:.4g} N either way"
        )
    return left
