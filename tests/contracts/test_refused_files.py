"""Files of a user's own that are refused: one line that names what is wrong and what is allowed."""

from pathlib import Path

import gymnasium
import pytest

from agents.training.configuration import load_configuration
from baselines.identification.experiment import NAMES, read_plan
from baselines.logs.table import read_table
from baselines.named import make_controller
from birthsim_env import Parameters
from birthsim_env.parts.own_parts import stiffness_of
from birthsim_live.logs.reading import read_log
from lab.studies.sweeps.plan import load_sweep
from lab.studies.sweeps.work import tasks_of

CIRCLE = "BirthSIM/Circle-v2"
RIG = Parameters()


def drawn(path):
    return gymnasium.make(CIRCLE, parameters=path, randomize="plant").reset(seed=0)


READERS = {
    "rig": lambda path: gymnasium.make(CIRCLE, parameters=path),
    "drawn rig": drawn,
    "reference": lambda path: gymnasium.make(CIRCLE, reference=path),
    "user_force": lambda path: gymnasium.make(CIRCLE, user_force=path),
    "stiffness": stiffness_of,
    "controller": lambda path: make_controller(path, RIG),
    "training": load_configuration,
    "plan": lambda path: read_plan(path, RIG),
    "sweep": lambda path: tasks_of((sweep := load_sweep(path)).points[0], sweep),
    "log": read_table,
    "recorded": lambda path: read_log(Path(path)),
}

PYTHON = """
import birthsim_env

def along(t):
    return 0.5 + 0.01 * t, 0.0

def wild(t):
    return 1 / 0

class Needs(birthsim_env.UserForce):
    def __init__(self, size):
        pass

class Wordless:
    def __init__(self, parameters):
        pass

class Bare:
    pass

number = 3
"""
HEAD, BINARY = ",".join(NAMES) + "\n", b"\xff\xfe\x00"
A_CLASS = "allowed: an object with command(measurement, reference) and reset(), a function law(measurement, reference)"
CSV = "increasing times"


def rows(text):
    return HEAD + "".join(text.format(k, k % 4, 0.1 * k) for k in range(9))


