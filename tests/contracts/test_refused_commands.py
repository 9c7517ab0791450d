"""Commands that are refused: status 2, one line that names what is wrong and what is allowed, and nothing written."""

import shlex
import sys

import pytest

from tests.build.targets import need_linker
from tests.console import OWN, RESIDUAL, assert_says, call, words

TUNED = """
class Tuned(Held):
    TUNABLE = {"fraction": (0.0, 2.0)}

class Upside(Held):
    TUNABLE = {"fraction": (5.0, 1.0)}

class Mute(Held):
    TUNABLE = {}
"""
FILES = {
    "own/mine.txt": "mine", "heavy.toml": "[mechanics]\nmass = 90.0\n", "rig.toml": "[mechanics]\nmass = -3.0\n",
    "own.py": OWN + TUNED, "other.json": '{"gains": {"damping": 1.0}}', "beyond.json": '{"gains": {"fraction": 2.5}}',
}  # fmt: skip
"""What lies in the folder where a command is called."""
ONE_OF = "allowed: one of LOG, --propose PLAN, --simulate PLAN"
ENDS = "allowed: a file that ends in .toml"
COMPILED = "allowed: a compiled one: backstepping"
NUMBER, SEED = "allowed: a whole number from 1 to 1000000", "allowed: a whole number from 0 to 4294967295"
MODELS, DRAWN = ("ideal", "lab", "honest"), ("some", "none", "plant", "all")
KNOWN = "allowed: backstepping, "
MASS = "Mechanics.mass = -3.0 is impossible; allowed: a finite number > 0 and"
RAY = "allowed: ray, or ray:ADDRESS of a running cluster"

