"""Programs as files, for those who launch kernels by themselves."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from birthsim_build.bundle import loop_name
from birthsim_build.device.beginning import beginning_with
from birthsim_build.device.loops import SEVERAL, controlled
from birthsim_build.device.program import Pieces, Program, key_of, program_of
from birthsim_build.layout import LAYOUT
from birthsim_env.episodes import Episodes
from birthsim_env.files import write_json
from birthsim_env.loop.rows import WORLD
from birthsim_env.physics.rig.parameters import Parameters


def write_programs(
    loops: Iterable[tuple[str, str, str]], rig: Parameters, folder: Path
) -> tuple[list[str], int, dict[str, int]]:
    """Write ``NAME.bin`` and ``NAME.json`` of loops (scenario, sensors, controller) into ``folder``.

    Returns the functions that the code must contain, the rows of memory that a thread needs, and by the name of each loop the
    bytes of data of a lane. A lane can begin the episode of any seed. ``NAME.bin`` has the words of a
    ``birthsim_build.device.program``, and ``NAME.json`` the rows of its data by name.
    """
    made: dict[str, tuple[Episodes, Pieces, Pieces]] = {}
    for scenario, sensors, controller in loops:
        many, other = (controlled(scenario, sensors, rig, controller, 0, lanes) for lanes in SEVERAL)
        name = loop_name(scenario, sensors, controller)
        made[name] = many, beginning_with(many), beginning_with(other)
    functions = sorted({function for _, pieces, _ in made.values() for function in pieces.functions})
    space, data = 0, {}
    for name, (episodes, pieces, like) in made.items():
        program = program_of(pieces, like, functions)
        program.words.tofile(folder / f"{name}.bin")
        about = {"words_of_data": program.rows, "periods": episodes.simulation.periods}
        write_json(folder / f"{name}.json", {**about, "rows": rows_of(episodes, pieces, program)})
        space, data[name] = max(space, program.threads.space), 8 * program.rows
    return functions, space, data


def rows_of(episodes: Episodes, pieces: Pieces, program: Program) -> dict[str, Any]:
    """Name -> row of the data, for all that is one number per lane: what stages share, reward, ends and info."""
    regions = {key_of(array): region for array, region in zip(pieces.arrays(), program.regions, strict=True)}
    rows: dict[str, int] = {}
    placed = [*pieces.world, *((array, WORLD + row) for array, row in pieces.seen)]
    for array, first in placed:
        region = regions[key_of(array)]
        for row in LAYOUT:
            if region and row.count == 1 and first <= row.number < first + len(array):
                rows[row.name] = region.first + row.number - first
    for array, names in episodes.outcome_rows():
        region = regions[key_of(array)]
        assert region, "an outcome is one of lanes"
        rows |= {name: region.first + k for k, name in enumerate(names)}
    return rows
