"""What the page of ``birthsim live`` says where something is chosen or shown: the same sentences, as tables."""

from birthsim_env.registry import entries
from birthsim_live.rig.words import CHOICES, FIGURES


def page() -> str:
    """A table for scenarios, controllers, valves, sensors and numbers."""
    sections = {
        "Scenarios": CHOICES["scenario"],
        "Controllers": {one.name: one.about for one in entries("controller", listed=True)},
        "Valves": CHOICES["valves"],
        "Sensors": CHOICES["sensors"],
        "Figures, plots and pictures": FIGURES,
    }
    return "\n\n".join(_table(title, sentences) for title, sentences in sections.items())


def _table(title: str, sentences: dict[str, str]) -> str:
    rows = [f"| {name} | {words} |" for name, words in sentences.items()]
    return "\n".join([f"## {title}", "", "| name | what it is |", "|---|---|", *rows])