TABLE = {
    **{f"{command} --controller nobody --out x": f"controller = 'nobody'; {KNOWN}"
       for command in ("evaluate", "comparison", "haptics", "stability", "figure4", "tune")},
    **{f"{command} --parameters nowhere.toml --out x": "'nowhere.toml' cannot be read"
       for command in ("export --to wasm", "accuracy", "stability", "figure4", "tune --controller pid")},
    **{f"{line} 0 --out x": (line.split()[1], f"'0'; {NUMBER}") for line in (
       "comparison --episodes", "accuracy --rigs", "haptics --rigs", "stability --points", "train --seeds", "train --jobs")},
    "export --to riscv": "--to 'riscv'; allowed: onnx, hub, minari, wasm, c, x86-64, aarch64, cortex-m7",
    "export --to wasm --env CartPole-v1 --out x": "--env 'CartPole-v1'; allowed: BirthSIM/Circle-v2",
    "export --to wasm --controller shut-valves --out x": f"controller = 'shut-valves'; {COMPILED}",
    "export --to wasm --controller nothing --out x": "controller = 'nothing'; allowed: backstepping",
    "export --to wasm --controller residual --out x": "--controller residual; allowed: --policy NAME",
    "export --to wasm --policy nowhere --out x": "policy = 'nowhere'",
    "export --to wasm --all --controller pid --out x": "--all with --controller; allowed: one of them",
    "export --to cortex-m7 --env BirthSIM/Circle-v2 --out x": "--env with cortex-m7; allowed: without it",
    "export --to ptx --gpu sm_90 --out x": "--gpu with ptx; allowed: with cubin",
    "export --to ptx --seed 1 --out x": "--seed with ptx; allowed: with other targets",
    "export --to parquet own.py --out a.csv": "a.csv'; allowed: a file that ends in .parquet",
    "export --to mcap none.rec --out a.mcap": "none.rec' cannot be read",
    "export --to fmu --out x.zip": "--out 'x.zip'; allowed: a file that ends in .fmu",
    "export --to fmu --controller shut-valves --out x.fmu": f"controller = 'shut-valves'; {COMPILED},",
    "export --to fmu --controller pid --policy circle --out x.fmu": "--controller with --policy; allowed: one of them",
    "export --to fmu --alone --out x.fmu": "--alone without a controller; allowed: with --controller or --policy",
    "export --to fmu --valves one_valve --out x.fmu": "--valves without a controller; allowed: with --controller or --policy",
    "export --to fmu --env BirthSIM/Square-v1 --out x.fmu": "--env 'BirthSIM/Square-v1'; allowed: BirthSIM/Circle-v2",
    **dict.fromkeys(("evaluate", "figure4", "animate", "train"), "--out"),
    "tune": "--controller",
    "drive --driver can --out x": "--driver 'can'; allowed: udp, simulated, or path/to/file.py:Class",
    "evaluate --env BirthSIM/Square-v1 --out x": "--env 'BirthSIM/Square-v1'; allowed: BirthSIM/Circle-v2, ",
    "evaluate --controller backsteping --out x": "(did you mean 'backstepping'?); allowed: a registered name",
    "evaluate --sensors labb --out x": "error: --sensors 'labb' (did you mean 'lab'?)",
    "evaluate --controller own.py:Mine --out x": "own.py' has no 'Mine'; allowed: a name that it defines: ",
    "evaluate --controller residual --policy none --out x": "none' holds no policy; allowed: a folder that birthsim train",
    "evaluate --controller pid": ("--out is missing", "--help"),
    "evaluate --episodes -3 --out x": ("--episodes", f"'-3'; {NUMBER}"),
    "evaluate --episods 3 --out x": "--episods. Did you mean --episodes?",
    "evaluate --seed -1 --out x": ("--seed", f"'-1'; {SEED}"),
    "evaluate --sensors perfect --out x": ("--sensors", "perfect", *MODELS),
    "evaluate --randomize some --out x": ("--randomize", *DRAWN),
    "evaluate --parameters rig.toml --out x": MASS,
    "evaluate --reference nowhere.csv --out x": "reference = 'nowhere.csv' cannot be read",
    "evaluate --user-force gentle --out x": "user_force = 'gentle'; allowed: a birthsim_env.UserForce, 'steps', 'sine'",
    "evaluate --cluster slurm --out x": ("--cluster", "slurm", RAY),
    "evaluate --cluster ray: --out x": ("--cluster", "ray:", RAY),
    "evaluate --episodes 2 --colour red --out x": ("--colour", "allowed: ", "--help"),
    "evaluate --out own.py": "own.py'",
    "sweep nowhere.toml --out x": "sweep = 'nowhere.toml' cannot be read: ",
    "sweep own.py --out x": "own.py' is no TOML: ",
    "sweep rig.toml --out x": "rig.toml': 'mechanics'; allowed: [base], [grid], [draw], [search] and [[map]]",
    "comparison --jobs 0 --out x": ("--jobs", "'0'; allowed: a whole number from 1 to "),
    f"comparison --env {RESIDUAL} --out x": ("--env", RESIDUAL, "BirthSIM/Circle-v2"),
    "comparison --controller residual --out x": "--controller 'residual'; allowed: residual:POLICY, ",
    "comparison --parameters rig.toml --out x": MASS,
    "comparison --plant drawn-sensors --sensors lab --out x": "--plant drawn-sensors; allowed: with --sensors honest",
    "haptics --subject moon --out x": "--subject",
    "speed --beside own --out x": "--beside 'own' has no birthsim_env; allowed: a checkout of the project\n",
    "stability --map moon --out x": "--map",
    "beside-law --policy own --parameters '' --out x": "own' holds no policy",
    "study compare": ("NAME = 'compare'; allowed: status, render, ", "comparison"),
    "figure4 --set daming=3 --controller pid --out x": "--set 'daming=3' (did you mean 'damping'?); allowed for pid: ",
    "figure4 --set gain=3 --out x": "--set 'gain=3'; allowed for backstepping: weight_compensation, ",
    "figure4 --out own.py": "own.py'",
    "animate --out pull.png": "--out 'pull.png'; allowed: a file that ends in .webp or .gif",
    "animate --end 99 --out a.gif": "allowed: from 0 to 15 s",
    "animate --begin 2 --end 2.5 --out a.gif": "allowed: from 0 to 15 s, a second apart",
    "animate --begin nan --out a.gif": "--begin: 'nan'; allowed: a finite number",
    "animate --controller backstepping nobody --out a.gif": f"controller = 'nobody'; {KNOWN}",
    "animate --out a.gif --controller backstepping": ("--controller", "2"),
    "animate --env BirthSIM/Moon-v1 --out a.gif": "--env 'BirthSIM/Moon-v1'; allowed: BirthSIM/Circle-v2",
    "animate --rate 30 --out a.gif": ("--rate", "30", "10, 20, 25, 50"),
    "animate --parameters nowhere.toml --out a.gif": "parameters = 'nowhere.toml' cannot be read",
    "animate --reference own.py:Mine --out a.gif": "own.py' has no 'Mine'; allowed: a name that it",
    "train --env BirthSIM/Circle-v2 --out x": ("--env 'BirthSIM/Circle-v2'", "; allowed: BirthSIM/CircleResidual-v2, "),
    "train --steps 1e6 --out x": ("--steps", "'1e6'", "allowed: a whole number "),
    "train --seed 4294967296 --out x": ("--seed", f"'4294967296'; {SEED}"),
    "train --config square --out x": "configuration = 'square' is no file; allowed: circle, ",
    "train --config rig.toml --out x": "rig.toml': table 'mechanics'; allowed: training, residual",
    "train --law pid --out x": ("law = 'pid'", "backstepping-weight", "none"),
    "train --parameters rig.toml --out x": MASS,
    "train --out own.py": "own.py' is a file; allowed: a folder",
    "tune --controller backstepping --out x": "controller = 'backstepping' has no gains to tune; allowed: ",
    "tune --controller own.py:Mute --out x": "has no gains to tune",
    "tune --controller own.py:Upside --out x": "Upside.TUNABLE['fraction'] = (5.0, 1.0); allowed: 0 <= low < high, finite",
    "tune --controller pid --trials 0 --out x": ("--trials", "'0'", "a whole number from 1 to 100000"),
    "tune --controller pid --sensors none --out x": ("--sensors", "none", "ideal", "both"),
    "tune --controller pid --start nowhere.json --out x": "nowhere.json'",
    "tune --controller pid --start other.json --out x": "other.json' lacks 'bandwidth'; allowed: JSON with gains: bandwidth",
    "tune --controller own.py:Tuned --start beyond.json --out x": "beyond.json' has fraction = 2.5; allowed: 0 to 2",
    **dict.fromkeys(
        ("run --env BirthSIM/Forcep-v1 --out x", "run --env Forceps-v2 --out x"),
        "(did you mean 'BirthSIM/Forceps-v2'?); allowed: BirthSIM/",
    ),
    "export --to onnx nowhere": "policy = 'nowhere'",
    "export --to onnx circle --out own": "'own' is a folder; allowed: the name of a file",
    "export --to onnx circle --out own.py/policy.onnx": "'own.py': File exists",
    "figure4 --set gain --out x": "--set 'gain'; allowed: GAIN=VALUE",
    "export --to fmux": "--to 'fmux' (did you mean 'fmu'?); allowed: what birthsim export --help",
    "export --to stone": "--to 'stone'; allowed: onnx, hub, minari, wasm, ",
    "export": "--to is missing; allowed: onnx, hub, minari, wasm, ",
    **{
        f"live --request-time {time}": f"{time!r}; allowed: a finite number > 0 and <= 3600"
        for time in ("0", "-1", "nan", "1e9", "soon")
    },
    "identify": f"nothing given; {ONE_OF}",
    "identify log.csv --propose plan.csv": f"log and propose given; {ONE_OF}",
    "identify log.csv": f"--out is missing; {ENDS}, in a folder that exists",
    "identify log.csv --out rig.json": f"rig.json'; {ENDS}",
    "identify log.csv --out none/rig.toml": f"none/rig.toml'; {ENDS}, in a folder that exists",
    "identify log.csv --out rig.toml --duration 5": "--duration is given; allowed with --propose only",
    "identify --propose plan.csv --report r": "--report is given; allowed with LOG only",
    "identify log.csv --out rig.toml --report r": "log = 'log.csv' cannot be read: No such file or directory",
    "identify --propose plan.csv --out a.toml": "--out is given; allowed with LOG or --simulate",
    "identify --propose plan.csv --duration 1": "duration = 1.0; allowed: a finite number >= 4 and <= 600 (s)",
    "identify --simulate plan.csv --out a.toml": "a.toml'; allowed: a file that ends in .csv, .parquet, .mcap",
    "identify --propose plan.csv --columns force_x=Fz": "--columns is given; allowed with LOG only",
    "identify --propose plan.csv --skip 0": "--skip is given; allowed with LOG only",
    "identify --propose plan.csv --decimal-comma": "--decimal-comma is given; allowed with LOG only",
    "identify log.csv --out rig.toml --skip -1": "'-1'; allowed: a whole number from 0",
    "identify log.csv --out rig.toml --columns force=Fz": ("--columns force=Fz: 'force'", "allowed: NAME=COLUMN"),
    "identify log.xlsx --out rig.toml": ("log = 'log.xlsx'; allowed: a file that ends in .csv, ", "save the sheet as CSV"),
    "identify --simulate plan.csv --out a.csv": "plan = 'plan.csv' cannot be read: No such file or directory",
    "identify log.csv --out rig.toml": "log = 'log.csv' cannot be read: No such file or directory",
    "identify log.csv --out rig.toml --parameters no.toml": "parameters = 'no.toml' cannot be read",
    "compare": ("--log is missing", "--help"),
    "compare log.csv": "log = 'log.csv' cannot be read: No such file or directory",
    "compare log.xlsx --parameters heavy.toml": "log = 'log.xlsx'; allowed: a file that ends in .csv, ",
    "compare log.csv --parameters no.toml": "parameters = 'no.toml' cannot be read",
    "compare log.csv --parameters rig.toml": MASS,
    "compare log.csv --parameters heavy.toml heavy.toml": "parameters = 'heavy.toml' is given twice; allowed: ",
    "compare log.csv --window 9": "window = 9.0; allowed: a finite number >= 0.05 and <= 5 (s)",
    "compare log.csv --multiple 0": "multiple = 0.0; allowed: a finite number > 0",
    "compare log.csv --pressure-limit -1": "pressure_limit = -1.0; allowed: a finite number > 0 (Pa)",
    "compare log.csv --position-limit 0": "position_limit = 0.0; allowed: a finite number > 0 (m)",
    "compare log.csv --horizon 0": "horizon = 0.0; allowed: a finite number >= 0.05 and <= 60 (s)",
    "compare log.csv --columns force=Fz": ("--columns force=Fz: 'force'", "allowed: NAME=COLUMN"),
    "compare log.csv --out own.py": "own.py' is a file; allowed: a folder",
    "live --host 0.0.0.0 --port 0": "host = '0.0.0.0' means every address",
    "live --allowed-host http://rig:80 --port 0": "--allowed-host 'http://rig:80'; allowed: a name or address alone",
    "live --port 0 --replay none.rec": "none.rec' cannot be read",
    "live --port 0 --compare nobody": "controller = 'nobody'; allowed: backstepping",
    "live --static page --compare nobody": "controller = 'nobody'; allowed: backstepping",
    "live --static page --controller shut-valves": "controller = 'shut-valves'; allowed: backstepping",
    "live --port 0 --controller none.py:Law": "controller file 'none.py' does not exist",
    "live --replay a.rec --controller pid": "--controller with --replay; allowed: without it",
    "live --policy circle nowhere --static page": "policy = 'nowhere'",
    "live --static page --parameters heavy.toml": "mass",
    "live --static own": "--static 'own' is not empty; allowed: a new or empty folder",
}  # fmt: skip

