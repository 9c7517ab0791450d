"""What the nonlinear MPC expects of the rig over a horizon, and how that depends on the flows that it commands.

State: the pistons, the pressures by (6) with the dead volume, and the four mass flows, which follow the commanded ones with
the lag of the valves; the exact inverse of the valves' characteristic makes openings of them. Dry friction and what an observer
finds besides are forces that stay as they are from node to node, the user's force too. The classical Runge-Kutta method takes
one step from node to node; the flows between are exact. Derivatives of rates and outputs are generated from their source.

The sum of squares of the residuals is what the controller minimises. At every node, weighed by the time that it stands for:
the end effector's distance from the motion, its speed relative to it, and the error of the pneumatic stiffness (9); between
nodes the changes of the commanded flows. Each is divided by its tolerance.
"""

from baselines.rivals.classical import STAGES, ahead_of, weight_of
from baselines.valve_inverse import CylinderAir, air_at, stiffness_of
from birthsim_env.gradients.derivatives import reverse
from birthsim_env.gradients.graph import Graph, Value
from birthsim_env.gradients.source import HEAD, loop, module_of
from birthsim_env.gradients.symbols import empty, inputs
from birthsim_env.gradients.tracing import call
from birthsim_env.loop.signals import Joints, Point
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import control_model
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array, Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, rows
from birthsim_env.physics.dynamics import load
from birthsim_env.physics.linkage import geometry, mechanics

NODES = 7
"""Nodes of the horizon."""

FLOWS = 4
"""Into chambers P1, N1, P2, N2, kg/s."""

SIZE = FLOWS * NODES
HALF = SIZE * (SIZE + 1) // 2
"""Flows of a plan, and entries of a symmetric matrix over them: row by row up to the diagonal."""


class State(Joints):
    """What is predicted, besides the flows."""

    pressure = rows(4, "Pa", "of the chambers")


class Flows(Rows):
    """Into the chambers."""

    chamber = rows(FLOWS, "kg/s", "into a chamber")


class Forces(Rows):
    """What acts on the pistons."""

    user = rows(2, "N", "of the user")
    unseen = rows(2, "N", "along the pistons")


class Outputs(Point):
    """What is asked for."""

    stiffness = rows(2, "N/m", "pneumatic stiffness")


STATE, FORCES, OUTPUTS = State.size, Forces.size, Outputs.size


class HorizonInputs(Rows):
    """What a plan begins with, and what is asked for and expected at each node."""

    joints = part(Joints, "pistons")
    pressure = rows(4, "Pa", "of the chambers")
    flow = rows(FLOWS, "kg/s", "into the chambers")
    force = rows(2, "N", "of the user")
    unseen = rows(2 * NODES, "N", "along the pistons, node by node")
    motion = rows(4 * NODES, "SI", "x, y, vx, vy that the end effector should have, node by node")
    stiffness = rows(2 * NODES, "N/m", "pneumatic stiffnesses asked for, node by node")


class Horizon(Numbers):
    """The horizon, and what counts how much."""

    tick = rows(NODES, "1", "control periods from now to each node")
    step = rows(NODES, "s", "from node to node")
    kept = rows(NODES, "1", "what is left of a difference between commanded and present flow after half a step")
    weight = rows(NODES, "1", "of a node's residuals")
    position = number("m", "tolerance")
    speed = number("m/s", "tolerance")
    stiffness = number("N/m", "tolerance")
    flow = number("kg/s", "tolerance")


@helper
def air_of(now: State, k: int, i: int, p: Rig) -> CylinderAir:
    """The chambers of cylinder ``k`` in lane ``i``."""
    return air_at(k, now.pressure[2 * k, i], now.pressure[2 * k + 1, i], now.position[k, i], now.speed[k, i], p)


@helper
def rates(x: Array, q: Array, f: Array, p: Rig, dx: Array, i: int) -> None:
    """Writes d(state)/dt ``dx`` of lane ``i`` for a ``State``, ``Flows`` and ``Forces``."""
    now, flow, force, rate = State(x), Flows(q), Forces(f), State(dx)
    r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
        now.position[0, i], now.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
    )
    index, gas_t = p.index, p.gas * p.temperature
    for k in range(2):
        v, dead, c = now.speed[k, i], p.dead_volume, air_of(now, k, i, p)
        flow_p, flow_n = flow.chamber[2 * k, i], flow.chamber[2 * k + 1, i]
        rate.position[k, i] = v
        rate.pressure[2 * k, i] = control_model.polytropic_rate_p(c.pp, flow_p, v, c.ap, c.length_p + dead / c.ap, index, gas_t)
        rate.pressure[2 * k + 1, i] = control_model.polytropic_rate_n(
            c.pn, flow_n, v, c.an, c.length_n + dead / c.an, index, gas_t
        )
    v1, v2, fx, fy, pressure = now.speed[0, i], now.speed[1, i], force.user[0, i], force.user[1, i], now.pressure
    load1 = mechanics.piston_force(pressure[0, i], pressure[1, i], p.area_p1, p.area_n1, p.atmosphere) - p.fv1 * v1
    load2 = mechanics.piston_force(pressure[2, i], pressure[3, i], p.area_p2, p.area_n2, p.atmosphere) - p.fv2 * v2
    load1 += mechanics.user_force1(fx, fy, kappa, sine, cosine) + force.unseen[0, i]
    load2 += mechanics.user_force2(fx, fy, sine, cosine) + force.unseen[1, i]
    rate.speed[0, i] = mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, p.inverse_mass, p.gravity)
    rate.speed[1, i] = mechanics.acceleration2(load2, v1, r2, r4, s2, cosine, p.inverse_mass, p.gravity)


