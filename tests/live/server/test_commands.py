"""The commands that serve a page: until they are interrupted, or refuse in one line."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest

from tests.console import PATIENCE, call


@pytest.mark.slow
def test_the_command_serves_until_an_interrupt_and_leaves_nothing(tmp_path: Path) -> None:
    host = "127.0.0.2" if sys.platform == "linux" else "127.0.0.1"  # others lack the rest of 127.0.0.0/8
    command = [sys.executable, "-m", "birthsim", "live", "--port", "0", "--host", host]
    env = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=env) as process:
        try:
            assert process.stdout is not None
            line = next(line for line in process.stdout if "http://" in line)
            address = next(word for word in line.split() if word.startswith("http:"))
            assert address.startswith(f"http://{host}:")
            with urlopen(f"{address}/rig/loop.wasm") as answer:
                assert answer.read(4) == b"\0asm"
            process.send_signal(signal.SIGINT)
            rest = process.stdout.read()
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()
    assert "Traceback" not in rest
    assert list(tmp_path.iterdir()) == []


def test_without_the_extra_it_says_how_to_get_it_before_anything_is_compiled(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    monkeypatch.setattr("birthsim_live.commands.live.packed_page", None)
    for command, arguments in (("live", []), ("live", ["--replay", "pull.rec"])):
        status, _, complained = call(command, monkeypatch, capsys, *arguments)
        assert status == 2
        assert "pip install 'birthsim[live]'" in complained
