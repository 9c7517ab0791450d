"""A recurrent student learns from a privileged policy to act without what that one is told.

python -m agents.commands.distill --teacher DIR --out DIR, and then agents.commands.beside_law --policy DIR. The best student
so far is in --out after every round; an interrupted command does not continue.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from baselines.commands.shared import run, seed_number, whole_up_to
from birthsim_env.physics.rig.parameters import load_parameters

try:
    from agents.policy.files import load_policy
    from agents.policy.seeds import best_policy
    from agents.training.student import Lessons, teach
    from agents.training.student_file import save_student
except ImportError as error:
    raise SystemExit(f"{error}; a student needs the extra: pip install 'birthsim[agents]'") from error


def main() -> None:
    """Entry point."""
    own = Lessons()
    parser = argparse.ArgumentParser(prog="agents.commands.distill", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--teacher", required=True, metavar="DIR", help="folder of a policy that was trained privileged")
    parser.add_argument("--parameters", help="TOML file of the rig (default: the paper's)")
    parser.add_argument("--hidden", type=whole_up_to(512), default=own.hidden, help="cells of memory (default: %(default)s)")
    parser.add_argument("--rounds", type=whole_up_to(1000), default=own.rounds, help="of 256 episodes (default: %(default)s)")
    parser.add_argument("--seed", type=seed_number, default=own.seed, help="of weights and worlds (default: %(default)s)")
    parser.add_argument("--out", type=Path, required=True, help="folder for student.safetensors")
    run(parser, _distill)


def _distill(arguments: argparse.Namespace) -> None:
    teacher = load_policy(best_policy(arguments.teacher))
    if not teacher.training.get("privileged", False):
        raise ValueError(f"--teacher {arguments.teacher!r} is not privileged; allowed: a policy trained with privileged = true")
    lessons = Lessons(arguments.hidden, arguments.rounds, arguments.seed)
    rounds = teach(teacher, lessons, load_parameters(arguments.parameters))
    for number, (student, score, best) in enumerate(rounds, start=1):
        said = f"round {number} of {lessons.rounds}: {score.pooled:.3f} mm, 95 % {score.tail:.2f} mm, {score.lost} lost"
        if best:
            training = {"lessons": asdict(lessons), "teacher": teacher.training, "reached": score.to_dict()}
            save_student(student, teacher, training, arguments.out)
            said += f"; the best so far, written to {arguments.out}/"
        print(said, flush=True)


if __name__ == "__main__":
    main()
