"""The controllers that a control engineer would try first: PID, LQR and sliding mode, piston by piston.

All follow the same compliant motion (``baselines.admittance``) and know the same of the rig: its mass, weight and friction and
the measured user force. What differs is the loop round each piston.
"""

from baselines.rivals.lqr import LinearQuadratic
from baselines.rivals.pid import PositionPID
from baselines.rivals.sliding_mode import SlidingMode

__all__ = ["LinearQuadratic", "PositionPID", "SlidingMode"]
