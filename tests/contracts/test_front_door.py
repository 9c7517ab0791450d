"""``import birthsim``: it is quick, every name is typed and documented, and the examples of the documentation run."""

import doctest
import inspect
import os
import pkgutil
import subprocess
import sys
import typing

import pytest

import birthsim
from birthsim_env import registry
from tests.build.targets import need_linker
from tests.console import ROOT

NAMES = birthsim.__all__
EXAMPLES = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def signature(thing):
    """The parameters that a caller may give; those of a protocol and of what gives rows of a name are none."""
    if inspect.isclass(thing) and (getattr(thing, "_is_protocol", False) or "__init__" not in vars_of(thing)):
        return []
    return list(inspect.signature(thing).parameters)


def vars_of(kind):
    return {name for one in kind.__mro__[:-1] for name in vars(one)}


@pytest.fixture(scope="module")
def docstrings(generated):
    return generated(".docstrings")


@pytest.mark.parametrize("name", NAMES)
def test_a_name_says_what_it_takes_and_gives(name, docstrings):
    thing = getattr(birthsim, name)
    summary, sections = docstrings.read(thing)
    assert summary.partition("\n\n")[0].endswith(".")
    documented = docstrings.documented(sections.get("Parameters", ""))
    assert [one for one in signature(thing) if one not in documented] == []
    assert [one for one in documented if one not in signature(thing)] == []
    assert ("Returns" in sections) == inspect.isfunction(thing)
    assert ">>> " in sections["Examples"]
    empty = [title for title, body in sections.items() if not body.strip()]
    assert empty == []


@pytest.fixture
def registered():
    """What an example registers is gone after it."""
    known = {kind: set(registry.names(kind)) for kind in ("controller", "policy")}
    yield
    for kind, names in known.items():
        for name in set(registry.names(kind)) - names:
            del registry._ENTRIES[kind][name]


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.weekly if name == "identify" else ()) for name in NAMES])
def test_an_example_runs(name, tmp_path, monkeypatch):
    if name == "export":
        need_linker()
    monkeypatch.chdir(tmp_path)
    thing = getattr(birthsim, name)
    (test,) = [one for one in doctest.DocTestFinder(recurse=False).find(thing, name, globs={}) if one.examples]
    runner, said = doctest.DocTestRunner(optionflags=EXAMPLES), []
    runner.run(test, out=said.append)
    assert runner.failures == 0, "".join(said)


def test_a_type_checker_knows_every_name_where_it_is(monkeypatch):
    """What is imported for type checkers is what is imported when a name is used."""
    seen = {}
    monkeypatch.setattr(typing, "TYPE_CHECKING", True)
    source = (ROOT / "birthsim" / "__init__.py").read_text(encoding="utf-8")
    exec(compile(source, "birthsim", "exec"), seen | {"__name__": "birthsim"}, seen)
    assert {name: seen[name] for name in NAMES} == {name: getattr(birthsim, name) for name in NAMES}


def test_no_name_is_that_of_a_module():
    """Whoever imports the module would find it under the name from then on."""
    assert set(NAMES) & {module.name for module in pkgutil.iter_modules(birthsim.__path__)} == set()


def test_it_is_imported_at_once():
    script = "import sys, birthsim; print(*sorted(name for name in sys.modules if name.partition('.')[0] in sys.argv[1:]))"
    heavy = ["numpy", "gymnasium", "numba", "birthsim_env", "baselines", "agents", "torch"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", script, *heavy], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_a_name_that_there_is_not_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"birthsim.*nothing_of_the_kind"):
        _ = birthsim.nothing_of_the_kind
    assert set(NAMES) <= set(dir(birthsim))
