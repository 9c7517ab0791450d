"""Stages that only built loops have: what a law is asked for, inputs from outside, and one valve per cylinder."""

from __future__ import annotations

import math

from birthsim_build.layout import (
    ADD,
    ADD_FORCE,
    BEGINS,
    CLOCK,
    DAMPING,
    EPISODE,
    HELD,
    INPUTS,
    KEEP,
    KEEP_FORCE,
    LIMIT,
    POINTER,
    PULL,
    STIFFNESS,
)
from birthsim_env.loop.rows import FORCE, MOTION, OPENING, REFERENCE, SEEN, TIME, WORLD
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.loop.stage import block
from birthsim_env.physics.compiled.compilation import kernel


@kernel
def pair_valves(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """One 5/3 valve per cylinder gets half the difference of what its chambers should: what moves the piston."""
    s = block(seen, SEEN)
    for cylinder in range(2):
        for i in range(n):
            half = (s[OPENING + 2 * cylinder, i] - s[OPENING + 2 * cylinder + 1, i]) / 2.0
            s[OPENING + 2 * cylinder, i], s[OPENING + 2 * cylinder + 1, i] = half, -half
    return 0


@kernel
def enter_scenario(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """The clock shows the time since the scenario began, until ``outside`` puts it back."""
    s, m = block(seen, SEEN), block(memory, INPUTS)
    for i in range(n):
        m[CLOCK, i] = s[TIME, i]
        s[TIME, i] -= m[BEGINS, i]
    return 0


@kernel
def outside(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Inputs act on what is asked for and on the hand's force; memory: the rows of ``layout`` that are inputs."""
    w, s, m = block(world, WORLD), block(seen, SEEN), block(memory, INPUTS)
    for i in range(n):
        m[EPISODE, i], s[TIME, i] = s[TIME, i], m[CLOCK, i]
        for row in range(REFERENCES):
            if m[KEEP + row, i] == 0.0:
                s[REFERENCE + row, i] = m[ADD + row, i]
            elif m[ADD + row, i] != 0.0:
                s[REFERENCE + row, i] += m[ADD + row, i]
        held = 1.0 if m[HELD, i] != 0.0 else 0.0
        for axis in range(2):
            stretched = m[POINTER + axis, i] - w[MOTION + axis, i]
            m[PULL + axis, i] = held * (m[STIFFNESS, i] * stretched - m[DAMPING, i] * w[MOTION + 2 + axis, i])
        size = math.sqrt(m[PULL, i] * m[PULL, i] + m[PULL + 1, i] * m[PULL + 1, i])
        for axis in range(2):
            if size > m[LIMIT, i]:
                m[PULL + axis, i] = m[PULL + axis, i] * (m[LIMIT, i] / size)
            own = w[FORCE + axis, i] if m[KEEP_FORCE, i] != 0.0 else 0.0
            added = m[ADD_FORCE + axis, i]
            w[FORCE + axis, i] = own + added if added != 0.0 else own
            if held != 0.0:
                w[FORCE + axis, i] += m[PULL + axis, i]
    return 0
