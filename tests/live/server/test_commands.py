"""The commands that serve a page: until they are interrupted, or refuse in one line."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from birthsim_live.rig.recording import load_recording
from tests.console import PATIENCE, call


@pytest.mark.slow
def test_the_command_serves_and_finishes_its_recording_at_an_interrupt(tmp_path: Path) -> None:
    from websockets.sync.client import connect

    command = [sys.executable, "-m", "birthsim", "live", "--port", "0", "--record-dir", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            line = next(line for line in process.stdout if "http://" in line)
            address = next(word for word in line.split() if word.startswith("http:"))
            with connect(address.replace("http", "ws") + "/ws", open_timeout=PATIENCE) as ws:
                assert json.loads(ws.recv())["type"] == "hello"
                ws.send('{"type":"record","on":true}')
                while not (message := json.loads(ws.recv())).get("recording"):
                    pass
                ws.send("x" * 100_000)
                while json.loads(ws.recv())["type"] != "error":
                    pass
                process.send_signal(signal.SIGINT)
                rest = process.stdout.read()
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()
    assert f"recording finished: {tmp_path / message['recording']['file']}" in rest
    assert "Traceback" not in rest
    assert load_recording(tmp_path / message["recording"]["file"]).rows.shape[0] >= 1


def test_without_the_extra_it_says_how_to_get_it_before_anything_is_compiled(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    monkeypatch.setattr("birthsim_live.rig.session.Session", None)
    for command, arguments in (("live", []), ("live", ["--replay", "pull.rec"])):
        status, _, complained = call(command, monkeypatch, capsys, *arguments)
        assert status == 2
        assert "pip install 'birthsim[live]'" in complained


def test_commands_refuse_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        for arguments, words in (
            (["--port", port], f"port = {port} of 127.0.0.1 cannot be served"),
            (["--host", "0.0.0.0", "--port", "0"], "host = '0.0.0.0' means every address"),
        ):
            status, _, complained = call("live", monkeypatch, capsys, *arguments)
            assert status == 2
            assert complained.strip().splitlines()[-1].startswith("birthsim live: error: ")
            assert words in complained
    status, _, complained = call("live", monkeypatch, capsys, "--port", "0", "--replay", tmp_path / "none.rec")
    assert status == 2
    assert complained.strip().splitlines()[-1].startswith("birthsim live: error: ")
    assert "none.rec' cannot be read" in complained


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--port", "0", "--compare", "nobody"], "compare = 'nobody'; allowed: nothing, backstepping"),
        (["--static", "page", "--compare", "pid"], "--compare pid beside --static; allowed: "),
    ],
)
def test_a_comparison_that_cannot_be_is_refused(
    options: list[str], said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _, complained = call("live", monkeypatch, capsys, *options)
    assert status == 2
    assert said in complained.splitlines()[-1]
