"""Controllers alone as FMUs: the openings of Python, also where samples are missing, and the loop with a plant's FMU."""

import numpy as np
import pytest

from baselines.named import compiled_names, make_controller
from birthsim_build.fmu.units import controller_unit, loop_unit, plant_unit
from birthsim_build.loops import PAIRED_VALVES, law_part, scenario_world
from birthsim_env import Parameters, Reference
from birthsim_env.ids import rig_for
from birthsim_env.loop.rows import ASKED, FORCE, OPENING, POSITION, REFERENCE, STATE, WORLD, measurement_of
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import STATE_NAMES
from birthsim_env.physics.rig.parameters import load_parameters
from lab.studies.targets.reference import PERIODS, whole_rows
from lab.studies.targets.running import ROW
from tests.build import fmus
from tests.build.fmus import FORCES, OPENINGS, PERIOD, fmpy
from tests.build.targets import assert_same_bits, imported
from tests.console import ROOT

validate_fmu = imported("fmpy.validation").validate_fmu

FINDING = ("admittance-adaptive[finds_rig=true]", "admittance-adaptive[reader=wide]")
BACKSTEPPING = ("--controller", "backstepping")
ADAPTIVE = ("--controller", "admittance-adaptive", "--fmi", 3)
POSITIONS, VELOCITIES = ["measured_x", "measured_y"], ["measured_vx", "measured_vy"]
PRESSURES, FELT = ["measured_Pp1", "measured_Pn1", "measured_Pp2", "measured_Pn2"], ["measured_force_x", "measured_force_y"]
SENSED = POSITIONS + VELOCITIES + PRESSURES
SAMPLED = [*POSITIONS, *VELOCITIES, "position_time", *PRESSURES]
ENDED = ["missed", "fault"]


def alone(written, *options):
    return written("--alone", *options)


def answers(one, rows, periods):
    """Outputs of a unit (periods, its outputs) that is told what the world's ``rows`` before each period say."""
    said = np.empty((periods, len(one.outputs)))
    given = rows[:, [ROW[name] for name in one.inputs]]
    for k in range(periods):
        one.set(one.inputs, given[k])
        one.step()
        said[k] = one.get(one.outputs)
    return said


@pytest.mark.parametrize("options", [BACKSTEPPING, ADAPTIVE])
def test_the_file_is_valid_and_has_no_parameters(written, unit, options):
    path = alone(written, *options)
    assert validate_fmu(str(path)) == []
    one = unit(path)
    assert one.parameters == []
    assert one.inputs == [*SENSED, *(FELT if options == ADAPTIVE else []), *fmus.REFERENCE]
    assert one.outputs == [*OPENINGS, *ENDED]
    result = fmpy.simulate_fmu(str(path), stop_time=0.05, step_size=PERIOD, output=["opening_P1", "fault"])
    assert 0.0 < np.abs(result["opening_P1"]).max() <= 1.0
    assert (result["fault"] == 0.0).all()


def commanded(law, rows, sampled, rig=None):
    """Openings of Python's controller, its count and its fault, (periods, 6), told the same."""
    controller, found = make_controller(law, rig or Parameters()), np.empty((len(rows) - 1, 6))
    for own, seen in zip(found, rows[:, WORLD : WORLD + ASKED, None], strict=False):
        openings = controller.command(measurement_of(seen, sampled, False), Reference(seen[REFERENCE:].copy()))
        own[:] = *openings[:, 0], controller.missed[0], 2.0 * controller.ended[0]
    return found


@pytest.mark.parametrize(
    ("sensors", "law", "options"),
    [
        ("ideal", "backstepping", BACKSTEPPING),
        ("ideal", "admittance-adaptive", ADAPTIVE),
        ("lab", "residual:circle", ("--policy", "circle", "--sensors", "lab")),
        *(("lab", law, ("--controller", law, "--sensors", "lab")) for law in FINDING),
    ],
)
def test_the_openings_are_those_of_python(written, unit, sensors, law, options):
    """Over what they measure in Python's closed loop."""
    one, rows = unit(alone(written, *options)), whole_rows("circle", sensors, law, PERIODS)
    expected = commanded(law, rows, sensors == "lab")
    assert np.ptp(expected[:, :4], axis=0).min() > 0.1
    assert (expected[:, 4:] == 0.0).all()
    assert_same_bits(answers(one, rows, PERIODS), expected)


