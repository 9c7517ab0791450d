"""The paper's control model of the air (6)-(10): polytropic chambers, the A-T transform and the pneumatic stiffness.

For one cylinder of stroke l at position y: Lp = l/2 + y, Ln = l/2 - y. It knows no dead volume, temperature or heat
exchange; the plant does. Scalar helpers for kernels; all of them also work on NumPy arrays through ``.py_func``.
"""

from birthsim_env.physics.compiled.compilation import helper


@helper
def polytropic_rate_p(
    pressure: float, flow: float, speed: float, area: float, length: float, index: float, gas_t: float
) -> float:
    """dPp/dt of (6), Pa/s; ``gas_t`` is r T, J/kg, ``length`` Lp."""
    return index * (gas_t * flow - pressure * area * speed) / (area * length)


@helper
def polytropic_rate_n(
    pressure: float, flow: float, speed: float, area: float, length: float, index: float, gas_t: float
) -> float:
    """dPn/dt of (6), Pa/s; ``length`` is Ln."""
    return index * (gas_t * flow + pressure * area * speed) / (area * length)


@helper
def pneumatic_stiffness(
    pressure_p: float, pressure_n: float, area_p: float, area_n: float, length_p: float, length_n: float, index: float
) -> float:
    """K of (9), N/m."""
    return index * (pressure_p * area_p / length_p + pressure_n * area_n / length_n)


@helper
def active_flow(flow_p: float, flow_n: float, length_p: float, length_n: float) -> float:
    """qA of the A-T transform (8), kg/s; l = Lp + Ln."""
    return 0.5 * (length_p + length_n) * (flow_p / length_p - flow_n / length_n)


@helper
def pressurization_flow(flow_p: float, flow_n: float, length_p: float, length_n: float) -> float:
    """qT of the A-T transform (8), kg/s."""
    return 0.5 * (length_p + length_n) * (flow_p / length_p + flow_n / length_n)


@helper
def chamber_flow_p(active: float, pressurization: float, length_p: float, length_n: float) -> float:
    """qp from the inverse of (8), kg/s."""
    return length_p * (pressurization + active) / (length_p + length_n)


@helper
def chamber_flow_n(active: float, pressurization: float, length_p: float, length_n: float) -> float:
    """qn from the inverse of (8), kg/s."""
    return length_n * (pressurization - active) / (length_p + length_n)


@helper
def force_rate(active: float, stiffness: float, speed: float, stroke: float, index: float, gas_t: float) -> float:
    """dF/dt of (10), N/s."""
    return 2.0 * index * gas_t / stroke * active - stiffness * speed


@helper
def active_flow_for(rate: float, stiffness: float, speed: float, stroke: float, index: float, gas_t: float) -> float:
    """The qA that gives dF/dt = ``rate`` in (10), kg/s."""
    return (rate + stiffness * speed) * stroke / (2.0 * index * gas_t)


@helper
def stiffness_drift(
    force: float, stiffness: float, speed: float, active: float, length_p: float, length_n: float, index: float, gas_t: float
) -> float:
    """A1 v y K - A2 v F - B1 y qA of (10), N m/s: what changes K without pressurisation, times Lp Ln."""
    position = 0.5 * (length_p - length_n)
    a1, a2 = 2.0 * (index + 1.0), index * (index + 1.0)
    b1 = 2.0 * index * index * gas_t / (length_p + length_n)
    return a1 * speed * position * stiffness - a2 * speed * force - b1 * position * active


@helper
def stiffness_rate(
    force: float,
    stiffness: float,
    speed: float,
    active: float,
    pressurization: float,
    length_p: float,
    length_n: float,
    index: float,
    gas_t: float,
) -> float:
    """dK/dt of (10), N/(m s); ``force`` is Pp Sp - Pn Sn."""
    drift = stiffness_drift(force, stiffness, speed, active, length_p, length_n, index, gas_t)
    return (drift + index * index * gas_t * pressurization) / (length_p * length_n)


@helper
def pressurization_flow_for(
    rate: float,
    force: float,
    stiffness: float,
    speed: float,
    active: float,
    length_p: float,
    length_n: float,
    index: float,
    gas_t: float,
) -> float:
    """The qT that gives dK/dt = ``rate`` in (10), kg/s."""
    drift = stiffness_drift(force, stiffness, speed, active, length_p, length_n, index, gas_t)
    return (rate * length_p * length_n - drift) / (index * index * gas_t)
