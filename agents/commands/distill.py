"""Recurrent students learn from privileged policies to act without what those are told.

birthsim distill --teacher DIR --seeds 5 --out DIR, where DIR/seed_0 ... hold the teachers, one for each
student. A folder gets the best student so far after every round. Interrupted, the same command goes on with the seeds that are
not done.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from tqdm import tqdm

from baselines.commands.shared import run, seed_number, whole, whole_up_to
from baselines.work.files import finite, make_folder, own_folder, write_json
from baselines.work.side_by_side import side_by_side
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

try:
    from agents.policy.files import Policy, load_policy, save_policy
    from agents.reports.learning_curves import learning_curves
    from agents.training.student import Lessons, teach
    from agents.training.validation import merit
except ImportError as error:
    raise SystemExit(f"{error}; a student needs the extra: pip install 'birthsim[agents]'") from error

TAUGHT = ("environment", "sensors", "randomize", "validation_lanes")
"""What a student's training has in common with its teacher's."""


def main() -> None:
    """Entry point."""
    own = Lessons()
    parser = argparse.ArgumentParser(prog="birthsim distill", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--teacher", type=Path, required=True, metavar="DIR", help="privileged policies: seed_0 ... in it")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--hidden", type=whole_up_to(512), default=own.hidden, help="cells of memory (default: %(default)s)")
    parser.add_argument("--rounds", type=whole_up_to(1000), default=own.rounds, help="of 256 episodes (default: %(default)s)")
    parser.add_argument("--seed", type=seed_number, default=0, help="first seed, of teacher, weights and worlds (default: 0)")
    parser.add_argument("--seeds", type=whole, default=1, help="how many, one after the other from --seed on (default: 1)")
    parser.add_argument("--jobs", type=whole, default=1, help="seeds taught side by side (default: 1)")
    parser.add_argument("--out", type=Path, required=True, help="folder; each seed has one in it with its policy and curve")
    run(parser, _distill)


def _distill(arguments: argparse.Namespace) -> None:
    rig, work = load_parameters(arguments.parameters), []
    for k in range(arguments.seeds):
        lessons = Lessons(arguments.hidden, arguments.rounds, arguments.seed + k)
        place = arguments.teacher / f"seed_{lessons.seed}"
        teacher = load_policy(place)
        if not teacher.training.get("privileged", False):
            raise ValueError(f"--teacher: {str(place)!r} is not privileged; allowed: policies trained with privileged = true")
        work.append((teacher, lessons, rig, arguments.out / f"seed_{lessons.seed}", k % arguments.jobs))
    make_folder(arguments.out)
    results: dict[int, dict[str, Any]] = {}
    side_by_side(_one, work, arguments.jobs, results.__setitem__)
    for k, (_, lessons, *_) in enumerate(work):
        figures, law = results[k]["policy"], results[k]["law"]
        print(
            f"seed {lessons.seed}: {figures['pooled_mm']:.2f} mm pooled, 95 % {figures['tail_mm']:.2f} mm, {figures['lost']} "
            f"lost; law {law['pooled_mm']:.2f} mm"
        )
    print(f"written to {arguments.out}/")


def _one(teacher: Policy, lessons: Lessons, rig: Parameters, folder: Path, position: int) -> dict[str, Any]:
    """What one student reached; a folder in which a student of the same lessons is complete is left as it is."""
    shared = {name: teacher.training[name] for name in TAUGHT}
    settings = finite({**shared, **asdict(lessons), "teacher": teacher.training})
    with own_folder(folder):
        for done in learning_curves([folder]):
            its = {name: done["settings"].get(name) for name in settings}
            if its != settings or done["settings"].get("rig") != rig.to_dict():
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
