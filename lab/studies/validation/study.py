"""What the plant assumes beside what others measured: seals of pistons, a servovalve, tubes.

The data stay in a folder of the user's, because not all of them may be handed on. docs/validation.md says where each comes
from.
"""

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import register
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.studies.validation import seals, tables, tubes, valve


def _hashes(data: Path, files: Iterable[Path]) -> dict[str, str]:
    """SHA-256 of each file, named as below ``data``; nothing where one is missing."""
    listed = list(files)
    if not all(file.is_file() for file in listed):
        return {}
    return {str(file.relative_to(data)): hashlib.sha256(file.read_bytes()).hexdigest() for file in listed}


def _tasks(options: Options) -> dict[Any, Task]:
    data = Path(options.data)
    tasks = dict[Any, Task]()
    for seal in seals.SEALS:
        if files := _hashes(data, (seals.file_of(data, seal, bar) for bar in seals.BARS)):
            tasks["seals", seal] = Task(f"seal-{seal}", seals.measure, {"data": str(data), "seal": seal, "files": files})
    if files := _hashes(data, [data / valve.FILE]):
        tasks["valve", ""] = Task("valve", valve.measure, {"data": str(data), "files": files})
    wanted = [
        tubes.files_of(data, length, bar, way) for length in tubes.LENGTHS for bar in tubes.SUPPLIES for way in tubes.WAYS
    ]
    if all(wanted) and (files := _hashes(data, (file for each in wanted for file in each))):
        tasks["tubes", ""] = Task("tubes", tubes.measure, {"data": str(data), "files": files})
    if not options.data or not tasks:
        raise ValueError(
            f"--data = {shown(options.data)} has no measured data that the study knows; "
            f"allowed: a folder with {seals.FOLDER}/, {tubes.FOLDER}/ or {valve.FILE}, as docs/validation.md says"
        )
    return tasks


def _kept(options: Options, found: Found) -> dict[str, Any]:
    """Results by subject; of a subject with several, by name."""
    kept = dict[str, Any]()
    for (subject, name), result in found.items():
        if name:
            kept.setdefault(subject, dict[str, Result]())[name] = result
        else:
            kept[subject] = result
    return kept


def _shown(content: Content) -> dict[str, str]:
    return {f"validation_{subject}.md": text + "\n" for subject, text in tables.tables(content["figures"]).items()}


def _pictures(content: Content, folder: Path) -> list[Path]:
    # pyplot takes half a second to load.
    from lab.studies.validation.figure import validation_figure

    return validation_figure(content["figures"], folder)


STUDY = Study(
    {"data": ""},
    _tasks,
    _kept,
    {"levels": "N", "own": "N", "one_level": "N", "by_pressure": "N", **seals.UNITS, "fastest": "m/s", **tubes.UNITS},
    _shown,
    _pictures,
    words={"data": "folder with the measured data, as docs/validation.md says"},
    places=("data",),
)
register(study="validation", about="what the plant assumes, beside measured seals, valves and tubes")(STUDY)
