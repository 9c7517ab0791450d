"""Controllers that a control engineer would try, or that the literature asks for: PID, LQR, sliding modes, observers of what
the model lacks, adaptation and learning, piston by piston, and nonlinear MPC.

All follow the same compliant motion (``baselines.estimation.admittance``) and know the same of the rig: its mass, weight and
friction and the measured user force. What differs is the loop round each piston; the MPC plans for both together, with
a model that ``symbolic.symbolic_model`` gives in symbols. A controller is a file here, which registers itself.
"""
