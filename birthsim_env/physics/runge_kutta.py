"""The plant's Runge-Kutta method, Ralston's of third order, stage by stage.

Of the methods with three stages it has the least bound of the error (Ralston, Mathematics of Computation 16, 1962). Each stage
takes its trial state from the stage before alone, so that nothing of earlier stages is kept but their weighted sum.
"""

from birthsim_env.physics.compiled.compilation import helper

STAGES = 3


@helper
def weight_of(stage: int, step: float) -> float:
    """What the rates of a stage count for at the end of the step, s."""
    return step * 2.0 / 9.0 if stage == 0 else step / 3.0 if stage == 1 else step * 4.0 / 9.0


@helper
def ahead_of(stage: int, step: float) -> float:
    """How far a stage's rates take the next trial state, s."""
    return 0.0 if stage == 2 else step * 0.75 if stage == 1 else step / 2.0
