"""What each controller is, in a sentence: for the page of ``birthsim live`` and for the documentation."""

RESIDUAL = "residual"
"""The controller with a trained policy, which stands above this package; ``residual:circle`` names its policy."""

CONTROLLERS = {
    "backstepping": "The paper's law: position and stiffness from pressures, without a force sensor.",
    "backstepping-weight": "The paper's law, which also carries the weight of what moves.",
    "backstepping-frozen": "The paper's law with weight compensation; friction is left out where its model errs at rest.",
    "backstepping-one-valve": "The paper's law with one valve a cylinder: pneumatic stiffness runs free.",
    "backstepping-force-first": "The paper's law; where a valve saturates, pneumatic stiffness gives way to force.",
    "backstepping-cartesian": "The paper's law in Cartesian coordinates: stiffness along x and y may be coupled.",
    "admittance-backstepping": "Measures the hand's force, and moves the rig to where the spring would be.",
    "admittance-adaptive": "The admittance law, which also learns friction, light masses, noise and its force sensor's bias.",
    "admittance-sensorless": "The admittance law, with the hand's force estimated from pressures and motion.",
    "pid": "A position controller on the motion that the spring would make: what most would try first.",
    "lqr": "A linear regulator on the motion that the spring would make; its gains weigh error against effort.",
    "sliding-mode": "A sliding-mode controller on the motion that the spring would make.",
    "nonlinear-mpc": "Plans 57 ms ahead at every millisecond, with a model of the rig.",
    "shut-valves": "All valves stay shut: the rig is a spring of air.",
    "slammed-valves": "Fully open valves drive both pistons out.",
    "random-valves": "Valves open at random.",
}
"""Name -> what it is."""


def uses_force(controller: str) -> bool:
    """Whether a controller, by name, is told the hand's force; the limiter of ``limited:`` needs it."""
    without = ("sensor=false", "sensorless", "student")
    own = controller.startswith("backstepping") or controller.endswith("-valves")
    return controller.startswith("limited:") or not (own or any(one in controller for one in without))