GONE = {
    "tune --controller pid --out x": ("optuna", "tune"), "live --port 0": ("uvicorn", "live"),
    "live --port 0 --replay a.rec": ("uvicorn", "live"), "export --to hub circle --out x": ("agents.policy.seeds", "agents"),
}  # fmt: skip
"""Command -> a package or module that is not there, and the extra that has it."""
TABLE |= {line: f"pip install -e '.[{extra}]'" for line, (_, extra) in GONE.items()}


@pytest.mark.parametrize("line", TABLE)
def test_a_command_is_refused_in_one_line_and_leaves_nothing(line, tmp_path, monkeypatch, capsys):
    if "--to fmu" in line or "--to wasm" in line:
        need_linker()
    if line in GONE:
        monkeypatch.setitem(sys.modules, GONE[line][0], None)
        for compiling in ("birthsim.commands.live.packed_page", "birthsim.commands.tune.check_world"):
            monkeypatch.setattr(compiling, None)
    monkeypatch.chdir(tmp_path)
    for name, content in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(content)
    command, *options = shlex.split(line)
    status, printed, complained = call(command, monkeypatch, capsys, *options)
    assert (status, printed) == (2, "")
    *before, last = complained.splitlines()
    assert last.startswith(f"{' '.join(words(command))}: error: ")
    # Before the line there is nothing but the usage, and this only where an option itself is wrong.
    assert before == [] or before[0].startswith("Usage: ")
    assert_says(TABLE[line], complained)
    assert {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.*") if path.suffix != ".pyc"} == FILES.keys()
    assert not (tmp_path / "x").exists()
    assert not (tmp_path / "page").exists()
