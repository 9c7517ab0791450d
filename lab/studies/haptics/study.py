"""What a hand feels at the end effector: impedance, own error, energy, stability, friction and the release of a pull."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from baselines.bench.pieces import controller_settings
from baselines.work.tasks import Task
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import names, register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study, no_pictures
from lab.studies.haptics.kept import kept
from lab.studies.haptics.measurements import SUBJECTS, Key, gathered, haptic_tasks
from lab.studies.haptics.tables import heading, report, reports

UNITS = {
    "stiffness": "N/m", "peak": "N", "bandwidth": "Hz", "unnoticed": "Hz", "unnoticed_without_work": "Hz", "energy": "J",
    "shortage": "J", "error_own_mm": "mm", "error_spring_mm": "mm", "air": "l/min", "saturation": "%", "motion_mm": "mm",
    "frequency": "Hz", "magnitude": "N/m", "phase": "degrees", "damping": "N s/m", "time": "s", "offset_mm": "mm",
    "overshoot_mm": "mm", "speed": "m/s", "kinetic": "J", "stored": "J", "mean": "N", "most": "N",
}  # fmt: skip


def _by_law(options: Options) -> list[tuple[Key, dict[str, list[Task]]]]:
    """Each controller under each kind of sensors, and its pieces by subject."""
    rig, rigs = load_parameters(options.parameters or None), 0 if options.nominal else options.rigs
    keys = [
        Key(controller_settings(name, rig), kind, options.seed, rigs, not options.no_force_sensor)
        for name in dict.fromkeys(options.controller)
        for kind in dict.fromkeys(options.sensors)
    ]
    return [(key, haptic_tasks(key, options.subject)) for key in keys]


def _tasks(options: Options) -> dict[Any, Task]:
    return {task.name: task for _, tasks in _by_law(options) for group in tasks.values() for task in group}


def _kept(options: Options, found: Found) -> Any:
    return [kept(gathered(key, tasks, dict(found))) for key, tasks in _by_law(options)]


def _shown(content: Content, name: str) -> dict[str, str]:
    return {f"{name}.md": report(content["figures"], content["settings"]["parameters"])}


def _by_subject(content: Content) -> dict[str, str]:
    """A file for each subject, which begins with its title: the page that shows it has a heading of its own."""
    texts, figures = dict[str, str](), content["figures"]
    for subject, text in reports(figures, content["settings"]["parameters"]).items():
        title, tables = text.removeprefix("### ").split("\n\n", 1)
        texts[f"haptics-{subject}.md"] = f"*{title}.* {heading(figures)}\n\n{tables}\n"
    return texts


def _pictures(content: Content, folder: Path) -> list[Path]:
    # pyplot takes half a second to load.
    from lab.studies.haptics.figures import haptic_figures

    return haptic_figures(content["figures"], folder)


def _haptics(
    show: Callable[[Content], dict[str, str]], draw: Callable[[Content, Path], list[Path]] = no_pictures, **options: Any
) -> Study:
    """A study of some controllers; the seeds are of worlds on which nothing was tuned or decided."""
    return Study(
        {
            "controller": ("backstepping", "backstepping-cartesian", "admittance-backstepping", "pid"),
            "sensors": ("ideal", "lab"),
            "subject": SUBJECTS,
            "rigs": 4,
            "nominal": False,
            "no_force_sensor": False,
            "seed": 4_100_000,
            "parameters": "",
            **options,
        },
        _tasks,
        _kept,
        UNITS,
        show,
        draw,
        allowed={"sensors": tuple(names("sensors")), "subject": SUBJECTS},
        words={
            "controller": "registered names, with options, or path/to/file.py:Class",
            "rigs": "randomised ones",
            "nominal": "the rig as the controllers believe it, instead of randomised ones",
            "no_force_sensor": "show the controllers a hand's force of zero",
            "parameters": "TOML file of the rig",
        },
    )


STUDY = _haptics(_by_subject, _pictures)
LIMITS = _haptics(
    partial(_shown, name="limits"),
    sensors=("lab", "honest"),
    subject=("hands", "release"),
    seed=6_400_000,
    rigs=24,
    controller=("backstepping", "limited:backstepping", "admittance-adaptive", "limited:admittance-adaptive"),
)
ACCELERATION = _haptics(
    partial(_shown, name="acceleration-feel"),
    sensors=("lab", "honest"),
    subject=("release",),
    seed=70_000,
    rigs=8,
    controller=("admittance-adaptive",),
    parameters="examples/acceleration_sensor_rig.toml",
)
register(study="acceleration-feel", about="a pull let go with an acceleration sensor")(ACCELERATION)
register(study="haptics", about="what a hand feels")(STUDY)
register(study="limits", about="what a hand feels of a controller in a limiter")(LIMITS)
