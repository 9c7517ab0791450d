"""Commands that are refused: status 2, one line that names what is wrong and what is allowed, and nothing written."""

import shlex

import pytest

from tests.build.targets import need_linker
from tests.console import call

FILES = {
    "own/mine.txt": "mine", "heavy.toml": "[mechanics]\nmass = 90.0\n",
}  # fmt: skip
"""What lies in the folder where a command is called."""
ONE_OF = "allowed: one of LOG, --propose PLAN, --simulate PLAN"
ENDS = "allowed: a file that ends in .toml"
COMPILED = "allowed: a compiled one: backstepping"

TABLE = {
    "export --to riscv": "--to 'riscv'; allowed: onnx, wasm, c, x86-64, aarch64, cortex-m7",
    "export --to wasm --env CartPole-v1 --out x": "--env 'CartPole-v1'; allowed: BirthSIM/Circle-v1",
    "export --to wasm --controller shut-valves --out x": f"controller = 'shut-valves'; {COMPILED}",
    "export --to wasm --controller nothing --out x": "controller = 'nothing'; allowed: backstepping",
    "export --to wasm --controller pid[gain=1] --out x": "gain = 1.0 is unknown; allowed for pid: ",
    "export --to wasm --controller residual --out x": "--controller residual; allowed: --policy NAME",
    "export --to wasm --policy nowhere --out x": "policy = 'nowhere'",
    "export --to wasm --all --controller pid --out x": "--all with --controller; allowed: one of them",
    "export --to cortex-m7 --env BirthSIM/Circle-v1 --out x": "--env with cortex-m7; allowed: without it",
    "export --to wasm --parameters nowhere.toml --out x": "'nowhere.toml'",
    "export --to fmu --out x.zip": "--out 'x.zip'; allowed: a file that ends in .fmu",
    "export --to fmu --controller shut-valves --out x.fmu": f"controller = 'shut-valves'; {COMPILED},",
    "export --to fmu --controller pid --policy circle --out x.fmu": "--controller with --policy; allowed: one of them",
    "export --to fmu --env BirthSIM/Square-v1 --out x.fmu": "--env 'BirthSIM/Square-v1'; allowed: BirthSIM/Circle-v1",
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
    "identify --simulate plan.csv --out a.csv": "log = 'plan.csv' cannot be read: No such file or directory",
    "identify log.csv --out rig.toml": "log = 'log.csv' cannot be read: No such file or directory",
    "identify log.csv --out rig.toml --parameters no.toml": "parameters = 'no.toml' cannot be read",
    "live --host 0.0.0.0 --port 0": "host = '0.0.0.0' means every address",
    "live --port 0 --replay none.rec": "none.rec' cannot be read",
    "live --port 0 --compare nobody": "controller = 'nobody'; allowed: backstepping",
    "live --static page --compare nobody": "controller = 'nobody'; allowed: backstepping",
    "live --static page --controller shut-valves": "controller = 'shut-valves'; allowed: backstepping",
    "live --port 0 --controller none.py:Law": "controller file 'none.py' does not exist",
    "live --replay a.rec --controller pid": "--controller with --replay; allowed: without it",
    "live --policy circle nowhere --port 0": "policy = 'nowhere'",
    "live --policy circle nowhere --static page": "policy = 'nowhere'",
    "live --static page --parameters heavy.toml": "mass",
    "live --static own": "--static 'own' is not empty; allowed: a new or empty folder",
}


@pytest.mark.parametrize("line", TABLE)
def test_a_command_is_refused_in_one_line_and_leaves_nothing(line, tmp_path, monkeypatch, capsys):
    if "--to fmu" in line:
        need_linker()
    monkeypatch.chdir(tmp_path)
    for name, content in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(content)
    command, *options = shlex.split(line)
    status, printed, complained = call(command, monkeypatch, capsys, *options)
    assert (status, printed) == (2, "")
    assert complained.startswith(f"birthsim {command}: error: ")
    assert complained.count("\n") == 1
    assert TABLE[line] in complained
    assert {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()} == FILES.keys()
    assert not (tmp_path / "page").exists()
