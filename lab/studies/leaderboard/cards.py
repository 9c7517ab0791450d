"""Model cards of learned entries: how each was trained, from what its training says of itself."""

from typing import Any

from lab.engine.tables import markdown
from lab.studies.leaderboard import who

FIRST = (
    "environment",
    "sensors",
    "randomize",
    "algorithm",
    "law",
    "impedance",
    "authority",
    "policy_period",
    "force_sensor",
    "hidden",
)
"""Settings that a card begins with."""


def cards(known: dict[str, dict[str, Any]]) -> str:
    """A card for each learned entry."""
    return "\n\n".join(_card(name, said) for name, said in known.items() if any(one != "controller" for one in said["kinds"]))


def _card(name: str, said: dict[str, Any]) -> str:
    settings = {key: value for key, value in who.settings(said).items() if key != "seed"}
    seeds, steps, minutes = who.training(said)
    rows = [
        ["what", "value"],
        ["policies", ", ".join(f"`{one}`" for one in said["policies"])],
        ["kind", ", ".join(dict.fromkeys(said["kinds"]))],
        ["learned", who.learned(said)],
        ["judged in", ", ".join(f"`{one['task']}`" for one in said["tasks"])],
        ["training seeds", seeds],
        ["million policy steps, each seed", steps],
        ["minutes, each seed, with validation", minutes],
        ["SHA-256 of the weights, first task", ", ".join(f"`{one[:12]}`" for one in said["sha256"][0])],
        *([key, f"`{settings[key]}`"] for key in FIRST if key in settings),
        [
            "other hyperparameters",
            ", ".join(f"`{key} = {value}`" for key, value in settings.items() if key not in FIRST) or "-",
        ],
    ]
    return f"`{name}`:\n\n{markdown(rows)}"
