"""birthsim distill: recurrent students of privileged policies, where TEACHER/seed_0 ... hold one teacher for each student."""

import math
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter
from tqdm import tqdm

from baselines.bench.statistics import number
from baselines.work.side_by_side import side_by_side
from birthsim.command_line.settings import PROCESSES, Configured, RigFile, Seed, whole
from birthsim_env.extras import installation
from birthsim_env.files import finite, make_folder, own_folder, write_json
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.schema import fault

try:
    from agents.policy.files import Policy, read_policy, save_policy
    from agents.reports.learning_curves import learning_curves
    from agents.training.student import Lessons, teach
    from agents.training.validation import merit
except ImportError as error:
    raise ImportError(f"{error}; a student needs the extra: {installation('agents')}") from error

TAUGHT = {"environment": str, "sensors": str, "randomize": (bool, str), "validation_lanes": range(1, 2**16 + 1)}
"""Name -> kind of what a student's training has in common with its teacher's."""


@dataclass(kw_only=True)
class Settings(Configured):
    """Train recurrent policies, the students: from measurements alone they imitate teachers that know the true rig.

    After every round the folder gets the best student so far. After an interruption the same command continues with the seeds
    that are not complete.
    """

    teacher: Annotated[Path, Parameter(metavar="DIR")]
    """Folder of the teachers, which contains seed_0 and so on."""
    hidden: Annotated[int, whole(1, 512)] = Lessons.hidden
    """Cells of memory."""
    rounds: Annotated[int, whole(1, 1000)] = Lessons.rounds
    """Rounds of 256 episodes."""
    seed: Seed = 0
    """First seed, of teacher, weights and worlds."""
    seeds: Annotated[int, whole()] = 1
    """Number of consecutive seeds, from --seed on."""
    jobs: Annotated[int, whole(), Parameter(group=PROCESSES)] = 1
    """Number of seeds taught in parallel."""
    parameters: RigFile = None
    out: Path
    """Folder; each seed gets one in it with its policy and curve."""


def main(settings: Settings) -> None:
    """Teach every seed and print what it reached."""
    rig, work = load_parameters(settings.parameters), []
    for k in range(settings.seeds):
        lessons = Lessons(settings.hidden, settings.rounds, settings.seed + k)
        place = settings.teacher / f"seed_{lessons.seed}"
        teacher = read_policy(place)
        if not teacher.training.get("privileged", False):
            raise ValueError(f"--teacher: {str(place)!r} is not privileged; allowed: policies trained with privileged = true")
        if problem := fault(teacher.training, TAUGHT, "training"):
            raise ValueError(f"--teacher: {str(place)!r} does not say what it was trained on: {problem}")
        work.append((teacher, lessons, rig, settings.out / f"seed_{lessons.seed}", k % settings.jobs))
    make_folder(settings.out)
    results: dict[int, dict[str, Any]] = {}
    side_by_side(_one, work, settings.jobs, results.__setitem__)
    for k, (_, lessons, *_) in enumerate(work):
        figures, law = results[k]["policy"], results[k]["law"]
        errors = figures["pooled_mm"], figures["tail_mm"], law["pooled_mm"]
        said = [number(math.nan if one is None else one) for one in errors]
        print(f"seed {lessons.seed}: {said[0]} mm pooled, 95 % {said[1]} mm, {figures['lost']} lost; law {said[2]} mm")
    print(f"written to {settings.out}/")


def _one(teacher: Policy, lessons: Lessons, rig: Parameters, folder: Path, position: int) -> dict[str, Any]:
    """What one student reached; a folder in which a student of the same lessons is complete is left as it is."""
    shared = {name: teacher.training[name] for name in TAUGHT}
    settings = finite({**shared, **asdict(lessons), "teacher": teacher.training})
    with own_folder(folder):
        for done in learning_curves([folder]):
            its = {name: done["settings"].get(name) for name in settings}
            if "policy" not in done or its != settings or done["settings"].get("rig") != rig.to_dict():
                raise ValueError(f"{str(folder)!r} has a training with other settings; allowed: the same, or another folder")
            return done
        reached = _taught(teacher, lessons, rig, folder, settings, position)
        write_json(folder / "training.json", reached)
        return reached


def _taught(
    teacher: Policy, lessons: Lessons, rig: Parameters, folder: Path, settings: dict[str, Any], position: int
) -> dict[str, Any]:
    """Teaches, and keeps the best student in ``folder``."""
    began, curve, best, law = time.perf_counter(), [], None, None
    with tqdm(total=lessons.rounds, desc=f"seed {lessons.seed}", unit=" rounds", position=position) as bar:
        for steps, network, score in teach(teacher, lessons, rig):
            figures = score.to_dict()
            law = law or figures
            curve.append({"steps": steps, "seconds": time.perf_counter() - began, **figures})
            if best is None or merit(figures) < merit(best):
                best = figures
                training = {**settings, "law": law, "reached": figures}
                save_policy(Policy(network, teacher.environment, teacher.settings, training), folder)
            bar.update(len(curve) - 1 - bar.n)
            bar.set_postfix_str(f"error {best['pooled_mm']:.2f} mm, law {law['pooled_mm']:.2f} mm")
    return {
        "settings": {**settings, **teacher.settings.to_dict(), "rig": rig.to_dict()},
        "law": law,
        "paper": None,
        "policy": best,
        "curve": curve,
    }