@helper
def outputs(x: Array, p: Rig, out: Array, i: int) -> None:
    """Writes ``Outputs`` of lane ``i``; no chamber is shorter than ``CLEARANCE``, since the model has no end stops."""
    now, seen = State(x), Outputs(out)
    _, r2, _, _, _, kappa, sine, cosine = geometry.pose(
        now.position[0, i], now.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
    )
    v1, v2 = now.speed[0, i], now.speed[1, i]
    seen.position[0, i], seen.position[1, i] = r2 * sine, -r2 * cosine
    seen.velocity[0, i], seen.velocity[1, i] = v2 * sine - kappa * v1 * cosine, -kappa * v1 * sine - v2 * cosine
    for k in range(2):
        seen.stiffness[k, i] = stiffness_of(air_of(now, k, i, p), p)


def _generated() -> tuple[str, int, int]:
    """Source of the derivatives, and how many slopes of rates and outputs vary.

    ``rates_slopes(x, q, f, p, out, n)`` and ``outputs_slopes(x, p, out, n)`` write values and then slopes;
    ``rates_along(j, s, out, n)`` and ``outputs_along`` multiply these slopes by a tangent of state and flows, or of the state.
    """
    texts, counts = [HEAD], []
    sizes = {"x": STATE, "q": FLOWS, "f": FORCES, "p": PARAMETERS}
    for name, function, read, among, many in (
        ("rates", rates, ("x", "q", "f", "p"), ("x", "q"), STATE),
        ("outputs", outputs, ("x", "p"), ("x",), OUTPUTS),
    ):
        graph, product = Graph(), Graph()
        blocks = {one: inputs(graph, one, sizes[one]) for one in read}
        out = empty(many)
        call(function, *(Rig(blocks[one][:, 0]) if one == "p" else blocks[one] for one in read), out, 0)
        sources = [value for one in among for value in blocks[one][:, 0]]
        slopes, sums = list[Value](), []
        for value in out[:, 0]:
            terms = []
            for k, slope in enumerate(reverse(graph, [(value, 1.0)], sources)):
                varies = isinstance(slope, Value)
                if varies:
                    slopes.append(slope)
                if varies or slope != 0.0:
                    own = product.input("j", len(slopes) - 1) if varies else slope
                    terms.append(own * product.input("s", k))
            sums.append(sum(terms[1:], terms[0]))
        written = [("out", k, value) for k, value in enumerate([*out[:, 0], *slopes])]
        texts.append(loop(graph, f"{name}_slopes", (*read, "out"), written))
        texts.append(loop(product, f"{name}_along", ("j", "s", "out"), [("out", k, one) for k, one in enumerate(sums)]))
        counts.append(len(slopes))
    return "\n\n".join(texts), counts[0], counts[1]


GENERATED, RATE_SLOPES, OUTPUT_SLOPES = _generated()
_made = module_of(GENERATED)
rates_slopes, rates_along = _made.rates_slopes, _made.rates_along
outputs_slopes, outputs_along = _made.outputs_slopes, _made.outputs_along
POINT = STATE + RATE_SLOPES
"""Rows of rates and their slopes at one stage of a step."""

MOVING, POINTS, TANGENTS = STATE + FLOWS, STAGES * POINT, STATE * SIZE
SEEN, SEEN_SLOPES = OUTPUTS + OUTPUT_SLOPES, OUTPUTS * SIZE
"""Rows of scratch, whose number has to be a constant."""


@helper
def place(row: int, column: int) -> int:
    """Where an entry stands in ``HALF`` rows; ``column`` <= ``row``."""
    return row * (row + 1) // 2 + column


@helper
def step_to(
    x: Array,
    flows: Array,
    plan: Array,
    f: Array,
    p: Array,
    k: int,
    constants: Horizon,
    points: Array,
    total: Array,
    q: Array,
    n: int,
) -> None:
    """Takes ``x`` (8, n) and ``flows`` (4, n) to node ``k``; ``points`` (STAGES POINT, n) get rates and slopes."""
    step, kept = constants.step[k], constants.kept[k]
    trial = scratch(STATE)
    load(x, 0, n, total)
    load(x, 0, n, trial)
    for stage in range(STAGES):
        left = 1.0 if stage == 0 else kept * kept if stage == 3 else kept
        for chamber in range(FLOWS):
            for i in range(n):
                asked = plan[FLOWS * k + chamber, i]
                q[chamber, i] = asked + left * (flows[chamber, i] - asked)
        first = stage * POINT
        point = points[first : first + POINT]
        rates_slopes(trial, q, f, p, point, n)
        weight, ahead = weight_of(stage, step), ahead_of(stage, step)
        for row in range(STATE):
            for i in range(n):
                total[row, i] += weight * point[row, i]
                trial[row, i] = x[row, i] + ahead * point[row, i]
    load(total, 0, n, x)
    load(q, 0, n, flows)