TABLE = {
    # reader, file: (content or None for no file, what follows the file's name, words of the message)
    ("rig", "our_rig.toml"): [
        (None, "", "cannot be read", "No such file"),
        (BINARY, "", "our_rig.toml"),
        ("[mechanics]\nmass 3.0\n", "", "our_rig.toml", "line 2"),
        ("[mechanics]\nmas = 3.0\n", "", "our_rig.toml", "mechanics.mas", "allowed in mechanics", "mass", "gravity"),
        ("[motor]\nmass = 3.0\n", "", "our_rig.toml", "'motor'", "allowed", "mechanics"),
        ("[mechanics]\nmass = -3.0\n", "", "our_rig.toml", "Mechanics.mass = -3.0", "allowed", "> 0 and <= 1e+20 (kg)"),
        ("[cylinder1]\nrod_diameter = 0.03\n", "", "our_rig.toml", "rod_diameter = 0.03", "less than piston_diameter = 0.025"),
        ("mass = 3\n", "", "our_rig.toml", "mass = 3", "allowed", "a section"),
        ("[mechanics]\nmass = '3'\n", "", "our_rig.toml", "Mechanics.mass = '3' is impossible"),
        ("mechanics = 3\n", "", "our_rig.toml", "mechanics = 3", "allowed", "section"),
    ],
    ("rig", ""): [(None, "", "parameters = '", "cannot be read", "directory")],
    ("drawn rig", "rig.toml"): [
        ('[randomize]\n"mechanics.mass" = 3\n', "", "[randomize] mechanics.mass = 3; allowed: "),
        ('[randomize]\n"mechanics.weight" = [1, 2]\n', "", "unknown parameter 'mechanics.weight'"),
        ('[randomize]\n"mechanics.mass" = [3, 2]\n', "", "randomize['mechanics.mass'] = ", "ordered"),
        ('[randomize]\n"cylinder1.stroke" = [0.2, 0.3]\n', "", "randomize['cylinder1.stroke']: allowed"),
    ],
    ("reference", "own.csv"): [
        (None, "", "reference = '", "own.csv' cannot be read: ", "; allowed: a file"),
        ("time,x,y\n0,0.5,0\n0,0.5,0\n", "", "own.csv', line 3: time 0 after 0; allowed: rows of time (s), x (m), y (m)", CSV),
        ("u,x,y\n0,0.5,0\n", "", "own.csv' lacks time; there are: u, x, y; allowed: "),
        ("0,0.5,0\n", "", "own.csv' has 1 rows of numbers; allowed: ", "at least 2"),
    ],
    ("reference", "plain"): [(None, "", "reference = '", "plain'; allowed: a birthsim_env.Trajectory")],
    ("reference", "own.py"): [
        (PYTHON, ":missing", "has no 'missing'; allowed: a name that it defines: birthsim_env, along, "),
        (PYTHON, ":wild", "reference: function(0) fails (ZeroDivisionError: ", "); allowed: a function of"),
        (PYTHON, ":number", "reference = 3; allowed: None, a birthsim_env.Trajectory, a function of time"),
        ("def\n", ":x", "reference file '", "own.py': SyntaxError: ", " line 1"),
    ],
    ("user_force", "own.py"): [
        (PYTHON, ":Needs", "user_force: Needs() fails (TypeError: ", "'size'); allowed: a birthsim_env.UserForce"),
        (PYTHON, ":number", "user_force = 3; allowed: None, a birthsim_env.UserForce, 'steps', 'sine'"),
    ],
    ("user_force", "push.csv"): [
        (text, names, "user_force = ", said, "allowed: ")
        for text, names, said in (
            ("time_mm,Fx,Fy\n0,1,2\n1,1,2\n", "", "lacks time"),
            ("time (years),Fx,Fy\n0,1,2\n1,1,2\n", "", "'time' in years"),
            ("time,Fx [kg],Fy\n0,1,2\n1,1,2\n", "", "'Fx' in kg"),
            ("time,Fx,Fx,Fy\n0,1,2,3\n1,1,2,3\n", "", "'Fx': is there more than once"),
            ("t,a,b\n0,1,2\n1,1,2\n", ":t,a", "a COLUMN for each of"),
            ("t,a,b\n0,1,2\n1,1,2\n", ":t,a,d", "no column 'd'"),
            ("0,1,2\n1,1,2\n", ":t,a,b", "t, a, b"),
            ("time,Fx,Fy\n0,1,2\n1,1\n", "", "line 3"),
            ("Fx,time,Fy\n0,1,2\n1,0.5,2\n", "", "line 3"),
        )
    ],
    ("user_force", "soft"): [(None, "", "soft'; allowed: a birthsim_env.UserForce, 'steps', 'sine', 'noise', 'guided'")],
    ("stiffness", "own.csv"): [
        (text, "", "stiffness") for text in ("0,0.5,0\n1,0.5,0\n", "0,0.5,0,2000\n1,0.5,0\n", "0,0.5,0,-1\n1,0.5,0,2000\n")
    ],
    ("controller", "own.py"): [
        (PYTHON, "", "controller = '", "own.py'; allowed: ", "path/to/file.py:Class"),
        (None, ":Own", "own.py' does not exist; allowed: path/to/file.py:Name"),
        (PYTHON, ":Missing", "own.py' has no 'Missing'; allowed: a name that it defines: "),
        (PYTHON, ":", "own.py' has no ''; allowed: a name"),
        (PYTHON, ":number", "own.py:number' is 3", "; allowed: an object with command(measurement, reference) and reset()"),
        (PYTHON, ":Wordless", "own.py:Wordless' is made without command() or reset()", A_CLASS),
        (PYTHON, ":Bare", "own.py:Bare' is made without command() or reset()", A_CLASS),
        ("import numpy\nimport no_such_module\n", ":Own", "own.py', line 2: ModuleNotFoundError: No module named 'no_such"),
    ],
    ("training", "own.toml"): [
        (None, "", "own.toml", "is no file; allowed: circle, ", "vacuum", ", or a TOML file"),
        (BINARY, "", "own.toml", "is in UTF-16; allowed: text in UTF-8"),
        ("[training]\nsteps = 3".encode("utf-16-le"), "", "is in UTF-16 without a byte-order mark; allowed: text in UTF-8"),
        ("# \xb0\n".encode("cp1252"), "", "is in Windows-1252; allowed: text in UTF-8"),
        ("[experiment]\nsteps = 3", "", "own.toml", "table 'experiment'; allowed: training, residual"),
        ("training = 3", "", "own.toml", "training = 3"),
        ("[[training]]\nsteps = 3", "", "own.toml", "training = "),
        ("[training]\nlaw = 'none'", "", "own.toml", "law = 'none' is unknown; allowed: environment, "),
        ("[training]\nhidden = [64, 0]", "", "own.toml", "hidden = (64, 0); allowed: 1 to 8 whole numbers from 1 to 2048"),
        ("[residual]\nauthority = 501", "", "own.toml", "authority = 501; allowed: more than 0, at most 500"),
        ("[training]\nsteps = 3\nsteps = 4", "", "own.toml", "is no TOML: "),
    ],
    ("training", ""): [(None, "", "is no file; allowed: circle, ")],
    ("plan", "plan.csv"): [
        ("time,x,y\n0,0.5,0\n", "", "lacks added_P1, added_N1, added_P2, added_N2; there are: time, x, y"),
        ("", "", "is empty"),
        (f"{HEAD}0,0.5,zero,0,0,0,0\n", "", "'y': line 2: 'zero' is no number; allowed: numbers"),
        (rows("{1},0.5,0,0,0,0,0\n"), "", "line 6: time 0 after 3; allowed: ", CSV),
        ("".join(rows("{0},0.5,0,0,0,0,0\n").splitlines(True)[:8]), "", "has 7 rows; allowed: at least 8"),
        (rows("{0},0.5,0,2,0,0,0\n"), "", "an added opening of 2; allowed: -1 to 1"),
        (rows("{0},1.5,0,0,0,0,0\n"), "", "position = (1.5, 0) m is unreachable"),
        (rows("{2:g},0.5,0,0,0,0,0\n"), "", "lasts 0.8 s; allowed: 4 to 600 s"),
    ],
    ("sweep", "sweep.toml"): [
        (text, "", "sweep.toml", *said, "allowed")
        for text, *said in (
            ("[gird]\nsensors = ['lab']", "'gird'", "[base], [grid], [draw], [search] and [[map]]"),
            ("[base]\ncolour = 'red'", "'colour'", "environment, controller, "),
            ("[grid]\nsensors = 'lab'", "[grid] sensors = 'lab'", "a list of values, or "),
            ("[grid]\n'gain.bandwidth' = {from = 3, to = 2, count = 2}", "from below to"),
            ("[grid]\n'gain.bandwidth' = {from = 1, to = 2}", "count = None", "a whole number from 2"),
            ("[grid]\n'gain.bandwidth' = {from = 1, to = 2, count = 2, step = 1}", "{ from, to, count, log }"),
            ("[grid]\n'gain.bandwidth' = {from = 1, to = 2, count = 4000000000}", "count"),
            ("[draw]\nsensors = ['lab']", "[draw] count = None", "a whole number from 1"),
            ("[draw]\ncount = 2000000\nsensors = ['lab']", "makes 2000000 points", "at most 1000000"),
            ("[base]\nepisodes = 0", "[base] episodes = 0", "a whole number from 1"),
            ("[search]\ntrials = 3", "[search] has no ranges", "names with"),
            ("[search]\n'gain.bandwidth' = [1, 2]", "[search] gain.bandwidth = [1, 2]", "{ from, to, log }"),
            ("[grid]\nsensors = ['lab']\n[[map]]\nx = 'sensors'", "[[map]]", "x, y and perhaps"),
            ("[[map]]\nx = 'sensors'\ny = 'policy'", "x = 'sensors'", "what varies"),
            ("[base]\npolicy = ''", "policy", "a word"),
            ("[grid]\ncontroller = [1, 'pid']", "controller = 1", "a word"),
            ("[draw]\ncount = 1\nenvironment = [2000-01-01]", "environment", "a word"),
            ("[base]\nsensors = 'perfect'", "sensors", "'lab'"),
            ("[grid]\nrandomize = ['no']", "randomize", "True"),
            ("[grid]\nsensors = {from = 1, to = 2, count = 2}", "sensors", "a list of values"),
            ("[search]\nreference = {from = 1, to = 2}", "reference", "from, to, log"),
            ("[grid]\n'gain.bandwidth' = [[1]]", "gain.bandwidth", "a number"),
            ("[grid]\n'gain.bandwidth' = {from = 1, to = 2, count = 2, log = 'no'}", "gain.bandwidth log", "true, false"),
            ("[search]\ntrials = 2000000\n'gain.bandwidth' = {from = 1, to = 2}", "trials", "1000000"),
            ("[search]\nmetric = 'best'\n'gain.bandwidth' = {from = 1, to = 2}", "metric", "settled_rms"),
            ("[[map]]\nx = ['a']\ny = {}", "x", "what varies"),
            ("[grid]\nsensors = ['lab']\n[[map]]\nx = 'sensors'\ny = 'sensors'\nstatistic = []", "statistic", "'median'"),
            ("[base]\n'training.seed' = 1", "training.seed", "train"),
            ("[base]\ntrain = 'circle'\n[grid]\n'training.stepz' = [1]", "training.stepz", "steps"),
            ("[base]\ntrain = 'circle'\n[grid]\ncontroller = ['pid']", "controller", "without it"),
            ("[base]\npolicy = 'circle'\n[grid]\ncontroller = ['pid']", "controller", "'residual'"),
            ("[base]\nsensors = 'lab'\n[draw]\ncount = 1\nsensors = ['ideal']", "sensors", "once"),
        )
    ],
    ("sweep", "points.toml"): [
        ("[grid]\n'rig.mechanics.mas' = [3.0]", "", "mechanics.mas"),
        ("[grid]\n'gain.bandwith' = [60.0]", "", "bandwith"),
        ("[grid]\npolicy = ['nowhere']", "", "nowhere"),
    ],
    ("log", "none.parquet"): [(None, "", "cannot be read")],
    ("log", "log.xyz"): [("", "", "allowed: a file that ends in .csv, .parquet, .mcap")],
    ("log", "log.csv"): [
        (None, "", "cannot be read"),
        ("", "", "is empty; allowed: a line of names, then lines of numbers"),
        (BINARY, "", "is empty; allowed: a line of names"),
        ("0,1\n".encode("utf-16")[:-1], "", "is no CSV: damaged utf-16 text"),
        ("time,a\n0,1\n1\n", "", "line 3: '1'; allowed: 2 numbers, for time, a"),
        ("time,a\n" + "1," * 2**20, "", "log.csv'", " allowed: at most 1048576"),
    ],
    ("recorded", "bad.rec"): [
        (None, "", "bad.rec' cannot be read"),
        ("{", "", "bad.rec' is damaged or foreign ("),
    ],
    ("recorded", "bad.json"): [
        (None, "", "bad.json' cannot be read"),
        ("{", "", "bad.json' is damaged: "),
        ("[1]", "", "content = [1]; allowed: an object"),
    ],
    ("log", "log.parquet"): [(b"PAR1 but not", "", "is no Parquet (")],
    ("log", "log.mcap"): [(b"neither", "", "cannot be read as MCAP (")],
}
CASES = [
    pytest.param(kind, name, *row[:2], row[2:], id=f"{kind}-{name}{row[1]}-{k}")
    for (kind, name), all_rows in TABLE.items()
    for k, row in enumerate(all_rows)
]


@pytest.mark.parametrize(("kind", "name", "content", "rest", "words"), CASES)
def test_a_refused_file_says_what_is_wrong_in_one_line(kind, name, content, rest, words, tmp_path):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ValueError) as caught:  # noqa: PT011  its words are the table's
        READERS[kind](path if kind == "log" else f"{path}{rest}")
    message = str(caught.value)
    assert all(word in message for word in words), message
    assert "\n" not in message
