"""Rigs that differ from the default one in whatever a formula may depend on."""

import pytest

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import MPYE_5_M5

LAWS = ("lugre", "coulomb", "elasto_plastic")
NO_FRICTION = {
    **{f"cylinder{k}.{name}_friction": 0.0 for k in (1, 2) for name in ("coulomb", "pressure", "viscous")},
    "friction.law": "coulomb",
}
CATALOGUE = MPYE_5_M5.changes()
"""The curve of the paper's valve."""
UNLIKE = {
    **CATALOGUE,
    **{"valves.exhaust_overlap": 0.06, "valves.exhaust_curvature": -0.2, "valves.exhaust_ratio": 0.8},
    **{"valve_p1.supply_overlap": 0.02, "valve_n1.supply_curvature": -0.1, "valve_p2.supply_conductance": 0.2},
    **{"valve_n2.exhaust_overlap": -0.07, "valve_p1.exhaust_curvature": 0.1, "valve_n1.exhaust_conductance": -0.15},
}
"""Four valves of which no edge is as another one; that of N2 to the exhaust has no overlap, since less than none is none."""

MOVED = {
    **{"cylinder1.coulomb_friction": 9.0, "cylinder1.viscous_friction": 20.0, "cylinder2.viscous_friction": 50.0},
    **{"cylinder2.piston_diameter": 0.03, "cylinder1.rod_diameter": 0.008, "mechanics.mass": 2.5},
}
"""Cylinders that differ in everything, so that no figure of one may stand for the other's."""

OTHER = {
    **{"geometry.gamma3": 1.3, "geometry.d3": 0.4, "geometry.d6": 0.22, "geometry.k1": 0.44, "geometry.k2": 0.55},
    **{"cylinder1.piston_diameter": 0.032, "cylinder2.rod_diameter": 0.012, "mechanics.mass": 4.0, "mechanics.gravity": 9.7},
    **{"friction.static_ratio": 1.6, "friction.stribeck_speed": 0.01, "friction.bristle_damping": 90.0},
    **{"chambers.dead_volume": 2e-5, "chambers.wall_heat_transfer": 80.0, "chambers.piston_conductance": 0.1},
    **{"valves.critical_ratio": 0.4, "valves.time_constant": 0.003, "valves.leakage_ratio": 0.02},
    **{"air.supply_pressure": 6e5, "air.temperature": 300.0, "air.atmospheric_pressure": 0.95e5},
}
PRESSED = {
    **{"cylinder1.coulomb_friction": 5.0, "cylinder1.pressure_friction": 9e-6, "cylinder1.direction_asymmetry": 0.25},
    **{"cylinder2.coulomb_friction": 8.0, "cylinder2.pressure_friction": 5e-6, "cylinder2.direction_asymmetry": -0.15},
}
"""Friction that grows with the pressures and has a level for each direction."""

DEMANDING = {
    **{"cylinder1.coulomb_friction": 25.0, "cylinder2.coulomb_friction": 6.0, "mechanics.mass": 2.0},
    **{"chambers.dead_volume": 5e-6, "chambers.wall_heat_transfer": 100.0, "valves.time_constant": 0.0015},
}
"""A corner of the ranges of domain randomisation: light, tight and quick, so that the integrator has least to spare."""

TILTED = Parameters().replace(
    {
        **{"geometry.gamma3": 1.2, "geometry.d3": 0.42, "geometry.d6": 0.21, "geometry.k1": 0.45, "mechanics.mass": 4.2},
        **{"cylinder1.viscous_friction": 55.0, "cylinder2.coulomb_friction": 22.0, "cylinder2.rod_diameter": 0.012},
        **{"air.temperature": 310.0, "air.polytropic_index": 1.3, "valves.critical_ratio": 0.4},
        **{"chambers.dead_volume": 1.7e-5, "valves.time_constant": 0.006},
    }
)
LINKAGES = {
    "default": Parameters(),
    "tilted pivot": TILTED,
    "d6 longer than d3": Parameters().replace({"geometry.d3": 0.25, "geometry.d6": 0.35, "geometry.gamma3": 2.4}),
    "pivot below": Parameters().replace(
        {
            **{"geometry.gamma3": -2.0, "geometry.k2": 0.6, "mechanics.mass": 4.3, "mechanics.gravity": 1.62},
            **{"cylinder1.piston_diameter": 0.04, "cylinder2.rod_diameter": 0.02, "chambers.dead_volume": 2e-5},
        }
    ),
}
each_rig = pytest.mark.parametrize("rig", LINKAGES.values(), ids=LINKAGES.keys())
