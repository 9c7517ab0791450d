"""Splits: which seeds of worlds serve which purpose, declared once.

A world is an environment's episode of one seed. What learns or is tuned sees worlds of ``train``, and what is chosen between is
chosen by ``validation``. The ends of the scale of scores were measured on ``scale``. ``test`` judges, and guides nothing.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from birthsim_env.physics.rig.values import near, shown


@dataclass(frozen=True)
class Split:
    """Ranges of seeds for one purpose.

    Parameters
    ----------
    name : str
        As commands take it instead of a seed.
    ranges : tuple of range
        Seeds that belong to it. The first seed of the first range is where it begins.
    about : str
        What its worlds are for.
    """

    name: str
    ranges: tuple[range, ...]
    about: str

    @property
    def first(self) -> int:
        """The seed where it begins."""
        return self.ranges[0].start

    def meets(self, seeds: range) -> bool:
        """Whether one of ``seeds`` belongs to it."""
        return any(max(own.start, seeds.start) < min(own.stop, seeds.stop) for own in self.ranges)


TRAIN = Split("train", (range(2_000_000, 4_000_000), range(10_000)), "that training and tuning may have seen")
"""``birthsim train``, ``distill`` and ``tune`` begin at 2,000,000, 2,500,000 and 3,000,000. Other libraries begin at their own
seed, ``PPO(seed=0)`` at 0, and give lane i the seed that is larger by i."""

VALIDATION = Split("validation", (range(1_000_000, 2_000_000),), "by which policies are chosen")

SCALE = Split("scale", (range(70_000, 80_000),), "on which the scale of scores was measured")

TEST = Split("test", (range(80_000, 90_000), range(47_000_000, 47_010_000)), "that guided nothing")
"""Benchmark and leaderboard take the first range, tables that compare controllers of this project the second."""

SPLITS = {one.name: one for one in (TRAIN, VALIDATION, SCALE, TEST)}
"""Name -> split. No two share a seed."""

GUIDING = (TRAIN, VALIDATION)
"""Splits whose worlds have guided what is evaluated."""


def find_split(name: str) -> Split:
    """The split of a name; ``ValueError`` names those that there are."""
    if name not in SPLITS:
        raise ValueError(f"split = {shown(name)}{near(name, SPLITS)}; allowed: {', '.join(SPLITS)}")
    return SPLITS[name]


def first_seed(seed: int | str) -> int:
    """A seed as it is, or the first one of the split that it names."""
    return find_split(seed).first if isinstance(seed, str) else seed


def split_of(seeds: range) -> str:
    """The name of the split that all ``seeds`` belong to, or ""."""
    for one in SPLITS.values():
        if any(own.start <= seeds.start and seeds.stop <= own.stop for own in one.ranges):
            return one.name
    return ""


def caution(seeds: range, among: Iterable[Split] = GUIDING) -> str:
    """One line where worlds of ``seeds`` have guided what is judged on them, and what to use instead; else ""."""
    met = [one for one in among if one.meets(seeds)]
    if not met:
        return ""
    said = " and ".join(f"of the split {one.name}, worlds {one.about}" for one in met)
    return f"seeds {seeds.start} to {seeds.stop - 1} are {said}; for results to report: --seed {TEST.name}"
