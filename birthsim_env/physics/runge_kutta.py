"""The plant's Runge-Kutta method: the classical one, or Ralston's where ``BIRTHSIM_STEP`` asks for it."""

from birthsim_env.physics.step import METHOD

if METHOD == "rk3":
    from birthsim_env.physics.ralston import STAGES as STAGES
    from birthsim_env.physics.ralston import ahead_of as ahead_of
    from birthsim_env.physics.ralston import weight_of as weight_of
else:
    from birthsim_env.physics.classical import STAGES as STAGES
    from birthsim_env.physics.classical import ahead_of as ahead_of
    from birthsim_env.physics.classical import weight_of as weight_of
