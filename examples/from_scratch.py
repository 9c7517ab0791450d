"""How PPO from scratch learns, with the defaults of Stable-Baselines3 and of CleanRL: runs both examples, prints their returns.

python examples/from_scratch.py --out out/scratch          needs pip install -e '.[agents]'; a run of 1 million steps
                                                           takes minutes; what --out holds is kept
"""

import argparse
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from tqdm import tqdm

from birthsim_env.parts.scenarios import environment_id
from birthsim_env.registry import names

HERE = Path(__file__).resolve().parent
EXAMPLES = {"Stable-Baselines3": "sb3_ppo.py", "CleanRL": "cleanrl_ppo.py"}
LINE = re.compile(r"^\s*([\d,]+) steps: episodes of (\d+) steps, normalised return (-?\d+)", re.MULTILINE)


def run(job):
    """The output of one training, from the folder where it is there."""
    name, environment, seed, steps, folder = job
    short = environment.removeprefix("BirthSIM/")
    path = folder / f"{name}-{short}-{seed}-{steps}.txt"
    if not path.is_file():
        command = [sys.executable, str(HERE / EXAMPLES[name]), environment, str(steps), str(seed)]
        command += [str(path.with_suffix(".zip"))] if name == "Stable-Baselines3" else []
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{' '.join(command)}:\n{done.stderr[-2000:]}")
        partial = path.with_suffix(".partial")
        partial.write_text(done.stdout, encoding="utf-8")
        partial.replace(path)
    return np.array([[float(x.replace(",", "")) for x in row] for row in LINE.findall(path.read_text(encoding="utf-8"))])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--env", nargs="+", default=[environment_id(name) for name in names("scenario")])
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    jobs = [
        (name, environment, seed, arguments.steps, arguments.out)
        for environment in arguments.env
        for name in EXAMPLES
        for seed in range(arguments.seeds)
    ]
    with ThreadPoolExecutor(arguments.jobs) as pool:
        curves = list(tqdm(pool.map(run, jobs), total=len(jobs), unit=" trainings"))
    print(f"{'environment':22}{'algorithm':20}{'seed':>5}{'steps of the first':>20}{'and last episodes':>19}{'return':>8}")
    for (name, environment, seed, *_), curve in zip(jobs, curves, strict=True):
        print(f"{environment:22}{name:20}{seed:5}{curve[0, 1]:20.0f}{curve[-1, 1]:19.0f}{curve[-1, 2]:8.0f}")
    print(f"written to {arguments.out}/: the output of every training")
