"""Runs cases in a forked process with limits on time, memory and deeds, and says of each how it ended.

A case is what a kind draws from its own random generator, so that a case is its kind, seed and number. It ends as:

- ``valid``: the object exists.
- ``refused``: a ``ValueError`` or ``TypeError`` in one line that names the argument or file and what is allowed.
- a failure: anything else that is raised, an error that is not clear, a case longer than ``SECONDS``, one that asks for
  ``MEMORY`` more than the process had, one that does what reading must not do, and the death of the process.
"""

import faulthandler
import json
import os
import re
import resource
import select
import shutil
import signal
import sys
import tempfile
import traceback
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

SECONDS = 10.0
MEMORY = 200 * 2**20
BATCH = 250
LONGEST = 1000
"""Characters of an error that is still clear."""

DEEDS = frozenset(
    {
        *("os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty", "pty.spawn", "subprocess.Popen"),
        *("socket.connect", "socket.bind", "os.remove", "os.rename", "os.rmdir", "os.chmod", "os.symlink", "shutil.rmtree"),
        *("os.kill", "os.putenv", "ctypes.dlopen", "webbrowser.open", "code.__new__"),
    }
)
"""Audit events that no reading of a file causes."""

ROOTS = (str(Path(__file__).resolve().parents[3]), sys.prefix, sys.base_prefix, "<frozen", "<string>", "<__array")
"""Where code that may run comes from."""


@dataclass(frozen=True)
class Kind:
    """What is fuzzed.

    ``prepare(folder)`` loads modules and valid examples once. ``attempt(prepared, rng, folder, case)`` draws a case, says in
    ``case`` what it is, and tries it. ``runs_code`` is true where a case is code of a user's own.
    """

    prepare: Callable[[Path], Any]
    attempt: Callable[[Any, np.random.Generator, Path, "Case"], None]
    runs_code: bool = False


@dataclass
class Case:
    """What a case is, for its report: ``names`` of which an error has to say one, and ``shown``, the case in words."""

    names: tuple[str, ...] = ()
    shown: str = ""


@dataclass
class Figures:
    """How cases of a kind ended; ``failures`` are (signature, number of the case, its words)."""

    tried: int = 0
    valid: int = 0
    refused: int = 0
    failures: list[tuple[str, int, str]] = field(default_factory=list)

    def signatures(self) -> list[tuple[str, int, int, str]]:
        """(signature, how many, the first case and its words), the most frequent first."""
        counts = Counter(signature for signature, _, _ in self.failures)
        first = {signature: (number, words) for signature, number, words in reversed(self.failures)}
        return [(signature, count, *first[signature]) for signature, count in counts.most_common()]


class TooSlowError(BaseException):
    """A case has taken longer than ``SECONDS``."""


def generator(kind: str, seed: int, number: int) -> np.random.Generator:
    """The random generator of a case."""
    return np.random.default_rng([zlib.crc32(kind.encode()), seed, number])


def fuzz(name: str, kind: Kind, cases: int, seed: int, start: int = 0) -> Iterator[Figures]:
    """Try ``cases`` cases from number ``start`` on; yields the figures so far, after every batch."""
    figures, number, last = Figures(), start, start + cases
    with tempfile.TemporaryDirectory(prefix="birthsim-fuzz-") as place:
        prepared = kind.prepare(_made(Path(place) / "valid"))
        while number < last:
            number = _batch(
                name, kind, prepared, (number, min(number + BATCH, last)), seed, _made(Path(place) / "case"), figures
            )
            yield figures


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _batch(name: str, kind: Kind, prepared: Any, numbers: tuple[int, int], seed: int, folder: Path, figures: Figures) -> int:
    """Run a batch in a child; returns the number of the case after the last that has ended."""
    reading, writing = os.pipe()
    sys.stdout.flush(), sys.stderr.flush()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _work(name, kind, prepared, numbers, seed, folder, writing)
    os.close(writing)
    done, ended = numbers[0], False
    with os.fdopen(reading, "rb") as pipe:
        while not ended and select.select([pipe], [], [], 6 * SECONDS)[0]:
            line = pipe.readline()
            ended = not line
            if line:
                verdict, words = json.loads(line)
                _count(figures, verdict, words, done)
                done += 1
    if not ended:
        os.kill(child, signal.SIGKILL)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if done < numbers[1]:
        _count(figures, "hang" if not ended else f"the process ends with {status}", "", done)
        done += 1
    return done


