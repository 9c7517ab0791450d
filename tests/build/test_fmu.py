"""FMUs: FMPy accepts them, and they compute the bits of the plant and of the closed loop in Python."""

import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from baselines.named import make_controller
from birthsim_build.derived_parameters import derived_parameters, parameter_names
from birthsim_build.fmu import archive
from birthsim_build.fmu.description import exponents
from birthsim_env import Parameters, Plant
from birthsim_env.loop.rows import FORCE, STATE
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATE_NAMES, parameter_column
from birthsim_env.physics.rig.parameters import DECLARED, load_parameters, value_of
from tests.build.fmus import FORCES, OPENINGS, PERIOD, REFERENCE, fmpy
from tests.build.targets import imported
from tests.console import ROOT

validate_fmu = imported("fmpy.validation").validate_fmu

RIG = Parameters()
CIRCLE = "BirthSIM/Circle-v2"
HEADERS = Path(archive.__file__).parent / "fmi_headers"


@pytest.mark.parametrize("options", [(), ("--controller", "backstepping", "--sensors", "lab")], ids=["plant", "loop"])
@pytest.mark.parametrize("version", [2, 3])
def test_the_file_is_valid_and_runs_as_a_user_runs_it(written, options, version):
    path = written(*options, "--fmi", version)
    assert validate_fmu(str(path)) == []
    result = fmpy.simulate_fmu(str(path), stop_time=0.05, step_size=PERIOD, output=["y", "Pp1"])
    assert len(result) == 51
    assert np.isfinite(result["y"]).all()
    assert result["Pp1"][0] > 1e5


@pytest.mark.parametrize("version", [2, 3])
def test_the_plant_computes_the_bits_of_python(written, unit, version):
    rng, plant = np.random.default_rng(version), Plant(RIG)
    one = unit(written("--fmi", version))
    plant.state = one.get(STATE_NAMES)[:, None]
    for _ in range(300):
        openings, force = rng.uniform(-0.3, 0.3, 4), rng.uniform(-20, 20, 2)
        one.set(OPENINGS + FORCES, [*openings, *force])
        one.step()
        plant.advance(openings[:, None], force[:, None], PERIOD)
        assert one.get(STATE_NAMES).tolist() == plant.state[:, 0].tolist()
    assert one.get(["measured_x", "measured_y"]).tolist() == plant.end_effector()[:2, 0].tolist()


FELT = ROOT / "examples" / "acceleration_sensor_rig.toml"
ADAPTIVE = ("admittance-adaptive", "honest")
WEEKLY = ((*ADAPTIVE, None, 600), ("backstepping", "ideal", None, 15_990))


@pytest.mark.parametrize(
    ("controller", "sensors", "file", "periods"),
    [
        ("backstepping", "lab", None, 600),
        pytest.param(*ADAPTIVE, FELT, 600, marks=pytest.mark.slow),
        *(pytest.param(*case, marks=pytest.mark.weekly) for case in WEEKLY),
    ],
)
def test_the_closed_loop_computes_the_bits_of_python(written, unit, controller, sensors, file, periods):
    """Under the target and the hand of the circle, as seen from Python; the last case is all of Fig. 4."""
    described, rig = (("--parameters", file), load_parameters(file)) if file else ((), RIG)
    one = unit(written("--controller", controller, "--sensors", sensors, *described, "--fmi", 2))
    env = gymnasium.make_vec(CIRCLE, num_envs=1, sensors=sensors, parameters=rig, policy_period=PERIOD)
    env.reset(seed=0)
    simulation = env.unwrapped.simulation
    law = make_controller(controller, rig)
    for _ in range(periods):
        reference, seen = simulation.reference, simulation.measurement
        one.set(REFERENCE + FORCES, [*reference.rows[:, 0], *simulation.rows()[0][FORCE : FORCE + 2, 0]])
        one.step()
        env.step(law.command(seen, reference).T)
        assert one.get(["measured_x", "measured_y"]).tolist() == seen.position[:, 0].tolist()
        assert one.get(STATE_NAMES).tolist() == simulation.rows()[0][STATE : STATE + 18, 0].tolist()


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("wine") is None, reason="runs Windows' binary where Wine is installed")
def test_windows_computes_the_bits_of_linux(written, tmp_path):
    path = written("--controller", "backstepping", "--sensors", "lab", "--target", "x86-64", "x86-64-windows")
    about, unpacked = fmpy.read_model_description(path), Path(fmpy.extract(path, tmp_path / "fmu"))
    (linux,), (windows,) = (unpacked / "binaries" / "linux64").iterdir(), (unpacked / "binaries" / "win64").iterdir()
    printed, numbers = [], {one.name: one.valueReference for one in about.modelVariables}
    outputs = [one.valueReference for one in about.modelVariables if one.causality == "output"]
    counts = [f"-DOUTPUTS={len(outputs)}", f"-DFIRST={outputs[0]}", f"-DFORCE={numbers['force_x']}"]
    for target, library, host in (("x86_64-linux-gnu", linux, []), ("x86_64-windows-gnu", windows, ["wine"])):
        folder = library.parent
        compiler = [sys.executable, "-m", "ziglang", "cc", "-target", target]
        line = [*compiler, f"-I{HEADERS}", *counts, Path(__file__).parent / "host.c"]
        subprocess.run([*line, library, f"-Wl,-rpath,{folder}", "-o", folder / "host.exe"], check=True)
        quiet = {**os.environ, "WINEDEBUG": "-all", "WINEPREFIX": str(tmp_path / "wine")}
        done = subprocess.run([*host, folder / "host.exe", about.guid], cwd=folder, env=quiet, capture_output=True, check=True)
        printed.append(done.stdout.split())
    assert len(printed[0]) == 400 * len(outputs)
    assert printed[0] == printed[1]


