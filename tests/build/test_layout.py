"""The rows that header and JavaScript name are those of the loops."""

from birthsim_build.layout import LAYOUT, ROWS, Inputs
from birthsim_env.loop import rows as at
from birthsim_env.loop.rows import SEEN, WORLD
from birthsim_env.loop.signals import REFERENCE_NAMES
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, STATE_NAMES

NUMBER = {row.name: row.number for row in LAYOUT}


def test_rows_are_those_of_the_loop():
    world = {"impact1": at.IMPACT, "x": at.MOTION, "force_x": at.FORCE, "since_jump": at.SINCE_JUMP, "tick": at.TICK}
    seen = {
        "time": at.TIME, "measured_x": at.POSITION, "measured_vx": at.VELOCITY, "position_time": at.POSITION_TIME,
        "measured_ax": at.ACCELERATION,
        "measured_Pp1": at.PRESSURE, "measured_force_x": at.USER_FORCE, "reference_x": at.REFERENCE, "asked_x": at.ASKED,
        "feedforward_force1": at.FEEDFORWARD, "damping_factor": at.DAMPING, "action": at.ACTION, "opening_P1": at.OPENING,
        "shown": at.SHOWN, "handed": at.HANDED,
    }  # fmt: skip
    for name, number in {**world, **{name: WORLD + row for name, row in seen.items()}}.items():
        assert NUMBER[name] == number, name
    assert [NUMBER[f"rig_{name}"] for name in PARAMETER_NAMES] == list(range(len(PARAMETER_NAMES)))
    assert [NUMBER[name] for name in STATE_NAMES] == [at.STATE + row for row in range(len(STATE_NAMES))]
    assert [NUMBER[f"add_{name}"] for name in REFERENCE_NAMES] == list(range(ROWS - len(REFERENCE_NAMES), ROWS))


def test_rows_fill_the_layout_without_gaps():
    assert sum(row.count for row in LAYOUT) == ROWS == WORLD + SEEN + Inputs.size
    assert [row.number for row in LAYOUT[1:]] == [row.number + row.count for row in LAYOUT[:-1]]


def test_names_differ_in_upper_case_too():
    assert len({row.name.upper() for row in LAYOUT}) == len(LAYOUT)
