"""Mechanics: accelerations of both pistons (5), pneumatic and external forces (3), and the end stops."""

from birthsim_env.physics.compiled.compilation import helper


@helper
def piston_force(pressure_p: float, pressure_n: float, area_p: float, area_n: float, atmosphere: float) -> float:
    """F - Fext (3): force of both chambers less that of the atmosphere on the rod, N."""
    return pressure_p * area_p - pressure_n * area_n - atmosphere * (area_p - area_n)


@helper
def acceleration1(
    force: float,
    v1: float,
    v2: float,
    r2: float,
    r4: float,
    w: float,
    s2: float,
    kappa: float,
    sine: float,
    inverse_mass: float,
    gravity: float,
) -> float:
    """dv1/dt of (5), m/s2. ``force`` is F1 - Fext1 - Ff1 + Fu1, ``s2`` is S^2, ``sine`` sin(theta1); ``inverse_mass`` 1/m."""
    # A division costs as much as ten products, and one serves both accelerations: 1/kappa = S/(2 r2 r4).
    inverse = 1.0 / (r2 * r4 * s2)
    transport = v1 * (2.0 * r4 * r4 * r2 * w * v1 + s2 * (2.0 * r4 * v2 + r2 * v1)) * inverse
    lengths = s2 * inverse
    return (force * inverse_mass + kappa * gravity * sine) * (0.25 * s2 * lengths * lengths) - transport


@helper
def acceleration2(
    force: float, v1: float, r2: float, r4: float, s2: float, cosine: float, inverse_mass: float, gravity: float
) -> float:
    """dv2/dt of (5), m/s2: force, weight along cylinder 2 and centrifugal term; ``cosine`` is cos(theta1)."""
    inverse, radius = 1.0 / (r2 * r4 * s2), r2 * r4
    return force * inverse_mass + gravity * cosine + 4.0 * radius * radius * r4 * v1 * v1 * inverse


@helper
def user_force1(force_x: float, force_y: float, kappa: float, sine: float, cosine: float) -> float:
    """First row of J^T (17): the user's force along cylinder 1, N."""
    return -kappa * (cosine * force_x + sine * force_y)


@helper
def user_force2(force_x: float, force_y: float, sine: float, cosine: float) -> float:
    """Second row of J^T (17): the user's force along cylinder 2, N."""
    return sine * force_x - cosine * force_y


@helper
def stop_force(position: float, speed: float, half_stroke: float, stiffness: float, damping: float) -> float:
    """Force of the end stops against the piston, N, positive at the far stop: k p (1 + c dp/dt), never pulling.

    ``p`` is how far |y| exceeds half the stroke (Hunt and Crossley 1975): zero and continuous at first contact.
    """
    depth = max(abs(position) - half_stroke, 0.0)
    outward = speed if position > 0.0 else -speed
    push = stiffness * depth * max(1.0 + damping * outward, 0.0)
    return push if position > 0.0 else -push