@helper
def _tangent_step(
    s: Array, chamber: int, begun: float, own: bool, k: int, constants: Horizon, points: Array, total: Array, out: Array, n: int
) -> None:
    """Takes a tangent ``s`` (8, n) to node ``k``, of a flow whose own tangent was ``begun`` at its beginning and goes towards 1
    where it is this step's ``own``, else towards 0."""
    step, kept, end = constants.step[k], constants.kept[k], 1.0 if own else 0.0
    trial = scratch(MOVING)
    load(s, 0, n, total)
    for row in range(STATE + FLOWS):
        for i in range(n):
            trial[row, i] = s[row, i] if row < STATE else 0.0
    for stage in range(STAGES):
        left = 1.0 if stage == 0 else kept * kept if stage == 3 else kept
        for i in range(n):
            trial[STATE + chamber, i] = end + left * (begun - end)
        first = stage * POINT
        rates_along(points[first + STATE : first + POINT], trial, out, n)
        weight, ahead = weight_of(stage, step), ahead_of(stage, step)
        for row in range(STATE):
            for i in range(n):
                total[row, i] += weight * out[row, i]
                trial[row, i] = s[row, i] + ahead * out[row, i]
    load(total, 0, n, s)


@helper
def programme(plan: Array, inputs: HorizonInputs, p: Array, constants: Horizon, h: Array, g: Array, n: int) -> None:
    """Writes ``h`` (HALF, n), the squared slopes of the residuals to the flows, and ``g`` (SIZE, n), the slope of half the sum
    of squares at ``plan`` (SIZE, n), kg/s. ``p`` (PARAMETERS, n)."""
    x, flows, f, points = scratch(STATE), scratch(FLOWS), scratch(FORCES), scratch(POINTS)
    total, q, out = scratch(STATE), scratch(FLOWS), scratch(STATE)
    s, seen, slopes = scratch(TANGENTS), scratch(SEEN), scratch(SEEN_SLOPES)
    now, pushes, across = State(x), Forces(f), 1.0 / (constants.flow * constants.flow)
    for row in range(HALF):
        for i in range(n):
            h[row, i] = 0.0
    for row in range(SIZE):
        for i in range(n):
            before = inputs.flow[row, i] if row < FLOWS else plan[row - FLOWS, i]
            change = plan[row, i] - before
            g[row, i] = across * change
            h[place(row, row), i] = across
            if row >= FLOWS:
                g[row - FLOWS, i] -= across * change
                h[place(row - FLOWS, row - FLOWS), i] += across
                h[place(row, row - FLOWS), i] = -across
    for row in range(STATE * SIZE):
        for i in range(n):
            s[row, i] = 0.0
    for row in range(4):
        for i in range(n):
            x[row, i], now.pressure[row, i] = inputs.joints.rows[row, i], inputs.pressure[row, i]
            flows[row, i], f[row, i] = inputs.flow[row, i], inputs.force[row, i] if row < 2 else 0.0
    for k in range(NODES):
        for axis in range(2):
            for i in range(n):
                pushes.unseen[axis, i] = inputs.unseen[2 * k + axis, i]
        step_to(x, flows, plan, f, p, k, constants, points, total, q, n)
        outputs_slopes(x, p, seen, n)
        for row in range(OUTPUTS):
            size = constants.weight[k] / (
                constants.position if row < 2 else constants.speed if row < 4 else constants.stiffness
            )
            for i in range(n):
                asked = inputs.motion[4 * k + row, i] if row < 4 else inputs.stiffness[2 * k + row - 4, i]
                seen[row, i] = size * (seen[row, i] - asked)
        count = FLOWS * (k + 1)
        for column in range(count):
            begun, node = 0.0, column // FLOWS
            if node < k:
                begun = 1.0 - constants.kept[node] * constants.kept[node]
                for later in range(node + 1, k):
                    begun *= constants.kept[later] * constants.kept[later]
            first = STATE * column
            own = s[first : first + STATE]
            _tangent_step(own, column % FLOWS, begun, node == k, k, constants, points, total, out, n)
            outputs_along(seen[OUTPUTS:], own, out, n)
            for row in range(OUTPUTS):
                size = constants.weight[k] / (
                    constants.position if row < 2 else constants.speed if row < 4 else constants.stiffness
                )
                for i in range(n):
                    slopes[OUTPUTS * column + row, i] = size * out[row, i]
                    g[column, i] += size * out[row, i] * seen[row, i]
        for column in range(count):
            for other in range(column + 1):
                entry = place(column, other)
                for row in range(OUTPUTS):
                    for i in range(n):
                        h[entry, i] += slopes[OUTPUTS * column + row, i] * slopes[OUTPUTS * other + row, i]
