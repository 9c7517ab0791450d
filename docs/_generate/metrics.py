"""What the bench measures: a row for each of ``baselines.bench.metrics.UNITS``."""

from baselines.bench.metrics import HELD, QUIET, RUNNING, STUCK, UNITS, WINDOW

AXES = {"x": "along x", "y": "along y"}

MEANINGS = {
    "error_rms": "root mean square error {}, over the whole episode",
    "error_max": "largest error {}, over the whole episode",
    "settled_rms_x": "root mean square settled error along x",
    "settled_rms_y": "root mean square settled error along y",
    "settled_rms": "root mean square settled distance from the compliant target, both axes: the *settled error* of most tables",
    "settled_max": "largest settled error {}",
    "stiffness_error": "stiffness that a push finds over the stiffness asked for, less one, along the push",
    "cross_motion": "displacement across the push beyond the one asked for",
    "unrest": f"motion, peak to peak, in the {WINDOW:g} s before the push",
    "hunting": "largest span of motion {} while nothing that is asked for changes",
    "restarts": "how often the end effector sticks and starts anew while nothing changes",
    "pneumatic_rms": "root mean square error of the pneumatic stiffness of cylinder {}, relative to its setpoint",
    "air": "normal litres of air drawn from the supply",
    "saturation": "time in which at least one valve is asked to open fully",
    "valve_turns": "how often the command of a valve turns back, mean of the valves",
    "valve_travel": "full openings that the command of a valve moves, mean of the valves: their wear, and what is heard",
}
"""Metric, or what it begins with -> meaning; ``{}`` is the axis or the cylinder."""


def metrics() -> str:
    """The table, and what its words mean in numbers."""
    rows = [f"| `{name}` | {unit} | {_meaning(name)} |" for name, unit in UNITS.items()]
    return "\n".join(
        [
            "| metric | unit | meaning |",
            "|---|---|---|",
            *rows,
            "",
            f"- Nothing changes: target, force and setpoints have been constant for {QUIET:g} s.",
            f"- `stiffness_error`, `cross_motion` and `unrest` exist where the target stands still and the episode ends in "
            f"a push held for {HELD:g} s. Positions are means over {WINDOW:g} s, so hunting does not enter.",
            f"- Stuck: slower than {1e3 * STUCK:g} mm/s. Restarted: faster than {1e3 * RUNNING:g} mm/s after that.",
            "- Bandwidth and energy are not metrics of an episode; [What a hand feels](../laboratory/haptics.md) defines what "
            "`birthsim study haptics` measures.",
        ]
    )


def _meaning(name: str) -> str:
    if name in MEANINGS:
        return MEANINGS[name]
    kind, _, axis = name.rpartition("_")
    return MEANINGS[kind].format(AXES.get(axis, axis))
