"""``birthsim export`` without what it needs: a line that says what to install, and nothing written."""

import subprocess
import sys

from tests.console import call


def test_an_old_llvm_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("birthsim_build.code.compiler.llvm_version_info", (20, 1, 8))
    status, _, complained = call("export", monkeypatch, capsys, "--to", "wasm", "--out", tmp_path / "out")
    assert (status, complained) == (
        2, "birthsim export: error: llvmlite has LLVM 20.1.8; allowed: 22 or later, llvmlite 0.50\n"
    )  # fmt: skip
    assert not (tmp_path / "out").exists()


def test_without_a_linker_it_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("birthsim_build.code.compiler.llvm_version_info", (22, 1, 0))
    monkeypatch.setattr("birthsim_build.code.compiler.find_spec", lambda _: None)
    status, _, complained = call("export", monkeypatch, capsys, "--to", "wasm", "--out", tmp_path / "out")
    assert status == 2
    assert "pip install 'birthsim[build]'" in complained
    assert not (tmp_path / "out").exists()


WITHOUT_POLICIES = """
import sys
sys.modules["safetensors"] = sys.modules["torch"] = None
import birthsim_build.commands.build, birthsim_build.commands.fmu
from birthsim_build.loops import law_part
from birthsim_env import Parameters
print(len(law_part("pid", Parameters(), False).stages))
law_part("residual:circle", Parameters(), False)
"""


def test_laws_need_nothing_that_trains_policies():
    done = subprocess.run([sys.executable, "-c", WITHOUT_POLICIES], capture_output=True, text=True, check=False)
    assert int(done.stdout) > 1
    assert done.stderr.rstrip().endswith("a policy needs the extra: pip install 'birthsim[agents]'")
