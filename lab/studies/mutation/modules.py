"""The modules whose tests the mutation tester examines."""

from collections.abc import Iterator
from pathlib import Path

TESTS = Path(__file__).resolve().parents[3] / "tests"

MODULES = {
    "birthsim_env.physics.geometry": ("dynamics", "strict_feedback", "inverse_kinematics", "geometry", "mechanics"),
    "birthsim_env.physics.mechanics": ("dynamics", "strict_feedback", "cartesian_stiffness", "mechanics"),
    "birthsim_env.physics.friction": ("dynamics", "strict_feedback", "reference_friction", "friction"),
    "birthsim_env.physics.chambers": ("dynamics", "chambers"),
    "birthsim_env.physics.valves": ("dynamics", "valve_inverse", "valves"),
    "birthsim_env.physics.control_model": ("strict_feedback", "valve_inverse", "control_model"),
    "birthsim_env.physics.dynamics": ("dynamics", "mechanics", "plant"),
    "birthsim_env.physics.equilibrium": ("equilibrium", "plant", "mechanics"),
    "birthsim_env.physics.inverse_kinematics": ("inverse_kinematics",),
    "birthsim_env.physics.compiled.exact": ("exact",),
    "baselines.backstepping.gains": ("gains", "damping"),
    "baselines.backstepping.law": ("backstepping", "damping", "one_valve", "force_first", "lyapunov"),
    "baselines.backstepping.cartesian_law": ("cartesian_backstepping",),
    "baselines.backstepping.cartesian_stiffness": ("cartesian_stiffness", "backstepping"),
    "baselines.admittance.law": ("admittance_law", "admittance_backstepping"),
    "baselines.valve_inverse": ("valve_inverse", "admittance_law", "backstepping", "one_valve", "force_first"),
}
"""The test files (``tests/*/test_*.py``) that concern a module, the quickest first."""


def files_of(module: str) -> Iterator[Path]:
    """Files of the tests of a module, where they are."""
    return (path for name in MODULES[module] for path in sorted(TESTS.rglob(f"test_{name}.py")))
