"""The rows that header and JavaScript name are those of the loops."""

from birthsim_build.layout import LAYOUT, ROWS, Inputs
from birthsim_env.loop.rows import SEEN, WORLD, Seen, World
from birthsim_env.loop.signals import REFERENCE_NAMES
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, STATE_NAMES

NUMBER = {row.name: row.number for row in LAYOUT}


def test_rows_are_those_of_the_loop():
    world = {"impact1": "impact", "x": "motion", "force_x": "force", "since_jump": "since_jump", "tick": "tick"}
    seen = {
        "time": "time", "measured_x": "position", "measured_vx": "velocity", "position_time": "position_time",
        "measured_ax": "acceleration", "measured_Pp1": "pressure", "measured_force_x": "user_force", "reference_x": "reference",
        "asked_x": "asked", "feedforward_force1": "feedforward", "damping_factor": "damping_factor", "action": "action",
        "opening_P1": "opening", "shown": "shown", "intermediate": "intermediate",
    }  # fmt: skip
    for begins, layout, names in ((0, World, world), (WORLD, Seen, seen)):
        for name, group in names.items():
            assert NUMBER[name] == begins + layout.groups[group].first, name
    assert [NUMBER[f"rig_{name}"] for name in PARAMETER_NAMES] == list(range(len(PARAMETER_NAMES)))
    assert [NUMBER[name] for name in STATE_NAMES] == [World.state.first + row for row in range(len(STATE_NAMES))]
    assert [NUMBER[f"add_{name}"] for name in REFERENCE_NAMES] == list(range(ROWS - len(REFERENCE_NAMES), ROWS))


def test_rows_fill_the_layout_without_gaps():
    assert sum(row.count for row in LAYOUT) == ROWS == WORLD + SEEN + Inputs.size
    assert [row.number for row in LAYOUT[1:]] == [row.number + row.count for row in LAYOUT[:-1]]


def test_names_differ_in_upper_case_too():
    assert len({row.name.upper() for row in LAYOUT}) == len(LAYOUT)
