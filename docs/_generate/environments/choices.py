"""What the arguments of an environment can be: sensor models, hands, frictions, a row for each."""

from _generate.tables import table
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import Entry, entries


def sensors() -> str:
    """A row for every sensor model."""
    head = ["`sensors`", "what they show", "looks", "`randomize` draws its errors", "a board before the valves"]
    return table(head, map(_sensor_row, entries("sensors")))


def _sensor_row(model: Entry) -> list[str]:
    made = model.made(Parameters().replace({"electronics.acceleration_bandwidth": 300.0}).electronics, 1)
    looks = "every control period" if made.sampled else "when it is asked"
    return [f"`{model.name}`", model.about, looks, _yes(made.drawn), _yes(made.has_board)]


def hands() -> str:
    """A row for every hand that has a name."""
    rows = [[f"`{hand.name}`", hand.about, _yes(hand.made.closed_loop)] for hand in entries("hand")]
    return table(["`user_force`", "what it does", "feels where the head is"], rows)


def frictions() -> str:
    """A row for every friction that plants can be drawn with."""
    return table(["`friction`", "what plants have", "laws", "ranges, SI", "source"], map(_friction_row, entries("friction")))


def _friction_row(friction: Entry) -> list[str]:
    laws = ", ".join(f"`{law}`" for law in friction.made.laws)
    ranges = "; ".join(f"`{name}` {low:g} to {high:g}" for name, (low, high) in friction.made.ranges.items())
    return [f"`{friction.name}`", friction.about, laws, ranges, friction.made.source]


def _yes(said: object) -> str:
    return "yes" if said else "no"
