"""``birthsim export`` without what it needs: a line that says what to install, and nothing written."""

import json
import subprocess
import sys

import numpy as np
import pytest

from birthsim_build.code import threads
from birthsim_env.physics.compiled.lanes import MASS
from tests.console import call

LACKS = [
    # what is asked for, LLVM, what is not there, what is said
    ("wasm", (20, 1, 8), "compiler.find_spec", "llvmlite has LLVM 20.1.8; allowed: 22 or later, llvmlite 0.50"),
    ("wasm", (22, 1, 0), "compiler.find_spec", "pip install -e '.[build]'"),
    ("cubin", (22, 1, 0), "ptx.assembler", "a cubin needs NVIDIA's ptxas: pip install -e '.[cuda]'"),
]


@pytest.mark.parametrize(("target", "llvm", "gone", "said"), LACKS)
def test_without_what_it_needs_it_says_what_to_install(target, llvm, gone, said, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("llvmlite.binding.llvm_version_info", llvm)
    monkeypatch.setattr(f"birthsim_build.code.{gone}", lambda *_: None)
    monkeypatch.setattr("birthsim.exports.loops.make_bundle", None)  # before anything is compiled
    status, _, complained = call("export", monkeypatch, capsys, "--to", target, "--out", tmp_path / "out")
    assert status == 2
    assert said in complained
    assert not (tmp_path / "out").exists()


WITHOUT_POLICIES = """
import sys
sys.modules["safetensors"] = sys.modules["torch"] = None
import birthsim.exports.loops, birthsim.exports.fmu
from birthsim_build.loops import law_part
from birthsim_env import Parameters
print(len(law_part("pid", Parameters(), False).stages))
law_part("residual:circle", Parameters(), False)
"""


def test_laws_need_nothing_that_trains_policies():
    done = subprocess.run([sys.executable, "-c", WITHOUT_POLICIES], capture_output=True, text=True, check=False)
    assert int(done.stdout) > 1
    assert done.stderr.rstrip().endswith("residual needs pip install -e '.[agents]' in a clone")


def test_kernels_and_programs(tmp_path, monkeypatch, capsys):
    def compiled(functions, target, out, **given):
        assert target == "ptx"
        assert "baselines.rivals.pid:control" in functions
        words = np.fromfile(out.parent / "circle_ideal_pid.bin", dtype=np.int64)
        assert given == {"threads": threads.Threads(words[threads.SPACE])}
        out.with_suffix(".ptx").write_text("text")

    monkeypatch.setattr("birthsim_build.building.compile_object", compiled)
    status, said, _ = call("export", monkeypatch, capsys, "--to", "ptx", "--controller", "pid", "--out", tmp_path / "out")
    assert status == 0
    assert "a lane of circle_ideal_pid" in said
    assert f"Word {threads.MISSED} of the program" in (tmp_path / "out" / "kernels.h").read_text()
    words = np.fromfile(tmp_path / "out" / "circle_ideal_pid.bin", dtype=np.int64)
    assert words[0] == threads.MAGIC
    about = json.loads((tmp_path / "out" / "circle_ideal_pid.json").read_text())
    assert about["words_of_data"] == words[threads.ROWS]
    assert about["rows"]["rig_mass"] == MASS
    assert {"y1", "measured_x", "reward", "terminated", "tracking_error1"} <= about["rows"].keys()
    assert max(about["rows"].values()) < words[threads.ROWS]
