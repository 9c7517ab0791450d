"""What is in a cylinder that a rail lacks, for laws that read it all the same: its valves are shut."""

from birthsim_env.physics.compiled.lanes import PRESSURES
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters


def idle_pressures(rig: Parameters) -> dict[int, float]:
    """Chamber, 0 to 3 of P1, N1, P2, N2, -> its pressure, Pa; nothing where both cylinders move."""
    state, moving = Plant(rig).state[:, 0], rig.linkage.topology.chambers
    return {chamber: float(state[row]) for chamber, row in enumerate(PRESSURES) if chamber not in moving}
