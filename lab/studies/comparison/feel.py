"""How the stiffness of every controller feels: pushes at the stiffness test's poses, kept as they are and drawn."""

from pathlib import Path
from typing import Any

from baselines.bench.pieces import controller_settings
from baselines.work.tasks import Task
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.studies.comparison.grid import default_controllers
from lab.studies.comparison.stiffness import study_tasks


def _tasks(options: Options) -> dict[Any, Task]:
    rig = load_parameters(options.parameters or None)
    return study_tasks([controller_settings(name, rig) for name in dict.fromkeys(options.controller)], rig)


def _kept(_: Options, found: Found) -> Any:
    kept: dict[str, dict[str, Any]] = {}
    for (study, label), result in found.items():
        kept.setdefault(study, {})[label] = result
    return kept


def _pictures(content: Content, folder: Path) -> list[Path]:
    # pyplot takes half a second to load.
    from lab.studies.comparison.stiffness_figures import draw_studies

    return draw_studies(content["figures"], folder)


STUDY = Study(
    {"controller": tuple(default_controllers()), "parameters": ""},
    _tasks,
    _kept,
    {"stiffness": "N/m", "error_mm": "mm", "error_percent": "%", "angles": "rad", "amplitudes": "N"},
    draw=_pictures,
    partial=True,
    words={"controller": "registered names, with options, or path/to/file.py:Class"},
)
register(study="stiffness", about="how the stiffness of every controller feels")(STUDY)
