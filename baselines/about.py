"""What each controller is, in a sentence: for the page of ``birthsim-live`` and for the documentation."""

from __future__ import annotations

CONTROLLERS = {
    "backstepping": "The paper's law: position and stiffness from pressures, without a force sensor.",
    "backstepping-weight": "The paper's law, which also carries the weight of the moving parts.",
    "backstepping-frozen": "The same, with friction left out of a derivative in which the model errs at rest.",
    "backstepping-one-valve": "One valve for each cylinder: pneumatic stiffness runs free.",
    "backstepping-force-first": "Where a valve saturates, pneumatic stiffness gives way to force.",
    "backstepping-cartesian": "The law in Cartesian coordinates: x and y may be coupled.",
    "admittance-backstepping": "Measures the hand's force and moves the rig to where the spring would be.",
    "admittance-adaptive": "The same, and learns friction, noise and the force sensor's bias on the way.",
    "admittance-sensorless": "The same, but estimates the hand's force from pressures and motion.",
    "pid": "A position controller, as most engineers would try first.",
    "lqr": "A linear regulator of each piston, with gains that weigh error against effort.",
    "sliding-mode": "Drives a sum of error and its rates to zero, and holds it there.",
    "nonlinear-mpc": "Plans 57 ms ahead at every millisecond: a bound, far from real time.",
    "shut-valves": "All valves stay shut: the rig is a spring of air.",
    "slammed-valves": "Fully open valves drive both pistons out.",
    "random-valves": "Valves open at random.",
}
"""Name -> what it is."""
