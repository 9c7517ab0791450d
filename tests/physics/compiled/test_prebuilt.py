"""Prebuilt code serves what it was built from; Numba serves the rest: edits, other arguments, and where there is none.

Two modules of a user's stand in a folder of their own, with a library that is built of their kernels.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from birthsim_env.physics.compiled import prebuilt
from birthsim_env.physics.compiled.compilation import kernel

ROOT = Path(__file__).parents[3]

FIRST = """
import numpy as np
from birthsim_env.physics.compiled.compilation import helper, kernel

@helper
def weighed(x):
    return 2.0 * x

@kernel
def total(values):
    found = 0.0
    for i in range(values.shape[0]):
        found += weighed(values[i])
    return found

@kernel
def added(first, second):
    return first + second
"""

SECOND = """
import numpy as np
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.records import Rows, row

class Pair(Rows):
    near = row("m", "one")
    far = row("m", "the other")

@kernel
def exchanged(pair, scale, negative, found):
    for i in range(found.shape[1]):
        found[0, i] = -scale * pair.far[i] if negative else scale * pair.far[i]
        found[1, i] = pair.near[i]

@kernel
def room(count):
    return float(np.empty(count).shape[0])
"""

KERNELS = {
    "first.total": ("d1C",), "first.added": ("i", "i"), "second.room": ("i",),
    "second.exchanged": ("second.Pair:d2C", "d", "b", "d2C"),
}  # fmt: skip

BUILD = """
import json, sys
from importlib import import_module
from pathlib import Path
from birthsim_build.kernels.building import made, write
from birthsim_build.kernels.wanted import Wanted
from birthsim_env.physics.compiled.prebuilt import target
folder, kernels = Path(sys.argv[1]), json.loads(sys.argv[2])
wanted = []
for name, kinds in kernels.items():
    module, _, own = name.partition(".")
    wanted.append(Wanted(getattr(import_module(module), own), tuple(kinds)))
write(folder, made(wanted, [target()], folder.parent / "work"), [target()])
"""

HEAD = """
import json, sys
from pathlib import Path
import numpy as np
from birthsim_env.physics.compiled import prebuilt
prebuilt.FOLDER = Path(sys.argv[1])
import first, second
"""

RUN = f"""{HEAD}
pair, found = second.Pair(np.array([[1.0, 2.0], [3.0, 4.0]])), np.zeros((2, 2))
returned = second.exchanged(pair, 10.0, True, found)
said = [first.total(np.arange(4.0)), first.added(2, 3), second.room(5), returned, found.tolist()]
served = [bool(prebuilt.found(one, kinds.split())[0]) for one, kinds in ((first.total, "d1C"), (second.room, "i"))]
print(json.dumps([said, served, "numba" in sys.modules, "scipy" in sys.modules]))
"""

SAID = [12.0, 5, 5.0, None, [[-30.0, -40.0], [1.0, 2.0]]]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder of the two modules, and in it ``prebuilt``."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "first.py").write_text(FIRST)
    (folder / "second.py").write_text(SECOND)
    (folder / "prebuilt").mkdir()
    run(folder, BUILD, json.dumps(KERNELS), BIRTHSIM_PREBUILT="0")
    return folder


@pytest.fixture
def own(built, tmp_path):
    """A copy of it, for edits."""
    return Path(shutil.copytree(built, tmp_path / "own"))


@pytest.fixture
def looked_for(monkeypatch):
    """Prebuilt code is looked for, whatever the environment says."""
    monkeypatch.setattr(prebuilt, "USED", True)


def run(folder, program, *arguments, **environment):
    """What a program says in a process that finds the two modules first."""
    paths = os.pathsep.join((str(folder), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])))
    line = [sys.executable, "-c", program, str(folder / "prebuilt"), *arguments]
    own = {"PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(folder / "kept"), "BIRTHSIM_PREBUILT": "1"}
    environment = {**os.environ, **own, **environment}
    done = subprocess.run(line, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout and json.loads(done.stdout)


def test_what_was_built_is_served_without_numba(built):
    assert run(built, RUN) == [SAID, [True, True], False, False]


def test_after_an_edit_the_file_that_was_edited_is_compiled_alone(own):
    (own / "first.py").write_text(FIRST.replace("2.0 * x", "3.0 * x"))
    assert run(own, RUN) == [[18.0, *SAID[1:]], [False, True], True, True]
    (own / "first.py").write_text(f"# A comment.\n{FIRST}")
    assert run(own, RUN) == [SAID, [True, True], False, False], "prose compiles nothing"


def test_switched_off_everything_is_compiled(built):
    assert run(built, RUN, BIRTHSIM_PREBUILT="0") == [SAID, [False, False], True, True]


def test_a_word_that_says_neither_is_refused():
    environment = {**os.environ, "BIRTHSIM_PREBUILT": "no", "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", "import birthsim_env"], env=environment, capture_output=True, text=True)
    assert done.returncode == 1
    assert "BIRTHSIM_PREBUILT = 'no'; allowed: 1" in done.stderr.splitlines()[-1]


OTHERS = f"""{HEAD}
numbers = np.arange(8.0)
said = [first.total(one) for one in (numbers[::2], numbers.astype(np.float32), np.arange(3))]
locked = numbers.copy()
locked.flags.writeable = False
said += [first.total(values=numbers), first.total(locked), first.added(1.5, 2), first.added(second=1, first=2)]
refused = []
foreign = numbers.astype(">f8")
for call in (lambda: second.room(2**55), lambda: first.total(1.0), lambda: first.total(), lambda: first.total(foreign)):
    try:
        call()
    except Exception as error:
        refused.append(type(error).__name__)
