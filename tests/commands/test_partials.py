"""Places for what is not whole: a dead writer's go, a live one's and a user's files stay, whatever process ids say."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from birthsim_env import partials
from birthsim_env.files import own_folder, whole_file, whole_folder, whole_results, write_text
from birthsim_env.partials import HIDDEN, place
from tests.console import ROOT

LOADED = f"""
import sys, types
sys.modules["birthsim_env"] = package = types.ModuleType("birthsim_env")
package.__path__ = [{str(ROOT / "birthsim_env")!r}]  # the package itself takes seconds
from pathlib import Path
"""

WRITER = """
from birthsim_env.files import {kind}
with {kind}(Path(sys.argv[1])) as it:
    (it / "a.txt").write_text("half") if isinstance(it, Path) else it.write(b"half")
    print("writing", flush=True)
    sys.stdin.read()
"""


@contextmanager
def writing(kind, path):
    """A process that has half of something written and waits."""
    line = [sys.executable, "-c", LOADED + WRITER.replace("{kind}", kind.__name__), str(path)]
    with subprocess.Popen(line, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout.readline() == b"writing\n"
            yield process
        finally:
            process.kill()


def names(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("kind", [whole_file, whole_results])
def test_nobody_removes_what_a_live_process_writes(kind, tmp_path):
    target = tmp_path / "a.txt" if kind is whole_file else tmp_path
    with writing(kind, target) as process:
        write_text(tmp_path / "other.txt", "whole")
        with own_folder(tmp_path):
            write_text(tmp_path / "third.txt", "whole")
        process.communicate(b"")
        assert process.returncode == 0
    assert names(tmp_path) == [".lock", "a.txt", "other.txt", "third.txt"]
    assert (tmp_path / "a.txt").read_text() == "half"


@pytest.mark.parametrize("kind", [whole_file, whole_results])
def test_what_a_killed_process_left_goes_with_the_next_one_that_writes_there(kind, tmp_path):
    for _ in range(3):
        with writing(kind, tmp_path / "a.txt" if kind is whole_file else tmp_path) as process:
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            assert len(names(tmp_path / HIDDEN)) == 2
    write_text(tmp_path / "b.txt", "whole")
    assert os.listdir(tmp_path) == ["b.txt"]


def test_the_owner_of_a_folder_removes_what_was_left_in_folders_below(tmp_path):
    (tmp_path / "pieces").mkdir()
    with writing(whole_file, tmp_path / "pieces" / "a.txt") as process:
        process.kill()
        process.wait()
    with own_folder(tmp_path):
        assert names(tmp_path) == [".lock"]


def test_files_of_a_user_stay_whatever_their_names(tmp_path):
    own = (
        *(".holiday.2024999.partial", ".results.1.partial", f"{HIDDEN}/notes.txt", f"{HIDDEN}/a.lock", "films/.a.7.partial"),
        *(f"films/{HIDDEN}/{'0' * 32}.lock", f"{HIDDEN}/{'0' * 32}/thesis.txt", ".lock"),
    )
    for name in own:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("mine")
    with own_folder(tmp_path), whole_results(tmp_path) as results:
        write_text(results / "new.txt", "new")
    assert names(tmp_path) == sorted([*own, "new.txt"])
    assert all((tmp_path / name).read_text() == "mine" for name in own)


def test_a_link_leads_no_cleaning_elsewhere(tmp_path):
    for folder in ("elsewhere", "out"):
        (tmp_path / folder).mkdir()
    with writing(whole_file, tmp_path / "elsewhere" / "a.txt") as process:
        process.kill()
        process.wait()
    left = names(tmp_path / "elsewhere")
    (tmp_path / "out" / HIDDEN).symlink_to(tmp_path / "elsewhere" / HIDDEN)
    with own_folder(tmp_path / "out"), pytest.raises(ValueError, match=r"\.birthsim' is no folder; allowed: "):
        write_text(tmp_path / "out" / "b.txt", "b")
    assert names(tmp_path / "elsewhere") == left


@pytest.mark.parametrize("last", [1, 2, 3, 4])
def test_another_writer_may_remove_the_folder_between_any_two_looks(tmp_path, monkeypatch, last):
    look, looks = Path.stat, []

    def removes(path, **how):
        found = look(path, **how)
        if path.name == HIDDEN:
            looks.append(path)
            if len(looks) == last:
                path.rmdir()
        return found

    (tmp_path / HIDDEN).mkdir()
    monkeypatch.setattr(Path, "stat", removes)
    write_text(tmp_path / "a.txt", "a")
    assert (tmp_path / "a.txt").read_text() == "a"


def test_what_another_host_made_stays_for_a_week(tmp_path, monkeypatch):
    """Its locks may not be seen here, so that a live writer would look as if it had ended."""
    with writing(whole_file, tmp_path / "a.txt") as process:
        process.kill()
        process.wait()
    monkeypatch.setattr(partials, "_system", lambda: "0" * 16)
    write_text(tmp_path / "b.txt", "b")
    left = names(tmp_path / HIDDEN)
    assert len(left) == 2
    old = time.time() - partials.PATIENCE - 60
    (lock,) = (tmp_path / HIDDEN).glob("*.lock")
    os.utime(lock, (old, old))
    write_text(tmp_path / "b.txt", "b")
    assert os.listdir(tmp_path) == ["b.txt"]


def test_where_nothing_can_be_locked_nothing_young_goes(tmp_path, monkeypatch):
    monkeypatch.setattr(partials, "_locked", lambda descriptor: None)
    with place(tmp_path) as one, place(tmp_path) as other:
        assert one.is_dir()
        assert other.is_dir()
    assert os.listdir(tmp_path) == []


def test_writers_at_once_in_one_folder_do_not_meet(tmp_path):
    """The last one there removes the hidden folder while others make it."""
    code = (
        f"{LOADED}from birthsim_env.files import write_text\n"
        "for k in range(60):\n    write_text(Path(sys.argv[1]) / sys.argv[2], str(k))\n"
    )
    line = [sys.executable, "-c", code, str(tmp_path)]
    several = [subprocess.Popen([*line, name], cwd=ROOT) for name in "abc"]
    assert [one.wait() for one in several] == [0, 0, 0]
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys("abc", "59")


def test_a_folder_appears_as_a_whole_and_once(tmp_path):
    def write(word):
        with whole_folder(tmp_path, "data/probe/one") as own:
            (own / "data" / "probe" / "one").mkdir(parents=True)
            (own / "data" / "about.txt").write_text(word)
            (own / "data" / "probe" / "one" / "rows.txt").write_text(word)
            if word == "none":
                assert not (tmp_path / "data").exists()
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write("none")
    assert os.listdir(tmp_path) == []
    write("first")
    with pytest.raises(OSError, match="exists"):
        write("second")
    assert names(tmp_path) == ["data/about.txt", "data/probe/one/rows.txt"]
    assert (tmp_path / "data" / "about.txt").read_text() == "first"
    assert (tmp_path / "data" / "probe" / "one" / "rows.txt").read_text() == "first"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root")
def test_what_root_leaves_bars_no_owner(tmp_path):
    """A container's root writes into a user's folder."""
    os.chown(tmp_path, 1234, 1234)
    with place(tmp_path) as own, own_folder(tmp_path):
        for path in (own, own.parent, own.with_suffix(".lock"), tmp_path / ".lock"):
            assert path.stat().st_uid == 1234