@pytest.mark.parametrize("law", ["abry", "abry-one-valve"])
def test_a_rail_has_two_openings_and_with_a_5_3_valve_one(written, unit, law):
    environment, rig, told = (
        environment_id("rail-steps"),
        rig_for(environment_id("rail-steps"), None),
        ("--sensors", "encoders"),
    )
    valves = ("--valves", "one_valve") if law == "abry-one-valve" else ()
    one = unit(alone(written, "--controller", law, "--env", environment, *told, *valves))
    assert one.outputs == [*(["opening_P2"] if valves else OPENINGS[2:]), *ENDED]
    rows = whole_rows("rail-steps", "encoders", law, PERIODS, rig=rig, parameters=rig)
    expected = commanded(law, rows, True, rig)
    assert np.ptp(expected[:, 2:4], axis=0).min() > 0.1
    assert_same_bits(answers(one, rows, PERIODS), expected[:, [2, 4, 5] if valves else [2, 3, 4, 5]])


def test_missing_samples_are_replaced_and_an_outage_ends_the_control(written, unit):
    """Single samples that are not finite, or none, and 0.1 s without a position: openings, count and fault of Python."""
    one, periods = unit(alone(written, *ADAPTIVE)), 600
    rows = whole_rows("circle", "ideal", "admittance-adaptive", periods)
    rng = np.random.default_rng(0)
    for period in rng.choice(np.arange(periods - 100), 100, replace=False):
        rows[period, [ROW[name] for name in rng.choice(SENSED + FELT, 2)]] = rng.choice([np.nan, np.inf, -np.inf, 1e300])
    rows[periods - 100 : periods, WORLD + POSITION] = np.nan
    expected = commanded("admittance-adaptive", rows, False)
    assert_same_bits(answers(one, rows, periods), expected)
    *openings, missed, fault = expected[-1]
    assert (openings, fault) == ([0.0] * 4, 2.0)
    assert missed > 150


def test_valves_stay_shut_until_every_signal_was_good_once(written, unit):
    one = unit(alone(written, *BACKSTEPPING))
    one.set(["measured_Pp2"], [np.nan])
    one.step()
    assert one.get(one.outputs).tolist() == [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]
    one.set(["measured_Pp2"], [4e5])
    one.step()
    assert one.get(["fault"])[0] == 0.0
    assert np.abs(one.get(OPENINGS)).max() > 0.0


def test_setpoints_that_are_not_finite_are_refused(written, unit):
    one = unit(alone(written, *BACKSTEPPING))
    for name in fmus.REFERENCE:
        with pytest.raises(fmpy.fmi1.FMICallException, match="fmi2SetReal"):
            one.set([name], [np.nan])


def test_a_state_with_a_missing_sample_comes_back(written, unit):
    one = unit(alone(written, *BACKSTEPPING))
    one.step(5)
    one.set(["measured_y"], [np.nan])
    one.step()
    content = bytes(one.unit.serializeFMUstate(one.unit.getFMUstate()))
    one.step(3)
    after = one.get(one.outputs)
    one.unit.setFMUstate(one.unit.deSerializeFMUstate(content))
    one.ticks = 6
    one.step(3)
    assert_same_bits(one.get(one.outputs)[None], after[None])


@pytest.mark.parametrize(
    ("sensors", "options", "periods"),
    [
        ("ideal", BACKSTEPPING, 15_990),
        ("ideal", ADAPTIVE, PERIODS),
        pytest.param("lab", BACKSTEPPING, PERIODS, marks=pytest.mark.slow),
    ],
)
def test_with_the_plants_unit_it_is_the_closed_loop_of_python(written, unit, sensors, options, periods):
    """The controller steps first, then the plant. A force sensor is of the instant: the hand's force goes to both."""
    told = () if sensors == "ideal" else ("--sensors", sensors)
    plant, law = unit(written(*told, "--fmi", 2)), unit(alone(written, *options, *told))
    measured = [name for name in law.inputs if name in plant.outputs and name not in FELT]
    assert measured == (SENSED if sensors == "ideal" else SAMPLED)
    felt = [name for name in law.inputs if name in FELT]
    rows = whole_rows("circle", sensors, options[1], periods)
    asked = rows[:, [ROW[name] for name in fmus.REFERENCE]]
    states, openings = np.empty((periods, len(STATE_NAMES))), np.empty((periods, 4))
    for k in range(periods):
        force = rows[k, FORCE : FORCE + 2]
        law.set([*measured, *felt, *fmus.REFERENCE], [*plant.get(measured), *(force if felt else ()), *asked[k]])
        law.step()
        openings[k] = law.get(OPENINGS)
        plant.set(OPENINGS + FORCES, [*openings[k], *force])
        plant.step()
        states[k] = plant.get(STATE_NAMES)
    assert_same_bits(openings, rows[1:, WORLD + OPENING : WORLD + OPENING + 4])
    assert_same_bits(states, rows[1:, STATE : STATE + len(STATE_NAMES)])


