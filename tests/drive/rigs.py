"""Drives in one process: a simulated rig in a thread, the control loop beside it."""

import socket
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

from birthsim_drive.driver import make_driver
from birthsim_drive.loop.control import Loop, warm_up
from birthsim_drive.loop.record import Record
from birthsim_drive.safety.limits import Limits
from birthsim_drive.session import Drive, course_of, law_of, needs_of
from birthsim_drive.simulated import PATIENCE, Simulated, serve
from birthsim_env.physics.rig.parameters import Parameters

RIG = Parameters()
PROBE = "BirthSIM/Probe-v3"


def drive(folder: Path, simulated=None, law=None, wrap=lambda driver: driver, **options):
    """Loop, record and fate; ``wrap`` makes of a driver the one that the loop gets; ``by_clock`` counts late periods."""
    rig, by_clock = options.pop("rig", RIG), options.pop("by_clock", False)
    limits = options.pop("limits", Limits()).for_rig(rig)
    told = {"driver": "udp", "controller": "admittance-adaptive", "rig": rig, "limits": limits, "duration": 0.5, "ramp": 0.0}
    asked = Drive(**{**told, **options})
    simulated = simulated or Simulated(PROBE, rig, "lab", lockstep=True)
    law = law or law_of(asked)
    warm_up(law)
    record = Record.make(folder / "periods", 20000)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link, ThreadPoolExecutor(1) as pool:
        link.bind(("127.0.0.1", 0))
        ready = Event()
        fate = pool.submit(serve, simulated, link, ready.set)
        while not (ready.wait(0.1) or fate.done()):
            pass
        driver = make_driver(f"udp:127.0.0.1:{link.getsockname()[1]}", rig)
        driver.wait = PATIENCE if simulated.lockstep else driver.wait
        driver = wrap(driver)
        told = (limits, rig, record, needs_of(law), asked.duration or 0.0, asked.ramp, asked.dry)
        loop = Loop(law, course_of(asked), driver, *told, lockstep=simulated.lockstep and not by_clock)
        loop.run()
        return loop, record, fate.result()
