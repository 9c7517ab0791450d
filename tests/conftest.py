"""What several tests share: property tests that repeat themselves and may take their time, a short training, a last word."""

import inspect
import os
import signal
import tomllib
from collections import Counter
from importlib import import_module

# LAPACK's threads wait for each other longer than the small matrices here take; NumPy reads this when it is imported. PyTorch's
# wait with the processor in their hands: on a busy machine that takes ten times as long.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import gymnasium
import pytest
from hypothesis import settings
from hypothesis.internal.conjecture.providers import Constants, HypothesisProvider

from birthsim_env.physics.compiled.plain import plain
from tests.console import ROOT, run
from tests.live import browser

# Files that are copied into a tree of their own.
collect_ignore = ["project/recipes"]

# A process that a script starts in the background ignores Ctrl-C; tests that raise it need it.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Hypothesis also draws literals of all packages that a process happens to have imported: any commit would make other examples.
HypothesisProvider._local_constants = Constants()

# The same examples every time, and as long as a busy machine needs; make test-slow tries more, make test-weekly twice as many,
# make fuzz others, mutants few.
settings.register_profile("quick", deadline=None, derandomize=True, database=None)
settings.register_profile("deep", settings.get_profile("quick"), derandomize=False, max_examples=50_000)
settings.register_profile("slow", settings.get_profile("quick"), max_examples=1000)
settings.register_profile("weekly", settings.get_profile("quick"), max_examples=2000)
settings.register_profile("brief", settings.get_profile("quick"), max_examples=5)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "quick"))
MUTANTS = os.environ.get("HYPOTHESIS_PROFILE") == "brief"

SMALL = """[training]
environment = "BirthSIM/ProbeResidual-v3"
lanes = 32
rollout = 32
batch = 64
epochs = 4
learning_rate = 2e-3
hidden = [32, 32]
validation_lanes = 4
validations = 2
[residual]
policy_period = 0.04
"""


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    """A configuration whose trainings take seconds."""
    path = tmp_path_factory.mktemp("configurations") / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="session")
def trained(tmp_path_factory, small):
    """A folder of birthsim train, and the process that made it. With this seed so few steps do better than the controller."""
    folder = tmp_path_factory.mktemp("policies") / "deeper" / "policy"
    return folder, run("train", "--config", small, "--steps", 4096, "--seed", 12, "--authority", 60, "--out", folder)


@pytest.fixture(scope="session")
def generated():
    """A module of docs/_generate, by its name with a dot before it."""

    def module(name):
        with pytest.MonkeyPatch.context() as patch:
            patch.syspath_prepend(ROOT / "docs")
            return import_module(f"_generate{name}")

    return module


@pytest.fixture(scope="session")
def chromium():
    """A browser for all tests of a worker, as a second one beside it would not start; without one, CI fails and others skip."""
    if lack := browser.missing():
        pytest.fail(f"CI=true, and {lack}") if os.environ.get("CI") == "true" else pytest.skip(lack)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, browser.launch(playwright) as opened:
        yield opened


@pytest.fixture
def brief(monkeypatch):
    """Evaluated episodes of 7 s, which have their first push."""
    make_vec = gymnasium.make_vec
    monkeypatch.setattr(gymnasium, "make_vec", lambda *args, **options: make_vec(*args, duration=7.0, **options))


def pytest_sessionstart():
    """Kernels of files that mutmut changes have lost their decorator: they are made plain, as those of other files are."""
    if MUTANTS:
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
        for path in project["tool"]["mutmut"]["only_mutate"]:
            module = import_module(path.removesuffix(".py").replace("/", "."))
            for _, function in inspect.getmembers(module, inspect.isfunction):
                if function.__module__ == module.__name__:
                    function.py_func = inspect.unwrap(function)
                    plain(function.py_func)


@pytest.fixture(autouse=MUTANTS)
def quick_enough_for_mutants():
    """Uncompiled some tests take minutes: mutmut goes on without those that take 3 s."""

    def skip(*_):
        pytest.skip("takes long uncompiled")

    before = signal.signal(signal.SIGPROF, skip)
    signal.setitimer(signal.ITIMER_PROF, 3.0)
    yield
    signal.setitimer(signal.ITIMER_PROF, 0)
    signal.signal(signal.SIGPROF, before)


def pytest_terminal_summary(terminalreporter):
    """Seconds of the workers, by folder."""
    folders = Counter()
    for reports in terminalreporter.stats.values():
        for report in reports:
            if hasattr(report, "duration"):
                folders[report.nodeid.split("/")[1]] += report.duration
    if sum(folders.values()) > 60.0:
        each = (f"{folder} {seconds:.0f}" for folder, seconds in folders.most_common())
        terminalreporter.write_line(f"s by folder: {', '.join(each)}; all {sum(folders.values()):.0f}")


def pytest_itemcollected(item):
    if item.nodeid.startswith("tests/fuzz/"):
        item.add_marker("fuzz")
    if item.get_closest_marker("weekly"):
        item.add_marker("slow")


TOGETHER = {
    "browser": ("tests/live/page/", "tests/project/test_docs.py"),
    "device": ("tests/build/test_beginning.py", "tests/build/test_device.py"),
}
"""Modules that one worker runs one after the other, because they share what takes long to make."""

LONG = 25.0
"""What a test that is marked slow takes, in times of one that is not, assumed."""


def _scope(nodeid):
    """What one worker runs: its module, all tests in a browser, or all on a device, whose code is compiled once."""
    path = nodeid.partition("::")[0]
    return next((name for name, places in TOGETHER.items() if path.startswith(places)), path)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config, items):
    """Of several workers none shall wait at the end for another's long module: the longest come first."""
    if hasattr(config, "workerinput"):
        takes = Counter()
        for item in items:
            takes[_scope(item.nodeid)] += LONG if item.get_closest_marker("slow") else 1.0
        items.sort(key=lambda item: -takes[_scope(item.nodeid)])


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """One worker has the browser, and each module one worker: what its tests share is made once."""
    from xdist.scheduler import LoadScopeScheduling

    class Grouped(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            return _scope(nodeid)

    if config.getvalue("dist") != "load":
        return None
    config.option.loadscopereorder = False  # as collected
    return Grouped(config, log)


def pytest_unconfigure(config):
    """After everything else pytest says whether the page was tested: a skip among thousands of dots is not seen."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    skipped = reporter.stats.get("skipped", []) if reporter else []
    reasons = [report.longrepr[2] for report in skipped if report.nodeid.startswith("tests/live/page/")]
    if reasons:
        said = reasons[0].removeprefix("Skipped: ")
        reporter.write_line(f"THE PAGE WAS NOT TESTED, {len(reasons)} tests were skipped: {said}", red=True, bold=True)
