"""Python files with a controller of a user's own, whole and damaged: whatever they raise is one line."""

from hypothesis import given

from baselines.named import make_controller
from birthsim_env import Parameters
from tests.fuzz.strategies import damaged, sampled
from tests.fuzz.watched import cases, watched

CLASS = "class Own:\n    def __init__(self, rig): "
SOURCES = (
    "import numpy as np\nclass Own:\n    def __init__(self, rig): pass\n    def reset(self, lanes=None): pass\n"
    "    def command(self, measurement, reference): return np.zeros(4)\n",
    *("import no_such_module_anywhere\n", "import Own from nothing\n", "from . import Own\n", "def broken(:\n"),
    *("raise RuntimeError('at import')\n", "raise SystemExit(3)\n", "import sys\nsys.exit()\n", "raise KeyError\n"),
    *("raise ValueError('a\\nb')\n", "raise GeneratorExit\n", "raise MemoryError\n", "def f(): f()\nf()\n", "x = 1 / 0\n"),
    *("x = " + "(" * 500 + ")" * 500, "x = " + "9" * 5000 + "\n", "# coding: latin-99\nOwn = 1\n"),
    *("class Own: pass\n", "class Own(Exception): pass\n", "Own = 3\n", "Own = None\n", "def Own(*a): return None\n"),
    "class Own(Exception): pass\nraise Own('ö' * 5000)\n",
    *(
        f"{CLASS}raise SystemExit(1)\n",
        f"{CLASS}self.command, self.reset = 1, 2\n",
        f"{CLASS}raise ValueError('a\\nb' * 2000)\n",
    ),
)
TEXTS = sampled([text.encode() for text in SOURCES])


@cases
@given(content=TEXTS | TEXTS.flatmap(damaged))
def test_a_controller_file(content):
    with watched("ours.py", runs_code=True) as case:
        path = case.folder / "ours.py"
        path.write_bytes(content)
        make_controller(f"{path}:Own", Parameters())