def _count(figures: Figures, verdict: str, words: str, number: int) -> None:
    figures.tried += 1
    figures.valid += verdict == "valid"
    figures.refused += verdict == "refused"
    if verdict not in ("valid", "refused"):
        figures.failures.append((verdict, number, words))


def _work(name: str, kind: Kind, prepared: Any, numbers: tuple[int, int], seed: int, folder: Path, writing: int) -> NoReturn:
    """The child: cases one by one, a line of JSON each."""
    deeds: list[str] = []
    watched = [False]

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if watched[0]:
            deed = _deed(event, arguments, str(folder), kind.runs_code)
            if deed:
                deeds.append(deed)

    def late(*_: object) -> NoReturn:
        raise TooSlowError

    sys.addaudithook(watch)
    signal.signal(signal.SIGALRM, late)
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1), os.dup2(silent, 2)
    faulthandler.disable()  # pytest's writes past them
    with open("/proc/self/statm", encoding="ascii") as statm:
        size = int(statm.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, resource.RLIM_INFINITY))
    for number in range(*numbers):
        for leftover in folder.iterdir():
            shutil.rmtree(leftover) if leftover.is_dir() else leftover.unlink()
        case = Case()
        deeds.clear()
        signal.setitimer(signal.ITIMER_REAL, SECONDS)
        watched[0] = True
        verdict = _verdict(kind, prepared, generator(name, seed, number), folder, case)
        watched[0] = False
        signal.setitimer(signal.ITIMER_REAL, 0)
        if deeds:
            verdict = (f"does {deeds[0]}", case.shown)
        os.write(writing, json.dumps([text[:3000] for text in verdict]).encode() + b"\n")
    os._exit(0)


def _verdict(kind: Kind, prepared: Any, rng: np.random.Generator, folder: Path, case: Case) -> tuple[str, str]:
    try:
        kind.attempt(prepared, rng, folder, case)
        return "valid", ""
    except (ValueError, TypeError) as error:
        fault = unclear(error, case.names)
        return ("refused", "") if not fault else (f"{fault}: {_place(error)}", f"{error}\n{case.shown}")
    except BaseException as error:
        return f"{type(error).__name__}: {_place(error)}", f"{error}\n{case.shown}"


def unclear(error: BaseException, names: tuple[str, ...]) -> str:
    """What an error lacks to be clear, or nothing."""
    text = str(error)
    if type(error) not in (ValueError, TypeError):
        return type(error).__name__
    if not 0 < len(text) <= LONGEST or "\n" in text:
        return "not a short line"
    if names and not any(name in text for name in names):
        return "names neither argument nor file"
    return (
        ""
        if re.search(r"allowed|cannot be read|is no TOML|\(at |line \d|unexpected keyword argument", text)
        else "does not say what is allowed"
    )


def _place(error: BaseException) -> str:
    """The last line of ours on the way to an error."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename.startswith(ROOTS[0]) and "/studies/fuzz/" not in frame.filename]
    frame = (own or frames)[-1]
    return f"{Path(frame.filename).name}:{frame.lineno} {frame.name}"


def _is_ours(path: Any, folder: str) -> bool:
    """Whether a path is in the folder of the case, or in the cache of compiled kernels."""
    return str(path).startswith((folder, os.devnull)) or "birthsim" in str(path)


def _deed(event: str, arguments: tuple[Any, ...], folder: str, runs_code: bool) -> str:
    """What an audit event is that reading must not cause, or nothing."""
    if event == "open":
        path, mode, flags = arguments
        writes = (isinstance(mode, str) and any(letter in mode for letter in "wax+")) or (
            mode is None and isinstance(flags, int) and flags & (os.O_WRONLY | os.O_RDWR)
        )
        return "" if not writes or isinstance(path, int) or _is_ours(path, folder) else f"writing to {path!r}"
    if event == "exec" and not runs_code:
        source = getattr(arguments[0], "co_filename", "?")
        return "" if source.startswith(ROOTS) or "lib/python" in source else f"running {source!r}"
    if event not in DEEDS or runs_code:
        return ""
    return "" if event.startswith(("os.", "shutil.")) and arguments and _is_ours(arguments[0], folder) else event