def test_parameters_act_as_in_python(written, unit):
    given = {"mechanics.mass": 2.2, "cylinder1.coulomb_friction": 20.0, "valves.time_constant": 6e-3, "air.temperature": 300.0}
    one = unit(written("--fmi", 2), **{f"rig.{name}": value for name, value in given.items()})
    plant = Plant(RIG.replace(given))
    plant.state = one.get(STATE_NAMES)[:, None]
    for _ in range(50):
        one.step()
        plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), PERIOD)
    assert one.get(STATE_NAMES).tolist() == plant.state[:, 0].tolist()
    assert one.get(["vy"])[0] != 0.0


def test_the_c_code_derives_parameters_as_python_does(tmp_path):
    names = parameter_names(Parameters())
    rng = np.random.default_rng(0)
    rows = "\n".join(f"r[{k}] = {term};" for k, term in enumerate(derived_parameters(RIG)))
    (tmp_path / "derive.c").write_text(f"""#include <math.h>\n#include <stdio.h>
int main(void) {{ double p[{len(names)}], r[{PARAMETERS}]; for (int k = 0; k < {len(names)}; k++) scanf("%la", p + k);
{rows}
for (int k = 0; k < {PARAMETERS}; k++) printf("%a\\n", r[k]); return 0; }}""")
    subprocess.run(["gcc", "-O1", "-o", tmp_path / "derive", tmp_path / "derive.c", "-lm"], check=True)
    for _ in range(5):
        free = [name for name in names if "diameter" not in name and "ratio" not in name]
        rig = RIG.replace({name: value_of(RIG, name) * rng.uniform(0.98, 1.02) for name in free})
        given = "\n".join(value_of(rig, name).hex() for name in names)
        done = subprocess.run([tmp_path / "derive"], input=given, capture_output=True, text=True, check=True)
        assert [float.fromhex(line) for line in done.stdout.split()] == parameter_column(rig).tolist()


def test_steps_of_any_length_run_the_control_periods_that_are_complete(written, unit):
    path = written("--fmi", 3)
    whole, odd = unit(path), unit(path)
    for one in (whole, odd):
        one.set(OPENINGS, [0.1, -0.1, 0.05, -0.05])
    for _ in range(30):
        whole.step()
    time = 0.0
    for step in (0.0004, 0.0006, 0.0105, 0.0005, 0.018):
        odd.unit.doStep(currentCommunicationPoint=time, communicationStepSize=step)
        time += step
    assert odd.get(STATE_NAMES).tolist() == whole.get(STATE_NAMES).tolist()
    assert odd.get(["time"])[0] == pytest.approx(0.03, rel=1e-12)


@pytest.mark.parametrize("version", [2, 3])
def test_a_state_comes_back(written, unit, version):
    one = unit(written("--controller", "backstepping", "--sensors", "lab", "--fmi", version))
    one.step(20)
    get, put = (one.unit.getFMUstate, one.unit.setFMUstate) if one.two else (one.unit.getFMUState, one.unit.setFMUState)
    before = get()
    one.step(30)
    after = one.get(STATE_NAMES)
    put(before)
    one.ticks = 20
    one.step(30)
    assert one.get(STATE_NAMES).tolist() == after.tolist()


