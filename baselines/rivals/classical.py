"""The classical Runge-Kutta method, stage by stage."""

from birthsim_env.physics.compiled.compilation import helper

STAGES = 4


@helper
def weight_of(stage: int, step: float) -> float:
    """What the rates of a stage count for at the end of the step, s."""
    return step / 6.0 if stage == 0 or stage == 3 else step / 3.0


@helper
def ahead_of(stage: int, step: float) -> float:
    """How far a stage's rates take the next trial state, s."""
    return 0.0 if stage == 3 else step if stage == 2 else step / 2.0
