"""What holds of whatever is read or called: it works or is refused in a clear line, within limits and without other deeds."""

import os
import re
import resource
import signal
import sys
import tempfile
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from hypothesis import HealthCheck, settings

import birthsim_env.physics.compiled.with_numba  # noqa: F401 (loads LLVM, once a process)
from birthsim_env.physics.compiled import prebuilt
from birthsim_env.physics.compiled.kept import cache_folder
from tests.console import ROOT

SECONDS = 30.0
"""Of a processor, assumed: no example needs them, whatever else the machine does."""

MEMORY = 256 * 2**20
"""Bytes beyond those that the process had."""

LONGEST = 1000
"""Characters of an error that is still clear."""

SAYS_WHAT = r"allowed|cannot be read|is no TOML|\(at |line \d|unexpected keyword argument"

DEEDS = {
    *("os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty", "pty.spawn", "subprocess.Popen"),
    *("socket.connect", "socket.bind", "os.remove", "os.rename", "os.rmdir", "os.chmod", "os.symlink", "shutil.rmtree"),
    *("os.kill", "os.putenv", "ctypes.dlopen", "webbrowser.open", "code.__new__"),
}
"""Audit events that no reading of a file causes."""

CODE = (str(ROOT), sys.prefix, sys.base_prefix, "<frozen", "<string>", "<__array", "<traced ")
"""Where code that may run comes from; of the package itself what ``gradients.tracing`` makes, once a process."""

cases = settings(max_examples=settings.default.max_examples // 10, suppress_health_check=list(HealthCheck))
"""Examples of one kind: 10 in the profile ``quick``, 100 in ``slow``, 200 in ``weekly``, 5,000 in ``deep``."""


prebuilt._opened()  # once a process, whichever example would be the first


class TooSlow(BaseException):
    """An example has taken longer than ``SECONDS``."""


@dataclass
class Example:
    """``names``, of which a refusal has to say one, may be changed as the example goes on; ``refused`` is what was said."""

    folder: Path
    names: tuple[str, ...]
    runs_code: bool
    refused: str = ""
    deeds: list[str] = field(default_factory=list)


@contextmanager
def watched(*names, runs_code=False, memory=MEMORY):
    """One example, in a folder of its own: a clear ``ValueError`` or ``TypeError`` ends it, anything else fails the test.

    ``runs_code`` is true where a user's own code runs, which may do what it likes.
    """
    with tempfile.TemporaryDirectory(prefix="birthsim-fuzz-") as place:
        example, fault = Example(Path(place), names, runs_code), ""
        try:
            with _limits(memory), _listening(example):
                yield example
        except (ValueError, TypeError) as error:
            example.refused, fault = str(error), unclear(error, example.names)
        assert not fault, f"{fault}: {example.refused[:3000]}"
        assert not example.deeds, example.deeds


def unclear(error, names):
    """What an error lacks to be clear, or nothing."""
    text = str(error)
    if type(error) not in (ValueError, TypeError):
        return type(error).__name__
    if not 0 < len(text) <= LONGEST or "\n" in text:
        return "not a short line"
    if names and not any(name in text for name in names):
        return f"names none of {', '.join(names)}"
    return "" if re.search(SAYS_WHAT, text) else "does not say what is allowed"


def _late(*_):
    raise TooSlow


@contextmanager
def _limits(memory):
    """Of data: PyArrow reserves addresses that it never uses."""
    with open("/proc/self/statm", encoding="ascii") as statm:
        size = int(statm.read().split()[5]) * resource.getpagesize()
    before, handler = resource.getrlimit(resource.RLIMIT_DATA), signal.signal(signal.SIGPROF, _late)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    resource.setrlimit(resource.RLIMIT_DATA, (size + memory, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, handler)


_listener = []
"""The example that audit events are told to; the hook, which cannot be taken away again, stands beside it."""


@contextmanager
def _listening(example):
    if not _listener:
        _listener.append(None)
        sys.addaudithook(_heard)
    _listener[0] = example
    try:
        yield
    finally:
        _listener[0] = None


def _heard(event, arguments):
    if (example := _listener[0]) is not None and (deed := _deed(event, arguments, example)):
        example.deeds.append(deed)


def _deed(event, arguments, example):
    """What an audit event is that reading must not cause, or nothing."""
    if event == "open":
        path, mode, flags = arguments
        writes = bool(set("wax+") & set(mode)) if mode else bool((flags or 0) & (os.O_WRONLY | os.O_RDWR))
        return f"writing to {path!r}" if writes and not isinstance(path, int) and not _is_own(path, example) else ""
    if event == "exec" and not example.runs_code:
        source = getattr(arguments[0], "co_filename", "?")
        return "" if source.startswith(CODE) or "lib/python" in source else f"running {source!r}"
    if event not in DEEDS or example.runs_code:
        return ""
    return "" if event.startswith(("os.", "shutil.")) and arguments and _is_own(arguments[0], example) else event


def _is_own(path, example):
    """Whether a path is in the example's folder, or in a cache: of compiled kernels, or of modules that are imported late."""
    return "__pycache__" in str(path) or str(path).startswith((str(example.folder), os.devnull, str(cache_folder())))