@pytest.mark.parametrize("version", [2, 3])
def test_bytes_of_a_state_come_back_and_damaged_ones_are_refused(written, unit, version):
    """Flipped words of the loop's description would be jumped to and indexed; a flipped one of its memory is a number."""
    one = unit(written("--controller", "backstepping", "--sensors", "lab", "--fmi", version))
    names = ("serializeFMUstate", "deSerializeFMUstate", "setFMUstate", "getFMUstate")
    write, read, put, get = (
        getattr(one.unit, name if one.two else name.replace("FMUs", "FMUS").replace("deS", "des")) for name in names
    )
    one.step(20)
    content = bytes(write(get()))
    one.step(30)
    after = one.get(STATE_NAMES)

    def run(content):
        put(read(content))
        one.ticks = 20
        one.step(30)
        return one.get(STATE_NAMES)

    assert run(content).tolist() == after.tolist()
    before, refused = get(), 0
    for place in range(0, len(content) // 8, 7):
        words = np.frombuffer(content, dtype=np.int64).copy()
        words[place] = 10**9
        try:
            read(words.tobytes())
        except fmpy.fmi1.FMICallException:
            refused += 1
            continue
        put(read(words.tobytes()))
        one.ticks = 20
        with suppress(fmpy.fmi1.FMICallException):
            one.step(3)
        put(before)
    assert refused > 20
    for wrong in (content[:-8], content + bytes(8), b""):
        with pytest.raises(fmpy.fmi1.FMICallException):
            read(wrong)


WRONG = [
    *(("opening_P1", 1.5), ("force_x", np.inf), ("force_x", 1e308), ("force_y", -10_001.0), ("force_y", np.nan)),
    *(("rig.mechanics.mass", 4.0), ("x", 0.0), ("time", 1.0)),
]


@pytest.mark.parametrize(("name", "value"), WRONG)
def test_what_must_not_be_set_in_a_simulation_is_refused_and_changes_nothing(written, unit, name, value):
    """Neither what is wrong nor what is set together with it."""
    one, names = unit(written("--fmi", 2)), ["opening_N2", name]
    one.step()
    before = one.get(names).tolist()
    with pytest.raises(fmpy.fmi1.FMICallException, match="fmi2SetReal"):
        one.set(names, [0.1, value])
    assert one.get(names).tolist() == before


@pytest.mark.parametrize("version", [2, 3])
def test_inputs_say_their_limits_and_are_accepted_at_them(written, unit, version):
    path = written("--fmi", version)
    said = {one.name: (one.min, one.max) for one in fmpy.read_model_description(path).modelVariables}
    assert {tuple(map(float, said[name])) for name in FORCES} == {(-1e4, 1e4)}
    assert said["measured_x"] == (None, None)
    one = unit(path)
    one.set(FORCES, [-1e4, 1e4])
    one.step()
    assert one.get(FORCES).tolist() == [-1e4, 1e4]
    assert np.isfinite(one.get(STATE_NAMES)).all()


def test_setpoints_that_the_law_cannot_serve_are_refused_and_a_saved_state_goes_on(written, unit):
    one = unit(written("--controller", "backstepping", "--sensors", "lab", "--fmi", 2))
    one.step(5)
    before, states = one.unit.getFMUstate(), one.get(STATE_NAMES)
    one.set(["reference_Kclx"], [-500.0])
    for _ in range(2):
        with pytest.raises(fmpy.fmi1.FMICallException, match="fmi2DoStep"):
            one.step()
    one.unit.setFMUstate(before)
    assert one.get(STATE_NAMES).tolist() == states.tolist()
    one.step()
    assert one.get(["reference_Kclx"])[0] > 0


@pytest.mark.parametrize("version", [2, 3])
def test_calls_out_of_turn_and_impossible_parameters_are_refused(written, unit, version):
    one = unit(written("--fmi", version))
    for call_of in (one.unit.enterInitializationMode, one.unit.exitInitializationMode):
        with pytest.raises(fmpy.fmi1.FMICallException, match="InitializationMode"):
            call_of()
    with pytest.raises(fmpy.fmi1.FMICallException, match="DoStep"):
        one.unit.doStep(currentCommunicationPoint=5.0, communicationStepSize=PERIOD)
    with pytest.raises(fmpy.fmi1.FMICallException, match=r"fmi\dSet(Real|Float64)"):
        unit(written("--fmi", version), **{"rig.mechanics.mass": -1.0})


def test_units_are_those_of_the_rig():
    assert exponents("W/(m2 K)") == {"kg": 1, "s": -3, "K": -1}
    assert exponents("m3/(s Pa)") == {"m": 4, "s": 1, "kg": -1}
    assert exponents("N s/m") == {"kg": 1, "s": -1}
    assert exponents("1") == exponents("-") == {}
    for one in DECLARED.values():
        exponents(one.unit)
    with pytest.raises(ValueError, match="unit = 'furlong'; allowed: "):
        exponents("furlong")
