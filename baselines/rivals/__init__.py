"""The controllers that a control engineer would try first: PID, LQR and sliding mode, piston by piston, and nonlinear MPC.

All follow the same compliant motion (``baselines.estimation.admittance``) and know the same of the rig: its mass, weight and
friction and the measured user force. What differs is the loop round each piston; the MPC plans for both together, with
a model that ``symbolic_model`` gives in symbols.
"""

from baselines.rivals.lqr import LinearQuadratic
from baselines.rivals.pid import PositionPID
from baselines.rivals.predictive import NonlinearMPC
from baselines.rivals.sliding_mode import SlidingMode
from baselines.rivals.symbolic import symbolic_model

__all__ = ["LinearQuadratic", "NonlinearMPC", "PositionPID", "SlidingMode", "symbolic_model"]
