"""What a control loop runs is there before it begins: nothing is imported, nothing compiled in it."""

import subprocess
import sys
from pathlib import Path

import pytest

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


AWAKE = """
import os, sys
import birthsim_drive.loop.realtime as realtime

file, priority = sys.argv[1], int(sys.argv[2])
realtime.LATENCY = file
granted = realtime.prepare(priority)
held = [one for one in os.listdir("/proc/self/fd") if os.path.realpath(f"/proc/self/fd/{one}") == os.path.realpath(file)]
print(granted.awake, len(held), "idle processors kept awake" in granted.words())
"""


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="only Linux lists a process's files")
@pytest.mark.parametrize(("priority", "told"), [(50, "True 1 True"), (0, "False 0 False")])
def test_processors_are_told_to_stay_awake_for_as_long_as_a_loop_with_a_priority_runs(tmp_path, priority, told):
    """PM QoS: 0 us, in 32 bits, in a file that stays open. Without a priority nothing is asked of the system."""
    file = tmp_path / "cpu_dma_latency"
    file.write_bytes(b"")
    done = subprocess.run([sys.executable, "-c", AWAKE, str(file), str(priority)], capture_output=True, text=True, timeout=600)
    assert done.stdout.strip() == told, done.stderr
    assert file.read_bytes() == (bytes(4) if priority else b"")


def test_a_system_that_has_no_such_file_is_said_to_let_processors_sleep(tmp_path):
    missing = str(tmp_path / "none" / "cpu_dma_latency")
    done = subprocess.run([sys.executable, "-c", AWAKE, missing, "50"], capture_output=True, text=True, timeout=600)
    assert done.stdout.strip() == "False 0 False", done.stderr
