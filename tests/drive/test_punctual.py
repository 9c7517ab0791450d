"""What a control loop runs is there before it begins: nothing is imported, nothing compiled in it."""

import subprocess
import sys

SCRIPT = """
import sys, tempfile
from pathlib import Path
from birthsim_drive.simulated import Simulated
from tests.drive.rigs import PROBE, RIG, drive
import birthsim_drive.loop.control as control

before = []
begins = control.Loop.run

def run(self):
    before.append(set(sys.modules))
    begins(self)

control.Loop.run = run
with tempfile.TemporaryDirectory() as folder:
    drive(Path(folder), Simulated(PROBE, RIG, "lab", lockstep=True), ramp=0.2, duration=0.3)
print(sorted(name for name in set(sys.modules) - before[0] if not name.startswith("encodings")))
print("numba" in sys.modules)
"""


def test_the_loop_imports_and_compiles_nothing():
    done = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=600, check=True)
    imported, numba = done.stdout.splitlines()
    assert imported == "[]"
    assert numba == "False"
