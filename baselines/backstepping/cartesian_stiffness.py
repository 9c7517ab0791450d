"""Joint stiffness setpoints from Cartesian ones (18): the diagonal of J^T diag(Kclx, Kcly) J."""

from birthsim_env.physics.compiled.compilation import helper


@helper
def joint_stiffness1(kcl_x: float, kcl_y: float, kappa: float, sine: float, cosine: float) -> float:
    """Kcl1 (18), N/m, with the first column of the Jacobian (16)."""
    return kappa * kappa * (cosine * cosine * kcl_x + sine * sine * kcl_y)


@helper
def joint_stiffness2(kcl_x: float, kcl_y: float, sine: float, cosine: float) -> float:
    """Kcl2 (18), N/m, with the second column of the Jacobian (16)."""
    return sine * sine * kcl_x + cosine * cosine * kcl_y
