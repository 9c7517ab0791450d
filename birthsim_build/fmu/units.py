"""What a functional mock-up unit contains: the plant, the closed loop, or the controller alone.

A unit is the parts that a control period runs, in order, and the rows that are its inputs and outputs. What belongs to the idle
cylinder of a rail is neither.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from birthsim_build.derived_parameters import parameter_names
from birthsim_build.fmu.clock import clock_stage
from birthsim_build.image import Part
from birthsim_build.layout import LAYOUT, Row
from birthsim_build.loops import World, alone_rows
from birthsim_env.loop import guard
from birthsim_env.loop.rows import (
    FAULT,
    FORCE,
    MOTION,
    OPENING,
    POSITION,
    REFERENCE,
    SEEN,
    SHOWN,
    STATE,
    WORLD,
    Signals,
)
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.physics.compiled.lanes import STATES
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.topology import Topology

_PLANT, _LOOP = ("board", "plant", "sensors"), ("sensors", "law", "valves", "board", "plant")
"""Parts of a control period, in order. A law acts on what is measured when the period begins: the hand's force of that instant
comes in just before."""
_MOST_FORCE = 1e4
"""N, assumed: several times what the cylinders of any such rig push with; more is a mistake of the tool that sets it."""

_OPENINGS = range(WORLD + OPENING, WORLD + SHOWN)
_FILLING = _OPENINGS[::2]
"""Openings of the chambers P, which say all where a cylinder has one 5/3 valve: its chambers N get the opposite."""
_FORCES = range(FORCE, FORCE + 2)
_REFERENCE = range(WORLD + REFERENCE, WORLD + REFERENCE + REFERENCES)
_MEASURED = range(WORLD + POSITION, WORLD + REFERENCE)
_TRUTH = (*range(STATE, STATE + STATES), *range(MOTION, MOTION + 4))
_ENDED = range(WORLD + FAULT, WORLD + SEEN)

_LIMITS = {**dict.fromkeys(_OPENINGS, 1.0), **dict.fromkeys(_FORCES, _MOST_FORCE)}
"""Largest absolute value of what the plant is moved by."""


@dataclass(frozen=True)
class Input:
    """A row that is set from outside: finite and at most ``most``, or, of a ``sample``, anything a sensor may say."""

    row: Row
    most: float = float("inf")
    sample: bool = False


@dataclass(frozen=True)
class Unit:
    """Parts in the order of a control period, names of the rig's parameters that may be set, inputs and outputs."""

    parts: list[Part]
    parameters: list[str]
    inputs: list[Input]
    outputs: list[Row]


def plant_unit(world: World, rig: Parameters) -> Unit:
    """The plant with its sensors, moved by openings and the hand's force."""
    return Unit(
        _parts(world, {}, _PLANT),
        parameter_names(rig),
        _bounded((*_OPENINGS, *_FORCES), rig),
        _rows((*_TRUTH, *_MEASURED), rig),
    )


def loop_unit(world: World, laws: dict[str, Part], rig: Parameters) -> Unit:
    """The closed loop of the plant under ``laws``, parts by name, moved by setpoints and the hand's force."""
    return Unit(
        _parts(world, laws, _LOOP),
        parameter_names(rig),
        _bounded((*_REFERENCE, *_FORCES), rig),
        _rows((*_TRUTH, *_MEASURED, *_OPENINGS), rig),
    )


def controller_unit(world: World, laws: dict[str, Part], rig: Parameters) -> Unit:
    """The controller alone: from signals of sensors as in ``world`` that it reads, and setpoints, to openings.

    Nothing of it is derived from the rig's parameters any more, so that it has none. Cells that a rail lacks, which laws read
    all the same, show what is in its idle cylinder.
    """
    idle = alone_rows(rig)
    cells = {number: float(idle[number]) for number in np.flatnonzero(idle).tolist()}
    clock = Part((clock_stage(rig.electronics.control_period, world.sampled),), cells)
    measured = [Input(row, sample=True) for row in _rows(_read(laws["law"], world.sampled), rig)]
    opened = _FILLING if "valves" in laws else _OPENINGS
    inputs = [*measured, *_bounded(_REFERENCE, rig)]
    return Unit([clock, *laws.values()], [], inputs, _rows((*opened, *_ENDED), rig))


def _read(law: Part, sampled: bool) -> list[int]:
    """Numbers of the measured rows that a law reads, as its first stage knows them; its own clock is none."""
    (first,) = (stage for stage in law.stages if stage.function is guard.let_pass)
    needed = dict(zip(guard.SIGNALS, guard.Limits(first.constants).needed, strict=True))
    left_out = {"time", "reference", *(() if sampled else ("position_time",))}
    groups = [group for name, group in Signals.groups.items() if name not in left_out and needed.get(name, 1.0) > 0.0]
    return [WORLD + group.first + k for group in groups for k in range(group.count)]


def _parts(world: World, laws: dict[str, Part], order: Sequence[str]) -> list[Part]:
    every = {**world.parts, **laws}
    return [every[name] for name in order if name in every]


_BY_NUMBER = {row.number: row for row in LAYOUT}


def _rows(numbers: Iterable[int], rig: Parameters) -> list[Row]:
    """Rows by their numbers, without those of a cylinder that does not move."""
    rows = [_BY_NUMBER[number] for number in numbers]
    return [row for row in rows if _moves(row.name, rig.linkage.topology)]


def _moves(name: str, topology: Topology) -> bool:
    """Whether a row is of no single cylinder, or of one that moves: its number is the only digit of the name."""
    number = re.search(r"\d", name)
    return number is None or int(number[0]) - 1 in topology.cylinders


def _bounded(numbers: Iterable[int], rig: Parameters) -> list[Input]:
    return [Input(row, _LIMITS.get(row.number, float("inf"))) for row in _rows(numbers, rig)]
