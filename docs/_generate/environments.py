"""One section per registered environment id: what is seen, done and paid, and what it is made of by default."""

import inspect
import re

import gymnasium

import agents  # noqa: F401  registers the ids with a controller inside
import birthsim_env
from birthsim_env import observation, reward
from birthsim_env.assembly import DEFAULTS
from birthsim_env.info import FIELDS
from birthsim_env.parts.scenarios import environment_id, find_scenario
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import Entry, entries, entry, names


def environments() -> str:
    """A card per id, what all share, then a section per id."""
    cards = "\n\n".join(_card(name) for name in names("scenario"))
    return "\n\n".join([f":::{{container}} cards\n{cards}\n:::", _shared(), *(_section(name) for name in names("scenario"))])


def _picture(scenario: str) -> str:
    """How a section and its card show an experiment."""
    return (
        f"![{environment_id(scenario)} under admittance-backstepping, in real time](../../out/docs-generated/{scenario}.webp)"
    )


def _card(scenario: str) -> str:
    anchor = re.sub(r"[^a-z0-9-]", "", environment_id(scenario).lower())
    return f"[{_picture(scenario)}](#{anchor}) **{scenario.capitalize()}.** {entry('scenario', scenario).about}"


def _shared() -> str:
    scales = [f"{entry.scale:g} {entry.unit}".replace("1 half strokes", "half a stroke") for entry in observation.ENTRIES]
    rows = [
        f"| {k} | {entry.name} | {scale} |" for k, (entry, scale) in enumerate(zip(observation.ENTRIES, scales, strict=True))
    ]
    info = [f"| `{name}` | {size} | {words} |" for name, (size, words) in FIELDS.items()]
    terms = (reward.__doc__ or "").strip()
    return "\n".join(
        [
            "## What all have in common",
            "",
            f"Version of the package: {birthsim_env.__version__}. The full contract of an environment is its docstring, "
            f"{{py:class}}`birthsim_env.env.BirthSIMEnv`.",
            "",
            "### Observation",
            "",
            f"Each entry is a reading divided by the scale in the last column, clipped to ±{observation.LIMIT:g}; "
            "the last action follows them.",
            "",
            "| index | entry | value that maps to 1 |",
            "|---|---|---|",
            *rows,
            "",
            "### Sensors",
            "",
            "Errors have the sizes that `electronics` of the rig has ([all of them](rig.md)).",
            "",
            "| `sensors` | what they show | looks | `randomize` draws its errors | a board before the valves |",
            "|---|---|---|---|---|",
            *map(_sensor_row, entries("sensors")),
            "",
            "### Hands",
            "",
            "Instead of the scenario's, `user_force` takes one by its name.",
            "",
            "| `user_force` | what it does | feels where the head is |",
            "|---|---|---|",
            *map(_hand_row, entries("hand")),
            "",
            "### Frictions",
            "",
            "`friction = NAME` under `[randomize]` in the file of a rig draws the friction of its plants, wherever rigs are "
            "drawn. Controllers go on believing the friction that the file describes. What an entry does not name is as the "
            "file says, or drawn as [the rig](rig.md) documents it.",
            "",
            "| `friction` | what plants have | laws | ranges, SI | source |",
            "|---|---|---|---|---|",
            *map(_friction_row, entries("friction")),
            "",
            "### Reward",
            "",
            terms,
            "",
            "### Arguments and their defaults",
            "",
            ", ".join(f"`{name}={value}`" for name, value in _arguments().items()) + ".",
            "",
            "### Info",
            "",
            "The true state, whatever the sensors say.",
            "",
            "| key | numbers | unit and meaning |",
            "|---|---|---|",
            *info,
            *(f"| `{name}` | 1 | term of the reward |" for name in reward.REWARD_TERMS),
            "| `is_success` | 1 | settled error below 1 mm so far, and not terminated |",
        ]
    )


def _sensor_row(model: Entry) -> str:
    made = model.made(Parameters().electronics, 1)
    looks = "every control period" if made.sampled else "when it is asked"
    return f"| `{model.name}` | {model.about} | {looks} | {_yes(made.drawn)} | {_yes(made.has_board)} |"


def _hand_row(hand: Entry) -> str:
    return f"| `{hand.name}` | {hand.about} | {_yes(hand.made.closed_loop)} |"


def _friction_row(friction: Entry) -> str:
    laws = ", ".join(f"`{law}`" for law in friction.made.laws)
    ranges = "; ".join(f"`{name}` {low:g} to {high:g}" for name, (low, high) in friction.made.ranges.items())
    return f"| `{friction.name}` | {friction.about} | {laws} | {ranges} | {friction.made.source} |"


def _yes(said: object) -> str:
    return "yes" if said else "no"


def _section(scenario: str) -> str:
    name, made = environment_id(scenario), find_scenario(scenario)
    facts = {
        "experiment": made.experiment,
        "what one meets": entry("scenario", scenario).about,
        "duration": f"{made.duration:g} s, {round(made.duration / 0.01)} steps of 10 ms",
        **_spaces(name),
        **{f"{kind}, controller inside": text for kind, text in _spaces(environment_id(scenario, "Residual")).items()},
    }
    rows = [f"| {fact} | {text} |" for fact, text in facts.items()]
    return "\n".join(
        [
            f"## `{name}`",
            "",
            _picture(scenario),
            "",
            "| what | value |",
            "|---|---|",
            *rows,
            "",
            "What it is made of, as it stands and as `randomize` draws it (SI units):",
            "",
            "```py",
            inspect.getsource(type(made)).rstrip(),
            "```",
        ]
    )


def _spaces(name: str) -> dict[str, str]:
    env = gymnasium.make(name)
    entries = [one.removeprefix("last action: ") for one in env.unwrapped.observation_names if one.startswith("last action")]
    spaces = {"action": f"`{env.action_space}`: {'; '.join(entries)}", "observation": f"`{env.observation_space}`"}
    env.close()
    return spaces


def _arguments() -> dict[str, str]:
    """Argument of ``gymnasium.make`` -> its default."""
    return {name: repr(default) for name, default in DEFAULTS.items()}
