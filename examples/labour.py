"""A labour of six contractions, twenty-five times as fast as at a birth, rendered from one file.

    python examples/labour.py labour.csv

The file holds time, x, y and stiffness. A laboratory puts the output of its own biomechanical model there instead; the commands
take it too: birthsim evaluate --env BirthSIM/Descent-v1 --reference labour.csv --stiffness labour.csv ...
"""

import sys

from baselines.bench.evaluation import evaluate
from baselines.registry import make_controller
from birthsim_env import ForceProfile, Parameters
from lab.studies.labour.model import Labour

file = sys.argv[1] if len(sys.argv) > 1 else "labour.csv"
labour, faster = Labour(), 25.0
labour.write(file, faster)
for name in ("backstepping", "admittance-backstepping"):
    result = evaluate(
        "BirthSIM/Descent-v1",
        make_controller(name, Parameters()),
        name,
        1,
        0,
        False,
        reference=file,
        stiffness=file,
        duration=labour.duration / faster,
        user_force=ForceProfile(),
    )
    print(f"{name}: settled error {result.metrics['settled_rms'][0]:.3g} mm, air {result.metrics['air'][0]:.3g} l/min")
