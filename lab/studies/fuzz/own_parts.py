"""Kinds of a user's own parts: CSV files of references and forces, and Python files with a controller."""

from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.fuzz.files import loaded, written
from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import Rng, damaged, plain


def _csv(_: Any, rng: Rng, folder: Path, case: Case) -> None:
    from birthsim_env.parts.courses import check_points
    from birthsim_env.parts.own_parts import hand_of, trajectory_of
    from birthsim_env.parts.times import called, check_times
    from birthsim_env.physics.rig.parameters import Parameters

    time = np.arange(int(rng.integers(1, 40))) * 0.1
    lines = ["time, x, y", *(f"{t},{0.5 + 0.01 * t:.4f},0.01" for t in time)]
    for _ in range(int(rng.integers(4))):
        line = int(rng.integers(len(lines)))
        cells = lines[line].split(",")
        value = plain(rng)
        cells[rng.integers(len(cells))] = str(value) if not isinstance(value, int) or value < 10**400 else "9" * 5000
        lines[line] = ",".join(cells[: int(rng.integers(1, 5))])
    text = "\n".join(lines).encode("utf-8", "surrogatepass")
    path = written(case, folder / "ours.csv", damaged(rng, text) if rng.random() < 0.5 else text)
    if rng.random() < 0.5:
        trajectory = trajectory_of(path, 1.0)
        assert np.isfinite(trajectory.sample(np.linspace(-1.0, 5.0, 99))).all()
        check_times("reference", path, trajectory.timed, 1.0, True)
        check_points(called("reference", path), trajectory, 1.0, Parameters())
    else:
        hand = hand_of(path, False)
        check_times("user_force", path, hand.timed, 1.0, True)
        hand.prepare(2)
        hand.begin(0, np.random.default_rng(0))
        assert np.isfinite(hand.force(np.zeros((1, 2)), np.zeros((2, 2)), np.zeros((2, 2)))).all()


_SOURCES = (
    "import numpy as np\nclass Own:\n    def __init__(self, rig): pass\n    def reset(self, lanes=None): pass\n"
    "    def command(self, measurement, reference): return np.zeros(4)\n",
    "import no_such_module_anywhere\n",
    "raise RuntimeError('at import')\n",
    "raise SystemExit(3)\n",
    "import sys\nsys.exit()\n",
    "def broken(:\n",
    "x = " + "(" * 500 + ")" * 500,
    "x = 1 / 0\n",
    "from . import Own\n",
    "class Own: pass\n",
    "Own = 3\n",
    "Own = None\n",
    "import Own from nothing\n",
    "def f(): f()\nf()\n",
    "raise KeyError\n",
    "raise ValueError('a\\nb')\n",
    "# coding: latin-99\nOwn = 1\n",
    "class Own(Exception): pass\nraise Own('ö' * 5000)\n",
    "raise GeneratorExit\n",
    "class Own:\n    def __init__(self, rig): raise SystemExit(1)\n",
    "class Own:\n    def __init__(self, rig): self.command, self.reset = 1, 2\n",
    "def Own(*a): return None\n",
    "raise MemoryError\n",
    "x = " + "9" * 5000 + "\n",
    "class Own:\n    def __init__(self, rig): raise ValueError('a\\nb' * 2000)\n",
)


def _controller_file(_: Any, rng: Rng, folder: Path, case: Case) -> None:
    from baselines.registry import make_controller
    from birthsim_env.physics.rig.parameters import Parameters

    text = _SOURCES[rng.integers(len(_SOURCES))].encode()
    path = written(case, folder / "ours.py", damaged(rng, text) if rng.random() < 0.5 else text)
    make_controller(f"{path}:Own", Parameters())


OWN_PARTS: dict[str, Kind] = {"csv": Kind(loaded, _csv), "controller-file": Kind(loaded, _controller_file, runs_code=True)}
