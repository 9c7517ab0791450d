"""What a process may do to be on time: no garbage collection, locked memory, a priority before others, processors that stay
awake."""

import ctypes
import gc
import os
import sys
from dataclasses import dataclass

MEMORY = 3
"""MCL_CURRENT | MCL_FUTURE of mlockall."""

PRIORITY = 50
"""Of SCHED_FIFO, 1 to 99; assumed: above other programs, below what a kernel for real time gives its interrupts."""


LATENCY = "/dev/cpu_dma_latency"
"""Where Linux is told how late a processor may wake, us in 32 bits, for as long as the file is open (its PM QoS interface)."""


@dataclass(frozen=True)
class Granted:
    """What the system has granted."""

    memory_locked: bool
    priority: int
    """Of SCHED_FIFO; 0 where it was refused or not asked for."""
    awake: bool
    """Whether idle processors poll instead of sleeping; a virtual one that sleeps may be taken away for milliseconds."""
    kernel: str
    """The system's own words of its kernel; PREEMPT_RT is one for real time."""

    def words(self) -> str:
        """In a line."""
        locked = "memory locked" if self.memory_locked else "memory not locked"
        first = f"SCHED_FIFO {self.priority}" if self.priority else "no priority"
        awake = "idle processors kept awake" if self.awake else "idle processors asleep"
        return f"{locked}, {first}, {awake}, kernel {self.kernel}"


def prepare(priority: int) -> Granted:
    """Make this process as punctual as the system allows; what is refused is said, not raised."""
    gc.collect()
    gc.freeze()
    gc.disable()
    return Granted(_lock_memory(), _raise_priority(priority), priority > 0 and _stay_awake(), _kernel())


def _lock_memory() -> bool:
    try:
        return int(ctypes.CDLL(None).mlockall(MEMORY)) == 0
    except (OSError, AttributeError):  # a system without it
        return False


def _raise_priority(priority: int) -> int:
    if priority == 0 or not hasattr(os, "sched_setscheduler"):
        return 0
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return 0
    return priority


def _stay_awake() -> bool:
    """Until this process ends, which closes the file."""
    try:
        told = os.open(LATENCY, os.O_WRONLY)
        os.write(told, (0).to_bytes(4, sys.byteorder))
    except OSError:  # another system, or no permission
        return False
    return True


def _kernel() -> str:
    if not hasattr(os, "uname"):
        return "unknown"
    told = os.uname()
    kinds = ("PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT")
    kind = next((one for one in kinds if one in told.version), "without preemption")
    return f"{told.sysname} {told.release} {kind}"