def interface(scenario, sensors, law, file=None, one_valve=False):
    """Names of the inputs before the reference, and of the outputs, of a unit that is not compiled."""
    environment = environment_id(scenario)
    rig = rig_for(environment, None if file is None else load_parameters(ROOT / "examples" / file))
    world = scenario_world(environment, sensors, rig)
    laws = {"law": law_part(law, rig, world.sampled), **({"valves": PAIRED_VALVES} if one_valve else {})}
    made = controller_unit(world, laws, rig)
    inputs = [one.row.name for one in made.inputs]
    assert {one.row.name for one in made.inputs if one.sample} == {*inputs} - {*fmus.REFERENCE}
    asked = [name for name in inputs if name in fmus.REFERENCE]
    assert asked == [name for name in fmus.REFERENCE if "1" not in name or scenario == "circle"]
    return [name for name in inputs if name not in asked], [row.name for row in made.outputs]


def test_inputs_are_what_the_controller_reads():
    assert interface("circle", "lab", "backstepping") == (SAMPLED, [*OPENINGS, *ENDED])
    felt = [*SAMPLED[:5], "measured_ax", "measured_ay", *PRESSURES, *FELT]
    assert interface("circle", "honest", "admittance-adaptive", "acceleration_sensor_rig.toml")[0] == felt


def test_a_rail_has_nothing_of_cylinder_1_and_a_5_3_valve_one_opening():
    inputs = [*POSITIONS, *VELOCITIES, *PRESSURES[2:]]
    assert interface("rail", "ideal", "abry") == (inputs, [*OPENINGS[2:], *ENDED])
    assert interface("rail", "ideal", "abry-one-valve", one_valve=True) == (inputs, ["opening_P2", *ENDED])
    assert interface("circle", "ideal", "backstepping", one_valve=True)[1] == ["opening_P1", "opening_P2", *ENDED]


def test_units_of_a_rail_fit_together():
    """The plant's and the closed loop's have nothing of cylinder 1 either."""
    environment = environment_id("rail")
    rig = rig_for(environment, None)
    world = scenario_world(environment, "ideal", rig)
    plant, loop = plant_unit(world, rig), loop_unit(world, {"law": law_part("abry", rig, False)}, rig)
    assert [one.row.name for one in plant.inputs] == [*OPENINGS[2:], *FORCES]
    assert [one.row.name for one in loop.inputs] == [*(name for name in fmus.REFERENCE if "1" not in name), *FORCES]
    shown = [name for name in STATE_NAMES if "1" not in name] + ["x", "y", "vx", "vy", *POSITIONS, *VELOCITIES]
    shown += ["position_time", "measured_ax", "measured_ay", *PRESSURES[2:], *FELT]
    assert [row.name for row in plant.outputs] == shown
    assert [row.name for row in loop.outputs] == [*shown, *OPENINGS[2:]]


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_no_controller_heeds_a_signal_that_is_no_input(sensors):
    """Lane 1 is told other numbers there than lane 0."""
    rows = whole_rows("circle", sensors, "backstepping", 300)[:, WORLD : WORLD + ASKED]
    names = [name for name, number in ROW.items() if WORLD + POSITION <= number < WORLD + REFERENCE]
    for law in [*compiled_names(listed=True), "limited:pid", "residual:circle", "residual:circle_honest_student"]:
        inputs = interface("circle", sensors, law)[0]
        unread = [ROW[name] - WORLD for name in names if name not in [*inputs, "position_time"]]
        controller = make_controller(law, Parameters())
        for seen in rows:
            two = np.repeat(seen[:, None], 2, axis=1)
            two[unread, 1] = 3.0
            openings = controller.command(measurement_of(two, sensors == "lab", False), Reference(two[REFERENCE:].copy()))
            assert (openings[:, 0] == openings[:, 1]).all(), law
