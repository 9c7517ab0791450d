"""A rig in C speaks with ``birthsim drive``: the example that comes with the header of its packets."""

import shutil
import socket
import subprocess

import numpy as np

from baselines.named import make_controller
from birthsim_drive.driver import make_driver
from birthsim_drive.loop.control import COURSE, Loop, warm_up
from birthsim_drive.loop.record import Period, Record
from birthsim_drive.safety.limits import Limits
from birthsim_drive.session import needs_of
from birthsim_env.loop.rows import Signals
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.build.targets import need
from tests.build.test_c_face import STRICT
from tests.console import PATIENCE, ROOT

RIG = Parameters()
PERIOD = RIG.electronics.control_period


def _free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        return link.getsockname()[1]


def test_a_rig_in_c_is_driven_as_the_plant_in_python(library, tmp_path):
    need(shutil.which("cc"), "a C compiler is missing")
    own = ROOT / "birthsim_drive" / "c"
    line = (
        "cc",
        *STRICT,
        "-O2",
        f"-I{library}",
        f"-I{own}",
        own / "rig.c",
        library / "libbirthsim.so",
        f"-Wl,-rpath,{library}",
    )
    subprocess.run([*map(str, line), "-o", str(tmp_path / "rig")], check=True)
    port, law, record = _free_port(), make_controller("backstepping", RIG), Record.make(tmp_path / "periods", 5000)
    warm_up(law)
    with subprocess.Popen([tmp_path / "rig", str(port)], stdout=subprocess.PIPE, text=True) as rig:
        assert rig.stdout.readline() == "listening\n"
        driver = make_driver(f"udp:127.0.0.1:{port}", RIG)
        driver.wait = PATIENCE
        limits = Limits().for_rig(RIG)
        loop = Loop(law, None, driver, limits, RIG, record, needs_of(law), duration=0.5, ramp=0.2, lockstep=True)
        loop.run()
        said, _ = rig.communicate(timeout=PATIENCE)
    assert rig.returncode == 0
    assert loop.faults == []
    rows = record.kept
    signals, openings = Signals(rows[Period.signals.place]), rows[Period.opening.place]
    assert (rows[Period.phase.first] == COURSE).sum() == 500
    assert np.abs(openings).max() > 0.01
    plant, still = Plant(RIG), np.zeros((2, 1))
    for k in range(rows.shape[1]):
        motion = plant.end_effector()
        assert signals.position[:, k].tolist() == motion[:2, 0].tolist()
        assert signals.pressure[:, k].tolist() == plant.pressures[:, 0].tolist()
        plant.advance(openings[:, [k]], still, PERIOD)
    assert [float(word) for word in said.split()] == plant.end_effector()[:2, 0].tolist()
