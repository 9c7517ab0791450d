"""What a hand feels of several laws and sensors, in pieces that several processes and interrupted runs put together."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from baselines.bench.pieces import file_stem
from baselines.work.tasks import Result, Task
from lab.studies.haptics import backdriving, coupled, rendering
from lab.studies.haptics.backdriving import measure_backdriving
from lab.studies.haptics.coupled import measure_hands, measure_z_width
from lab.studies.haptics.release import measure_release
from lab.studies.haptics.rendering import measure_rendering
from lab.studies.haptics.worlds import condition_of, uses_force

SUBJECTS = ("impedance", "release", "backdriving", "hands", "z_width")
"""What can be measured; ``impedance`` has own error, energy, air and saturation beside it."""


@dataclass(frozen=True)
class Key:
    """A law under one condition: its ``controller_settings``, sensors, first seed, rigs drawn, and whether it has its force
    sensor."""

    settings: dict[str, Any]
    sensors: str
    seed: int
    rigs: int
    force_sensor: bool

    def arguments(self) -> dict[str, Any]:
        """As the pieces' functions take them, and JSON."""
        own = {"sensors": self.sensors, "seed": self.seed, "rigs": self.rigs, "force_sensor": self.force_sensor}
        return {**self.settings, **own}


def haptic_tasks(key: Key, subjects: Sequence[str]) -> dict[str, list[Task]]:
    """Subject -> pieces of one law under one condition."""
    variants: dict[str, tuple[Any, list[dict[str, Any]]]] = {
        "impedance": (measure_rendering, [{"stiffness": value} for value in rendering.STIFFNESSES]),
        "release": (measure_release, [{}]),
        "backdriving": (measure_backdriving, [{"stiffness": value} for value in backdriving.STIFFNESSES]),
        "hands": (measure_hands, [{"damping": value} for value in coupled.DAMPINGS]),
        "z_width": (measure_z_width, [{}]),
    }
    place = f"pieces/{file_stem(key.settings['controller'])}/{key.sensors}"
    return {
        subject: [
            Task("-".join([f"{place}-{subject}", *map(str, one.values())]), work, {**key.arguments(), **one}) for one in each
        ]
        for subject, (work, each) in variants.items()
        if subject in subjects
    }


def gathered(key: Key, tasks: dict[str, list[Task]], done: dict[str, Result]) -> dict[str, Any]:
    """One law under one condition as JSON: what it is, and the pieces of every subject."""
    condition = condition_of(**key.arguments())
    return {
        "controller": key.settings["controller"], "sensors": key.sensors, "seed": key.seed, "rigs": key.rigs,
        "uses_force": uses_force(condition),
        **{subject: [done[task.name] for task in each] for subject, each in tasks.items()},
    }  # fmt: skip