print(json.dumps([said, refused]))
"""


def test_arguments_of_other_kinds_go_to_numba(built):
    said, refused = run(built, OTHERS)
    assert said == [24.0, 56.0, 6.0, 56.0, 56.0, 3.5, 3]
    assert refused == ["MemoryError", "TypingError", "TypeError", "TypingError"]


TOGETHER = f"""{HEAD}
import os
from concurrent.futures import ThreadPoolExecutor
with ThreadPoolExecutor(8) as pool:
    said = list(pool.map(lambda k: first.total(np.full(1000, float(k))), range(64)))
child = os.fork()
if child == 0:
    os._exit(first.total(np.ones(3)) == 6.0 and "numba" not in sys.modules)
print(json.dumps([said == [2000.0 * k for k in range(64)], os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])]))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="asks for fork")
def test_threads_and_children_are_served(built):
    assert run(built, TOGETHER) == [True, 1]


def opened():
    library, kernels = prebuilt._opened.__wrapped__()
    assert (library is None) == (not kernels)
    return library is not None


def other_processor(content):
    """An ELF file for another machine: word 18 of its head says which."""
    return content[:18] + (b"\xb7" if content[18:19] != b"\xb7" else b"\x3e") + content[19:]


DAMAGES = {
    "damaged": (lambda content: content[:-1] + bytes([content[-1] ^ 1]), False),
    "cut": (lambda content: content[: len(content) // 2], False),
    "no library": (lambda _: b"", True),
    "another processor's": (other_processor, True),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.usefixtures("looked_for")
def test_a_library_that_is_no_good_is_not_opened(own, monkeypatch, damage):
    monkeypatch.setattr(prebuilt, "FOLDER", own / "prebuilt")
    change, signed = DAMAGES[damage]
    place, index = own / "prebuilt" / prebuilt.target(), own / "prebuilt" / "index.json"
    content = change(place.read_bytes())
    place.write_bytes(content)
    if signed:
        said = json.loads(index.read_text())
        said["libraries"][place.name] = hashlib.sha256(content).hexdigest()
        index.write_text(json.dumps(said))
    assert not opened()


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"format": 1}', '{"format": 0, "libraries": {}, "kernels": {}}'])
@pytest.mark.usefixtures("looked_for")
def test_an_index_that_is_no_good_opens_nothing(own, monkeypatch, content):
    monkeypatch.setattr(prebuilt, "FOLDER", own / "prebuilt")
    (own / "prebuilt" / "index.json").write_text(content)
    assert not opened()


@pytest.mark.usefixtures("looked_for")
def test_nothing_is_opened_for_other_blocks_or_processors_or_where_it_is_missing(own, monkeypatch):
    monkeypatch.setattr(prebuilt, "FOLDER", own / "prebuilt")
    for name, value in (
        ("BLOCK", 16),
        ("USED", False),
        ("_arrays_are_as_known", lambda: False),
        ("target", lambda: "riscv64.so"),
    ):
        with monkeypatch.context() as other:
            other.setattr(prebuilt, name, value)
            assert not opened()
    for name in (prebuilt.target(), "index.json"):
        with monkeypatch.context() as other:
            other.setattr(prebuilt, "FOLDER", own / name)
            assert not opened()
    assert opened()


def test_an_older_processor_has_no_library(monkeypatch):
    assert prebuilt.target().partition(".")[0] in ("x86-64-v3", "x86-64-v4", "aarch64")
    monkeypatch.setattr(prebuilt.platform, "machine", lambda: "x86_64")
    known = dict.fromkeys(("AVX2", "FMA3", "F16C"), True)
    monkeypatch.setattr(prebuilt, "_features", lambda: {**known, "AVX512_SKX": True})
    assert prebuilt.target().startswith("x86-64-v4.")
    monkeypatch.setattr(prebuilt, "_features", lambda: known)
    assert prebuilt.target().startswith("x86-64-v3.")
    for name in known:
        monkeypatch.setattr(prebuilt, "_features", lambda name=name: {**known, name: False})
        assert prebuilt.target() == ""
    monkeypatch.setattr(prebuilt.platform, "machine", lambda: "riscv64")
    assert prebuilt.target() == ""


@kernel
def doubled(x):
    return 2.0 * x


def test_kinds_say_what_numba_would_tell_apart():
    square = np.zeros((3, 3))
    kinds = [
        prebuilt.kind_of(one) for one in (square, square.T[:, 1:], square[::2], np.float64(1), 1, True, np.uint64(1), "1", 1j)
    ]
    assert [prebuilt.code_of(kind) for kind in kinds] == ["d2C", "d2F", "d2A", "d", "i", "b", "u", "?", "?"]
    assert prebuilt.key_of(doubled, ["d"]) == f"{__name__}.doubled d"
    assert prebuilt.symbol_of("a") != prebuilt.symbol_of("b")
