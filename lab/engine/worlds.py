"""The worlds on which results are measured: every table that states a settled error names its own."""

from birthsim_env.splits import TEST

SEED, COUNT = TEST.ranges[1].start, 100
"""The test set: the seeds of no design, tuning, training or validation. All that compares controllers on one scenario is
measured on it, so that a controller has one settled error for one kind of sensors and rigs, whichever page tells it."""


def worlds(seed: int, count: int) -> str:
    """A set of worlds in words: how many, their seeds, and whether they are the test set or its first ones.

    Parameters
    ----------
    seed, count
        First seed, and how many worlds there are.
    """
    whole = "the test set" if count == COUNT else f"the first {count} of the test set"
    name = f", {whole}" if seed == SEED and count <= COUNT else ""
    return f"{count} worlds, seeds {seed} to {seed + count - 1}{name}"
